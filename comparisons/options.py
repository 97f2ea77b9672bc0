"""What the commands of the command line share: how they are declared, and the options that several of them have.

A command is a module of `comparisons.commands` with `register`, which declares its options, and a function that gets
them and a way to say lines, and returns the exit status.
"""

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path

Say = Callable[[str], None]
"""Takes a line of text for the user."""

Command = Callable[[argparse.Namespace, Say], int]


class Commands:
    """The commands of a parser, each with an example in its help."""

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        self._commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    def add(self, name: str, command: Command, summary: str, *examples: str) -> argparse.ArgumentParser:
        added = self._commands.add_parser(
            name,
            help=summary,
            description=summary,
            epilog="\n  ".join([f"example{'s' if len(examples) > 1 else ''}:", *examples]),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        added.set_defaults(command=command)
        return added


def add_selection(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scenes",
        nargs="*",
        metavar="SCENE",
        help="a name, a path to a TOML file, a folder of them, or a pattern such as 'eye-*'; all shipped ones if none",
    )
    add_keep(parser)


def add_keep(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-k",
        dest="keep",
        metavar="EXPR",
        default="",
        help="only checks whose scene/technique, effect or quantity contains this; or 'shadow and not (soft or talk)'; "
        "$ is the end of a name",
    )


def add_techniques(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--technique",
        dest="techniques",
        metavar="FILE",
        type=Path,
        action="append",
        default=[],
        help="a technique of your own: a Python file, a fragment shader or a look (docs/your-technique.md); repeatable",
    )


def add_own(parser: argparse.ArgumentParser) -> None:
    add_techniques(parser)
    parser.add_argument(
        "--budget",
        dest="budgets",
        metavar="METRIC=MAX",
        action="append",
        default=[],
        help="hold your own techniques against this, or METRIC=MIN..MAX, instead of the best that ships; one bound "
        "of a bias holds in either direction; repeatable",
    )


def add_store(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--store",
        metavar="FOLDER",
        type=Path,
        default=Path(".lightgauge"),
        help="where truth is kept between runs; default: .lightgauge",
    )


def say_all(say: Say, lines: Iterable[str]) -> None:
    for line in lines:
        say(line)
