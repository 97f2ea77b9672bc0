"""The thin lens: circles of confusion in closed form, and views that agree with them."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realtime.camera import Camera, lens_camera, perspective_matrix
from realtime.lens import coc_radius, coc_scale, lens_views, planar_depth, r2_sequence, shifted, vogel_disk
from scenes.image import Float64
from scenes.model import Perspective, ThinLens

depths = st.floats(0.1, 100)


def lens(**changes: Any) -> ThinLens:
    plain = {
        "type": "thin_lens",
        "origin": (0.0, 0.0, 0.0),
        "target": (0.0, 0.0, -1.0),
        "fov_deg": 50.0,
        "width": 160,
        "height": 90,
        "aperture_radius": 0.04,
        "focus_distance": 2.0,
    }
    return ThinLens.model_validate(plain | changes)


def pixel(camera: Camera, point: Float64, sensor: Perspective) -> Float64:
    """Where a point is seen, in pixels from the middle."""
    clip = camera.matrix @ np.append(point, 1.0)
    place: Float64 = clip[:2] / clip[3] / 2 * (sensor.width, sensor.height)
    return place


@given(depths, st.floats(0, 2 * math.pi), st.sampled_from(["x", "y"]))
def test_a_point_seen_from_the_rim_moves_by_its_circle_of_confusion(depth: float, angle: float, axis: str) -> None:
    sensor = lens(fov_axis=axis)
    place = (0.04 * math.cos(angle), 0.04 * math.sin(angle))
    point = np.array([0.3, -0.2, -depth])
    seen, centre = (pixel(lens_camera(sensor, 0.01, 200.0, p), point, sensor) for p in (place, (0.0, 0.0)))
    radius = float(coc_radius(sensor, np.array(depth)))
    np.testing.assert_allclose(seen - centre, radius / 0.04 * np.array(place), atol=1e-9)


def test_the_radius_is_the_one_of_similar_triangles() -> None:
    """At twice the focus distance, rays through the rim are as far from the axis there as on the lens."""
    sensor = lens(fov_deg=90.0)
    assert float(coc_radius(sensor, np.array(4.0))) == pytest.approx(0.04 / 4.0 * 160 / 2)
    assert float(coc_radius(sensor, np.array(2.0))) == 0
    assert float(coc_radius(sensor, np.array(1.0))) == pytest.approx(-0.04 / 2.0 * 160 / 2)


def test_a_pinhole_has_no_circle_of_confusion() -> None:
    pinhole = Perspective(type="perspective", origin=(0, 0, 0), target=(0, 0, -1), fov_deg=50.0)
    assert coc_scale(pinhole) == 0
    assert not coc_radius(pinhole, np.array([0.1, 1.0, 1e9])).any()


def test_focused_at_infinity_blur_depends_on_distance_alone() -> None:
    sensor = lens(focus_distance=1e9)
    np.testing.assert_allclose(
        coc_radius(sensor, np.array([1.0, 2.0, 1e9])), -coc_scale(sensor) / np.array([1, 2, np.inf]), atol=1e-12
    )


@given(st.floats(0.01, 1), st.floats(2, 100), st.floats(0, 1))
def test_the_depth_buffer_gives_the_planar_depth_back(near: float, far: float, part: float) -> None:
    depth = near + part * (far - near)
    clip = perspective_matrix(0.7, 0.4, near, far) @ np.array([0.3 * depth, 0.1, -depth, 1.0])
    stored = np.array(clip[2] / clip[3] / 2 + 0.5)
    assert float(planar_depth(stored, near, far)) == pytest.approx(depth, rel=1e-6)


@pytest.mark.parametrize("bits", [16, 24])
def test_bits_of_depth_limit_the_radius_to_half_a_step(bits: int) -> None:
    """Half a step of K / n / 2^bits px: .3 px at 16 bits with a near plane at a millimetre."""
    sensor, near, far = lens(aperture_radius=0.1, fov_deg=40.0, width=256), 0.001, 10.0
    depth = np.linspace(0.5, 9.5, 20000)
    exact = (1 / near - 1 / depth) / (1 / near - 1 / far)
    stored = np.round(exact * (2**bits - 1)) / (2**bits - 1)
    hit = stored < 1
    error = np.abs(coc_radius(sensor, planar_depth(stored[hit], near, far)) - coc_radius(sensor, depth[hit]))
    assert error.max() == pytest.approx(coc_scale(sensor) / near / 2 ** (bits + 1), rel=0.02)


@pytest.mark.parametrize("count", [16, 100, 1024])
def test_places_on_the_lens_are_spread_as_a_disk_is(count: int) -> None:
    places = vogel_disk(count)
    r2 = np.sum(places**2, axis=1)
    assert r2.max() < 1
    assert r2.mean() == pytest.approx(0.5)
    assert np.abs(places.mean(axis=0)).max() < 0.6 / count**0.75


def edge_error(places: Float64, shifts: Float64, radius: float) -> float:
    """Root mean square error of how much of a pixel straight edges cover, that are `radius` px out of focus."""
    rng = np.random.default_rng(0)
    angle = rng.uniform(0, math.pi, 400)
    normals = np.stack([np.cos(angle), np.sin(angle)])
    offsets = rng.uniform(-1, 1, 400) * (radius + 0.6)
    fine = (np.arange(24) + 0.5) / 24 - 0.5
    square = np.stack(np.meshgrid(fine, fine), axis=-1).reshape(-1, 1, 2)
    truth_points = (square + radius * vogel_disk(96)).reshape(-1, 2)

    def covered(points: Float64) -> Float64:
        shares: Float64 = np.mean(points @ normals < offsets, axis=0)
        return shares

    return float(np.sqrt(np.mean((covered(shifts - 0.5 + radius * places) - covered(truth_points)) ** 2)))


@pytest.mark.parametrize("radius", [0.5, 1.0])
def test_places_on_the_lens_and_in_the_pixel_are_spread_jointly(radius: float) -> None:
    """Shifts in random order leave half as much error again on edges that are nearly in focus."""
    places, shifts = vogel_disk(1024), r2_sequence(1024)
    random = np.random.default_rng(1).permutation(shifts)
    assert edge_error(places, shifts, radius) < 0.8 * edge_error(places, random, radius)


def test_a_camera_is_shifted_by_what_it_is_told() -> None:
    sensor = lens()
    camera = lens_camera(sensor, 0.1, 10.0, (0.0, 0.0))
    point = np.array([0.2, 0.1, -3.0])
    moved = pixel(shifted(camera, 2 * np.array([0.25, -0.5]) / (160, 90)), point, sensor) - pixel(camera, point, sensor)
    np.testing.assert_allclose(moved, (0.25, -0.5), atol=1e-12)


def test_the_views_of_a_lens_scatter_a_point_over_its_disk_and_a_pixel() -> None:
    """Their second moment is that of a disk of the circle of confusion plus that of a pixel."""
    sensor = lens()
    point = np.array([0.0, 0.0, -5.0])
    places = np.array([pixel(camera, point, sensor) for camera in lens_views(sensor, 0.1, 10.0, 512)])
    radius = float(coc_radius(sensor, np.array(5.0)))
    np.testing.assert_allclose(places.mean(axis=0), 0, atol=0.02)
    assert np.mean(np.sum(places**2, axis=1)) == pytest.approx(radius**2 / 2 + 2 / 12, rel=0.01)


def test_a_sharp_point_stays_in_its_pixel_in_all_views() -> None:
    sensor = lens()
    point = np.array([0.3, 0.1, -2.0])
    places = np.array([pixel(camera, point, sensor) for camera in lens_views(sensor, 0.1, 10.0, 64)])
    middle = pixel(lens_camera(sensor, 0.1, 10.0, (0.0, 0.0)), point, sensor)
    assert np.abs(places - middle).max() <= 0.5 + 1e-9


@pytest.mark.parametrize("depth", [0.2, 1.0, 9.0])
def test_clip_planes_are_the_same_in_all_views(depth: float) -> None:
    point = np.array([0.1, 0.0, -depth, 1.0])
    clips = [camera.matrix @ point for camera in lens_views(lens(), 0.1, 10.0, 16)]
    np.testing.assert_allclose([c[2] / c[3] for c in clips], clips[0][2] / clips[0][3], rtol=1e-12)
