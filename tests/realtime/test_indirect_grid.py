"""The grid of probes, the transfer past the subject, and what is left out, on closed forms and against plain numpy."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.special import sph_harm_y

from realtime.frame import Frame
from realtime.graph import Plan, plan
from realtime.probe_grid import ProbeGrid, clearance, probes_enough
from realtime.render import Rendering
from realtime.subject import Transfer
from realtime.techniques import technique
from scenes.errors import InputError
from scenes.features import features_of
from scenes.image import Float32, Float64
from scenes.model import Scene
from scenes.procedural import normalised

if TYPE_CHECKING:
    import moderngl

Glsl = Callable[..., Float64]
Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]
MakeCavity = Callable[..., dict[str, Any]]
FrameWith = Callable[..., Frame]

GRID = "indirect.grid"
FAST: dict[str, Any] = {"side": 24, "block": 3, "shadow_side": 64, "subject_surfels": 64}
COARSE: dict[str, Any] = {"side": 48, "block": 4, "subject_surfels": 64}
LIGHT = {"type": "point", "position": [0.7, 0.9, 0.8], "intensity": [6.0, 5.0, 4.0]}
ROOM = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white", "walls": {"left": "red"}}
TALL = {
    "name": "ball",
    "type": "ellipsoid",
    "radii": [0.2, 0.8, 0.2],
    "detail": 4,
    "position": [0.1, 0.0, 0.0],
    "material": "skin",
}
KNOT = {
    "name": "ball",
    "type": "torus_knot",
    "radius": 0.4,
    "tube": 0.12,
    "segments": 96,
    "sides": 12,
    "position": [0.1, 0.0, 0.0],
    "material": "skin",
}


def greys(**reflectances: float) -> dict[str, Any]:
    return {name: {"type": "diffuse", "reflectance": [value] * 3} for name, value in reflectances.items()}


def harmonics(directions: Float64) -> Float64:
    """The nine real harmonics (..., 9) of glsl/lib/sh.glsl, from SciPy's complex ones."""
    polar = np.arccos(np.clip(directions[..., 2], -1, 1))
    azimuth = np.arctan2(directions[..., 1], directions[..., 0])
    made = []
    for degree, orders in ((0, (0,)), (1, (-1, 0, 1)), (2, (-2, -1, 0, 1, 2))):
        for m in orders:
            value = sph_harm_y(degree, abs(m), polar, azimuth) * (-1.0) ** m
            made.append(value.real if m == 0 else np.sqrt(2) * (value.real if m > 0 else value.imag))
    return np.stack(made, axis=-1)


