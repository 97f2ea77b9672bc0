"""Rays through the cornea against Fermat's principle, paraxial optics, limits, and Mitsuba's camera and dielectric."""

import itertools
import json
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from reference import eye_rays
from reference.estimator import Reference
from reference.eye_rays import Ball, Optics, look_inside, optics_of, uv_of
from reference.stage import build_stage
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.model import Scene
from scenes.shapes import Eye

MakeScene = Callable[..., Scene]

TALK: dict[str, Any] = {
    "name": "eye",
    "type": "eye",
    "material": "white",
    "iris": "skin",
    "sclera_radius": 1.0,
    "cornea_radius": 1.0,
    "limbus_radius": float(np.sqrt(1 - 0.805**2)),
    "ior": 1.376,
    "pupil_radius": 0.15,
}
"""The talk's: one sphere, of which the part beyond 0.805 is cornea."""

HUMAN: dict[str, Any] = TALK | {
    "sclera_radius": 12.0,
    "cornea_radius": 7.8,
    "limbus_radius": 5.9,
    "iris_depth": 3.55,
    "pupil_radius": 2.0,
    "endothelium": {"radius": 6.5, "thickness": 0.55, "ior": 1.336},
}


def eye(base: dict[str, Any], **changes: Any) -> Eye:
    return Eye.model_validate_json(json.dumps(base | changes))


EYES = {
    "talk": eye(TALK),
    "bowl": eye(TALK, iris_curvature=2.0),
    "human": eye(HUMAN),
    "human with one surface": eye(HUMAN, endothelium=None),
    "human with a bowl": eye(HUMAN, iris_curvature=10.0),
}


def camera(view_deg: float, distance: float, size: float = 1.0) -> dict[str, Any]:
    """Looks at the middle of the eye's front from an angle to its gaze, from a distance in radii of the sclera."""
    at = np.radians(view_deg)
    direction = np.array([0.3 * np.sin(at), np.cos(at), np.sqrt(1 - 0.09) * np.sin(at)])
    return {
        "type": "perspective",
        "origin": (size * (distance * direction + [0.0, 0.8, 0.0])).tolist(),
        "target": [0.0, 0.8 * size, 0.0],
        "up": [1.0, 0.0, 0.1],
        "fov_deg": float(np.degrees(2 * np.arctan(0.7 / distance))),
        "width": 24,
        "height": 24,
    }


def rays_at(optics: Optics, view_deg: float, distance: float, count: int = 24) -> tuple[Float64, Float64]:
    """Rays from a point in the eye's frame to a square grid across the cornea."""
    at = np.radians(view_deg)
    apex = np.array([0.0, optics.cornea.y + optics.cornea.radius, 0.0])
    origin = apex + distance * np.array([0.3 * np.sin(at), np.cos(at), np.sqrt(0.91) * np.sin(at)])
    side = optics.limbus_radius * (np.arange(count) - (count - 1) / 2) * (2 / count)
    x, z = np.meshgrid(side, side)
    targets = np.stack([x.ravel(), np.full(x.size, optics.limbus_y), z.ravel()], axis=-1)
    directions = targets - origin
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    return np.broadcast_to(origin, directions.shape), directions


def front(optics: Optics, origin: Float64, direction: Float64) -> Float64:
    """Where rays meet the front of the cornea."""
    t, _ = eye_rays.outer_hit(optics, origin, direction)
    return origin + t[:, None] * direction


@pytest.mark.parametrize("name", EYES)
@pytest.mark.parametrize("view_deg", [0.0, 45.0, 75.0])
def test_the_optical_path_is_stationary(name: str, view_deg: float) -> None:
    """Fermat: the optical length from the camera to the iris does not change to first order in the points passed.

    Here the points are moved along the surfaces, and the derivative is taken by central differences: no formula of
    refraction is used.
    """
    from scipy.optimize import minimize

    optics = optics_of(EYES[name])
    camera_at, directions = rays_at(optics, view_deg, 5 * optics.sclera.radius, count=7)
    points, sees = look_inside(optics, camera_at, directions)
    assert sees.sum() >= 5
    entries = front(optics, camera_at, directions)
    balls = [optics.cornea] if optics.endothelium is None else [optics.cornea, optics.endothelium]
    for k in np.flatnonzero(sees)[::3]:
        if len(balls) == 2 and not crosses_once(optics, points[k]):
            continue

        def length(angles: Float64, k: int = k) -> float:
            stations = [camera_at[k], *(on_ball(b, a) for b, a in zip(balls, angles.reshape(-1, 2), strict=True))]
            indices = [1.0, *(ball.ior for ball in balls)]
            path = [*stations, points[k]]
            legs = [np.linalg.norm(b - a) for a, b in itertools.pairwise(path)]
            return float(np.dot(indices, legs)) / optics.cornea.radius

        start = np.tile(angles_on(optics.cornea, entries[k]), len(balls))
        best = minimize(length, start, tol=1e-14, options={"gtol": 1e-9}).x
        np.testing.assert_allclose(on_ball(optics.cornea, best[:2]), entries[k], atol=3e-6 * optics.cornea.radius)


