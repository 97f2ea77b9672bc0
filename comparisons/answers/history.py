"""The lines of `lightgauge history`."""

import difflib
from collections.abc import Iterator, Sequence

from comparisons.baseline import family_of
from comparisons.gate import Verdict
from comparisons.history import Entry, History, Run
from comparisons.report.numbers import format_bound, format_interval, format_metric, format_percent, format_seconds
from scenes.errors import InputError


def run_lines(history: History) -> Iterator[str]:
    """One line a run, the oldest first, and what the newest has changed."""
    if not history.runs:
        yield "No run has been noted yet."
        return
    rows = [("when", "commit", "renderer", "checks", "took"), *map(_run_row, history.runs)]
    yield from _table(rows)
    changes = history.changes()
    for change in changes:
        now, before = change.now, change.before
        yield (
            f"{'rose' if change.rose else 'fell'}: {now.check}: {now.metric} from {_measured(before)} "
            f"({before.commit or before.when}) to {_measured(now)}, by {format_percent(change.share, trim=True)} "
            "of the budget"
        )
    if len(history.runs) > 1 and not changes:
        yield "The newest run changed no error by more than noise."


def course_lines(history: History, text: str) -> Iterator[str]:
    """The course of each check whose name contains the text, or of the one that is called so.

    Raises
    ------
    InputError
        There is none.
    """
    names = [text] if text in history.courses else [name for name in history.courses if text in name]
    if not names:
        close = difflib.get_close_matches(text, history.courses, 5, 0.4)
        hint = f" Close to it: {', '.join(close)}." if close else ""
        raise InputError(f"None of the {len(history.courses)} checks of this history contains '{text}'.{hint}")
    for name in names:
        yield name
        yield from _table([_ENTRY_HEADER, *_entry_rows(history.entries(name))], indent="  ")


_ENTRY_HEADER = (
    "when",
    "commit",
    "metric",
    "error",
    "interval",
    "budget",
    "verdict",
    "spp",
    "time",
    "truth",
    "renderer",
)


def _entry_rows(entries: Sequence[Entry]) -> Iterator[tuple[str, ...]]:
    for entry in entries:
        stored = " (stored)" if entry.cached else ""
        yield (
            entry.when,
            entry.commit,
            entry.metric,
            format_metric(entry.metric, entry.value, entry.unit),
            format_interval(entry.metric, entry.low, entry.high),
            format_bound(entry.metric, entry.min, entry.max, entry.unit),
            f"{entry.verdict}{stored}",
            str(entry.spp or ""),
            format_seconds(entry.realtime_seconds),
            format_seconds(entry.truth_seconds),
            entry.renderer,
        )


def _run_row(run: Run) -> tuple[str, ...]:
    counts = ", ".join(f"{run.counts[verdict]} {verdict}" for verdict in Verdict if verdict in run.counts)
    how = "".join((f", shard {run.shard}" if run.shard else "", f", {run.jobs} jobs" if run.jobs > 1 else ""))
    return run.when, run.commit, family_of(run.gl_renderer), counts, f"{format_seconds(run.seconds)}{how}"


def _measured(entry: Entry) -> str:
    interval = format_interval(entry.metric, entry.low, entry.high)
    return f"{format_metric(entry.metric, entry.value, entry.unit)} {interval}".strip()


def _table(rows: Sequence[Sequence[str]], indent: str = "") -> Iterator[str]:
    """Columns side by side."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield (indent + "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True))).rstrip()
