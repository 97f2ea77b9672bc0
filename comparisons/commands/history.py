"""The course of errors and times over runs."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say, say_all


def register(commands: Commands) -> None:
    history = commands.add(
        "history",
        tell,
        "the runs of a history, and how the error and the time of a check came about",
        "lightgauge history history.sqlite",
        "lightgauge history history.sqlite small-room-knot/indirect.probe",
    )
    history.add_argument("file", metavar="FILE", type=Path, help="as given to `lightgauge run --history FILE`")
    history.add_argument("check", nargs="?", metavar="TEXT", help="the checks whose scene/technique contains TEXT")


def tell(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.history import course_lines, run_lines
    from comparisons.history import read

    history = read(options.file)
    say_all(say, run_lines(history) if options.check is None else course_lines(history, options.check))
    return 0