def crosses_once(optics: Optics, point: Float64) -> bool:
    """Whether a point of the iris lies well inside the endothelium's sphere."""
    ball = optics.endothelium
    return ball is not None and bool(np.linalg.norm(point - [0.0, ball.y, 0.0]) < 0.97 * ball.radius)


def on_ball(ball: Ball, angles: Float64) -> Float64:
    """A point of the front of a sphere by its slopes from the pole."""
    a, b = angles
    direction = np.array([np.tan(a), 1.0, np.tan(b)])
    found: Float64 = np.array([0.0, ball.y, 0.0]) + ball.radius * direction / np.linalg.norm(direction)
    return found


def angles_on(ball: Ball, point: Float64) -> Float64:
    x, y, z = point - [0.0, ball.y, 0.0]
    angles: Float64 = np.arctan(np.array([x, z]) / y)
    return angles


@pytest.mark.parametrize("name", ["talk", "human", "human with one surface"])
def test_rays_near_the_axis_follow_the_matrices_of_paraxial_optics(name: str) -> None:
    """Hecht, "Optics", 6.2.1: refraction changes n times the angle by -(n' - n) h / R, travel the height by the angle.

    To second order in the angle of 1e-4.
    """
    shape = EYES[name]
    optics = optics_of(shape)
    apex, distance, slope = optics.cornea.y + optics.cornea.radius, 4 * optics.sclera.radius, 1e-4
    origin = np.array([[0.0, apex + distance, 0.0]])
    direction = np.array([[np.sin(slope), -np.cos(slope), 0.0]])
    points, sees = look_inside(optics, origin, direction)
    assert sees.all()
    height, angle, n, at = distance * slope, slope, 1.0, apex
    for ball in [optics.cornea] + ([] if optics.endothelium is None else [optics.endothelium]):
        height += angle * (at - (ball.y + ball.radius))
        angle = (n * angle - (ball.ior - n) * height / ball.radius) / ball.ior
        n, at = ball.ior, ball.y + ball.radius
    height += angle * (at - optics.iris_y)
    np.testing.assert_allclose(points[0], [height, optics.iris_y, 0.0], rtol=1e-6, atol=1e-9)


def test_a_nearly_flat_cornea_refracts_as_a_plane() -> None:
    """Snell at a plane, in closed form: the iris appears at a depth of tan(t) / tan(i) of the real one."""
    optics = optics_of(eye(TALK, sclera_radius=1e6, cornea_radius=1e6, limbus_radius=1.0, iris_depth=0.5))
    apex, angle = 1e6, np.radians(50.0)
    direction = np.array([[np.sin(angle), -np.cos(angle), 0.0]])
    points, sees = look_inside(optics, np.array([[-2 * np.tan(angle), apex + 2.0, 0.0]]), direction)
    assert sees.all()
    np.testing.assert_allclose(points[0, 0], 0.5 * np.tan(np.arcsin(np.sin(angle) / 1.376)), atol=2e-6)


@pytest.mark.parametrize("curvature", [None, 2.0])
def test_a_cornea_without_optical_density_bends_nothing(curvature: float | None) -> None:
    optics = optics_of(eye(TALK, ior=1 + 1e-12, iris_curvature=curvature))
    origin, direction = rays_at(optics, 40.0, 4.0)
    points, sees = look_inside(optics, origin, direction)
    across = np.cross(points - origin, direction)
    assert sees.sum() > 200
    assert np.abs(across[sees]).max() < 1e-10
    rim = np.hypot(points[sees, 0], points[sees, 2])
    bottom = optics.iris_y if curvature is None else optics.iris_y + np.sqrt(4 - optics.limbus_radius**2)
    depth = bottom if curvature is None else bottom - np.sqrt(4 - rim**2)
    np.testing.assert_allclose(points[sees, 1], depth, atol=1e-12)


