"""Carved blocks: their fields, and the mesh that stands for them."""

from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numpy as np
import PIL.Image
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.errors import SceneError
from scenes.features import features_of
from scenes.geometry import geometry_of, heights_of
from scenes.image import Float64
from scenes.load import LIBRARY, load_scene
from scenes.mesh import Surface
from scenes.model import Scene
from scenes.relief import field, relief
from scenes.shapes import FieldName, Relief
from scenes.topology import EdgeFaults, edge_faults, face_vectors, weld

NAMES: tuple[FieldName, ...] = get_args(FieldName)
PHOTOGRAPHS = ("brick", "gravel")
SIZE, DEPTH = (2.0, 1.0), 0.3
BLOCK = Relief(name="block", material="m", type="relief", size=SIZE, depth=DEPTH, heights="noise")

some_heights = st.tuples(st.integers(2, 6), st.integers(2, 6), st.integers(0, 1 << 16)).map(
    lambda seed: np.random.default_rng(seed[2]).random(seed[:2])
)


def bilinear(heights: Float64, u: Float64, v: Float64) -> Float64:
    """Heights between the samples, with weights spelt out."""
    rows, columns = heights.shape
    x, y = u * (columns - 1), v * (rows - 1)
    i, j = (np.clip(np.floor(a).astype(int), 0, n - 2) for a, n in ((x, columns), (y, rows)))
    s, t = x - i, y - j
    below = (1 - s) * heights[j, i] + s * heights[j, i + 1]
    above = (1 - s) * heights[j + 1, i] + s * heights[j + 1, i + 1]
    found: Float64 = (1 - t) * below + t * above
    return found


def faces_up(surface: Surface) -> Float64:
    """The corners (F, 3, 3) of the faces on the carved side."""
    is_top = surface.normals[surface.faces[:, 0], 2] > 0
    corners: Float64 = surface.positions.astype(np.float64)[surface.faces[is_top]]
    return corners


@pytest.mark.parametrize("name", NAMES)
def test_a_field_reaches_from_0_to_1_in_numbers_of_float32(name: FieldName) -> None:
    heights = field(name, 40, 0)
    assert heights.shape == (40, 40)
    assert (heights.min(), heights.max()) == (0, 1)
    np.testing.assert_array_equal(heights, heights.astype(np.float32))


@pytest.mark.parametrize("name", NAMES)
def test_a_field_is_the_same_every_time_and_another_with_another_seed(name: FieldName) -> None:
    np.testing.assert_array_equal(field(name, 40, 3), field(name, 40, 3))
    assert np.array_equal(field(name, 40, 3), field(name, 40, 4)) == (name in PHOTOGRAPHS)


@pytest.mark.parametrize("name", ["bumps", "spikes", "noise"])
def test_a_finer_field_is_the_same_field(name: FieldName) -> None:
    """What is made by formula is sampled in places that coincide, up to the range that the samples reach."""
    coarse, fine = field(name, 65, 0), field(name, 129, 0)[::2, ::2]
    assert np.corrcoef(coarse.ravel(), fine.ravel())[0, 1] > 0.9999


@pytest.mark.parametrize("name", PHOTOGRAPHS)
def test_the_lower_edge_of_a_photograph_is_row_0(name: FieldName) -> None:
    import skimage.data

    whole = getattr(skimage.data, name)().astype(float)
    coarse = whole.reshape(128, 4, 128, 4).mean(axis=(1, 3))
    found = field(name, 128, 0)
    assert np.corrcoef(coarse[::-1].ravel(), found.ravel())[0, 1] > 0.85
    assert np.corrcoef(coarse.ravel(), found.ravel())[0, 1] < 0.5


def test_terraces_are_nearly_level_with_cliffs_one_cell_wide() -> None:
    slopes = np.abs(np.diff(field("steps", 256, 0), axis=1))
    is_cliff = slopes > 0.1
    assert 0.02 < is_cliff.mean() < 0.1
    assert np.percentile(slopes[~is_cliff], 99) < 0.01
    assert np.median(slopes[is_cliff]) == pytest.approx(0.8 / 5.2, rel=0.05)