def sphere_directions(count: int) -> Float64:
    """Directions (count, 3) of equal solid angles: a Fibonacci lattice."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)


def places_of(low: Float64, high: Float64, per_side: int) -> Float64:
    """Middles (n³, 3) of the cells of a box, x fastest."""
    axis = (np.arange(per_side) + 0.5) / per_side
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    made: Float64 = low + np.stack([x, y, z], axis=-1).reshape(-1, 3) * (high - low)
    return made


def coefficients_of(grid: ProbeGrid) -> Float64:
    data = np.frombuffer(grid.coefficients.read(), dtype=np.float32)
    return data.reshape(-1, 9, 4)[..., :3].astype(float)


def floats(buffer: Any, *shape: int) -> Float64:
    return np.frombuffer(buffer.read(), dtype=np.float32).astype(float).reshape(shape)


def interpolated(glsl: Glsl, field: Float64, places: Float64, box: tuple[Float64, Float64], per_side: int) -> Float64:
    """What the grid with the coefficients (n³, 9, 3) holds at places (N, 3): (N, 9, 3)."""
    rows = np.zeros((len(field), 9, 4), dtype=np.float32)
    rows[..., :3] = field
    given = np.concatenate([places, np.zeros((len(places), 1))], axis=1)[:, None]
    made = glsl(
        "indirect_grid/interpolate.glsl",
        "vec3[9] h = harmonics_at(a[0].xyz); for (int k = 0; k < 9; ++k) r[k].xyz = h[k];",
        given,
        outputs=9,
        buffers={2: rows},
        box_low=tuple(box[0]),
        box_high=tuple(box[1]),
        per_side=per_side,
    )
    return made[..., :3]


BOX = (np.array([-0.4, 0.1, 1.0]), np.array([0.3, 1.6, 1.2]))


@pytest.mark.parametrize("per_side", [1, 2, 4, 6])
@pytest.mark.parametrize("flat", [False, True])
def test_the_weights_of_the_probes_sum_to_one_everywhere(glsl: Glsl, per_side: int, flat: bool) -> None:
    """Also far outside the box, and in one that is as flat as a sheet of paper."""
    rng = np.random.default_rng(5)
    low, high = BOX[0], BOX[1] * [1, 0, 1] + BOX[0] * [0, 1, 0] if flat else BOX[1]
    places = rng.uniform(-3, 3, (200, 3))
    made = interpolated(glsl, np.ones((per_side**3, 9, 3)), places, (low, high), per_side)
    np.testing.assert_allclose(made, 1, rtol=1e-6)


@pytest.mark.parametrize("per_side", [2, 4, 6])
def test_light_that_changes_linearly_is_reproduced_between_the_probes(glsl: Glsl, per_side: int) -> None:
    rng = np.random.default_rng(6)
    slopes, level = rng.normal(size=(3, 27)), rng.normal(size=27)
    probes = places_of(*BOX, per_side)
    places = rng.uniform(probes.min(axis=0), probes.max(axis=0), (200, 3))
    field = (probes @ slopes + level).reshape(-1, 9, 3)
    made = interpolated(glsl, field, places, BOX, per_side)
    np.testing.assert_allclose(made, (places @ slopes + level).reshape(-1, 9, 3), atol=1e-5)


def solid_angles(glsl: Glsl, places: Float64, positions: Float64, normals: Float64, areas: Float64) -> Float64:
    """Mean directions and solid angles (N, 4) of surfels (N, ...) from places (N, 3)."""
    zeros = np.zeros((len(places), 1))
    given = np.stack(
        [
            np.concatenate([places, zeros], axis=1),
            np.concatenate([positions, areas[:, None]], axis=1),
            np.concatenate([normals, zeros], axis=1),
        ],
        axis=1,
    )
    body = "r[0] = seen_from(a[0].xyz, Surfel(a[1], a[2], vec4(0.0)));r[0].xyz *= band_factor(1, r[0].w);"
    return glsl("indirect_grid/seen_from.glsl", body, given)[:, 0]


def test_a_square_on_its_axis_has_its_exact_solid_angle(glsl: Glsl) -> None:
    """4 atan(h² / (d sqrt(d² + 2 h²))) with its half side h; to 0.5 % where it is taken as a disk."""
    distance = np.geomspace(1e-3, 100, 60)
    count, up = len(distance), np.array([0.0, 0.0, 1.0])
    exact = 4 * np.arctan(1 / (distance * np.sqrt(distance**2 + 2)))
    places = distance[:, None] * up
    at, normals, areas = np.zeros((count, 3)), np.tile(up, (count, 1)), np.full(count, 4.0)
    made = solid_angles(glsl, places, at, normals, areas)
    np.testing.assert_allclose(normalised(made[:, :3]), np.tile(-up, (count, 1)), atol=1e-5)
    np.testing.assert_allclose(made[:, 3], exact, rtol=0.005)
    np.testing.assert_allclose(made[distance < 8, 3], exact[distance < 8], rtol=1e-4)
    assert np.all(solid_angles(glsl, -places, at, normals, areas)[:, 3] == 0)


def test_a_cap_has_its_exact_harmonics(glsl: Glsl) -> None:
    """From a point to half the sphere and all of it: means of the Legendre polynomials, by quadrature."""
    solid_angle = np.array([1e-3, 0.5, 2 * np.pi, 9.0, 4 * np.pi])
    given = np.zeros((5, 1, 4))
    given[:, 0, 0] = solid_angle
    body = "r[0] = vec4(band_factor(0, a[0].x), band_factor(1, a[0].x), band_factor(4, a[0].x), 0.0);"
    x, weights = np.polynomial.legendre.leggauss(4)
    edge = 1 - solid_angle / (2 * np.pi)
    inside = edge[:, None] + (1 - edge[:, None]) * (x + 1) / 2
    means = [np.polynomial.legendre.Legendre.basis(n)(inside) @ weights / 2 for n in range(3)]
    made = glsl("indirect_grid/seen_from.glsl", body, given)[:, 0, :3]
    np.testing.assert_allclose(made, np.stack(means, axis=1), atol=1e-6)


@pytest.mark.parametrize("height", [1.0, 0.3, 0.1, 0.01])
def test_a_cube_of_surfels_surrounds_every_place_in_it_before_anything_is_scaled(glsl: Glsl, height: float) -> None:
    """Surfels of a side of 1/8, seen from as near as a twelfth of it: no probe has a near plane."""
    centres = (np.arange(16) + 0.5) / 8 - 1
    u, v = (w.ravel() for w in np.meshgrid(centres, centres))
    positions, normals = [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            face = np.zeros((256, 3))
            face[:, axis], face[:, axis - 1], face[:, axis - 2] = sign, u, v
            positions.append(face)
            normals.append(np.tile(-sign * np.eye(3)[axis], (256, 1)))
    place = np.tile([0.37, height - 1, -0.2], (6 * 256, 1))
    areas = np.full(len(place), 1 / 64)
    made = solid_angles(glsl, place, np.concatenate(positions), np.concatenate(normals), areas)
    assert made[:, 3].sum() == pytest.approx(4 * np.pi, rel=0.02)
    np.testing.assert_allclose((made[:, 3:] * made[:, :3]).sum(axis=0) / (4 * np.pi), 0, atol=0.02)


def cavity_with(
    make_scene: MakeScene, make_cavity: MakeCavity, light: Sequence[float], subject: dict[str, Any]
) -> Scene:
    """A small subject away from the middle of a cavity of radius 1 and reflectance 0.5, with a light of 1 W/sr."""
    return make_scene(
        materials=greys(wall=0.5, skin=0.6),
        sensor={
            "type": "perspective",
            "origin": [0.6, 0.3, 0.5],
            "target": [0.1, 0.0, 0.4],
            "fov_deg": 30.0,
            "width": 12,
            "height": 12,
        },
        shapes=[make_cavity(1.0, "wall"), subject],
        emitters=[{"type": "point", "position": list(light), "intensity": [1.0, 1.0, 1.0]}],
    )


def cavity_radiance(wall: Float64, light: Float64) -> Float64:
    """Radiance of the wall of the cavity at `wall` (N, 3): the first bounce as lit, all later ones uniform."""
    to_light = light - wall
    r = np.linalg.norm(to_light, axis=1)
    first = 0.5 / np.pi * np.sum(to_light * -wall, axis=1) / r**3
    made: Float64 = first + 0.5 * 0.5 / (1 - 0.5) / np.pi
    return made


@pytest.mark.parametrize(("distance", "loss"), [(0.5, 0.01), (0.1, 0.02), (0.02, 0.05)])
def test_probes_hold_the_exact_radiance_around_places_off_the_centre(
    make_scene: MakeScene, make_cavity: MakeCavity, frame_with: FrameWith, distance: float, loss: float
) -> None:
    """A needle, which takes hardly any light, and a light close to the wall.

    Most probes are far off the place where the cube was captured. `loss` is relative to the mean radiance; it grows
    when the hot spot gets smaller than a surfel.
    """
    needle = TALL | {
        "radii": [0.5, 0.004, 0.004],
        "detail": 2,
        "position": [0.1, 0.0, 0.3],
        "rotation_deg": [0.0, 40.0, 35.0],
    }
    light = np.array([0.0, 1.0 - distance, 0.0])
    frame = frame_with(cavity_with(make_scene, make_cavity, light.tolist(), needle), GRID, "probes", subject_surfels=16)
    grid: ProbeGrid = frame.resources["probes"]
    assert grid.per_side == 4
    directions = sphere_directions(40000)
    basis = harmonics(directions)
    low, high = frame.subject_box
    places = places_of(low, high, 4)
    exact = []
    for place in places:
        b = directions @ place
        wall = place + (-b + np.sqrt(b * b + 1 - place @ place))[:, None] * directions
        exact.append(4 * np.pi / len(directions) * cavity_radiance(wall, light) @ basis)
    expected = np.array(exact)
    made = coefficients_of(grid)
    np.testing.assert_allclose(made[..., 0], made[..., 2], rtol=1e-5)
    assert np.ptp(expected[:, 1]) > 0.05 * expected[:, 0].mean()
    assert np.abs(made[..., 0] - expected).max() < loss * expected[:, 0].mean()


def test_a_cavity_lit_from_its_middle_shows_its_closed_form(
    make_scene: MakeScene, make_cavity: MakeCavity, draw: Draw
) -> None:
    """B = rho I / (R² (1 - rho)) everywhere; a body of albedo a shows a B / pi wherever it is."""
    ball = {
        "name": "ball",
        "type": "sphere",
        "radius": 0.02,
        "detail": 3,
        "position": [0.1, 0.0, 0.4],
        "material": "skin",
    }
    scene = cavity_with(make_scene, make_cavity, [0.0, 0.0, 0.0], ball)
    scene = scene.model_copy(update={"sensor": scene.sensor.model_copy(update={"fov_deg": 2.0})})
    np.testing.assert_allclose(draw(scene, GRID), 0.6 * 0.5 / (1 - 0.5) / np.pi, rtol=0.01)


def test_the_grid_follows_light_that_changes_along_the_subject(make_scene: MakeScene, draw: Draw) -> None:
    """As gathering from every pixel does, which one probe cannot."""
    scene = make_scene(shapes=[ROOM, TALL])
    gathered = draw(scene, "indirect.irradiance", **COARSE).astype(float)
    distance = {
        probes: float(np.sqrt(np.mean((draw(scene, GRID, **COARSE, probes=probes) - gathered) ** 2)) / gathered.mean())
        for probes in (1, 2, 4)
    }
    assert distance[1] > 0.1
    assert distance[4] < 0.025
    assert distance[4] < distance[2] < distance[1]


def test_the_subject_stands_in_its_own_shadow(make_scene: MakeScene, frame_with: FrameWith) -> None:
    """The floor right below it, lit from above, gets no direct light."""
    above = LIGHT | {"position": [0.1, 1.1, 0.0]}
    frame = frame_with(make_scene(shapes=[ROOM, TALL], emitters=[above]), GRID, "lit", **FAST)
    surfels = frame.resources["surfels"]
    place = floats(surfels.buffer, -1, 3, 4)[: surfels.surroundings, 0, :3]
    radiance = floats(frame.resources["lit"], -1, 4)[: surfels.surroundings, :3]
    below = (place[:, 1] < -1.2) & (np.linalg.norm(place[:, [0, 2]] - [0.1, 0], axis=1) < 0.25)
    beside = (place[:, 1] < -1.2) & (np.linalg.norm(place[:, [0, 2]] - [0.1, 0], axis=1) > 0.8)
    assert below.any()
    assert radiance[below].max() == 0
    assert radiance[beside].min() > 0


def corner(tmp_path: Path, tall: float) -> dict[str, Any]:
    """A floor that faces +z and a wall along y that faces +x, with a vertex of the floor just before the wall."""
    corners = [(x, y, 0) for x in (0.001, 40) for y in (-40, 0, 40)]
    wall = [(0, -40, 0), (0, 40, 0), (0, 40, tall), (0, -40, tall)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners + wall]
    lines += ["f 1 4 5", "f 1 5 2", "f 2 5 6", "f 2 6 3", "f 7 8 9", "f 7 9 10"]
    (tmp_path / "corner.obj").write_text("\n".join(lines), encoding="ascii")
    return {"name": "ball", "type": "mesh", "path": "corner.obj", "material": "skin"}


FAR_ROOM = ROOM | {"size": [300.0, 300.0, 300.0]}


def transfer_of(frame: Frame) -> tuple[Float64, Any, Float64, Float64]:
    """Vectors (R, 9), hits (N, R), and places and normals (R, 3) of the receivers."""
    transfer: Transfer = frame.resources["transfer"]
    count = transfer.receivers.count
    vectors = floats(transfer.vectors, 9, count).T
    hits = np.frombuffer(transfer.hits.read(), dtype=np.int32).reshape(-1, count)
    receivers = floats(transfer.receivers.buffer, count, 2, 4)
    return vectors, hits, receivers[:, 0, :3], receivers[:, 1, :3]


def test_a_point_before_a_wall_sees_half_of_what_it_would(
    make_scene: MakeScene, frame_with: FrameWith, tmp_path: Path
) -> None:
    """Against the integral of each harmonic over the quarter of the sphere that is left, to the noise of 1024 rays."""
    scene = make_scene(shapes=[FAR_ROOM, corner(tmp_path, 40)])
    frame = frame_with(scene, GRID, "transfer", **FAST, directions=1024)
    vectors, hits, places, _ = transfer_of(frame)
    before = int(np.argmin(np.linalg.norm(places - [0.001, 0, 0], axis=1) + 1e3 * (np.arange(len(places)) < 64)))
    directions = sphere_directions(200000)
    open_part = np.maximum(directions[:, 2], 0) * (directions[:, 0] > 0)
    expected = 4 / len(directions) * open_part @ harmonics(directions)
    assert np.mean(hits[:, before] >= 0) == pytest.approx(0.5, abs=0.01)
    np.testing.assert_allclose(vectors[before], expected, atol=0.01)


def as_if_not_convex(monkeypatch: pytest.MonkeyPatch, where: str) -> None:
    monkeypatch.setattr(where, lambda *given: replace(features_of(*given), subject_is_convex=False))


def test_a_convex_subject_sees_with_the_cosine(
    make_scene: MakeScene, frame_with: FrameWith, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ramamoorthi & Hanrahan 2001: A_l / pi times the harmonic at the normal. No ray meets the subject."""
    as_if_not_convex(monkeypatch, "tests.realtime.conftest.features_of")
    frame = frame_with(make_scene(shapes=[ROOM, TALL]), GRID, "transfer", **FAST, directions=256)
    vectors, hits, _, normals = transfer_of(frame)
    assert np.all(hits[:, 64:] == -1)
    expected = harmonics(normals) * np.array([1, *[2 / 3] * 3, *[1 / 4] * 5])
    np.testing.assert_allclose(vectors[64:], expected[64:], atol=0.01)


