"""Measure how long runs take."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say, add_selection, add_store, say_all
from scenes.errors import InputError


def register(commands: Commands) -> None:
    profile = commands.add(
        "profile",
        measure,
        "measure how long runs take here: warm, and after a change to a shader, a budget, a scene",
        "lightgauge profile 'small-room-*'",
        "lightgauge profile --cold --write docs/speed.md",
    )
    add_selection(profile)
    add_store(profile)
    profile.add_argument(
        "--cold", action="store_true", help="begin with an empty store, and tell how long that takes (minutes)"
    )
    profile.add_argument(
        "--write", metavar="FILE", type=Path, help="put the table between the marks of this Markdown file"
    )


def measure(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.profile import profile_lines, with_block
    from comparisons.progress import steps
    from reference.store import write_text

    if options.write is not None:
        with_block(_text_of(options.write), [], options.write)  # which sees that there is a place for it
    with steps(say) as step:
        lines = profile_lines(options.scenes, options.keep, options.store, options.cold, step)
    say_all(say, lines)
    if options.write is not None:
        write_text(options.write, with_block(_text_of(options.write), lines, options.write))
    return 0


def _text_of(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"'{path}' cannot be read ({error}). Name a Markdown file with --write.") from error
