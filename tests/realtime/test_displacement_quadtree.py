"""Displacement by a quadtree of heights: against a march in float64, planes, walls and shadows in closed form."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import map_coordinates

from realtime.camera import sensor_camera
from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass
from realtime.relief import BELOW, grid_to_world, quadtree, relief_gbuffer_pass, view_rays, world_to_grid
from realtime.render import Renderer
from realtime.techniques import displacement_quadtree, technique
from scenes.errors import InputError
from scenes.features import features_of
from scenes.geometry import geometry_of, heights_of
from scenes.image import Float32, Float64
from scenes.model import DirectionalLight, Scene
from scenes.shapes import Relief

MakeScene = Callable[..., Scene]
Draw = Callable[..., Float32]
March = Callable[..., Float64]

UV, RADIANCE = "displacement.quadtree_uv", "displacement.quadtree"


def texels_off(made: Float32, true: Float64) -> Float64:
    """Distance between places of the field (H, W) in samples; infinite where only one of both is there."""
    is_hit, is_drawn = ~np.isnan(true[..., 0]), made.any(axis=-1)
    off = np.linalg.norm(made - np.nan_to_num(true[..., :2]), axis=-1)
    result: Float64 = np.where(is_hit & is_drawn, off, np.where(is_hit == is_drawn, 0.0, np.inf))
    return result


# The quadtree.


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(st.integers(2, 20), st.integers(2, 20)).flatmap(
        lambda shape: arrays(np.float32, shape, elements=st.floats(0, 1, width=32))
    )
)
def test_each_node_is_the_highest_sample_below_it(heights: Float32) -> None:
    levels = quadtree(heights.astype(float))
    rows, columns = (n - 1 for n in heights.shape)
    assert levels[-1].size == 1
    for level, values in enumerate(levels):
        assert values.shape == tuple(max(1, n >> level) for n in levels[0].shape)
        for i, j in np.ndindex(*values.shape):
            y, x = i << level, j << level
            reach = 1 << level
            inside = heights[y : y + reach + 1, x : x + reach + 1] if y < rows and x < columns else np.array([BELOW])
            assert values[i, j] == inside.max()


def test_a_mean_instead_of_the_maximum_would_miss_spikes() -> None:
    """A ray at half its height would pass over every node that held the mean of the four below it."""
    heights = np.zeros((9, 9))
    heights[4, 4] = 1.0
    highest = quadtree(heights)
    mean = highest[0]
    for level in highest[1:]:
        mean = mean.reshape(len(level), 2, len(level), 2).mean(axis=(1, 3))
        assert mean.max() < 0.5
        assert level.max() == 1


# Where rays meet the field.


@pytest.mark.parametrize("field", ["bumps", "brick", "gravel", "steps", "spikes", "noise"])
@pytest.mark.parametrize("view", [0.0, 60.0, 85.0])
def test_hits_are_those_of_a_march(make_relief: MakeScene, draw: Draw, marched: March, field: str, view: float) -> None:
    """A march of 4000 steps may pass over what is thinner than a step: one ray in 576 may differ."""
    scene = make_relief(field, view)
    off = texels_off(draw(scene, UV), marched(scene))
    assert (off > 1e-3).sum() <= 1
    assert np.median(off) < 1e-4


@pytest.mark.parametrize(
    "given",
    [
        {"rotation_deg": [20.0, -35.0, 50.0], "position": [3.0, -2.0, 1.0], "scale": 0.4},
        {"pixels": (40, 12)},
        {"pixels": (2, 2)},
        {"pixels": (1, 1)},
        {"distance": 400.0},
        {"distance": 0.4, "width": 0.4, "view": 30.0},
        {"depth": 0.5},
        {"resolution": 2},
        {"resolution": 3},
        {"resolution": 7},
    ],
    ids=lambda given: ", ".join(f"{key} {value}" for key, value in given.items()),
)
def test_hits_are_right_wherever_the_block_is(
    make_relief: MakeScene, draw: Draw, marched: March, given: dict[str, Any]
) -> None:
    """Turned, long, close, far off, deep, coarse; in images that are not square, or of a pixel."""
    scene = make_relief("noise", **given)
    assert texels_off(draw(scene, UV), marched(scene)).max() < 2e-3


def test_a_block_that_is_not_square(make_relief: MakeScene, draw: Draw, marched: March) -> None:
    """31 x 6 samples over 1.6 x 0.4: none of the quadtree's sides are alike."""
    heights = np.random.default_rng(1).random((6, 31))
    scene = make_relief(heights, 50.0, width=0.6, pixels=(32, 20), size=[1.6, 0.4])
    true = marched(scene)
    assert texels_off(draw(scene, UV), true).max() < 1e-3
    assert (true[..., 0] > 0).mean() > 0.3