def test_where_all_shines_alike_every_point_of_a_knot_receives_just_that(
    make_scene: MakeScene, frame_with: FrameWith
) -> None:
    """Whatever the subject hides, it makes up for: the white furnace."""
    scene = make_scene(shapes=[ROOM, KNOT])
    frame = frame_with(scene, GRID, "received", **COARSE)
    surfels = frame.resources["surfels"]
    frame.resources["reflected"] = frame.context.buffer(np.ones((surfels.count, 4), dtype=np.float32).tobytes())
    given = technique(GRID)
    for step in given.passes(scene, frame.features, frame.settings):
        if step.name in ("probes", "receive"):
            step.run(frame)
    received = floats(frame.resources["received"]["ball"], -1, 4)[:, :3]
    assert len(received) > 500
    np.testing.assert_allclose(received, 1, atol=0.02)
    transport = floats(frame.resources["transport"], surfels.count, surfels.count)
    np.testing.assert_allclose(transport.sum(axis=0), 1, atol=0.02)


def test_in_a_black_room_a_knot_is_lit_by_itself_alone(make_scene: MakeScene, frame_with: FrameWith) -> None:
    """What its surfels reflect solves B = E + rho K B, here by numpy. Its own reflectance tells how many bounces."""
    scene = make_scene(materials=greys(white=0.0, red=0.0, skin=0.9), shapes=[ROOM, KNOT])
    frame = frame_with(scene, GRID, "received", **FAST)
    surfels = frame.resources["surfels"]
    own = slice(surfels.surroundings, surfels.count)
    direct = floats(frame.resources["lit"], surfels.count, 4)[own, 0]
    kernel = floats(frame.resources["transport"], surfels.count, surfels.count)[own, own].T
    solved = np.linalg.solve(np.eye(len(direct)) - 0.9 * kernel, direct)
    made = floats(frame.resources["reflected"], surfels.count, 4)[:, 0]
    assert direct.max() > 0
    assert solved.max() > 1.1 * direct.max() or solved.sum() > 1.1 * direct.sum()
    np.testing.assert_allclose(made[own], solved, rtol=0.01, atol=1e-3 * solved.max())
    assert floats(frame.resources["received"]["ball"], -1, 4)[:, 0].max() > 0


