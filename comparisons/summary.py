"""Lines of text about results."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import indent

from comparisons.baseline import notes_on
from comparisons.gate import CriterionResult, Verdict
from comparisons.report.numbers import format_bound, format_count, format_interval, format_metric
from comparisons.result import CheckResult
from comparisons.selection import Broken


def line_of(result: CheckResult) -> str:
    """Verdict, check, its first criterion that has this verdict, and where it comes from."""
    deciding = [c for c in result.criteria if c.verdict is result.verdict]
    numbers = numbers_of(deciding[0], result.unit) if deciding else " ".join(result.message.split())
    origin = " (stored)" if result.cached else ""
    return f"{result.verdict:12} {result.id}  {numbers}{origin}"


def numbers_of(c: CriterionResult, unit: str) -> str:
    """A metric, its value with interval, and its budget; `unit` is that of the quantity."""
    value = format_metric(c.metric, c.value, unit)
    budget = format_bound(c.metric, c.min, c.max, unit)
    return f"{c.metric} {value} {format_interval(c.metric, c.low, c.high)}, budget {budget}"


def closing_lines(
    results: Sequence[CheckResult],
    notes: Sequence[str],
    page: Path,
    seconds: float,
    broken: Sequence[Broken] = (),
    processes: int = 1,
) -> Iterator[str]:
    """What a reader needs last: repairs, everything that is not fine with its reason, counts, the page."""
    yield from notes
    said: set[str] = set()
    for result in results:
        if result.verdict is not Verdict.PASS:
            yield f"{result.verdict} {result.id}"
            for c in result.criteria:
                if c.verdict is not Verdict.PASS:
                    yield f"  {numbers_of(c, result.unit)} ({c.reason}){'; ' + c.note if c.note else ''}"
            if result.message:
                yield "  (for the same reason)" if result.message in said else indent(result.message, "  ")
                said.add(result.message)
            yield f"  again: {result.rerun}"
    yield from broken_lines(broken)
    yield from notes_on(results)
    yield from _saving(results)
    if processes > 1:
        yield f"{processes} processes shared this machine: times of techniques are those of a busy one."
    counts = [f"{n} {v}" for v in Verdict if (n := sum(r.verdict is v for r in results))]
    counts += [f"{len(broken)} broken scene{'s' if len(broken) > 1 else ''}"] if broken else []
    yield f"{', '.join(counts)} in {seconds:.1f} s. Report: {page}"


def broken_lines(broken: Sequence[Broken]) -> Iterator[str]:
    """Scenes that could not be run, and why."""
    for scene in broken:
        yield f"BROKEN {scene.argument}"
        yield indent(scene.message, "  ")


def _saving(results: Sequence[CheckResult]) -> Iterator[str]:
    """Samples that sequential verdicts spared. Checks of one truth share it: the most that any of them took counts."""
    spent: dict[tuple[str, str], tuple[int, int]] = {}
    for r in results:
        if r.spp and r.verdict in (Verdict.PASS, Verdict.FAIL, Verdict.REGRESSED):
            used, fixed = spent.get((r.scene, r.quantity), (0, 0))
            spent[r.scene, r.quantity] = max(used, r.spp), max(fixed, r.spp_fixed)
    if spent:
        used, fixed = (sum(column) for column in zip(*spent.values(), strict=True))
        truths = f"{len(spent)} truth{'s' if len(spent) > 1 else ''}"
        yield (
            f"Verdicts took {format_count(used)} samples a pixel over {truths}; "
            f"references of a fixed size, as certain, take {format_count(fixed)}: {fixed / used:.1f} times as many."
        )
