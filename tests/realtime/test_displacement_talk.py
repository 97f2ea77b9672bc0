"""The talk's march through a volume of distances, and its rival: against a march in float64, and on planes."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime.relief_polygons import sample_normals
from realtime.relief_volume import TEXTURE_SPACE, cubic, signed_distances, voxel_distances
from realtime.render import Rendering
from realtime.shader import GLSL
from realtime.techniques import displacement_parallax, displacement_talk
from scenes.errors import InputError
from scenes.image import Float32, Float64
from scenes.model import Scene

MakeScene = Callable[..., Scene]
Draw = Callable[..., Float32]
March = Callable[..., Float64]

TALK, PARALLAX = "displacement.talk_uv", "displacement.parallax_uv"
EXTENT = (1.0, 0.6, 0.1)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7800)


# The volume.


@pytest.mark.parametrize("metric", [TEXTURE_SPACE, (5.0, 4.0, 4.0), (1.0, 0.6, 0.1)])
def test_voxels_are_as_far_as_the_nearest_solid_one(
    rng: np.random.Generator, metric: tuple[float, float, float]
) -> None:
    """Against all pairs of voxels."""
    heights, slices = rng.random((5, 6)), 4
    made = voxel_distances(heights, slices, metric)
    k, j, i = np.meshgrid(np.arange(4), np.arange(5), np.arange(6), indexing="ij")
    points = np.stack([(k + 0.5) / slices, j / 4, i / 5], axis=-1)
    solid = points[(points[..., 0] <= heights) | (k == 0)]
    exact = np.linalg.norm((points[..., None, :] - solid) * metric[::-1], axis=-1).min(axis=-1)
    np.testing.assert_allclose(made.values, exact, atol=1e-12)
    assert made.metric == metric


def test_beside_a_wall_cubic_voxels_count_columns_and_slices() -> None:
    """A wall at u = 0 of 9 x 33 columns and 8 slices: as far as the wall or the floor, whichever is nearer."""
    heights = np.zeros((9, 33))
    heights[:, 0] = 1
    made = voxel_distances(heights, 8, cubic(heights, 8))
    slices, columns = np.ogrid[:8, :33]
    np.testing.assert_allclose(made.values[:, 4], np.minimum(columns, slices))
    unit = voxel_distances(heights, 8)
    np.testing.assert_allclose(unit.values[:, 4], np.minimum(columns / 32, slices / 8))


def test_cliffs_have_no_holes() -> None:
    """Half-way up, nodes on both sides of a cliff are a sample's width from it.

    From the ends of the columns, which are all that point samples know, it would be four to five times as much.
    """
    heights = np.tile([0.0, 0.0, 1.0, 1.0], (4, 1))
    values = signed_distances(heights, 9, (0.03, 0.03, 0.1)).values
    np.testing.assert_allclose(values[1:-1, 2, 1:3], np.broadcast_to([0.01, -0.01], (7, 2)))


def test_the_bottom_slice_is_solid() -> None:
    """Of height 0 no voxel's middle is in the surface: without a floor there would be nothing to be far from."""
    made = voxel_distances(np.zeros((3, 3)), 8)
    np.testing.assert_allclose(made.values[:, 1, 1], np.arange(8) / 8)


def test_distances_of_voxels_end_half_a_voxel_inside_the_surface() -> None:
    """On average over heights of eight voxels; where they end is the middle of one."""
    depths = []
    for height in np.linspace(0.25, 0.75, 256, endpoint=False):
        values = voxel_distances(np.full((2, 2), height), 16).values[:, 0, 0]
        depths.append(height - (np.flatnonzero(values == 0).max() + 0.5) / 16)
    assert np.mean(depths) == pytest.approx(0.5 / 16, rel=0.1)


