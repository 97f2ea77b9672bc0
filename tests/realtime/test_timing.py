"""Later frames: what is drawn again, what is not, and what is counted."""

import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realtime.graph import Pass, plan
from realtime.instrument import Instrument
from realtime.own import load_own
from realtime.render import Renderer
from realtime.techniques import MODULES, OWN, technique
from realtime.timing import Prepared, median_interval
from scenes.errors import InputError, RenderError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.model import PIXEL_GRID, Scene
from tests.realtime.samples import CAPTURE, SCENES, SETTINGS, small

MakeScene = Callable[..., Scene]


@cache
def renderer_for(family: str) -> Renderer:
    return Renderer(small(SCENES[family]))


def prepared_for(name: str) -> Prepared:
    return renderer_for(name.partition(".")[0]).prepared(technique(name), SETTINGS.get(name, {}))


@pytest.fixture(scope="module")
def other() -> Prepared:
    """A technique that binds and sets nearly everything, to draw in between."""
    return Renderer(small("shadow-room-10cm")).prepared(technique("lighting.talk"), {"side": 16})


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name.startswith("character.") else ()) for name in MODULES]
)
def test_later_frames_show_what_the_first_one_shows(name: str, other: Prepared) -> None:
    """Bit by bit, though the baked passes do not run again, and another technique draws in between."""
    prepared = prepared_for(name)
    assert np.any(prepared.rendering.image.pixels)
    for _ in range(2):
        other.frame()
        sample = prepared.frame()
        np.testing.assert_array_equal(prepared.pixels(), prepared.rendering.image.pixels)
    assert sample.passes.keys() == prepared.rendering.pass_seconds.keys()
    assert not sample.passes.keys() & prepared.rendering.baked_seconds.keys()
    assert sample.wall_seconds >= sample.seconds == sum(sample.passes.values()) > 0


@pytest.mark.parametrize("name", MODULES)
def test_what_is_baked_needs_only_what_is_baked(name: str) -> None:
    """Else it would change with what it reads."""
    renderer, used = renderer_for(name.partition(".")[0]), technique(name)
    settings = used.settings(SETTINGS.get(name, {}))
    features = features_of(renderer.scene, geometry_of(renderer.scene))
    passes = plan(used.passes(renderer.scene, features, settings), "image").passes
    moving = {resource for step in passes if not step.is_baked for resource in step.writes}
    for step in passes:
        if step.is_baked:
            assert not moving & {*step.reads, *step.uses}, step.name


def test_baked_passes_are_those_that_the_camera_and_the_lights_leave_alone() -> None:
    """You should see the expensive parts of precomputed transport, and nothing that shades."""
    baked = {
        "indirect.grid": {
            "capture",
            "reduce",
            "subject surfels",
            "transfer",
            "transport",
            "own transport",
            "place probes",
        },
        "cornea.anatomical_iris": {"iris exchange"},
        "shadow.vcm": {"remap cube"},
        "shadow.vcm_analytic": set(),
        "translucency.additive": {"slab tables"},
        "translucency.talk": {"lookup"},
    }
    for name, expected in baked.items():
        prepared = prepared_for(name)
        assert set(prepared.rendering.baked_seconds) == expected


def test_what_is_spent_once_is_kept_apart() -> None:
    name = "indirect.grid"
    prepared = prepared_for(name)
    start, rendering = prepared.start_seconds, prepared.rendering
    assert list(start) == ["compile", "upload", "bake", "first frame"]
    assert all(seconds > 0 for seconds in start.values())
    assert start["bake"] == sum(rendering.baked_seconds.values())
    assert start["first frame"] == sum(rendering.pass_seconds.values()) == rendering.seconds


def test_a_rendering_is_timed_by_its_second_frame(make_scene: MakeScene) -> None:
    rendered = Renderer(make_scene()).render(technique("indirect.probe"), CAPTURE)
    assert set(rendered.baked_seconds) == {"capture", "reduce", "transport"}
    assert rendered.seconds == sum(rendered.pass_seconds.values())


def test_peak_memory_is_that_of_the_formats(make_scene: MakeScene) -> None:
    """Three float targets and depth at PIXEL_GRID x PIXEL_GRID samples a pixel, the image, and the meshes."""
    scene = make_scene()
    prepared = Renderer(scene).prepared(technique("raster.normal"), {})
    samples, pixels = PIXEL_GRID**2 * 16 * 12, 16 * 12
    meshes = geometry_of(scene)
    surfaces = sum(32 * len(mesh.surface.positions) + 12 * len(mesh.surface.faces) for mesh in meshes)
    textures = len(meshes) * 2 * 3 * 4
    expected = samples * (3 * 16 + 4) + pixels * 16 + surfaces + textures
    assert prepared.peak_bytes == expected
    for _ in range(3):
        prepared.frame()
    assert prepared.peak_bytes == expected


