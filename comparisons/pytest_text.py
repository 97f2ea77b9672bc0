"""What a failed test says about its check, and what it leaves in pytest's own JUnit XML."""

import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path

from comparisons.gate import CriterionResult, Verdict
from comparisons.report.pixel import pixel_text
from comparisons.result import CheckResult
from comparisons.summary import numbers_of
from scenes.paths import shown_path

PICTURES = {"realtime": "real-time", "truth": "truth", "error": "error"}
"""The pictures of a check that are worth a look, and what they are called."""

COLUMN = 14
"""Where texts begin, behind what they are called."""

Property = tuple[str, object]


def failure_text(result: CheckResult, report: Path, again: Sequence[str]) -> str:
    """Everything that is needed to act on a check that did not pass; the first line says what is wrong.

    Parameters
    ----------
    report : the folder that the pictures of the result are in.
    again : commands that run the check again.
    """
    rows = _rows(result, report, again)
    return "\n".join([_headline(result), *(f"{what:{COLUMN}}{said}" for what, said in rows)])


def _headline(result: CheckResult) -> str:
    deciding = [c for c in result.criteria if c.verdict is result.verdict]
    return f"{result.verdict} {numbers_of(deciding[0], result.unit) if deciding else result.message}"


def _rows(result: CheckResult, report: Path, again: Sequence[str]) -> Iterator[tuple[str, str]]:
    """What is told, and how it is called."""
    yield "check", f"{result.id}: {result.scene_title}"
    for c in result.criteria:
        yield c.verdict, numbers_of(c, result.unit)
        yield "", _origin(c)
    if result.criteria:
        yield from (("", line) for line in result.message.splitlines())
    if result.worst is not None:
        yield "worst pixel", pixel_text(result.worst, result.unit)
    for name, called in PICTURES.items():
        if name in result.images:
            yield called, shown_path(report / result.images[name])
    yield "report", f"{shown_path(report / 'index.html')}, written at the end of the session"
    for command in again:
        yield "again", command


def _origin(c: CriterionResult) -> str:
    """Where a budget is written and why it is so."""
    where = f'{c.place}, for "{c.renderer}"' if c.renderer else c.place
    return f"{where}: {c.reason}{f'; {c.note}' if c.note else ''}"


def lightgauge_command(result: CheckResult, store: Path) -> str:
    """The command line that runs a check of a scene again, with the same truth."""
    has_usual_store = store.resolve() == Path(".lightgauge").resolve()
    return result.rerun + ("" if has_usual_store else f" --store {shlex.quote(shown_path(store))}")


def properties_of(result: CheckResult) -> Iterator[Property]:
    """The numbers of a check, by names such as `tiny/indirect.talk/nrmse/high`; without bounds that it lacks."""
    yield f"{result.id}/verdict", str(result.verdict)
    for c in result.criteria:
        numbers = {"value": c.value, "low": c.low, "high": c.high, "min": c.min, "max": c.max}
        yield from ((f"{result.id}/{c.metric}/{name}", float(x)) for name, x in numbers.items() if x is not None)


def counts_of(results: Sequence[CheckResult]) -> str:
    """How many checks have which verdict: 3 PASS, 1 FAIL."""
    return ", ".join(f"{n} {v}" for v in Verdict if (n := sum(r.verdict is v for r in results)))
