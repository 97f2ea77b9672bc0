"""Carved blocks: height fields by name, and their surface.

Between its samples a field is bilinear. Where a cell's corners do not lie in one plane its patch is a saddle, and the
normal jumps from cell to cell: the surface has vertices of its own for each cell.
"""

from collections.abc import Callable

import numpy as np

from scenes.image import Float64
from scenes.mesh import Surface
from scenes.procedural import make_surface, normalised
from scenes.shapes import FieldName, Relief
from scenes.units import Vec3

BUMPS, BUMP_RADII = 48, (0.05, 0.11)
TERRACES, SLOPE_KEPT = 6, 0.2
SPIKES, SPIKE_RADIUS = 40, 0.03
OCTAVES, COARSEST_CELLS = 6, 4

RING = ((0, 0), (0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0))
"""The border of a cell cut in 2 x 2, counter-clockwise as (row, column) of its 3 x 3 vertices."""


def field(name: FieldName, resolution: int, seed: int) -> Float64:
    """The samples (resolution, resolution) of a named height field; row 0 at v = 0, column 0 at u = 0.

    They reach from 0 to 1 and are numbers of float32, so that whoever stores them in float32 has the same field.

    bumps  : smooth hills
    brick, gravel : photographs of scikit-image, brightness as height; `seed` has no meaning for them
    steps  : terraces of the bumps, which keep a fifth of their slope, with cliffs one cell wide
    spikes : narrow cones on a plane
    noise  : fractal value noise, each octave half as high and half as wide as the one before
    """
    makers: dict[FieldName, Callable[[int, np.random.Generator], Float64]] = {
        "bumps": _bumps,
        "brick": lambda n, _: _photograph("brick", n),
        "gravel": lambda n, _: _photograph("gravel", n),
        "steps": _steps,
        "spikes": _spikes,
        "noise": _noise,
    }
    return _from_0_to_1(makers[name](resolution, np.random.default_rng(seed))).astype(np.float32).astype(np.float64)


def _from_0_to_1(heights: Float64) -> Float64:
    span = float(np.ptp(heights))
    return (heights - heights.min()) / span if span > 0 else np.zeros_like(heights)


def _grid(resolution: int) -> tuple[Float64, Float64]:
    """The u and the v of each sample."""
    along = np.linspace(0, 1, resolution)
    u, v = np.meshgrid(along, along)
    return u, v


def _bumps(resolution: int, rng: np.random.Generator) -> Float64:
    u, v = _grid(resolution)
    heights = np.zeros_like(u)
    for x, y, share in rng.random((BUMPS, 3)):
        radius = BUMP_RADII[0] + share * (BUMP_RADII[1] - BUMP_RADII[0])
        heights += np.exp(-((u - x) ** 2 + (v - y) ** 2) / radius**2)
    return heights


def _steps(resolution: int, rng: np.random.Generator) -> Float64:
    heights = TERRACES * _from_0_to_1(_bumps(resolution, rng))
    level = np.floor(np.minimum(heights, TERRACES - 1))
    return level + SLOPE_KEPT * (heights - level)


def _spikes(resolution: int, rng: np.random.Generator) -> Float64:
    u, v = _grid(resolution)
    heights = np.zeros_like(u)
    for x, y, share in rng.random((SPIKES, 3)):
        cone = 1 - np.hypot(u - x, v - y) / SPIKE_RADIUS
        heights = np.maximum(heights, (0.5 + 0.5 * share) * cone)
    return heights


def _noise(resolution: int, rng: np.random.Generator) -> Float64:
    from scipy.ndimage import map_coordinates

    u, v = _grid(resolution)
    heights = np.zeros_like(u)
    for octave in range(OCTAVES):
        cells = COARSEST_CELLS << octave
        values = rng.random((cells + 1, cells + 1))
        heights += 0.5**octave * map_coordinates(values, [v * cells, u * cells], order=1)
    return heights


def _photograph(name: str, resolution: int) -> Float64:
    import PIL.Image
    import skimage.data

    photograph = getattr(skimage.data, name)()[::-1].astype(np.float32)
    resized = PIL.Image.fromarray(photograph).resize((resolution, resolution), PIL.Image.Resampling.BILINEAR)
    return np.asarray(resized, dtype=np.float64)