def test_passes_can_be_left_out(make_scene: MakeScene) -> None:
    renderer, used = Renderer(make_scene()), technique("indirect.irradiance")
    whole = renderer.prepared(used, CAPTURE).rendering
    less = renderer.prepared(used, CAPTURE, without=["bounce"]).rendering
    assert "transport" not in less.baked_seconds
    assert ("bounce", "switched off") in [(skip.what, skip.why) for skip in less.skipped]
    assert less.image.pixels.mean() < whole.image.pixels.mean()


def test_without_shadows_more_light_comes_back(make_scene: MakeScene) -> None:
    renderer, used = Renderer(make_scene()), technique("indirect.irradiance")
    whole = renderer.prepared(used, CAPTURE).rendering.image.pixels
    less = renderer.prepared(used, CAPTURE, without=["shadow atlas"]).rendering.image.pixels
    assert less.mean() > whole.mean()


def test_what_a_technique_needs_cannot_be_left_out(make_scene: MakeScene) -> None:
    renderer, used = Renderer(make_scene()), technique("indirect.probe")
    with pytest.raises(RenderError, match=r"indirect.probe.* without capture: .*'cube'"):
        renderer.prepared(used, CAPTURE, without=["capture"])
    with pytest.raises(InputError, match=r"no pass 'gbufer'. It has: gbuffer, capture"):
        renderer.prepared(used, CAPTURE, without=["gbufer"])


def test_an_instrument_watches_one_frame_alone(make_scene: MakeScene) -> None:
    class Watch(Instrument):
        def __init__(self) -> None:
            self.seen: list[str] = []

        def begin(self, frame: Any) -> None:
            self.seen.append("begin")

        def after_pass(self, step: Pass, frame: Any) -> None:
            self.seen.append(step.name)

    watch = Watch()
    rendered = Renderer(make_scene(), watch).render(technique("raster.normal"), {})
    assert watch.seen == ["begin", "gbuffer", "resolve"]
    assert rendered.seconds > 0


OWN_TECHNIQUE = """
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.technique import Technique

TECHNIQUES = {"mine.normal": Technique("mine.normal", "normal", "normals", "me", "none",
    lambda scene, features, settings: [gbuffer_pass(), resolve_pass("normal")])}
"""


@pytest.fixture
def own(tmp_path: Path) -> Iterator[str]:
    (tmp_path / "mine.py").write_text(OWN_TECHNIQUE, encoding="utf-8")
    (name,) = load_own(tmp_path / "mine.py")
    yield name
    OWN.clear()


def test_a_users_passes_are_timed_as_a_whole_on_a_gpu(
    make_scene: MakeScene, own: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They may submit work past the methods of the frame."""
    monkeypatch.setattr("realtime.clock.is_software", lambda renderer: False)
    renderer = Renderer(make_scene())
    assert renderer.prepared(technique(own), {}).clock == "GPU timer queries around whole passes"
    assert renderer.prepared(technique("raster.normal"), {}).clock == "GPU timer queries"


def test_queries_are_taken_of_real_submissions(make_scene: MakeScene, monkeypatch: pytest.MonkeyPatch) -> None:
    """llvmpipe's are wrong, but it has them; the image is the same."""
    monkeypatch.setattr("realtime.clock.is_software", lambda renderer: False)
    prepared = Renderer(make_scene()).prepared(technique("indirect.irradiance"), CAPTURE)
    sample = prepared.frame()
    assert all(seconds >= 0 for seconds in sample.passes.values())
    assert sample.seconds > 0
    np.testing.assert_array_equal(prepared.pixels(), prepared.rendering.image.pixels)


@pytest.mark.parametrize(("count", "rank"), [(1, 1), (5, 1), (6, 1), (8, 1), (9, 2), (20, 6), (25, 8), (100, 40)])
def test_the_interval_of_a_median_has_the_ranks_of_the_table(count: int, rank: int) -> None:
    """Conover 1999, table A3: the largest rank whose interval misses the median in 5 % of all cases at most."""
    values = [float(v) for v in np.random.default_rng(count).permutation(count)]
    assert median_interval(values) == (rank - 1.0, float(count - rank))
    missed = 2 * sum(math.comb(count, k) for k in range(rank)) / 2**count
    assert missed <= 0.05 or rank == 1
    assert missed + 2 * math.comb(count, rank) / 2**count > 0.05
