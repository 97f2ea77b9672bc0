"""glTF that another engine reads as the renderers see the scene."""

import base64
import io
import json
import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from realtime.camera import sensor_camera
from scenes import srgb
from scenes.errors import InputError
from scenes.geometry import geometry_of, texture_of
from scenes.gltf import Gltf, gltf_of, write_gltf
from scenes.load import library_scenes, load_scene
from scenes.materials import Texture
from scenes.model import DirectionalLight, PointLight, Scene

TYPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
COMPONENTS = {5126: "<f4", 5125: "<u4"}


def values(gltf: Gltf, number: int) -> Any:
    """The content of an accessor, checked against its own description."""
    accessor = gltf.document["accessors"][number]
    view = gltf.document["bufferViews"][accessor["bufferView"]]
    kind = np.dtype(COMPONENTS[accessor["componentType"]])
    width = TYPES[accessor["type"]]
    assert view["byteOffset"] % 4 == 0
    assert view["byteOffset"] + view["byteLength"] <= len(gltf.buffer)
    assert view["byteLength"] == accessor["count"] * width * kind.itemsize
    content = gltf.buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    found = np.frombuffer(content, kind).reshape(accessor["count"], width)
    if "min" in accessor:
        assert np.array_equal(found.min(axis=0), np.array(accessor["min"], dtype=np.float32))
        assert np.array_equal(found.max(axis=0), np.array(accessor["max"], dtype=np.float32))
    return found


def scene_named(name: str) -> Scene:
    return load_scene(library_scenes()[name])


@pytest.fixture
def load(tmp_path: Path) -> Callable[[str], Scene]:
    """A scene of one card, with more TOML added."""

    def make(more: str) -> Scene:
        path = tmp_path / "card.toml"
        path.write_text(CARD + more, encoding="utf-8")
        return load_scene(path)

    return make


CARD = """\
title = "A card"
subject = ["card"]
[sensor]
type = "perspective"
origin = [0.3, -0.2, 2.0]
target = [0.1, 0.4, -0.5]
up = [0.1, 1.0, 0.2]
fov_deg = 40.0
fov_axis = "y"
width = 32
height = 20
[materials]
grey = { type = "diffuse", reflectance = [0.5, 0.25, 0.125] }
[[shapes]]
name = "card"
type = "rectangle"
size = [1.0, 2.0]
material = "grey"
"""


@pytest.mark.parametrize("name", library_scenes())
def test_a_shipped_scene_becomes_valid_gltf(name: str) -> None:
    """You should see every reference point at something, and every number in its range: glTF 2.0, section 3."""
    gltf = gltf_of(scene_named(name))
    document = gltf.document
    assert document["asset"]["version"] == "2.0"
    assert document["buffers"] == [{"byteLength": len(gltf.buffer)}]
    assert len(gltf.buffer) % 4 == 0
    assert document["scenes"][0]["nodes"] == list(range(len(document["nodes"])))
    used: set[str] = set()
    for material in document["materials"]:
        used |= set(material["extensions"])
        factor = material["pbrMetallicRoughness"].get("baseColorFactor", [1, 1, 1, 1])
        assert all(0 <= c <= 1 for c in [*factor, *material.get("emissiveFactor", [0])])
    for light in document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", []):
        used.add("KHR_lights_punctual")
        assert light["intensity"] >= 0
        assert all(0 <= c <= 1 for c in light["color"])
    assert document["extensionsUsed"] == sorted(used)
    for mesh in document["meshes"]:
        (primitive,) = mesh["primitives"]
        assert primitive["material"] < len(document["materials"])
        positions = values(gltf, primitive["attributes"]["POSITION"])
        normals = values(gltf, primitive["attributes"]["NORMAL"])
        assert len(positions) == len(normals) == len(values(gltf, primitive["attributes"]["TEXCOORD_0"]))
        assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 5e-4
        indices = values(gltf, primitive["indices"])
        assert len(indices) % 3 == 0
        assert indices.max() < len(positions)
    json.dumps(document, allow_nan=False)