@pytest.mark.parametrize("view", [20.0, 60.0, 85.0])
@pytest.mark.parametrize("azimuth", [25.0, 90.0, 200.0])
def test_rays_come_in_through_the_sides(
    make_relief: MakeScene, draw: Draw, marched: March, view: float, azimuth: float
) -> None:
    """The whole block before an empty background: walls from the border down, and the outline of the field."""
    scene = make_relief("gravel", view, azimuth, pixels=(32, 32), width=1.7, depth=0.3)
    true = marched(scene)
    off = texels_off(draw(scene, UV), true)
    assert (off > 1e-3).sum() <= 2
    met = true[~np.isnan(true[..., 0])]
    on_wall = (met[:, :2] < 1e-9) | (met[:, :2] > 63 - 1e-9)
    assert 0.1 < np.isnan(true[..., 0]).mean() < 0.95
    assert view < 60 or on_wall.any(axis=1).mean() > 0.1


def on_plane(scene: Scene, z: float) -> Float64:
    """Where the rays through the pixels' centres meet a plane z of a block that is not turned: (H, W, 2)."""
    sensor = scene.sensor
    eye, half = np.array(sensor.origin), np.tan(np.radians(sensor.fov_deg / 2))
    forward = np.array(sensor.target) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, sensor.up) / np.linalg.norm(np.cross(forward, sensor.up))
    x = half * ((2 * np.arange(sensor.width) + 1) / sensor.width - 1)
    y = half * (sensor.height - 2 * np.arange(sensor.height) - 1) / sensor.width
    d = forward + x[None, :, None] * right + y[:, None, None] * np.cross(right, forward)
    met: Float64 = eye[:2] + (z - eye[2]) / d[..., 2:] * d[..., :2]
    return met


