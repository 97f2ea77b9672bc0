"""What a finished run leaves for other programs: JUnit XML, Markdown, annotations on GitHub, the history, a gate.

All of it is made from the content of results.json, so it is the same at the end of a run, for shards that were merged,
and for a run of last week. Importing this loads nothing heavy.
"""

import argparse
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparisons.options import Say
from scenes.errors import InputError

if TYPE_CHECKING:
    from comparisons.report.view import Overview

GITHUB_SUMMARY_BYTES = 1 << 20
"""What GitHub takes as the summary of a step; a larger one is dropped as a whole."""

GITHUB_COMMENT_CHARACTERS = 65_536
"""What GitHub takes as a comment on a pull request."""

SPARE_BYTES = 1024
"""Left free in both, for a heading that somebody sets above the text."""


def add_outputs(parser: argparse.ArgumentParser) -> None:
    """Options of every command that ends with results."""
    outputs = parser.add_argument_group("for continuous integration")
    outputs.add_argument(
        "--junit", metavar="FILE", type=Path, help="write JUnit XML: a test suite a scene, a test a check"
    )
    outputs.add_argument("--markdown", metavar="FILE", type=Path, help="write a summary for a pull request")
    outputs.add_argument(
        "--format",
        choices=("text", "github"),
        default="text",
        help="github: annotate the lines of budgets too, and append to $GITHUB_STEP_SUMMARY; default: text",
    )
    outputs.add_argument(
        "--history",
        metavar="FILE",
        type=Path,
        help="note the run in this SQLite file, and show in the report how errors and times came about",
    )
    outputs.add_argument(
        "--min-checks",
        metavar="N",
        type=int,
        help="exit status 1 if fewer checks were judged; parity and ERROR are not counted",
    )


def prepare_outputs(options: argparse.Namespace) -> None:
    """See that everything the options ask for can be written, before anything is rendered.

    Raises
    ------
    InputError
        A file cannot be written, a history cannot be read, or --min-checks asks for nothing.
    """
    from comparisons.doctor import require_writable
    from comparisons.history_file import require_history

    for option, path in (("--junit", options.junit), ("--markdown", options.markdown)):
        if path is not None and path.is_dir():
            raise InputError(f"'{path}' is a folder. Name a file with {option}.")
        if path is not None:
            require_writable(path.absolute().parent, f"folder for {path.name}", option)
    if options.history is not None:
        require_history(options.history)
    if options.min_checks is not None and options.min_checks < 1:
        raise InputError(f"--min-checks is {options.min_checks}. It takes the least number of checks, 1 or more.")


def write_outputs(options: argparse.Namespace, folder: Path, results: Mapping[str, Any], status: int, say: Say) -> int:
    """Write what the options ask for; returns the exit status.

    Parameters
    ----------
    folder : that of the report, which pictures are relative to.
    results : the content of results.json.
    status : the exit status as the checks left it. With too few of them, 0 (passed) and 2 (inconclusive) become 1: the
        gate is not held. 3 and 4 stay, which say why.
    """
    from comparisons.history import read
    from comparisons.outputs.junit import junit_xml
    from comparisons.outputs.markdown import summary_of
    from comparisons.outputs.words import shortfall
    from comparisons.report.view import overview_of
    from reference.store import write_text

    is_summarised = options.markdown is not None or options.format == "github"
    if not is_summarised and options.junit is None and options.min_checks is None:
        return status
    history = read(options.history, until=results["started"]) if options.history and is_summarised else None
    overview = overview_of(results, history)
    complaint = shortfall(overview, options.min_checks)
    if options.junit is not None:
        write_text(options.junit, junit_xml(overview, folder, results.get("started") or "", complaint))
    if options.markdown is not None:
        write_text(options.markdown, summary_of(overview, complaint, GITHUB_COMMENT_CHARACTERS - SPARE_BYTES))
    if options.format == "github":
        _tell_github(overview, folder, complaint, say)
    elif complaint:
        say(complaint)
    return 1 if complaint and status in (0, 2) else status


def _tell_github(overview: "Overview", folder: Path, complaint: str, say: Say) -> None:
    """Annotate, and append the summary of the step to the file that GitHub names, if it names one."""
    from comparisons.outputs.github import annotations
    from comparisons.outputs.markdown import summary_of

    for line in annotations(overview, folder, complaint, Path(os.environ.get("GITHUB_WORKSPACE") or ".").resolve()):
        say(line)
    if named := os.environ.get("GITHUB_STEP_SUMMARY"):
        summary = Path(named)
        there = summary.stat().st_size if summary.exists() else 0
        text = summary_of(overview, complaint, GITHUB_SUMMARY_BYTES - there - SPARE_BYTES)
        with summary.open("a", encoding="utf-8") as file:
            file.write(text)
