"""The command line: the only place that prints and exits."""

import argparse
import io
import os
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
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
  lightgauge accept --reason "as in 2005"  hold later runs against the errors of this one
  lightgauge diff indirect.probe indirect.irradiance --scene small-room-knot   which one is better?
  lightgauge selftest                      would the checks notice a fault?
  lightgauge store --prune 1G              keep at most a gigabyte of truth
  lightgauge calibrate                     are the error bars honest?
  lightgauge doctor                        can this machine render?

exit status: 0 all checks pass, 1 a budget is exceeded or an error has regressed, 2 inconclusive, 3 bad input,
4 environment or render error
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


class _Commands:
    """The commands of the command line, each with an example in its help."""

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        self._commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=_Parser)

    def add(
        self, name: str, command: Callable[[argparse.Namespace], int], summary: str, example: str
    ) -> argparse.ArgumentParser:
        added = self._commands.add_parser(
            name,
            help=summary,
            description=summary,
            epilog=f"example:\n  {example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        added.set_defaults(command=command)
        return added


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="lightgauge",
        description="How wrong is a real-time shading technique? Measured against path-traced truth, with error bars.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = _Commands(parser)
    _add_runs(commands)
    _add_questions(commands)
    _add_upkeep(commands)
    return parser


def _add_runs(commands: _Commands) -> None:
    """What there is to run, running it, and what is done with a finished run."""
    commands.add("list", _list, "scenes, techniques, quantities and metrics", "lightgauge list")
    explain = commands.add(
        "explain", _explain, "what a scene runs, what it skips, and why", "lightgauge explain small-room-knot"
    )
    explain.add_argument("scene", help="a name from `lightgauge list`, or a path to a TOML file")
    run = commands.add(
        "run", _run, "run checks and write a report", "lightgauge run small-room-ellipsoid -k indirect -o report"
    )
    _add_selection(run)
    run.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, default=Path("report"), help="default: report")
    _add_store(run)
    run.add_argument(
        "--store-limit", metavar="SIZE", default="4G", help="remove truth unused for longest beyond that; default: 4G"
    )
    report = commands.add("report", _report, "write the page of a finished run again", "lightgauge report report")
    report.add_argument("run", metavar="RUN", type=Path, help="the folder of a run, or its results.json")
    accept = commands.add(
        "accept",
        _accept,
        "accept the errors of a finished run: later runs are REGRESSED when they exceed them",
        'lightgauge accept report -k indirect.probe --reason "wider kernel: less noise, 1 % more error"',
    )
    accept.add_argument("run", nargs="?", metavar="RUN", type=Path, default=Path("report"), help="default: report")
    accept.add_argument("--reason", required=True, metavar="SENTENCE", help="why these errors are as they should be")
    _add_keep(accept)


def _add_questions(commands: _Commands) -> None:
    """What asks whether checks, error bars and techniques are as good as they seem."""
    selftest = commands.add(
        "selftest",
        _selftest,
        "plant known faults in every image: would the checks notice them?",
        "lightgauge selftest small-room-knot",
    )
    _add_selection(selftest)
    diff = commands.add(
        "diff",
        _diff,
        "which of two techniques, settings or finished runs is closer to the truth?",
        "lightgauge diff indirect.probe indirect.irradiance --scene small-room-knot\n"
        "  lightgauge diff 'indirect.talk[c_height=0.0,fitted]' 'indirect.talk[c_height=7.0,fitted]' "
        "--scene small-room-knot\n"
        "  lightgauge diff report-before report-after",
    )
    for side in ("a", "b"):
        diff.add_argument(side, metavar=side.upper(), help="TECHNIQUE, TECHNIQUE[setting=value,fitted], or a run")
    diff.add_argument(
        "--scene", metavar="SCENE", help="a name or a path to a TOML file; needed unless A and B are runs"
    )
    diff.add_argument("--metric", metavar="METRIC", default="nrmse", help="nrmse (default) or rel_mse_eps1e-2")
    calibrate = commands.add(
        "calibrate",
        _calibrate,
        "measure how honest the error bars are, on truths that are known exactly (some minutes)",
        "lightgauge calibrate -o docs/calibration.md",
    )
    calibrate.add_argument(
        "-o", dest="file", metavar="FILE", type=Path, default=Path("calibration.md"), help="default: calibration.md"
    )
    calibrate.add_argument(
        "--repetitions", metavar="N", type=int, default=200, help="of each simulated experiment; default: 200"
    )
    for parser in (selftest, diff, calibrate):
        _add_store(parser)


def _add_upkeep(commands: _Commands) -> None:
    """The machine and the store."""
    doctor = commands.add("doctor", _doctor, "can this machine render?", "lightgauge doctor")
    store = commands.add(
        "store", _store, "what the store of truth holds; prune or merge it", "lightgauge store --prune 500M"
    )
    change = store.add_mutually_exclusive_group()
    change.add_argument("--prune", metavar="SIZE", help="remove what was used least recently until it fits, e.g. 500M")
    change.add_argument("--merge", metavar="FOLDER", type=Path, help="take over what another store holds")
    for parser in (doctor, store):
        _add_store(parser)


