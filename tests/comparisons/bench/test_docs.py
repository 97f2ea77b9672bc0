"""docs/bench.md: its commands are understood, its full-screen eye is one, its plots show its numbers."""

import json
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons.bench.claims import claims
from comparisons.bench.machine import doubts
from comparisons.bench.result import bench_of
from comparisons.cli import _parser
from comparisons.report.bench_page import write_bench_page
from realtime.render import Renderer
from realtime.techniques import technique
from scenes.load import load_scene

DOCS = Path(__file__).parents[3] / "docs"
TEXT = (DOCS / "bench.md").read_text(encoding="utf-8")
BLOCKS = "".join(re.findall(r"^```sh\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)).replace("\\\n", "")
COMMANDS = re.findall(r"lightgauge bench.*", BLOCKS)


def test_all_commands_are_found() -> None:
    assert len(COMMANDS) == BLOCKS.count("lightgauge") > 5


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_is_understood(command: str) -> None:
    options = _parser().parse_args(shlex.split(command, comments=True)[1:])
    assert callable(options.command)


def test_every_pixel_sees_the_eye_and_seven_of_ten_its_iris(gl: Any) -> None:
    renderer = Renderer(load_scene(DOCS / "examples" / "full-screen-eye.toml"))
    coverage, iris_uv = (
        renderer.render(technique(name), {}, timed=False).image.pixels for name in ("raster.coverage", "cornea.talk_uv")
    )
    assert coverage.min() == 1
    assert (iris_uv.sum(axis=-1) > 0).mean() == pytest.approx(0.7, abs=0.05)


def test_the_branch_changes_no_pixel(gl: Any) -> None:
    renderer = Renderer(load_scene(DOCS / "examples" / "full-screen-eye.toml"))
    with_it, without = (
        renderer.render(technique("cornea.talk"), {"branching": branching}, timed=False).image.pixels
        for branching in (True, False)
    )
    assert np.allclose(with_it, without, rtol=1e-4)


def test_the_measured_plots_are_those_of_the_measured_numbers(tmp_path: Path) -> None:
    measured = DOCS / "results" / "nvidia-h200"
    write_bench_page(tmp_path, json.loads((measured / "bench.json").read_text(encoding="utf-8")))
    shown = re.findall(r"results/nvidia-h200/(plots/\S+\.svg)", TEXT)
    assert len(shown) == len(list((measured / "plots").iterdir())) > 0
    for plot in shown:
        assert (measured / plot).read_bytes() == (tmp_path / plot).read_bytes()


def test_the_measured_sentences_are_those_of_the_measured_numbers() -> None:
    content = json.loads((DOCS / "results" / "nvidia-h200" / "bench.json").read_text(encoding="utf-8"))
    measured = bench_of(content)
    assert measured.claims == claims(measured.points, measured.traced, measured.slopes)
    assert tuple(measured.environment["doubts"]) == tuple(doubts(dict(measured.environment), is_software=False))
