"""What a triangle mesh encloses: open edges, area, volume."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scenes.image import Float32, Float64
from scenes.mesh import Surface

Integers = NDArray[np.integer]


class EdgeFaults(NamedTuple):
    """Edges that keep a mesh from enclosing a volume; all zero for a watertight, consistently wound mesh.

    open    : edges with an odd number of faces, so that there is a hole
    flipped : edges whose faces are wound against each other
    """

    open: int
    flipped: int


def weld(positions: Float32) -> Integers:
    """For each vertex (V,) the index of its place, counted over the distinct positions."""
    without_minus_zero = np.asarray(positions, dtype=np.float32) + np.float32(0)
    places: Integers = np.unique(without_minus_zero, axis=0, return_inverse=True)[1].reshape(-1)
    return places


def edge_faults(corners: Integers) -> EdgeFaults:
    """Counts over faces (F, 3) that index welded places. A watertight mesh runs along each edge as often up as down."""
    edges = corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    upward = edges[:, 0] < edges[:, 1]
    which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)[1].reshape(-1)
    up = np.bincount(which, weights=upward)
    down = np.bincount(which, weights=~upward)
    is_open = (up + down) % 2 == 1
    return EdgeFaults(open=int(is_open.sum()), flipped=int((~is_open & (up != down)).sum()))


def is_watertight(surface: Surface) -> bool:
    """Whether the mesh encloses a volume: each edge has as many faces on one side as on the other."""
    return edge_faults(weld(surface.positions)[surface.faces]) == EdgeFaults(0, 0)


def face_vectors(positions: NDArray[np.floating], faces: Integers) -> Float64:
    """For each face (F, 3) the normal on its counter-clockwise side, as long as twice its area."""
    a, b, c = np.asarray(positions, dtype=np.float64)[faces].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def corner_angles(positions: Float64, faces: Integers) -> Float64:
    """The angle (F, 3) of each face at each of its corners, in radians."""
    corners = positions[faces]
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    doubled_area: Float64 = np.linalg.norm(np.cross(ahead, behind), axis=2)
    angles: Float64 = np.arctan2(doubled_area, np.sum(ahead * behind, axis=2))
    return angles


def angle_weighted_normals(positions: Float64, faces: Integers, places: Integers) -> Float64:
    """For each place (P, 3) the sum of the unit normals of the faces around it, each times its angle there.

    Thürmer and Wüthrich 1998, "Computing vertex normals from polygonal facets".
    """
    vectors = face_vectors(positions, faces)
    unit = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    sums = np.zeros((places.max() + 1, 3))
    np.add.at(sums, places[faces], corner_angles(positions, faces)[..., None] * unit[:, None])
    return sums


def surface_area(surface: Surface) -> float:
    """The sum of the faces' areas, in the square of the positions' unit."""
    return float(0.5 * np.linalg.norm(face_vectors(surface.positions, surface.faces), axis=1).sum())


def signed_volume(surface: Surface) -> float:
    """The enclosed volume of a watertight mesh, by the divergence theorem; negative when its faces look inward."""
    positions = surface.positions.astype(np.float64)
    positions -= positions.mean(axis=0)
    heights = np.sum(positions[surface.faces[:, 0]] * face_vectors(positions, surface.faces), axis=1)
    return float(heights.sum() / 6)
