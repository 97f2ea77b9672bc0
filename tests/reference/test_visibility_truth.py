"""Visibility against closed forms, rays in float64 without Mitsuba, and Mitsuba's own path tracer."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from reference.estimator import Reference, Truth, seed_of
from reference.quantities.visibility import ball_block
from reference.stage import build_stage
from scenes.errors import SceneError
from scenes.geometry import geometry_of
from scenes.image import Bool, Float64
from scenes.model import PIXEL_GRID, PointLight, Scene, SphereLight

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]

STANDARD_ERRORS = 5
"""Known from 16 estimates, they are exceeded by chance in one of a thousand tests."""

GREY = {"all": {"type": "diffuse", "reflectance": [0.5, 0.5, 0.5]}}
FLOOR = {"name": "floor", "type": "rectangle", "size": [8.0, 8.0], "rotation_deg": [-90.0, 0.0, 0.0], "material": "all"}
POINT = {"type": "point", "position": [0.4, 2.0, 0.3], "intensity": [1.0, 1.0, 1.0]}


def ball_light(position: list[float], radius: float) -> dict[str, Any]:
    return {"type": "sphere", "position": position, "radius": radius, "radiance": [1.0, 1.0, 1.0]}


def looking_down(height: float, fov_deg: float, side: int, x: float = 0.0) -> dict[str, Any]:
    """Sees a square of the floor around (x, 0, 0): columns run along +x, rows along +z."""
    return {
        "type": "perspective",
        "origin": [x, height, 0.0],
        "target": [x, 0.0, 0.0],
        "up": [0.0, 0.0, -1.0],
        "fov_deg": fov_deg,
        "width": side,
        "height": side,
    }


def floor_points(scene: Scene, grid: int) -> Float64:
    """(pixels, grid², 3), where the rays through a regular grid in each pixel of `looking_down` meet the floor."""
    sensor = scene.sensor
    offsets = (np.arange(grid) + 0.5) / grid
    row, column, v, u = np.meshgrid(np.arange(sensor.height), np.arange(sensor.width), offsets, offsets, indexing="ij")
    extent = sensor.origin[1] * np.tan(np.radians(sensor.fov_deg) / 2)
    x = sensor.origin[0] + extent * (2 * (column + u) / sensor.width - 1)
    z = extent * (2 * (row + v) / sensor.height - 1)
    return np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, grid**2, 3)


def overlap(theta_1: Float64, theta_2: Float64, alpha: Float64) -> Float64:
    """Solid angle that two caps of the unit sphere share: half-angles theta_1 and theta_2, alpha apart.

    By the theorem of Gauss and Bonnet. The border has two arcs, which turn by their length times their geodesic
    curvature, 2 phi_i cos(theta_i), and two corners, which turn by gamma each.
    """
    c1, c2, ca = np.cos(theta_1), np.cos(theta_2), np.cos(alpha)
    s1, s2, sa = np.sin(theta_1), np.sin(theta_2), np.sin(alpha)
    with np.errstate(divide="ignore", invalid="ignore"):
        phi_1 = np.arccos(np.clip((c2 - ca * c1) / (sa * s1), -1, 1))
        phi_2 = np.arccos(np.clip((c1 - ca * c2) / (sa * s2), -1, 1))
        gamma = np.arccos(np.clip((ca - c1 * c2) / (s1 * s2), -1, 1))
        lens = 2 * (np.pi - gamma - phi_1 * c1 - phi_2 * c2)
    smaller = 2 * np.pi * (1 - np.maximum(c1, c2))
    shared: Float64 = np.where(alpha <= np.abs(theta_1 - theta_2), smaller, lens)
    found: Float64 = np.where(alpha >= theta_1 + theta_2, 0.0, shared)
    return found


def angle(a: Float64, b: Float64) -> Float64:
    found: Float64 = np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))
    return found


def share_of_ball(points: Float64, light: Any, axis: Float64, half_angle: Any) -> Float64:
    """The fraction of a ball's cone from points (..., 3) that lies in caps of `half_angle` around `axis`."""
    away = np.array(light.position) - points
    theta = np.arcsin(light.radius / np.linalg.norm(away, axis=-1))
    share: Float64 = overlap(theta, half_angle, angle(away, axis)) / (2 * np.pi * (1 - np.cos(theta)))
    return share


