"""A bounding volume hierarchy over triangles, laid out for a traversal without a stack."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.image import Float32, Float64
from scenes.mesh import Surface

TRIANGLES_A_LEAF = 4


@dataclass(frozen=True)
class Bvh:
    """Nodes in depth-first order.

    nodes     : (N, 8) float32: lowest corner, the node to go on with if the box is missed; highest corner, minus one
    for
                an inner node, else the leaf's first triangle times TRIANGLES_A_LEAF plus its count less one
    triangles : (T, 12) float32: a corner and two edges of each triangle, each padded to a vec4
    order     : (T,) which of the given triangles each is
    """

    nodes: Float32
    triangles: Float32
    order: NDArray[np.int64]


def build(surfaces: list[Surface]) -> Bvh:
    """Split at the median of the widest axis of the centroids until TRIANGLES_A_LEAF are left."""
    corners = np.concatenate([s.positions[s.faces.astype(np.int64)] for s in surfaces]).astype(float)
    low, high, centroids = corners.min(axis=1), corners.max(axis=1), corners.mean(axis=1)
    nodes: list[list[float]] = []
    order: list[NDArray[np.int64]] = []
    placed = 0

    def add(members: NDArray[np.int64]) -> None:
        nonlocal placed
        index = len(nodes)
        nodes.append([*low[members].min(axis=0), 0.0, *high[members].max(axis=0), -1.0])
        if len(members) <= TRIANGLES_A_LEAF:
            nodes[index][7] = placed * TRIANGLES_A_LEAF + len(members) - 1
            order.append(members)
            placed += len(members)
        else:
            spread = centroids[members]
            axis = int(np.argmax(np.ptp(spread, axis=0)))
            halves = members[np.argsort(spread[:, axis], kind="stable")]
            add(halves[: len(members) // 2])
            add(halves[len(members) // 2 :])
        nodes[index][3] = float(len(nodes))

    add(np.arange(len(corners)))
    placed_order = np.concatenate(order)
    return Bvh(np.array(nodes, dtype=np.float32), _packed(corners[placed_order]), placed_order)


def _packed(corners: Float64) -> Float32:
    packed = np.zeros((len(corners), 3, 4), dtype=np.float32)
    packed[:, 0, :3] = corners[:, 0]
    packed[:, 1, :3] = corners[:, 1] - corners[:, 0]
    packed[:, 2, :3] = corners[:, 2] - corners[:, 0]
    return packed.reshape(-1, 12)
