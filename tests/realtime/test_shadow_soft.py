"""Soft shadows against closed forms, and the traps of how they are made."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from realtime.render import Rendering
from realtime.techniques import technique
from realtime.techniques.shadow_soft import ball_points, pcss_rmse, points_for
from scenes.errors import InputError
from scenes.image import Float32, Float64
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl

Draw = Callable[..., Float32]
Render = Callable[..., Rendering]
MakeScene = Callable[..., Scene]

METHODS = pytest.mark.parametrize("method", ["pcss", "lights"])


def segment(x: Any) -> Float64:
    """The part of a unit disk's area on one side of a line at the signed distance x from its centre."""
    x = np.clip(np.asarray(x, dtype=float), -1, 1)
    part: Float64 = 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi
    return part


def surface_points(count: int) -> Float64:
    """Evenly spread over the unit sphere: a spherical Fibonacci lattice."""
    i = np.arange(count)
    z, angle = 1 - (2 * i + 1) / count, i * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def projection_error(points: Float64) -> float:
    """Root mean square error, over planes, of the part of the points beyond a plane against that of a disk."""
    along = np.sort(points @ surface_points(200).T, axis=0)
    middles = (np.arange(len(points)) + 0.5)[:, None] / len(points)
    return float(np.sqrt(np.mean((segment(along) - middles) ** 2)))


def test_points_in_the_ball_look_like_a_disk_from_everywhere_and_points_on_it_do_not() -> None:
    """Points thrown at random would have sqrt(1 / 6 N): 0.144, 0.072, 0.036.

    A sphere's points project evenly (Archimedes): they differ from the disk by 0.04 however many they are.
    """
    x = np.linspace(-1, 1, 2001)
    archimedes = float(np.sqrt(np.mean((segment(x) - (1 + x) / 2) ** 2)))
    assert archimedes > 0.03
    assert projection_error(surface_points(4096)) == pytest.approx(archimedes, rel=0.02)
    for count, bound in ((8, 0.07), (32, 0.027), (128, 0.011)):
        assert projection_error(ball_points(count)) < bound


def test_points_are_as_dense_as_one_over_the_root() -> None:
    """The mean of r² is 3/4; that of a full ball is 3/5, of the surface 1."""
    points = ball_points(128)
    assert np.mean(np.sum(points**2, axis=1)) == pytest.approx(0.75, abs=0.02)
    np.testing.assert_allclose(points.mean(axis=0), 0, atol=0.01)


def light(position: tuple[float, float, float], radius: float) -> dict[str, Any]:
    if radius == 0:
        return {"type": "point", "position": list(position), "intensity": [1.0] * 3}
    return {"type": "sphere", "position": list(position), "radius": radius, "radiance": [1.0] * 3}


LEVEL = {"type": "rectangle", "rotation_deg": [-90.0, 0.0, 0.0], "material": "white"}
FLOOR = LEVEL | {"name": "floor", "size": [8.0, 8.0]}
CARD = LEVEL | {"name": "card", "size": [4.0, 8.0], "position": [-2.0, 1.0, 0.0]}
DOWN = {"type": "perspective", "origin": [0.0, 0.5, 0.0], "target": [0.0, 0.0, 0.0], "up": [0.0, 0.0, -1.0]}


