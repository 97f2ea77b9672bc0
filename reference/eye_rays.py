"""What a camera sees through the cornea of an eye, by exact rays in float64.

Everything happens in the eye's frame (see `scenes.eyes`) at the size that the eye has in the world: a point there is
turned and moved, never scaled. Directions are unit vectors, arrays are (..., 3), a ray that misses something has the
distance infinity to it.

A ray that comes from outside is bent where it meets the front of the cornea, and again where it enters or leaves the
sphere of the endothelium, if there is one: inside it is aqueous humour, around it the cornea. Then it sees the iris,
unless it passes beside the rim or leaves through the cornea's side first.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenes import eyes
from scenes.errors import SceneError
from scenes.image import Bool, Float32, Float64
from scenes.model import PIXEL_GRID, DiskLight, Perspective, Scene
from scenes.procedural import rotation_xyz
from scenes.shapes import Eye

Y = 1
RAYS_AT_ONCE = 1 << 18
"""Bounds the memory: about 1 KiB a ray."""


CELLS = 192
"""Along each side of the grid on which caustic lines are looked for."""


@dataclass(frozen=True)
class Ball:
    """A sphere about a point of the axis; `ior` is the refractive index inside."""

    y: float
    radius: float
    ior: float


@dataclass(frozen=True)
class Optics:
    """The surfaces of an eye at the size they have in the world.

    sclera, cornea, endothelium : spheres; the refractive index is that of what lies behind their front
    limbus_radius, limbus_y     : the circle in which cornea and sclera meet
    iris_y                      : plane of the iris' rim, whose radius is that of the limbus
    bowl                        : sphere behind that plane on which the iris lies; None for a flat iris
    to_world, position          : a point p of the eye's frame is at to_world @ p + position, with a rotation (3, 3)
    """

    sclera: Ball
    cornea: Ball
    endothelium: Ball | None
    limbus_radius: float
    limbus_y: float
    iris_y: float
    bowl: Ball | None
    pupil_radius: float
    to_world: Float64
    position: Float64

    def into(self, points: Float64) -> Float64:
        """Points (..., 3) of the world in the eye's frame."""
        turned: Float64 = (points - self.position) @ self.to_world
        return turned


def optics_of(eye: Eye) -> Optics:
    """The surfaces of an eye as it stands in the world."""
    s, inner, back, bowl_y = eye.scale, eye.endothelium, eyes.endothelium_centre(eye), eyes.iris_centre(eye)
    return Optics(
        sclera=Ball(0.0, s * eye.sclera_radius, eye.ior),
        cornea=Ball(s * eyes.cornea_centre(eye), s * eye.cornea_radius, eye.ior),
        endothelium=None if inner is None or back is None else Ball(s * back, s * inner.radius, inner.ior),
        limbus_radius=s * eye.limbus_radius,
        limbus_y=s * eyes.limbus_height(eye),
        iris_y=s * eyes.iris_plane(eye),
        bowl=None if bowl_y is None or eye.iris_curvature is None else Ball(s * bowl_y, s * eye.iris_curvature, 1.0),
        pupil_radius=s * eye.pupil_radius,
        to_world=rotation_xyz(eye.rotation_deg),
        position=np.array(eye.position),
    )


def eye_of(scene: Scene) -> Eye:
    """The eye of a scene that has one.

    Raises
    ------
    SceneError
        There are other shapes, which could hide it, shadow it or light it.
    """
    others = [shape.name for shape in scene.shapes if not isinstance(shape, Eye)]
    if others:
        raise SceneError(
            f"Scene '{scene.name}': found shapes beside the eye ({', '.join(others)}); allowed is an eye alone under "
            "lights, when what is seen through its cornea is judged. Remove them."
        )
    return next(shape for shape in scene.shapes if isinstance(shape, Eye))