def test_meshes_are_those_of_both_renderers() -> None:
    scene = scene_named("small-room-knot")
    gltf = gltf_of(scene)
    meshes = geometry_of(scene)
    assert [m["name"] for m in gltf.document["meshes"]] == [m.name for m in meshes]
    for mesh, written in zip(meshes, gltf.document["meshes"], strict=True):
        (primitive,) = written["primitives"]
        attributes = {name: values(gltf, number) for name, number in primitive["attributes"].items()}
        assert np.array_equal(attributes["POSITION"], mesh.surface.positions)
        assert np.array_equal(attributes["NORMAL"], mesh.surface.normals)
        assert np.allclose(attributes["TEXCOORD_0"], [[0, 1]] + mesh.surface.uvs * [[1, -1]], atol=1e-7)
        assert np.array_equal(values(gltf, primitive["indices"]).reshape(-1, 3), mesh.surface.faces)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_camera_sees_each_point_at_the_same_pixel(load: Callable[[str], Scene], axis: str) -> None:
    """Points without any symmetry: a swapped axis, a sign or a wrong field of view moves them."""
    scene = load("")
    sensor = scene.sensor.model_copy(update={"fov_axis": axis})
    document = gltf_of(scene.model_copy(update={"sensor": sensor})).document
    node = next(node for node in document["nodes"] if "camera" in node)
    perspective = document["cameras"][node["camera"]]["perspective"]
    to_camera = np.linalg.inv(np.array(node["matrix"]).reshape(4, 4).T)
    points = np.array([[0.2, 0.5, -0.3, 1], [-0.4, 0.1, 0.6, 1], [0.9, -0.7, -2.0, 1]])
    x, y, z, _ = to_camera @ points.T
    tangent = math.tan(perspective["yfov"] / 2)
    found = np.stack([x / -z / (tangent * perspective["aspectRatio"]), y / -z / tangent])
    clip = sensor_camera(sensor, 0.1, 10.0).matrix @ points.T
    assert np.allclose(found, clip[:2] / clip[3], atol=1e-12)


def test_lights_keep_their_radiometric_numbers(load: Callable[[str], Scene]) -> None:
    scene = load(
        """
[[emitters]]
type = "point"
position = [1.0, 2.0, 3.0]
intensity = [6.0, 3.0, 1.5]
[[emitters]]
type = "directional"
direction = [1.0, -2.0, 0.5]
irradiance = [0.0, 4.0, 2.0]
"""
    )
    document = gltf_of(scene).document
    lights = document["extensions"]["KHR_lights_punctual"]["lights"]
    nodes = [node for node in document["nodes"] if "KHR_lights_punctual" in node.get("extensions", {})]
    point, directional = scene.emitters
    assert isinstance(point, PointLight)
    assert isinstance(directional, DirectionalLight)
    assert (lights[0]["type"], lights[1]["type"]) == ("point", "directional")
    assert np.allclose(np.array(lights[0]["color"]) * lights[0]["intensity"], point.intensity)
    assert np.allclose(np.array(lights[1]["color"]) * lights[1]["intensity"], directional.irradiance)
    assert nodes[0]["translation"] == list(point.position)
    pose = np.array(nodes[1]["matrix"]).reshape(4, 4).T
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    assert np.allclose(
        pose[:3, :3] @ [0, 0, -1], np.array(directional.direction) / np.linalg.norm(directional.direction)
    )


def test_surfaces_are_lambertian_and_emitters_shine_from_their_front(load: Callable[[str], Scene]) -> None:
    scene = load('[[emitters]]\ntype = "area"\nshape = "card"\nradiance = [3.0, 12.0, 6.0]\n')
    (material,) = gltf_of(scene).document["materials"]
    assert material["doubleSided"] is False
    assert material["pbrMetallicRoughness"] == {
        "metallicFactor": 0.0,
        "roughnessFactor": 1.0,
        "baseColorFactor": [0.5, 0.25, 0.125, 1.0],
    }
    assert material["extensions"]["KHR_materials_specular"] == {"specularFactor": 0.0}
    strength = material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"]
    assert np.allclose(np.array(material["emissiveFactor"]) * strength, [3, 12, 6])


