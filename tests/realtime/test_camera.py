from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pydantic import TypeAdapter

from realtime.camera import (
    FACES,
    Camera,
    basis_along,
    cube_cameras,
    orthographic_matrix,
    parallel_camera,
    perspective_matrix,
    sensor_camera,
    unit,
)
from scenes.image import Float64
from scenes.model import Perspective, Sensor

Glsl = Callable[..., Float64]

coordinates = st.floats(-5, 5)
points = st.tuples(coordinates, coordinates, coordinates)


def projected(camera: Camera, point: Float64) -> Float64:
    """Normalised device coordinates."""
    clip = camera.matrix @ np.append(point, 1.0)
    ndc: Float64 = clip[:3] / clip[3]
    return ndc


def sensor(**changes: object) -> Perspective:
    plain = {"type": "perspective", "origin": (0.0, 0.0, 0.0), "target": (0.0, 0.0, -1.0), "fov_deg": 50.0} | changes
    adapter: TypeAdapter[Perspective] = TypeAdapter(Sensor)
    return adapter.validate_python(plain)


def grid_of_directions(side: int) -> tuple[Float64, Float64]:
    """Face and st of the texel centres of all six faces, as vec4 (N, 1, 4), and the size of a texel."""
    centres = (np.arange(side) + 0.5) / side * 2 - 1
    face, t, s = np.meshgrid(np.arange(6.0), centres, centres, indexing="ij")
    return np.stack([face, s, t, np.zeros_like(s)], axis=-1).reshape(-1, 1, 4), centres


@pytest.mark.parametrize("face", range(6))
def test_each_face_of_the_cube_has_a_right_handed_basis(face: int) -> None:
    forward, right, up = (np.array(v, dtype=float) for v in FACES[face])
    np.testing.assert_array_equal(np.cross(right, up), -forward)


def test_the_faces_look_along_all_six_axes_in_opengl_order() -> None:
    axes = [axis for pair in zip(np.eye(3), -np.eye(3), strict=True) for axis in pair]
    np.testing.assert_array_equal([forward for forward, _, _ in FACES], axes)


def test_directions_in_glsl_are_those_of_the_faces_in_python(glsl: Glsl) -> None:
    given_, _ = grid_of_directions(8)
    made = glsl("lib/cube.glsl", "r[0].xyz = cube_direction(int(a[0].x), a[0].yz);", given_)[:, 0, :3]
    faces = np.array(FACES, dtype=float)[given_[:, 0, 0].astype(int)]
    expected = faces[:, 0] + given_[:, 0, 1:2] * faces[:, 1] + given_[:, 0, 2:3] * faces[:, 2]
    np.testing.assert_allclose(made, expected, atol=1e-6)


def test_a_direction_finds_its_face_and_texel_again(glsl: Glsl) -> None:
    given_, _ = grid_of_directions(8)
    body = "vec2 st; r[0].x = float(cube_face(3.7 * cube_direction(int(a[0].x), a[0].yz), st)); r[0].yz = st;"
    made = glsl("lib/cube.glsl", body, given_)
    np.testing.assert_allclose(made[:, 0, :3], given_[:, 0, :3], atol=1e-6)


def test_a_texel_is_drawn_where_its_direction_is_looked_up() -> None:
    eye = np.array([0.3, -0.2, 0.5])
    for camera, (forward, right, up) in zip(cube_cameras(eye, 0.01, 10.0), FACES, strict=True):
        for s, t in ((0.0, 0.0), (0.6, 0.2), (-0.9, 0.7)):
            direction = np.array(forward) + s * np.array(right) + t * np.array(up)
            np.testing.assert_allclose(projected(camera, eye + 2.5 * direction)[:2], (s, t), atol=1e-12)


@pytest.mark.parametrize("side", [16, 96])
def test_solid_angles_of_all_texels_fill_the_sphere(glsl: Glsl, side: int) -> None:
    given_, _ = grid_of_directions(side)
    made = glsl("lib/cube.glsl", f"r[0].x = cube_texel_solid_angle(a[0].yz, {side}.0);", given_)
    assert made[:, 0, 0].sum() == pytest.approx(4 * np.pi, rel=1e-3)


