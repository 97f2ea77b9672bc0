"""Rays through a relief itself, never through its mesh, in double precision.

Ramsey, Potter and Hansen 2004, "Ray Bilinear Patch Intersections", for a patch over a cell of a grid: along a ray the
height above the patch is a polynomial of second degree, whose first root is where the ray meets it. Cells are visited
in the order in which the ray passes them: Amanatides and Woo 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing".
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from reference.eye_rays import camera_rays
from scenes.geometry import heights_of
from scenes.image import Bool, Float32, Float64
from scenes.model import Scene
from scenes.procedural import rotation_xyz
from scenes.shapes import Relief

RAYS_AT_ONCE = 1 << 16
"""Bounds the memory: about 1 KiB a ray."""

MARGIN = 1e-9
"""The block reaches that much below the height 0, in heights: rays to a floor at 0 meet it, whatever the rounding."""

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Block:
    """A relief as it stands in the world.

    heights : (N, M), row 0 at v = 0
    extent  : (3,) lengths in the world of one sample along u, of one along v, and of the height 1
    to_world, position : a point p of the grid (samples along u, samples along v, height) is at
        to_world @ (extent * (p - middle)) + position, with a rotation (3, 3)
    """

    heights: Float64
    extent: Float64
    to_world: Float64
    position: Float64

    @property
    def last(self) -> Float64:
        """The grid coordinates (2,) of the last sample."""
        return np.array([self.heights.shape[1] - 1.0, self.heights.shape[0] - 1.0])

    @property
    def middle(self) -> Float64:
        """The grid coordinates (3,) of the shape's origin."""
        return np.array([*(0.5 * self.last), 1.0])

    def into(self, points: Float64) -> Float64:
        """Points (..., 3) of the world on the grid."""
        turned: Float64 = (points - self.position) @ self.to_world / self.extent + self.middle
        return turned

    def along(self, directions: Float64) -> Float64:
        """Directions (..., 3) of the world on the grid, without changing the distances along them."""
        turned: Float64 = directions @ self.to_world / self.extent
        return turned


@dataclass(frozen=True)
class Hits:
    """Where rays meet a block first.

    t    : (R,) in lengths of the directions; infinite where they pass by
    grid : (R, 3) the place on the grid, 0 where they pass by
    """

    t: Float64
    grid: Float64


def block_of(scene: Scene, shape: Relief) -> Block:
    """A relief with its samples, at the size that it has in the world."""
    heights = heights_of(scene, shape)
    rows, columns = heights.shape
    size = np.array([shape.size[0] / (columns - 1), shape.size[1] / (rows - 1), shape.depth])
    return Block(heights, shape.scale * size, rotation_xyz(shape.rotation_deg), np.array(shape.position))


def subject_of(scene: Scene) -> Relief:
    """The relief that is a scene's subject."""
    return next(shape for shape in scene.shapes if isinstance(shape, Relief) and shape.name in scene.subject)


def cast(block: Block, origins: Float64, directions: Float64) -> Hits:
    """The first hits of rays with a block.

    A ray that is below the lowest height, where the block has no bottom, has passed it.

    origins, directions : (R, 3) in the world; directions of any length but 0
    """
    starts, along = block.into(origins), block.along(directions)
    parts = [
        _cast(block.heights, starts[first : first + RAYS_AT_ONCE], along[first : first + RAYS_AT_ONCE])
        for first in range(0, max(len(starts), 1), RAYS_AT_ONCE)
    ]
    return Hits(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("t", "grid")))


def seen_from(scene: Scene, block: Block, x: Float64, y: Float64) -> Hits:
    """What the camera sees of a block through film positions (R,) in pixels; a lens is looked through at its centre."""
    origin, directions = camera_rays(scene.sensor, x, y)
    return cast(block, np.broadcast_to(origin, directions.shape), directions)


def displaced_uv(scene: Scene) -> Float32:
    """Grid coordinate (H, W, 2), in samples, that the ray through each pixel's centre meets; 0 where it meets none."""
    y, x = np.mgrid[0 : scene.sensor.height, 0 : scene.sensor.width] + 0.5
    hits = seen_from(scene, block_of(scene, subject_of(scene)), x.ravel(), y.ravel())
    return hits.grid[:, :2].reshape(*x.shape, 2).astype(np.float32)


@dataclass(frozen=True)
class _Rays:
    """Rays in the cells of the grid that they have come to.

    index : which of all rays; o, d : (R, 3) on the grid; near, far : the part of the ray from the cell on
    """

    index: Ints
    o: Float64
    d: Float64
    near: Float64
    far: Float64
    cell: Ints

    def only(self, chosen: Bool | Ints) -> "_Rays":
        return _Rays(*(getattr(self, field.name)[chosen] for field in fields(self)))


