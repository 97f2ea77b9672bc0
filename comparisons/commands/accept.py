"""Accept the errors of a finished run."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say, add_keep, say_all


def register(commands: Commands) -> None:
    accept = commands.add(
        "accept",
        accept_run,
        "accept the errors of a finished run: later runs are REGRESSED when they exceed them",
        'lightgauge accept report -k indirect.probe --reason "wider kernel: less noise, 1 % more error"',
    )
    accept.add_argument("run", nargs="?", metavar="RUN", type=Path, default=Path("report"), help="default: report")
    accept.add_argument("--reason", required=True, metavar="SENTENCE", help="why these errors are as they should be")
    add_keep(accept)


def accept_run(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.accept import accept_lines

    say_all(say, accept_lines(options.run, options.reason, options.keep))
    return 0
