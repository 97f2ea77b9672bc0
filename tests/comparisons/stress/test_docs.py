"""docs/stress.md: its commands are understood, its table tells what is documented in limits.toml."""

import re
import shlex
from pathlib import Path

import pytest

from comparisons.answers.shader_function import run_function
from comparisons.answers.stress import chosen
from comparisons.cli import _parser
from comparisons.stress.laws import RADIANCE, TOLERANCES
from comparisons.stress.limits import documented
from comparisons.stress.stresses import STRESSES
from realtime.techniques import MODULES

TEXT = (Path(__file__).parents[3] / "docs" / "stress.md").read_text(encoding="utf-8")
BLOCKS = "".join(re.findall(r"^```sh\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE))
COMMANDS = re.findall(r"lightgauge stress.*", BLOCKS)
TABLE = re.findall(r"^<!-- the table of .*? -->\n```text\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_is_understood(command: str) -> None:
    options = _parser().parse_args(shlex.split(command, comments=True)[1:])
    assert callable(options.command)
    assert chosen(options.subjects, options.stresses, options.at)
    if options.input is not None:
        assert run_function(options.subjects, options.stresses, options.input)[0]


def cells() -> dict[tuple[str, str], str]:
    """What the table says, by technique and stress."""
    assert len(TABLE) == 1
    found: dict[tuple[str, str], str] = {}
    for block in TABLE[0].split("\n\n"):
        header, *rows = block.splitlines()
        stresses = header.split()
        for row in rows:
            technique, *values = row.split()
            found |= dict(zip([(technique, stress) for stress in stresses], values, strict=True))
    return found


def test_the_table_is_of_all_techniques_and_stresses() -> None:
    assert cells().keys() == {(technique, stress) for technique in MODULES for stress in STRESSES}


def test_the_table_breaks_where_limits_are_documented() -> None:
    breaks = {key: float(value) for key, value in cells().items() if value not in ("-", "n/a") and value[0] != "("}
    assert breaks == {key: limit.magnitude for key, limit in documented().items() if key in cells()}


def test_every_stress_and_every_tolerance_is_explained() -> None:
    explained = " ".join(re.findall(r"^\| (`[^|]*) \|", TEXT, re.MULTILINE))
    assert all(f"`{name}`" in explained for name in (*STRESSES, *TOLERANCES))
    assert RADIANCE.value == 0.01
    assert "| radiance of any kind | 1 % of the mean, rms |" in TEXT
