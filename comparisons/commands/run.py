"""Run checks and write the report: the main job."""

import argparse
import time
import warnings
from datetime import UTC, datetime
from pathlib import Path

from comparisons.interrupt import Interrupt
from comparisons.options import Commands, Say, add_selection, add_store, say_all


def register(commands: Commands) -> None:
    run = commands.add(
        "run",
        run_checks,
        "run checks and write a report",
        "lightgauge run small-room-ellipsoid -k indirect -o report",
    )
    add_selection(run)
    run.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, default=Path("report"), help="default: report")
    add_store(run)
    run.add_argument(
        "--store-limit", metavar="SIZE", default="4G", help="remove truth unused for longest beyond that; default: 4G"
    )


def run_checks(options: argparse.Namespace, say: Say) -> int:
    with Interrupt() as interrupt:
        return _run(options, say, interrupt)


def _run(options: argparse.Namespace, say: Say, interrupt: Interrupt) -> int:
    from comparisons.answers.store import evicted_note, parse_size
    from comparisons.doctor import require_writable
    from comparisons.progress import Display
    from comparisons.results import prepare_folder, results_json, with_pictures, write_run
    from comparisons.selection import select
    from comparisons.suite import Progress, exit_status, run
    from comparisons.summary import closing_lines, line_of
    from comparisons.validate import validate
    from reference.store import Store
    from reference.upkeep import evict

    started, clock = datetime.now(UTC).isoformat(timespec="seconds"), time.perf_counter()
    requests = select(options.scenes, options.keep)
    validate(requests)
    prepare_folder(options.folder)
    require_writable(options.store, "store", "--store")
    limit = parse_size(options.store_limit)
    store = Store(options.store)
    warnings.filterwarnings("ignore", module="colour")
    with Display(sum(len(r.checks) for r in requests), line_of, say) as display:
        bar = display.progress
        progress = Progress(interrupt.after(bar.step), interrupt.after(bar.finished))
        store.waiting = progress.step
        results = run(requests, store, progress)
    shown = [with_pictures(options.folder, store, result) for result in results]
    store.notes.extend(evicted_note(evict(store, limit), limit))
    page = write_run(options.folder, results_json(shown, started, time.perf_counter() - clock, store.notes))
    say_all(say, closing_lines(results, store.notes, page, time.perf_counter() - clock))
    return exit_status(results)
