"""The pure functions behind displacement on grids, against float64 and closed forms."""

from collections.abc import Callable

import numpy as np
import pytest

from scenes.image import Float64

Glsl = Callable[..., Float64]
NEVER = 1e29


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7800)


def rows(*columns: Float64) -> Float64:
    """Input (N, I, 4) of a grid from vectors (N, 1 to 4)."""
    made = np.zeros((len(columns[0]), len(columns), 4))
    for k, values in enumerate(columns):
        made[:, k, : values.shape[1]] = values
    return made.astype(np.float32).astype(np.float64)


BOX = "int axis; r[0].xy = box_span(a[0].xyz, a[1].xyz, a[2].xyz, a[3].xyz, axis); r[0].z = float(axis);"


def spans(o: Float64, d: Float64, low: Float64, high: Float64) -> tuple[Float64, Float64, Float64]:
    """Entry, exit and the axis of the entry, by intersecting with each slab."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort(np.stack([(low - o) / d, (high - o) / d]), axis=0)
    return ends[0].max(axis=1), ends[1].min(axis=1), ends[0].argmax(axis=1)


def test_a_box_is_entered_and_left_where_its_slabs_are(glsl: Glsl, rng: np.random.Generator) -> None:
    low, high = -rng.uniform(0.1, 2, (2000, 3)), rng.uniform(0.1, 2, (2000, 3))
    given = rows(3 * rng.normal(size=(2000, 3)), rng.normal(size=(2000, 3)), low, high)
    made = glsl("lib/relief_box.glsl", BOX, given)[:, 0]
    begin, end, axis = spans(*(given[:, k, :3] for k in range(4)))
    np.testing.assert_allclose(made[:, 0], begin, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(made[:, 1], end, rtol=1e-5, atol=1e-5)
    hit = begin < end - 1e-4
    assert hit.sum() > 100
    np.testing.assert_array_equal(made[hit, 2], axis[hit])


@pytest.mark.parametrize("inside", [True, False])
def test_a_ray_along_an_axis_misses_the_box_only_beside_it(glsl: Glsl, inside: bool) -> None:
    o = np.array([[-2.0, 0.5 if inside else 1.5, 0.5]])
    given = rows(o, np.array([[2.0, 0.0, -0.0]]), np.zeros((1, 3)), np.ones((1, 3)))
    begin, end, axis = glsl("lib/relief_box.glsl", BOX, given)[0, 0, :3]
    assert (begin <= end) == inside
    if inside:
        assert (begin, end, axis) == (1.0, 1.5, 0)


def test_a_flat_box_is_hit_from_above(glsl: Glsl) -> None:
    """A field of height 0 everywhere."""
    given = rows(
        np.array([[0.3, 0.4, 2.0]]), np.array([[0.1, 0.0, -1.0]]), np.array([[0.0, 0, 0]]), np.array([[1.0, 1, 0]])
    )
    begin, end, axis = glsl("lib/relief_box.glsl", BOX, given)[0, 0, :3]
    assert (begin, end, axis) == (2, 2, 2)


def height(corners: Float64, at: Float64) -> Float64:
    x, y = at.T
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)
    summed: Float64 = np.sum(weights * corners, axis=1)
    return summed


def test_patches_are_bilinear_and_their_slope_is_their_derivative(glsl: Glsl, rng: np.random.Generator) -> None:
    given = rows(rng.random((500, 4)), rng.random((500, 2)))
    body = "r[0].x = patch_height(a[0], a[1].xy); r[0].yz = patch_slope(a[0], a[1].xy);"
    made = glsl("lib/relief_patch.glsl", body, given)[:, 0]
    corners, at = given[:, 0], given[:, 1, :2]
    np.testing.assert_allclose(made[:, 0], height(corners, at), atol=1e-6)
    for axis, step in enumerate(np.eye(2) / 2):
        # Along an axis a patch is straight, so that any difference is its derivative.
        difference = height(corners, at + step) - height(corners, at - step)
        np.testing.assert_allclose(made[:, 1 + axis], difference, atol=1e-6)


def test_neighbours_have_one_height_on_their_common_edge(glsl: Glsl, rng: np.random.Generator) -> None:
    """To the bit: no ray passes between them."""
    corners = rng.random((500, 4))
    other = np.stack([corners[:, 1], rng.random(500), corners[:, 3], rng.random(500)], axis=1)
    given = rows(corners, other, rng.random((500, 1)))
    body = "r[0].x = patch_height(a[0], vec2(1.0, a[2].x)); r[0].y = patch_height(a[1], vec2(0.0, a[2].x));"
    made = glsl("lib/relief_patch.glsl", body, given)[:, 0]
    np.testing.assert_array_equal(made[:, 0], made[:, 1])


def exact_hits(corners: Float64, o: Float64, d: Float64) -> Float64:
    """The first s > 0 at which o + s d meets the patch or its continuation, by numpy's roots; infinite if none."""
    found = np.full(len(o), np.inf)
    for i, (h, (x, y, z), (dx, dy, dz)) in enumerate(zip(corners, o, d, strict=True)):
        twist = h[0] - h[1] - h[2] + h[3]
        ux, uy = h[1] - h[0], h[2] - h[0]
        above = z - (h[0] + ux * x + uy * y + twist * x * y)
        roots = np.roots([-twist * dx * dy, dz - ux * dx - uy * dy - twist * (x * dy + y * dx), above])
        real = roots[np.abs(roots.imag) < 1e-9].real
        found[i] = min(real[real > 0], default=np.inf)
    return found


