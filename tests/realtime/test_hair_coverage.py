"""How hair is drawn: ribbons cover what the hair covers, the nearest in front; lines do not."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realtime.camera import sensor_camera
from realtime.frame import Frame
from realtime.graph import Pass, plan
from realtime.hair import Strands, hair_points_passes, samples_pass
from realtime.hair_ribbons import draw_pass, draw_ribbons, order_pass
from realtime.techniques import technique
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Bool, Float32, Float64
from scenes.model import Scene

MakeScene = Callable[..., Scene]
Draw = Callable[..., Float32]
Glsl = Callable[..., Float64]
StrandPoints = Callable[..., Float64]

SIZE = 24
PIXEL = 0.75
"""Millimetres of the meadow that a pixel spans."""

FLAT = {"type": "rectangle", "size": [16.0, 16.0]}
EYE = {"type": "perspective", "up": [0.0, 0.0, 1.0], "fov_deg": 2 * np.degrees(np.arctan(0.5 * SIZE * PIXEL / 400))}
FROM_THE_SIDE = EYE | {"origin": [0.0, -400.0, 5.0], "target": [0.0, 0.0, 5.0], "width": SIZE, "height": SIZE}


@pytest.fixture
def meadow(make_hair: MakeScene) -> MakeScene:
    """Hair on flat ground seen from the side: meadow(width in pixels, count, ground, **fields of the hair)."""

    def make(width: float, count: int, ground: dict[str, Any] = FLAT, **hair: Any) -> Scene:
        grown = {"radius": 0.5 * PIXEL * width, "count": count, "comb": [0.3, 0.0], "region": [0.0, 0.0, 1.0, 1.0]}
        return make_hair(hair=grown | hair, skin=ground, sensor=FROM_THE_SIDE)

    return make


# Ribbons.


def on_film(scene: Scene, points: Float64) -> tuple[Float64, Float64]:
    """Where places (..., 3) are seen in pixels (..., 2), x to the right, y up, and how many pixels a length spans."""
    sensor = scene.sensor
    camera = sensor_camera(sensor, 1.0, 1000.0)
    clip = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1) @ camera.matrix.T
    scale = 0.5 * sensor.width / np.tan(np.radians(sensor.fov_deg) / 2) / clip[..., 3]
    places: Float64 = (clip[..., :2] / clip[..., 3:] + 1) / 2 * np.array([sensor.width, sensor.height])
    return places, scale


def courses(points: Float64, pieces: int) -> Float64:
    """Places along Bezier curves (N, 4, 3): (N, pieces + 1, 3)."""
    t = np.linspace(0, 1, pieces + 1)
    weights = np.stack([(1 - t) ** 3, 3 * (1 - t) ** 2 * t, 3 * (1 - t) * t**2, t**3], axis=1)
    places: Float64 = np.einsum("tk,nki->nti", weights, points)
    return places


def supersampled(scene: Scene, points: Float64, side: int) -> Float64:
    """Coverage (H, W) by side x side points a pixel, of hair seen from its side and cut off straight at both ends."""
    pieces = 24
    course, scale = on_film(scene, courses(points, pieces))
    radii = scene.hair[0].radius * scale
    covered = np.zeros((SIZE * side, SIZE * side), dtype=bool)
    for line, radius in zip(course, radii.mean(axis=1), strict=True):
        for k in range(pieces):
            _cover(covered, side, line[k : k + 2], radius, _ends(line, k, pieces, radius))
    coverage: Float64 = covered.reshape(SIZE, side, SIZE, side).mean(axis=(1, 3))[::-1]
    return coverage


def _ends(line: Float64, k: int, pieces: int, radius: float) -> list[tuple[Float64, Float64]]:
    """The ends that a piece is close to: where, and which way the hair goes from there."""
    found = []
    for end, next_ in ((0, 1), (pieces, pieces - 1)):
        if np.linalg.norm(line[k] - line[end]) < 4 * radius + 1:
            found.append((line[end], line[next_] - line[end]))
    return found


def _cover(covered: Bool, side: int, piece: Float64, radius: float, ends: Sequence[tuple[Float64, Float64]]) -> None:
    """Mark the samples within `radius` of a piece of a curve, and not beyond its ends."""
    low = np.clip(np.floor((piece.min(axis=0) - radius) * side), 0, SIZE * side).astype(int)
    high = np.clip(np.ceil((piece.max(axis=0) + radius) * side), 0, SIZE * side).astype(int)
    x, y = np.meshgrid((np.arange(low[0], high[0]) + 0.5) / side, (np.arange(low[1], high[1]) + 0.5) / side)
    p, way = np.stack([x, y], axis=-1), piece[1] - piece[0]
    along = np.clip((p - piece[0]) @ way / (way @ way), 0, 1)[..., None]
    near = np.linalg.norm(p - piece[0] - along * way, axis=-1) <= radius
    for end, inward in ends:
        near &= (p - end) @ inward >= 0
    covered[low[1] : high[1], low[0] : high[0]] |= near


@pytest.mark.parametrize("width", [0.05, 0.25, 1.0, 2.0])
def test_a_single_hair_covers_its_area(
    meadow: MakeScene, draw: Draw, strand_points: StrandPoints, width: float
) -> None:
    """Width times length on the film. As one hair covers itself nowhere, this is exact: alphas add up."""
    scene = meadow(width, 1, curl=0.0)
    course, scale = on_film(scene, courses(strand_points(scene), 200))
    lengths = np.linalg.norm(np.diff(course, axis=1), axis=-1)
    area = np.sum(lengths * 2 * scene.hair[0].radius * scale.mean())
    made = draw(scene, "hair.frame_coverage", segments=64)
    assert made.sum() == pytest.approx(area, rel=0.02)


@pytest.mark.parametrize(("width", "count", "side"), [(0.05, 150, 80), (0.25, 60, 48), (1.0, 25, 16), (2.0, 12, 16)])
def test_ribbons_cover_what_hair_covers(
    meadow: MakeScene, draw: Draw, strand_points: StrandPoints, width: float, count: int, side: int
) -> None:
    """Against points in the pixel: mean 1 %, root mean square .03, where hair covers about a fourth of the image.

    Narrow hair is blended as if its place in a sample were independent of that of other hair.
    """
    scene = meadow(width, count)
    true = supersampled(scene, strand_points(scene), side)
    made = draw(scene, "hair.frame_coverage")[..., 0].astype(float)
    assert 0.1 < true.mean() < 0.5
    assert made.mean() == pytest.approx(true.mean(), rel=0.01)
    assert np.sqrt(np.mean((made - true) ** 2)) < 0.03


@pytest.mark.parametrize(
    ("width", "count", "low", "high"),
    [(0.05, 100, 3.0, 5.0), (0.25, 60, 0.7, 1.2), (1.0, 25, -0.1, 0.05), (2.0, 8, -0.5, -0.4)],
)
def test_lines_cover_a_pixel_whatever_the_hair_covers(
    meadow: MakeScene, draw: Draw, width: float, count: int, low: float, high: float
) -> None:
    """Opaque and one pixel wide: far too much of narrow hair, half of hair of two pixels."""
    scene = meadow(width, count)
    line, ribbon = (draw(scene, f"hair.{way}_coverage") for way in ("talk", "frame"))
    assert low < line.mean() / ribbon.mean() - 1 < high
    assert set(np.unique(line)) == {0.0, 1.0}


def test_a_ribbons_coverage_adds_up_to_its_width(glsl: Glsl) -> None:
    """Whatever the width, and wherever samples lie: the mean over all places is right."""
    widths = np.array([0.01, 0.3, 1.0, 1.7, 5.0])
    away = np.linspace(-4, 4, 4001)
    rows = np.zeros((len(widths) * len(away), 1, 4))
    rows[:, 0, 0], rows[:, 0, 1] = np.tile(away, len(widths)), np.repeat(widths, len(away))
    made = glsl("lib/ribbon.glsl", "r[0].x = ribbon_coverage(a[0].x, a[0].y);", rows)[:, 0, 0]
    np.testing.assert_allclose(made.reshape(len(widths), -1).sum(axis=1) * (away[1] - away[0]), widths, rtol=2e-3)
    assert made.max() <= 1


def test_a_hair_lies_between_its_ends(glsl: Glsl) -> None:
    """The overlap of a sample with the stretch between both ends, which may be shorter than a sample, or empty."""
    root, tip = (g.ravel() for g in np.meshgrid(np.linspace(-1, 2, 31), np.linspace(-1, 2, 31)))
    rows = np.zeros((len(root), 1, 4))
    rows[:, 0, 0], rows[:, 0, 1] = root, tip
    made = glsl("lib/ribbon.glsl", "r[0].x = within_ends(a[0].x, a[0].y);", rows)[:, 0, 0]
    overlap = np.maximum(np.minimum(tip, 0.5) - np.maximum(-root, -0.5), 0)
    np.testing.assert_allclose(made, overlap, atol=1e-6)


def rays_at_a_tube(start: Float64, end: Float64, radius: float, scene: Scene, side: int) -> Float64:
    """Coverage (H, W) by the outside of an open cylinder; rays that meet its inside go on."""
    camera, sensor = sensor_camera(scene.sensor, 1.0, 1000.0), scene.sensor
    ndc = (np.arange(SIZE * side) + 0.5) / (SIZE * side) * 2 - 1
    x, y = np.meshgrid(ndc, -ndc)
    tangent = np.tan(np.radians(sensor.fov_deg) / 2)
    right = np.cross(camera.forward, sensor.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, camera.forward)
    d = camera.forward + tangent * (x[..., None] * right + y[..., None] * up)
    axis = (end - start) / np.linalg.norm(end - start)
    o = camera.eye - start
    across, from_axis = d - (d @ axis)[..., None] * axis, o - (o @ axis) * axis
    a, b = np.sum(across**2, axis=-1), across @ from_axis
    root = b * b - a * (from_axis @ from_axis - radius**2)
    t = (-b - np.sqrt(np.maximum(root, 0))) / a
    along = (o + t[..., None] * d) @ axis
    hit = (root > 0) & (along >= 0) & (along <= np.linalg.norm(end - start))
    covered: Float64 = hit.reshape(SIZE, side, SIZE, side).mean(axis=(1, 3))
    return covered


@pytest.mark.parametrize("turn", [[0, 0, 0], [45, 0, 0], [-45, 0, 0], [70, 0, 0], [-70, 20, 0], [30, 40, 0]], ids=str)
def test_a_thick_hair_is_the_near_side_of_an_open_tube(
    meadow: MakeScene, draw: Draw, strand_points: StrandPoints, turn: list[float]
) -> None:
    """Four pixels wide, leaning towards the camera or away from it: rays at a cylinder are its truth.

    A flat ribbon would end at the axis' ends, where the near side of the tube is up to a radius away.
    """
    speck = {"type": "rectangle", "size": [0.01, 0.01], "rotation_deg": turn, "position": [0.0, 0.0, 5.0]}
    scene = meadow(4.0, 1, speck, curl=0.0, comb=[0.0, 0.0], spread=0.0, length=6.0)
    points = strand_points(scene)[0]
    true = rays_at_a_tube(points[0], points[3], scene.hair[0].radius, scene, 8)
    made = draw(scene, "hair.frame_coverage")[..., 0].astype(float)
    assert made.sum() == pytest.approx(true.sum(), rel=0.02)
    assert np.sqrt(np.mean((made - true) ** 2)) < 0.02


def bent(gl: Any, scene: Scene, points: Float64, segments: int) -> Float32:
    """Coverage (H, W) by samples of hairs with these control points (N, 4, 3) in place of those of a scene."""
    meshes = geometry_of(scene)
    given = technique("hair.frame_coverage").settings({"segments": segments})
    frame = Frame(gl, scene, meshes, features_of(scene, meshes), given, 4)

    def bend(frame: Frame) -> None:
        rows = np.full((len(points), 4, 4), scene.hair[0].radius, dtype=np.float32)
        rows[..., :3] = points
        colors = frame.context.buffer(reserve=16 * len(points))
        frame.resources["strands"] = Strands(frame.context.buffer(rows.tobytes()), colors, len(points))

    for step in plan([Pass("bend", bend, writes=("strands",)), samples_pass(), draw_pass(shaded=False)], "hair").passes:
        step.run(frame)
    return frame.read("hair", 4)[..., 3]


@pytest.mark.parametrize("width", [0.1, 0.5])
def test_a_hair_that_curls_back_over_its_root_is_no_thinner_there(meadow: MakeScene, gl: Any, width: float) -> None:
    """It goes on through its root's place on the film; the same curve cut in two has no end near that place."""
    b, c = np.array([12.0, 0.0, 4.0]), np.array([-4.0, 0.0, 14.0])
    d = -(b / 3 + c)  # at 0.75 the curve is where it was at 0
    root = np.array([0.0, 0.0, 6.0])
    whole = root + np.stack([0 * b, b, c, d])
    np.testing.assert_allclose(courses(whole[None], 4)[0, 3], root, atol=1e-9)
    ab, bc, cd = (whole[:-1] + whole[1:]) / 2
    halves = np.array([[whole[0], ab, (ab + bc) / 2, 0 * b], [0 * b, (bc + cd) / 2, cd, whole[3]]])
    halves[0, 3] = halves[1, 0] = (halves[0, 2] + halves[1, 1]) / 2
    scene = meadow(width, 1)
    made = bent(gl, scene, whole[None], 32)
    first, second = (bent(gl, scene, half[None], 16) for half in halves)
    (column, row), _ = on_film(scene, root)
    around = np.s_[4 * SIZE - int(4 * row) - 4 : 4 * SIZE - int(4 * row) + 4, int(4 * column) - 4 : int(4 * column) + 4]
    assert second[around].max() > 0.9 * min(4 * width, 1)
    np.testing.assert_allclose(made[around], (1 - (1 - first) * (1 - second))[around], atol=0.03)