def test_a_flat_iris_is_the_limit_of_a_bowl() -> None:
    flat, bowl = optics_of(eye(TALK)), optics_of(eye(TALK, iris_curvature=1e5))
    origin, direction = rays_at(flat, 30.0, 4.0)
    a, sees_a = look_inside(flat, origin, direction)
    b, sees_b = look_inside(bowl, origin, direction)
    assert (sees_a == sees_b).all()
    np.testing.assert_allclose(uv_of(flat, a[sees_a]), uv_of(bowl, b[sees_a]), atol=1e-5)


def test_an_endothelium_without_contrast_changes_nothing() -> None:
    inner = HUMAN["endothelium"] | {"ior": 1.376}
    one, two = optics_of(EYES["human with one surface"]), optics_of(eye(HUMAN, endothelium=inner))
    for view in (0.0, 60.0, 85.0):
        origin, direction = rays_at(one, view, 40.0)
        (a, sees_a), (b, sees_b) = look_inside(one, origin, direction), look_inside(two, origin, direction)
        assert (sees_a == sees_b).all()
        np.testing.assert_allclose(a[sees_a], b[sees_a], atol=1e-12)


@pytest.mark.parametrize(("ior", "is_live"), [(1.376, False), (1.243, False), (1.2, True)])
def test_the_way_out_through_the_side_is_dead_above_a_refractive_index(ior: float, is_live: bool) -> None:
    """A ray that grazes the rim of the talk's cornea is bent to below the rim's plane if n >= 1 / 0.805."""
    optics = optics_of(eye(TALK, ior=ior))
    leaves = 0
    for view in (60.0, 90.0, 120.0):
        origin, direction = rays_at(optics, view, 4.0, count=64)
        t, on_cornea = eye_rays.outer_hit(optics, origin, direction)
        at = origin[on_cornea] + t[on_cornea, None] * direction[on_cornea]
        normal = at / optics.cornea.radius
        bent, _ = eye_rays.refract(direction[on_cornea], normal, 1 / ior)
        leaves += eye_rays._leaves_sideways(optics, at, bent).sum()
    assert (leaves > 0) == is_live


