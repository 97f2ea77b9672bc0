"""The command line: the only place that prints and exits."""

import argparse
import importlib
import io
import os
import sys
import traceback
from collections.abc import Sequence
from typing import NoReturn

from comparisons.options import Command, Commands
from scenes.errors import InputError, LightgaugeError, MachineError

INTERRUPTED = 130
BROKEN_PIPE = 141
"""As a shell reports a process that SIGINT or SIGPIPE ends."""

COMMANDS = (
    "list",
    "explain",
    "run",
    "merge",
    "report",
    "history",
    "accept",
    "selftest",
    "bench",
    "stress",
    "diff",
    "fit",
    "compare",
    "export",
    "calibrate",
    "profile",
    "doctor",
    "store",
)
"""Modules of `comparisons.commands`, in the order of the help."""

EXAMPLES = """\
examples:
  lightgauge list                          what there is to run
  lightgauge run                           every shipped check, report in ./report
  lightgauge run small-room-ellipsoid      one scene
  lightgauge run mine.toml -o out          a scene of your own
  lightgauge run -k indirect.irradiance    the checks whose name contains that
  lightgauge run 'eye-*' mine/ --jobs 4    scenes by pattern and folder, four at a time
  lightgauge merge shard-1 shard-2         one report from runs with --shard 1/2 and --shard 2/2
  lightgauge run --technique mine.frag     a technique of your own, on the scenes that judge its quantity
  lightgauge explain small-room-knot       what runs, what is skipped, and why
  lightgauge report report                 the page again, from report/results.json
  lightgauge history history.sqlite        what runs with --history found, and what the last one changed
  lightgauge accept --reason "as in 2005"  hold later runs against the errors of this one
  lightgauge diff indirect.probe indirect.irradiance --scene small-room-knot   which one is better?
  lightgauge fit indirect.talk --on 'small-room-*' --test large-room-ellipsoid --exposure   constants by measurement
  lightgauge bench indirect-light          what does a millisecond buy, against the path tracer?
  lightgauge stress indirect.grid          where does it break?
  lightgauge export small-room-knot -o knot.glb   for an engine of your own
  lightgauge compare knot.exr --scene small-room-knot --quantity indirect_radiance   how wrong is its image?
  lightgauge selftest                      would the checks notice a fault?
  lightgauge store --prune 1G              keep at most a gigabyte of truth
  lightgauge calibrate                     are the error bars honest?
  lightgauge profile                       how long do runs take here?
  lightgauge doctor                        can this machine render?

exit status: 0 all checks pass, 1 a budget is exceeded or an error has regressed, 2 inconclusive, 3 bad input,
4 environment or render error
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit status."""
    options = _parser().parse_args(arguments)
    command: Command = options.command
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # where the encoding has no ≤, a question mark will do
    try:
        status = command(options, print)
        sys.stdout.flush()
        return status
    except LightgaugeError as error:
        return _complain(str(error), error.exit_status)
    except KeyboardInterrupt:
        return _complain("interrupted. What was rendered is kept; the same command goes on from there.", INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes once more when it ends
        return BROKEN_PIPE
    except OSError as error:
        return _complain(
            f"the system refused to read or write a file ({error}). Give it room and permission, then run the same "
            "command again: what was rendered is kept.",
            MachineError.exit_status,
        )
    except Exception:  # noqa: BLE001  # else Python would exit with 1, which here means that a budget is exceeded
        traceback.print_exc()
        return _complain("this is a fault of lightgauge itself. What was rendered is kept.", MachineError.exit_status)


def _complain(message: str, status: int) -> int:
    print(f"lightgauge: {message}", file=sys.stderr)
    return status


class _Parser(argparse.ArgumentParser):
    """argparse exits with 2 on a wrong option, which here means inconclusive."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        self.exit(InputError.exit_status, f"{self.prog}: {message}. See {self.prog} --help.\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="lightgauge",
        description="How wrong is a real-time shading technique? Measured against path-traced truth, with error bars.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = Commands(parser)
    for name in COMMANDS:
        importlib.import_module(f"comparisons.commands.{name}").register(commands)
    return parser
