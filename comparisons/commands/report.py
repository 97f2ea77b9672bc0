"""The page of a finished run again."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say
from comparisons.outputs import add_outputs, prepare_outputs, write_outputs


def register(commands: Commands) -> None:
    report = commands.add(
        "report",
        write,
        "write the pages of a finished run again, and what else is made from its results",
        "lightgauge report report",
        "lightgauge report report --junit junit.xml --markdown summary.md",
    )
    report.add_argument("run", metavar="RUN", type=Path, help="the folder of a run, or its results.json")
    add_outputs(report)


def write(options: argparse.Namespace, say: Say) -> int:
    from comparisons.results import read_run, write_page

    folder, results = read_run(options.run)
    prepare_outputs(options)
    say(str(write_page(folder, results, options.history)))
    return write_outputs(options, folder, results, 0, say)