def assert_pixels_agree(truth: Truth, exact: Float64) -> None:
    """Each pixel and the mean of all, against exact values (pixels,), by the spread of the accumulators."""
    assert truth.mask.all()
    made = truth.accumulators[..., 0].reshape(len(truth.accumulators), -1).astype(float)
    error = made.std(axis=0, ddof=1) / np.sqrt(len(made))
    apart = made.mean(axis=0) - exact
    assert np.abs(apart[error == 0]).max(initial=0.0) < 1e-3
    noisy = error > 0
    assert np.count_nonzero(noisy) > len(exact) / 8, "too few pixels are partly lit"
    assert np.sqrt(np.mean((apart[noisy] / error[noisy]) ** 2)) < 1.5
    error_of_mean = made.mean(axis=1).std(ddof=1) / np.sqrt(len(made))
    assert error_of_mean < 1e-3
    assert abs(apart.mean()) < STANDARD_ERRORS * error_of_mean


def test_the_overlap_of_caps() -> None:
    """Two hemispheres share a lune; small caps share what two disks share; caps within each other, the smaller."""
    half = np.array(np.pi / 2)
    assert overlap(half, half, np.array(0.7)) == pytest.approx(2 * (np.pi - 0.7))
    r = np.array(0.01)
    assert overlap(r, r, r) == pytest.approx((2 * np.pi / 3 - np.sqrt(3) / 2) * r**2, rel=1e-4)
    assert overlap(np.array(0.2), np.array(0.5), np.array(0.1)) == pytest.approx(2 * np.pi * (1 - np.cos(0.2)))
    assert overlap(np.array(0.2), np.array(0.5), np.array(0.8)) == 0
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(400_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    other = np.array([np.sin(0.8), 0.0, np.cos(0.8)])
    inside = (directions[:, 2] > np.cos(0.9)) & (directions @ other > np.cos(0.5))
    assert overlap(np.array(0.9), np.array(0.5), np.array(0.8)) == pytest.approx(4 * np.pi * inside.mean(), rel=0.02)


def nearest_hits(origins: Float64, directions: Float64, triangles: Float64) -> tuple[Float64, NDArray[np.intp]]:
    """Distance (N,) to the first of the triangles (F, 3, 3), infinite if there is none, and its index.

    Möller & Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection".
    """
    a, e1, e2 = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    distances, indices = [], []
    for o, d in zip(np.array_split(origins, 32), np.array_split(directions, 32), strict=True):
        p = np.cross(d[:, None], e2)
        s = o[:, None] - a
        q = np.cross(s, e1)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / np.einsum("nfc,fc->nf", p, e1)
            u = np.einsum("nfc,nfc->nf", s, p) * inverse
            v = np.einsum("nfc,nc->nf", q, d) * inverse
            t = np.einsum("nfc,fc->nf", q, e2) * inverse
            t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-9), t, np.inf)
        indices.append(t.argmin(axis=1))
        distances.append(t.min(axis=1))
    return np.concatenate(distances), np.concatenate(indices)


def camera_rays(scene: Scene) -> tuple[Float64, Float64]:
    """Origins and directions (N, 3) of the rays through the regular grid of each pixel, pixel after pixel."""
    sensor = scene.sensor
    forward = np.array(sensor.target) - np.array(sensor.origin)
    right = np.cross(forward, sensor.up)
    up = np.cross(right, forward)
    forward, right, up = (axis / np.linalg.norm(axis) for axis in (forward, right, up))
    offsets = (np.arange(PIXEL_GRID) + 0.5) / PIXEL_GRID
    row, column, v, u = np.meshgrid(np.arange(sensor.height), np.arange(sensor.width), offsets, offsets, indexing="ij")
    extent = np.tan(np.radians(sensor.fov_deg) / 2)
    x = (2 * (column + u) / sensor.width - 1) * extent
    y = (1 - 2 * (row + v) / sensor.height) * extent * sensor.height / sensor.width
    directions = forward + x.reshape(-1, 1) * right + y.reshape(-1, 1) * up
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.broadcast_to(np.array(sensor.origin), directions.shape), directions


