from collections.abc import Callable

import numpy as np
import pytest

from realtime.bvh import TRIANGLES_A_LEAF, Bvh, build
from scenes import procedural
from scenes.image import Bool, Float32, Float64
from scenes.mesh import Surface

CORNERS: Float32 = np.eye(3, dtype=np.float32)
SURFACES = {
    "one triangle": [Surface(CORNERS, CORNERS, CORNERS[:, :2], np.array([[0, 1, 2]], dtype=np.uint32))],
    "box": [procedural.box((1.0, 2.0, 0.5))],
    "knot": [procedural.torus_knot(2, 3, 1.0, 0.2, 64, 8)],
    "sphere in a box": [procedural.box((2.0, 2.0, 2.0)), procedural.sphere(0.5, 2)],
}
surfaces = pytest.mark.parametrize("parts", SURFACES.values(), ids=SURFACES.keys())


def corners_of(parts: list[Surface]) -> Float64:
    return np.concatenate([s.positions[s.faces.astype(int)] for s in parts]).astype(float)


def leaves(tree: Bvh) -> list[tuple[int, range]]:
    """Each leaf's node and its triangles."""
    found = []
    for node, code in enumerate(tree.nodes[:, 7].astype(int)):
        if code >= 0:
            first = code // TRIANGLES_A_LEAF
            found.append((node, range(first, first + code % TRIANGLES_A_LEAF + 1)))
    return found


@surfaces
def test_every_triangle_is_in_one_leaf(parts: list[Surface]) -> None:
    tree = build(parts)
    assert [i for _, triangles in leaves(tree) for i in triangles] == list(range(len(tree.triangles)))
    packed = tree.triangles.reshape(-1, 3, 4)[:, :, :3].astype(float)
    rebuilt = np.stack([packed[:, 0], packed[:, 0] + packed[:, 1], packed[:, 0] + packed[:, 2]], axis=1)
    sorted_by_corners = [np.unique(x.reshape(-1, 9).round(4), axis=0) for x in (rebuilt, corners_of(parts))]
    np.testing.assert_allclose(sorted_by_corners[0], sorted_by_corners[1], atol=2e-4)


@surfaces
def test_a_box_holds_the_triangles_of_its_leaf_and_all_boxes_below(parts: list[Surface]) -> None:
    tree = build(parts)
    packed = tree.triangles.reshape(-1, 3, 4)[:, :, :3]
    for node, triangles in leaves(tree):
        own = packed[triangles.start : triangles.stop]
        points = np.concatenate([own[:, 0], own[:, 0] + own[:, 1], own[:, 0] + own[:, 2]])
        assert (points >= tree.nodes[node, :3] - 1e-5).all()
        assert (points <= tree.nodes[node, 4:7] + 1e-5).all()
    for node, row in enumerate(tree.nodes):
        below = tree.nodes[node : int(row[3])]
        assert (below[:, :3] >= row[:3]).all()
        assert (below[:, 4:7] <= row[4:7]).all()


@surfaces
def test_what_comes_after_a_missed_box_lies_ahead(parts: list[Surface]) -> None:
    nodes = build(parts).nodes
    after = nodes[:, 3].astype(int)
    assert (after > np.arange(len(nodes))).all()
    assert after[0] == len(nodes)


def blocked(parts: list[Surface], origins: Float64, directions: Float64) -> tuple[Bool, Bool]:
    """Whether each segment meets a triangle, by all of them in float64; and whether that is clear of any edge."""
    corners = corners_of(parts)
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(directions[:, None], edge2)
    determinant = np.sum(edge1 * p, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (origins[:, None] - corners[:, 0]) / determinant[..., None]
        q = np.cross(s, edge1)
        u, v, t = np.sum(s * p, axis=-1), np.sum(directions[:, None] * q, axis=-1), np.sum(edge2 * q, axis=-1)
        margin = np.min([u, v, 1 - u - v, t, 1 - t], axis=0)
    margin = np.where(determinant == 0, -1.0, margin)
    hit: Bool = np.any(margin > 0, axis=1)
    clear: Bool = np.all(np.abs(margin) > 1e-4, axis=1)
    return hit, clear


@surfaces
def test_segments_are_blocked_by_what_lies_between(glsl: Callable[..., Float64], parts: list[Surface]) -> None:
    """Against every triangle one by one. Some segments are parallel to an axis, where the slabs divide by zero."""
    rng = np.random.default_rng(8)
    tree = build(parts)
    origins, directions = rng.uniform(-1.5, 1.5, (600, 3)), rng.uniform(-1.5, 1.5, (600, 3))
    directions[:90] *= np.repeat(np.eye(3), 30, axis=0)
    grid = np.concatenate([origins, np.zeros((600, 1)), directions, np.zeros((600, 1))], axis=1).reshape(-1, 2, 4)
    made = glsl(
        "indirect/bvh.glsl",
        "r[0].x = float(is_blocked(a[0].xyz, a[1].xyz, 1.0));",
        grid.astype(np.float32).astype(float),
        buffers={4: tree.nodes, 5: tree.triangles},
        defines={"TRIANGLES_A_LEAF": TRIANGLES_A_LEAF},
        node_count=len(tree.nodes),
    )[:, 0, 0]
    expected, clear = blocked(parts, *grid.astype(np.float32).astype(float)[:, :, :3].transpose(1, 0, 2))
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(made[clear] == 1, expected[clear])
    assert expected.any()
