"""A limb that bends and bulges: what a skin is made of, at rest and deformed.

The rest shape is all points within `radius` of a line of `length` along y about the origin. Morph, then skin, as the
talk has it. Everything is computed in float64: it decides the frames that hair stands on.
"""

import math
from dataclasses import dataclass

import numpy as np

from scenes.errors import SceneError
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.procedural import Faces, make_surface, normalised, rotation_xyz
from scenes.shapes import Limb
from scenes.topology import Integers, angle_weighted_normals

BLEND_RADII = 2.0
"""From the joint to where skin follows one bone alone, in radii. From 1.5 on skin does not fold back on itself at 90
degrees."""

BULGE_RADII = 2.0
"""From the joint to where the morph target moves nothing, in radii."""


@dataclass(frozen=True)
class Skin:
    """A skinned mesh, before it is placed: position' = sum_b weight_b M_b (position + amount * morph).

    rest      : the surface before anything moves it
    morph     : (V, 3) what the morph target adds to positions [length]
    weights   : (V, 2) of the bones, sum 1
    bones     : (2, 3, 4) matrices of the bones, the lower one first
    amount    : weight of the morph target
    places    : (V,) index of each vertex' place: vertices at one place share a normal, though not their (u, v)
    positions : (V, 3) after morph, then skin, in float64
    normals   : (V, 3) of the deformed surface, in float64: recomputed from `positions`, the faces around each place
        weighted by their angles there
    deformed  : the same as a surface
    """

    rest: Surface
    morph: Float64
    weights: Float64
    bones: Float64
    amount: float
    places: Integers
    positions: Float64
    normals: Float64
    deformed: Surface


def limb(shape: Limb) -> Skin:
    """The limb at rest and deformed.

    Raises
    ------
    SceneError
        It is bent so that skin lies back to back, where it has no normal.
    """
    profile, v = _profile(shape)
    turn, u = _columns(shape)
    rows, columns = len(profile), len(turn)
    around = np.append(turn[:-1], turn[0])  # the last column stands in the very place of the first
    x, z = np.outer(profile[:, 0], np.sin(around)), np.outer(profile[:, 0], np.cos(around))
    positions = np.stack([x, np.repeat(profile[:, 1:], columns, axis=1), z], axis=-1).reshape(-1, 3)
    uvs = np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1).reshape(-1, 2)
    faces, places = _faces(rows, turn), _places(rows, turn)
    morph, weights, bones = _morph(shape, positions), _weights(shape, positions), _bones(shape)
    moved = deform(positions, morph, weights, bones, shape.bulge)
    normals = _normals(moved, faces, places)
    return Skin(
        rest=make_surface(positions, _normals(positions, faces, places), uvs, faces),
        morph=morph,
        weights=weights,
        bones=bones,
        amount=shape.bulge,
        places=places,
        positions=moved,
        normals=normals,
        deformed=make_surface(moved, normals, uvs, faces),
    )


def deform(positions: Float64, morph: Float64, weights: Float64, bones: Float64, amount: float) -> Float64:
    """Positions (V, 3) after morph, then skin; see `Skin`.

    Magnenat-Thalmann, Laperrière, Thalmann 1988, "Joint-dependent local deformations for hand animation and object
    grasping" (linear blend skinning).
    """
    morphed = positions + amount * morph
    each = np.einsum("bij,vj->vbi", bones[:, :, :3], morphed) + bones[:, :, 3]
    moved: Float64 = np.einsum("vb,vbi->vi", weights, each)
    return moved


