"""Hair at rest: guides, what is between them, and what control textures do."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator

from scenes.errors import SceneError
from scenes.exr import write_exr
from scenes.geometry import geometry_of
from scenes.grooming import film_uv, groom, lookup, rooted_faces, shape_at
from scenes.image import Float32, Float64, Image
from scenes.model import Scene
from scenes.procedural import rectangle

MakeScene = Callable[..., Scene]
HAIR: dict[str, Any] = {
    "name": "fur",
    "on": "limb",
    "material": "fibre",
    "count": 4000,
    "guides": 5,
    "length": 6.0,
    "radius": 0.05,
    "region": [0.0, 0.2, 1.0, 0.8],
    "comb": [0.3, 0.6],
}
LIMB = {"name": "limb", "type": "limb", "material": "skin", "radius": 10.0, "length": 60.0, "detail": 16}
MATERIALS = {
    "skin": {"type": "diffuse", "reflectance": [0.5, 0.4, 0.3]},
    "fibre": {"type": "fibre", "sigma_a": [0.1, 0.2, 0.3]},
}


@pytest.fixture
def hairy(make_scene: MakeScene) -> MakeScene:
    """Makes a limb with hair, some keys of the hair replaced."""

    def make(shape: dict[str, Any] | None = None, **changes: Any) -> Scene:
        shapes = [LIMB | (shape or {})]
        return make_scene(subject=["limb"], materials=MATERIALS, shapes=shapes, hair=[HAIR | changes])

    return make


def texture(folder: Path, values: Any) -> dict[str, str]:
    """A grey texture (H, W), row 0 at the top."""
    pixels: Float32 = np.repeat(np.asarray(values, dtype=np.float32)[:, :, None], 3, axis=2)
    write_exr(folder / "control.exr", Image(pixels))
    return {"path": "control.exr", "color_space": "linear"}


def lengths(points: Float64) -> Float64:
    """From root to tip in a straight line."""
    return np.asarray(np.linalg.norm(points[:, 3] - points[:, 0], axis=1))


def test_the_same_seed_grows_the_same_hair(hairy: MakeScene) -> None:
    one, same, other = (groom(scene, scene.hair[0]) for scene in (hairy(), hairy(), hairy(seed=1)))
    np.testing.assert_array_equal(one.shape, same.shape)
    assert not np.isclose(one.uv, other.uv).any(axis=1).all()
    low, high = one.uv.min(axis=0), one.uv.max(axis=0)
    np.testing.assert_allclose([*low, *high], [0, 0.2, 1, 0.8], atol=2e-3)


def test_roots_are_spread_evenly_over_the_region(hairy: MakeScene) -> None:
    """In sixteen parts of it the counts differ by what chance allows: chi-squared with 15 degrees of freedom."""
    scene = hairy()
    uv = groom(scene, scene.hair[0]).uv
    counts, _, _ = np.histogram2d(uv[:, 0], uv[:, 1], bins=4, range=[[0, 1], [0.2, 0.8]])
    assert np.sum((counts - 250) ** 2 / 250) < 37.7  # exceeded once in a thousand


def test_a_hair_rooted_where_a_guide_is_is_that_guide(hairy: MakeScene) -> None:
    scene = hairy()
    grown = groom(scene, scene.hair[0])
    np.testing.assert_allclose(shape_at(scene, scene.hair[0], grown.guide_uv), grown.guides, atol=1e-12)


def test_between_guides_hair_is_bilinear(hairy: MakeScene) -> None:
    scene = hairy()
    grown = groom(scene, scene.hair[0])
    grid = grown.guides.reshape(5, 5, 4, 3)
    uv = np.array([[0.25 * (1 + 0.3), 0.2 + 0.15 * (2 + 0.6)]])
    expected = 0.4 * (0.7 * grid[2, 1] + 0.3 * grid[2, 2]) + 0.6 * (0.7 * grid[3, 1] + 0.3 * grid[3, 2])
    np.testing.assert_allclose(shape_at(scene, scene.hair[0], uv)[0], expected, atol=1e-12)


def test_every_hair_is_the_guides_around_its_own_root(hairy: MakeScene, tmp_path: Path) -> None:
    """Scipy's interpolation on the grid of guides, curl in closed form, lengths interpolated over texels by hand.

    Both sides of a comparison take hair in the frames of its roots from here: this is what holds it.
    """
    scene = hairy(curl=0.1, length_map=texture(tmp_path, [[0.4, 0.8]]))
    grown = groom(scene, scene.hair[0])
    (u, v), along = grown.uv.T, np.linspace(0, 1, 5)
    between = RegularGridInterpolator((0.2 + 0.6 * along, along), grown.guides.reshape(5, 5, 12))(
        np.column_stack([v, u])
    ).reshape(-1, 4, 3)
    for k in range(4):
        angle = 2 * np.pi * (13 * u + 8 * (v - 0.2) / 0.6 + k / 3)
        between[:, k, :2] += 0.1 * 6.0 * k / 3 * np.column_stack([np.cos(angle), np.sin(angle)])
    length = 0.6 + 0.2 * np.interp(u, [0, 0.25, 0.75, 1], [0, -1, 1, 0])  # texels' centres, and the texture repeats
    np.testing.assert_allclose(grown.shape, length[:, None, None] * between, atol=1e-6)


def test_without_spread_and_comb_hair_stands_straight(hairy: MakeScene) -> None:
    scene = hairy(spread=0.0, comb=[0.0, 0.0])
    points = groom(scene, scene.hair[0]).shape
    np.testing.assert_allclose(points, np.broadcast_to([[0, 0, 0], [0, 0, 2], [0, 0, 4], [0, 0, 6]], points.shape))


def test_the_comb_says_where_tips_point(hairy: MakeScene) -> None:
    """The last third of a hair lies along (comb, 1)."""
    scene = hairy(spread=0.0)
    points = groom(scene, scene.hair[0]).shape
    last = points[:, 3] - points[:, 2]
    np.testing.assert_allclose(last / last[:, 2:], np.broadcast_to([0.3, 0.6, 1.0], last.shape), atol=1e-12)


def test_curl_moves_tips_in_the_plane_of_the_skin(hairy: MakeScene) -> None:
    scene = hairy(curl=0.2)
    grown = groom(scene, scene.hair[0])
    straight = hairy()
    offset = grown.shape - groom(straight, straight.hair[0]).shape
    np.testing.assert_array_equal(offset[:, 0], 0)
    np.testing.assert_allclose(np.linalg.norm(offset[:, 3], axis=1), 0.2 * 6.0)
    np.testing.assert_allclose(offset[:, :, 2], 0, atol=1e-12)


def test_density_is_a_probability(hairy: MakeScene, tmp_path: Path) -> None:
    """A quarter of 4000 hairs, within four standard deviations."""
    scene = hairy(density=texture(tmp_path, [[0.25]]))
    assert len(groom(scene, scene.hair[0]).uv) == pytest.approx(1000, abs=4 * np.sqrt(4000 * 0.25 * 0.75))


def test_kill_takes_hair_away_where_it_is_above_a_half(hairy: MakeScene, tmp_path: Path) -> None:
    """Two texels side by side: from u = 0.25 to 0.75 the texture goes from 0 to 1, and back where it repeats."""
    scene = hairy(kill=texture(tmp_path, [[0.0, 1.0]]))
    uv = groom(scene, scene.hair[0]).uv
    assert uv[:, 0].max() <= 0.5
    assert len(uv) == pytest.approx(2000, abs=4 * np.sqrt(1000))


def test_where_all_hair_is_killed_none_grows(hairy: MakeScene, tmp_path: Path) -> None:
    scene = hairy(kill=texture(tmp_path, [[1.0]]))
    with pytest.raises(SceneError, match=r'hair "fur": of 4000 hairs the density and kill textures leave none'):
        groom(scene, scene.hair[0])


def test_the_length_texture_scales(hairy: MakeScene, tmp_path: Path) -> None:
    scene, full = hairy(length_map=texture(tmp_path, [[0.5]]), curl=0.1), hairy(curl=0.1)
    half = groom(scene, scene.hair[0])
    np.testing.assert_allclose(lengths(half.shape), 0.5 * lengths(groom(full, full.hair[0]).shape))


def test_the_colour_texture_is_looked_up_at_the_root(hairy: MakeScene, tmp_path: Path) -> None:
    scene = hairy(color=texture(tmp_path, [[0.2, 0.8]]))
    grown = groom(scene, scene.hair[0])
    middle = np.abs(grown.uv[:, 0] - 0.5) < 0.2
    expected = 0.2 + 0.6 * (grown.uv[middle, 0] * 2 - 0.5)
    np.testing.assert_allclose(grown.color[middle], np.repeat(expected[:, None], 3, axis=1), atol=1e-6)


@given(st.integers(0, 3), st.integers(0, 2), st.integers(-2, 2), st.integers(-2, 2))
def test_a_texture_has_its_values_at_the_centres_of_texels_and_repeats(column: int, row: int, i: int, j: int) -> None:
    values = np.random.default_rng(0).random((3, 4, 2)).astype(np.float32)
    uv = np.array([[(column + 0.5) / 4 + i, 1 - (row + 0.5) / 3 + j]])
    np.testing.assert_allclose(lookup(values, uv)[0], values[row, column], rtol=1e-6)


def test_an_image_over_the_chart_spans_the_region(hairy: MakeScene) -> None:
    scene = hairy()
    uv, mirrored = film_uv(scene.shapes[0], scene.hair[0], 4, 3)
    np.testing.assert_allclose(uv[0], [0.125, 0.7])  # the upper left pixel
    np.testing.assert_allclose(uv[-1], [0.875, 0.3])
    assert not mirrored.any()


def test_an_image_over_a_mirrored_chart_has_both_copies_side_by_side(hairy: MakeScene) -> None:
    scene = hairy(shape={"chart": "mirrored"})
    uv, mirrored = film_uv(scene.shapes[0], scene.hair[0], 8, 1)
    np.testing.assert_allclose(uv[:, 0], np.tile([0.125, 0.375, 0.625, 0.875], 2))
    np.testing.assert_array_equal(mirrored, np.repeat([False, True], 4))


def test_faces_without_area_in_the_chart_are_refused(hairy: MakeScene) -> None:
    scene = hairy()
    flat = replace(rectangle((1.0, 1.0)), uvs=np.zeros((4, 2), dtype=np.float32))
    with pytest.raises(SceneError, match=r'shape "limb": 2 of 2 faces have no area in \(u, v\)'):
        rooted_faces(scene.shapes[0], flat)


def test_the_seam_of_a_sphere_holds_no_hair(make_scene: MakeScene) -> None:
    """Its faces run backwards through the whole texture; all others together cover nearly all of it."""
    scene = make_scene()
    shape, surface = scene.shapes[1], geometry_of(scene)[-1].surface
    held = rooted_faces(shape, surface)
    corners = surface.uvs[surface.faces[held]].astype(np.float64)
    (du1, dv1), (du2, dv2) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    doubled_area = du1 * dv2 - du2 * dv1
    assert (doubled_area > 0).all()
    assert 0.5 * doubled_area.sum() == pytest.approx(1, abs=0.1)
    assert 0 < np.count_nonzero(~held) < 0.1 * len(held)


@pytest.mark.parametrize(
    ("shape", "changes", "said"),
    [
        ({}, {"on": "lamb"}, r'the unknown shape "lamb" \(did you mean "limb"\?\)'),
        ({}, {"material": "fibbre"}, r'the unknown material "fibbre" \(did you mean "fibre"\?\)'),
        ({}, {"material": "skin"}, r'the diffuse material "skin"; allowed: a fibre'),
        ({"material": "fibre"}, {}, r'the fibre "fibre" on a shape; allowed: any other material'),
        ({}, {"region": [0.2, 0.2, 0.2, 0.8]}, r"the region \[0.2, 0.2, 0.2, 0.8\] without an area"),
        ({}, {"kill": {"path": "gone.png", "color_space": "linear"}}, r'the path "gone.png", where there is no file'),
        ({}, {"density": {"path": "gone.png"}}, r'"srgb" for parts and factors; allowed: "linear"'),
        ({}, {"color": {"path": "gone.exr"}}, r'"srgb" for the EXR "gone.exr"'),
    ],
)
def test_hair_that_does_not_fit_is_said(
    hairy: MakeScene, shape: dict[str, Any], changes: dict[str, Any], said: str
) -> None:
    with pytest.raises(SceneError, match=said):
        hairy(shape=shape, **changes)


def test_hair_grows_on_shapes_that_are_unwrapped(make_scene: MakeScene) -> None:
    torus = {"name": "ring", "type": "torus", "material": "skin", "radius": 2.0, "tube": 0.5}
    with pytest.raises(SceneError, match=r'found "ring", a shape of the type "torus"; allowed: shapes of sphere'):
        make_scene(subject=["ring"], materials=MATERIALS, shapes=[torus], hair=[HAIR | {"on": "ring"}])


def test_hair_has_names_of_its_own(make_scene: MakeScene) -> None:
    with pytest.raises(SceneError, match=r'the hair "fur" a second time'):
        make_scene(subject=["limb"], materials=MATERIALS, shapes=[LIMB], hair=[HAIR, HAIR])