def test_a_texture_is_srgb_encoded_as_gltf_wants_it() -> None:
    scene = scene_named("defocus-row")
    gltf = gltf_of(scene)
    image = gltf.document["images"][0]
    view = gltf.document["bufferViews"][image["bufferView"]]
    png = gltf.buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    codes = np.asarray(PIL.Image.open(io.BytesIO(png)))
    linear = texture_of(scene, Texture(path=image["name"]))
    assert codes.dtype == np.uint8
    assert np.abs(srgb.decode(codes / 255) - linear).max() < 1e-6


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("defocus-row", "lens of radius"),
        ("skin-ear", "sigma_a and sigma_s"),
        ("skin-ear", "Lengths are in mm"),
        ("suit-woven", "Layered and principled surfaces show their base alone"),
        ("eye-human-view75", "iris and pupil"),
        ("character", "Hair is no mesh here"),
        ("character", "other than defocus_radiance and full_radiance look"),
        ("character", "name files that are not in this one: assets/iris.png."),
        ("suit-woven", "name files that are not in this one: assets/"),
    ],
)
def test_what_gltf_cannot_say_is_said(name: str, says: str) -> None:
    assert any(says in note for note in gltf_of(scene_named(name)).notes)


def test_what_gltf_cannot_say_is_in_extras() -> None:
    skin = gltf_of(scene_named("skin-ear")).document
    medium = next(m["extras"]["lightgauge"] for m in skin["materials"] if "extras" in m)
    assert medium == {"type": "translucent", "sigma_a": [0.032, 0.17, 0.48], "sigma_s": [0.74, 0.88, 1.01]}
    (suit,) = gltf_of(scene_named("suit-plastic-light1")).document["materials"]
    assert suit["pbrMetallicRoughness"]["baseColorFactor"] == [0.06, 0.12, 0.4, 1.0]
    assert suit["extras"]["lightgauge"]["film"] == {"ior": 1.5, "alpha": 0.35}
    eye = gltf_of(scene_named("eye-human-view75")).document["scenes"][0]["extras"]["lightgauge"]
    assert eye["eyes"][0]["type"] == "eye"
    hair = gltf_of(scene_named("hair-groomed")).document["scenes"][0]["extras"]["lightgauge"]
    assert hair["hair"][0]["on"] == scene_named("hair-groomed").hair[0].on
    assert hair["materials"][hair["hair"][0]["material"]]["type"] == "fibre"
    lens = gltf_of(scene_named("defocus-row")).document["nodes"][0]["extras"]["lightgauge"]
    assert lens["focus_distance"] == 2


def test_a_sky_is_in_extras(load: Callable[[str], Scene]) -> None:
    gltf = gltf_of(load('[[emitters]]\ntype = "constant"\nradiance = [1.0, 2.0, 3.0]\n'))
    assert gltf.document["scenes"][0]["extras"]["lightgauge"]["emitters"] == [
        {"type": "constant", "radiance": [1.0, 2.0, 3.0]}
    ]
    assert any("infinitely far" in note for note in gltf.notes)


def test_a_glb_is_read_by_another_program(tmp_path: Path) -> None:
    import trimesh

    scene = scene_named("small-room-ellipsoid")
    path = tmp_path / "room.glb"
    write_gltf(path, gltf_of(scene))
    magic, version, length = struct.unpack("<III", path.read_bytes()[:12])
    assert (magic, version, length) == (0x46546C67, 2, path.stat().st_size)
    read = trimesh.load_scene(path)
    expected = {mesh.name: mesh.surface for mesh in geometry_of(scene)}
    assert set(read.geometry) == set(expected)
    for name, mesh in read.geometry.items():
        assert np.allclose(mesh.bounds, [expected[name].positions.min(axis=0), expected[name].positions.max(axis=0)])
        assert len(mesh.faces) == len(expected[name].faces)


def test_a_gltf_holds_its_buffer_itself(tmp_path: Path, load: Callable[[str], Scene]) -> None:
    gltf = gltf_of(load(""))
    path = tmp_path / "card.gltf"
    write_gltf(path, gltf)
    document = json.loads(path.read_text(encoding="utf-8"))
    assert base64.b64decode(document["buffers"][0]["uri"].partition(",")[2]) == gltf.buffer


@pytest.mark.parametrize("name", ["card.obj", "card", "missing/card.glb"])
def test_a_file_that_cannot_be_written_is_refused(tmp_path: Path, load: Callable[[str], Scene], name: str) -> None:
    with pytest.raises(InputError, match=r"allowed are \.glb and \.gltf|cannot be written"):
        write_gltf(tmp_path / name, gltf_of(load("")))