def test_the_solid_angle_of_one_texel_is_the_exact_one(glsl: Glsl) -> None:
    """Midpoint rule against the closed form, atan(xy / sqrt(1 + x² + y²)) differenced over the corners."""
    side = 32
    given_, _ = grid_of_directions(side)
    made = glsl("lib/cube.glsl", f"r[0].x = cube_texel_solid_angle(a[0].yz, {side}.0);", given_)[:, 0, 0]

    def corner(x: Float64, y: Float64) -> Float64:
        return np.arctan2(x * y, np.sqrt(1 + x * x + y * y))

    low, high = given_[:, 0, 1:3] - 1 / side, given_[:, 0, 1:3] + 1 / side
    exact = corner(high[:, 0], high[:, 1]) - corner(low[:, 0], high[:, 1])
    exact += corner(low[:, 0], low[:, 1]) - corner(high[:, 0], low[:, 1])
    np.testing.assert_allclose(made, exact, rtol=2e-3)


@given(points, points, st.floats(5, 170), st.integers(1, 400), st.integers(1, 400))
def test_the_target_is_in_the_middle_of_the_image(
    origin: tuple[float, ...], target: tuple[float, ...], fov_deg: float, width: int, height: int
) -> None:
    forward = np.array(target) - np.array(origin)
    assume(np.linalg.norm(np.cross(forward, [0, 1, 0])) > 1e-2)
    seen = sensor(origin=origin, target=target, fov_deg=fov_deg, width=width, height=height)
    np.testing.assert_allclose(projected(sensor_camera(seen, 1e-3, 100.0), np.array(target))[:2], 0, atol=1e-6)


@pytest.mark.parametrize(("axis", "width", "height"), [("x", 160, 90), ("y", 160, 90), ("x", 88, 136), ("y", 88, 136)])
@pytest.mark.parametrize("fov_deg", [24.0, 85.0])
def test_the_field_of_view_spans_the_image_along_its_axis(axis: str, width: int, height: int, fov_deg: float) -> None:
    camera = sensor_camera(sensor(fov_deg=fov_deg, fov_axis=axis, width=width, height=height), 0.1, 10.0)
    tangent = np.tan(np.radians(fov_deg / 2))
    along = tangent if axis == "x" else tangent * width / height
    ndc = projected(camera, np.array([along, along * height / width, -1.0]))
    np.testing.assert_allclose(ndc[:2], (1, 1), rtol=1e-12)


def test_the_image_has_x_to_the_right_and_y_up() -> None:
    """Seen along -z with +y up, as in the contract."""
    ndc = projected(sensor_camera(sensor(), 0.1, 10.0), np.array([0.1, 0.2, -1.0]))
    assert ndc[0] > 0
    assert ndc[1] > 0


@pytest.mark.parametrize("matrix", [perspective_matrix(0.7, 0.4, 0.25, 8.0), orthographic_matrix(3.0, 0.25, 8.0)])
def test_clip_planes_are_at_near_and_far(matrix: Float64) -> None:
    for z, expected in ((0.25, -1.0), (8.0, 1.0)):
        clip = matrix @ np.array([0.0, 0.0, -z, 1.0])
        assert clip[2] / clip[3] == pytest.approx(expected)


@given(points)
def test_a_basis_along_any_direction_is_orthonormal_and_right_handed(direction: tuple[float, ...]) -> None:
    assume(np.linalg.norm(direction) > 1e-3)
    forward = unit(np.array(direction))
    right, up = basis_along(forward)
    np.testing.assert_allclose(np.linalg.inv([right, up, -forward]), np.transpose([right, up, -forward]), atol=1e-9)
    np.testing.assert_allclose(np.cross(right, up), -forward, atol=1e-9)


@given(points, points, points, st.floats(0.1, 4))
def test_a_parallel_camera_sees_the_whole_ball(
    direction: tuple[float, ...], centre: tuple[float, ...], towards: tuple[float, ...], radius: float
) -> None:
    assume(np.linalg.norm(direction) > 1e-3)
    assume(np.linalg.norm(towards) > 1e-3)
    camera = parallel_camera(unit(np.array(direction)), np.array(centre), radius)
    ndc = projected(camera, np.array(centre) + radius * unit(np.array(towards)))
    assert np.abs(ndc).max() <= 1 + 1e-9