@pytest.mark.parametrize("height", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("view", [0.0, 60.0, 85.0])
def test_flat_fields(make_relief: MakeScene, draw: Draw, height: float, view: float) -> None:
    """A plane; of height 0 it is the bottom, where no box is left."""
    z = -0.1 * (1 - height)
    scene = make_relief(np.full((9, 9), height), view, width=0.05, target=(0.0, 0.0, z))
    np.testing.assert_allclose(draw(scene, UV), 8 * (on_plane(scene, z) + 0.5), atol=1e-5)


def test_a_sensor_in_a_valley_sees_the_hills_around_it(make_relief: MakeScene, draw: Draw, marched: March) -> None:
    """Inside the box that is searched, above the surface."""
    along = np.abs(np.linspace(-1, 1, 33))
    heights = np.maximum(*np.meshgrid(along, along)) ** 2
    target = (0.0, 0.0, -0.07)
    scene = make_relief(heights, 70.0, distance=0.02, width=0.04, target=target)
    true = marched(scene)
    assert -0.1 < scene.sensor.origin[2] < 0
    assert 0.5 < np.isfinite(true[..., 0]).mean() < 1
    assert texels_off(draw(scene, UV), true).max() < 1e-3


def test_a_sensor_inside_the_body_is_refused(make_relief: MakeScene, draw: Draw) -> None:
    scene = make_relief(np.full((4, 4), 0.9), 30.0, distance=0.01, target=(0.0, 0.0, -0.05))
    with pytest.raises(InputError, match="inside the relief 'block'"):
        draw(scene, UV)


@pytest.mark.parametrize("distance", [8.0, 0.05])
@pytest.mark.parametrize("view", [130.0, 155.0, 180.0])
def test_from_below_nothing_is_seen(make_relief: MakeScene, draw: Draw, view: float, distance: float) -> None:
    """The block is open there, also to a sensor less than its depth below it; its walls are seen from outside."""
    scene = make_relief("gravel", view, distance=distance, width=0.3, target=(0.0, 0.0, -0.1))
    assert not draw(scene, UV).any()
    assert not draw(scene, RADIANCE).any()


def test_far_from_the_origin_nothing_changes(make_relief: MakeScene, draw: Draw) -> None:
    here, there = (draw(make_relief(position=[x, 0.0, 0.0]), UV) for x in (0.0, 1e5))
    assert np.quantile(np.linalg.norm(here - there, axis=-1), 0.99) < 0.01


@pytest.mark.parametrize("distance", [0.3, 8.0, 1000.0])
def test_rays_are_those_of_the_camera(make_relief: MakeScene, distance: float) -> None:
    """The ray through a pixel's corner, made for float32, against the inverse of the camera's matrix in float64."""
    scene = make_relief(distance=distance, rotation_deg=[10.0, 20.0, 30.0], position=[1.0, 2.0, 3.0])
    shape = scene.shapes[0]
    assert isinstance(shape, Relief)
    camera = sensor_camera(scene.sensor, 0.1 * distance, 10 * distance)
    to_grid = world_to_grid(shape, (63, 63))
    rays = {
        key: np.float32(value).astype(float) for key, value in view_rays(camera, to_grid, np.array([63, 63, 1])).items()
    }
    across = 0.7 * rays["ray_right"] - 0.4 * rays["ray_up"]
    o, d = rays["ray_anchor"] + across, rays["ray_forward"] + across
    near = np.linalg.inv(camera.matrix) @ [0.7, -0.4, -1.0, 1.0]
    direction = to_grid[:3, :3] @ (near[:3] / near[3] - camera.eye)
    assert np.linalg.norm(np.cross(d, direction)) < 1e-6 * np.linalg.norm(d) * np.linalg.norm(direction)
    way = o - (to_grid @ [*camera.eye, 1.0])[:3]
    aside = way - (way @ direction) / (direction @ direction) * direction
    assert np.linalg.norm(aside) < 1e-5


def test_the_grid_spans_the_block(make_relief: MakeScene) -> None:
    """Its corners, and back again; against the vertices of the mesh that Mitsuba gets."""
    scene = make_relief("noise", resolution=9, rotation_deg=[10.0, 20.0, 30.0], position=[1.0, 2.0, 3.0], scale=0.5)
    shape = scene.shapes[0]
    assert isinstance(shape, Relief)
    to_world = grid_to_world(shape, (8, 8))
    surface = geometry_of(scene)[0].surface
    grid = np.hstack([surface.positions, np.ones((len(surface.positions), 1))]) @ world_to_grid(shape, (8, 8)).T
    np.testing.assert_allclose(grid[:, :2], 8 * surface.uvs, atol=1e-4)
    np.testing.assert_allclose(to_world @ world_to_grid(shape, (8, 8)), np.eye(4), atol=1e-12)


# What they look like.


def test_a_flat_field_is_as_bright_as_lambert_says(make_relief: MakeScene, draw: Draw) -> None:
    light = np.array([-0.5, 0.3, -0.8])
    made = draw(make_relief(np.full((5, 5), 0.5), 40.0, target=(0.0, 0.0, -0.05)), RADIANCE)
    np.testing.assert_allclose(made, 0.5 / np.pi * 2 * 0.8 / np.linalg.norm(light), rtol=1e-5)


def test_walls_are_lit_from_their_side(make_relief: MakeScene, draw: Draw) -> None:
    """Seen along u: a wall under light that goes along -u, and black under light that goes along u."""
    given: dict[str, Any] = {"view": 90.0, "azimuth": 0.0, "width": 0.05, "target": (0.5, 0.0, -0.05)}
    towards, away = (draw(make_relief(np.ones((5, 5)), light=(x, 0.0, 0.0), **given), RADIANCE) for x in (-1.0, 1.0))
    np.testing.assert_allclose(towards, 0.5 / np.pi * 2, rtol=1e-5)
    assert not away.any()


def terrace(count: int = 41) -> Float64:
    """Height 1 for u below a half, height 0 above it, with a cliff one cell wide."""
    return np.tile((np.arange(count) < count // 2).astype(float), (count, 1))


def test_a_terrace_throws_a_shadow_as_long_as_the_light_is_low(make_relief: MakeScene, draw: Draw) -> None:
    """Light that sinks 0.5 a length goes 0.2 far from the upper edge at u = 0.475 until it is 0.1 down."""
    scene = make_relief(
        terrace(), 0.0, 180.0, light=(1.0, 0.0, -0.5), width=1.0, target=(0.0, 0.0, -0.1), pixels=(200, 4)
    )
    lit = draw(scene, RADIANCE)[0, :, 0] > 0
    # On the lower plane, which is at the sensor's target, pixels are 1 / 200 wide.
    u = (np.arange(200) + 0.5) / 200
    shadow = ~lit & (u > 0.5)
    ends = u[shadow].min(), u[shadow].max()
    assert ends[1] == pytest.approx(0.475 + 0.2, abs=0.006)
    assert lit[(u > 0.69) & (u < 0.99)].all()
    open_ = draw(scene, RADIANCE, self_shadow=False)[0, :, 0] > 0
    assert open_[shadow & (u > 0.51)].all()


def shaded(scene: Scene, places: Float64) -> Float64:
    """Radiance (H, W) of places (H, W, 3) on a grid under one sun: shadows by a march in steps of 0.03 samples."""
    shape, sun = scene.shapes[0], scene.emitters[0]
    assert isinstance(shape, Relief)
    assert isinstance(sun, DirectionalLight)
    heights = heights_of(scene, shape)
    last = np.array([heights.shape[1] - 1, heights.shape[0] - 1, 1])
    per_length = last / [*shape.size, shape.depth]
    to_light = -np.array(sun.direction) / np.linalg.norm(sun.direction)
    column, row = (np.minimum(np.floor(places[..., k]).astype(int), last[k] - 1) for k in range(2))
    s, t = places[..., 0] - column, places[..., 1] - row
    h00, h10, h01, h11 = (heights[row + j, column + i] for j in (0, 1) for i in (0, 1))
    slope_u, slope_v = (h10 - h00) * (1 - t) + (h11 - h01) * t, (h01 - h00) * (1 - s) + (h11 - h10) * s
    normals = np.stack([-slope_u, -slope_v, np.ones_like(s)], axis=-1) * per_length
    cosine = normals @ to_light / np.linalg.norm(normals, axis=-1)
    step = to_light * per_length
    step *= 0.03 / np.abs(step[:2]).max()
    start = places + np.array([0, 0, 1e-6])
    is_free = cosine > 0
    for k in range(1, int(np.ceil(1 / step[2])) + 1):
        at = start + k * step
        inside = ((at[..., :2] >= 0) & (at[..., :2] <= last[:2])).all(axis=-1)
        ground = map_coordinates(heights, [at[..., 1], at[..., 0]], order=1, mode="nearest")
        is_free &= ~inside | (at[..., 2] > ground)
    return np.where(is_free, cosine, 0.0) * sun.irradiance[0] * 0.5 / np.pi


@pytest.mark.parametrize("light", [(-0.8, 0.4, -0.4), (-0.8, 0.4, -0.2)], ids=["24 degrees", "13 degrees"])
def test_radiance_is_that_of_marches_to_the_light(
    make_relief: MakeScene, draw: Draw, marched: March, light: tuple[float, float, float]
) -> None:
    """At the same samples: what is left are marches that step over edges."""
    scene = make_relief("gravel", light=light, pixels=(12, 12))
    grid = technique(RADIANCE).grid
    finer = {"width": 12 * grid, "height": 12 * grid}
    places = marched(scene.model_copy(update={"sensor": scene.sensor.model_copy(update=finer)}), 2000)
    true = shaded(scene, places).reshape(12, grid, 12, grid).mean(axis=(1, 3))
    made = draw(scene, RADIANCE)[..., 0]
    assert np.mean((made - true) ** 2) < 2e-4 * np.mean(true**2)
    assert made.mean() == pytest.approx(true.mean(), rel=2e-3)
    unshadowed = draw(scene, RADIANCE, self_shadow=False)[..., 0]
    assert unshadowed.mean() > 1.05 * true.mean()


def test_shadow_rays_begin_on_the_surface_and_above_it(make_relief: MakeScene, draw: Draw) -> None:
    """Without a bias the place itself is in the way; from 2e-6 to 2e-4 depths it does not matter how large it is."""
    scene = make_relief("gravel")
    energy = [float(draw(scene, RADIANCE, shadow_bias=bias).mean()) for bias in (0.0, 2e-6, 2e-5, 2e-4)]
    assert energy[0] < 0.1 * energy[2]
    np.testing.assert_allclose(energy[1:], energy[2], rtol=3e-3)


def test_a_point_light_before_the_field_is_not_hidden_by_what_lies_behind_it(
    make_relief: MakeScene, draw: Draw
) -> None:
    """The light stands between the lower plane and the cliff: seen from the plane, the way to it is free."""
    lamp = {"type": "point", "position": [0.1, 0.0, -0.08], "intensity": [1.0, 1.0, 1.0]}
    scene = make_relief(terrace(), 0.0, width=0.02, target=(0.2, 0.0, -0.1), overrides={"emitters": [lamp]})
    made = draw(scene, RADIANCE)[11:13, 11:13, 0].mean()
    assert made == pytest.approx(0.5 / np.pi * 0.02 / (0.1**2 + 0.02**2) ** 1.5, rel=1e-2)


def test_lights_of_some_size_are_points_that_cast_each(make_relief: MakeScene, draw: Draw) -> None:
    """A disk far off is as bright as the sun that sends the same irradiance."""
    place = 50 * np.array([0.5, -0.3, 0.8]) / np.linalg.norm([0.5, -0.3, 0.8])
    disk = {"type": "disk", "position": list(place), "normal": list(-place), "radius": 0.5}
    disk |= {"radiance": [2 * 50**2 / (np.pi * 0.5**2)] * 3}
    small, sun = draw(make_relief("gravel", overrides={"emitters": [disk]}), RADIANCE), draw(make_relief(), RADIANCE)
    np.testing.assert_allclose(small.mean(), sun.mean(), rtol=0.01)


def test_without_light_it_is_black(make_relief: MakeScene, draw: Draw) -> None:
    assert not draw(make_relief(overrides={"emitters": []}), RADIANCE).any()


# What is refused, and what others draw with.


@pytest.mark.parametrize("name", sorted(displacement_quadtree.TECHNIQUES))
def test_a_scene_without_a_relief_is_refused(make_scene: MakeScene, name: str) -> None:
    with pytest.raises(
        InputError, match=r"Found 1 shape\(s\) in the subject of 'scene' \(sphere\).*exactly one relief"
    ):
        Renderer(make_scene()).render(technique(name), {}, timed=False)


def test_a_sky_is_refused(make_relief: MakeScene, draw: Draw) -> None:
    sky = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
    scene = make_relief(overrides={"emitters": [sky]})
    with pytest.raises(InputError, match="Found a sky"):
        draw(scene, RADIANCE)


def test_a_relief_among_meshes_has_their_depth(make_relief: MakeScene, gl: Any) -> None:
    """A ball half sunk into the block: what both draw as meshes is what is drawn with rays, in front and behind."""
    block = make_relief("noise").shapes[0].model_dump()
    ball = {"name": "ball", "type": "sphere", "radius": 0.08, "detail": 4, "material": "stone"}
    ball |= {"position": [0.0, 0.0, -0.05]}
    scene = make_relief("noise", 50.0, width=0.4, overrides={"shapes": [block, ball]})
    meshes = geometry_of(scene)
    frames = [Frame(gl, scene, meshes, features_of(scene, meshes), {}, 2) for _ in range(2)]
    for frame, step in zip(frames, (gbuffer_pass(), relief_gbuffer_pass()), strict=True):
        step.run(frame)
    mesh, rays = (frame.read("albedo", 4)[..., 3] for frame in frames)
    seen_by_mesh, seen_by_rays = (frame.read("normal", 4)[..., 3] for frame in frames)
    assert 0.05 < 1 - seen_by_mesh.mean() < 0.95  # the ball is no subject
    assert (seen_by_mesh != seen_by_rays).mean() < 0.01
    # The mesh has two flat triangles where the field is bilinear.
    assert np.quantile(np.abs(mesh - rays), 0.99) < 2e-3
    positions = [frame.read("position", 4) for frame in frames]
    assert np.quantile(np.linalg.norm(positions[0] - positions[1], axis=-1), 0.99) < 5e-3
    normals = [frame.read("normal", 4)[..., :3] for frame in frames]
    assert np.quantile(1 - np.sum(normals[0] * normals[1], axis=-1), 0.9) < 0.01


def test_of_two_reliefs_the_nearer_one_is_seen(make_relief: MakeScene, gl: Any) -> None:
    """Whichever is drawn first."""
    near = make_relief("noise").shapes[0].model_dump() | {"position": [0.0, 0.0, 0.2], "size": [0.2, 0.2]}
    far = make_relief("noise").shapes[0].model_dump() | {"name": "far"}
    depths = []
    for shapes in ([near, far], [far, near]):
        scene = make_relief("noise", 20.0, width=0.5, overrides={"shapes": shapes})
        meshes = geometry_of(scene)
        frame = Frame(gl, scene, meshes, features_of(scene, meshes), {}, 1)
        relief_gbuffer_pass().run(frame)
        depths.append(frame.read("albedo", 4)[..., 3])
    np.testing.assert_array_equal(depths[0], depths[1])
    assert 0.05 < (depths[0] < 7.95).mean() < 0.6


def test_reliefs_that_are_not_wanted_are_not_drawn(make_relief: MakeScene, gl: Any) -> None:
    scene = make_relief()
    meshes = geometry_of(scene)
    frame = Frame(gl, scene, meshes, features_of(scene, meshes), {}, 1)
    relief_gbuffer_pass(lambda mesh: False).run(frame)
    assert not frame.read("position", 4).any()
