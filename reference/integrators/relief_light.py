"""Light that a relief reflects once, by rays through the height field itself, as a Dr.Jit loop.

The rays are those of `reference.relief_rays`, in double precision as there: same cells, same polynomial. Mitsuba gives
the camera's rays, samples the emitters and evaluates the material. On the relief's mesh instead, which lies up to a
sixteenth of a cell's twist off the field, pixels of gravel differ by 3 to 7 % of the mean radiance (root mean square),
and shadow rays start so far off the surface that it is up to half a per cent too bright.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from reference.relief_rays import MARGIN, Block, block_of, subject_of
from reference.stage import Stage

RAISED = 1e-9
"""Shadow rays start that far off the surface, in samples or heights: above its rounding."""

NO_WALL = 2


@dataclass(frozen=True)
class Field:
    """A block on the device: its heights (N M,) row by row, and the grid of `reference.relief_rays.Block`."""

    heights: Any
    columns: int
    rows: int
    block: Block


@dataclass(frozen=True)
class Places:
    """What rays meet on the grid: distance, cell, place in it, slopes of its patch, and which wall if it is one.

    axis : 0 or 1 for a wall across u or v, 2 for none
    """

    t: Any
    grid: Any
    slopes: tuple[Any, Any]
    axis: Any


def direct_light(stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    """One sample for each camera ray: no emitter is seen, and the light that the block reflects."""
    mi = stage.mi
    block = block_of(stage.description, subject_of(stage.description))
    rows, columns = block.heights.shape
    field = Field(mi.Float64(block.heights.ravel()), columns, rows, block)
    into = block.to_world.T / block.extent[:, None]
    d = _turned(mi, into, ray.d)
    o = _turned(mi, into, mi.Vector3d(ray.o) - _triple(mi, block.position)) + _triple(mi, block.middle)
    places = _places(mi, field, o, d, mi.Bool(True))
    hits = dr.isfinite(places.t)
    outward = _outward(mi, places, d)
    si = _surface(mi, field, places, outward, ray, hits)
    light, arriving = stage.scene.sample_emitter_direction(si, sampler.next_2d(), False, hits)
    bsdf = stage.subject[0].bsdf()
    value = bsdf.eval(mi.BSDFContext(), si, si.to_local(light.d), hits)
    matters = hits & (light.pdf > 0) & dr.any(value > 0)
    start = places.grid + RAISED * dr.select(places.axis == NO_WALL, mi.Vector3d(0, 0, 1), outward)
    shadow = _places(mi, field, start, _turned(mi, into, light.d), matters)
    is_lit = matters & (shadow.t >= mi.Float64(light.dist))
    return mi.Color3f(0.0), dr.select(is_lit, value * arriving, 0.0)


def _triple(mi: Any, values: Any) -> Any:
    return mi.Vector3d(*(float(v) for v in values))


def _turned(mi: Any, matrix: Any, vector: Any) -> Any:
    """A matrix (3, 3) times vectors, in double precision."""
    x, y, z = (mi.Float64(c) for c in vector)
    return mi.Vector3d(*(float(a) * x + float(b) * y + float(c) * z for a, b, c in matrix))


def _outward(mi: Any, places: Places, d: Any) -> Any:
    """Normals on the grid: up along the patch, or out of the wall against the ray that meets it."""
    zero = mi.Float64(0.0)
    wall = mi.Vector3d(
        dr.select(places.axis == 0, -dr.sign(d.x), zero), dr.select(places.axis == 1, -dr.sign(d.y), zero), zero
    )
    return dr.select(places.axis == NO_WALL, mi.Vector3d(-places.slopes[0], -places.slopes[1], 1.0), wall)


def _surface(mi: Any, field: Field, places: Places, outward: Any, ray: Any, hits: Any) -> Any:
    """The places as Mitsuba's surface interactions, with the v of its textures downward."""
    block = field.block
    from_middle = _turned(mi, block.to_world * block.extent, places.grid - _triple(mi, block.middle))
    normal = dr.normalize(_turned(mi, block.to_world / block.extent, outward))
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(places.t))
    si.t = dr.select(hits, mi.Float(places.t), dr.inf)
    si.p = mi.Point3f(from_middle + _triple(mi, block.position))
    si.n = mi.Normal3f(normal)
    si.sh_frame = mi.Frame3f(mi.Vector3f(normal))
    si.uv = mi.Point2f(mi.Float(places.grid.x / (field.columns - 1)), 1 - mi.Float(places.grid.y / (field.rows - 1)))
    si.wi = si.to_local(-ray.d)
    return si