BLACK = [
    ({"emitters": []}, "no emitter"),
    ({"materials": greys(white=0.0, red=0.0, skin=0.0), "shapes": [ROOM, KNOT]}, "every surface is black"),
    ({"materials": greys(white=0.0, red=0.0, skin=0.6)}, "nothing sends light back"),
]


@pytest.mark.parametrize(("changes", "why"), BLACK)
def test_where_the_image_must_be_black_nothing_is_drawn_and_nothing_is_lost(
    make_scene: MakeScene,
    render: Callable[..., Rendering],
    monkeypatch: pytest.MonkeyPatch,
    changes: dict[str, Any],
    why: str,
) -> None:
    scene = make_scene(**changes)
    short = render(scene, GRID, **FAST)
    assert list(short.pass_seconds) == ["black"]
    assert all(why in s.why for s in short.skipped)
    monkeypatch.setattr("realtime.techniques.indirect_grid._why_black", lambda features: "")
    whole = render(scene, GRID, **FAST)
    assert "probes" in whole.pass_seconds
    assert short.image.pixels.shape == whole.image.pixels.shape
    np.testing.assert_array_equal(short.image.pixels, whole.image.pixels)
    assert short.image.pixels.max() == 0


def without_skipping(why: str) -> Callable[..., Plan]:
    """A planner that takes no notice of one reason for leaving passes out."""
    return lambda passes, wanted, *rest: plan(
        [replace(p, skip="") if p.skip == why else p for p in passes], wanted, *rest
    )


