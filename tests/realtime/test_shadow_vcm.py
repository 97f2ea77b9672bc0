"""Hard shadows against rays in float64, and each way in which a virtual cube map can be wrong."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from realtime import vcm
from realtime.frame import Frame
from realtime.technique import Technique
from realtime.techniques import shadow_vcm, technique
from scenes.image import Float32, Float64
from scenes.model import PIXEL_GRID, PointLight, Scene
from scenes.procedural import rotation_xyz
from scenes.shapes import Box

Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]
FrameWith = Callable[..., Frame]

NAMES = ("shadow.vcm", "shadow.vcm_analytic")
EVERY = pytest.mark.parametrize("name", NAMES)
CLEARED = 1e-5
"""Rays of the exact answer start this far above their surface: more than float32 misplaces what is seen."""

ROOM = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.5], "rotation_deg": [11.0, 23.0, 7.0], "material": "white"}
LAMP = [0.05, 0.1, -0.1]
BAND = 1 / shadow_vcm.REMAP_SIDE
"""How close to the edge of a cube's face counts as near a seam: half a texel of the remap cube, 8 of a tile of 1024."""


def point(position: Any) -> dict[str, Any]:
    return {"type": "point", "position": [float(x) for x in position], "intensity": [5.0, 5.0, 5.0]}


def crate(i: int, position: Any, size: Any, rotation: Any) -> dict[str, Any]:
    place = {"size": list(size), "position": [float(x) for x in position], "rotation_deg": [float(r) for r in rotation]}
    return {"name": f"crate-{i}", "type": "box", "material": "skin", **place}


def view(make_scene: MakeScene, **changed: Any) -> dict[str, Any]:
    corner = {"origin": [-1.1, 0.8, 1.1], "target": [0.2, -0.3, -0.3], "fov_deg": 80.0, "width": 64, "height": 48}
    return make_scene().sensor.model_dump() | corner | changed


@pytest.fixture
def crates(make_scene: MakeScene) -> Scene:
    """Crates at odd angles on all sides of the lamp, in a room that is tilted against the cube's axes.

    They hang around the twelve edges of the cube, so that many shadows run across seams.
    """
    rng = np.random.default_rng(4)
    edges = [d for d in np.ndindex(3, 3, 3) if d.count(1) == 1]
    directions = np.array(edges) - 1 + rng.uniform(-0.5, 0.5, (12, 3)) * (np.array(edges) == 1)
    places = LAMP + directions * rng.uniform(0.4, 0.6, (12, 1))
    sizes = [(0.15, 0.2, 0.1), (0.04, 0.6, 0.04)]
    shapes = [crate(i, p, sizes[i % 2], rng.uniform(0, 360, 3)) for i, p in enumerate(places)]
    return make_scene(sensor=view(make_scene), subject=["crate-0"], shapes=[ROOM, *shapes], emitters=[point(LAMP)])


def blocked(box: Box, starts: Float64, light: Float64) -> Any:
    """Whether the ways (N, 3) from `starts` to the light pass through a box: between its three pairs of planes."""
    turn = rotation_xyz(box.rotation_deg)
    start, end = ((p - np.array(box.position)) @ turn for p in (starts, light))
    half = np.array(box.size) / 2
    with np.errstate(divide="ignore"):
        crossings = np.stack([-half - start, half - start]) / (end - start)
    enters, leaves = crossings.min(axis=0).max(axis=1), crossings.max(axis=0).min(axis=1)
    return (enters < leaves) & (leaves > 0) & (enters < 1)


def exact(frame: Frame) -> tuple[Float64, Float64]:
    """The true visibility (H, W) of the point light at each sample that is seen, and the way (H, W, 3) to the light."""
    position = frame.read("position", 4)[..., :3].astype(float)
    normal = frame.read("face_normal", 4)[..., :3].astype(float)
    (lamp,) = (e for e in frame.scene.emitters if isinstance(e, PointLight))
    to_light = np.array(lamp.position) - position
    seen = np.einsum("hwc,hwc->hw", normal, to_light) > 0
    starts = (position + CLEARED * normal)[seen]
    for box in frame.scene.shapes:
        if isinstance(box, Box):
            seen[seen] = clear = ~blocked(box, starts, np.array(lamp.position))
            starts = starts[clear]
    return seen.astype(float), to_light


