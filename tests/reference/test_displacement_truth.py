"""What is seen of a relief, against closed forms, a march of small steps, and Mitsuba on the relief's mesh."""

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from reference.estimator import Reference, seed_of
from reference.quantities import quantity
from reference.quantities.displacement import displaced_block
from reference.quantities.radiance import light_paths_block
from reference.relief_rays import Block, Hits, block_of, cast, seen_from, subject_of
from reference.stage import Stage, build_stage
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Bool, Float64
from scenes.load import LIBRARY
from scenes.model import Scene
from scenes.procedural import normalised
from scenes.relief import field
from scenes.shapes import FieldName

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]
Ints = NDArray[np.int64]

MARCH_STEPS = 200_001
TWIST = np.array([[0.0, 0.0], [0.0, 1.0]])
"""One cell of the height s t: neither of its diagonals is straight."""

SENSOR = {
    "type": "perspective",
    "origin": [1.2, -2.4, 2.0],
    "target": [0.0, 0.0, -0.1],
    "up": [0.0, 0.0, 1.0],
    "fov_deg": 8.0,
    "width": 24,
    "height": 16,
}
BLOCK = {
    "name": "block",
    "type": "relief",
    "size": [1.0, 0.8],
    "depth": 0.12,
    "heights": "noise",
    "resolution": 24,
    "material": "skin",
}
TO_SUN = np.array([-0.8, -0.3, 0.6]) / np.linalg.norm([0.8, 0.3, 0.6])
IRRADIANCE = np.array([3.0, 2.0, 1.0])
SUN = {"type": "directional", "direction": [0.8, 0.3, -0.6], "irradiance": [3.0, 2.0, 1.0]}
LAMP = {"type": "point", "position": [0.3, 0.2, 1.0], "intensity": [2.0, 2.0, 2.0]}
ALBEDO = np.array([0.6, 0.5, 0.4])
MATERIALS = {
    "skin": {"type": "diffuse", "reflectance": ALBEDO.tolist()},
    "tiles": {"type": "diffuse", "reflectance": {"path": "tiles.png"}},
}


def grid_block(heights: Float64) -> Block:
    """A block whose grid is the world."""
    columns, rows = heights.shape[1] - 1, heights.shape[0] - 1
    return Block(heights, np.ones(3), np.eye(3), np.array([0.5 * columns, 0.5 * rows, 1.0]))


def one(block: Block, origin: list[float], direction: list[float]) -> Hits:
    return cast(block, np.array([origin]), np.array([direction]))


def heights_at(heights: Float64, x: Float64, y: Float64) -> Float64:
    """Heights between the samples, with weights spelt out."""
    i, j = (np.clip(np.floor(a).astype(int), 0, n - 2) for a, n in ((x, heights.shape[1]), (y, heights.shape[0])))
    s, t = x - i, y - j
    below = (1 - s) * heights[j, i] + s * heights[j, i + 1]
    above = (1 - s) * heights[j + 1, i] + s * heights[j + 1, i + 1]
    found: Float64 = (1 - t) * below + t * above
    return found


def out_of(block: Block, points: Float64) -> Float64:
    """Points (..., 3) of the grid in the world."""
    turned: Float64 = (block.extent * (points - block.middle)) @ block.to_world.T + block.position
    return turned


def walls(block: Block, hits: Hits) -> Ints:
    """-1 or 1 (R, 2) for a ray that meets a wall at the lower or upper end of u or v, else 0.

    A wall is met below the field's border.
    """
    x, y, z = hits.grid.T
    is_below = np.isfinite(hits.t) & (heights_at(block.heights, x, y) - z > 1e-9)
    at_end = np.abs(np.stack([hits.grid[:, :2], hits.grid[:, :2] - block.last])) < 1e-9
    return np.where(is_below[:, None], at_end[1].astype(np.int64) - at_end[0], 0)


def shading_normals(block: Block, hits: Hits) -> Float64:
    """Unit normals (R, 3) in the world of what rays meet: of the cell's patch, or of the wall."""
    i, j = np.clip(np.floor(hits.grid[:, :2]).astype(int), 0, block.last.astype(int) - 1).T
    s, t = hits.grid[:, 0] - i, hits.grid[:, 1] - j
    a, b, c, d = (block.heights[j + row, i + column] for row in (0, 1) for column in (0, 1))
    along_u, along_v = (1 - t) * (b - a) + t * (d - c), (1 - s) * (c - a) + s * (d - b)
    upward = np.stack([-along_u, -along_v, np.ones_like(s)], axis=-1) / block.extent
    sides = walls(block, hits)
    outward = np.column_stack([sides, np.zeros(len(s))])
    return normalised(np.where(sides.any(axis=1, keepdims=True), outward, upward)) @ block.to_world.T