def _profile(shape: Limb) -> tuple[Float64, Float64]:
    """Distances from the axis and heights (R, 2) from the lower end to the upper one, and v (R,): length along it."""
    segments, half, end = _segments(shape), 0.5 * shape.length, 0.5 * math.pi * shape.radius
    angle = 0.5 * np.pi * np.arange(max(segments // 4, 2) + 1) / max(segments // 4, 2)
    cap = shape.radius * np.column_stack([np.cos(angle), np.sin(angle)])
    cap[-1] = (0.0, shape.radius)
    rings = 2 * math.ceil(shape.length * segments / (4 * math.pi * shape.radius))  # one row is at the joint
    heights = np.linspace(-half, half, rings + 1)[1:-1]
    side = np.column_stack([np.full(rings - 1, shape.radius), heights])
    up = np.array([0.0, half])
    along = np.concatenate(
        [end - shape.radius * angle[::-1], end + half + heights, end + shape.length + shape.radius * angle]
    )
    return np.concatenate([cap[::-1] * (1, -1) - up, side, cap + up]), along / along[-1]


def _segments(shape: Limb) -> int:
    """Round the axis: `detail`, or one more if that is odd, so that both halves are alike."""
    return shape.detail + shape.detail % 2


def _columns(shape: Limb) -> tuple[Float64, Float64]:
    """Angles (C,) round y from -z over -x to +z and on over +x, and u (C,). Where u jumps or turns there are two."""
    n = _segments(shape)
    turn = 2 * np.pi * np.arange(n + 1) / n - np.pi
    if shape.chart == "plain":
        return turn, np.arange(n + 1) / n
    turn = np.concatenate([turn[: n // 2 + 1], turn[n // 2 :]])
    return turn, np.abs(turn) / np.pi


def _faces(rows: int, turn: Float64) -> Faces:
    """Two triangles a cell, counter-clockwise from outside; one where a row is a pole, none between twin columns."""
    columns = len(turn)
    i, j = np.meshgrid(np.arange(rows - 1), np.flatnonzero(np.diff(turn) > 0), indexing="ij")
    a = i * columns + j
    b, c, d = a + 1, a + columns + 1, a + columns
    lower, upper = np.stack([a, b, c], axis=-1)[1:], np.stack([a, c, d], axis=-1)[:-1]
    return np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)])


def _places(rows: int, turn: Float64) -> Integers:
    """(V,) which vertices are one: the first and last column, twin columns, and all of a pole."""
    column = np.concatenate([[0], np.cumsum(np.diff(turn) > 0)])
    count = column[-1]
    place = np.arange(rows)[:, None] * count + column % count
    place[0], place[-1] = 0, (rows - 1) * count
    places: Integers = np.unique(place.reshape(-1), return_inverse=True)[1].reshape(-1)
    return places


def _morph(shape: Limb, positions: Float64) -> Float64:
    """Away from the axis by the radius at the joint, smoothly less and less along the limb."""
    reach = min(BULGE_RADII * shape.radius, 0.5 * shape.length)
    swell = np.maximum(1 - (positions[:, 1] / reach) ** 2, 0) ** 2
    morph: Float64 = positions * (1, 0, 1) * swell[:, None]
    return morph


def _weights(shape: Limb, positions: Float64) -> Float64:
    """Of the lower and the upper bone: each alone beyond the blend, a smooth step in it."""
    reach = min(BLEND_RADII * shape.radius, 0.5 * shape.length)
    t = np.clip(0.5 + 0.5 * positions[:, 1] / reach, 0, 1)
    upper = t * t * (3 - 2 * t)
    return np.column_stack([1 - upper, upper])


def _bones(shape: Limb) -> Float64:
    """The lower bone stays, the upper one turns about x through the joint, which is the origin."""
    bones: Float64 = np.zeros((2, 3, 4))
    bones[:, :, :3] = np.eye(3), rotation_xyz((shape.bend_deg, 0.0, 0.0))
    return bones


def _normals(positions: Float64, faces: Faces, places: Integers) -> Float64:
    sums = angle_weighted_normals(positions, faces, places)[places]
    flat = np.linalg.norm(sums, axis=1) < 1e-6  # an angle sum of 1e-6 rad has no direction left in float32
    if flat.any():
        raise SceneError(
            f"at {flat.sum()} of {len(flat)} vertices the bent skin lies back to back, so that it has no normal. Bend "
            "the limb a little more or less, or change its bulge."
        )
    return normalised(sums)
