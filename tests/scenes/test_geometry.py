import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from scenes import procedural
from scenes.errors import SceneError
from scenes.exr import write_exr
from scenes.geometry import diffuse_reflectance, disk_light_mesh, geometry_of, line_light_mesh, placed, texture_of
from scenes.image import Image
from scenes.materials import Texture, Translucent
from scenes.mesh import Interface
from scenes.model import DiskLight, LineLight, Scene
from scenes.shapes import Sphere
from scenes.topology import face_vectors, is_watertight, signed_volume, surface_area
from scenes.units import Vec3

GREY = {"type": "diffuse", "reflectance": (0.5, 0.5, 0.5)}
RED = {"type": "diffuse", "reflectance": (0.5, 0.1, 0.1)}
BALL = {"type": "sphere", "name": "ball", "material": "grey", "detail": 2}
ROOM = {"type": "room", "name": "room", "material": "grey", "size": (2.0, 3.0, 4.0), "walls": {"left": "red"}}

angles = st.floats(-720, 720)
unit_interval = st.floats(0.01, 10)


def scene(folder: Path = Path(), **changes: Any) -> Scene:
    return Scene.model_validate(
        {
            "name": "test",
            "folder": folder,
            "title": "A test",
            "sensor": {"type": "perspective", "origin": (0.0, 0.0, 5.0), "target": (0.0, 0.0, 0.0), "fov_deg": 40.0},
            "materials": {"grey": GREY, "red": RED},
            "shapes": (BALL, ROOM),
            "subject": ("ball",),
            **changes,
        }
    )


def test_one_mesh_a_shape_and_one_a_wall() -> None:
    meshes = {mesh.name: mesh for mesh in geometry_of(scene())}
    walls = ["left", "right", "floor", "ceiling", "back", "front"]
    assert list(meshes) == ["ball", *(f"room/{wall}" for wall in walls)]
    assert {mesh.shape for mesh in meshes.values()} == {"ball", "room"}
    assert [name for name, mesh in meshes.items() if mesh.is_subject] == ["ball"]
    assert diffuse_reflectance(meshes["room/left"].material) == (0.5, 0.1, 0.1)
    assert diffuse_reflectance(meshes["room/right"].material) == (0.5, 0.5, 0.5)
    assert all(mesh.radiance is None for mesh in meshes.values())


def test_an_area_light_makes_all_meshes_of_its_shape_emit() -> None:
    light = {"type": "area", "shape": "room", "radiance": (1.0, 2.0, 3.0)}
    for mesh in geometry_of(scene(emitters=(light,))):
        assert mesh.radiance == ((1.0, 2.0, 3.0) if mesh.shape == "room" else None)


def test_a_disk_light_is_a_black_mesh_that_emits_and_is_numbered_among_the_emitters() -> None:
    point = {"type": "point", "position": (0.0, 0.0, 0.0), "intensity": (1.0, 1.0, 1.0)}
    disk = {
        "type": "disk",
        "position": (0.0, 1.0, 0.0),
        "normal": (0.0, -1.0, 0.0),
        "radius": 0.5,
        "radiance": (3.0, 2.0, 1.0),
    }
    mesh = geometry_of(scene(emitters=(point, disk)))[-1]
    assert (mesh.name, mesh.shape, mesh.radiance, mesh.is_subject) == ("emitter-1", "emitter-1", (3.0, 2.0, 1.0), False)
    assert diffuse_reflectance(mesh.material) == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(mesh.surface.positions[:, 1], 1, atol=1e-6)
    assert surface_area(mesh.surface) == pytest.approx(math.pi * 0.25, rel=1e-5)


