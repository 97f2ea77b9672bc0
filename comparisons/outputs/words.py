"""What an output for other programs says about a check, in plain text."""

import re
from collections.abc import Iterator
from pathlib import Path

from comparisons.report.check import CheckView
from comparisons.report.criterion import CriterionView
from comparisons.report.pixel import pixel_text
from comparisons.report.view import Overview

PICTURES = ("error", "realtime", "truth", "flip", "significance")
"""The one to look at first stands first: some viewers show no other."""

NAMES = {"realtime": "the real-time side", "truth": "the truth", "error": "the error", "flip": "FLIP"}


def criterion_text(criterion: CriterionView) -> str:
    """Metric, value with interval, and budget: `nrmse 41.2 % [40.1, 42.3], budget ≤ 5 %`."""
    interval = f" {criterion.interval}" if criterion.interval else ""
    on = f" on {criterion.renderer}" if criterion.renderer else ""
    return f"{criterion.metric} {criterion.value}{interval}, budget {criterion.bound}{on}"


def headline_text(view: CheckView) -> str:
    """What decided a check, in one line: its criterion, or what went wrong."""
    if view.headline is None or view.verdict == "ERROR":
        return one_line(view.raw.get("message") or "It could not be judged.")
    return criterion_text(view.headline)


def one_line(text: str) -> str:
    """A text without line breaks; the spaces within numbers stay unbroken."""
    return re.sub(r"(?a:\s+)", " ", text).strip()


def failure_lines(view: CheckView, folder: Path) -> Iterator[str]:
    """All that helps with a check that does not pass: criteria with reason and place, worst pixel, pictures, command.

    Parameters
    ----------
    folder : that of the report, which pictures are relative to.
    """
    for criterion in view.criteria:
        if criterion.verdict != "PASS":
            yield f"{criterion.verdict} {criterion_text(criterion)}"
            yield f"  reason for the budget: {criterion.reason}"
            yield from (f"  {text}" for text in (criterion.note, criterion.accepted) if text)
            if criterion.place:
                yield f"  written at {criterion.place}"
    yield from (view.raw.get("message") or "").splitlines()
    if worst := worst_pixel_text(view):
        yield worst
    for name, path in pictures_of(view, folder):
        yield f"picture of {NAMES.get(name, name)}: {path}"
    if view.raw.get("rerun"):
        yield f"again: {view.raw['rerun']}"


def worst_pixel_text(view: CheckView) -> str:
    """The worst pixel with both values; empty where it is not known."""
    worst = view.raw.get("worst")
    if not worst:
        return ""
    return f"worst pixel {pixel_text(worst, view.raw.get('unit') or '1')}"


def pictures_of(view: CheckView, folder: Path) -> Iterator[tuple[str, Path]]:
    """Names and paths of a check's pictures, that of the error first."""
    images = view.raw.get("images") or {}
    yield from ((name, folder / images[name]) for name in PICTURES if name in images)


def shortfall(overview: Overview, least: int | None) -> str:
    """Why there are fewer judged checks than `least`, parity and ERROR not counted; empty if there are enough."""
    dropped = [view.raw["id"] for view in overview.checks if view.verdict == "ERROR"]
    judged = len(overview.checks) - len(dropped)
    if least is None or judged >= least:
        return ""
    reasons = [
        f"{judged} check{' was' if judged == 1 else 's were'} judged, --min-checks asks for {least} (parity and "
        "ERROR are not counted)",
        f"{len(dropped)} ended in ERROR: {', '.join(dropped)}" if dropped else "",
        f"{len(overview.broken)} could not be read: {', '.join(a for a, _ in overview.broken)}"
        if overview.broken
        else "",
    ]
    why = "; ".join(reason for reason in reasons if reason)
    return f"Too few checks: {why}. Checks that were not chosen, or are gone from the scenes, do not show here."