def _places(mi: Any, field: Field, o: Any, d: Any, active: Any) -> Places:
    """Where rays on the grid meet the block first; a distance that is infinite where they pass by."""
    near, far, axis = _box(mi, field, o, d)
    enters = active & (near <= far) & (far > 0) & ~((near > 0) & (axis == NO_WALL) & (d.z > 0))
    near = dr.maximum(near, 0.0)
    column = dr.clip(mi.Int32(dr.floor(o.x + near * d.x)), 0, field.columns - 2)
    row = dr.clip(mi.Int32(dr.floor(o.y + near * d.y)), 0, field.rows - 2)
    t, column, row, axis = _loop(
        mi, field.heights, field.columns, field.rows, o, d, near, far, axis, column, row, enters
    )
    grid = o + dr.select(dr.isfinite(t), t, 0.0) * d
    _, b, c, e = _patch(mi, field.heights, field.columns, column, row, dr.isfinite(t))
    slopes = b + e * (grid.y - row), c + e * (grid.x - column)
    return Places(t, grid, slopes, axis)


def _box(mi: Any, field: Field, o: Any, d: Any) -> tuple[Any, Any, Any]:
    """Distances between which rays are in the box about the block, and the axis across which they come in."""
    ends = (field.columns - 1.0, field.rows - 1.0, 1.0)
    near, far, axis = mi.Float64(-dr.inf), mi.Float64(dr.inf), mi.UInt32(NO_WALL)
    for index, (p, slope, low, high) in enumerate(zip(o, d, (0.0, 0.0, -MARGIN), ends, strict=True)):
        first, second = (low - p) / slope, (high - p) / slope
        is_within = (low <= p) & (p <= high)
        enters = dr.select(slope != 0, dr.minimum(first, second), dr.select(is_within, -dr.inf, dr.inf))
        leaves = dr.select(slope != 0, dr.maximum(first, second), dr.inf)
        axis = dr.select((enters > near) & (enters > 0), mi.UInt32(index), axis)
        near, far = dr.maximum(near, enters), dr.minimum(far, leaves)
    return near, far, axis


def _patch(mi: Any, heights: Any, columns: int, column: Any, row: Any, active: Any) -> tuple[Any, Any, Any, Any]:
    """The a, b, c and e of the height a + b s + c t + e s t over cells, s and t from 0 to 1."""
    first = mi.UInt32(row * columns + column)
    a = dr.gather(mi.Float64, heights, first, active)
    right = dr.gather(mi.Float64, heights, first + 1, active)
    above = dr.gather(mi.Float64, heights, first + columns, active)
    across = dr.gather(mi.Float64, heights, first + columns + 1, active)
    return a, right - a, above - a, across - right - above + a


@dr.syntax  # type: ignore[untyped-decorator]
def _loop(
    mi: Any,
    heights: Any,
    columns: Any,
    rows: Any,
    o: Any,
    d: Any,
    near: Any,
    far: Any,
    axis: Any,
    column: Any,
    row: Any,
    active: Any,
) -> Any:
    """Distance, column, row and axis of what rays meet, cell by cell; see `reference.relief_rays._first_root`."""
    found = mi.Float64(dr.inf)
    wall = mi.UInt32(NO_WALL)

    while active:
        # Where the ray leaves the cell.
        to_x = dr.select(d.x != 0, (mi.Float64(column + dr.select(d.x > 0, 1, 0)) - o.x) / d.x, dr.inf)
        to_y = dr.select(d.y != 0, (mi.Float64(row + dr.select(d.y > 0, 1, 0)) - o.y) / d.y, dr.inf)
        leaves = dr.maximum(dr.minimum(dr.minimum(to_x, to_y), far), near)

        # Its height above the patch along the way: bend w² + slope w + height.
        a, b, c, e = _patch(mi, heights, columns, column, row, active)
        s = o.x + near * d.x - column
        t = o.y + near * d.y - row
        height = o.z + near * d.z - (a + b * s + c * t + e * s * t)
        slope = d.z - (b * d.x + c * d.y + e * (s * d.y + t * d.x))
        bend = -e * d.x * d.y
        discriminant = slope * slope - 4 * bend * height
        q = -0.5 * (slope + dr.copysign(dr.sqrt(dr.maximum(discriminant, 0.0)), slope))
        w = dr.select(slope < 0, height / q, dr.select(bend < 0, q / bend, dr.inf))
        w = dr.select(height <= 0, 0.0, dr.select(discriminant < 0, dr.inf, w))

        meets = active & (near + w <= leaves)
        found = dr.select(meets, near + w, found)
        wall = dr.select(meets & (w == 0), axis, wall)

        # The next cell.
        goes_on = active & ~meets & (leaves < far)
        column = dr.select(goes_on & (to_x <= to_y), column + dr.select(d.x > 0, 1, -1), column)
        row = dr.select(goes_on & (to_x > to_y), row + dr.select(d.y > 0, 1, -1), row)
        active = goes_on & (column >= 0) & (column < columns - 1) & (row >= 0) & (row < rows - 1)
        near = dr.select(active, leaves, near)
        axis = dr.select(active, mi.UInt32(NO_WALL), axis)

    return found, column, row, wall