def test_a_convex_subject_needs_no_transfer(
    make_scene: MakeScene, render: Callable[..., Rendering], monkeypatch: pytest.MonkeyPatch
) -> None:
    """To 3 %: what is skipped also interpolates between vertices and sees by rays."""
    scene = make_scene(shapes=[ROOM, TALL])
    short = render(scene, GRID, **COARSE)
    skipped = {s.what: s.why for s in short.skipped}
    assert all("convex" in skipped[name] for name in ("transfer", "own transport", "receive", "draw received"))
    as_if_not_convex(monkeypatch, "realtime.render.features_of")
    whole = render(scene, GRID, **COARSE, directions=256)
    assert {"transfer", "own transport", "receive", "draw received"} <= {*whole.pass_seconds, *whole.baked_seconds}
    difference = np.abs(whole.image.pixels.astype(float) - short.image.pixels).max() / short.image.pixels.max()
    assert difference < 0.03


@pytest.mark.parametrize(("size", "per_side"), [(1.0, 4), (6.0, 2), (30.0, 1)])
def test_far_from_everything_fewer_probes_are_enough(
    make_scene: MakeScene,
    render: Callable[..., Rendering],
    monkeypatch: pytest.MonkeyPatch,
    size: float,
    per_side: int,
) -> None:
    """To 1 % of the mean, which is where the limits of the clearance were set."""
    shapes = [ROOM | {"size": [3 * size, 2.5 * size, 3 * size]}, TALL | {"radii": [0.2, 0.6, 0.2]}]
    light = {"type": "point", "position": [0.7 * size, 0.9 * size, 0.8 * size], "intensity": [6 * size**2] * 3}
    scene = make_scene(shapes=shapes, emitters=[light])
    few = render(scene, GRID, **FAST)
    reasons = [s for s in few.skipped if "probes" in s.what]
    assert [s.what for s in reasons] == ([] if per_side == 4 else [f"{64 - per_side**3} of 4³ probes"])
    assert all("half diagonals" in s.why and f"{per_side}³ are enough" in s.why for s in reasons)
    monkeypatch.setattr("realtime.probe_grid.ENOUGH", ())
    every = render(scene, GRID, **FAST)
    assert not [s for s in every.skipped if "probes" in s.what]
    difference = np.sqrt(np.mean((few.image.pixels.astype(float) - every.image.pixels) ** 2))
    assert difference < 0.01 * every.image.pixels.mean()


