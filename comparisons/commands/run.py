"""Run checks and write the report: the main job."""

import argparse
import time
import warnings
from datetime import UTC, datetime
from pathlib import Path

from comparisons.interrupt import Interrupt
from comparisons.options import Commands, Say, add_own, add_selection, add_store, say_all
from comparisons.outputs import add_outputs, prepare_outputs, write_outputs


def register(commands: Commands) -> None:
    run = commands.add(
        "run",
        run_checks,
        "run checks and write a report",
        "lightgauge run small-room-ellipsoid -k indirect -o report",
    )
    add_selection(run)
    add_own(run)
    run.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, default=Path("report"), help="default: report")
    add_store(run)
    run.add_argument(
        "--store-limit", metavar="SIZE", default="4G", help="remove truth unused for longest beyond that; default: 4G"
    )
    run.add_argument("--jobs", metavar="N", type=int, default=1, help="run N scenes at a time; default: 1")
    run.add_argument(
        "--shard", metavar="I/N", help="only part I of N of the scenes: for N machines, and `lightgauge merge` after it"
    )
    run.add_argument(
        "--dask", metavar="ADDRESS", default="", help="render on the cluster of that Dask scheduler; docs/clusters.md"
    )
    add_outputs(run)


def run_checks(options: argparse.Namespace, say: Say) -> int:
    with Interrupt() as interrupt:
        return _run(options, say, interrupt)


def _run(options: argparse.Namespace, say: Say, interrupt: Interrupt) -> int:
    from comparisons.answers.store import evicted_note, parse_size
    from comparisons.batch import opening_lines, run_selection
    from comparisons.cache import keep_known
    from comparisons.doctor import require_writable
    from comparisons.jobs import require_jobs
    from comparisons.overrides import idle_lines, idle_overrides
    from comparisons.own import load_techniques
    from comparisons.results import prepare_folder, results_json, with_pictures, write_run
    from comparisons.selection import choose
    from comparisons.setup import Setup, sides
    from comparisons.shards import parse_shard
    from comparisons.suite import exit_status
    from comparisons.summary import closing_lines
    from realtime.own import own_files
    from reference.store import Store
    from reference.upkeep import tidy

    started, clock = datetime.now(UTC).isoformat(timespec="seconds"), time.perf_counter()
    own = load_techniques(options.techniques, options.budgets)
    require_jobs(options.jobs)
    shard = parse_shard(options.shard) if options.shard else None
    chosen = choose(options.scenes, options.keep, shard, own)
    say_all(say, opening_lines(chosen))
    if not options.keep and shard is None:  # what one shard does not judge, another one may
        say_all(say, own.notes(options.scenes, chosen.scenes, [request.scene for request in chosen.requests]))
    setup = Setup(own_files(), options.dask)
    sides(setup)
    prepare_folder(options.folder)
    prepare_outputs(options)
    require_writable(options.store, "store", "--store")
    limit = parse_size(options.store_limit)
    store = Store(options.store)
    warnings.filterwarnings("ignore", module="colour")
    jobs = min(options.jobs, max(1, len(chosen.requests)))
    results = run_selection(chosen, store, setup, jobs, interrupt, say)
    shown = with_pictures(options.folder, store, results)
    if (tidied := tidy(store, limit)) is not None:
        store.notes.extend(evicted_note(tidied, limit))
    content = results_json(shown, started, time.perf_counter() - clock, store.notes)
    idle = idle_overrides(chosen.every_check, {r.gl_renderer for r in results if r.gl_renderer})
    content |= chosen.to_json() | {"jobs": jobs, "idle_overrides": idle}
    page = write_run(options.folder, content, options.history)
    keep_known(store)
    seconds = time.perf_counter() - clock
    notes = [*store.notes, *idle_lines(idle)]
    say_all(say, closing_lines(results, notes, page, seconds, chosen.broken, 1 if options.dask else jobs))
    return write_outputs(options, options.folder, content, exit_status(results, bool(chosen.broken)), say)
