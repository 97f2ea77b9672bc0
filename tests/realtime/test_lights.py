from collections.abc import Callable

import numpy as np
import pytest

from realtime.lights import FACET, PARALLEL, POINT, facets_of, lights_of
from scenes import procedural
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.model import Scene
from scenes.topology import face_vectors, surface_area

SURFACES = {
    "rectangle": procedural.rectangle((2.0, 3.0)),
    "disk": procedural.disk(0.7),
    "box": procedural.box((1.0, 2.0, 3.0)),
    "sphere": procedural.sphere(0.5, 3),
}
surfaces = pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES.keys())


def home_faces(surface: Surface, places: Float64) -> Float64:
    """Index of a triangle that holds each place, by barycentric coordinates and distance from the plane; -1 if none."""
    corners = surface.positions.astype(float)[surface.faces.astype(int)]
    a, b, c = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(b, c)
    v = places[:, None] - a
    area = np.sum(normal**2, axis=1)
    s = np.sum(np.cross(v, c) * normal, axis=2) / area
    t = np.sum(np.cross(b, v) * normal, axis=2) / area
    off = np.abs(np.sum(v * normal, axis=2)) / np.sqrt(area)
    inside = (s > -1e-6) & (t > -1e-6) & (s + t < 1 + 1e-6) & (off < 1e-6)
    return np.where(inside.any(axis=1), inside.argmax(axis=1), -1)


@surfaces
@pytest.mark.parametrize("count", [1, 16, 200])
def test_facets_lie_on_the_surface_and_face_as_it_does(surface: Surface, count: int) -> None:
    facets = facets_of(surface, count)
    places, axes = facets.places, facets.normals
    assert places.shape == axes.shape == (count, 3)
    faces = home_faces(surface, places)
    assert faces.min() >= 0
    np.testing.assert_allclose(
        axes, procedural.normalised(face_vectors(surface.positions, surface.faces))[faces], atol=1e-6
    )


@surfaces
@pytest.mark.parametrize("count", [1, 16])
def test_facets_have_the_area_of_the_surface(surface: Surface, count: int) -> None:
    area = facets_of(surface, count).area
    assert count * area == pytest.approx(surface_area(surface), rel=1e-6)


def test_facets_are_spread_by_area() -> None:
    """A box of 1 x 2 x 3 has faces of 6, 3 and 2: the normals along x, y and z."""
    axes = facets_of(SURFACES["box"], 220).normals
    np.testing.assert_allclose(np.abs(axes).sum(axis=0), [120, 60, 40], atol=1)


@pytest.mark.parametrize("name", ["rectangle", "disk"])
def test_facets_cover_a_sheet_evenly(name: str) -> None:
    """Mean and variance along both axes, against those of a uniform density."""
    places = facets_of(SURFACES[name], 256).places[:, :2]
    variance = np.array([2.0**2, 3.0**2]) / 12 if name == "rectangle" else np.full(2, 0.7**2 / 4)
    np.testing.assert_allclose(places.mean(axis=0), 0, atol=0.03 * np.sqrt(variance).max())
    np.testing.assert_allclose(places.var(axis=0), variance, rtol=0.05)


def test_facets_of_a_disk_shine_as_the_disk_does(glsl: Callable[..., Float64]) -> None:
    """E = pi L R² / (h² + R²) below its centre. Closer than a facet is wide, the formula of a small disk loses some."""
    radius, count = 0.7, 256
    facets = facets_of(procedural.disk(radius), count)
    places, axes, area = facets.places, facets.normals, facets.area
    for h, loss in ((0.25 * radius, 0.06), (radius, 0.01), (4 * radius, 0.01)):
        rows = np.zeros((count, 5, 4))
        rows[:, 0, :3], rows[:, 0, 3], rows[:, 1, :3], rows[:, 1, 3] = places, FACET, axes, area
        rows[:, 2, :3], rows[:, 3, 2], rows[:, 4, 2] = 2.0 * area, h, -1.0
        body = "r[0].xyz = unshadowed_irradiance(Light(a[0], a[1], a[2]), a[3].xyz, a[4].xyz);"
        made = glsl("lib/lights.glsl", body, rows)[:, 0, 0].sum()
        assert made == pytest.approx(2.0 * np.pi * radius**2 / (h**2 + radius**2), rel=loss)


def test_every_emitter_but_the_sky_becomes_lights(make_scene: Callable[..., Scene]) -> None:
    scene = make_scene(
        emitters=[
            {"type": "constant", "radiance": [1.0, 1.0, 1.0]},
            {"type": "point", "position": [0.0, 1.0, 0.5], "intensity": [1.0, 2.0, 3.0]},
            {"type": "directional", "direction": [0.0, -3.0, 4.0], "irradiance": [4.0, 5.0, 6.0]},
            {
                "type": "disk",
                "position": [0.0, 1.2, 0.0],
                "normal": [0.0, -1.0, 0.0],
                "radius": 0.1,
                "radiance": [7.0, 8.0, 9.0],
            },
        ]
    )
    lights = lights_of(scene, geometry_of(scene), facets=4)
    assert [light.kind for light in lights] == [POINT, PARALLEL, *[FACET] * 4]
    np.testing.assert_array_equal(lights[0].place, [0, 1, 0.5])
    np.testing.assert_allclose(lights[1].axis, [0, -0.6, 0.8])
    flux = sum(np.pi * light.strength for light in lights[2:])
    np.testing.assert_allclose(flux, np.pi * np.pi * 0.1**2 * np.array([7, 8, 9]), rtol=1e-6)
    np.testing.assert_allclose([light.axis for light in lights[2:]], [[0, -1, 0]] * 4, atol=1e-6)


def test_each_wall_of_an_emitting_room_is_a_light_of_its_own(make_scene: Callable[..., Scene]) -> None:
    scene = make_scene(emitters=[{"type": "area", "shape": "room", "radiance": [1.0, 1.0, 1.0]}])
    lights = lights_of(scene, geometry_of(scene), facets=2)
    assert len(lights) == 12
    assert sum(light.area for light in lights) == pytest.approx(2 * (3 * 2.5 + 3 * 3 + 2.5 * 3))
    assert all(light.axis @ light.place < 0 for light in lights)


def test_lights_name_the_mesh_that_they_are_a_part_of(make_scene: Callable[..., Scene]) -> None:
    """Two disks that overlap have points where the other one is, too."""
    disk = {"type": "disk", "position": [0, 1, 0], "normal": [0, -1, 0], "radius": 0.1, "radiance": [7, 8, 9]}
    ball = {"type": "sphere", "position": [0, 1, 0], "radius": 0.1, "radiance": [1, 1, 1]}
    sun = {"type": "directional", "direction": [0, -3, 4], "irradiance": [4, 5, 6]}
    room = {"type": "area", "shape": "room", "radiance": [1, 1, 1]}
    scene = make_scene(emitters=[disk, sun, disk, ball, room])
    lights = lights_of(scene, geometry_of(scene), facets=2)
    of_emitters = [light.emitter for light in lights if not light.emitter.startswith("room/")]
    assert sorted(of_emitters) == ["", *["emitter-0"] * 2, *["emitter-2"] * 2, *["emitter-3"] * 2]
    assert len(lights) - len(of_emitters) == 12