@given(heights=some_heights)
@settings(max_examples=40, deadline=None)
def test_vertices_lie_on_the_bilinear_field(heights: Float64) -> None:
    surface = relief(BLOCK, heights)
    is_top = surface.normals[:, 2] > 0
    u, v = surface.uvs[is_top].astype(np.float64).T
    expected = np.stack([SIZE[0] * (u - 0.5), SIZE[1] * (v - 0.5), DEPTH * (bilinear(heights, u, v) - 1)], axis=1)
    np.testing.assert_allclose(surface.positions[is_top], expected, atol=1e-6)


@given(heights=some_heights)
@settings(max_examples=40, deadline=None)
def test_normals_are_those_of_each_cells_patch(heights: Float64) -> None:
    """By differences within the cell, over which the field is linear along u and along v."""
    surface = relief(BLOCK, heights)
    cells = (heights.shape[0] - 1) * (heights.shape[1] - 1)
    points = surface.positions[: 9 * cells].reshape(-1, 3, 3, 3).astype(np.float64)
    along_x = points[:, :, 2:] - points[:, :, :1]
    along_y = points[:, 2:] - points[:, :1]
    normals = np.cross(np.broadcast_to(along_x, points.shape), np.broadcast_to(along_y, points.shape))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    np.testing.assert_allclose(surface.normals[: 9 * cells].reshape(points.shape), normals, atol=3e-5)


@given(heights=some_heights)
@settings(max_examples=40, deadline=None)
def test_the_block_is_closed_but_for_its_bottom_and_faces_outward(heights: Float64) -> None:
    surface = relief(BLOCK, heights)
    border = 4 * (sum(heights.shape) - 2)
    assert edge_faults(weld(surface.positions)[surface.faces]) == EdgeFaults(open=border, flipped=0)
    outward = np.einsum(
        "fi,fi->f", face_vectors(surface.positions, surface.faces), surface.normals[surface.faces[:, 0]]
    )
    assert (outward > 0).all()


@given(heights=some_heights)
@settings(max_examples=40, deadline=None)
def test_triangles_lie_as_much_above_the_patches_as_below(heights: Float64) -> None:
    """The volume under them is that under the field, whose mean over a cell is that of its corners."""
    corners = faces_up(relief(BLOCK, heights))
    first, second = corners[:, 1, :2] - corners[:, 0, :2], corners[:, 2, :2] - corners[:, 0, :2]
    area = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    volume = float(np.sum(area * (corners[:, :, 2].mean(axis=1) + DEPTH)))
    means = 0.25 * (heights[1:, 1:] + heights[1:, :-1] + heights[:-1, 1:] + heights[:-1, :-1])
    assert area.sum() == pytest.approx(SIZE[0] * SIZE[1], rel=1e-6)
    assert volume == pytest.approx(SIZE[0] * SIZE[1] * DEPTH * means.mean(), rel=1e-5)


@given(heights=some_heights, seed=st.integers(0, 1 << 16))
@settings(max_examples=40, deadline=None)
def test_triangles_stay_within_a_sixteenth_of_the_twist(heights: Float64, seed: int) -> None:
    corners = faces_up(relief(BLOCK, heights))
    weights = np.random.default_rng(seed).dirichlet(np.ones(3), len(corners))
    x, y, z = np.einsum("fc,fci->if", weights, corners)
    twist = np.abs(heights[1:, 1:] - heights[1:, :-1] - heights[:-1, 1:] + heights[:-1, :-1]).max()
    off = np.abs(1 + z / DEPTH - bilinear(heights, x / SIZE[0] + 0.5, y / SIZE[1] + 0.5))
    assert off.max() <= twist / 16 + 1e-5


def test_there_is_no_wall_where_the_border_is_at_the_bottom() -> None:
    heights = np.zeros((4, 4))
    heights[1:3, 1:3] = 1
    surface = relief(BLOCK, heights)
    assert (surface.normals[surface.faces, 2] > 0).all()
    heights[0, 0] = 1
    surface = relief(BLOCK, heights)
    assert np.linalg.norm(face_vectors(surface.positions, surface.faces), axis=1).min() > 0


BLOCK_TABLE = {"name": "block", "type": "relief", "size": [1.0, 1.0], "depth": 0.1, "material": "skin"}