def camera_rays(sensor: Perspective, x: Float64, y: Float64) -> tuple[Float64, Float64]:
    """Origin (3,) and unit directions (N, 3) in the world of the rays through film positions in pixels.

    (0, 0) is the upper left corner of the image. A lens is looked through at its centre.
    """
    origin = np.array(sensor.origin)
    forward = _unit(np.array(sensor.target) - origin)
    right = _unit(np.cross(forward, np.array(sensor.up)))
    up = np.cross(right, forward)
    half = np.tan(np.radians(sensor.fov_deg) / 2)
    side = 2 * half / (sensor.width if sensor.fov_axis == "x" else sensor.height)
    across = side * (np.asarray(x, dtype=np.float64) - sensor.width / 2)
    down = side * (np.asarray(y, dtype=np.float64) - sensor.height / 2)
    return origin, _unit(forward + across[:, None] * right - down[:, None] * up)


def sphere_roots(origin: Float64, direction: Float64, ball: Ball) -> tuple[Float64, Float64]:
    """Distances to where a ray enters and leaves a sphere; both are infinite if it passes by.

    Haines, Günther, Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems: the
    discriminant from the ray's closest point to the centre stays precise for a sphere that is small or far away.
    """
    f = origin - np.array([0.0, ball.y, 0.0])
    b = -_dot(f, direction)
    closest = f + b[..., None] * direction
    discriminant = ball.radius**2 - _dot(closest, closest)
    half = np.sqrt(np.maximum(discriminant, 0.0))
    q = b + np.copysign(half, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        other = np.where(q == 0, 0.0, (_dot(f, f) - ball.radius**2) / q)
    passes = discriminant < 0
    return np.where(passes, np.inf, np.minimum(q, other)), np.where(passes, np.inf, np.maximum(q, other))


def refract(direction: Float64, normal: Float64, eta: float) -> tuple[Float64, Bool]:
    """Direction behind a surface, and whether there is one (total reflection otherwise, and zeros).

    normal : (..., 3) against the ray; eta : refractive index before the surface over that behind it

    Heckbert 1989, "Derivation of Refraction Formulas", An Introduction to Ray Tracing.
    """
    cos_i = -_dot(direction, normal)
    cos_t_squared = 1 - eta**2 * (1 - cos_i**2)
    passes: Bool = cos_t_squared > 0
    cos_t = np.sqrt(np.maximum(cos_t_squared, 0.0))
    bent = eta * direction + (eta * cos_i - cos_t)[..., None] * normal
    return np.where(passes[..., None], bent, 0.0), passes


def outer_hit(optics: Optics, origin: Float64, direction: Float64) -> tuple[Float64, Bool]:
    """Distance to the eye from outside, and whether it is the cornea that is met there.

    Both spheres are met at their fronts: what faces away lies behind another part of the closed surface.
    """
    cornea, _ = sphere_roots(origin, direction, optics.cornea)
    sclera, _ = sphere_roots(origin, direction, optics.sclera)
    on_cornea = _height(origin, direction, cornea) > optics.limbus_y
    on_sclera = _height(origin, direction, sclera) <= optics.limbus_y
    cornea = np.where((cornea > 0) & on_cornea, cornea, np.inf)
    sclera = np.where((sclera > 0) & on_sclera, sclera, np.inf)
    return np.minimum(cornea, sclera), cornea < sclera


def iris_hit(optics: Optics, origin: Float64, direction: Float64) -> Float64:
    """Distance to the iris of a ray inside the eye, from a point in front of the plane of its rim or in its bowl."""
    with np.errstate(divide="ignore", invalid="ignore"):
        plane = np.where(direction[..., Y] < 0, (optics.iris_y - origin[..., Y]) / direction[..., Y], np.inf)
    at_plane = _at(origin, direction, np.where(np.isfinite(plane), plane, 0.0))
    passes_rim = (
        (plane > 0) & np.isfinite(plane) & (np.hypot(at_plane[..., 0], at_plane[..., 2]) <= optics.limbus_radius)
    )
    if optics.bowl is None:
        return np.where(passes_rim, plane, np.inf)
    near, far = sphere_roots(origin, direction, optics.bowl)
    is_in_bowl = (origin[..., Y] <= optics.iris_y) & (near <= 0) & (far > 0)
    stays = is_in_bowl & (_height(origin, direction, far) <= optics.iris_y)
    return np.where(passes_rim | stays, far, np.inf)


def look_inside(optics: Optics, origin: Float64, direction: Float64) -> tuple[Float64, Bool]:
    """Points (..., 3) of the iris that rays from outside see through the cornea, and whether they see it.

    Parameters
    ----------
    origin, direction : (..., 3) in the eye's frame
    """
    t, on_cornea = outer_hit(optics, origin, direction)
    points, sees = _through_cornea(optics, _at(origin, direction, np.where(on_cornea, t, 0.0)), direction)
    return points, sees & on_cornea


def _through_cornea(optics: Optics, origin: Float64, direction: Float64) -> tuple[Float64, Bool]:
    """Points of the iris that rays meet which come from outside to points of the cornea, and whether they meet it."""
    sees = np.ones(direction.shape[:-1], dtype=bool)
    direction, _ = refract(direction, _normal(origin, optics.cornea), 1 / optics.cornea.ior)
    if optics.endothelium is not None:
        origin, direction, sees = _through_endothelium(optics, optics.endothelium, origin, direction, sees)
    sees = sees & ~_leaves_sideways(optics, origin, direction)
    t = iris_hit(optics, origin, direction)
    sees = sees & np.isfinite(t)
    return _at(origin, direction, np.where(sees, t, 0.0)), sees


def _leaves_sideways(optics: Optics, origin: Float64, direction: Float64) -> Bool:
    """Whether a ray in the eye meets the cornea's front again, from inside, before the iris."""
    _, far = sphere_roots(origin, direction, optics.cornea)
    return (_height(origin, direction, far) > optics.limbus_y) & (far < iris_hit(optics, origin, direction))


def _through_endothelium(
    optics: Optics, ball: Ball, origin: Float64, direction: Float64, sees: Bool
) -> tuple[Float64, Float64, Bool]:
    """Rays after they went into the sphere of the endothelium, and out again where it ends before the iris."""
    near, _ = sphere_roots(origin, direction, ball)
    enters = (near > 0) & (near < iris_hit(optics, origin, direction))
    origin, direction, in_passes = _bent(origin, direction, near, enters, ball, optics.cornea.ior / ball.ior, +1)
    _, far = sphere_roots(origin, direction, ball)
    leaves = enters & (far < iris_hit(optics, origin, direction))
    origin, direction, out_passes = _bent(origin, direction, far, leaves, ball, ball.ior / optics.cornea.ior, -1)
    return origin, direction, sees & in_passes & out_passes


def _bent(
    origin: Float64, direction: Float64, t: Float64, where: Bool, ball: Ball, eta: float, side: int
) -> tuple[Float64, Float64, Bool]:
    """Rays moved by t to a sphere and refracted there, where that is to happen; false where they cannot pass it."""
    at = _at(origin, direction, np.where(where, t, 0.0))
    bent, passes = refract(direction, side * _normal(at, ball), eta)
    return at, np.where(where[..., None], bent, direction), passes | ~where


def folds(optics: Optics, light: Float64, is_far: bool) -> bool:
    """Whether light of one point reaches some of the iris in more than one way, beside a caustic line.

    The cornea's front is covered with a grid. The beam through a cell that arrives turned over has passed a focus.

    Parameters
    ----------
    light : (3,) its place in the eye's frame, or the unit vector to it if it `is_far`
    """
    ball = optics.cornea
    side = np.linspace(-1, 1, CELLS + 1) * optics.limbus_radius / (optics.limbus_y - ball.y)
    a, b = np.meshgrid(side, side, indexing="ij")
    outward = _unit(np.stack([a, np.ones_like(a), b], axis=-1))
    p = outward * ball.radius + np.array([0.0, ball.y, 0.0])
    to_light = np.broadcast_to(light, p.shape) if is_far else _unit(light - p)
    x, arrives = _through_cornea(optics, p, -to_light)
    arrives = arrives & (p[..., Y] >= optics.limbus_y) & (_dot(outward, to_light) > 0)
    (xa, za), (xb, zb) = (
        np.moveaxis(d[..., [0, 2]], -1, 0) for d in (x[1:, 1:] - x[:-1, :-1], x[:-1, 1:] - x[1:, :-1])
    )
    is_whole = arrives[1:, 1:] & arrives[:-1, :-1] & arrives[:-1, 1:] & arrives[1:, :-1]
    return bool((is_whole & (xa * zb - za * xb <= 0)).any())


def uv_of(optics: Optics, points: Float64) -> Float64:
    """Iris coordinates (..., 2) of points in the eye's frame, in diameters of the iris from its lower left corner."""
    uv: Float64 = 0.5 + points[..., [0, 2]] * (0.5, -0.5) / optics.limbus_radius
    return uv


def iris_coverage(scene: Scene) -> Float32:
    """Fraction of each pixel (H, W, 1) that sees the iris or the pupil: of a regular 8 x 8 grid."""
    offsets = (np.arange(PIXEL_GRID) + 0.5) / PIXEL_GRID
    du, dv = (d.ravel() for d in np.meshgrid(offsets, offsets))

    def of_pixels(x: Float64, y: Float64) -> Float64:
        _, sees = _look(scene, (x[:, None] + du).ravel(), (y[:, None] + dv).ravel())
        fraction: Float64 = sees.reshape(-1, PIXEL_GRID**2).mean(axis=1, keepdims=True)
        return fraction

    return _image(scene.sensor, of_pixels, RAYS_AT_ONCE // PIXEL_GRID**2)


def iris_uv(scene: Scene) -> Float32:
    """Iris coordinate (H, W, 2) that the ray through each pixel's centre sees; 0 where it sees no iris."""
    optics = optics_of(eye_of(scene))

    def of_pixels(x: Float64, y: Float64) -> Float64:
        points, sees = _look(scene, x + 0.5, y + 0.5)
        return np.where(sees[:, None], uv_of(optics, points), 0.0)

    return _image(scene.sensor, of_pixels, RAYS_AT_ONCE)


def _look(scene: Scene, x: Float64, y: Float64) -> tuple[Float64, Bool]:
    """What the camera sees of the iris through film positions, where no disk light hides the eye."""
    optics = optics_of(eye_of(scene))
    origin, direction = camera_rays(scene.sensor, x, y)
    local_origin = np.broadcast_to(optics.into(origin), direction.shape)
    local_direction = direction @ optics.to_world
    points, sees = look_inside(optics, local_origin, local_direction)
    eye_t, _ = outer_hit(optics, local_origin, local_direction)
    for light in scene.emitters:
        if isinstance(light, DiskLight):
            sees = sees & ~(_disk_distance(light, origin, direction) < eye_t)
    return points, sees


def _disk_distance(light: DiskLight, origin: Float64, direction: Float64) -> Float64:
    normal = _unit(np.array(light.normal))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((np.array(light.position) - origin) @ normal) / (direction @ normal)
        away = np.linalg.norm(origin + t[:, None] * direction - np.array(light.position), axis=-1)
    return np.where((t > 0) & (away <= light.radius), t, np.inf)


def _image(sensor: Perspective, of_pixels: Callable[[Float64, Float64], Float64], pixels_at_once: int) -> Float32:
    """An image (H, W, C) from a function of pixels' upper left corners, a band of rows at a time."""
    rows = max(1, pixels_at_once // sensor.width)
    bands = []
    for top in range(0, sensor.height, rows):
        y, x = np.mgrid[top : min(top + rows, sensor.height), 0 : sensor.width].astype(np.float64)
        bands.append(of_pixels(x.ravel(), y.ravel()).reshape(*x.shape, -1))
    return np.concatenate(bands).astype(np.float32)


def _at(origin: Float64, direction: Float64, t: Float64) -> Float64:
    moved: Float64 = origin + t[..., None] * direction
    return moved


def _height(origin: Float64, direction: Float64, t: Float64) -> Float64:
    """The y of the point at a distance, which may be infinite."""
    with np.errstate(invalid="ignore"):
        y: Float64 = origin[..., Y] + np.where(np.isfinite(t), t, np.nan) * direction[..., Y]
    return y


def _normal(points: Float64, ball: Ball) -> Float64:
    outward: Float64 = (points - np.array([0.0, ball.y, 0.0])) / ball.radius
    return outward


def _dot(a: Float64, b: Float64) -> Float64:
    product: Float64 = np.einsum("...i,...i->...", a, b)
    return product


def _unit(vectors: Float64) -> Float64:
    lengths: Float64 = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / lengths
