"""The command line: the only place that prints and exits."""

import argparse
import io
import os
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from comparisons.interrupt import Interrupt
from scenes.errors import InputError, LightgaugeError, MachineError

if TYPE_CHECKING:
    from comparisons.suite import Request

INTERRUPTED = 130
BROKEN_PIPE = 141
"""As a shell reports a process that SIGINT or SIGPIPE ends."""

EXAMPLES = """\
examples:
  lightgauge list                          what there is to run
  lightgauge run                           every shipped check, report in ./report
  lightgauge run small-room-ellipsoid      one scene
  lightgauge run mine.toml -o out          a scene of your own
  lightgauge run -k indirect.irradiance    the checks whose name contains that
  lightgauge explain small-room-knot       what runs, what is skipped, and why
  lightgauge report report                 the page again, from report/results.json
  lightgauge doctor                        can this machine render?

exit status: 0 all checks pass, 1 a budget is exceeded, 2 inconclusive, 3 bad input, 4 environment or render error
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit status."""
    options = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], int] = options.command
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # where the encoding has no ≤, a question mark will do
    try:
        status = command(options)
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
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=_Parser)

    def add(
        name: str, command: Callable[[argparse.Namespace], int], summary: str, example: str
    ) -> argparse.ArgumentParser:
        added = commands.add_parser(
            name,
            help=summary,
            description=summary,
            epilog=f"example:\n  {example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        added.set_defaults(command=command)
        return added

    add("list", _list, "scenes, techniques, quantities and metrics", "lightgauge list")
    explain = add(
        "explain", _explain, "what a scene runs, what it skips, and why", "lightgauge explain small-room-knot"
    )
    explain.add_argument("scene", help="a name from `lightgauge list`, or a path to a TOML file")
    run = add("run", _run, "run checks and write a report", "lightgauge run small-room-ellipsoid -k indirect -o report")
    run.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a name or a path to a TOML file; all shipped scenes if none"
    )
    run.add_argument(
        "-k", dest="keep", metavar="TEXT", default="", help="only checks whose scene/technique contains TEXT"
    )
    run.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, default=Path("report"), help="default: report")
    report = add("report", _report, "write the page of a finished run again", "lightgauge report report")
    report.add_argument("run", metavar="RUN", type=Path, help="the folder of a run, or its results.json")
    doctor = add("doctor", _doctor, "can this machine render?", "lightgauge doctor")
    for parser_with_store in (run, doctor):
        parser_with_store.add_argument(
            "--store",
            metavar="FOLDER",
            type=Path,
            default=Path(".lightgauge"),
            help="where truth is kept between runs; default: .lightgauge",
        )
    return parser


def _list(options: argparse.Namespace) -> int:
    from comparisons.metrics import METRICS
    from realtime.techniques import MODULES as TECHNIQUES
    from realtime.techniques import technique
    from reference.quantities import MODULES as QUANTITIES
    from reference.quantities import quantity
    from scenes.load import library_scenes, load_scene

    scenes = {name: load_scene(path).title for name, path in library_scenes().items()}
    sections = {
        "scenes": scenes,
        "techniques": {name: technique(name).summary for name in TECHNIQUES},
        "quantities": {name: f"[{quantity(name).unit}] {quantity(name).summary}" for name in QUANTITIES},
        "metrics": {name: metric.summary for name, metric in METRICS.items()},
    }
    for title, entries in sections.items():
        print(f"{title}:")
        width = max(len(name) for name in entries)
        for name, summary in entries.items():
            print(f"  {name:{width}}  {summary}")
    return 0


def _explain(options: argparse.Namespace) -> int:
    from comparisons.explain import explanation
    from comparisons.suite import Request
    from comparisons.validate import validate
    from scenes.load import find_scene, load_scene

    scene = load_scene(find_scene(options.scene))
    validate([Request(scene, options.scene)])
    for line in explanation(scene):
        print(line)
    return 0


def _run(options: argparse.Namespace) -> int:
    with Interrupt() as interrupt:
        return _run_checks(options, interrupt)


def _run_checks(options: argparse.Namespace, interrupt: Interrupt) -> int:
    from comparisons.doctor import require_writable
    from comparisons.progress import Display
    from comparisons.results import prepare_folder, results_json, with_pictures, write_run
    from comparisons.suite import Progress, exit_status, run
    from comparisons.summary import closing_lines, line_of
    from comparisons.validate import validate
    from reference.store import Store

    started, clock = datetime.now(UTC).isoformat(timespec="seconds"), time.perf_counter()
    requests = _requests(options)
    validate(requests)
    prepare_folder(options.folder)
    require_writable(options.store, "store", "--store")
    store = Store(options.store)
    warnings.filterwarnings("ignore", module="colour")
    with Display(sum(len(r.checks) for r in requests), line_of, print) as display:
        bar = display.progress
        progress = Progress(interrupt.after(bar.step), interrupt.after(bar.finished))
        results = run(requests, store, progress)
    shown = [with_pictures(options.folder, store, result) for result in results]
    page = write_run(options.folder, results_json(shown, started, time.perf_counter() - clock, store.notes))
    for line in closing_lines(results, store.notes, page, time.perf_counter() - clock):
        print(line)
    return exit_status(results)


def _requests(options: argparse.Namespace) -> "list[Request]":
    from comparisons.suite import Request
    from scenes.load import find_scene, library_scenes, load_scene

    names = options.scenes or list(library_scenes())
    once = {find_scene(name).resolve(): name for name in reversed(names)}
    requests = [
        Request(load_scene(find_scene(name)), name, lambda check_id: options.keep in check_id)
        for name in reversed(once.values())
    ]
    kept = [r for r in requests if r.checks]
    if not kept:
        raise InputError(
            f"No check of {', '.join(names)} contains '{options.keep}'. See `lightgauge list` and `lightgauge "
            f"explain SCENE`."
        )
    return kept


def _report(options: argparse.Namespace) -> int:
    from comparisons.report.page import write_report
    from comparisons.results import read_run

    folder, results = read_run(options.run)
    print(write_report(folder, results))
    return 0


def _doctor(options: argparse.Namespace) -> int:
    from comparisons.doctor import findings
    from scenes.errors import MachineError

    status = 0
    for finding in findings(options.store):
        print(f"{'ok' if finding.is_fine else 'WRONG':6}{finding.what:16}{finding.detail}")
        if not finding.is_fine:
            status = MachineError.exit_status
    return status