@pytest.fixture
def cluttered(make_scene: MakeScene) -> Callable[..., Scene]:
    """Makes a room of things that touch, overlap, are coarse and are smooth, under one light."""

    def make(light: dict[str, Any], width: int = 16, height: int = 12) -> Scene:
        return make_scene(
            sensor={
                "type": "perspective",
                "origin": [-1.2, 1.9, 1.8],
                "target": [0.1, 0.6, -0.2],
                "fov_deg": 66.0,
                "width": width,
                "height": height,
            },
            materials=GREY,
            shapes=[
                {
                    "name": "room",
                    "type": "room",
                    "size": [3.0, 2.4, 4.0],
                    "position": [0.0, 1.2, 0.0],
                    "material": "all",
                },
                {
                    "name": "ball",
                    "type": "displaced_icosphere",
                    "radius": 0.35,
                    "amplitude": 0.4,
                    "detail": 1,
                    "position": [0.1, 0.9, -0.1],
                    "material": "all",
                },
                {
                    "name": "crate",
                    "type": "box",
                    "size": [0.45, 0.5, 0.4],
                    "position": [0.7, 0.25, -0.9],
                    "rotation_deg": [0.0, 25.0, 0.0],
                    "material": "all",
                },
                {
                    "name": "ring",
                    "type": "torus",
                    "radius": 0.3,
                    "tube": 0.08,
                    "segments": 16,
                    "sides": 8,
                    "position": [-0.5, 0.3, 0.3],
                    "rotation_deg": [60.0, 0.0, 30.0],
                    "material": "all",
                },
            ],
            emitters=[light],
        )

    return make


def test_a_point_against_rays_in_double_precision(cluttered: Callable[..., Scene], reference: MakeReference) -> None:
    """Of 12,288 positions none may differ: grazing rays, contacts and coarse smooth meshes included."""
    scene = cluttered(POINT)
    light = scene.emitters[0]
    assert isinstance(light, PointLight)
    triangles = np.concatenate([m.surface.positions.astype(float)[m.surface.faces] for m in geometry_of(scene)])
    origins, directions = camera_rays(scene)
    distance, face = nearest_hits(origins, directions, triangles)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[face]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = origins + distance[:, None] * directions
    away = np.array(light.position) - points
    reach = np.linalg.norm(away, axis=1)
    blocked, _ = nearest_hits(points + 1e-9 * normals, away / reach[:, None], triangles)
    seen: Bool = ((normals * away).sum(axis=1) > 0) & (blocked >= reach)
    truth = reference(scene).truth("visibility", 0)
    assert truth.is_exact
    assert truth.mask.all()
    assert 0.1 < seen.mean() < 0.95
    expected = seen.reshape(-1, PIXEL_GRID**2).mean(axis=1)
    assert np.abs(truth.accumulators[0, ..., 0].ravel() - expected).sum() == 0


def test_the_shadow_of_a_card(make_scene: MakeScene, reference: MakeReference) -> None:
    """A card halfway up to a point light casts a shadow of twice its size, off to the side by what the light is."""
    card = FLOOR | {"name": "card", "size": [0.3, 0.2], "position": [0.1, 1.0, 0.1]}
    scene = make_scene(
        sensor=looking_down(0.9, 80.0, 48),
        materials=GREY,
        subject=["card"],
        shapes=[FLOOR, card],
        emitters=[POINT | {"position": [0.2, 2.0, 0.0]}],
    )
    image = reference(scene).truth("visibility", 0).accumulators[0, ..., 0]
    points = floor_points(scene, PIXEL_GRID)
    inside = (np.abs(points[..., 0] - 0.0) < 0.3) & (np.abs(points[..., 2] - 0.2) < 0.2)
    np.testing.assert_allclose(image.ravel(), 1 - inside.mean(axis=1), atol=1e-6)
    assert 0.02 < inside.mean() < 0.2


def test_the_shadow_of_a_sphere(make_scene: MakeScene, reference: MakeReference) -> None:
    """What a ball hides of another is the overlap of two caps. The blocker's mesh is 0.01 % smaller than the ball."""
    blocker = {"name": "blocker", "type": "sphere", "radius": 0.15, "detail": 6, "position": [0.2, 1.0, 0.1]}
    scene = make_scene(
        sensor=looking_down(0.8, 60.0, 16),
        materials=GREY,
        subject=["floor"],
        shapes=[FLOOR, blocker | {"material": "all"}],
        emitters=[ball_light([0.4, 2.0, 0.3], 0.25)],
    )
    points = floor_points(scene, 16)
    axis = np.array([0.2, 1.0, 0.1]) - points
    half_angle = np.arcsin(0.15 / np.linalg.norm(axis, axis=-1))
    hidden = share_of_ball(points, scene.emitters[0], axis, half_angle)
    assert_pixels_agree(reference(scene).truth("visibility", 4096), 1 - hidden.mean(axis=1))