HIT = "r[0].x = patch_hit(a[0], a[1].xyz, a[2].xyz);"


def test_a_ray_meets_a_patch_at_the_smallest_root(glsl: Glsl, rng: np.random.Generator) -> None:
    count = 1000
    corners, at = rng.random((count, 4)), rng.random((count, 2))
    o = np.column_stack([at, height(corners, at) + rng.uniform(0.01, 1, count)])
    given = rows(corners, o, rng.normal(size=(count, 3)) * [1, 1, 0.5])
    made = glsl("lib/relief_patch.glsl", HIT, given)[:, 0, 0]
    exact = exact_hits(given[:, 0], given[:, 1, :3], given[:, 2, :3])
    near = exact < 10
    assert near.sum() > 300
    np.testing.assert_allclose(made[near], exact[near], rtol=2e-4, atol=2e-6)
    np.testing.assert_allclose(np.median(np.abs(made[near] - exact[near])), 0, atol=2e-7)
    assert (made[np.isinf(exact)] > NEVER).all()
    assert np.isinf(exact).sum() > 50


def test_a_ray_that_begins_below_a_patch_has_met_it(glsl: Glsl, rng: np.random.Generator) -> None:
    corners, at = rng.random((100, 4)), rng.random((100, 2))
    o = np.column_stack([at, height(corners, at) - 0.01])
    assert not glsl("lib/relief_patch.glsl", HIT, rows(corners, o, rng.normal(size=(100, 3)))).any()


def test_flat_patches_do_not_cancel(glsl: Glsl, rng: np.random.Generator) -> None:
    """A twist of rounding only, where the textbook's root is a difference of equal numbers over almost 0."""
    corners = 0.5 + 1e-7 * rng.random((500, 4))
    d = np.column_stack([rng.normal(size=(500, 2)) * 100, np.full(500, -1.0)])
    given = rows(corners, np.column_stack([rng.random((500, 2)), np.ones(500)]), d)
    made = glsl("lib/relief_patch.glsl", HIT, given)[:, 0, 0]
    np.testing.assert_allclose(made, exact_hits(given[:, 0], given[:, 1, :3], given[:, 2, :3]), rtol=1e-5)


def test_a_step_is_as_long_as_the_distance_where_the_distance_was_measured(
    glsl: Glsl, rng: np.random.Generator
) -> None:
    """In stretched texture space; with distances of texture space itself it is the talk's distance * normalize(t)."""
    t, metric, distance = rng.normal(size=(500, 3)), rng.uniform(0.05, 2, (500, 3)), rng.normal(size=(500, 1))
    given = rows(t, metric, distance)
    body = """
        r[0].xyz = march_step(a[2].x, a[0].xyz, a[1].xyz);
        r[1].xyz = march_step(a[2].x, a[0].xyz, vec3(1.0));"""
    made = glsl("lib/relief_march.glsl", body, given, outputs=2)
    t, metric, distance = given[:, 0, :3], given[:, 1, :3], given[:, 2, :1]
    np.testing.assert_allclose(np.linalg.norm(metric * made[:, 0, :3], axis=1), np.abs(distance[:, 0]), rtol=1e-5)
    np.testing.assert_allclose(np.cross(made[:, 0, :3], t), 0, atol=1e-4)
    talk = distance * t / np.linalg.norm(t, axis=1, keepdims=True)
    np.testing.assert_allclose(made[:, 1, :3], talk, rtol=1e-5, atol=1e-6)


def test_the_wrong_pairing_of_distances_and_steps_misses_by_most_of_the_way(glsl: Glsl) -> None:
    """A plane at half the depth of 0.1 widths, seen from 60 degrees: lengths, stepped along in texture space.

    The march should go towards the plane by cos(60 degrees) of the way. The talk's normalize goes a fifth as far.
    """
    t = np.array([[0.1 * np.tan(np.radians(60)), 0.0, -1.0]])
    given = rows(t, np.array([[1.0, 1.0, 0.1]]), np.array([[0.05]]))
    body = "r[0] = vec4(march_step(a[2].x, a[0].xyz, a[1].xyz).z, march_step(a[2].x, a[0].xyz, vec3(1.0)).z, 0.0, 0.0);"
    right, wrong = glsl("lib/relief_march.glsl", body, given)[0, 0, :2]
    assert right == pytest.approx(-0.5 * np.cos(np.radians(60)), rel=1e-5)
    assert wrong == pytest.approx(-0.05 / np.hypot(1, t[0, 0]), rel=1e-5)


def test_parallax_mapping_ends_on_a_plane_as_deep_as_the_lookup_says(glsl: Glsl, rng: np.random.Generator) -> None:
    t = np.column_stack([rng.normal(size=(200, 2)), -rng.uniform(0.1, 1, 200)])
    given = rows(rng.random((200, 2)), t, rng.random((200, 1)))
    made = glsl("lib/relief_march.glsl", "r[0].xy = parallax_uv(a[0].xy, a[1].xyz, a[2].x);", given)[:, 0, :2]
    uv, t, depth = given[:, 0, :2], given[:, 1, :3], given[:, 2, :1]
    np.testing.assert_allclose(made, uv + t[:, :2] * (depth / -t[:, 2:]), rtol=1e-5, atol=1e-6)
