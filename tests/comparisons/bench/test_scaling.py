from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from comparisons.bench import scaling
from comparisons.bench.result import Scaling
from comparisons.bench.scaling import LONGEST_FRAME, LONGEST_START, Measured, scalings
from comparisons.bench.sizes import AXES
from realtime.technique import Technique
from realtime.techniques import technique
from scenes.errors import InputError
from scenes.load import find_scene, load_scene
from scenes.model import Scene

ROOM = load_scene(find_scene("small-room-ellipsoid"))
PROBE = technique("indirect.probe")


@dataclass
class Said:
    """What was told of the measuring."""

    steps: list[str]
    skipped: list[tuple[str, str]]

    def laws(self, *axes: str) -> list[Scaling]:
        return scalings(ROOM, PROBE, {}, axes, self.steps.append, lambda what, why: self.skipped.append((what, why)))


@pytest.fixture
def said() -> Said:
    return Said([], [])


@pytest.fixture
def takes(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Makes every frame of n pixels, triangles or lights take seconds(n), and what comes before it start(n)."""

    def make(seconds: Any, start: Any = lambda size: 0.0) -> None:
        def time_of(scene: Scene, size: float, technique: Technique, settings: Any) -> Measured:
            return Measured(size, seconds(size), start(size))

        monkeypatch.setattr(scaling, "_time_of", time_of)

    return make


def test_the_law_of_each_axis_is_found(said: Said, takes: Any) -> None:
    takes(lambda size: 1e-6 * size**0.9)
    pixels, triangles = said.laws("pixels", "triangles")
    assert (pixels.axis, triangles.axis) == ("pixels", "triangles")
    assert [law.exponent.value for law in (pixels, triangles)] == pytest.approx([0.9, 0.9])
    assert pixels.sizes == (256**2, 512**2, 1024 * 768, 1280 * 1024, 1920 * 1080)
    assert pixels.seconds == tuple(1e-6 * size**0.9 for size in pixels.sizes)
    assert (pixels.scene, pixels.technique) == ("small-room-ellipsoid", "indirect.probe")
    assert said.steps[0] == "small-room-ellipsoid, indirect.probe: pixels, 65536"
    assert said.skipped == []


def test_sizes_that_would_take_too_long_are_left_out(said: Said, takes: Any) -> None:
    takes(lambda size: size / (1024 * 768) * 0.8 * LONGEST_FRAME)  # 1280 x 1024 would take a third longer than that
    (law,) = said.laws("pixels")
    assert law.sizes[-1] == 1024 * 768
    ((what, why),) = said.skipped
    assert what == "small-room-ellipsoid, indirect.probe: pixels"
    assert why.startswith("1.31072e+06: a frame would take about 6.7 s, more than 5 s")


def test_so_are_those_that_would_take_too_long_to_prepare(said: Said, takes: Any) -> None:
    takes(lambda size: 0.01, lambda size: size / 512**2 * LONGEST_START)
    assert said.laws("pixels") == []
    assert "preparing a frame would take about 90 s" in said.skipped[0][1]
    assert said.skipped[0][1].endswith("A power law takes 3 sizes; here it would be 2.")


def test_what_a_technique_refuses_is_its_reason(said: Said, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(scene: Scene, size: float, technique: Technique, settings: Any) -> Measured:
        if size > 1:
            raise InputError("Only one light is allowed.")
        return Measured(size, 0.01, 0.0)

    monkeypatch.setattr(scaling, "_time_of", refuse)
    assert said.laws("lights") == []
    reason = "Only one light is allowed. A power law takes 3 sizes; here it would be 1."
    assert said.skipped == [("small-room-ellipsoid, indirect.probe: lights", reason)]


def test_frames_are_really_drawn(said: Said, monkeypatch: pytest.MonkeyPatch, gl: Any) -> None:
    def tiny(scene: Scene, folder: Path) -> Iterator[tuple[float, Scene]]:
        for side in (8, 16, 32):
            sensor = scene.sensor.model_copy(update={"width": side, "height": side})
            yield side**2, scene.model_copy(update={"sensor": sensor})

    monkeypatch.setitem(AXES, "pixels", tiny)
    monkeypatch.setattr(scaling, "PATIENCE", 0.05)
    (law,) = scalings(ROOM, technique("raster.depth"), {}, ["pixels"], said.steps.append)
    assert law.sizes == (64, 256, 1024)
    assert all(0 < seconds < 60 for seconds in law.seconds)