DIRECTIONS = st.tuples(*[st.floats(-1, 1, width=32)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@settings(max_examples=60, deadline=None)
@given(
    DIRECTIONS,
    DIRECTIONS,
    st.floats(1.0, 2.5),
)
def test_refraction_obeys_snell_and_can_be_reversed(d: tuple[float, ...], n: tuple[float, ...], ior: float) -> None:
    direction, normal = np.array(d) / np.linalg.norm(d), np.array(n) / np.linalg.norm(n)
    cos_i = abs(direction @ normal)
    assume(cos_i > 1e-3)
    normal *= -np.copysign(1.0, direction @ normal)
    bent, passes = eye_rays.refract(direction, normal, 1 / ior)
    assert passes
    np.testing.assert_allclose(np.linalg.norm(bent), 1, atol=1e-12)
    np.testing.assert_allclose(np.cross(direction, normal), ior * np.cross(bent, normal), atol=1e-12)
    back, _ = eye_rays.refract(-bent, -normal, ior)
    np.testing.assert_allclose(back, -direction, atol=1e-12 / cos_i)


def test_light_is_totally_reflected_from_within() -> None:
    angle = np.radians([[46.0], [47.0]])
    direction = np.concatenate([np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    bent, passes = eye_rays.refract(direction, np.array([0.0, -1.0, 0.0]), 1.376)
    assert passes.tolist() == [True, False]
    assert not bent[1].any()


@pytest.mark.parametrize("distance", [2.0, 1e2, 1e5])
def test_distances_stay_precise_from_far_away(distance: float) -> None:
    """Points on the sphere to 1e-15 of the distance, where the textbook formula leaves 1e-16 of its square."""
    ball = Ball(0.3, 1.0, 1.0)
    across = np.linspace(-0.99, 0.99, 41)
    direction = np.array([0.36, -0.48, 0.8])
    side = np.cross(direction, [0.0, 1.0, 0.0]) / np.linalg.norm(np.cross(direction, [0.0, 1.0, 0.0]))
    origin = np.array([0.0, 0.3, 0.0]) - distance * direction + across[:, None] * side
    near, far = eye_rays.sphere_roots(origin, np.broadcast_to(direction, origin.shape), ball)
    half = np.sqrt(1 - across**2)
    np.testing.assert_allclose(near, distance - half, rtol=1e-14, atol=3e-15 * distance)
    np.testing.assert_allclose(far, distance + half, rtol=1e-14, atol=3e-15 * distance)


@pytest.mark.parametrize("fov_axis", ["x", "y"])
def test_the_camera_is_mitsubas(make_scene: MakeScene, mi: ModuleType, fov_axis: str) -> None:
    sensor = camera(50.0, 5.0) | {"width": 20, "height": 11, "fov_axis": fov_axis}
    lens = {"type": "thin_lens", "aperture_radius": 0.1, "focus_distance": 5.0}
    scene = make_scene(sensor=sensor | lens)
    stage = build_stage(mi, scene, geometry_of(scene))
    x, y = np.array([0.0, 20.0, 3.25, 10.0]), np.array([0.0, 11.0, 9.5, 5.5])
    ray = stage.rays(mi.Float(x), mi.Float(y))
    origin, direction = eye_rays.camera_rays(scene.sensor, x, y)
    np.testing.assert_allclose(direction, np.array(ray.d).T, atol=3e-7)
    travelled = np.array(ray.o).T - origin
    assert np.abs(np.cross(travelled, direction)).max() < 1e-6


def test_the_cornea_bends_as_mitsubas_dielectric(mi: ModuleType) -> None:
    """A sphere of glass, on which the refracted direction is the one that its BSDF samples."""
    scene = mi.load_dict(
        {"type": "scene", "ball": {"type": "sphere", "bsdf": {"type": "dielectric", "int_ior": 1.376, "ext_ior": 1.0}}}
    )
    optics = optics_of(EYES["talk"])
    origin, direction = rays_at(optics, 60.0, 4.0)
    t, on_cornea = eye_rays.outer_hit(optics, origin, direction)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(origin.T), mi.Vector3f(direction.T)))
    sample, _ = si.bsdf().sample(mi.BSDFContext(), si, mi.Float(1.0), mi.Point2f(0.5))
    mitsubas = np.array(si.to_world(sample.wo)).T[on_cornea]
    at = (origin + np.where(on_cornea, t, 0.0)[:, None] * direction)[on_cornea]
    bent, _ = eye_rays.refract(direction[on_cornea], at, 1 / 1.376)
    assert on_cornea.sum() > 300
    np.testing.assert_allclose(bent, mitsubas, atol=3e-5)


@pytest.mark.parametrize("name", EYES)
@pytest.mark.parametrize("view_deg", [0.0, 60.0, 90.0, 180.0])
def test_no_view_makes_nan_and_all_that_is_seen_lies_on_the_iris(name: str, view_deg: float) -> None:
    optics = optics_of(EYES[name])
    points, sees = look_inside(optics, *rays_at(optics, view_deg, 5 * optics.sclera.radius, count=64))
    assert np.isfinite(points).all()
    seen = points[sees]
    assert (np.hypot(seen[:, 0], seen[:, 2]) <= optics.limbus_radius * (1 + 1e-12)).all()
    if optics.bowl is None:
        np.testing.assert_allclose(seen[:, 1], optics.iris_y, rtol=1e-13)
    else:
        away = np.linalg.norm(seen - [0.0, optics.bowl.y, 0.0], axis=-1)
        np.testing.assert_allclose(away, optics.bowl.radius, rtol=1e-13)
        assert (seen[:, 1] <= optics.iris_y + 1e-12).all()
    assert sees.any() == (view_deg < 120)


def test_the_rim_of_a_wide_iris_is_seen_beside_the_endothelium() -> None:
    """Its sphere is 5.48 wide at the iris: farther out rays leave it again, or never enter it."""
    optics = optics_of(EYES["human"])
    points, sees = look_inside(optics, *rays_at(optics, 30.0, 60.0, count=96))
    radius = np.hypot(points[sees, 0], points[sees, 2])
    assert ((radius > 5.5).sum() > 20) & ((radius < 5.4).sum() > 20)


def test_a_bowl_is_seen_to_its_rim_beside_the_endothelium() -> None:
    """Some rays enter that sphere only after they passed the rim: from the front nothing of the iris is hidden."""
    optics = optics_of(EYES["human with a bowl"])
    radius = np.linspace(0, 0.999 * optics.limbus_radius, 400)
    origin = np.stack([radius, np.full_like(radius, 60.0), np.zeros_like(radius)], axis=-1)
    points, sees = look_inside(optics, origin, np.broadcast_to([0.0, -1.0, 0.0], origin.shape))
    assert sees.all()
    assert (np.diff(points[:, 0]) > 0).all()


@pytest.mark.parametrize(("view_deg", "most"), [(0.0, 0.001), (30.0, 0.002), (60.0, 0.002), (75.0, 0.003)])
def test_one_surface_of_the_keratometric_index_stands_for_both(view_deg: float, most: float) -> None:
    """The expected loss: 0.3 % of the iris' diameter on average at most; its radius and n = 1.3375 are the clinic's."""
    both, one = optics_of(EYES["human"]), optics_of(eye(HUMAN, endothelium=None, ior=1.3375))
    origin, direction = rays_at(both, view_deg, 60.0, count=64)
    (a, sees_a), (b, sees_b) = look_inside(both, origin, direction), look_inside(one, origin, direction)
    seen = sees_a & sees_b
    apart = np.linalg.norm(uv_of(both, a[seen]) - uv_of(one, b[seen]), axis=-1)
    assert seen.sum() > 500
    assert 0 < apart.mean() < most


def moved(shape: dict[str, Any], sensor: dict[str, Any], scale: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """The eye and the camera turned, scaled and moved together."""
    placed = shape | {"rotation_deg": [20.0, -50.0, 70.0], "position": [1.0, -2.0, 3.0], "scale": scale}
    turn = optics_of(eye(placed)).to_world
    at = {key: (scale * turn @ np.array(sensor[key]) + placed["position"]).tolist() for key in ("origin", "target")}
    return placed, sensor | at | {"up": (turn @ np.array(sensor["up"])).tolist()}


@pytest.mark.parametrize("base", [TALK, HUMAN], ids=["talk", "human"])
def test_what_is_seen_depends_on_the_relative_place_alone(make_scene: MakeScene, base: dict[str, Any]) -> None:
    size = base["sclera_radius"]
    sensor = camera(40.0, 4.0, size)
    placed, moved_sensor = moved(base, sensor, 0.1)
    materials = {
        "white": {"type": "diffuse", "reflectance": [0.8] * 3},
        "skin": {"type": "diffuse", "reflectance": [0.4] * 3},
    }
    scenes = [
        make_scene(subject=["eye"], materials=materials, shapes=[shape], sensor=view, emitters=[])
        for shape, view in ((base, sensor), (placed, moved_sensor))
    ]
    first, second = (eye_rays.iris_coverage(scene) for scene in scenes)
    assert (first == 1).sum() > 60
    assert np.abs(first - second).max() <= 1 / 64
    everywhere = (first == 1) & (second == 1)
    a, b = (eye_rays.iris_uv(scene) for scene in scenes)
    np.testing.assert_allclose(a[everywhere[..., 0]], b[everywhere[..., 0]], atol=1e-6)


def test_a_disk_light_in_front_hides_the_iris(make_scene: MakeScene) -> None:
    sensor = camera(0.0, 5.0)
    lamp = {"type": "disk", "position": [0.0, 3.0, 0.0], "normal": [0.0, -1.0, 0.0], "radiance": [1.0] * 3}
    shapes = {"shapes": [TALK], "subject": ["eye"], "sensor": sensor}
    bare, hidden, behind = (
        eye_rays.iris_coverage(make_scene(emitters=[lamp | change], **shapes))
        for change in ({"radius": 0.001}, {"radius": 2.0}, {"radius": 2.0, "position": [0.0, -3.0, 0.0]})
    )
    assert not hidden.any()
    np.testing.assert_array_equal(bare, behind)


def test_uv_is_upright_for_one_who_looks_at_the_face(make_scene: MakeScene) -> None:
    """The eye's +x to the right of the image and -z upward, as the texture lies on the iris."""
    sensor = camera(0.0, 5.0) | {"up": [0.0, 0.0, -1.0]}
    scene = make_scene(subject=["eye"], shapes=[TALK], sensor=sensor, emitters=[])
    uv, seen = eye_rays.iris_uv(scene), eye_rays.iris_coverage(scene)[..., 0] == 1
    middle = uv[12, seen[12]]
    assert (np.diff(middle[:, 0]) > 0).all()
    assert (np.diff(uv[seen[:, 12], 12, 1]) < 0).all()
    np.testing.assert_allclose(uv[11:13, 11:13].mean(axis=(0, 1)), 0.5, atol=1e-6)


def test_the_quantities_are_judged_where_only_iris_is_seen(
    make_scene: MakeScene, reference: Callable[..., Reference]
) -> None:
    scene = make_scene(subject=["eye"], shapes=[TALK], sensor=camera(20.0, 5.0), emitters=[])
    truth = reference(scene).truth("iris_uv", 0)
    assert truth.is_exact
    assert truth.mask.sum() == (eye_rays.iris_coverage(scene) == 1).sum() > 50
    values = truth.accumulators[0][truth.mask]
    assert (np.hypot(*(values - 0.5).T) <= 0.5 + 1e-6).all()
