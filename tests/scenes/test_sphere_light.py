"""A ball that shines: its mesh, what is derived from it, and that both renderers give it the same power."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime import lights
from reference.estimator import Reference
from reference.store import Store
from reference.to_mitsuba import scene_dict
from scenes.digest import scene_parts
from scenes.errors import SceneError
from scenes.features import features_of
from scenes.geometry import diffuse_reflectance, geometry_of
from scenes.mesh import Mesh
from scenes.model import Scene
from scenes.topology import is_watertight, signed_volume, surface_area

MakeScene = Callable[..., Scene]

RADIUS, CENTRE = 0.2, (0.7, 0.9, 0.8)
BALL: dict[str, Any] = {"type": "sphere", "position": list(CENTRE), "radius": RADIUS, "radiance": [3.0, 2.0, 1.0]}
POINT = {"type": "point", "position": [0.0, 0.9, 0.8], "intensity": [1.0, 1.0, 1.0]}


def lamp(scene: Scene) -> Mesh:
    return next(mesh for mesh in geometry_of(scene) if mesh.shape.startswith("emitter"))


def test_the_mesh_is_the_ball_numbered_among_the_emitters(make_scene: MakeScene) -> None:
    """Every corner lies on the sphere, so that nothing of the mesh is outside; it faces outward and is closed."""
    mesh = lamp(make_scene(emitters=[POINT, BALL]))
    assert (mesh.name, mesh.shape, mesh.radiance, mesh.is_subject) == ("emitter-1", "emitter-1", (3, 2, 1), False)
    assert diffuse_reflectance(mesh.material) == (0.0, 0.0, 0.0)
    from_centre = mesh.surface.positions - np.array(CENTRE)
    np.testing.assert_allclose(np.linalg.norm(from_centre, axis=1), RADIUS, rtol=2e-6)
    np.testing.assert_allclose(mesh.surface.normals, from_centre / RADIUS, atol=2e-6)
    assert is_watertight(mesh.surface)
    assert 0.995 < signed_volume(mesh.surface) / (4 / 3 * math.pi * RADIUS**3) < 1


def test_the_silhouette_is_a_thousandth_smaller(make_scene: MakeScene) -> None:
    """The mean silhouette of a convex body is a quarter of its surface (Cauchy 1832)."""
    silhouette = surface_area(lamp(make_scene(emitters=[BALL])).surface) / 4
    assert 1 - silhouette / (math.pi * RADIUS**2) == pytest.approx(0.0012, abs=0.0001)


@pytest.mark.parametrize(
    ("emitters", "one", "ball"),
    [([], False, False), ([BALL], True, True), ([POINT], True, False), ([POINT, BALL], False, True)],
    ids=["none", "ball", "point", "both"],
)
def test_what_follows_from_it(make_scene: MakeScene, emitters: list[dict[str, Any]], one: bool, ball: bool) -> None:
    scene = make_scene(emitters=emitters)
    features = features_of(scene, geometry_of(scene))
    assert features.has_one_omni_light is one
    assert features.has_sphere_light is features.has_surface_lights is ball


def test_other_lights_do_not_count(make_scene: MakeScene) -> None:
    others = [
        {"type": "constant", "radiance": [1.0, 1.0, 1.0]},
        {"type": "area", "shape": "room", "radiance": [1.0, 1.0, 1.0]},
    ]
    scene = make_scene(emitters=[*others, BALL])
    assert features_of(scene, geometry_of(scene)).has_one_omni_light


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"radius": 0.0}, "radius"),
        ({"radius": -0.1}, "radius"),
        ({"radiance": [1.0, -1.0, 1.0]}, "radiance"),
        ({"intensity": [1.0, 1.0, 1.0]}, "intensity"),
    ],
)
def test_what_is_no_ball_of_light_is_refused(make_scene: MakeScene, change: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError, match=rf"emitters\[0\].*{said}"):
        make_scene(emitters=[BALL | change])


@pytest.mark.parametrize("change", [{"radius": 0.21}, {"position": [0.7, 0.9, 0.7]}, {"radiance": [3.0, 2.0, 2.0]}])
def test_a_change_of_the_ball_makes_another_truth(make_scene: MakeScene, change: dict[str, Any]) -> None:
    assert scene_parts(make_scene(emitters=[BALL])) != scene_parts(make_scene(emitters=[BALL | change]))


def test_mitsuba_gets_the_mesh_and_no_other_light(make_scene: MakeScene) -> None:
    scene = make_scene(emitters=[BALL])
    plain = scene_dict(scene, geometry_of(scene))
    emitting = [name for name, part in plain.items() if isinstance(part, dict) and "emitter" in part]
    assert emitting == [f"mesh_{len(geometry_of(scene)) - 1}"]
    assert plain[emitting[0]]["emitter"]["radiance"] == {"type": "rgb", "value": [3.0, 2.0, 1.0]}
    assert not any(name.startswith("light") for name in plain)


def test_it_lights_a_plane_as_a_point_of_its_power_does(
    make_scene: MakeScene, reference: Callable[[Scene], Reference]
) -> None:
    """E = pi L (R/d)² cos: that of a point with the intensity pi R² L, however near, while all of it is above."""
    floor = {
        "name": "ball",
        "type": "rectangle",
        "size": [4.0, 4.0],
        "rotation_deg": [-90.0, 0.0, 0.0],
        "material": "white",
    }
    sensor = {
        "type": "perspective",
        "origin": [0.1, 0.3, 0.0],
        "target": [0.1, 0.0, 0.0],
        "up": [0.0, 0.0, -1.0],
        "fov_deg": 1.0,
        "width": 4,
        "height": 4,
    }
    scene = make_scene(sensor=sensor, shapes=[floor], emitters=[BALL | {"position": [0.3, 0.5, 0.2], "radius": 0.25}])
    distance = math.dist((0.1, 0.0, 0.0), (0.3, 0.5, 0.2))
    expected = 0.7 / math.pi * math.pi * np.array([3.0, 2.0, 1.0]) * (0.25 / distance) ** 2 * 0.5 / distance
    made = reference(scene).truth("direct_radiance", 65536).accumulators.mean(axis=(0, 1, 2))
    np.testing.assert_allclose(made, expected, rtol=0.01)
    points = lights.lights_of(scene, geometry_of(scene), 64)
    assert {light.kind for light in points} == {lights.POINT}
    away = np.array([light.place for light in points]) - [0.1, 0.0, 0.0]
    strengths = np.array([light.strength for light in points])
    irradiance = (strengths * (away[:, 1] / np.linalg.norm(away, axis=1) ** 3)[:, None]).sum(axis=0)
    np.testing.assert_allclose(0.7 / math.pi * irradiance, expected, rtol=5e-3)


@pytest.fixture
def reference(mi: Any, tmp_path: Any) -> Callable[[Scene], Reference]:
    return lambda scene: Reference(scene, Store(tmp_path / "store"), lambda what, part: None)
