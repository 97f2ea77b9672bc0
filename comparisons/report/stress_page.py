"""The page of a stress: who breaks where, and for each break its trials and how to see it again."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from comparisons.report.page import TEMPLATES, jinja_environment, write_files
from comparisons.stress.limits import Standing, standing
from comparisons.stress.result import Outcome, Trial
from comparisons.stress.tables import Table, cell, tables

VERDICTS = {
    Standing.HOLDS: "PASS",
    Standing.KNOWN: "INCONCLUSIVE",
    Standing.BROKEN: "FAIL",
    Standing.STALE: "REGRESSED",
    Standing.UNFIT: "",
}
"""The colours of the report in which standings are shown."""


@dataclass(frozen=True)
class Break:
    """A break, as the page shows it."""

    outcome: Outcome
    name: str
    verdict: str
    standing: str

    @property
    def trials(self) -> tuple[Trial, ...]:
        return self.outcome.trials


def write_stress_page(folder: Path, outcomes: Iterable[Outcome], content: Mapping[str, Any]) -> Path:
    """Write `index.html` and `assets/style.css`; `content` is that of stress.json. Returns the page.

    Raises
    ------
    InputError
        The files cannot be written.
    """
    found = list(outcomes)
    return write_files(folder, _files(found, content))


def _files(outcomes: list[Outcome], content: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "assets/style.css", (TEMPLATES / "style.css").read_text(encoding="utf-8")
    counts = {kind: sum(standing(outcome) is kind for outcome in outcomes) for kind in Standing}
    page = jinja_environment().get_template("stress.html")
    yield (
        "index.html",
        page.render(
            content=content,
            sentence=sentence(counts),
            verdict="FAIL" if counts[Standing.BROKEN] else "PASS",
            tables=[_shown(table) for table in tables(outcomes)],
            breaks=sorted(map(_break, filter(_is_shown, outcomes)), key=lambda shown: shown.verdict != "FAIL"),
        ),
    )


def sentence(counts: Mapping[Standing, int]) -> str:
    """The outcome of all in one line."""
    tried = sum(count for kind, count in counts.items() if kind is not Standing.UNFIT)
    broken, known = counts[Standing.BROKEN], counts[Standing.KNOWN]
    return (
        f"{broken} of {tried} break where no limit is documented, {known} break at their documented limit, "
        f"{tried - broken - known} hold"
    )


def _is_shown(outcome: Outcome) -> bool:
    return standing(outcome) in (Standing.BROKEN, Standing.KNOWN, Standing.STALE)


def _break(outcome: Outcome) -> Break:
    kind = standing(outcome)
    return Break(outcome, f"{outcome.subject}-{outcome.stress}", VERDICTS[kind], kind.value)


def _shown(table: Table) -> dict[str, Any]:
    """Rows of cells: text, colour, what the pointer tells, and the anchor of the break."""
    return {"stresses": table.stresses, "rows": [(name, _row(table, name)) for name in table.subjects]}


def _row(table: Table, subject: str) -> list[dict[str, str]]:
    found = (table.cells.get((subject, stress)) for stress in table.stresses)
    return [_cell(outcome) if outcome else {"text": "", "verdict": "", "title": "", "to": ""} for outcome in found]


def _cell(outcome: Outcome) -> dict[str, str]:
    kind = standing(outcome)
    return {
        "text": cell(outcome),
        "verdict": VERDICTS[kind],
        "title": outcome.unfit or kind.value,
        "to": f"#{outcome.subject}-{outcome.stress}" if _is_shown(outcome) else "",
    }