def relief(shape: Relief, heights: Float64) -> Surface:
    """The surface of a carved block, before it is placed, without its bottom.

    Each cell is cut in 2 x 2, whose eight triangles meet in its middle: they lie as much above the bilinear patch as
    below it, by a sixteenth of its twist at most. Vertices have the normal of the patch.

    heights : (N, M) in [0, 1], as `scenes.geometry.heights_of` reads them
    """
    tops = _finer(heights)
    block = _carved(shape, heights, tops)
    walls = _walls(shape, tops)
    start = len(block.positions)
    return Surface(
        positions=np.concatenate([block.positions, walls.positions]),
        normals=np.concatenate([block.normals, walls.normals]),
        uvs=np.concatenate([block.uvs, walls.uvs]),
        faces=np.concatenate([block.faces, walls.faces + np.uint32(start)]),
    )


def _finer(heights: Float64) -> Float64:
    """The field (2 N - 1, 2 M - 1) with a sample in the middle of each cell and of each of its sides."""
    rows = np.insert(heights, np.arange(1, len(heights)), 0.5 * (heights[1:] + heights[:-1]), axis=0)
    middles = 0.5 * (rows[:, 1:] + rows[:, :-1])
    return np.insert(rows, np.arange(1, heights.shape[1]), middles, axis=1)


def _points(shape: Relief, tops: Float64) -> tuple[Float64, Float64]:
    """Positions (..., 3) and (u, v) (..., 2) of the samples of a field."""
    u, v = np.meshgrid(np.linspace(0, 1, tops.shape[1]), np.linspace(0, 1, tops.shape[0]))
    positions = [shape.size[0] * (u - 0.5), shape.size[1] * (v - 0.5), shape.depth * (tops - 1)]
    return np.stack(positions, axis=-1), np.stack([u, v], axis=-1)


def _carved(shape: Relief, heights: Float64, tops: Float64) -> Surface:
    positions, uvs = _points(shape, tops)
    of_cells = [(slice(a, a - 2 or None, 2), slice(b, b - 2 or None, 2)) for a in range(3) for b in range(3)]
    rows, columns = (n - 1 for n in heights.shape)
    first = 9 * np.arange(rows * columns)[:, None, None]
    fan = [(4, 3 * a + b, 3 * c + d) for (a, b), (c, d) in zip(RING, RING[1:] + RING[:1], strict=True)]
    normals = [_normals(shape, heights, 0.5 * b, 0.5 * a) for a in range(3) for b in range(3)]
    return make_surface(
        np.stack([positions[s] for s in of_cells], axis=2).reshape(-1, 3),
        np.stack(normals, axis=2).reshape(-1, 3),
        np.stack([uvs[s] for s in of_cells], axis=2).reshape(-1, 2),
        (first + np.array(fan)).reshape(-1, 3),
    )


def _normals(shape: Relief, heights: Float64, s: float, t: float) -> Float64:
    """Unit normals (N - 1, M - 1, 3) of the cells' patches at the place (s, t) in each, s along u."""
    rows, columns = (n - 1 for n in heights.shape)
    along_u, along_v = np.diff(heights, axis=1), np.diff(heights, axis=0)
    slope_x = (along_u[:-1] * (1 - t) + along_u[1:] * t) * shape.depth * columns / shape.size[0]
    slope_y = (along_v[:, :-1] * (1 - s) + along_v[:, 1:] * s) * shape.depth * rows / shape.size[1]
    return normalised(np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], axis=-1))


def _walls(shape: Relief, tops: Float64) -> Surface:
    """From the border down to z = -depth, where there is anything between."""
    positions, uvs = _points(shape, tops)
    sides: list[tuple[tuple[int | slice, int | slice], Vec3]] = [
        ((0, slice(None)), (0.0, -1.0, 0.0)),
        ((slice(None), -1), (1.0, 0.0, 0.0)),
        ((-1, slice(None, None, -1)), (0.0, 1.0, 0.0)),
        ((slice(None, None, -1), 0), (-1.0, 0.0, 0.0)),
    ]
    tops_of = np.concatenate([positions[side] for side, _ in sides])
    feet_of = np.column_stack([tops_of[:, :2], np.full(len(tops_of), -shape.depth)])
    lengths = [len(positions[side]) for side, _ in sides]
    ends = np.cumsum(lengths)
    start = np.setdiff1d(np.arange(ends[-1]), ends - 1)
    foot, is_raised = start + len(tops_of), tops_of[:, 2] > -shape.depth
    faces = [
        np.column_stack([foot, foot + 1, start + 1])[is_raised[start + 1]],
        np.column_stack([foot, start + 1, start])[is_raised[start]],
    ]
    return make_surface(
        np.concatenate([tops_of, feet_of]),
        np.tile(np.repeat([normal for _, normal in sides], lengths, axis=0), (2, 1)),
        np.tile(np.concatenate([uvs[side] for side, _ in sides]), (2, 1)),
        np.concatenate(faces),
    )