def test_signed_distances_are_those_to_columns_of_solid_and_of_air(rng: np.random.Generator) -> None:
    """Against all columns, which end at the heights themselves; the nearest voxel's may be the second nearest."""
    heights, slices = rng.random((9, 8)), 17
    made = signed_distances(heights, slices, EXTENT)
    step = np.array([EXTENT[2] / 16, EXTENT[1] / 8, EXTENT[0] / 7])
    k, j, i = np.meshgrid(np.arange(17), np.arange(9), np.arange(8), indexing="ij")
    flat = np.hypot(step[1] * (j[..., None, None] - j[0]), step[2] * (i[..., None, None] - i[0]))
    over = EXTENT[2] * (k / 16)[..., None, None] - EXTENT[2] * heights
    outside = np.hypot(flat, np.maximum(over, 0)).min(axis=(-2, -1))
    inside = np.hypot(flat, np.maximum(-over, 0)).min(axis=(-2, -1))
    exact = np.where(k / 16 > heights, outside, -inside)
    assert (made.values - exact > -1e-12)[exact > 0].all()
    assert (np.abs(made.values - exact) < 1e-12).mean() > 0.9
    assert np.abs(made.values - exact).max() < step[0]


def test_a_plane_has_its_height_as_signed_distance() -> None:
    """On both sides, whatever lies between two slices; also for a field that leaves no air in the block."""
    for height in (0.0, 0.37, 1.0):
        values = signed_distances(np.full((4, 4), height), 9, EXTENT).values[:, 2, 2]
        np.testing.assert_allclose(values, EXTENT[2] * (np.linspace(0, 1, 9) - height), atol=1e-15)


# The march.


def off(made: Float32, true: Float64) -> Float64:
    """Distance (H, W) between places of the field, in samples."""
    assert not np.isnan(true).any()
    distance: Float64 = np.linalg.norm(made - true[..., :2], axis=-1)
    return distance


def test_seen_straight_on_everything_is_where_it_is(make_relief: MakeScene, draw: Draw, marched: March) -> None:
    scene = make_relief("gravel", 0.0)
    true = marched(scene)
    assert off(draw(scene, PARALLAX), true).max() < 0.1
    assert off(draw(scene, TALK, distances="signed"), true).max() < 0.1


@pytest.mark.parametrize("view", [30.0, 60.0, 80.0])
def test_on_a_plane_each_step_leaves_a_fixed_part_of_the_way(make_relief: MakeScene, draw: Draw, view: float) -> None:
    """A step is as long as the plane is far, and sinks by the cosine of that: what is left shrinks by 1 - cos."""
    scene = make_relief(np.full((17, 17), 0.25), view, 0.0, width=1e-4)
    made = draw(scene, TALK, distances="signed", iterations=5, slices=16, format="r32f")[12, 12]
    sunk = (1 - 0.25) * (1 - (1 - np.cos(np.radians(view))) ** 5)
    expected = [16 * (0.5 - 0.1 * sunk * np.tan(np.radians(view))), 8]
    np.testing.assert_allclose(made, expected, atol=0.02)


@pytest.mark.parametrize(("distances", "metric"), [("voxels", (1, 1)), ("cubic", (16, 8))])
def test_through_voxels_too_steps_are_as_long_as_their_distances(
    make_relief: MakeScene, draw: Draw, distances: str, metric: tuple[int, int]
) -> None:
    """A plane whose highest solid slice of 8 has its middle at 3 / 16, and 17 samples: a march in closed form."""
    scene = make_relief(np.full((17, 17), 0.25), 60.0, 0.0, width=1e-4)
    made = draw(scene, TALK, distances=distances, iterations=5, slices=8, format="r32f")[12, 12]
    along, down = np.sin(np.radians(60)), np.cos(np.radians(60)) / 0.1
    z = 1.0
    for _ in range(5):
        # Above the middle of the topmost slice lookups are clamped.
        z -= (min(z, 15 / 16) - 3 / 16) * metric[1] * down / np.hypot(metric[0] * along, metric[1] * down)
    np.testing.assert_allclose(made, [16 * (0.5 - (1 - z) * along / down), 8], atol=0.02)


