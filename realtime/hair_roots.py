"""Where hairs stand in the chart of a surface: found once, since texture space stays the same when the skin deforms."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.errors import InputError
from scenes.grooming import rooted_faces
from scenes.image import Bool, Float64
from scenes.limbs import Skin, limb
from scenes.mesh import Mesh, Surface
from scenes.model import Scene
from scenes.procedural import rotation_xyz
from scenes.shapes import Hair, Limb, Shape
from scenes.topology import Integers

ROOT = np.dtype([("corners", "u4", 4), ("place", "f4", 4), ("shape", "f4", (3, 4)), ("color_radius", "f4", 4)])
"""A row of hair/roots.glsl."""

ON_EDGE = 1e-9
"""A point on an edge may be rounded to lie beside both its faces: they hold it within this barycentric weight."""


@dataclass(frozen=True)
class Scalp:
    """A surface on which hair grows, with its shape's position as the origin: all that is computed on it stays small.

    positions, normals : (V, 3) float64
    uvs                : (V, 2)
    faces              : (F, 3) of those that may hold roots
    morph              : (V, 3) what the morph target adds to positions
    skin               : what deforms a limb; its positions, morph target and bones are those of the unplaced limb
    """

    shape: Shape
    positions: Float64
    normals: Float64
    uvs: Float64
    faces: Integers
    morph: Float64
    skin: Skin | None


@dataclass(frozen=True)
class Places:
    """Places in a chart.

    point    : (N,) which of the points that were asked for
    corners  : (N, 3) vertices of the face that holds it
    weights  : (N, 3) barycentric, of these
    mirrored : (N,) whether the chart is mirrored there
    """

    point: Integers
    corners: Integers
    weights: Float64
    mirrored: Bool


def the_hair(scene: Scene) -> tuple[Hair, ...]:
    """All hair of a scene.

    Raises
    ------
    InputError
        There is none.
    """
    if not scene.hair:
        raise InputError(
            f"Found no hair in '{scene.name}'; the techniques of hair draw at least one. Add a table [[hair]] to the "
            "scene, or leave out the check."
        )
    return scene.hair


def scalp_of(scene: Scene, meshes: Iterable[Mesh], hair: Hair) -> Scalp:
    """The surface among a scene's meshes that a hair grows on, at rest if it is a limb.

    Raises
    ------
    SceneError
        Faces of it have no area in the chart.
    """
    shape = next(shape for shape in scene.shapes if shape.name == hair.on)
    if isinstance(shape, Limb):
        skin = limb(shape)
        positions = shape.scale * skin.rest.positions.astype(np.float64)
        return _scalp(shape, skin.rest, positions, shape.scale * skin.morph, skin)
    surface = next(mesh for mesh in meshes if mesh.shape == hair.on).surface
    positions = surface.positions.astype(np.float64) - shape.position
    return _scalp(shape, surface, positions, np.zeros_like(positions), None)


def _scalp(shape: Shape, surface: Surface, positions: Float64, morph: Float64, skin: Skin | None) -> Scalp:
    faces = surface.faces[rooted_faces(shape, surface)].astype(np.int64)
    return Scalp(
        shape, positions, surface.normals.astype(np.float64), surface.uvs.astype(np.float64), faces, morph, skin
    )


def placed_bones(scalp: Scalp) -> Float64:
    """The bones (2, 4, 4) of a limb, followed by its own rotation; its scale is in the positions that they move."""
    bones = np.broadcast_to(np.eye(4), (2, 4, 4)).copy()
    if scalp.skin is not None:
        turn = rotation_xyz(scalp.shape.rotation_deg)
        bones[:, :3] = turn @ scalp.skin.bones * (1, 1, 1, scalp.shape.scale)
    return bones


def places_in(scalp: Scalp, uv: Float64) -> Places:
    """Every face that holds one of the points (N, 2): none, or where a chart is used twice, more than one of them.

    Ordered by the points, then by the faces. A point on an edge is in the faces on both its sides.
    """
    corners = scalp.uvs[scalp.faces]
    side = max(int(np.sqrt(len(corners))), 1)
    face, cell = _covered_cells(corners, side)
    point, near = _matches(_cell(uv, side) @ (1, side), cell)
    face = face[near]
    weights = _barycentric(corners[face], uv[point])
    held = np.all(weights >= -ON_EDGE, axis=1)
    point, face, weights = point[held], face[held], weights[held]
    order = np.lexsort((face, point))
    mirrored = _doubled_area(corners[face]) < 0
    return Places(point[order], scalp.faces[face[order]], weights[order], mirrored[order])


def _covered_cells(corners: Float64, side: int) -> tuple[Integers, Integers]:
    """Pairs of a face and the code of a cell of a side x side grid that its bounding box covers, by the cells."""
    low, high = _cell(corners.min(axis=1), side), _cell(corners.max(axis=1), side)
    width, height = (high - low + 1).T
    face = np.repeat(np.arange(len(corners)), width * height)
    within = np.arange(len(face)) - np.repeat(np.cumsum(width * height) - width * height, width * height)
    code = (low[face, 0] + within % width[face]) + side * (low[face, 1] + within // width[face])
    order = np.argsort(code, kind="stable")
    return face[order], code[order]


def _cell(uv: Float64, side: int) -> Integers:
    cell: Integers = np.clip(np.floor(uv * side), 0, side - 1).astype(np.int64)
    return cell


def _matches(wanted: Integers, keys: Integers) -> tuple[Integers, Integers]:
    """Pairs of an index into `wanted` and an index into the sorted `keys` where both are equal."""
    begin, end = np.searchsorted(keys, wanted, "left"), np.searchsorted(keys, wanted, "right")
    counts = end - begin
    first = np.repeat(np.arange(len(wanted)), counts)
    return first, np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(begin, counts)


def _doubled_area(corners: Float64) -> Float64:
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area: Float64 = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]
    return area


def _barycentric(corners: Float64, uv: Float64) -> Float64:
    e, f, p = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], uv - corners[:, 0]
    second = (p[:, 0] * f[:, 1] - p[:, 1] * f[:, 0]) / _doubled_area(corners)
    third = (e[:, 0] * p[:, 1] - e[:, 1] * p[:, 0]) / _doubled_area(corners)
    return np.stack([1 - second - third, second, third], axis=1)


def root_rows(scalp: Scalp, places: Places, shape: Float64, color: Float64, radius: float) -> NDArray[Any]:
    """Rows of hair/roots.glsl for places whose points have control points (P, 4, 3) and colours (P, 3).

    dP/du is the sum of both edges from the first corner, each times a weight that the chart alone decides; its length
    does not matter, so the weights are scaled to be about 1.
    """
    corners = scalp.uvs[places.corners]
    v = corners[:, 1:, 1] - corners[:, :1, 1]
    along_u = np.stack([v[:, 1], -v[:, 0]], axis=1) * np.sign(_doubled_area(corners))[:, None]
    rows = np.zeros(len(places.point), dtype=ROOT)
    rows["corners"] = np.column_stack([places.corners, places.mirrored])
    rows["place"] = np.column_stack([places.weights[:, 1:], along_u / np.abs(along_u).max(axis=1, keepdims=True)])
    rows["shape"][..., :3] = shape[places.point, 1:]
    rows["color_radius"] = np.column_stack([color[places.point], np.full(len(rows), radius)])
    return rows


def film_places(places: Places, mirrored: Bool) -> Places:
    """Of all places of some points the first one on the copy of the chart that each point means."""
    meant = np.flatnonzero(places.mirrored == mirrored[places.point])
    first = meant[np.unique(places.point[meant], return_index=True)[1]]
    return Places(places.point[first], places.corners[first], places.weights[first], places.mirrored[first])
