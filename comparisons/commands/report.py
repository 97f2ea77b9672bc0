"""The page of a finished run again."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say


def register(commands: Commands) -> None:
    report = commands.add("report", write, "write the page of a finished run again", "lightgauge report report")
    report.add_argument("run", metavar="RUN", type=Path, help="the folder of a run, or its results.json")


def write(options: argparse.Namespace, say: Say) -> int:
    from comparisons.report.page import write_report
    from comparisons.results import read_run

    folder, results = read_run(options.run)
    say(str(write_report(folder, results)))
    return 0