def test_clearance_is_measured_from_the_box_in_half_diagonals() -> None:
    low, high = np.array([-1.0, -2.0, -2.0]), np.array([1.0, 2.0, 2.0])
    assert clearance(low, high, np.array([[7.0, 0.0, 0.0], [0.0, 50.0, 0.0]]), np.zeros(2)) == pytest.approx(2)
    assert clearance(low, high, np.array([[4.0, 6.0, 0.0]]), np.zeros(1)) == pytest.approx(5 / 3)
    assert clearance(low, high, np.array([[7.0, 0.0, 0.0]]), np.array([9 * np.pi])) == pytest.approx(1)
    assert clearance(low, high, np.zeros((1, 3)), np.zeros(1)) == 0
    assert clearance(low, high, np.zeros((0, 3)), np.zeros(0)) == np.inf


@pytest.mark.parametrize(("far", "wanted", "enough"), [(1, 4, 4), (5, 4, 2), (5, 1, 1), (30, 6, 1), (np.inf, 2, 1)])
def test_never_more_probes_than_wanted(far: float, wanted: int, enough: int) -> None:
    assert probes_enough(far, wanted) == enough


def test_the_first_harmonics_that_are_left_out_add_nothing_to_a_cosine(glsl: Glsl) -> None:
    """Projections of the clamped cosine on the Legendre polynomials of degree 0, 1, 2; A_3 = 0."""
    x, weights = np.polynomial.legendre.leggauss(8)
    half = (x + 1) / 2
    exact = [np.pi * np.sum(weights * half * np.polynomial.legendre.Legendre.basis(n)(half)) for n in range(4)]
    body = "r[0] = vec4(sh_cosine_factor(0), sh_cosine_factor(2), sh_cosine_factor(7), 0.0);"
    made = glsl("lib/sh.glsl", body, np.zeros((1, 1, 4)))[0, 0]
    np.testing.assert_allclose(made, exact, atol=1e-6)