ROOM: list[dict[str, Any]] = [
    {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white"},
    {"name": "ball", "type": "sphere", "radius": 0.3, "detail": 3, "position": [0.1, 0.0, 0.0], "material": "skin"},
]


@pytest.fixture
def edge(make_scene: MakeScene) -> Callable[[float], tuple[Scene, Float64]]:
    """A card that covers x < 0 one metre above the floor, a light at three; what the floor sees of it, by column."""

    def make(radius: float) -> tuple[Scene, Float64]:
        sensor = DOWN | {"fov_deg": 60.0, "width": 48, "height": 8}
        scene = make_scene(
            subject=["card"], sensor=sensor, shapes=[FLOOR, CARD], emitters=[light((0.0, 3.0, 0.0), radius)]
        )
        columns = (np.arange(48 * 32) + 0.5) / (24 * 32) - 1
        x = 0.5 * np.tan(np.radians(30)) * columns
        seen = segment(2 * x / np.sqrt(1 + x * x) / radius)
        return scene, seen.reshape(48, 32).mean(axis=1)

    return make


@pytest.mark.parametrize("radius", [0.05, 0.3])
@METHODS
def test_the_penumbra_of_an_edge_is_the_segment_of_a_disk(
    edge: Callable[[float], tuple[Scene, Float64]],
    draw: Draw,
    monkeypatch: pytest.MonkeyPatch,
    radius: float,
    method: str,
) -> None:
    """64 points are right to 0.016, by their projections; at one edge the filter has no distances to mix up."""
    scene, truth = edge(radius)
    monkeypatch.setattr("realtime.techniques.shadow_soft.points_for", lambda wanted, pixels: 64)
    made = draw(scene, "shadow.soft", method=method, side=1024)[..., 0]
    penumbra = (truth > 0.02) & (truth < 0.98)
    assert np.sqrt(np.mean((made - truth)[:, penumbra] ** 2)) < 0.016
    assert made[:, 0].max() == 0
    assert made[:, -1].min() == pytest.approx(1, abs=1e-6)


def test_points_on_the_surface_of_the_ball_give_another_penumbra(
    edge: Callable[[float], tuple[Scene, Float64]], draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, truth = edge(0.3)
    monkeypatch.setattr("realtime.techniques.shadow_soft.points_for", lambda wanted, pixels: 128)
    penumbra = (truth > 0.02) & (truth < 0.98)

    def error() -> float:
        made = draw(scene, "shadow.soft", method="lights")[..., 0]
        return float(np.sqrt(np.mean((made - truth)[:, penumbra] ** 2)))

    assert error() < 0.011
    monkeypatch.setattr("realtime.techniques.shadow_soft.ball_points", surface_points)
    assert error() > 0.03


@pytest.mark.parametrize("method", ["auto", "pcss", "lights"])
def test_a_tiny_ball_is_a_point(make_scene: MakeScene, draw: Draw, method: str) -> None:
    place = (0.7, 0.9, 0.8)
    hard = draw(make_scene(emitters=[light(place, 0.0)]), "shadow.soft", method=method)
    tiny = draw(make_scene(emitters=[light(place, 1e-6)]), "shadow.soft", method=method)
    assert 0.2 < hard.mean() < 0.95
    np.testing.assert_allclose(tiny, hard, atol=2e-3)


@METHODS
@pytest.mark.parametrize("radius", [0.02, 0.4])
def test_a_light_is_not_shaded_by_its_own_ball(make_scene: MakeScene, draw: Draw, method: str, radius: float) -> None:
    sensor = DOWN | {"fov_deg": 60.0, "width": 8, "height": 8}
    scene = make_scene(subject=["floor"], sensor=sensor, shapes=[FLOOR], emitters=[light((0.1, 1.0, 0.2), radius)])
    assert draw(scene, "shadow.soft", method=method).min() == pytest.approx(1, abs=1e-6)


@METHODS
@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_within_a_mesh_a_light_is_seen_by_nobody_outside(
    make_scene: MakeScene, draw: Draw, method: str, radius: float
) -> None:
    """But for a few thousandths, where the plane of what is seen edge on cuts the mesh around the light."""
    case = {"name": "case", "type": "box", "size": [0.3, 0.3, 0.3], "position": [-0.9, 0.0, 0.5], "material": "white"}
    scene = make_scene(shapes=[*ROOM, case], emitters=[light((-0.9, 0.0, 0.5), radius)])
    assert draw(scene, "shadow.soft", method=method).max() < 4e-3


@METHODS
def test_a_ball_that_dips_into_the_ceiling(
    make_scene: MakeScene, draw: Draw, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    """From the floor below it all of it is seen; the ceiling sees what of its disk is on its own side.

    The way to a point of the light ends where it meets the ball, so what of the ceiling lies in it hides nothing.
    """
    monkeypatch.setattr("realtime.techniques.shadow_soft.points_for", lambda wanted, pixels: 64)
    lamp = light((1.0, 1.2, -1.0), 0.1)
    below = {"type": "perspective", "origin": [1.0, 0.5, -1.0], "target": [1.0, -1.0, -1.0], "up": [0.0, 0.0, 1.0]}
    floor = make_scene(sensor=below | {"fov_deg": 5.0, "width": 4, "height": 4}, shapes=ROOM, emitters=[lamp])
    assert draw(floor, "shadow.soft", method=method).min() > 0.99
    up = {"type": "perspective", "origin": [1.0, 0.3, 0.9], "target": [1.0, 1.25, 0.9], "up": [0.0, 0.0, 1.0]}
    ceiling = make_scene(sensor=up | {"fov_deg": 5.0, "width": 4, "height": 4}, shapes=ROOM, emitters=[lamp])
    made = draw(ceiling, "shadow.soft", method=method)
    np.testing.assert_allclose(made, segment(0.5), atol=2 / 64)


@pytest.mark.parametrize("radius", [0.0, 0.005])
def test_what_is_close_to_the_light_casts(make_scene: MakeScene, draw: Draw, radius: float) -> None:
    """A card 2 cm below it, in a room of 4.9 m, shades the floor."""
    card = LEVEL | {"name": "close", "size": [0.5, 0.5], "position": [0.0, 0.98, 0.0]}
    down = DOWN | {"fov_deg": 60.0, "width": 8, "height": 8}
    scene = make_scene(sensor=down, shapes=[*ROOM, card], emitters=[light((0.0, 1.0, 0.0), radius)])
    assert draw(scene, "shadow.soft").max() == 0


@METHODS
def test_flat_surfaces_and_hollow_edges_do_not_shade_themselves(make_scene: MakeScene, draw: Draw, method: str) -> None:
    """A corner of the room that nothing stands before, at 64² texels a face."""
    sensor = {"type": "perspective", "origin": [0.5, 0.5, 0.5], "target": [-1.5, -1.25, -1.5], "fov_deg": 50.0}
    scene = make_scene(
        subject=["room"],
        sensor=sensor | {"width": 16, "height": 16},
        shapes=ROOM[:1],
        emitters=[light((-0.3, -0.2, 0.9), 0.05)],
    )
    made = draw(scene, "shadow.soft", method=method, side=64)
    assert np.mean(1 - made) < 2e-3


def test_all_objects_cast_on_all_objects(make_scene: MakeScene, draw: Draw) -> None:
    """Two subjects and the room's own card, one below the other: each is shaded by the next above it."""
    shapes = [*ROOM, LEVEL | {"name": "low", "size": [1.0, 1.0], "position": [0.0, -0.8, 0.0]}]
    above = LEVEL | {"name": "above", "size": [1.5, 1.5], "position": [0.1, 0.5, 0.0]}
    sensor = {"type": "perspective", "origin": [0.1, 0.1, 1.2], "target": [0.1, -0.3, 0.0], "fov_deg": 40.0}
    emitters = [light((0.1, 1.0, 0.0), 0.05)]
    subject = ["ball", "low"]
    covered, bare = (
        draw(
            make_scene(subject=subject, sensor=sensor | {"width": 16, "height": 16}, shapes=s, emitters=emitters),
            "shadow.soft",
        )
        for s in ([*shapes, above], shapes)
    )
    ball_and_low = draw(
        make_scene(subject=subject, sensor=sensor | {"width": 16, "height": 16}, shapes=[*shapes, above]),
        "raster.coverage",
    )
    assert covered[ball_and_low == 1].max() == 0
    assert bare[ball_and_low == 1].max() > 0.9


def test_the_choice_of_the_way_is_told(make_scene: MakeScene, render: Render) -> None:
    """A point needs one map; a small ball a few; a large one the filter if that is good enough, else many maps."""

    def left_out(radius: float, wanted: float, width: int = 8) -> list[tuple[str, str]]:
        sensor = make_scene().sensor.model_dump() | {"width": width, "height": 4}
        scene = make_scene(sensor=sensor, emitters=[light((0.7, 0.9, 0.8), radius)])
        made = render(scene, "shadow.soft", wanted_rmse=wanted, side=32)
        return [(s.what, s.why) for s in made.skipped if "draws" not in s.what]

    expected = f"{pcss_rmse(0.1 / float(np.linalg.norm((0.6, 0.9, 0.8)))):.3f}"
    assert left_out(0.0, 0.02) == [("percentage-closer filter, all maps but one", "a point light has no size")]
    assert left_out(0.1, 0.04) == [("percentage-closer filter", "hard maps are quicker: 1 of them suffice")]
    ((what, why),) = left_out(0.1, 0.04, width=256)
    assert what.startswith("maps of ")
    assert why == f"one filtered map keeps to the wanted error: about {expected} of 0.04"
    assert left_out(0.1, 0.02, width=256) == [
        ("percentage-closer filter", f"its error is about {expected}, 0.02 is wanted")
    ]


def test_culling_changes_no_bit(make_scene: MakeScene, render: Render, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = make_scene(emitters=[light((0.7, 0.9, 0.8), 0.1)])
    culled = render(scene, "shadow.soft")
    assert culled.skipped[-1].what.endswith("draws into the faces of the maps")
    monkeypatch.setattr("realtime.techniques.shadow_soft.is_outside", lambda camera, corners: False)
    whole = render(scene, "shadow.soft")
    assert len(whole.skipped) == len(culled.skipped) - 1
    np.testing.assert_array_equal(culled.image.pixels, whole.image.pixels)


def test_a_smaller_wanted_error_takes_more_points() -> None:
    counts = [points_for(wanted, 5.0) for wanted in (0.012, 0.015, 0.02, 0.04, 1.0)]
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 1
    assert points_for(0.02, 0.0) == 1
    assert points_for(0.02, 1e6) < 64


def test_lights_that_are_not_one_are_refused(make_scene: MakeScene) -> None:
    two = make_scene(emitters=[light((0.7, 0.9, 0.8), 0.1), light((-0.7, 0.9, 0.8), 0.0)])
    for name in ("shadow.soft", "shadow.soft_talk"):
        used = technique(name)
        with pytest.raises(InputError, match="2 point or sphere lights"):
            used.passes(two, None, used.settings({}))  # type: ignore[arg-type]


def test_a_map_that_no_texture_can_hold_is_refused(
    gl: "moderngl.Context", make_scene: MakeScene, draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(gl.info, "GL_MAX_TEXTURE_SIZE", 2048)
    with pytest.raises(InputError, match=r"Set side to 341 or less"):
        draw(make_scene(), "shadow.soft", side=342)