# What hides what.


def test_hair_behind_a_wall_is_hidden(make_hair: MakeScene, draw: Draw) -> None:
    wall = {"name": "wall", "type": "box", "size": [40.0, 1.0, 40.0], "position": [0.0, -20.0, 0.0], "material": "skin"}
    ground = FLAT | {"name": "skin", "material": "skin"}
    grown = {"count": 50, "radius": 0.4, "region": [0.0, 0.0, 1.0, 1.0]}
    for name in ("hair.frame_coverage", "hair.talk_coverage"):
        seen, hidden = (
            draw(make_hair(hair=grown, sensor=FROM_THE_SIDE, shapes=shapes), name)
            for shapes in ([ground], [ground, wall])
        )
        assert seen.max() == 1
        assert not hidden.any()


def test_hair_nearer_than_all_meshes_is_seen(make_hair: MakeScene, draw: Draw) -> None:
    """The near plane lies before the meshes, and hair may stand out of them towards the camera."""
    ground = FLAT | {"name": "skin", "material": "skin"}
    speck = {"name": "speck", "type": "sphere", "radius": 0.01, "detail": 0, "material": "skin"}
    speck |= {"position": [200.0, 0.0, 59.0]}
    sensor = FROM_THE_SIDE | {"origin": [0.0, -1.0, 60.0], "target": [0.0, 0.0, 0.0], "fov_deg": 40.0}
    grown = {"count": 50, "radius": 0.4, "length": 50.0, "region": [0.0, 0.0, 1.0, 1.0]}
    for name in ("hair.frame_coverage", "hair.talk_coverage"):
        alone, beside = (
            draw(make_hair(hair=grown, sensor=sensor, shapes=shapes), name) for shapes in ([ground], [ground, speck])
        )
        assert alone.mean() > 0.1
        np.testing.assert_allclose(alone, beside, atol=0.02)