@pytest.fixture
def carved(make_scene: Callable[..., Scene]) -> Callable[..., Scene]:
    """Makes a scene with one block and nothing else."""

    def make(**block: object) -> Scene:
        return make_scene(shapes=[BLOCK_TABLE | {"heights": "noise", "resolution": 6} | block], subject=["block"])

    return make


def test_an_image_stands_upright(carved: Callable[..., Scene], tmp_path: Path) -> None:
    """Its lower left pixel is the sample at u = v = 0; a block may have more samples one way than the other."""
    levels = np.array([[10, 20, 30], [40, 50, 60]], dtype=np.uint8)
    PIL.Image.fromarray(levels).save(tmp_path / "levels.png")
    scene = carved(heights={"path": "levels.png", "color_space": "linear"})
    shape = scene.shapes[0]
    assert isinstance(shape, Relief)
    np.testing.assert_allclose(heights_of(scene, shape), levels[::-1] / 255, atol=1e-7)
    (mesh,) = geometry_of(scene)
    lower_left = np.argmin(mesh.surface.positions[:, :2].sum(axis=1))
    assert mesh.surface.positions[lower_left] == pytest.approx([-0.5, -0.5, 0.1 * (40 / 255 - 1)], abs=1e-6)
    assert mesh.surface.uvs[lower_left] == pytest.approx([0, 0])


def test_a_block_alone_is_a_relief_and_not_convex(carved: Callable[..., Scene]) -> None:
    """Not even a level one: it has no bottom."""
    scene = carved()
    found = features_of(scene, geometry_of(scene))
    assert found.subject_is_relief
    assert not found.subject_is_convex
    assert not found.has_other_than_diffuse


@pytest.mark.parametrize(
    ("block", "complaint"),
    [
        ({"heights": "grvel"}, r'heights: found "grvel"; allowed: "bumps", "brick", "gravel", .*"noise"'),
        (
            {"heights": {"path": "no.png", "color_space": "linear"}},
            r'heights.path: found the path "no.png", where .* no',
        ),
        ({"heights": {"path": "no.gif", "color_space": "linear"}}, r'heights.path: found the file "no.gif"; allowed'),
        ({"heights": {"path": "no.png"}}, r'color_space: found "srgb" for heights; allowed: "linear"'),
        ({"resolution": 1}, r"resolution: found 1; allowed: an integer >= 2"),
        ({"depth": 0.0}, r"depth: found 0(\.0)?; allowed: a finite number > 0"),
    ],
)
def test_a_block_that_cannot_be_is_refused(
    carved: Callable[..., Scene], block: dict[str, object], complaint: str
) -> None:
    with pytest.raises(SceneError, match=complaint):
        carved(**block)


def test_a_translucent_block_is_refused(make_scene: Callable[..., Scene]) -> None:
    """It has no bottom."""
    jade = {"jade": {"type": "translucent", "medium": "skin1"}}
    with pytest.raises(SceneError, match=r'the translucent material "jade" on what is not closed'):
        make_scene(shapes=[BLOCK_TABLE | {"heights": "noise", "material": "jade"}], subject=["block"], materials=jade)


@pytest.mark.parametrize("columns", [1, 1025])
def test_an_image_of_too_few_or_too_many_heights_is_refused(
    carved: Callable[..., Scene], tmp_path: Path, columns: int
) -> None:
    PIL.Image.fromarray(np.zeros((3, columns), np.uint8)).save(tmp_path / "levels.png")
    with pytest.raises(SceneError, match=rf"levels.png: found {columns} x 3 heights; allowed are 2 to 1024"):
        geometry_of(carved(heights={"path": "levels.png", "color_space": "linear"}))


def test_the_ramp_in_the_corner_of_the_woven_block_rises_along_u() -> None:
    """An image that were mirrored, turned or decoded as a colour would have it elsewhere or bent."""
    scene = load_scene(LIBRARY / "relief-weave.toml")
    shape = scene.shapes[0]
    assert isinstance(shape, Relief)
    ramp = heights_of(scene, shape)[:16, :32]
    np.testing.assert_allclose(ramp, np.broadcast_to((np.arange(32) + 0.5) / 32, ramp.shape), atol=0.5 / 255 + 1e-7)
