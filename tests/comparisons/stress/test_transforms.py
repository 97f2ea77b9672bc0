"""What stresses do to a scene obeys the laws of geometry and light exactly, on the scene itself."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comparisons.stress import transforms
from comparisons.stress.slivers import EVERY, cut, with_meshes
from reference.strands import strands_of
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.load import library_scenes, load_scene
from scenes.materials import Translucent
from scenes.media import coefficients
from scenes.model import PointLight, Scene, SphereLight
from scenes.placing import moved
from scenes.procedural import rotation_xyz, sphere
from scenes.topology import is_watertight, signed_volume

NAMES = ("skin-fingers", "defocus-blurred-foreground", "shadow-odd-angles", "eye-human-view30-light40")
LIBRARY = {name: load_scene(library_scenes()[name]) for name in NAMES}

quick = settings(max_examples=20, deadline=None)
some_scenes = st.sampled_from(list(LIBRARY.values()))
factors = st.floats(1e-3, 1e3)
offsets = st.tuples(*[st.floats(-1e3, 1e3)] * 3)
angles = st.floats(-180, 180)
axes = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1)


def numbers(part: Any) -> Float64:
    """All numbers of a scene, in order, but for rotations, which have more than one notation."""
    match part:
        case dict():
            return np.concatenate([numbers(v) for k, v in part.items() if k != "rotation_deg"] or [np.zeros(0)])
        case list() | tuple():
            return np.concatenate([numbers(v) for v in part] or [np.zeros(0)])
        case bool() | None | str() | Path():
            return np.zeros(0)
        case _:
            return np.array([part], dtype=float)


def assert_same(one: Scene, other: Scene) -> None:
    np.testing.assert_allclose(numbers(one.model_dump()), numbers(other.model_dump()), rtol=1e-9, atol=1e-6)
    for a, b in zip(one.shapes, other.shapes, strict=True):
        np.testing.assert_allclose(rotation_xyz(a.rotation_deg), rotation_xyz(b.rotation_deg), atol=1e-7)


@quick
@given(some_scenes, factors, factors)
def test_scales_compose(scene: Scene, one: float, other: float) -> None:
    twice = transforms.scaled(transforms.scaled(scene, one), other)
    assert_same(transforms.scaled(twice, 1 / (one * other)), transforms.scaled(scene, 1.0))


@quick
@given(some_scenes, offsets)
def test_moves_are_undone(scene: Scene, offset: tuple[float, float, float]) -> None:
    x, y, z = offset
    assert_same(moved(moved(scene, offset), (-x, -y, -z)), scene)


@quick
@given(some_scenes, axes, angles)
def test_turns_are_undone(scene: Scene, axis: tuple[float, float, float], degrees: float) -> None:
    there = transforms.turned(scene, transforms.axis_rotation(axis, degrees))
    assert_same(transforms.turned(there, transforms.axis_rotation(axis, -degrees)), scene)


@quick
@given(some_scenes, factors, factors)
def test_exposures_compose(scene: Scene, one: float, other: float) -> None:
    assert_same(transforms.exposed(transforms.exposed(scene, one), other), transforms.exposed(scene, one * other))


@quick
@given(st.tuples(angles, angles, angles))
def test_angles_are_found_again(degrees: tuple[float, float, float]) -> None:
    rotation = rotation_xyz(degrees)
    np.testing.assert_allclose(rotation_xyz(transforms.euler_deg(rotation)), rotation, atol=1e-6)


@pytest.mark.parametrize("degrees", [(20.0, 90.0, 0.0), (20.0, -90.0, 50.0)])
def test_angles_are_found_where_two_axes_coincide(degrees: tuple[float, float, float]) -> None:
    rotation = rotation_xyz(degrees)
    np.testing.assert_allclose(rotation_xyz(transforms.euler_deg(rotation)), rotation, atol=1e-6)


@quick
@given(axes, angles)
def test_a_rotation_keeps_lengths_and_its_axis(axis: tuple[float, float, float], degrees: float) -> None:
    rotation = transforms.axis_rotation(axis, degrees)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(rotation @ axis, axis, atol=1e-12)
    assert np.trace(rotation) == pytest.approx(1 + 2 * np.cos(np.radians(degrees)))


@settings(deadline=None, max_examples=5)
@given(axes, angles, st.floats(0.1, 10))
def test_meshes_turn_and_grow_with_the_scene(axis: tuple[float, float, float], degrees: float, factor: float) -> None:
    """You should see every vertex where the rotation takes it, lamps too."""
    scene = LIBRARY["shadow-odd-angles"]
    rotation = transforms.axis_rotation(axis, degrees)
    after = geometry_of(transforms.scaled(transforms.turned(scene, rotation), factor))
    for a, b in zip(after, geometry_of(scene), strict=True):
        np.testing.assert_allclose(a.surface.positions, factor * b.surface.positions @ rotation.T, atol=1e-4 * factor)
        np.testing.assert_allclose(a.surface.normals, b.surface.normals @ rotation.T, atol=1e-5)


@pytest.mark.parametrize("factor", [0.01, 30.0])
def test_hair_turns_and_grows_with_the_scene(factor: float) -> None:
    """Its control points on a bent limb, which are the same hairs, only elsewhere and as much longer."""
    scene, turn = load_scene(library_scenes()["hair-limb-60"]), transforms.axis_rotation((0.3, 0.8, -0.5), 33.0)
    hair = strands_of(scene)
    other = strands_of(transforms.turned(transforms.scaled(scene, factor), turn))
    np.testing.assert_allclose(other.points, factor * hair.points @ turn.T, atol=1e-5 * factor)
    np.testing.assert_allclose(other.radius, factor * hair.radius)


@quick
@given(factors)
def test_light_gets_as_far_through_a_medium_as_the_body_grows(factor: float) -> None:
    (before,), (after,) = (
        scene.materials.values()
        for scene in (LIBRARY["skin-fingers"], transforms.scaled(LIBRARY["skin-fingers"], factor))
    )
    assert isinstance(before, Translucent)
    assert isinstance(after, Translucent)
    for sigma, thinned in zip(coefficients(before, "mm"), coefficients(after, "mm"), strict=True):
        np.testing.assert_allclose(factor * thinned, sigma)


@quick
@given(factors, st.floats(1e-3, 1))
def test_a_point_gives_the_same_irradiance_in_a_larger_scene(factor: float, radius: float) -> None:
    """I / d² stays, for points and for balls, and a ball has the power of its point."""
    scene = LIBRARY["shadow-odd-angles"]

    def irradiance(of: Scene) -> Float64:
        (light,) = of.emitters
        assert isinstance(light, PointLight | SphereLight)
        strength = (
            light.intensity if isinstance(light, PointLight) else np.pi * light.radius**2 * np.array(light.radiance)
        )
        received: Float64 = np.array(strength) / np.sum(np.subtract(light.position, of.sensor.target) ** 2)
        return received

    point, ball = transforms.with_points(scene), transforms.with_balls(transforms.with_points(scene), radius)
    np.testing.assert_allclose(irradiance(transforms.scaled(point, factor)), irradiance(point))
    np.testing.assert_allclose(irradiance(transforms.scaled(ball, factor)), irradiance(point))
    np.testing.assert_allclose(irradiance(transforms.with_points(ball)), irradiance(point))


@quick
@given(some_scenes, angles)
def test_what_moves_around_the_target_keeps_its_distance(scene: Scene, degrees: float) -> None:
    seen, lit = transforms.seen_from(scene, degrees), transforms.lit_from(scene, degrees)
    assert transforms.viewing_distance(seen) == pytest.approx(transforms.viewing_distance(scene))
    for before, after in zip(scene.emitters, lit.emitters, strict=True):
        if "position" in type(before).model_fields:
            a, b = (np.linalg.norm(np.subtract(light.position, scene.sensor.target)) for light in (before, after))  # type: ignore[union-attr]
            assert a == pytest.approx(b)
    assert_same(transforms.seen_from(seen, -degrees), scene)
    assert_same(transforms.lit_from(lit, -degrees), scene)


def test_a_pinhole_has_no_lens_and_all_else() -> None:
    scene = LIBRARY["defocus-blurred-foreground"]
    sensor = transforms.with_pinhole(scene).sensor
    assert sensor.type == "perspective"
    assert {k: v for k, v in scene.sensor.model_dump().items() if k in type(sensor).model_fields and k != "type"} == {
        k: v for k, v in sensor.model_dump().items() if k != "type"
    }


@pytest.mark.parametrize("name", NAMES)
def test_the_far_card_is_in_the_picture_yet_smaller_than_a_pixel(name: str) -> None:
    scene = LIBRARY[name]
    for distance in (10.0, 1e5):
        card = geometry_of(transforms.with_far_card(scene, distance))[
            len(geometry_of(scene)) - len([m for m in geometry_of(scene) if m.name.startswith("emitter-")])
        ]
        forward = np.subtract(scene.sensor.target, scene.sensor.origin)
        away = card.surface.positions.mean(axis=0) - scene.sensor.origin
        cosine = away @ forward / np.linalg.norm(away) / np.linalg.norm(forward)
        assert np.degrees(np.arccos(cosine)) == pytest.approx(scene.sensor.fov_deg / 4, abs=0.1)
        assert (
            np.ptp(card.surface.positions, axis=0).max() / np.linalg.norm(away) < np.radians(scene.sensor.fov_deg) / 48
        )


def test_a_cut_solid_stays_the_same_solid() -> None:
    """You should see more triangles, a third of the new ones slivers, and the same closed surface."""
    ball = sphere(0.5, 2)
    positions, faces = cut(ball, 1e-3)
    corners = positions[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    whole = areas.max()
    assert (areas == 0).sum() == 4
    assert ((areas > 0) & (areas < 2e-3 * whole)).sum() == len(ball.faces[::EVERY])


@pytest.mark.parametrize("height", [1e-2, 1e-6])
def test_a_file_with_slivers_is_read_as_the_same_solid(
    make_scene: Callable[..., Scene], tmp_path: Path, height: float
) -> None:
    scene = make_scene()
    surfaces = {}
    for each in (None, height):
        (surfaces[each],) = (m.surface for m in geometry_of(with_meshes(scene, tmp_path, each)) if m.is_subject)
    assert is_watertight(surfaces[height])
    assert len(surfaces[height].faces) > len(surfaces[None].faces)
    assert signed_volume(surfaces[height]) == pytest.approx(signed_volume(surfaces[None]), rel=1e-5)
    np.testing.assert_allclose(np.ptp(surfaces[height].positions, axis=0), np.ptp(surfaces[None].positions, axis=0))
