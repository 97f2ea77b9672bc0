"""Hair before anything moves it: roots and guides in texture space, which stays the same when the skin deforms.

A hair is a cubic Bezier curve in the frame of its root: x along dP/du of the triangle that holds the root, made
perpendicular to the interpolated normal, z along that normal, y on the side to which v grows. The frame is orthonormal:
it turns with the skin, and is never stretched or scaled with it, so that a hair keeps its length when the skin swells.
All of that belongs to the deformed skin and is recomputed from it.

Where a chart is used twice, as a mirrored one is, hair grows in both places. There the frame of the mirrored half is
left-handed, so that the hair is mirrored too.
"""

from dataclasses import dataclass

import numpy as np

from scenes.errors import SceneError
from scenes.geometry import texture_of
from scenes.image import Bool, Float32, Float64
from scenes.materials import Texture
from scenes.mesh import Surface
from scenes.model import Scene
from scenes.procedural import normalised
from scenes.shapes import DisplacedIcosphere, Ellipsoid, Hair, Limb, Shape, Sphere

HAIRY = ("sphere", "ellipsoid", "displaced_icosphere", "rectangle", "capsule", "limb", "head", "mesh")
"""Types of shapes whose charts can hold hair."""

START_COMB = 0.25
"""How much of the comb a hair follows where it leaves the skin."""

CURL_TURN = 2 * np.pi / 3
"""From one control point to the next."""

CURL_WAVES = (13.0, 8.0)
"""How often curl repeats along each side of the region."""

KILLED = 0.5
"""Of the kill texture: above it no hair grows."""


@dataclass(frozen=True)
class Groom:
    """Hair at rest. Guides are cubic Bezier curves in the frame of their root; see above.

    guide_uv : (G, 2) roots of the guides in the chart, row by row (v) of a regular grid that spans the region
    guides   : (G, 4, 3) their control points, the first at the origin [length]
    uv       : (N, 2) roots of the hairs
    shape    : (N, 4, 3) control points of the hairs in the frames of their own roots: the guides around each,
        interpolated bilinearly, plus the hair's own curl, times the length texture
    color    : (N, 3) factor on the light that a hair scatters
    """

    guide_uv: Float64
    guides: Float64
    uv: Float64
    shape: Float64
    color: Float64


def groom(scene: Scene, hair: Hair) -> Groom:
    """The hairs that density and kill leave of `hair.count`, at rest.

    Raises
    ------
    SceneError
        None is left, or a control texture cannot be used.
    """
    uniform = _uniform(hair.seed, 3 * hair.count, "roots").reshape(3, hair.count)
    low, high = _corners(hair)
    uv = low + uniform[:2].T * (high - low)
    grows = uniform[2] < _control(scene, hair.density, uv)
    if hair.kill is not None:
        grows &= _control(scene, hair.kill, uv) <= KILLED
    if not grows.any():
        raise SceneError(
            f'hair "{hair.name}": of {hair.count} hairs the density and kill textures leave none; at least one is '
            "needed. Make density brighter, kill darker, or count larger."
        )
    uv = uv[grows]
    return Groom(
        guide_uv=_guide_uv(hair),
        guides=_guides(hair),
        uv=uv,
        shape=shape_at(scene, hair, uv),
        color=np.ones((len(uv), 3)) if hair.color is None else lookup(texture_of(scene, hair.color), uv),
    )


def shape_at(scene: Scene, hair: Hair, uv: Float64) -> Float64:
    """Control points (N, 4, 3) of hairs rooted anywhere in the region (N, 2), in the frames of their roots."""
    length = _control(scene, hair.length_map, uv)
    shape: Float64 = length[:, None, None] * (_between_guides(hair, uv) + _curl(hair, uv))
    return shape


def lookup(texture: Float32, uv: Float64) -> Float64:
    """Bilinear values (N, C) of a texture (H, W, C), row 0 at the top, at (u, v) with v upward; it repeats."""
    height, width = texture.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - left)[:, None], (y - top)[:, None]
    rows = [
        (1 - fx) * texture[row % height, left % width] + fx * texture[row % height, (left + 1) % width]
        for row in (top, top + 1)
    ]
    values: Float64 = (1 - fy) * rows[0] + fy * rows[1]
    return values