@settings(deadline=None)
@given(st.tuples(*3 * [st.floats(-1, 1)]).filter(lambda n: sum(c * c for c in n) > 1e-6))
def test_a_disk_faces_along_its_normal(normal: Vec3) -> None:
    light = DiskLight(type="disk", position=(1.0, 2.0, 3.0), normal=normal, radius=2.0, radiance=(1.0, 1.0, 1.0))
    surface = disk_light_mesh("emitter-0", light).surface
    unit = procedural.normalised(np.array(normal))
    np.testing.assert_allclose(surface.normals, np.tile(unit, (len(surface.normals), 1)), atol=1e-6)
    faces = procedural.normalised(face_vectors(surface.positions, surface.faces))
    np.testing.assert_allclose(faces, np.tile(unit, (len(faces), 1)), atol=1e-4)
    np.testing.assert_allclose(surface.positions[0], [1, 2, 3], atol=1e-6)


@settings(max_examples=30, deadline=None)
@given(direction=st.tuples(*3 * [st.floats(-1, 1)]).filter(lambda n: sum(c * c for c in n) > 1e-2))
def test_a_line_light_is_a_closed_tube_from_its_start_to_its_end(direction: Vec3) -> None:
    start = np.array([1.0, 2.0, 3.0])
    end = start + 4 * np.array(direction)
    length = float(np.linalg.norm(end - start))
    light = LineLight(type="line", start=tuple(start), end=tuple(end), radius=0.05, radiance=(1.0, 2.0, 3.0))
    mesh = line_light_mesh("emitter-0", light)
    assert (mesh.name, mesh.shape, mesh.radiance, mesh.is_subject) == ("emitter-0", "emitter-0", (1, 2, 3), False)
    assert diffuse_reflectance(mesh.material) == (0, 0, 0)
    axis = (end - start) / length
    offset = mesh.surface.positions - start
    along = offset @ axis
    assert (along.min(), along.max()) == (pytest.approx(0, abs=1e-6), pytest.approx(length, abs=1e-6))
    assert np.linalg.norm(offset - along[:, None] * axis, axis=1).max() == pytest.approx(0.05, rel=1e-3)
    assert is_watertight(mesh.surface)
    assert signed_volume(mesh.surface) == pytest.approx(math.pi * 0.05**2 * length, rel=2e-3)


def test_lights_that_are_meshes_come_last_and_keep_their_places_among_the_emitters() -> None:
    line = {
        "type": "line",
        "start": (0.0, 0.0, 0.0),
        "end": (0.0, 1.0, 0.0),
        "radius": 0.1,
        "radiance": (1.0, 1.0, 1.0),
    }
    sky = {"type": "constant", "radiance": (1.0, 1.0, 1.0)}
    names = [mesh.name for mesh in geometry_of(scene(emitters=(line, sky, line)))]
    assert names[-2:] == ["emitter-0", "emitter-2"]


def test_an_eye_is_a_sclera_and_a_clear_cornea() -> None:
    eye = {
        "type": "eye",
        "name": "eye",
        "material": "grey",
        "iris": "red",
        "sclera_radius": 12.0,
        "cornea_radius": 7.8,
        "limbus_radius": 5.9,
        "ior": 1.376,
    }
    sclera, cornea = geometry_of(scene(shapes=(eye,), subject=("eye",)))
    assert [mesh.name for mesh in (sclera, cornea)] == ["eye/sclera", "eye/cornea"]
    assert {mesh.shape for mesh in (sclera, cornea)} == {"eye"}
    assert sclera.is_subject
    assert cornea.is_subject
    assert diffuse_reflectance(sclera.material) == (0.5, 0.5, 0.5)
    assert cornea.material == Interface(1.376)


@pytest.mark.parametrize(
    "shape",
    [
        {"type": "slab", "thickness": 1.0, "width": 9.0},
        {"type": "wedge", "size": (3.0, 2.0), "thin": 0.1, "thick": 1.0},
        {"type": "capsule", "radius": 1.0, "length": 3.0},
        {"type": "torus", "radius": 2.0, "tube": 0.5},
        {"type": "ear", "height": 25.0, "membrane": 1.0, "cells": 64},
    ],
)
def test_bodies_are_built_of_their_material(shape: dict[str, Any]) -> None:
    skin = {"type": "translucent", "medium": "skin1"}
    body = {**shape, "name": "body", "material": "skin", "scale": 2.0}
    (mesh,) = geometry_of(scene(shapes=(body,), materials={"skin": skin}, subject=("body",)))
    assert mesh.material == Translucent(type="translucent", medium="skin1")
    assert is_watertight(mesh.surface)
    assert signed_volume(mesh.surface) > 0