def test_hair_that_points_at_the_camera_or_lies_behind_it_does_no_harm(make_hair: MakeScene, draw: Draw) -> None:
    straight = {"count": 30, "radius": 0.4, "length": 50.0, "comb": [0.0, 0.0], "spread": 0.0, "curl": 0.0}
    straight |= {"region": [0.0, 0.0, 1.0, 1.0]}
    for height in (300.0, 30.0):
        sensor = FROM_THE_SIDE | {"origin": [0.0, 0.0, height], "target": [0.0, 0.0, 0.0], "up": [0.0, 1.0, 0.0]}
        made = draw(make_hair(hair=straight, skin=FLAT, sensor=sensor | {"fov_deg": 20.0}), "hair.frame_coverage")
        assert made.min() >= 0
        assert 0.1 < made.max() <= 1 + 1e-6


@pytest.mark.parametrize("count", [3, 100, 500])
def test_segments_are_sorted_from_the_farthest_to_the_nearest(
    make_hair: MakeScene, frame_with: Callable[..., Frame], count: int
) -> None:
    """In one block of 1024, and in several."""
    frame = frame_with(make_hair(hair={"count": count}), "hair.frame", "hair_order", segments=16)
    samples = frame.resources["hair_samples"]
    rows = np.frombuffer(samples.buffer.read(), dtype=np.float32).reshape(count, 17, 2, 4)[:, :, 0, :3]
    distance = np.linalg.norm(0.5 * (rows[:, 1:] + rows[:, :-1]) - frame.camera.eye, axis=-1).ravel()
    order = np.frombuffer(frame.resources["hair_order"].read(), dtype=np.uint32).reshape(-1, 2)[: 16 * count, 1]
    np.testing.assert_array_equal(np.sort(order), np.arange(16 * count))
    assert np.diff(distance[order]).max() < 1e-4


