"""View and projection matrices, row-major: a column vector is multiplied from the right."""

from dataclasses import dataclass

import numpy as np

from scenes.image import Float64
from scenes.model import Perspective, ThinLens
from scenes.units import Vec3

FACES: tuple[tuple[Vec3, Vec3, Vec3], ...] = (
    ((1, 0, 0), (0, 0, -1), (0, -1, 0)),
    ((-1, 0, 0), (0, 0, 1), (0, -1, 0)),
    ((0, 1, 0), (1, 0, 0), (0, 0, 1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, -1)),
    ((0, 0, 1), (1, 0, 0), (0, -1, 0)),
    ((0, 0, -1), (-1, 0, 0), (0, -1, 0)),
)
"""Forward, right and up of the six faces of a cube map (OpenGL 4.6 specification, table 8.19); +X -X +Y -Y +Z -Z."""


@dataclass(frozen=True)
class Camera:
    """A pinhole at `eye`; `matrix` takes world space to clip space."""

    eye: Float64
    matrix: Float64
    forward: Float64


def view_matrix(eye: Float64, forward: Float64, right: Float64, up: Float64) -> Float64:
    """World space to a space whose axes are right, up and backward."""
    matrix = np.eye(4)
    matrix[:3, :3] = right, up, -forward
    matrix[:3, 3] = -matrix[:3, :3] @ eye
    return matrix


def perspective_matrix(tan_half_x: float, tan_half_y: float, near: float, far: float) -> Float64:
    """OpenGL 4.6 compatibility specification, section 12.1.1, of a symmetric frustum."""
    matrix = np.zeros((4, 4))
    matrix[0, 0] = 1 / tan_half_x
    matrix[1, 1] = 1 / tan_half_y
    matrix[2, 2] = (near + far) / (near - far)
    matrix[2, 3] = 2 * near * far / (near - far)
    matrix[3, 2] = -1
    return matrix


def orthographic_matrix(radius: float, near: float, far: float) -> Float64:
    """Parallel projection of a square of half width `radius`."""
    return np.array(
        [
            [1 / radius, 0, 0, 0],
            [0, 1 / radius, 0, 0],
            [0, 0, -2 / (far - near), -(far + near) / (far - near)],
            [0, 0, 0, 1],
        ]
    )


def unit(vector: Float64) -> Float64:
    """The vector at length 1."""
    normalised: Float64 = vector / np.linalg.norm(vector)
    return normalised


def basis_along(forward: Float64) -> tuple[Float64, Float64]:
    """Some right and up that complete `forward` to a basis with right x up = -forward.

    The helper is chosen in float32, so that glsl/lib/shadow.glsl chooses the same.
    """
    steep = np.float32(abs(forward[1])) >= np.float32(0.9)
    helper = np.array([1.0, 0.0, 0.0]) if steep else np.array([0.0, 1.0, 0.0])
    right = unit(np.cross(forward, helper))
    return right, np.cross(right, forward)


def sensor_camera(sensor: Perspective, near: float, far: float) -> Camera:
    """The camera of a sensor; a thin lens is seen through its centre."""
    return lens_camera(sensor, near, far, (0.0, 0.0))


def lens_camera(sensor: Perspective, near: float, far: float, place: tuple[float, float]) -> Camera:
    """The camera that sits in a `place` (right, up) on the lens: what lies at the focus distance stays where it is.

    Haeberli & Akeley 1990, "The Accumulation Buffer: Hardware Support for High-Quality Rendering", section 5.
    """
    eye = np.array(sensor.origin, dtype=float)
    forward = unit(np.array(sensor.target, dtype=float) - eye)
    right = unit(np.cross(forward, np.array(sensor.up, dtype=float)))
    up = np.cross(right, forward)
    tangent = float(np.tan(np.radians(sensor.fov_deg) / 2))
    aspect = sensor.width / sensor.height
    x, y = (tangent, tangent / aspect) if sensor.fov_axis == "x" else (tangent * aspect, tangent)
    view = view_matrix(eye, forward, right, up)
    if isinstance(sensor, ThinLens) and place != (0.0, 0.0):
        shear = np.eye(4)
        shear[:2, 3] = -np.array(place)
        shear[:2, 2] = -np.array(place) / sensor.focus_distance
        view = shear @ view
        eye = eye + place[0] * right + place[1] * up
    return Camera(eye, perspective_matrix(x, y, near, far) @ view, forward)


def ray_axes(camera: Camera) -> tuple[Float64, Float64, Float64]:
    """Forward, right and up (3,): the ray through x, y in normalised device coordinates is forward + x right + y up."""
    rows = np.stack([camera.matrix[0, :3], camera.matrix[1, :3], camera.forward])
    right, up, forward = np.linalg.inv(rows).T
    return forward, right, up


def cube_cameras(eye: Float64, near: float, far: float) -> tuple[Camera, ...]:
    """Six cameras of 90 degrees; window row 0 is the first row of the cube map's face."""
    projection = perspective_matrix(1.0, 1.0, near, far)
    cameras = []
    for forward, right, up in FACES:
        f, r, u = (np.array(v, dtype=float) for v in (forward, right, up))
        cameras.append(Camera(eye, projection @ view_matrix(eye, f, r, u), f))
    return tuple(cameras)


def parallel_camera(direction: Float64, centre: Float64, radius: float) -> Camera:
    """Looks along `direction` at a ball, in parallel projection."""
    right, up = basis_along(direction)
    eye = centre - 2 * radius * direction
    return Camera(
        eye, orthographic_matrix(radius, radius, 3 * radius) @ view_matrix(eye, direction, right, up), direction
    )
