"""The commands that docs/ci.md shows are commands that there are."""

import re
import shlex
from pathlib import Path

import pytest

from comparisons.cli import _parser

TEXT = (Path(__file__).parents[3] / "docs" / "ci.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(?:sh|yaml)\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


def commands() -> list[str]:
    """Each command of a block of code, folded lines joined, without what the shell adds."""
    joined = "\n".join(re.sub(r">-\n((?: +.*\n){2})", lambda m: " ".join(m[1].split()) + "\n", b) for b in BLOCKS)
    found = re.findall(r"(?:^|- |run: )(lightgauge .*)$", joined, re.MULTILINE)
    return [re.sub(r"\$\{\{.*?\}\}", "1", command).partition("||")[0] for command in found]


def test_all_of_them_are_found() -> None:
    mentioned = re.findall(r"lightgauge (?:run|report|merge|history) ", "".join(BLOCKS))
    assert len(commands()) == len(mentioned) > 6


@pytest.mark.parametrize("command", commands())
def test_a_command_is_understood(command: str) -> None:
    words = shlex.split(command, comments=True)
    assert callable(_parser().parse_args(words[1:]).command)