def test_sixteen_iterations_do_not_suffice_and_more_overshoot(
    make_relief: MakeScene, draw: Draw, marched: March
) -> None:
    """With more of them what is wrong grows again for the voxels, and shrinks for signed distances.

    Cubic voxels have longer steps: 8 of them get farther, and 16 overshoot already.
    """
    scene = make_relief("gravel", 60.0, resolution=128, depth=0.2, pixels=(32, 32))
    true = marched(scene)

    def wrong(**settings: Any) -> float:
        return float((off(draw(scene, TALK, **settings), true) > 1).mean())

    few, many, too_many = (wrong(iterations=n) for n in (16, 32, 96))
    assert 0.2 < few < 0.6
    assert many < few
    assert too_many > many
    cubes = [wrong(distances="cubic", iterations=n) for n in (8, 16, 32)]
    assert cubes[0] < wrong(iterations=8) - 0.2
    assert cubes[1] < cubes[2]
    signed = [wrong(distances="signed", iterations=n) for n in (8, 16, 32, 64)]
    assert signed == sorted(signed, reverse=True)
    assert signed[-1] < 0.06
    assert float((off(draw(scene, PARALLAX), true) > 1).mean()) > 0.8


def test_eight_bits_lose_what_half_precision_keeps(make_relief: MakeScene, draw: Draw) -> None:
    scene = make_relief("gravel", 75.0, resolution=128, depth=0.2)
    exact, half, byte = (draw(scene, TALK, distances="signed", iterations=64, format=f) for f in ("r32f", "r16f", "r8"))
    lost = [float(np.quantile(np.linalg.norm(made - exact, axis=-1), 0.9)) for made in (half, byte)]
    assert lost[0] < 0.05
    assert lost[1] > 2 * lost[0]


def test_rays_do_not_come_back_on_the_other_side(make_relief: MakeScene, draw: Draw) -> None:
    """Beyond the far border lookups are clamped, not repeated: the march shows the border, or nothing if told so."""
    scene = make_relief(np.full((9, 9), 0.1), 70.0, 180.0, width=0.02, target=(0.45, 0.0, 0.0))
    np.testing.assert_allclose(draw(scene, TALK)[12, 12], [8, 4], atol=0.1)
    assert not draw(scene, TALK, border="discard").any()


def test_rays_that_come_in_through_a_side_march_too(make_relief: MakeScene, draw: Draw, marched: March) -> None:
    scene = make_relief("noise", 85.0, 0.0, width=0.02, target=(0.5, 0.0, -0.02))
    true = marched(scene)
    made = draw(scene, TALK, distances="signed", iterations=128)
    assert (true[..., 0] < 62.9).mean() > 0.5
    assert np.median(off(made, true)) < 0.5


def test_walls_are_flat_and_show_their_border(make_relief: MakeScene, draw: Draw) -> None:
    given: dict[str, Any] = {"view": 90.0, "azimuth": 0.0, "width": 0.02, "target": (0.5, 0.0, -0.07)}
    scene = make_relief(np.full((9, 9), 0.9), light=(-1.0, 0.0, 0.0), **given)
    for name in (TALK, PARALLAX):
        np.testing.assert_allclose(draw(scene, name)[..., 0], 8, atol=1e-5)
    for name in ("displacement.talk", "displacement.parallax"):
        np.testing.assert_allclose(draw(scene, name), 0.5 / np.pi * 2, rtol=1e-5)


@pytest.mark.parametrize("view", [0.0, 40.0, 70.0])
def test_parallax_mapping_is_exact_on_planes(make_relief: MakeScene, draw: Draw, marched: March, view: float) -> None:
    scene = make_relief(np.full((17, 17), 0.3), view, width=0.1)
    assert off(draw(scene, PARALLAX), marched(scene)).max() < 1e-2


def test_parallax_mapping_holds_where_the_displacement_is_small(
    make_relief: MakeScene, draw: Draw, marched: March
) -> None:
    """Depth times tan(angle) of 0.5 and of 9 samples, on smooth bumps."""
    gentle, steep = (make_relief("bumps", 60.0, depth=depth) for depth in (0.005, 0.1))
    assert np.quantile(off(draw(gentle, PARALLAX), marched(gentle)), 0.99) < 0.1
    assert np.median(off(draw(steep, PARALLAX), marched(steep))) > 1


def test_the_eye_vector_is_off_between_the_corners_of_a_polygon_seen_from_close(
    make_relief: MakeScene, draw: Draw, marched: March
) -> None:
    """As published it is normalised at the corners. From afar that does not matter."""
    median = {}
    for distance in (0.3, 30.0):
        scene = make_relief(np.full((65, 65), 0.5), 40.0, distance=distance, width=0.2, target=(0.2, 0.1, 0.0))
        median[distance] = np.median(off(draw(scene, TALK, distances="signed", iterations=128), marched(scene)))
    assert median[30.0] < 0.05
    assert median[0.3] > 5 * median[30.0]