def test_the_shadow_of_a_straight_edge(make_scene: MakeScene, reference: MakeReference) -> None:
    """From a point, a half plane hides a hemisphere; what is left of the ball is the overlap of a cap with it."""
    half_plane = FLOOR | {"name": "sheet", "size": [6.0, 20.0], "position": [3.05, 1.0, 0.0]}
    scene = make_scene(
        sensor=looking_down(0.8, 60.0, 16),
        materials=GREY,
        subject=["sheet"],
        shapes=[FLOOR, half_plane],
        emitters=[ball_light([0.1, 2.0, 0.3], 0.2)],
    )
    points = floor_points(scene, 16)
    free = np.stack([-np.ones(points.shape[:2]), 0.05 - points[..., 0], np.zeros(points.shape[:2])], axis=-1)
    seen = share_of_ball(points, scene.emitters[0], free, np.pi / 2)
    assert_pixels_agree(reference(scene).truth("visibility", 4096), seen.mean(axis=1))


def test_far_away_the_edge_cuts_a_segment_of_a_circle(make_scene: MakeScene, reference: MakeReference) -> None:
    """A small ball at a large distance is a disk: 1/2 + (z sqrt(1 - z²) + asin z) / pi of it is left."""
    half_plane = FLOOR | {"name": "sheet", "size": [6.0, 20.0], "position": [3.0, 1.0, 0.0]}
    scene = make_scene(
        sensor=looking_down(0.5, 10.0, 12),
        materials=GREY,
        subject=["sheet"],
        shapes=[FLOOR, half_plane],
        emitters=[ball_light([0.0, 50.0, 0.0], 1.5)],
    )
    x = floor_points(scene, 16)[..., 0]
    z = np.clip(-49 * x / 1.5, -1, 1)
    seen = 0.5 + (z * np.sqrt(1 - z**2) + np.arcsin(z)) / np.pi
    assert_pixels_agree(reference(scene).truth("visibility", 4096), seen.mean(axis=1))


def test_the_horizon_hides_what_lies_below_it(make_scene: MakeScene, reference: MakeReference) -> None:
    """The plane of a surface hides a hemisphere: half of a ball whose centre lies in the plane, all of one below."""
    scene = make_scene(
        sensor=looking_down(0.8, 60.0, 16),
        materials=GREY,
        subject=["floor"],
        shapes=[FLOOR],
        emitters=[ball_light([1.5, 0.1, 0.2], 0.4)],
    )
    truth = reference(scene).truth("visibility", 4096)
    seen = share_of_ball(floor_points(scene, 16), scene.emitters[0], np.array([0.0, 1.0, 0.0]), np.pi / 2)
    assert seen.min() > 0.55
    assert_pixels_agree(truth, seen.mean(axis=1))
    for height, expected in ((0.0, 0.5), (-0.5, 0.0)):
        lowered = scene.model_copy(
            update={"emitters": (scene.emitters[0].model_copy(update={"position": (1.5, height, 0.2)}),)}
        )
        made = reference(lowered).truth("visibility", 1024).accumulators
        assert made.mean() == pytest.approx(expected, abs=0.002)