def rooted_faces(shape: Shape, surface: Surface) -> Bool:
    """Which faces (F,) of a shape's surface may hold roots: all but those that squeeze the texture across a seam.

    Raises
    ------
    SceneError
        A face has no area in (u, v), so that nothing can be rooted there.
    """
    corners = surface.uvs[surface.faces].astype(np.float64)
    edges = corners - np.roll(corners, 1, axis=1)
    doubled_area = np.abs(edges[:, 1, 0] * edges[:, 2, 1] - edges[:, 1, 1] * edges[:, 2, 0])
    degenerate = int(np.count_nonzero(doubled_area <= 1e-6 * np.sum(edges**2, axis=2).max(axis=1)))
    if degenerate:
        raise SceneError(
            f'shape "{shape.name}": {degenerate} of {len(corners)} faces have no area in (u, v), so that hair has no '
            "place there and no direction along u. Hair needs a shape whose texture coordinates are unwrapped."
        )
    if isinstance(shape, Sphere | Ellipsoid | DisplacedIcosphere):
        spans: Bool = np.ptp(corners[:, :, 0], axis=1) <= 0.5
        return spans
    return np.ones(len(corners), dtype=bool)


def film_uv(shape: Shape, hair: Hair, width: int, height: int) -> tuple[Float64, Bool]:
    """Which place of the chart a pixel stands for where an image spans the region.

    Where the chart is used twice (a mirrored limb) the image's left half is the region on the right-handed copy and its
    right half is the region on the mirrored one.

    Returns
    -------
    (u, v) at the pixels' centres (H * W, 2), row by row from the top, v upward; whether a pixel means the mirrored copy
    (H * W,)
    """
    low, high = _corners(hair)
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height)
    mirrored = np.zeros(x.shape, dtype=bool)
    if isinstance(shape, Limb) and shape.chart == "mirrored":
        mirrored = x > 0.5
        x = 2 * x - mirrored
    return low + np.stack([x, y], axis=-1).reshape(-1, 2) * (high - low), mirrored.reshape(-1)


def _corners(hair: Hair) -> tuple[Float64, Float64]:
    """The lower left and the upper right corner of the region."""
    ends = np.array(hair.region).reshape(2, 2)
    return ends.min(axis=0), ends.max(axis=0)


def _control(scene: Scene, texture: Texture | None, uv: Float64) -> Float64:
    """The mean of a control texture's channels (N,); 1 without one."""
    if texture is None:
        return np.ones(len(uv))
    values: Float64 = lookup(texture_of(scene, texture), uv).mean(axis=1)
    return values


def _guide_uv(hair: Hair) -> Float64:
    low, high = _corners(hair)
    along = np.linspace(0.0, 1.0, hair.guides)
    v, u = np.meshgrid(along, along, indexing="ij")
    return low + np.stack([u, v], axis=-1).reshape(-1, 2) * (high - low)


def _guides(hair: Hair) -> Float64:
    """Each leaves the skin almost upright and bends to the comb; they differ a little in direction and length."""
    count = hair.guides**2
    uniform = _uniform(hair.seed, 3 * count, "guides").reshape(3, count)
    tilt = hair.spread * np.sqrt(-2 * np.log1p(-uniform[0])) * np.exp(2j * np.pi * uniform[1])
    comb = np.array(hair.comb) + np.column_stack([tilt.real, tilt.imag])
    length = hair.length * (1 + hair.spread * (2 * uniform[2] - 1))[:, None]
    first = normalised(np.column_stack([START_COMB * comb, np.ones(count)]))
    last = normalised(np.column_stack([comb, np.ones(count)]))
    middle = normalised(first + last)
    points = np.cumsum([0 * first, first, middle, last], axis=0) / 3
    guides: Float64 = (length * points).transpose(1, 0, 2)
    return guides


def _between_guides(hair: Hair, uv: Float64) -> Float64:
    """The guides (N, 4, 3) around each root (N, 2), interpolated bilinearly."""
    low, high = _corners(hair)
    grid = _guides(hair).reshape(hair.guides, hair.guides, 4, 3)
    place = (uv - low) / (high - low) * (hair.guides - 1)
    cell = np.clip(np.floor(place).astype(int), 0, hair.guides - 2)
    (i, j), (fu, fv) = cell.T, (place - cell).T[:, :, None, None]
    lower = (1 - fu) * grid[j, i] + fu * grid[j, i + 1]
    upper = (1 - fu) * grid[j + 1, i] + fu * grid[j + 1, i + 1]
    between: Float64 = (1 - fv) * lower + fv * upper
    return between


def _curl(hair: Hair, uv: Float64) -> Float64:
    """Offsets (N, 4, 3) of the control points: a turn in the plane of the skin that widens towards the tip."""
    low, high = _corners(hair)
    phase = 2 * np.pi * ((uv - low) / (high - low) @ np.array(CURL_WAVES))
    step = np.arange(4)
    angle = phase[:, None] + CURL_TURN * step
    width = hair.curl * hair.length * step / 3
    return np.stack([width * np.cos(angle), width * np.sin(angle), 0 * angle], axis=-1)


def _uniform(seed: int, count: int, what: str) -> Float64:
    """Numbers in [0, 1) from the raw PCG64 stream, which numpy promises never to change."""
    raw = np.random.PCG64([seed, *what.encode()]).random_raw(count)
    uniform: Float64 = (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return uniform