def _cast(heights: Float64, o: Float64, d: Float64) -> Hits:
    hits = Hits(t=np.full(len(o), np.inf), grid=np.zeros_like(o))
    rays = _entering(heights, o, d)
    while len(rays.index):
        crossings = _crossings(rays)
        leaves = np.maximum(np.minimum(crossings.min(axis=1), rays.far), rays.near)
        t = _first_root(heights, rays, leaves)
        met = rays.only(np.isfinite(t))
        hits.t[met.index] = t[np.isfinite(t)]
        hits.grid[met.index] = met.o + hits.t[met.index, None] * met.d
        across = np.eye(2, dtype=np.int64)[crossings.argmin(axis=1)]
        moved = replace(rays, near=leaves, cell=rays.cell + across * np.sign(rays.d[:, :2]).astype(np.int64))
        rays = moved.only(~np.isfinite(t) & (leaves < rays.far) & _is_cell(heights, moved.cell))
    return hits


def _is_cell(heights: Float64, cell: Ints) -> Bool:
    column, row = cell.T
    inside: Bool = (column >= 0) & (column < heights.shape[1] - 1) & (row >= 0) & (row < heights.shape[0] - 1)
    return inside


def _entering(heights: Float64, o: Float64, d: Float64) -> _Rays:
    """Those rays that come into the box about a block, but not from below."""
    low = np.array([0.0, 0.0, -MARGIN])
    high = np.array([heights.shape[1] - 1.0, heights.shape[0] - 1.0, 1.0])
    with np.errstate(divide="ignore", invalid="ignore"):
        to_low, to_high = (low - o) / d, (high - o) / d
    is_within = (low <= o) & (o <= high)
    enters = np.where(d != 0, np.minimum(to_low, to_high), np.where(is_within, -np.inf, np.inf))
    leaves = np.where(d != 0, np.maximum(to_low, to_high), np.inf)
    near, far = enters.max(axis=1), leaves.min(axis=1)
    comes = (near <= far) & (far > 0) & ~((near > 0) & (enters.argmax(axis=1) == 2) & (d[:, 2] > 0))
    near = np.maximum(near, 0.0)
    place = o[:, :2] + np.where(comes, near, 0.0)[:, None] * d[:, :2]
    cell = np.clip(np.floor(place).astype(np.int64), 0, np.array(heights.shape[::-1]) - 2)
    return _Rays(np.arange(len(o)), o, d, near, far, cell).only(comes)


def _crossings(rays: _Rays) -> Float64:
    """Distances (R, 2) at which rays cross the sides of their cells, across u and across v."""
    ahead = rays.cell + (rays.d[:, :2] > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (ahead - rays.o[:, :2]) / rays.d[:, :2]
    return np.where(rays.d[:, :2] != 0, t, np.inf)


def _patch(heights: Float64, cell: Ints) -> tuple[Float64, Float64, Float64, Float64]:
    """The a, b, c and e of the height a + b s + c t + e s t over cells, s and t from 0 to 1."""
    column, row = cell.T
    a, right = heights[row, column], heights[row, column + 1]
    above, across = heights[row + 1, column], heights[row + 1, column + 1]
    return a, right - a, above - a, across - right - above + a


def _first_root(heights: Float64, rays: _Rays, leaves: Float64) -> Float64:
    """Distances at which rays meet the patches of their cells before they leave them; infinite for those that do not.

    With w from where the ray enters its height above the patch is A w² + B w + C. It comes from outside: if it is not
    above the patch there, it meets a wall, or a patch whose side it crosses to rounding. Of the roots, that in which
    nothing cancels is taken. Press et al. 2007, "Numerical Recipes", section 5.6.
    """
    a, b, c, e = _patch(heights, rays.cell)
    dx, dy, dz = rays.d.T
    place = rays.o + rays.near[:, None] * rays.d
    s, t = (place[:, :2] - rays.cell).T
    height = place[:, 2] - (a + b * s + c * t + e * s * t)
    slope = dz - (b * dx + c * dy + e * (s * dy + t * dx))
    bend = -e * dx * dy
    discriminant = slope**2 - 4 * bend * height
    q = -0.5 * (slope + np.copysign(np.sqrt(np.maximum(discriminant, 0.0)), slope))
    with np.errstate(divide="ignore", invalid="ignore"):
        w = np.where(slope < 0, height / q, np.where(bend < 0, q / bend, np.inf))
    w = np.where(height <= 0, 0.0, np.where(discriminant < 0, np.inf, w))
    return np.where(rays.near + w <= leaves, rays.near + w, np.inf)
