"""One report from the shards of a run."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say, say_all
from comparisons.outputs import add_outputs, prepare_outputs, write_outputs


def register(commands: Commands) -> None:
    merge = commands.add(
        "merge",
        merge_shards,
        "put the shards of a run together: one report, and the exit status of the run",
        "lightgauge merge shard-1 shard-2 shard-3 -o report",
    )
    merge.add_argument("runs", nargs="+", metavar="RUN", type=Path, help="the folders of all its shards, in any order")
    merge.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, default=Path("report"), help="default: report")
    add_outputs(merge)


def merge_shards(options: argparse.Namespace, say: Say) -> int:
    from comparisons.merge import copy_pictures, merge, read_part, require_other
    from comparisons.overrides import idle_lines
    from comparisons.results import prepare_folder, write_run
    from comparisons.suite import exit_status
    from comparisons.summary import closing_lines

    parts = [read_part(run) for run in options.runs]
    merged = merge(parts)
    require_other(parts, options.folder)
    prepare_folder(options.folder)
    prepare_outputs(options)
    copy_pictures(parts, merged, options.folder)
    content = merged.content
    page = write_run(options.folder, content, options.history)
    notes = [*merged.notes, *idle_lines(content["idle_overrides"])]
    say_all(say, closing_lines(merged.checks, notes, page, content["seconds"], merged.broken, content["jobs"]))
    status = exit_status(merged.checks, bool(merged.broken))
    return write_outputs(options, options.folder, content, status, say)
