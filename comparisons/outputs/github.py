"""Annotations on GitHub: workflow commands on the standard output, which mark the lines where budgets are written."""

import re
from collections.abc import Iterator
from pathlib import Path

from comparisons.outputs.words import headline_text, worst_pixel_text
from comparisons.report.check import CheckView
from comparisons.report.view import Overview

MOST = 10
"""GitHub shows as many errors of a step, as many warnings and as many notices, and drops the others in silence."""

LEVELS = {"ERROR": "error", "FAIL": "error", "REGRESSED": "error", "INCONCLUSIVE": "warning"}


def annotations(overview: Overview, folder: Path, complaint: str, root: Path) -> Iterator[str]:
    """Errors for what is broken, failed or regressed, warnings for what is inconclusive, notices for slack budgets.

    The worst come first. Where there are more than GitHub shows, the last one says how many are left out.

    Parameters
    ----------
    folder : that of the report.
    complaint : why the gate as a whole is not held; an error of its own if not empty.
    root : the checkout, absolute; a budget that is written outside is annotated without its place.
    """
    every = [*overview.checks, *overview.parity]
    errors = [
        *([_command("error", "Too few checks", complaint)] if complaint else []),
        *(_of_broken(argument, message, root) for argument, message in overview.broken),
        *(_of_check(view, root) for view in every if LEVELS.get(view.verdict) == "error"),
    ]
    warnings = [_of_check(view, root) for view in every if LEVELS.get(view.verdict) == "warning"]
    notices = [
        _command("notice", f"Slack budget: {view.raw['id']}", view.raw["slack"], _place(_written_at(view), root))
        for view in every
        if view.raw.get("slack")
    ]
    for level, lines in (("error", errors), ("warning", warnings), ("notice", notices)):
        yield from _limited(level, lines, folder)


def _limited(level: str, lines: list[str], folder: Path) -> Iterator[str]:
    if len(lines) <= MOST:
        yield from lines
        return
    yield from lines[: MOST - 1]
    more = f"GitHub shows no more than {MOST} at a time. All are in {folder / 'index.html'} and in the step's summary."
    yield _command(level, f"and {len(lines) - MOST + 1} more", more)


def _of_check(view: CheckView, root: Path) -> str:
    reason = view.headline.reason if view.headline is not None and view.verdict != "ERROR" else ""
    message = view.raw.get("message") or ""
    parts = (
        headline_text(view),
        f"reason for the budget: {reason}" if reason else "",
        message if view.verdict != "ERROR" else "",
        worst_pixel_text(view),
        f"again: {view.raw['rerun']}" if view.raw.get("rerun") else "",
    )
    title = f"{view.verdict} {view.raw['id']}"
    return _command(
        LEVELS[view.verdict], title, "\n".join(part for part in parts if part), _place(_written_at(view), root)
    )


def _of_broken(argument: str, message: str, root: Path) -> str:
    """What is wrong with a scene file begins with its place, FILE:LINE, where it has one."""
    named = re.match(r"(.+?:\d+): ", message)
    return _command("error", f"{argument} cannot be read", message, _place(named[1] if named else "", root))


def _written_at(view: CheckView) -> str:
    """FILE:LINE of the budget that decided; empty if it is not known."""
    return view.headline.place if view.headline is not None else ""


def _place(place: str, root: Path) -> tuple[str, str] | None:
    """File, relative to the checkout, and line of FILE:LINE; None if it lies outside or is empty."""
    path, _, line = place.rpartition(":")
    found = Path(path).resolve()
    return (found.relative_to(root).as_posix(), line) if path and found.is_relative_to(root) else None


def _command(level: str, title: str, message: str, place: tuple[str, str] | None = None) -> str:
    """One workflow command.

    >>> _command("error", "FAIL a,b", "50 % wrong", ("scenes/a.toml", "12"))
    '::error file=scenes/a.toml,line=12,title=FAIL a%2Cb::50 %25 wrong'
    """
    properties = ({"file": place[0], "line": place[1]} if place else {}) | {"title": title}
    told = ",".join(
        f"{key}={_escaped(value).replace(':', '%3A').replace(',', '%2C')}" for key, value in properties.items()
    )
    return f"::{level} {told}::{_escaped(message)}"


def _escaped(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