@pytest.mark.parametrize(
    ("degrees", "vector", "turned"),
    [
        ((90.0, 0.0, 0.0), (0, 1, 0), (0, 0, 1)),
        ((0.0, 90.0, 0.0), (0, 0, 1), (1, 0, 0)),
        ((0.0, 0.0, 90.0), (1, 0, 0), (0, 1, 0)),
        ((90.0, 90.0, 0.0), (0, 1, 0), (1, 0, 0)),  # x first: y to z, then z to x
        ((90.0, 0.0, 90.0), (1, 0, 0), (0, 1, 0)),
        ((0.0, 90.0, 90.0), (0, 0, 1), (0, 1, 0)),  # y before z: z to x, then x to y
    ],
)
def test_rotation_turns_about_x_then_y_then_z(degrees: Vec3, vector: Vec3, turned: Vec3) -> None:
    np.testing.assert_allclose(procedural.rotation_xyz(degrees) @ np.array(vector), turned, atol=1e-15)


@given(st.tuples(angles, angles, angles))
def test_rotation_is_a_proper_rotation(degrees: Vec3) -> None:
    rotation = procedural.rotation_xyz(degrees)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1)


@settings(deadline=None)
@given(degrees=st.tuples(angles, angles, angles), scale=unit_interval, x=st.floats(-5, 5))
def test_placing_scales_turns_and_moves_and_keeps_normals_on_their_faces(degrees: Vec3, scale: float, x: float) -> None:
    shape = Sphere(
        type="sphere", name="a", material="b", position=(x, 1.0, 2.0), rotation_deg=degrees, scale=scale, detail=0
    )
    unplaced = procedural.box((1.0, 2.0, 3.0))
    surface = placed(unplaced, shape)
    assert signed_volume(surface) == pytest.approx(6 * scale**3, rel=1e-3)
    np.testing.assert_allclose(surface.positions.mean(axis=0), [x, 1, 2], atol=1e-5)
    normals = procedural.normalised(face_vectors(surface.positions, surface.faces))
    np.testing.assert_allclose(surface.normals[surface.faces[:, 0]], normals, atol=1e-3)
    expected = scale * unplaced.positions @ procedural.rotation_xyz(degrees).T + [x, 1, 2]
    np.testing.assert_allclose(surface.positions, expected, atol=1e-5 * (scale + 5))


def test_every_shape_that_cannot_be_built_is_named_at_once() -> None:
    shapes = (
        {"type": "mesh", "name": "statue", "material": "grey", "path": "none.ply"},
        BALL,
        {"type": "torus_knot", "name": "knot", "material": "grey", "p": 2, "q": 4},
        {"type": "sphere", "name": "moon", "material": "cheese"},
    )
    light = {"type": "area", "shape": "lamp", "radiance": (1.0, 1.0, 1.0)}
    with pytest.raises(SceneError) as caught:
        geometry_of(scene(shapes=shapes, emitters=(light,)))
    lines = str(caught.value).splitlines()
    assert [line.split(":")[0] for line in lines] == [
        'an area light names the unknown shape "lamp".',
        'shape "statue"',
        'shape "knot"',
        'shape "moon"',
    ]
    assert 'unknown material "cheese"; allowed: grey, red' in lines[-1]


def png(path: Path, values: NDArray[np.uint8]) -> Path:
    import PIL.Image

    PIL.Image.fromarray(values).save(path)
    return path


