"""What the newest run of a history changed."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from comparisons.report.check import CheckView
from comparisons.report.numbers import format_interval, format_metric, format_percent

if TYPE_CHECKING:
    from comparisons.history import Entry, History

MOST_CHANGES = 12
"""How many of them the overview lists, the largest share of their budget first."""


@dataclass(frozen=True)
class ChangeView:
    """An error that differs from the run before by more than noise; `share` is the difference over the budget."""

    check: CheckView
    metric: str
    before: str
    now: str
    since: str
    rose: bool
    share: str


@dataclass(frozen=True)
class Changes:
    """`runs` are those that the history holds; `more` changes are not listed."""

    runs: int
    listed: tuple[ChangeView, ...]
    more: int


def changes_of(views: Iterable[CheckView], history: "History | None") -> Changes | None:
    """What the newest run of a history changed, of the checks at hand; None without a history of at least two runs."""
    if history is None or len(history.runs) < 2:
        return None
    known = {view.raw["id"]: view for view in views}
    found = [change for change in history.changes() if change.now.check in known]
    listed = tuple(
        ChangeView(
            check=known[change.now.check],
            metric=change.now.metric,
            before=_measured(change.before),
            now=_measured(change.now),
            since=" ".join(part for part in (change.before.when, change.before.commit) if part),
            rose=change.rose,
            share=format_percent(change.share, trim=True),
        )
        for change in found[:MOST_CHANGES]
    )
    return Changes(len(history.runs), listed, len(found) - len(listed))


def _measured(entry: "Entry") -> str:
    interval = format_interval(entry.metric, entry.low, entry.high)
    return f"{format_metric(entry.metric, entry.value, entry.unit)} {interval}".strip()
