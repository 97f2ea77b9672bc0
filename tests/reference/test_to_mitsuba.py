import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from reference.estimator import Reference
from reference.stage import build_stage, pixel_grid
from reference.to_mitsuba import FARTHEST_FOCUS, emitter_dicts, instantiate, scene_dict, sensor_dict
from scenes.errors import SceneError
from scenes.exr import write_exr
from scenes.geometry import geometry_of
from scenes.image import Float64, Image
from scenes.model import Scene

MakeScene = Callable[..., Scene]

SKY = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
LENS = {"type": "thin_lens", "aperture_radius": 0.1, "focus_distance": 1.5}
PLAIN = """
import sys
from pathlib import Path
from reference.estimator import Reference, truth_parts
from reference.to_mitsuba import scene_dict
from scenes.geometry import geometry_of
from scenes.load import load_scene
scene = load_scene(Path(sys.argv[1]))
plain = scene_dict(scene, geometry_of(scene))
truth_parts(scene, "indirect_radiance")
assert plain["sensor"]["fov"] == 40.0
print(*(name for name in sys.modules if name.split(".")[0] in ("mitsuba", "drjit", "moderngl")))
"""


def plain_types(value: Any) -> set[type]:
    """Types of all values inside dicts, lists and tuples."""
    if isinstance(value, dict):
        return set().union(*map(plain_types, value.values()))
    if isinstance(value, (list, tuple)):
        return set().union(*map(plain_types, value))
    return {type(value)}