def _add_selection(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a name or a path to a TOML file; all shipped scenes if none"
    )
    _add_keep(parser)


def _add_keep(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-k", dest="keep", metavar="TEXT", default="", help="only checks whose scene/technique contains TEXT"
    )


def _add_store(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--store",
        metavar="FOLDER",
        type=Path,
        default=Path(".lightgauge"),
        help="where truth is kept between runs; default: .lightgauge",
    )


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
    _say(explanation(scene))
    return 0


def _run(options: argparse.Namespace) -> int:
    with Interrupt() as interrupt:
        return _run_checks(options, interrupt)


def _run_checks(options: argparse.Namespace, interrupt: Interrupt) -> int:
    from comparisons.commands.store import evicted_note, parse_size
    from comparisons.doctor import require_writable
    from comparisons.progress import Display
    from comparisons.results import prepare_folder, results_json, with_pictures, write_run
    from comparisons.suite import Progress, exit_status, run
    from comparisons.summary import closing_lines, line_of
    from comparisons.validate import validate
    from reference.store import Store
    from reference.upkeep import evict

    started, clock = datetime.now(UTC).isoformat(timespec="seconds"), time.perf_counter()
    requests = _requests(options)
    validate(requests)
    prepare_folder(options.folder)
    require_writable(options.store, "store", "--store")
    limit = parse_size(options.store_limit)
    store = Store(options.store)
    warnings.filterwarnings("ignore", module="colour")
    with Display(sum(len(r.checks) for r in requests), line_of, print) as display:
        bar = display.progress
        progress = Progress(interrupt.after(bar.step), interrupt.after(bar.finished))
        store.waiting = progress.step
        results = run(requests, store, progress)
    shown = [with_pictures(options.folder, store, result) for result in results]
    store.notes.extend(evicted_note(evict(store, limit), limit))
    page = write_run(options.folder, results_json(shown, started, time.perf_counter() - clock, store.notes))
    _say(closing_lines(results, store.notes, page, time.perf_counter() - clock))
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


def _selftest(options: argparse.Namespace) -> int:
    from comparisons.commands.selftest import selftest_lines
    from comparisons.doctor import require_writable
    from comparisons.validate import validate
    from reference.store import Store

    requests = _requests(options)
    validate(requests)
    require_writable(options.store, "store", "--store")
    warnings.filterwarnings("ignore", module="colour")
    store = Store(options.store)
    with _progress() as step:
        store.waiting = step
        lines, status = selftest_lines(requests, store, step)
    _say(lines)
    return status


def _diff(options: argparse.Namespace) -> int:
    from comparisons.commands.diff import diff_lines
    from comparisons.doctor import require_writable
    from reference.store import Store

    require_writable(options.store, "store", "--store")
    warnings.filterwarnings("ignore", module="colour")
    store = Store(options.store)
    with _progress() as step:
        store.waiting = step
        lines, status = diff_lines(options.a, options.b, options.scene, options.metric, store, step)
    _say(lines)
    return status


def _calibrate(options: argparse.Namespace) -> int:
    from comparisons.commands.calibrate import calibration_lines
    from comparisons.doctor import require_writable
    from reference.store import write_text

    if options.repetitions < 2:
        raise InputError(f"--repetitions is {options.repetitions}. At least 2 are needed, 200 are usual.")
    if options.file.is_dir():
        raise InputError(
            f"'{options.file}' is a folder. Name a file with -o, such as {options.file / 'calibration.md'}."
        )
    require_writable(options.file.absolute().parent, "output folder", "-o")
    require_writable(options.store, "store", "--store")
    with _progress() as step:
        lines = list(calibration_lines(options.store / "kernels", options.repetitions, step))
    write_text(options.file, "\n".join([*lines, ""]))
    _say(lines)
    return 0


@contextmanager
def _progress() -> Iterator[Callable[[str, float], None]]:
    """What shows the steps of long work that has no checks to count."""
    from comparisons.progress import Display
    from comparisons.summary import line_of

    with Interrupt() as interrupt, Display(0, line_of, print) as display:
        yield interrupt.after(display.progress.step)


def _accept(options: argparse.Namespace) -> int:
    from comparisons.commands.accept import accept_lines

    _say(accept_lines(options.run, options.reason, options.keep))
    return 0


def _store(options: argparse.Namespace) -> int:
    from comparisons.commands.store import inventory_lines, merge_lines, parse_size, prune
    from reference.store import Store

    store = Store(options.store)
    if options.prune is not None:
        _say(prune(store, parse_size(options.prune)))
    elif options.merge is not None:
        _say(merge_lines(store, options.merge))
    else:
        _say(inventory_lines(store))
    return 0


def _say(lines: Iterable[str]) -> None:
    for line in lines:
        print(line)


def _doctor(options: argparse.Namespace) -> int:
    from comparisons.doctor import findings
    from scenes.errors import MachineError

    status = 0
    for finding in findings(options.store):
        print(f"{'ok' if finding.is_fine else 'WRONG':6}{finding.what:16}{finding.detail}")
        if not finding.is_fine:
            status = MachineError.exit_status
    return status