RED, GREEN = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


@pytest.mark.parametrize("radius", [1.0, 0.03])
@pytest.mark.parametrize("swapped", [False, True])
def test_the_nearer_hair_is_in_front(make_hair: MakeScene, gl: Any, radius: float, swapped: bool) -> None:
    """A red hair over a green one in the same place of the film: green shows through as far as red is transparent."""
    along = {"comb": [0.0, 50.0], "spread": 0.0, "curl": 0.0, "region": [0.49, 0.49, 0.51, 0.51], "material": "fibre"}
    along |= {"count": 1, "length": 8.0, "radius": radius, "seed": 3}
    specks = [
        {"name": name, "type": "rectangle", "size": [0.1, 0.1], "position": [0.0, -4.0, z], "material": "skin"}
        for name, z in (("near", 0.01), ("skin", -0.01))
    ]
    hair = [along | {"name": name, "on": name} for name in ("near", "skin")]
    sensor = FROM_THE_SIDE | {"origin": [0.0, 0.0, 400.0], "target": [0.0, 0.0, 0.0], "up": [0.0, 1.0, 0.0]}
    scene = make_hair(shapes=specks, sensor=sensor).model_copy()
    kinds = tuple(scene.hair[0].model_copy(update=_fields(h)) for h in (reversed(hair) if swapped else hair))
    made = drawn_with(gl, scene.model_copy(update={"hair": kinds}), [GREEN, RED] if swapped else [RED, GREEN])
    red, green, alpha = made[..., 0], made[..., 1], made[..., 3]
    assert red.max() == pytest.approx(1 if radius == 1 else 0.5 * 2 * radius / PIXEL * 4, abs=0.01)
    np.testing.assert_allclose(green, red * (1 - red), atol=0.02)
    np.testing.assert_allclose(alpha, 1 - (1 - red) ** 2, atol=0.02)


