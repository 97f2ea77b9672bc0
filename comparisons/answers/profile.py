"""How long runs take, as a table in Markdown."""

import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from comparisons.results import environment
from comparisons.suite_speed import Measured, speeds
from scenes.errors import InputError

BEGIN = "<!-- lightgauge profile: begin -->"
END = "<!-- lightgauge profile: end -->"


def profile_lines(
    scenes: Sequence[str], keep: str, store: Path, is_cold: bool, step: Callable[[str, float], None]
) -> list[str]:
    """Measure, and tell in Markdown what was found.

    Raises
    ------
    InputError, MachineError
        As `comparisons.suite_speed.speeds`.
    """
    with tempfile.TemporaryDirectory(prefix="lightgauge-profile-") as folder:
        found = list(speeds(scenes, keep, store, Path(folder), is_cold, step))
    command = " ".join(["lightgauge profile", *scenes, *([f"-k '{keep}'"] if keep else []), *["--cold"] * is_cold])
    return [*_table(found), "", _made_by(command)]


def _table(found: Iterable[Measured]) -> Iterator[str]:
    yield "| run | time | checks judged anew | truths rendered |"
    yield "|---|---:|---:|---:|"
    for one in found:
        judged = f"{one.judged} of {one.checks}" if one.checks else ""
        truths = str(one.truths) if one.checks else ""
        yield f"| {one.what} | {duration(one.seconds)} | {judged} | {truths} |"


def duration(seconds: float) -> str:
    """Seconds in words.

    >>> duration(0.254), duration(1.46), duration(75.2), duration(703.0)
    ('0.25 s', '1.5 s', '75 s', '11 min 43 s')
    """
    if seconds < 1:
        return f"{seconds:.2f} s"
    if seconds < 10:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes >= 2 else f"{round(seconds)} s"


def _made_by(command: str) -> str:
    machine = environment([])
    return (
        f"Made by `{command}` with lightgauge {machine['lightgauge']}, Mitsuba {machine['mitsuba']} and Python "
        f"{machine['python']} on {machine['cpu_count']} CPU cores, {machine['platform']}."
    )


def with_block(text: str, lines: Iterable[str], path: Path) -> str:
    """A document with the lines between its marks in place of what was there.

    Raises
    ------
    InputError
        It has no marks.
    """
    pattern = re.compile(rf"{re.escape(BEGIN)}\n.*?{re.escape(END)}", re.DOTALL)
    if not pattern.search(text):
        raise InputError(
            f"'{path}' has no place for the table. Write two lines into it, '{BEGIN}' and '{END}': what lies between "
            "them is replaced."
        )
    block = "\n".join([BEGIN, *lines, END])
    return pattern.sub(lambda _: block, text, count=1)
