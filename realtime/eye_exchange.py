"""How light that leaves the iris comes back to it: off the inside of the cornea, and in a bowl from across."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from realtime.eye import EyeModel
from realtime.fresnel import fresnel_dielectric
from scenes.image import Float32, Float64

RINGS, SECTORS = 16, 24
"""Cells of the iris, evenly spaced in radius and azimuth."""

RAYS_A_RING = 1 << 13
MOST_REFLECTIONS = 8
"""Light that creeps along the cornea by total reflection comes back to it ever farther out: few rays need more."""


@cache
def iris_exchange(eye: EyeModel) -> Float32:
    """Irradiance of one ring per unit of radiosity of another, by azimuth between them: (RINGS, RINGS, SECTORS).

    Row k, column j, entry a is the part of what a point of ring k receives that comes from the cell of ring j that lies
    a sectors on. A row sums to less than 1 by what gets out of the eye, or falls beside the iris on its black wall.
    Each ring shoots RAYS_A_RING directions, as dense as the cosine (R2 sequence), from points all over a cell.
    """
    u = (0.5 + np.outer(np.arange(RAYS_A_RING), _R4)) % 1
    return np.stack([_received(eye, ring, u) for ring in range(RINGS)]).astype(np.float32)


_ROOT = 1.16730397826141868426
_R4 = _ROOT ** -np.arange(1.0, 5.0)
"""Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences", in four dimensions: x^5 = x + 1."""


def _received(eye: EyeModel, ring: int, u: Float64) -> Float64:
    r = np.sqrt(ring**2 + u[:, 0] * (2 * ring + 1)) / RINGS * eye.limbus_radius
    sector = 2 * np.pi / SECTORS
    phi = u[:, 1] * sector
    origin, normal = _on_iris(eye, r, phi)
    direction = _cosine_directions(normal, u[:, 2], u[:, 3])
    weight, landing = _traced(eye, origin, direction)
    there = np.hypot(landing[:, 0], landing[:, 2]) / eye.limbus_radius
    j = np.minimum((there * RINGS).astype(int), RINGS - 1)
    a = (np.arctan2(-landing[:, 2], landing[:, 0]) % (2 * np.pi) / sector).astype(int) % SECTORS
    total = np.zeros((RINGS, SECTORS))
    np.add.at(total, (j, a), weight / len(u))
    return total


def _on_iris(eye: EyeModel, r: Float64, phi: Float64) -> tuple[Float64, Float64]:
    """Points and normals, as iris_point of glsl/lib/eye.glsl."""
    y, normal = np.full_like(r, eye.iris_plane), np.tile((0.0, 1.0, 0.0), (len(r), 1))
    if eye.iris_curvature:
        y = eye.iris_centre - np.sqrt(eye.iris_curvature**2 - r**2)
    points = np.stack([r * np.cos(phi), y, -r * np.sin(phi)], axis=1)
    if eye.iris_curvature:
        normal = ((0.0, eye.iris_centre, 0.0) - points) / eye.iris_curvature
    return points, normal


def _cosine_directions(normal: Float64, u: Float64, v: Float64) -> Float64:
    side = np.cross(normal, (0.0, 0.0, 1.0))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    r, angle = np.sqrt(u)[:, None], 2 * np.pi * v[:, None]
    made: Float64 = r * np.cos(angle) * side + r * np.sin(angle) * np.cross(normal, side)
    return made + np.sqrt(1 - u)[:, None] * normal


def _traced(eye: EyeModel, origin: Float64, direction: Float64) -> tuple[Float64, Float64]:
    """Follow rays from the iris until they are on it again: what is left of each (0: lost), and where it lands."""
    centre = np.array([0.0, eye.cornea_centre, 0.0])
    x, d = origin.copy(), direction.copy()
    weight, landing = np.zeros(len(x)), np.zeros_like(x)
    alive, left = np.arange(len(x)), np.ones(len(x))
    for reflection in range(MOST_REFLECTIONS + 1):
        lands, place = _iris_hit(eye, x, d, leaves_iris=reflection == 0)
        weight[alive[lands]], landing[alive[lands]] = left[lands], place[lands]
        x, d, alive, left = x[~lands], d[~lands], alive[~lands], left[~lands]
        x = x + _far_root(x - centre, d, eye.cornea_radius)[:, None] * d
        n = (x - centre) / eye.cornea_radius
        cosine = np.sum(n * d, axis=1)
        left = left * _internal_reflectance(eye, cosine)
        d = d - 2 * cosine[:, None] * n
        on_cornea = x[:, 1] > eye.limbus_height
        x, d, alive, left = x[on_cornea], d[on_cornea], alive[on_cornea], left[on_cornea]
    return weight, landing


def _internal_reflectance(eye: EyeModel, cos_i: Float64) -> Float64:
    """What the cornea's front throws back inside: all, where no light leaves the eye.

    Light comes at `cos_i` through what lies behind the cornea, of index `ior`. That alone tells at what angle it
    leaves, for a layer with parallel sides does not turn it; what part is reflected is up to the cornea's `front_ior`.
    """
    cos2_t = 1 - eye.ior**2 * (1 - cos_i**2)
    return fresnel_dielectric(np.sqrt(np.maximum(cos2_t, 0)), eye.front_ior)


def _iris_hit(eye: EyeModel, x: Float64, d: Float64, *, leaves_iris: bool) -> tuple[NDArray[np.bool_], Float64]:
    """Which rays meet the iris, and where; from the iris itself only a bowl can be met, below its rim."""
    if leaves_iris and not eye.iris_curvature:
        return np.zeros(len(x), dtype=bool), x
    if leaves_iris:
        t = _far_root(x - (0.0, eye.iris_centre, 0.0), d, eye.iris_curvature)
        place = x + t[:, None] * d
        return place[:, 1] < eye.iris_plane, place
    down = d[:, 1] < 0
    t = (eye.iris_plane - x[:, 1]) / np.where(down, d[:, 1], -1.0)
    place = x + t[:, None] * d
    inside = down & (np.hypot(place[:, 0], place[:, 2]) < eye.limbus_radius)
    if eye.iris_curvature:
        place = place + _far_root(place - (0.0, eye.iris_centre, 0.0), d, eye.iris_curvature)[:, None] * d
    return inside, place


def _far_root(o: Float64, d: Float64, radius: float) -> Float64:
    """Distance at which rays from inside a sphere about the origin leave it."""
    b = np.sum(o * d, axis=1)
    l2 = np.sum((o - b[:, None] * d) ** 2, axis=1)
    root: Float64 = -b + np.sqrt(np.maximum(radius**2 - l2, 0))
    return root
