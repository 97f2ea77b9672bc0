"""A summary of a run in GitHub-flavoured Markdown: for a comment on a pull request, or for the page of a job."""

from collections.abc import Iterator, Sequence
from itertools import islice

from comparisons.outputs.words import headline_text, one_line, worst_pixel_text
from comparisons.report.check import GLYPHS, CheckView
from comparisons.report.course import Changes
from comparisons.report.glance import Group, groups_of
from comparisons.report.numbers import MISSING, UNBROKEN
from comparisons.report.view import Overview
from reference.quantities import EFFECTS

ROWS = (1000, 300, 100, 30, 10, 3, 0)
"""How many rows a table may have, the next number if the text gets too long otherwise."""

CELL = 240
"""Characters of a cell: tables become unreadable with whole paragraphs in them."""


BAR = r"\|"
"""A vertical bar within a cell."""


def summary_of(overview: Overview, complaint: str = "", limit: int = 1 << 20) -> str:
    """The summary of a run, of at most `limit` bytes: a table that is too long says how many rows are left out.

    `complaint` is why the gate as a whole is not held.
    """
    texts = ("\n".join(_lines(overview, complaint, rows)) + "\n" for rows in ROWS)
    shortest = ""
    for text in texts:
        shortest = text
        if len(text.encode()) <= limit:
            return text
    return shortest.encode()[: max(0, limit)].decode(errors="ignore")


def _lines(overview: Overview, complaint: str, rows: int) -> Iterator[str]:
    yield f"## lightgauge: {_text(overview.sentence)}"
    yield ""
    counts = " · ".join(f"{GLYPHS[verdict]} {count} {verdict}" for verdict, count in overview.counts)
    yield " ".join(part for part in (counts or "no checks", "—", _text(overview.rest)) if part).removesuffix(" —")
    if complaint:
        yield from ("", f"> [!CAUTION]\n> {_text(complaint)}")
    if overview.broken:
        yield from ("", "**Scenes that could not be read**", "")
        yield from _table(("scene", "why"), [(_code(a), _cells(m)) for a, m in overview.broken], rows)
    wrong = [view for view in overview.all if view.verdict != "PASS"]
    if wrong:
        header = ("verdict", "scene", "technique", "metric", "error", "budget", "accepted", "written at, or why")
        yield ""
        yield from _table(header, [_row(view) for view in wrong], rows, right=(4, 5))
        yield from _details("Why, and how to run them again", _reasons(wrong, rows))
    if overview.changes is not None and overview.changes.listed:
        yield from _details(_changes_title(overview.changes), _changed(overview.changes, rows))
    effects = dict.fromkeys((*EFFECTS, *(view.effect for view in overview.checks)))
    for group in groups_of(overview.checks, tuple(effects)):
        yield from _details(_group_title(group), _glances(group, rows))
    slack = [view for view in overview.all if view.raw.get("slack")]
    if slack:
        listed = _table(("check", "what"), [(_code(v.raw["id"]), _cell(v.raw["slack"])) for v in slack], rows)
        yield from _details(f"{_count(len(slack), 'budget')} could be tightened", listed)
    environment = [(_cell(key), _code(value)) for key, value in overview.environment.items()]
    yield from _details("Environment", _table(("what", "value"), environment, rows))
    yield from ("", f"<sub>{_text(' · '.join(overview.summary))}</sub>")


def _row(view: CheckView) -> tuple[str, ...]:
    technique = f"{_code(view.raw['technique'])}{f' {_cell(view.how)}' if view.how else ''}"
    first = (f"{GLYPHS[view.verdict]} {view.verdict}", _cell(view.raw["scene"]), technique)
    if view.headline is None:
        return (*first, MISSING, MISSING, MISSING, MISSING, _cell(headline_text(view)))
    change = view.change
    since = " ".join(part for part in (change.text, change.arrow, change.word) if part) if change else MISSING
    c = view.headline
    error = f"**{_cell(c.value)}** {_cell(c.interval).replace(' ', UNBROKEN)}"
    place = _code(c.place) if c.place else MISSING
    return (*first, _code(c.metric), error, _cell(c.bound), _cell(since), place)