def marched(heights: Float64, origin: Float64, direction: Float64) -> tuple[float, float]:
    """The first of many even steps through the block's box that is not above the field, and the length of a step."""
    ends = np.array([heights.shape[1] - 1, heights.shape[0] - 1, 1.0])
    low, high = -origin / direction, (ends - origin) / direction
    near, far = max(0.0, float(np.minimum(low, high).max())), float(np.maximum(low, high).min())
    if near >= far:
        return np.inf, 0.0
    t = np.linspace(near, far, MARCH_STEPS)
    x, y, z = (origin + t[:, None] * direction).T
    inside = z <= heights_at(heights, x, y)
    return (float(t[inside.argmax()]) if inside.any() else np.inf), (far - near) / (MARCH_STEPS - 1)


def random_rays(heights: Float64, count: int, seed: int) -> tuple[Float64, Float64]:
    """Rays from all sides and from above to places in the block's box."""
    rng = np.random.default_rng(seed)
    extent = np.array([heights.shape[1] - 1.0, heights.shape[0] - 1.0])
    angle, reach = 2 * np.pi * rng.random(count), rng.uniform(0.0, 2.0, count)
    round_about = 0.5 * extent + (reach * extent.max())[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    origins = np.column_stack([round_about, rng.uniform(0.3, 3.0, count) + (reach < 0.8)])
    targets = np.column_stack([rng.random((count, 2)) * extent, rng.random(count)])
    return origins, targets - origins


# ---- Rays


def test_a_ray_meets_a_ramp_where_a_plane_is_met() -> None:
    ramp = np.outer(np.ones(5), np.linspace(0, 1, 9))
    hits = one(grid_block(ramp), [-3.0, 1.7, 2.0], [4.0, 0.1, -1.0])
    t = (2.0 + 3.0 / 8) / (1.0 + 4.0 / 8)
    assert hits.t == pytest.approx([t])
    assert hits.grid[0] == pytest.approx([-3 + 4 * t, 1.7 + 0.1 * t, 2 - t])


@pytest.mark.parametrize("place", [0.2, 0.5, 0.9])
def test_a_ray_along_a_diagonal_meets_the_saddle_where_its_parabola_is_met(place: float) -> None:
    """Along s = t the height s t is s²: the ray z = p + 0.1 - (s - p) meets it at the root of s² + s - 2 p - 0.1."""
    hits = one(grid_block(TWIST), [place - 1, place - 1, place + 1.1], [1.0, 1.0, -1.0])
    root = -0.5 + np.sqrt(0.25 + 2 * place + 0.1)
    assert hits.grid[0] == pytest.approx([root, root, root**2])


def test_a_ray_may_meet_the_saddle_twice_and_the_first_counts() -> None:
    """Along s + t = 1 the height is s - s², which a level ray at 0.2 is below of between two places."""
    hits = one(grid_block(TWIST), [-1.0, 2.0, 0.2], [1.0, -1.0, 0.0])
    assert hits.grid[0, 0] == pytest.approx(0.5 - np.sqrt(0.05))
    above = one(grid_block(TWIST), [-1.0, 2.0, 0.2500001], [1.0, -1.0, 0.0])
    assert np.isinf(above.t).all()


@pytest.mark.parametrize("name", ["gravel", "steps", "spikes", "noise"])
def test_the_cast_agrees_with_a_march_of_small_steps(name: FieldName) -> None:
    """The march comes to the place within one step after the cast, or passes by what it has stepped over."""
    heights = field(name, 32, 0)
    origins, directions = random_rays(heights, 40, 1)
    block = grid_block(heights)
    hits = cast(block, origins, directions)
    assert np.isfinite(hits.t).sum() > 10
    for origin, direction, t in zip(origins, directions, hits.t, strict=True):
        found, step = marched(heights, origin, direction)
        if np.isinf(found) and np.isfinite(t):
            assert origin[2] + t * direction[2] < 1e-6, "the floor is met at the very end of the march"
        elif np.isfinite(found):
            assert -1e-9 <= found - t <= step + 1e-9


@given(seed=st.integers(0, 1 << 16), shape=st.tuples(st.integers(2, 9), st.integers(2, 9)))
@settings(max_examples=60, deadline=None)
def test_a_hit_is_on_the_surface_and_nothing_before_it_is_below(seed: int, shape: tuple[int, int]) -> None:
    heights = np.random.default_rng(seed).random(shape)
    origins, directions = random_rays(heights, 50, seed)
    hits = cast(grid_block(heights), origins, directions)
    ends = np.where(np.isfinite(hits.t), hits.t, 4.0)
    x, y, z = np.moveaxis(origins + np.linspace(0, 1 - 1e-6, 400)[:, None, None] * ends[:, None] * directions, -1, 0)
    is_inside = (x >= 0) & (x <= shape[1] - 1) & (y >= 0) & (y <= shape[0] - 1) & (z >= 0)
    assert (z - heights_at(heights, x, y))[is_inside].min(initial=1.0) > -1e-9
    x, y, z = hits.grid[np.isfinite(hits.t)].T
    off = z - heights_at(heights, x, y)
    is_wall = walls(grid_block(heights), hits)[np.isfinite(hits.t)].any(axis=1)
    assert np.abs(off[~is_wall]).max(initial=0.0) < 1e-9


def test_rays_straight_down_and_along_lines_of_the_grid_meet_the_field() -> None:
    """Where a ray runs along the border of two cells, or through samples, either cell has the same answer."""
    heights = field("noise", 9, 0)
    block = grid_block(heights)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    down = cast(block, np.column_stack([i, j, np.full(81, 2.0)]), np.tile([0.0, 0.0, -1.0], (81, 1)))
    np.testing.assert_allclose(down.t, 2 - heights.ravel(), atol=1e-12)
    inward = np.column_stack([1e-9 * np.sign(4 - i), 1e-9 * np.sign(4 - j), np.full(81, -1.0)])
    aslant = cast(block, np.column_stack([i, j, np.full(81, 1.5)]), inward)
    np.testing.assert_allclose(aslant.t, 1.5 - heights.ravel(), atol=1e-7)
    diagonal = one(block, [-1.0, -1.0, 1.2], [1.0, 1.0, -0.1])
    shifted = one(block, [-1.0, -1.0 + 1e-9, 1.2], [1.0, 1.0, -0.1])
    assert diagonal.t == pytest.approx(shifted.t, abs=1e-6)


def test_a_floor_at_height_0_is_met() -> None:
    """Its distance is the end of the block's box, to rounding."""
    origins = np.column_stack([np.random.default_rng(0).uniform(0.1, 0.9, (500, 2)), np.full(500, 7.3)])
    directions = np.random.default_rng(1).normal(size=(500, 3)) * (1e-3, 1e-3, 0.0) + (0.0, 0.0, -1 / 3)
    hits = cast(grid_block(np.zeros((2, 2))), origins, directions)
    np.testing.assert_allclose(hits.t, 21.9, rtol=1e-12)


@pytest.mark.parametrize(
    ("origin", "direction", "side", "outward"),
    [
        ([-1.0, 0.5, 0.2], [1.0, 0.0, 0.0], [-1, 0], [-1, 0, 0]),
        ([2.0, 0.5, 0.2], [-1.0, 0.0, 0.0], [1, 0], [1, 0, 0]),
        ([0.5, -1.0, 0.2], [0.0, 1.0, 0.0], [0, -1], [0, -1, 0]),
        ([0.5, 2.0, 0.2], [0.0, -1.0, 0.0], [0, 1], [0, 1, 0]),
    ],
)
def test_rays_from_the_side_meet_the_walls(
    origin: list[float], direction: list[float], side: list[int], outward: list[int]
) -> None:
    block = grid_block(np.full((2, 2), 0.5))
    hits = one(block, origin, direction)
    assert hits.t == pytest.approx([1.0])
    assert walls(block, hits).tolist() == [side]
    np.testing.assert_array_equal(shading_normals(block, hits), [outward])
    over = one(block, [*origin[:2], 0.6], direction)
    assert np.isinf(over.t).all()


def test_rays_into_the_side_that_are_above_the_border_meet_what_is_behind_it() -> None:
    ramp = np.array([[0.0, 1.0], [0.0, 1.0]])
    block = grid_block(ramp)
    hits = one(block, [-1.0, 0.5, 0.3], [1.0, 0.0, 0.0])
    assert hits.grid[0, 0] == pytest.approx(0.3)
    assert walls(block, hits).tolist() == [[0, 0]]
    np.testing.assert_allclose(shading_normals(block, hits), [[-(0.5**0.5), 0, 0.5**0.5]])


def test_rays_from_below_and_away_pass_by() -> None:
    block = grid_block(field("noise", 5, 0))
    for origin, direction in ([2.0, 2.0, -1.0], [0.1, 0.0, 1.0]), ([2.0, 2.0, 3.0], [0.0, 0.1, 1.0]):
        assert np.isinf(one(block, origin, direction).t).all()


def test_a_ray_that_starts_within_the_box_meets_no_wall() -> None:
    block = grid_block(np.full((3, 3), 0.5))
    hits = one(block, [0.5, 0.5, 0.7], [0.3, 0.0, -0.1])
    assert hits.grid[0] == pytest.approx([1.1, 0.5, 0.5])
    assert walls(block, hits).tolist() == [[0, 0]]


def test_distances_are_those_of_the_world_however_a_block_stands(make_scene: MakeScene) -> None:
    """Turned, scaled and moved together with its rays it is met at the same places."""
    plain = make_scene(shapes=[BLOCK], subject=["block"])
    turned = make_scene(
        shapes=[BLOCK | {"scale": 2.5, "rotation_deg": [20.0, -50.0, 70.0], "position": [3.0, -1.0, 2.0]}],
        subject=["block"],
    )
    at, there = (block_of(scene, subject_of(scene)) for scene in (plain, turned))
    origins, directions = random_rays(at.heights, 60, 5)
    first = cast(at, out_of(at, origins), out_of(at, directions) - out_of(at, np.zeros(3)))
    second = cast(there, out_of(there, origins), out_of(there, directions) - out_of(there, np.zeros(3)))
    np.testing.assert_allclose(first.grid, second.grid, atol=1e-9)
    of_first, of_second = shading_normals(at, first), shading_normals(there, second)
    np.testing.assert_allclose(of_first @ at.to_world, of_second @ there.to_world, atol=1e-9)


# ---- What the camera sees


@pytest.fixture
def carved(make_scene: MakeScene, tmp_path: Path) -> MakeScene:
    """Makes a scene with one block and nothing else, in the sun if nothing else is said."""
    shutil.copy(LIBRARY / "assets" / "tiles.png", tmp_path)

    def make(emitters: tuple[dict[str, Any], ...] = (SUN,), fov_deg: float = 8.0, **block: Any) -> Scene:
        sensor = SENSOR | {"fov_deg": fov_deg}
        return make_scene(
            shapes=[BLOCK | block], subject=["block"], sensor=sensor, materials=MATERIALS, emitters=list(emitters)
        )

    return make


def stage_of(mi: ModuleType, scene: Scene) -> Stage:
    return build_stage(mi, scene, geometry_of(scene))


def centres(scene: Scene) -> tuple[Float64, Float64]:
    y, x = (a.ravel() + 0.5 for a in np.mgrid[: scene.sensor.height, : scene.sensor.width])
    return x, y


@pytest.mark.parametrize("fov_deg", [8.0, 40.0])
@pytest.mark.parametrize("name", ["bumps", "noise", "spikes"])
def test_mitsuba_meets_the_mesh_where_the_cast_meets_the_field(
    mi: ModuleType, carved: MakeScene, name: FieldName, fov_deg: float
) -> None:
    """The mesh is within a sixteenth of a cell's twist of the field, more along a ray that meets it aslant."""
    scene = carved(heights=name, fov_deg=fov_deg)
    block = block_of(scene, subject_of(scene))
    hits = seen_from(scene, block, *centres(scene))
    stage = stage_of(mi, scene)
    found = stage.scene.ray_intersect(stage.rays(*(mi.Float(a) for a in centres(scene))))
    valid = found.is_valid().numpy()
    np.testing.assert_array_equal(valid, np.isfinite(hits.t))
    points = found.p.numpy().T[valid].astype(np.float64)
    twist = np.abs(np.diff(np.diff(block.heights, axis=0), axis=1)).max() * block.extent[2]
    normals = shading_normals(block, hits)[valid]
    off = np.einsum("ri,ri->r", points - out_of(block, hits.grid[valid]), normals)
    u, v = found.uv.numpy()[:, valid].astype(np.float64)
    upward = np.stack([u, 1 - v], axis=1)
    np.testing.assert_allclose(upward * block.last, np.clip(block.into(points)[:, :2], 0, block.last), atol=1e-3)
    is_same_place = np.linalg.norm(points - out_of(block, hits.grid[valid]), axis=1) < 0.2 * block.extent[0]
    assert is_same_place.mean() > 0.97
    assert np.abs(off[is_same_place]).max() <= twist / 16 + 1e-5


def test_the_truth_is_what_the_ray_through_the_centre_of_a_pixel_meets(
    carved: MakeScene, reference: MakeReference
) -> None:
    """In samples, along +x and +y of the block; 0 where nothing is."""
    scene = carved()
    truth = reference(scene).truth("displaced_uv", 0)
    assert truth.is_exact
    grid = seen_from(scene, block_of(scene, subject_of(scene)), *centres(scene)).grid[:, :2]
    np.testing.assert_allclose(truth.accumulators[0].reshape(-1, 2), grid, atol=1e-5)
    middle = truth.accumulators[0][8, 12]
    assert np.abs(middle - 11.5).max() < 3
    assert quantity("displaced_uv").unit_in(scene) == "texel"


def test_no_ray_slips_through_between_the_triangles(carved: MakeScene, reference: MakeReference) -> None:
    """What the field hides is hidden in every one of a pixel's positions; 5 in 100 000 rays went through."""
    truth = reference(carved(heights="bumps", resolution=256, fov_deg=5.0)).truth("coverage", 0)
    assert (truth.accumulators == 1).all()


def test_only_pixels_that_the_block_covers_are_judged(carved: MakeScene, reference: MakeReference) -> None:
    scene = carved(fov_deg=40.0)
    truth = reference(scene).truth("displaced_uv", 0)
    hits = seen_from(scene, block_of(scene, subject_of(scene)), *centres(scene))
    assert 0.05 < truth.mask.mean() < 0.6
    assert np.isfinite(hits.t).reshape(truth.mask.shape)[truth.mask].all()


# ---- Light


def shaded(scene: Scene, positions: int) -> tuple[Float64, Bool]:
    """Radiance (P, 3) of a Lambertian block in the sun, by rays through the field; and pixels that it covers wholly.

    positions : in each pixel, a regular grid of that many along each side
    """
    block = block_of(scene, subject_of(scene))
    offsets = (np.arange(positions) + 0.5) / positions - 0.5
    x, y = centres(scene)
    dx, dy = (a.ravel() for a in np.meshgrid(offsets, offsets))
    hits = seen_from(scene, block, (x[:, None] + dx).ravel(), (y[:, None] + dy).ravel())
    normals = shading_normals(block, hits)
    starts = out_of(block, hits.grid) + 1e-7 * normals
    is_lit = np.isinf(cast(block, starts, np.broadcast_to(TO_SUN, starts.shape)).t) & np.isfinite(hits.t)
    cosine = np.where(is_lit, np.maximum(normals @ TO_SUN, 0.0), 0.0).reshape(len(x), -1).mean(axis=1)
    is_covered = np.logical_and.reduce(np.isfinite(hits.t).reshape(len(x), -1), axis=1)
    return cosine[:, None] * IRRADIANCE * ALBEDO / np.pi, is_covered


def relative_errors(found: Float64, expected: Float64) -> tuple[float, float]:
    """Of the mean, and root mean square of the pixels over the mean."""
    mean = float(expected.mean())
    return float(found.mean()) / mean - 1, float(np.sqrt(np.mean((found - expected) ** 2))) / mean


@pytest.mark.parametrize("name", ["bumps", "noise", "steps"])
def test_light_is_that_of_exact_rays_and_shadow_rays(mi: ModuleType, carved: MakeScene, name: FieldName) -> None:
    """Another program in numpy, whose rays are those that agree with a march of small steps.

    What is left are the edges of shadows between the 256 positions in a pixel.
    """
    scene = carved(heights=name)
    expected, is_covered = shaded(scene, 16)
    pixels = np.flatnonzero(is_covered)
    bias, rms = relative_errors(displaced_block(stage_of(mi, scene), pixels, seed_of("light"), 1024), expected[pixels])
    assert abs(bias) < 1e-3
    assert rms < 0.008


@pytest.mark.parametrize(
    ("block", "light", "fov_deg"),
    [
        ({"heights": "bumps"}, SUN, 8.0),
        ({"heights": "noise"}, LAMP, 8.0),
        ({"heights": "steps"}, SUN, 8.0),
        ({"scale": 1.3, "rotation_deg": [10.0, -15.0, 40.0], "position": [0.1, 0.0, 0.1]}, SUN, 20.0),
        ({"material": "tiles"}, SUN, 40.0),
    ],
)
def test_light_is_that_of_mitsuba_on_the_mesh(
    mi: ModuleType, carved: MakeScene, block: dict[str, Any], light: dict[str, Any], fov_deg: float
) -> None:
    """But for what the mesh is off, and a little light that shadow rays let in which start off the surface."""
    scene = carved((light,), fov_deg, **block)
    stage = stage_of(mi, scene)
    pixels = np.arange(scene.sensor.width * scene.sensor.height)
    ours, mitsubas = (
        f(stage, pixels, seed_of("light"), 1024) for f in (displaced_block, partial(light_paths_block, 1, 1))
    )
    bias, rms = relative_errors(mitsubas, ours)
    assert ours.mean() > 0
    assert -1e-3 < bias < 4e-3
    assert rms < 0.03


def test_without_its_own_shadow_a_block_would_be_brighter(mi: ModuleType, carved: MakeScene) -> None:
    scene = carved(depth=0.4)
    block = block_of(scene, subject_of(scene))
    pixels = np.flatnonzero(shaded(scene, 4)[1])
    normals = shading_normals(block, seen_from(scene, block, *centres(scene)))[pixels]
    unshadowed = np.maximum(normals @ TO_SUN, 0.0).mean() * IRRADIANCE[0] * ALBEDO[0] / np.pi
    found = displaced_block(stage_of(mi, scene), pixels, seed_of("light"), 256)[:, 0].mean()
    assert found < 0.9 * unshadowed


def test_a_level_block_under_a_constant_sky_reflects_its_share(mi: ModuleType, carved: MakeScene) -> None:
    """White furnace: what a plane reflects of a sky of radiance 1 in every direction is its reflectance."""
    sky = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
    scene = carved((sky,), fov_deg=5.0, heights="bumps", resolution=2, depth=1e-6)
    found = displaced_block(stage_of(mi, scene), np.arange(24 * 16), seed_of("sky"), 256).mean(axis=0)
    np.testing.assert_allclose(found, ALBEDO, rtol=0.01)


@pytest.mark.parametrize("light", [SUN, LAMP])
def test_a_level_block_has_the_light_of_a_plane(
    carved: MakeScene, reference: MakeReference, light: dict[str, Any]
) -> None:
    """The irradiance that arrives aslant, times the reflectance over pi; from a lamp it changes over a pixel."""
    scene = carved((light,), fov_deg=5.0, heights="bumps", resolution=2, depth=1e-6)
    block = block_of(scene, subject_of(scene))
    points = out_of(block, seen_from(scene, block, *centres(scene)).grid)
    to_lamp = np.array(LAMP["position"]) - points
    of_lamp = 2.0 * (to_lamp[:, 2] / np.linalg.norm(to_lamp, axis=1) ** 3)[:, None]
    irradiance = of_lamp if light is LAMP else TO_SUN[2] * IRRADIANCE
    expected = (irradiance * np.ones((len(points), 1)) * ALBEDO / np.pi).reshape(
        scene.sensor.height, scene.sensor.width, 3
    )
    truth = reference(scene).truth("displaced_radiance", 256)
    assert truth.mask.all()
    np.testing.assert_allclose(truth.accumulators.mean(axis=0), expected, rtol=2e-3)


def test_a_block_in_the_dark_is_black(carved: MakeScene, reference: MakeReference) -> None:
    truth = reference(carved(())).truth("displaced_radiance", 64)
    assert truth.is_exact
    assert not truth.accumulators.any()


def test_other_subjects_and_materials_are_refused(make_scene: MakeScene, carved: MakeScene) -> None:
    room = make_scene()
    for name in ("displaced_uv", "displaced_radiance"):
        assert "not one relief" in quantity(name).refuses(features_of(room, geometry_of(room)))
        assert not quantity(name).refuses(features_of(carved(), geometry_of(carved())))
    metal = {"skin": {"type": "principled", "base_color": [0.6, 0.5, 0.4], "metallic": 1.0}}
    scene = make_scene(shapes=[BLOCK], subject=["block"], materials=metal)
    found = features_of(scene, geometry_of(scene))
    assert not quantity("displaced_uv").refuses(found)
    assert "diffuse" in quantity("displaced_radiance").refuses(found)
    beside = {"name": "ball", "type": "sphere", "detail": 1, "material": "skin", "position": [0.0, 3.0, 0.0]}
    scene = make_scene(shapes=[BLOCK, beside], subject=["block"])
    found = features_of(scene, geometry_of(scene))
    assert not quantity("displaced_uv").refuses(found)
    assert "throw a shadow" in quantity("displaced_radiance").refuses(found)