def _fields(hair: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in hair.items()}


def drawn_with(gl: Any, scene: Scene, colors: Sequence[tuple[float, float, float]]) -> Float32:
    """The samples (H, W, 4) of hair whose every kind has a radiance of its own."""
    meshes = geometry_of(scene)
    given = technique("hair.frame").settings({})
    frame = Frame(gl, scene, meshes, features_of(scene, meshes), given, 4)

    def paint(frame: Frame) -> None:
        strands, samples = frame.resources["strands"], frame.resources["hair_samples"]
        kind = np.frombuffer(strands.colors.read(), dtype=np.float32).reshape(-1, 4)[: strands.count, 3].astype(int)
        rows = np.zeros((strands.count, samples.per_hair, 4), dtype=np.float32)
        rows[..., :3] = np.array(colors)[kind][:, None]
        frame.resources["hair_radiance"] = frame.context.buffer(rows.tobytes())

    painted = Pass("paint", paint, reads=("strands", "hair_samples"), writes=("hair_radiance",))
    passes = [*hair_points_passes(), samples_pass(), painted, order_pass(), draw_pass(shaded=True)]
    for step in plan(passes, "hair").passes:
        step.run(frame)
    return frame.read("hair", 4)


@pytest.mark.parametrize("fails", [False, True])
def test_drawing_hair_leaves_the_state_of_the_context_as_it_was(
    make_hair: MakeScene, frame_with: Callable[..., Frame], monkeypatch: pytest.MonkeyPatch, fails: bool
) -> None:
    """Also if it fails: a triangle that is drawn next is opaque, and is cut off at the far plane."""
    frame = frame_with(make_hair(), "hair.frame_coverage", "hair_samples")
    context = frame.context
    target = context.framebuffer([frame.texture(frame.size, 4)], context.depth_renderbuffer(frame.size))
    if fails:
        monkeypatch.setattr(frame, "submit", _fail)
        with pytest.raises(RuntimeError):
            draw_ribbons(frame, frame.camera, target, shaded=False)
    else:
        draw_ribbons(frame, frame.camera, target, shaded=False)
    assert target.depth_mask
    shader = context.program(
        vertex_shader="""#version 430
            uniform float depth;
            void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, depth, 1); }
        """,
        fragment_shader="#version 430\nout vec4 color; void main() { color = vec4(1, 0, 0, 0.25); }",
    )
    array = context.vertex_array(shader, [])
    for depth, seen in ((2.0, 0.0), (0.5, 1.0)):
        target.clear()
        shader["depth"] = depth
        array.render(vertices=3)
        pixels = np.frombuffer(target.read(components=4, dtype="f4"), dtype=np.float32).reshape(-1, 4)
        np.testing.assert_allclose(pixels, np.tile([seen, 0.0, 0.0, 0.25 * seen], (len(pixels), 1)))