def _reasons(views: Sequence[CheckView], rows: int) -> Iterator[str]:
    for view in views[:rows]:
        yield f"- **{view.verdict}** {_code(view.raw['id'])}: {_text(headline_text(view))}"
        reason = f"The budget's reason: {view.headline.reason.rstrip('.')}." if view.headline is not None else ""
        message = (view.raw.get("message") or "") if view.verdict != "ERROR" else ""
        for text in (reason, message, worst_pixel_text(view)):
            if text:
                yield f"  <br>{_text(text)}"
        if view.raw.get("rerun"):
            yield f"  <br>{_code(view.raw['rerun'])}"
    yield from _left_out(len(views) - rows)


def _changes_title(changes: Changes) -> str:
    count = len(changes.listed) + changes.more
    return f"{_count(count, 'error')} changed since the run before, by more than noise"


def _changed(changes: Changes, rows: int) -> Iterator[str]:
    table = [
        (
            _code(c.check.raw["id"]),
            _code(c.metric),
            _cell(c.before),
            _cell(c.now),
            f"{'↗' if c.rose else '↘'} {c.share}",
        )
        for c in changes.listed
    ]
    yield from _table(("check", "metric", "before", "now", "share of the budget"), table, rows, right=(2, 3, 4))
    if changes.more:
        yield from ("", f"… and {changes.more} more, in the report.")


def _group_title(group: Group) -> str:
    techniques = len({row.technique for row in group.rows})
    return f"{group.effect}: {_count(techniques, 'technique')} in {_count(group.checks, 'check')}"


def _glances(group: Group, rows: int) -> Iterator[str]:
    """Best to worst; interval and scene are those of the largest error, the time is the median."""
    table = [
        (
            f"{_code(row.technique)}{f' {_cell(row.how)}' if row.how else ''}",
            str(row.checks),
            _code(row.metric),
            f"**{_cell(row.error)}**",
            _cell(row.interval),
            _cell(row.worst.raw["scene"]),
            _cell(row.realtime),
        )
        for row in reversed(group.rows)
    ]
    header = ("technique", "checks", "metric", "least to largest error", "sure to", "where", "time")
    yield from _table(header, table, rows, right=(1, 3, 4, 6))


def _table(header: Sequence[str], rows: Sequence[Sequence[str]], most: int, right: Sequence[int] = ()) -> Iterator[str]:
    """A table of at most so many rows; `right` are the columns that numbers stand in."""
    yield f"| {' | '.join(header)} |"
    yield f"|{'|'.join('---:' if index in right else '---' for index in range(len(header)))}|"
    for row in islice(rows, most):
        yield f"| {' | '.join(cell.replace('|', BAR) for cell in row)} |"
    yield from _left_out(len(rows) - most)


def _left_out(count: int) -> Iterator[str]:
    if count > 0:
        yield from ("", f"… and {count} more, in the report.")


def _details(title: str, lines: Iterator[str]) -> Iterator[str]:
    yield from ("", f"<details><summary>{_text(title)}</summary>", "")
    yield from lines
    yield from ("", "</details>")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _cell(text: str) -> str:
    """Text in a cell of a table: one line, and not too long."""
    line = one_line(text)
    return _text(line if len(line) <= CELL else f"{line[: CELL - 1]}…")


def _cells(text: str) -> str:
    """Each line of a text on one of its own within a cell."""
    return "<br>".join(_cell(line) for line in text.splitlines())


def _code(text: str) -> str:
    """A name as it is."""
    return f"`{one_line(text).replace('`', chr(39))}`"


def _text(text: str) -> str:
    """A line of text that starts no HTML and mentions nobody."""
    return one_line(text).replace("<", "&lt;").replace("@", "@\u200b")