@pytest.mark.parametrize("emitter", [POINT, ball_light([0.4, 2.0, 0.3], 0.5)], ids=["point", "ball"])
@pytest.mark.parametrize("moved", [0.0, 100.0])
def test_a_coarse_smooth_ball_hides_nothing_from_itself(
    make_scene: MakeScene, reference: MakeReference, emitter: dict[str, Any], moved: float
) -> None:
    """A convex mesh sees of a light what is above the planes of its triangles, whatever its shading normals say.

    Also 100 m off, where positions are rounded to hundredths of a millimetre.
    """
    there = np.array([moved, 0.0, -moved])
    scene = make_scene(
        sensor={
            "type": "perspective",
            "origin": (there + np.array([1.0, 1.5, 1.2])).tolist(),
            "target": there.tolist(),
            "fov_deg": 14.0,
            "width": 12,
            "height": 12,
        },
        materials=GREY,
        shapes=[
            {
                "name": "ball",
                "type": "sphere",
                "radius": 0.5,
                "detail": 1,
                "position": there.tolist(),
                "material": "all",
            }
        ],
        emitters=[emitter | {"position": (there + np.array([0.9, -0.1, 0.4])).tolist()}],
    )
    light = scene.emitters[0]
    assert isinstance(light, PointLight | SphereLight)
    triangles = np.concatenate([m.surface.positions.astype(float)[m.surface.faces] for m in geometry_of(scene)[:1]])
    origins, directions = camera_rays(scene)
    distance, face = nearest_hits(origins, directions, triangles)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[face]
    points = origins + distance[:, None] * directions
    if isinstance(light, PointLight):
        seen = (((np.array(light.position) - points) * normals).sum(axis=1) > 0).astype(float)
    else:
        seen = share_of_ball(points, light, normals, np.pi / 2)
    assert 0.2 < seen.mean() < 0.9
    truth = reference(scene).truth("visibility", 4096)
    assert truth.mask.all()
    made = truth.accumulators.mean(axis=0)[..., 0].ravel()
    # An edge between two triangles may fall differently on a position of the grid, or cut a pixel's grid unevenly.
    assert np.abs(made - seen.reshape(-1, PIXEL_GRID**2).mean(axis=1)).mean() < (1e-3 if truth.is_exact else 5e-3)
    assert made.mean() == pytest.approx(seen.mean(), abs=2e-3)


def test_a_small_ball_is_a_point(cluttered: Callable[..., Scene], reference: MakeReference) -> None:
    """Half a millimetre wide, its shadows are those of a point but for the noise of the film."""
    point = reference(cluttered(POINT, 32, 24)).truth("visibility", 0)
    ball = reference(cluttered(ball_light([0.4, 2.0, 0.3], 5e-4), 32, 24)).truth("visibility", 1024)
    made = ball.accumulators.mean(axis=0)
    assert not ball.is_exact
    assert np.abs(made - point.accumulators[0])[point.mask & ball.mask].mean() < 2e-3
    assert made[ball.mask].mean() == pytest.approx(point.accumulators[0][ball.mask].mean(), abs=5e-4)


@pytest.mark.parametrize(("radius", "gap"), [(0.3, 1e-3), (0.3, 1.0), (0.01, 3.0)])
def test_a_ball_does_not_hide_itself(
    make_scene: MakeScene, reference: MakeReference, radius: float, gap: float
) -> None:
    """Nothing is in the way: every sample of a floor under a ball is lit, from its mesh's corners to its rim."""
    scene = make_scene(
        sensor=looking_down(0.5, 60.0, 24, x=-1.2),
        materials=GREY,
        subject=["floor"],
        shapes=[FLOOR],
        emitters=[ball_light([0.0, radius + gap, 0.0], radius)],
    )
    truth = reference(scene).truth("visibility", 1024)
    assert truth.mask.all()
    assert truth.accumulators.min() == 1


def test_a_ball_that_a_wall_cuts_is_hidden_behind_it(make_scene: MakeScene, reference: MakeReference) -> None:
    """Through a ceiling a ball pokes by half its radius: the rim of what is left subtends a smaller cap."""
    radius, height = 0.4, 2.0
    ceiling = {"name": "ceiling", "type": "rectangle", "size": [8.0, 8.0], "material": "all"}
    scene = make_scene(
        sensor=looking_down(0.5, 0.5, 4),
        materials=GREY,
        subject=["floor"],
        shapes=[FLOOR, ceiling | {"position": [0.0, height, 0.0], "rotation_deg": [90.0, 0.0, 0.0]}],
        emitters=[ball_light([0.0, height + radius / 2, 0.0], radius)],
    )
    rim = np.arctan2(radius * np.sqrt(0.75), height)
    whole = np.arcsin(radius / (height + radius / 2))
    expected = (1 - np.cos(rim)) / (1 - np.cos(whole))
    assert expected < 0.95
    made = reference(scene).truth("visibility", 8192).accumulators
    assert made.mean() == pytest.approx(expected, abs=0.002)


