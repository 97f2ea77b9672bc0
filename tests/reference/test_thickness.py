"""Thickness against closed forms, and against exact rays through the same triangles."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reference.estimator import Reference
from reference.eye_rays import camera_rays
from reference.stage import pixel_grid
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.model import PIXEL_GRID, Scene

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]

SENSOR = {
    "type": "perspective",
    "origin": [0.0, 0.0, 120.0],
    "target": [0.0, 0.0, 0.0],
    "fov_deg": 6.0,
    "width": 12,
    "height": 12,
}
"""As in a scene of mm: a view of 12.6 from a distance of 120."""

BODY = {"name": "ball", "material": "skin"}
BALL = BODY | {"type": "sphere", "radius": 6.0}


@pytest.fixture
def thickness(make_scene: MakeScene, reference: MakeReference) -> Callable[..., Float64]:
    """The image (H, W) of some shapes, all of them the subject."""

    def render(*shapes: dict[str, Any], **overrides: Any) -> Float64:
        subject = [shape["name"] for shape in shapes]
        scene = make_scene(**{"sensor": SENSOR, "shapes": shapes, "subject": subject, "emitters": []} | overrides)
        truth = reference(scene).truth("thickness", 64)
        assert truth.is_exact
        assert truth.mask.all()
        found: Float64 = truth.accumulators[0, ..., 0].astype(np.float64)
        return found

    return render


def rays(scene_sensor: Any) -> tuple[Float64, Float64]:
    """Origin (3,) and directions (R, 3) of all rays of an image, pixel after pixel."""
    x, y = pixel_grid(scene_sensor.width, range(scene_sensor.height), PIXEL_GRID)
    return camera_rays(scene_sensor, x.astype(np.float64), y.astype(np.float64))


def pixel_means(values: Float64, sensor: Any) -> Float64:
    means: Float64 = values.reshape(sensor.height, sensor.width, PIXEL_GRID**2).mean(axis=2)
    return means


def exact_length(surface: Surface, origin: Float64, direction: Float64) -> Float64:
    """Length of rays inside a closed mesh, in float64: the sum of -sign(d.n) t over all triangles that are crossed.

    Möller and Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection".
    """
    corners = surface.positions.astype(np.float64)[surface.faces]
    total = np.zeros(len(direction))
    for a, b, c in corners:
        e1, e2 = b - a, c - a
        p = np.cross(direction, e2)
        det = p @ e1
        s = origin - a
        q = np.cross(s, e1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, t = p @ s / det, direction @ q / det, e2 @ q / det
            crossed = (u >= 0) & (v >= 0) & (u + v <= 1)
        total -= np.where(crossed, np.sign(det) * t, 0.0)
    return total


SHAPES: dict[str, list[dict[str, Any]]] = {
    "sphere": [BALL | {"detail": 2}],
    "box": [BODY | {"type": "box", "size": [7.0, 5.0, 6.0], "rotation_deg": [25.0, 40.0, 10.0]}],
    "knot": [BODY | {"type": "torus_knot", "radius": 4.0, "tube": 0.9, "segments": 48, "sides": 8}],
    "torus": [BODY | {"type": "torus", "radius": 4.0, "tube": 1.5, "segments": 40, "sides": 12}],
    "fingers": [
        BODY | {"type": "capsule", "radius": 2.0, "length": 5.0, "detail": 16},
        BALL | {"name": "other", "radius": 1.5, "detail": 1, "position": [0.5, 0.5, -6.0]},
    ],
}


@pytest.mark.parametrize("name", SHAPES)
def test_all_layers_of_any_shape(name: str, make_scene: MakeScene, reference: MakeReference) -> None:
    shapes = SHAPES[name]
    scene = make_scene(sensor=SENSOR, shapes=shapes, subject=[shape["name"] for shape in shapes], emitters=[])
    origin, direction = rays(scene.sensor)
    exact = sum(exact_length(mesh.surface, origin, direction) for mesh in geometry_of(scene))
    found = reference(scene).truth("thickness", 64).accumulators[0, ..., 0]
    error = found - pixel_means(np.asarray(exact), scene.sensor)
    assert np.sqrt((error**2).mean()) < 1e-5 * 6
    assert np.abs(error).max() < 1e-4 * 6


def test_a_sphere(make_scene: MakeScene, thickness: Callable[..., Float64]) -> None:
    """2 sqrt(r² - b²) with b the ray's distance from the centre; the polyhedron's radius is too small by 4e-4 of it."""
    scene = make_scene(sensor=SENSOR)
    origin, direction = rays(scene.sensor)
    b = np.linalg.norm(np.cross(-origin, direction), axis=1)
    exact = pixel_means(2 * np.sqrt(np.maximum(36 - b**2, 0)), scene.sensor)
    found = thickness(BALL | {"detail": 5})
    inside = exact > 6
    np.testing.assert_allclose(found[inside], exact[inside], rtol=1e-3)
    assert (found[inside] < exact[inside]).all()


@pytest.mark.parametrize("width", [1e-2, 1e-1, 2.0])
def test_a_slab(width: float, make_scene: MakeScene, thickness: Callable[..., Float64]) -> None:
    """d / cos, also for a slab of a thousandth of what the image shows."""
    sensor = make_scene(sensor=SENSOR).sensor
    _, direction = rays(sensor)
    exact = pixel_means(width / np.abs(direction[:, 2]), sensor)
    found = thickness(BODY | {"type": "slab", "thickness": width, "width": 40.0})
    assert np.abs(found - exact).max() < 1e-5 * 12


def test_a_wedge(make_scene: MakeScene, thickness: Callable[..., Float64]) -> None:
    """Between the planes z = ±(a + b x): t = (±(a + b ox) - oz) / (dz -+ b dx)."""
    scene = make_scene(sensor=SENSOR)
    origin, direction = rays(scene.sensor)
    a, b = (0.1 + 1.9) / 4, (1.9 - 0.1) / 2 / 30
    front, back = ((s * (a + b * origin[0]) - origin[2]) / (direction[:, 2] - s * b * direction[:, 0]) for s in (1, -1))
    found = thickness(BODY | {"type": "wedge", "size": [30.0, 30.0], "thin": 0.1, "thick": 1.9})
    assert np.abs(found - pixel_means(back - front, scene.sensor)).max() < 1e-5 * 12


def test_a_ring_seen_edge_on(make_scene: MakeScene, thickness: Callable[..., Float64]) -> None:
    """A plane at height y cuts the ring R, r in two circles of radii R ± sqrt(r² - y²); rays here are almost parallel.

    First and last face alone would be off by up to half.
    """
    far = SENSOR | {"origin": [0.0, 0.0, 12000.0], "fov_deg": 0.06}
    scene = make_scene(sensor=far)
    origin, direction = rays(scene.sensor)
    at = origin + direction * 12000
    half = np.sqrt(np.maximum(1.5**2 - at[:, 1] ** 2, 0))
    outer, inner = (np.sqrt(np.maximum((4 + s * half) ** 2 - at[:, 0] ** 2, 0)) for s in (1, -1))
    exact = pixel_means(np.where(half > 0, 2 * (outer - inner), 0), scene.sensor)
    ring = {"type": "torus", "radius": 4.0, "tube": 1.5, "segments": 384, "sides": 128}
    found = thickness(BODY | ring, sensor=far)
    thick = exact > 2
    assert thick.sum() > 20
    assert np.sqrt(((found - exact)[thick] ** 2).mean()) < 4e-3


def test_thin_layers_one_behind_the_other(thickness: Callable[..., Float64]) -> None:
    """Ten membranes of 1e-2, their gaps as thin, seen from 120: none is skipped."""
    layers = [
        BODY | {"name": f"layer-{i}", "type": "slab", "thickness": 1e-2, "width": 40.0, "position": [0, 0, 2e-2 * i]}
        for i in range(10)
    ]
    np.testing.assert_allclose(thickness(*layers), 0.1, rtol=3e-3)


def test_what_is_beside_the_subject_neither_counts_nor_hides(thickness: Callable[..., Float64]) -> None:
    box = BODY | {"type": "box", "size": [5.0, 5.0, 5.0]}
    in_front = BODY | {"name": "in-front", "type": "rectangle", "size": [3.0, 30.0], "position": [0.0, 0.0, 20.0]}
    around = BALL | {"name": "around", "radius": 20.0}
    alone = thickness(box)
    assert alone.max() > 5
    np.testing.assert_array_equal(thickness(box, shapes=[box, in_front, around]), alone)


def test_what_sees_nothing_is_zero(thickness: Callable[..., Float64]) -> None:
    found = thickness(BALL | {"radius": 2.0})
    assert not found[[0, 0, -1, -1], [0, -1, 0, -1]].any()
    assert 3.5 < found.max() < 4


@pytest.mark.parametrize("distance", [0.0, 4.0, -5.0])
def test_from_within_it_counts_from_the_camera(distance: float, thickness: Callable[..., Float64]) -> None:
    """To the far side of the ball of radius 6, and through all of the one behind it."""
    other = BALL | {"name": "other", "radius": 2.0, "position": [0.0, 0.0, -20.0], "detail": 5}
    sensor = SENSOR | {"origin": [0.0, 0.0, distance], "target": [0.0, 0.0, -9.0], "fov_deg": 0.5}
    np.testing.assert_allclose(thickness(BALL | {"detail": 5}, other, sensor=sensor), distance + 6 + 4, rtol=3e-3)


@pytest.mark.parametrize("missing", ["front", "back"])
def test_an_open_mesh_counts_pairs_only(missing: str, tmp_path: Path, thickness: Callable[..., Float64]) -> None:
    """A layer of 1.5, and before it one face of another layer that lacks its front or its back."""
    faces = [(2.0, missing == "back"), (0.0, True), (-1.5, False)]
    lines = []
    for k, (z, faces_camera) in enumerate(faces):
        lines += [f"v {x} {y} {z}" for x, y in ((-20, -20), (20, -20), (20, 20), (-20, 20))]
        order = (1, 2, 3, 4) if faces_camera else (4, 3, 2, 1)
        lines.append("f " + " ".join(str(4 * k + i) for i in order))
    (tmp_path / "open.obj").write_text("\n".join(lines), encoding="ascii")
    found = thickness(BODY | {"type": "mesh", "path": "open.obj", "shading": "flat"})
    np.testing.assert_allclose(found, 1.5, rtol=3e-3)