def test_lookups_by_displaced_coordinates_name_their_level() -> None:
    """Those of neighbouring pixels may lie far apart, and a level by their derivatives would be a mean of both."""
    for file in GLSL.glob("displacement/*"):
        assert not re.search(r"\btexture\(", file.read_text(encoding="utf-8")), file.name


# Light.


def test_normals_are_those_of_the_field() -> None:
    """A plane that rises by 0.02 of the depth along u and falls by 0.01 along v with each sample."""
    v, u = np.mgrid[0:6, 0:9]
    normals = sample_normals(0.4 + 0.02 * u - 0.01 * v, (2.0, 1.0, 0.5))
    exact = np.array([-0.02 * 0.5 / (2 / 8), 0.01 * 0.5 / (1 / 5), 1.0])
    np.testing.assert_allclose(normals, np.broadcast_to(exact / np.linalg.norm(exact), normals.shape), atol=1e-6)


@pytest.mark.parametrize("name", ["displacement.talk", "displacement.parallax"])
def test_simple_lighting_is_lambert_without_shadows(make_relief: MakeScene, draw: Draw, name: str) -> None:
    """On a plane that is tilted in its block, in a block that is turned in the world."""
    u = np.tile(np.linspace(0.2, 0.8, 17), (17, 1))
    normal = np.array([-0.6 * 0.1, 0.0, 1.0]) / np.hypot(0.06, 1)
    scene = make_relief(u, 30.0, light=(0.6, 0.0, -0.3), rotation_deg=[30.0, 40.0, 50.0], scale=0.7)
    light = np.array([-0.6, 0.0, 0.3]) / np.hypot(0.6, 0.3)
    np.testing.assert_allclose(draw(scene, name), 2 * 0.5 / np.pi * (normal @ light), rtol=1e-4)
    cliff = np.tile((np.arange(17) < 8).astype(float), (17, 1))
    behind = make_relief(cliff, 0.0, light=(1.0, 0.0, -0.3), width=0.02, target=(0.1, 0.0, 0.0))
    assert draw(behind, name).min() > 0
    assert not draw(behind, "displacement.quadtree").any()


def test_without_light_it_is_black(make_relief: MakeScene, draw: Draw) -> None:
    scene = make_relief(overrides={"emitters": []})
    for name in ("displacement.talk", "displacement.parallax"):
        assert not draw(scene, name).any()


def test_the_volume_is_made_once(make_relief: MakeScene, render: Callable[..., Rendering]) -> None:
    assert "distance volume" in render(make_relief(), "displacement.talk").baked_seconds


@pytest.mark.parametrize("name", sorted(displacement_talk.TECHNIQUES | displacement_parallax.TECHNIQUES))
def test_a_scene_without_a_relief_is_refused(make_scene: MakeScene, draw: Draw, name: str) -> None:
    with pytest.raises(InputError, match="exactly one relief"):
        draw(make_scene(), name)


@pytest.mark.parametrize("name", ["displacement.talk", "displacement.parallax"])
def test_a_sky_is_refused(make_relief: MakeScene, draw: Draw, name: str) -> None:
    sky = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
    with pytest.raises(InputError, match="Found a sky"):
        draw(make_relief(overrides={"emitters": [sky]}), name)


@pytest.mark.parametrize("name", [TALK, "displacement.talk", PARALLAX, "displacement.parallax"])
def test_a_sensor_inside_the_box_is_refused(make_relief: MakeScene, draw: Draw, name: str) -> None:
    """Also above the surface: polygons that face away are not drawn, and nothing would be seen."""
    scene = make_relief(np.full((4, 4), 0.2), 30.0, distance=0.01, target=(0.0, 0.0, -0.05))
    with pytest.raises(InputError, match="inside the box of the relief 'block'"):
        draw(scene, name)


def test_an_unknown_choice_is_refused_with_the_known_ones(make_relief: MakeScene, draw: Draw) -> None:
    with pytest.raises(InputError, match=r"allowed: 'voxels', 'cubic', 'signed'\."):
        draw(make_relief(), TALK, distances="unsigned")