def test_irradiance_by_the_path_tracer_of_mitsuba(
    make_scene: MakeScene, reference: MakeReference, mi: ModuleType
) -> None:
    """Under a ball that stands high, cosines are within 1 %: what a box leaves of the irradiance is the visibility."""
    box = {"name": "box", "type": "box", "size": [0.4, 0.2, 0.3], "position": [0.15, 1.5, 0.1], "material": "all"}
    lit = {"sensor": looking_down(0.5, 30.0, 8), "materials": GREY, "emitters": [ball_light([0.0, 3.0, 0.0], 0.25)]}
    with_box = make_scene(**lit, subject=["box"], shapes=[FLOOR, box])
    without = make_scene(**lit, subject=["floor"], shapes=[FLOOR])
    integrator = mi.load_dict({"type": "path", "max_depth": 2})
    irradiance = []
    for scene in (with_box, without):
        loaded = build_stage(mi, scene, geometry_of(scene)).scene
        renders = [mi.render(loaded, integrator=integrator, spp=1024, seed=seed_of("test", k)) for k in range(8)]
        irradiance.append(np.mean([np.array(render)[..., 0] for render in renders], axis=0, dtype=float))
    made = reference(with_box).truth("visibility", 4096).accumulators.mean(axis=0)[..., 0]
    assert 0.3 < made.mean() < 0.95
    ratio = irradiance[0] / irradiance[1]
    assert ratio.mean() == pytest.approx(made.mean(), rel=0.005)
    np.testing.assert_allclose(ratio, made, atol=0.03)