def test_more_rays_than_a_buffer_holds_are_refused(
    gl: "moderngl.Context", make_scene: MakeScene, draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(gl.info, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE", 1 << 24)
    with pytest.raises(
        InputError, match=r"4096 rays from each of \d+ points .* MB; this GPU allows .*directions lower"
    ):
        draw(make_scene(shapes=[ROOM, KNOT]), GRID, **FAST, directions=4096)


def test_more_vertices_than_the_gpu_runs_groups_are_refused(
    gl: "moderngl.Context", make_scene: MakeScene, draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenGL would run none of them, and the subject would be black."""
    monkeypatch.setitem(gl.info, "GL_MAX_COMPUTE_WORK_GROUP_COUNT", (1000, 1000, 1000))
    with pytest.raises(InputError, match=r"needs \d+ x 1 groups .* allows 1000 x 1000\. Give the subject fewer"):
        draw(make_scene(shapes=[ROOM, KNOT]), "indirect.irradiance", **FAST)


def test_in_a_black_room_a_knot_that_is_gathered_at_its_vertices_is_lit_by_itself_too(
    make_scene: MakeScene, draw: Draw
) -> None:
    """Nothing of the surroundings bounces, but what the subject's own surfels reflect is still there to be gathered."""
    scene = make_scene(materials=greys(white=0.0, red=0.0, skin=0.9), shapes=[ROOM, KNOT])
    gathered, traced = (draw(scene, name, **FAST).mean() for name in ("indirect.irradiance", GRID))
    assert gathered == pytest.approx(traced, rel=0.3)
    assert gathered > 0
