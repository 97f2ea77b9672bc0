import math
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons.bench.sizes import COPIES, RESOLUTIONS, in_lights, in_pixels, in_triangles, resized
from realtime.render import Renderer
from realtime.techniques import technique
from scenes.errors import InputError
from scenes.geometry import geometry_of
from scenes.load import find_scene, load_scene
from scenes.model import Scene


def library(name: str) -> Scene:
    return load_scene(find_scene(name))


def plane_area(scene: Scene) -> float:
    """Of the image at a distance of 1."""
    sensor = scene.sensor
    half = math.tan(math.radians(sensor.fov_deg) / 2)
    aspect = sensor.width / sensor.height
    return 4 * half**2 * (1 / aspect if sensor.fov_axis == "x" else aspect)


@pytest.mark.parametrize("name", ["parity-wide", "parity-tall"])  # along x and along y
def test_other_resolutions_see_as_much(name: str, tmp_path: Path) -> None:
    scene = library(name)
    found = list(in_pixels(scene, tmp_path))
    assert [(s.sensor.width, s.sensor.height) for _, s in found] == list(RESOLUTIONS)
    assert [size for size, _ in found] == [width * height for width, height in RESOLUTIONS]
    assert [plane_area(s) for _, s in found] == pytest.approx([plane_area(scene)] * len(found))


def test_a_sensor_of_the_same_form_keeps_its_angle() -> None:
    sensor = library("small-room-ellipsoid").sensor
    assert resized(sensor, 2 * sensor.width, 2 * sensor.height).fov_deg == sensor.fov_deg


@pytest.mark.parametrize("name", ["small-room-ellipsoid", "small-room-knot", "skin-fingers", "eye-human-view75"])
def test_a_shape_of_a_formula_gets_64_times_as_many_triangles(name: str, tmp_path: Path) -> None:
    scene = library(name)
    sizes = [size for size, _ in in_triangles(scene, tmp_path)]
    assert sizes == sorted(sizes)
    assert sizes[-1] / sizes[0] == pytest.approx(64, rel=0.1)


def test_a_mesh_of_a_file_is_split_and_keeps_its_form(tmp_path: Path) -> None:
    scene = library("skin-figurine")
    sizes, scenes = zip(*islice(in_triangles(scene, tmp_path), 2), strict=True)
    before = geometry_of(scene)
    assert sizes[0] == sum(len(mesh.surface.faces) for mesh in before)
    boxes = [np.ptp(geometry_of(one)[0].surface.positions, axis=0) for one in scenes]
    assert sizes[1] == 4 * sizes[0]
    assert np.allclose(boxes, np.ptp(before[0].surface.positions, axis=0), rtol=1e-5)


def test_what_the_model_does_not_allow_is_left_out(tmp_path: Path) -> None:
    scene = library("small-room-ellipsoid")
    (figure,) = (shape for shape in scene.shapes if shape.name in scene.subject)
    finest = figure.model_copy(update={"detail": 7})
    others = tuple(shape for shape in scene.shapes if shape is not figure)
    changed = scene.model_copy(update={"shapes": (*others, finest)})
    subjects = [s.shapes[-1] for _, s in in_triangles(changed, tmp_path)]
    assert [getattr(shape, "detail", None) for shape in subjects] == [5, 6, 7]


def test_what_cannot_be_built_so_coarsely_is_left_out(tmp_path: Path) -> None:
    """Of an ear of a quarter of its cells, nothing would be left of the membrane."""
    _, coarsest = next(in_triangles(library("skin-ear"), tmp_path))
    assert [getattr(shape, "cells", None) for shape in coarsest.shapes] == [80]


def test_a_box_has_no_finer_mesh(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'skin-slab' has a subject whose number of triangles is fixed"):
        list(in_triangles(library("skin-slab"), tmp_path))


@pytest.mark.parametrize("name", ["large-room-ellipsoid", "skin-sphere", "eye-human-view30-light40", "shadow-room-5cm"])
def test_lights_share_the_power_out(name: str, tmp_path: Path) -> None:
    scene = library(name)
    for copies, (size, several) in zip(COPIES, in_lights(scene, tmp_path), strict=True):
        assert size == len(several.emitters) == copies * len(scene.emitters)
        assert power(several) == pytest.approx(power(scene))


def power(scene: Scene) -> list[float]:
    keys = ("intensity", "irradiance", "radiance")
    strengths: list[Any] = [next(getattr(e, key) for key in keys if hasattr(e, key)) for e in scene.emitters]
    return [float(channel) for channel in np.sum(strengths, axis=0)]


def test_a_sky_cannot_be_shared_out(tmp_path: Path) -> None:
    scene = library("small-room-ellipsoid")
    sky = {"type": "constant", "radiance": (1.0, 1.0, 1.0)}
    only_sky = Scene.model_validate(scene.model_dump() | {"emitters": (sky,)})
    with pytest.raises(InputError, match=r"no light that could be shared out among several \(its emitters: constant\)"):
        list(in_lights(only_sky, tmp_path))


def test_shared_lights_draw_the_same_image(tmp_path: Path, gl: Any) -> None:
    """You should see no difference: eight lamps at one place, each of an eighth of the power."""
    scene = library("small-room-ellipsoid")
    small = scene.model_copy(update={"sensor": resized(scene.sensor, 16, 16)})
    images = [
        Renderer(one).render(technique("indirect.probe"), {"side": 24, "block": 4}, timed=False).image.pixels
        for _, one in in_lights(small, tmp_path)
    ]
    assert images[0].max() > 0
    assert np.allclose(images, images[0], rtol=1e-3, atol=1e-6)