def test_a_scene_becomes_plain_data_without_importing_a_renderer(make_scene: MakeScene) -> None:
    scene = make_scene()
    path = scene.folder / "scene.toml"
    made = subprocess.run([sys.executable, "-c", PLAIN, str(path)], capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr
    assert made.stdout.split() == []


def test_the_dictionary_holds_numbers_texts_and_surfaces_alone(make_scene: MakeScene) -> None:
    scene = make_scene()
    plain = scene_dict(scene, geometry_of(scene))
    assert {t.__name__ for t in plain_types(plain)} <= {"str", "float", "int", "Surface"}
    assert [k for k in plain if k.startswith("mesh_")] == [f"mesh_{i}" for i in range(7)]


@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_sensor_keeps_its_view(make_scene: MakeScene, facing: dict[str, Any], axis: str) -> None:
    sensor = make_scene(sensor=facing | {"fov_axis": axis, "width": 30, "height": 20, "up": [0.0, 1.0, 0.5]}).sensor
    plain = sensor_dict(sensor)
    assert (plain["type"], plain["fov"], plain["fov_axis"]) == ("perspective", 60.0, axis)
    assert plain["to_world"]["look_at"] == ((0, 0, 2), (0, 0, 0), (0, 1, 0.5))
    assert (plain["film"]["width"], plain["film"]["height"], plain["film"]["rfilter"]) == (30, 20, {"type": "box"})


def test_a_thin_lens_keeps_its_radius_and_focus(make_scene: MakeScene, facing: dict[str, Any]) -> None:
    plain = sensor_dict(make_scene(sensor=facing | LENS).sensor)
    assert (plain["type"], plain["aperture_radius"], plain["focus_distance"]) == ("thinlens", 0.1, 1.5)


def test_a_lens_without_an_opening_is_a_pinhole(make_scene: MakeScene, facing: dict[str, Any]) -> None:
    """Mitsuba refuses it."""
    plain = sensor_dict(make_scene(sensor=facing | LENS | {"aperture_radius": 0.0}).sensor)
    assert plain == sensor_dict(make_scene(sensor=facing).sensor)
    assert plain["type"] == "perspective"


@pytest.mark.parametrize("focus", [1e9, 1e20, 1e300])
def test_a_lens_is_never_focused_so_far_away_that_mitsuba_is_black(
    make_scene: MakeScene, mi: ModuleType, facing: dict[str, Any], focus: float
) -> None:
    """At 1e20 it is, without a word."""
    scene = make_scene(sensor=facing | LENS | {"focus_distance": focus}, emitters=[SKY])
    stage = build_stage(mi, scene, ())
    assert sensor_dict(scene.sensor)["focus_distance"] == FARTHEST_FOCUS
    image = mi.render(stage.scene, integrator=mi.load_dict({"type": "path"}), spp=4)
    np.testing.assert_allclose(np.array(image), 1.0, rtol=1e-6)


def test_rays_without_a_place_on_the_lens_are_those_of_a_pinhole(
    make_scene: MakeScene, mi: ModuleType, facing: dict[str, Any]
) -> None:
    x, y = (mi.Float(column) for column in np.random.default_rng(1).uniform(0, 8, (2, 500)).astype(np.float32))
    lens, pinhole = (build_stage(mi, make_scene(sensor=sensor), ()).rays(x, y) for sensor in (facing | LENS, facing))
    for own, other in ((lens.o, pinhole.o), (lens.d, pinhole.d)):
        np.testing.assert_allclose(np.array(own), np.array(other), atol=3e-7)


def test_every_kind_of_emitter_is_translated(make_scene: MakeScene, tmp_path: Path) -> None:
    write_exr(tmp_path / "sky.exr", Image(np.ones((2, 4, 3), dtype=np.float32)))
    rgb = [1.0, 2.0, 3.0]
    scene = make_scene(
        emitters=[
            {"type": "point", "position": [0.0, 1.0, 0.0], "intensity": rgb},
            {"type": "directional", "direction": [0.0, -1.0, 0.0], "irradiance": rgb},
            {"type": "constant", "radiance": rgb},
            {"type": "environment", "path": "sky.exr", "scale": 2.5},
            {"type": "area", "shape": "room", "radiance": rgb},
            {"type": "disk", "position": [0.0, 1.0, 0.0], "normal": [0.0, -1.0, 0.0], "radius": 0.1, "radiance": rgb},
        ]
    )
    colour = {"type": "rgb", "value": rgb}
    plain = emitter_dicts(scene)
    assert plain["light_0"] == {"type": "point", "position": [0, 1, 0], "intensity": colour}
    assert plain["light_1"] == {"type": "directional", "direction": [0, -1, 0], "irradiance": colour}
    assert plain["light_2"] == {"type": "constant", "radiance": colour}
    assert (plain["light_3"]["type"], plain["light_3"]["scale"]) == ("envmap", 2.5)
    assert Path(plain["light_3"]["filename"]) == tmp_path / "sky.exr"
    meshes = [m for k, m in scene_dict(scene, geometry_of(scene)).items() if k.startswith("mesh_")]
    assert [m.get("emitter") for m in meshes] == [{"type": "area", "radiance": colour}] * 6 + [None] + [
        {"type": "area", "radiance": colour}
    ]
    assert meshes[-1]["bsdf"]["reflectance"] == {"type": "rgb", "value": [0, 0, 0]}


def test_meshes_of_equal_material_stay_apart(make_scene: MakeScene, mi: ModuleType) -> None:
    """Mitsuba's load_dict would merge them, and nobody could tell the subject from its surroundings."""
    balls = [
        {"name": n, "type": "sphere", "detail": 1, "material": "skin", "position": [x, 0.0, 0.0]}
        for n, x in (("ball", 0.0), ("other", 3.0))
    ]
    scene = make_scene(shapes=balls, emitters=[])
    loaded = instantiate(mi, scene_dict(scene, geometry_of(scene)))
    assert sorted(shape.id() for shape in loaded.shapes()) == ["mesh_0", "mesh_1"]
    assert len(build_stage(mi, scene, geometry_of(scene)).subject) == 1


def test_only_the_subject_counts_among_meshes_of_equal_material(
    make_scene: MakeScene, reference: Callable[..., Reference], facing: dict[str, Any]
) -> None:
    """Two squares side by side; the left one is the subject."""
    half = {"type": "rectangle", "size": [4.0, 8.0], "material": "skin"}
    scene = make_scene(
        sensor=facing,
        shapes=[
            half | {"name": "ball", "position": [-2.0, 0.0, 0.0]},
            half | {"name": "other", "position": [2.0, 0.0, 0.0]},
        ],
    )
    assert reference(scene).subject_mask.tolist() == [[True] * 4 + [False] * 4] * 8


OUTSIDE = {
    "type": "perspective",
    "origin": [0.0, 0.0, 9.0],
    "target": [0.0, 0.0, 0.0],
    "fov_deg": 40.0,
    "width": 8,
    "height": 8,
}


def test_a_camera_outside_a_room_is_refused(make_scene: MakeScene, reference: Callable[..., Reference]) -> None:
    """The backs of the walls hide everything, and Mitsuba would render zeros in silence."""
    with pytest.raises(SceneError, match=r"the subject \(ball\) covers no pixel.*stands inside the room"):
        reference(make_scene(sensor=OUTSIDE)).truth("indirect_radiance", 64)


def test_a_camera_that_looks_away_is_refused(make_scene: MakeScene, reference: Callable[..., Reference]) -> None:
    away = OUTSIDE | {"origin": [0.0, 0.0, 1.0], "target": [0.0, 0.0, 2.0]}
    with pytest.raises(SceneError, match="covers no pixel"):
        reference(make_scene(sensor=away)).truth("indirect_radiance", 64)


def sky_radiance(d: Float64) -> Float64:
    """Smooth and different in every direction."""
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    return np.stack([2 + x + 0.5 * y, 2 + y - 0.4 * z, 2 + 0.7 * z - 0.5 * x], axis=-1)


def test_an_environment_has_its_top_at_plus_y_and_its_middle_at_minus_z(
    make_scene: MakeScene, mi: ModuleType, tmp_path: Path
) -> None:
    """With +X at three quarters of the width, as in glsl/lib/sky.glsl.

    Mitsuba puts the middle of the first row, not its edge, at the pole: expect half a row of difference there.
    """
    rows, columns = 64, 128
    v, u = np.meshgrid((np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns, indexing="ij")
    theta, phi = np.pi * v, 2 * np.pi * (u - 0.5)
    d = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=-1)
    write_exr(tmp_path / "sky.exr", Image(sky_radiance(d).astype(np.float32)))
    scene = make_scene(emitters=[{"type": "environment", "path": "sky.exr", "scale": 1.5}])
    stage = build_stage(mi, scene, geometry_of(scene))
    towards = np.random.default_rng(1).normal(size=(3, 200)).astype(np.float32)
    towards /= np.linalg.norm(towards, axis=0)
    si = mi.SurfaceInteraction3f()
    si.wi = -mi.Vector3f(towards)
    found = np.array(stage.scene.environment().eval(si)).T
    np.testing.assert_allclose(found, 1.5 * sky_radiance(towards.T.astype(float)), rtol=0.02)


def test_film_positions_are_regular_and_of_single_precision() -> None:
    """Row by row, pixel by pixel; Mitsuba's points refuse float64."""
    x, y = pixel_grid(width=3, rows=range(5, 7), side=2)
    assert x.dtype == y.dtype == np.float32
    assert x[:4].tolist() == [0.25, 0.75, 0.25, 0.75]
    assert y[:4].tolist() == [5.25, 5.25, 5.75, 5.75]
    assert x.reshape(2, 3, 4).mean(axis=2).tolist() == [[0.5, 1.5, 2.5]] * 2
    assert y.reshape(2, 3, 4).mean(axis=2).tolist() == [[5.5] * 3, [6.5] * 3]


BALL_OF_SKIN = {
    "length_unit": "mm",
    "materials": {"skin": {"type": "translucent", "sigma_a": [0.0, 0.2, 2.0], "sigma_s": [1.0, 1.8, 2.0]}},
    "shapes": [{"name": "ball", "type": "sphere", "radius": 3.0, "material": "skin"}],
}


def test_a_translucent_body_is_filled_and_its_surface_lets_light_pass(make_scene: MakeScene) -> None:
    scene = make_scene(**BALL_OF_SKIN)
    plain = scene_dict(scene, geometry_of(scene))["mesh_0"]
    assert plain["bsdf"] == {"type": "null"}
    assert plain["interior"]["scale"] == pytest.approx(4.0)
    assert plain["interior"]["sigma_t"]["value"] == pytest.approx([0.25, 0.5, 1.0])
    assert plain["interior"]["albedo"]["value"] == pytest.approx([1.0, 0.9, 0.5])
    assert plain["interior"]["phase"] == {"type": "isotropic"}


def test_a_mesh_is_given_its_medium_on_the_inside(mi: ModuleType, make_scene: MakeScene) -> None:
    scene = make_scene(**BALL_OF_SKIN)
    (shape,) = instantiate(mi, scene_dict(scene, geometry_of(scene))).shapes()
    assert shape.interior_medium() is not None
    assert shape.exterior_medium() is None


def test_light_that_bounces_among_diffuse_walls_is_refused_where_a_body_is_translucent(
    make_scene: MakeScene, reference: Callable[[Scene], Reference]
) -> None:
    with pytest.raises(SceneError, match=r"radiance is not defined here: .* translucent body, an eye"):
        reference(make_scene(**BALL_OF_SKIN)).truth("radiance", 16)
