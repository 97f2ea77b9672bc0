"""Outcomes as tables: who breaks where."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from comparisons.stress.limits import Standing, standing
from comparisons.stress.result import Outcome

WIDTH = 120
"""Characters of a line of a table."""


def cell(outcome: Outcome) -> str:
    """An outcome in the table."""
    mark = {Standing.BROKEN: "*", Standing.STALE: "+"}.get(standing(outcome), "")
    if outcome.unfit and not outcome.trials:
        return "n/a"
    if outcome.first_failing is not None:
        return f"{outcome.first_failing:g}{mark}"
    return (f"({outcome.trials[-1].magnitude:g})" if outcome.unfit else "-") + mark


@dataclass(frozen=True)
class Table:
    """Subjects that were put under the same stresses: `cells` by both names."""

    stresses: tuple[str, ...]
    subjects: tuple[str, ...]
    cells: dict[tuple[str, str], Outcome]


def tables(outcomes: Iterable[Outcome]) -> list[Table]:
    """Outcomes by the kind of their subjects: techniques, then functions."""
    kinds: dict[bool, dict[tuple[str, str], Outcome]] = {}
    for outcome in outcomes:
        kinds.setdefault(":" in outcome.subject, {})[outcome.subject, outcome.stress] = outcome
    return [
        Table(tuple(dict.fromkeys(s for _, s in cells)), tuple(dict.fromkeys(s for s, _ in cells)), cells)
        for _, cells in sorted(kinds.items())
    ]


def table_lines(table: Table, width: int = WIDTH) -> Iterator[str]:
    """A table as text, in blocks of as many columns as fit."""
    first = max(map(len, table.subjects))
    columns = {
        stress: max(len(stress), *(len(_cell(table, subject, stress)) for subject in table.subjects))
        for stress in table.stresses
    }
    for number, block in enumerate(_blocks(columns, width - first)):
        if number:
            yield ""
        yield "  ".join([" " * first, *(f"{stress:>{columns[stress]}}" for stress in block)])
        for subject in table.subjects:
            cells = (f"{_cell(table, subject, stress):>{columns[stress]}}" for stress in block)
            yield "  ".join([f"{subject:{first}}", *cells])


def _cell(table: Table, subject: str, stress: str) -> str:
    outcome = table.cells.get((subject, stress))
    return "" if outcome is None else cell(outcome)


def _blocks(columns: dict[str, int], width: int) -> list[list[str]]:
    blocks: list[list[str]] = [[]]
    left = width
    for name, wide in columns.items():
        if blocks[-1] and wide + 2 > left:
            blocks.append([])
            left = width
        blocks[-1].append(name)
        left -= wide + 2
    return blocks