def test_srgb_code_values_are_decoded_by_the_standard_curve_with_row_0_at_the_top(tmp_path: Path) -> None:
    """IEC 61966-2-1: 10/255 lies on the linear toe, 188/255 is close to linear 1/2."""
    codes = np.array([[[0, 10, 255], [188, 188, 188]], [[1, 2, 3], [4, 5, 6]], [[7, 8, 9], [9, 8, 7]]], dtype=np.uint8)
    png(tmp_path / "image.png", codes)
    linear = texture_of(scene(tmp_path), Texture(path="image.png"))
    assert linear.dtype == np.float32
    assert linear.shape == (3, 2, 3)
    np.testing.assert_allclose(linear[0, 0], [0, 10 / 255 / 12.92, 1], rtol=1e-6)
    np.testing.assert_allclose(linear[0, 1], ((188 / 255 + 0.055) / 1.055) ** 2.4, rtol=1e-6)
    raw = texture_of(scene(tmp_path), Texture(path="image.png", color_space="linear"))
    np.testing.assert_allclose(raw, codes / 255, rtol=1e-6)


def test_grey_is_repeated_and_alpha_left_out(tmp_path: Path) -> None:
    png(tmp_path / "grey.png", np.array([[0, 128], [255, 64]], dtype=np.uint8))
    png(tmp_path / "rgba.png", np.array([[[255, 0, 0, 0]]], dtype=np.uint8))
    grey = texture_of(scene(tmp_path), Texture(path="grey.png", color_space="linear"))
    np.testing.assert_allclose(grey[0, 1], 128 / 255, rtol=1e-6)
    rgba = texture_of(scene(tmp_path), Texture(path="rgba.png"))
    np.testing.assert_array_equal(rgba, [[[1, 0, 0]]])


def test_a_jpeg_is_read(tmp_path: Path) -> None:
    png(tmp_path / "image.jpg", np.full((8, 8, 3), 188, dtype=np.uint8))
    np.testing.assert_allclose(texture_of(scene(tmp_path), Texture(path="image.jpg")), 0.5, atol=0.02)


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_an_exr_is_taken_as_it_is(tmp_path: Path, channels: int) -> None:
    pixels = np.random.default_rng(0).random((3, 5, channels), dtype=np.float32)
    write_exr(tmp_path / "image.exr", Image(pixels))
    linear = texture_of(scene(tmp_path), Texture(path="image.exr", color_space="linear"))
    np.testing.assert_array_equal(linear, np.broadcast_to(pixels[:, :, :3], (3, 5, 3)))


def test_textures_that_are_no_reflectance_are_refused(tmp_path: Path) -> None:
    write_exr(tmp_path / "bright.exr", Image(np.full((2, 2, 3), 1.5, dtype=np.float32)))
    write_exr(tmp_path / "nan.exr", Image(np.full((2, 2, 3), np.nan, dtype=np.float32)))
    write_exr(tmp_path / "two.exr", Image(np.zeros((2, 2, 2), dtype=np.float32)))
    for name, said in [("bright", "from 1.5 to 1.5"), ("nan", "from nan to nan"), ("two", "2 channels")]:
        with pytest.raises(SceneError, match=said):
            texture_of(scene(tmp_path), Texture(path=f"{name}.exr", color_space="linear"))


def test_an_exr_called_srgb_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match='say color_space = "linear"'):
        texture_of(scene(tmp_path), Texture(path="image.exr"))


def test_an_image_of_16_bits_is_refused(tmp_path: Path) -> None:
    import PIL.Image

    PIL.Image.fromarray(np.zeros((2, 2), dtype=np.uint16)).save(tmp_path / "deep.png")
    with pytest.raises(SceneError, match="mode I;16; allowed are 8 bits"):
        texture_of(scene(tmp_path), Texture(path="deep.png"))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("none.png", "No such file"),
        ("none.exr", "No such file"),
        ("note.txt", "allowed are .png"),
        ("bad.png", "cannot"),
    ],
)
def test_textures_that_cannot_be_read_are_refused(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / "note.txt").write_text("no image", encoding="ascii")
    (tmp_path / "bad.png").write_text("no image", encoding="ascii")
    with pytest.raises(SceneError, match=said):
        texture_of(scene(tmp_path), Texture(path=name, color_space="linear"))