def pixels(samples: Float64) -> Float64:
    """The means (H, W) over pixels."""
    height, width = (n // PIXEL_GRID for n in samples.shape)
    means: Float64 = samples.reshape(height, PIXEL_GRID, width, PIXEL_GRID).mean(axis=(1, 3))
    return means


@dataclass(frozen=True)
class Truth:
    """Exact visibility of samples, and which of them see the light along a way near the edge of a cube's face."""

    seen: Float64
    near_seam: Float64


@dataclass(frozen=True)
class Judged:
    """A technique's visibility of samples beside the exact one."""

    given: Float64
    exact: Truth

    @property
    def difference(self) -> Float64:
        return pixels(self.given - self.exact.seen)

    @property
    def misclassified(self) -> float:
        return float(np.abs(self.difference).mean())

    @property
    def misclassified_near_seams(self) -> float:
        return float(np.abs(self.given - self.exact.seen)[self.exact.near_seam > 0].mean())

    @property
    def is_edge(self) -> Any:
        """Pixels through which the edge of a shadow or of a lit surface runs."""
        truth = pixels(self.exact.seen)
        return (truth > 0) & (truth < 1)


@pytest.fixture(scope="module")
def truths() -> dict[str, Truth]:
    """What has been computed for one test serves the others."""
    return {}


@pytest.fixture
def judge(frame_with: FrameWith, truths: dict[str, Truth]) -> Callable[..., Judged]:
    def run(scene: Scene, name: str, **settings: Any) -> Judged:
        frame = frame_with(scene, name, "image", **settings)
        key = repr((scene.shapes, scene.emitters, scene.sensor))
        if key not in truths:
            seen, to_light = exact(frame)
            size = np.sort(np.abs(to_light), axis=-1)
            truths[key] = Truth(seen, (size[..., 1] > (1 - BAND) * size[..., 2]).astype(float))
        given = frame.read("visibility", 4)[..., 0].astype(float)
        np.testing.assert_allclose(frame.read("image", 4)[..., 0], pixels(given), atol=1e-6)
        return Judged(given, truths[key])

    return run


@pytest.mark.parametrize(("name", "bound"), [("shadow.vcm", 0.01), ("shadow.vcm_analytic", 0.006)])
def test_few_pixels_are_misclassified(crates: Scene, judge: Callable[..., Judged], name: str, bound: float) -> None:
    """At 1024² a tile: a hundredth of the pixels through which an edge runs, which are more in so small an image."""
    found = judge(crates, name)
    assert 0.2 < found.exact.seen.mean() < 0.95
    assert 0 < found.misclassified < bound * found.is_edge.mean()


@EVERY
def test_seams_are_no_worse_than_elsewhere(crates: Scene, judge: Callable[..., Judged], name: str) -> None:
    """Per pixel through which an edge runs, since more of these happen to lie near seams.

    The error of such pixels varies by about its own size: three standard errors of slack. Of other pixels next to none
    may be wrong.
    """
    found = judge(crates, name)
    near_seam = pixels(found.exact.near_seam) > 0
    near, elsewhere = (np.abs(found.difference[found.is_edge & side]) for side in (near_seam, ~near_seam))
    assert near.size > 40
    assert near.mean() < elsewhere.mean() + 3 * elsewhere.std() / np.sqrt(near.size)
    assert np.abs(found.difference[~found.is_edge & near_seam]).mean() < 1e-3


def test_taps_dip_into_the_next_tile_without_a_margin(crates: Scene, judge: Callable[..., Judged]) -> None:
    """With small tiles, so that the taps' reach of 2 texels is many pixels; the bias grows with the texels."""
    settings = {"side": 256, "rotated_taps": True, "zbias": 4e-3}
    without, usual = (judge(crates, "shadow.vcm", margin=margin, **settings) for margin in (0, 4))
    assert without.misclassified_near_seams > 5 * usual.misclassified_near_seams


def test_the_published_remap_cube_is_wrong_in_the_outer_half_texel(crates: Scene, judge: Callable[..., Judged]) -> None:
    """Beyond the last texel centre a face filtered by itself is constant: 8 texels of the map are skipped."""
    published, edge_to_edge = (judge(crates, "shadow.vcm", edge_to_edge=e) for e in (False, True))
    assert published.misclassified_near_seams > 2 * edge_to_edge.misclassified_near_seams


def test_filtering_across_seams_mixes_coordinates_of_different_tiles(
    crates: Scene, judge: Callable[..., Judged], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What OpenGL does today unless told otherwise. Squeezed lookups never reach the seams, so they do not care."""
    gl_dither = 0x0BD0
    squeezed = judge(crates, "shadow.vcm")
    monkeypatch.setattr(vcm, "_SEAMLESS_CUBE_MAPS", gl_dither)
    assert judge(crates, "shadow.vcm", edge_to_edge=False).misclassified_near_seams > 0.1
    assert judge(crates, "shadow.vcm").misclassified == pytest.approx(squeezed.misclassified, rel=0.05)


def test_without_a_bias_lit_surfaces_shade_themselves(crates: Scene, judge: Callable[..., Judged]) -> None:
    assert judge(crates, "shadow.vcm", zbias=0.0).difference.mean() < -0.05


def test_with_a_large_bias_light_leaks_below_what_stands_on_the_floor(
    make_scene: MakeScene, judge: Callable[..., Judged]
) -> None:
    """The constant bias moves a receiver the more, the farther it is; the plane test moves it by a texel."""
    sensor = view(make_scene, origin=[-1.2, 1.0, 1.2], target=[0.0, -1.2, 0.0], fov_deg=50.0)
    shapes = [EMPTY, *(crate(i, (x, -1.15, z), (0.3, 0.2, 0.2), (0, 40 * i, 0)) for i, (x, z) in enumerate(FLOOR))]
    scene = make_scene(sensor=sensor, subject=["crate-0"], shapes=shapes, emitters=[point((0.1, 0.9, 0.1))])
    usual, large = (judge(scene, "shadow.vcm", zbias=zbias) for zbias in (7e-4, 3e-3))
    plane = judge(scene, "shadow.vcm_analytic")
    assert large.difference.mean() > 1e-3
    assert large.misclassified > 3 * usual.misclassified
    assert plane.misclassified < 1.2 * usual.misclassified


FLOOR = ((-0.5, -0.4), (0.5, -0.5), (0.0, 0.0), (-0.4, 0.5), (0.6, 0.4))


@pytest.mark.parametrize("side", [128, 512])
def test_no_constant_is_tuned_to_the_size_of_a_tile(crates: Scene, judge: Callable[..., Judged], side: int) -> None:
    """The error of the plane test falls with the texel; neither acne nor leaks prevail."""
    found = judge(crates, "shadow.vcm_analytic", side=side)
    assert found.misclassified < 8 / side * found.is_edge.mean()
    assert abs(found.difference.mean()) < 0.4 * found.misclassified


def test_the_slide_to_the_letter_is_wrong_nearly_everywhere(crates: Scene, judge: Callable[..., Judged]) -> None:
    assert judge(crates, "shadow.vcm_literal").misclassified > 0.3


@pytest.mark.parametrize("part", ["unpacking", "corners"])
def test_each_erratum_alone_spoils_the_shadows(
    crates: Scene, judge: Callable[..., Judged], part: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """x + y for x + y / 8, or b / N and (N - b) / N without division by 3 and 2."""
    if part == "unpacking":
        right = vcm.remap_faces
        monkeypatch.setattr(
            shadow_vcm, "literal_remap_faces", lambda *given: right(given[0], given[1], given[2], False)
        )
        assert judge(crates, "shadow.vcm_literal").misclassified > 0.3
    else:
        wrong = vcm.literal_remap_faces
        monkeypatch.setattr(shadow_vcm, "remap_faces", lambda *given: wrong(*given[:3]))
        assert judge(crates, "shadow.vcm", edge_to_edge=False).misclassified > 0.3


@pytest.mark.parametrize(("name", "zbias"), [("shadow.vcm", {"zbias": 7e-6}), ("shadow.vcm_analytic", {})])
def test_the_ratio_of_clip_planes_costs_hyperbolic_depths_of_sixteen_bits(
    crates: Scene, judge: Callable[..., Judged], name: str, zbias: dict[str, float]
) -> None:
    """1:10000, with the talk's constant bias moved as far in the world as at 1:100. Linear depths do not care."""
    coarse, fine = (judge(crates, name, far_over_near=1e4, depth_format=f, **zbias) for f in ("D16", "D24"))
    if name == "shadow.vcm":
        assert coarse.misclassified > 10 * fine.misclassified
    else:
        assert coarse.misclassified == pytest.approx(fine.misclassified, rel=0.05)
    assert fine.misclassified == pytest.approx(judge(crates, name).misclassified, rel=0.1)


@EVERY
def test_a_lamp_inside_a_crate_lights_nothing_outside(make_scene: MakeScene, draw: Draw, name: str) -> None:
    shapes = [ROOM, crate(0, LAMP, (0.3, 0.3, 0.3), (20, 30, 40))]
    scene = make_scene(sensor=view(make_scene), subject=["crate-0"], shapes=shapes, emitters=[point(LAMP)])
    assert draw(scene, name).max() == 0


EMPTY = {**ROOM, "rotation_deg": [0.0, 0.0, 0.0]}
PLACES = {
    "amid": [0.1, 0.2, -0.3],
    "on the back wall": [0.3, 0.1, -1.75],
    "a centimetre before the back wall": [0.3, 0.1, -1.74],
    "near the corner of three walls": [1.45, 1.2, -1.7],
}


def empty_room(make_scene: MakeScene, lamp: list[float]) -> Scene:
    sensor = view(make_scene, width=32, height=24)
    return make_scene(sensor=sensor, subject=["room"], shapes=[EMPTY], emitters=[point(lamp)])


@EVERY
@pytest.mark.parametrize("depth_format", ["D16", "D32F"])
@pytest.mark.parametrize("place", ["amid", "on the back wall"])
def test_an_empty_room_is_lit_everywhere(
    make_scene: MakeScene, judge: Callable[..., Judged], name: str, depth_format: str, place: str
) -> None:
    """But for the wall in whose plane the lamp lies. The farthest wall lies just before the far plane."""
    found = judge(empty_room(make_scene, PLACES[place]), name, depth_format=depth_format)
    assert found.exact.seen.max() == 1
    assert (found.exact.seen.min() == 0) == (place == "on the back wall")
    assert found.misclassified < 1e-5


@pytest.mark.parametrize("place", ["a centimetre before the back wall", "near the corner of three walls"])
def test_grazing_light_needs_the_plane_test(make_scene: MakeScene, judge: Callable[..., Judged], place: str) -> None:
    """Depth changes across a texel without limit there: a constant bias fails on whole walls, the plane in creases."""
    scene = empty_room(make_scene, PLACES[place])
    assert judge(scene, "shadow.vcm").misclassified > 0.03
    assert judge(scene, "shadow.vcm_analytic").misclassified < 5e-4


@EVERY
@pytest.mark.parametrize("depth_format", ["D16", "D32F"])
def test_what_is_beyond_the_far_plane_is_lit_where_nothing_was_drawn(
    make_scene: MakeScene, draw: Draw, name: str, depth_format: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The map is cleared to 1, and depths beyond the far plane are clamped to 1, whatever the format."""
    monkeypatch.setattr(vcm, "clip_planes", lambda meshes, place, ratio: (0.005, 0.5))
    scene = empty_room(make_scene, [0.0, 0.0, 0.0])
    assert draw(scene, name, depth_format=depth_format).min() == 1


def test_what_is_before_the_near_plane_casts_no_shadow(make_scene: MakeScene, draw: Draw) -> None:
    """The loss at 1:100 that the talk warns of; linear depths afford a near plane a hundred times as near."""
    small = crate(0, [0.1, 0.2, -0.3], (0.02, 0.02, 0.02), (0, 0, 0))
    scene = make_scene(
        sensor=view(make_scene, width=32, height=24),
        subject=["crate-0"],
        shapes=[EMPTY, small],
        emitters=[point([0.1, 0.2, -0.3])],
    )
    assert draw(scene, "shadow.vcm").mean() > 0.9
    assert draw(scene, "shadow.vcm_analytic").max() == 0


@EVERY
def test_a_sphere_light_counts_as_a_point_at_its_centre(make_scene: MakeScene, draw: Draw, name: str) -> None:
    lamp = make_scene().emitters[0].model_dump()["position"]
    bulb = {"type": "sphere", "position": lamp, "radius": 0.1, "radiance": [1.0, 1.0, 1.0]}
    small, soft = (draw(make_scene(emitters=[light]), name, side=128) for light in (point(lamp), bulb))
    np.testing.assert_array_equal(small, soft)


@EVERY
def test_where_nothing_is_seen_nothing_is_lit(make_scene: MakeScene, draw: Draw, name: str) -> None:
    alone = [s.model_dump(exclude_none=True) for s in make_scene().shapes if s.name == "ball"]
    scene = make_scene(shapes=alone)
    lit = draw(scene, name, side=128)[..., 0]
    assert lit[draw(scene, "raster.coverage")[..., 0] == 0].max() == 0
    assert lit.max() == 1


@pytest.mark.parametrize("name", [*NAMES, "shadow.vcm_literal"])
def test_both_sides_average_the_same_positions(name: str) -> None:
    used: Technique = technique(name)
    assert (used.grid, used.channels, used.approximates) == (PIXEL_GRID, (0,), "visibility")