@pytest.mark.parametrize("spp", [16, 64, 512])
def test_error_bars_are_honest(make_scene: MakeScene, reference: MakeReference, tmp_path: Path, spp: int) -> None:
    """Over independent truths the mean is unbiased, and the accumulators foretell its error, of pixels and of all."""
    half_plane = FLOOR | {"name": "sheet", "size": [6.0, 20.0], "position": [3.05, 1.0, 0.0]}
    scene = make_scene(
        sensor=looking_down(0.8, 20.0, 8),
        materials=GREY,
        subject=["sheet"],
        shapes=[FLOOR, half_plane],
        emitters=[ball_light([0.1, 2.0, 0.0], 0.2)],
    )
    points = floor_points(scene, 32)
    free = np.stack([-np.ones(points.shape[:2]), 0.05 - points[..., 0], np.zeros(points.shape[:2])], axis=-1)
    exact = share_of_ball(points, scene.emitters[0], free, np.pi / 2).mean(axis=1)
    stage = build_stage(reference(scene).studio.mitsuba, scene, geometry_of(scene))
    pixels = np.tile(np.arange(64), 16)
    makes = np.stack([ball_block(stage, pixels, seed_of("test", k), spp // 16)[:, 0] for k in range(40)])
    makes = makes.reshape(40, 16, 64)
    variance = makes.var(axis=1, ddof=1).mean(axis=0) / 16
    apart = makes.mean(axis=1) - exact
    partly = variance > 0
    assert np.count_nonzero(partly) > 20
    assert np.mean(apart[:, partly] ** 2) / np.mean(variance[partly]) == pytest.approx(1, abs=0.15)
    bias = apart.mean()
    assert abs(bias) < 4 * apart.mean(axis=1).std(ddof=1) / np.sqrt(40)


def test_stratified_samples_need_fewer(make_scene: MakeScene, reference: MakeReference) -> None:
    """256 samples of a wide penumbra have the noise of 1000 or more independent ones, whose variance is v (1 - v)."""
    half_plane = FLOOR | {"name": "sheet", "size": [6.0, 20.0], "position": [3.05, 1.0, 0.0]}
    scene = make_scene(
        sensor=looking_down(0.8, 20.0, 16),
        materials=GREY,
        subject=["sheet"],
        shapes=[FLOOR, half_plane],
        emitters=[ball_light([0.1, 2.0, 0.0], 0.3)],
    )
    stage = build_stage(reference(scene).studio.mitsuba, scene, geometry_of(scene))
    made = ball_block(stage, np.tile(np.arange(256), 16), seed_of("test"), 256)[:, 0].reshape(16, 256)
    mean = made.mean(axis=0)
    independent = (mean * (1 - mean)).mean() / 256
    assert made.var(axis=0, ddof=1).mean() < independent / 4


def test_no_sample_is_clamped(make_scene: MakeScene, reference: MakeReference) -> None:
    scene = make_scene(
        sensor=looking_down(0.8, 20.0, 4),
        materials=GREY,
        subject=["floor"],
        shapes=[FLOOR],
        emitters=[ball_light([0.1, 2.0, 0.0], 0.3)],
        truth={"max_spp": 64, "clamp": 0.25},
    )
    truth = reference(scene).truth("visibility", 64)
    assert truth.accumulators.min() == 1
    assert truth.removed is not None
    assert truth.removed.max() == 0
    unclamped = scene.model_copy(update={"truth": scene.truth.model_copy(update={"clamp": None})})
    assert reference(unclamped).truth("visibility", 64).removed is None


def test_what_emits_or_is_not_there_receives_nothing(make_scene: MakeScene, reference: MakeReference) -> None:
    """Judged are the pixels that see surfaces alone: not the lamp's ball, a glowing card, the sky, nor their edges."""
    card = {"name": "card", "type": "rectangle", "size": [0.4, 0.4], "position": [-0.5, 0.0, 0.0], "material": "all"}
    wall = {"name": "wall", "type": "rectangle", "size": [2.0, 4.0], "position": [0.0, 0.0, -1.0], "material": "all"}
    scene = make_scene(
        sensor={
            "type": "perspective",
            "origin": [0.0, 0.0, 3.0],
            "target": [0.0, 0.0, 0.0],
            "fov_deg": 50.0,
            "width": 30,
            "height": 20,
        },
        materials=GREY,
        subject=["wall"],
        shapes=[card, wall],
        emitters=[
            ball_light([0.5, 0.0, 0.0], 0.2),
            {"type": "area", "shape": "card", "radiance": [1.0, 1.0, 1.0]},
            {"type": "constant", "radiance": [1.0, 1.0, 1.0]},
        ],
    )
    truth = reference(scene).truth("visibility", 16)
    x = np.abs((np.arange(30) + 0.5) / 15 - 1) * np.tan(np.radians(25))
    is_wall = np.broadcast_to(x * 4 + 4 * np.tan(np.radians(25)) / 30 < 1, (20, 30))
    assert not truth.mask[~is_wall].any()
    assert not truth.mask[10, 6:9].all()
    assert truth.mask[2, 12:18].all()
    area = (15 / (3 * np.tan(np.radians(25)))) ** 2
    found = np.count_nonzero(is_wall & ~truth.mask)
    solid = (0.4 * 0.4 + np.pi * 0.2**2) * area
    assert solid < found < 1.8 * solid


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"emitters": []}, "does not have exactly one"),
        ({"emitters": [POINT, POINT | {"position": [0.0, 1.0, 0.0]}]}, "does not have exactly one"),
        ({"emitters": [POINT, ball_light([0.0, 1.0, 0.0], 0.1)]}, "does not have exactly one"),
        (
            {"emitters": [{"type": "directional", "direction": [0.0, -1.0, 0.0], "irradiance": [1.0, 1.0, 1.0]}]},
            "does not have exactly one",
        ),
        (
            {"materials": {"all": {"type": "translucent", "sigma_a": [0.1, 0.1, 0.1], "sigma_s": [1.0, 1.0, 1.0]}}},
            "light passes through a translucent body",
        ),
    ],
    ids=["none", "two points", "a point and a ball", "a directional light", "a medium"],
)
def test_what_it_is_not_defined_for(
    make_scene: MakeScene, reference: MakeReference, changes: dict[str, Any], said: str
) -> None:
    ball = {"name": "ball", "type": "sphere", "radius": 0.3, "detail": 3, "material": "all"}
    scene = make_scene(**({"materials": GREY, "shapes": [ball], "emitters": [POINT]} | changes))
    with pytest.raises(SceneError, match=rf"visibility is not defined here: .*{said}"):
        reference(scene).truth("visibility", 16)


def test_the_kinds_of_truth(cluttered: Callable[..., Scene], reference: MakeReference) -> None:
    """A point is exact; a ball is sampled, with what else shines ignored; the store knows them apart."""
    from reference.estimator import truth_parts
    from reference.quantities import quantity

    point, ball = cluttered(POINT), cluttered(ball_light([0.4, 2.0, 0.3], 0.1))
    integrator = quantity("visibility").integrator
    assert integrator(reference(point).features).exact is not None
    assert integrator(reference(ball).features).block is not None
    assert truth_parts(point, "visibility") != truth_parts(ball, "visibility")
    assert quantity("visibility").judged_where == "receiver_coverage"