def _fail(*given: Any, **named: Any) -> None:
    raise RuntimeError


# Light.

WAYS = [("hair.talk", {}), ("hair.frame", {"iterations": 0, "cells": 8})]
"""What hair scatters to other hair is left out: it takes long to bake."""


@pytest.mark.parametrize(("name", "settings"), WAYS, ids=["talk", "frame"])
def test_dark_hair_is_black(make_hair: MakeScene, draw: Draw, name: str, settings: dict[str, Any]) -> None:
    assert not draw(make_hair(emitters=[], size=12), name, **settings).any()


@pytest.mark.parametrize(("name", "settings"), WAYS, ids=["talk", "frame"])
def test_the_color_of_a_hair_scales_its_light(
    make_hair: MakeScene, draw: Draw, tmp_path: Path, name: str, settings: dict[str, Any]
) -> None:
    import PIL.Image

    PIL.Image.fromarray(np.full((2, 2, 3), (255, 128, 0), dtype=np.uint8)).save(tmp_path / "color.png")
    tint = {"color": {"path": "color.png", "color_space": "linear"}}
    plain, tinted = (draw(make_hair(hair=more, size=12), name, **settings) for more in ({}, tint))
    assert plain.max() > 0
    np.testing.assert_allclose(tinted, plain * np.array([1, 128 / 255, 0]), rtol=1e-4, atol=1e-6)
