"""A scene as glTF 2.0, so that another engine can render it.

Khronos Group 2021, "glTF 2.0 Specification"; lights: KHR_lights_punctual; emitters: KHR_materials_emissive_strength;
surfaces without the gloss that glTF gives to all others: KHR_materials_specular.

Every number of light is radiometric. glTF asks for candela, lux and nit; here these stand for W/sr, W/m² and
W/(m² sr), with the scene's unit of length. An engine that shows a surface of 1 nit as the value 1 then renders what the
truth is in. Whatever glTF has no words for is in `extras.lightgauge` of the scene and of its nodes, in the scene's own
keys, and in the notes.
"""

import base64
import io
import json
import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes import srgb
from scenes.errors import InputError
from scenes.geometry import geometry_of, texture_of
from scenes.image import Float32, Float64
from scenes.materials import Diffuse, Layered, Principled, Texture, Translucent
from scenes.media import coefficients
from scenes.mesh import Interface, Mesh
from scenes.model import ConstantLight, DirectionalLight, EnvironmentLight, Perspective, PointLight, Scene, ThinLens
from scenes.procedural import normalised
from scenes.shapes import Eye
from scenes.units import Rgb, Vec3

Json = dict[str, Any]

FLOAT, UNSIGNED_INT = 5126, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
LINEAR, REPEAT = 9729, 10497

NEAR = 1e-3
"""Of the distance from the camera to its target: the near plane, which glTF requires and a truth does not have."""

SUFFIXES = (".glb", ".gltf")
GLB_MAGIC, GLB_JSON, GLB_BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942

UNITS = "W/sr, W/m² and W/(m² sr) stand where glTF has candela, lux and nit; nothing is multiplied by 683 lm/W"


@dataclass(frozen=True)
class Gltf:
    """A glTF document, its one binary buffer, and what it does not say, a sentence each."""

    document: Json
    buffer: bytes
    notes: tuple[str, ...]


def gltf_of(scene: Scene) -> Gltf:
    """Camera, meshes as both sides see them, materials and lights.

    Raises
    ------
    SceneError
        Some shapes cannot be built, or a texture cannot be read.
    """
    draft = _Draft(scene)
    nodes = [_camera_node(scene.sensor)]
    nodes += [draft.mesh_node(mesh) for mesh in geometry_of(scene)]
    lights = [light for light in scene.emitters if isinstance(light, PointLight | DirectionalLight)]
    nodes += [_light_node(i, light) for i, light in enumerate(lights)]
    document: Json = {
        "asset": {"version": "2.0", "generator": "lightgauge"},
        "scene": 0,
        "scenes": [{"name": scene.name, "nodes": list(range(len(nodes))), "extras": {"lightgauge": _extras(scene)}}],
        "nodes": nodes,
        "cameras": [_camera(scene.sensor)],
        "meshes": draft.meshes,
        "materials": draft.materials,
        "accessors": draft.accessors,
        "bufferViews": draft.views,
        "buffers": [{"byteLength": len(draft.buffer)}],
    }
    if draft.images:
        textures = [{"source": i, "sampler": 0} for i in range(len(draft.images))]
        sampler = {"magFilter": LINEAR, "minFilter": LINEAR, "wrapS": REPEAT, "wrapT": REPEAT}
        document |= {"images": draft.images, "textures": textures, "samplers": [sampler]}
    if lights:
        document["extensions"] = {"KHR_lights_punctual": {"lights": [_punctual(light) for light in lights]}}
    used = {name for material in draft.materials for name in material.get("extensions", {})}
    document["extensionsUsed"] = sorted(used | ({"KHR_lights_punctual"} if lights else set()))
    return Gltf(document, bytes(draft.buffer), tuple(_notes(scene)))


def write_gltf(path: Path, gltf: Gltf) -> None:
    """Write one file that holds everything: binary if it ends in .glb, text if in .gltf.

    Raises
    ------
    InputError
        It ends in something else, or cannot be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: found a name that ends in {path.suffix or 'nothing'!r}; allowed are .glb and .gltf.")
    try:
        path.write_bytes(_glb(gltf) if path.suffix.lower() == ".glb" else _text(gltf))
    except OSError as error:
        raise InputError(
            f"{path}: cannot be written ({error.strerror}). Choose a folder that exists, is writable and has room."
        ) from error


def _glb(gltf: Gltf) -> bytes:
    """glTF 2.0, section 4, "GLB File Format"."""
    text = json.dumps(gltf.document, separators=(",", ":"), allow_nan=False).encode()
    chunks = [(GLB_JSON, text + b" " * (-len(text) % 4)), (GLB_BINARY, gltf.buffer)]
    body = b"".join(struct.pack("<II", len(content), kind) + content for kind, content in chunks)
    return struct.pack("<III", GLB_MAGIC, 2, 12 + len(body)) + body


def _text(gltf: Gltf) -> bytes:
    uri = "data:application/octet-stream;base64," + base64.b64encode(gltf.buffer).decode()
    document = gltf.document | {"buffers": [{"byteLength": len(gltf.buffer), "uri": uri}]}
    return json.dumps(document, indent=1, allow_nan=False).encode()


@dataclass
class _Draft:
    """The parts of a document that refer to one another by number, while they are collected."""

    scene: Scene
    buffer: bytearray = field(default_factory=bytearray)
    views: list[Json] = field(default_factory=list)
    accessors: list[Json] = field(default_factory=list)
    meshes: list[Json] = field(default_factory=list)
    materials: list[Json] = field(default_factory=list)
    images: list[Json] = field(default_factory=list)
    numbers: dict[Texture, int] = field(default_factory=dict)

    def mesh_node(self, mesh: Mesh) -> Json:
        surface = mesh.surface
        below = np.stack([surface.uvs[:, 0], 1 - surface.uvs[:, 1]], axis=1)  # glTF's v points down
        attributes = {
            "POSITION": self.accessor(surface.positions, "VEC3", ARRAY_BUFFER, bounds=True),
            "NORMAL": self.accessor(surface.normals, "VEC3", ARRAY_BUFFER),
            "TEXCOORD_0": self.accessor(below, "VEC2", ARRAY_BUFFER),
        }
        indices = self.accessor(surface.faces.reshape(-1), "SCALAR", ELEMENT_ARRAY_BUFFER)
        material = self.number_of(self.material(mesh))
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        self.meshes.append({"name": mesh.name, "primitives": [primitive]})
        extras = {"shape": mesh.shape, "is_subject": mesh.is_subject}
        return {"name": mesh.name, "mesh": len(self.meshes) - 1, "extras": {"lightgauge": extras}}

    def accessor(self, values: NDArray[Any], kind: str, target: int, *, bounds: bool = False) -> int:
        is_index = target == ELEMENT_ARRAY_BUFFER
        packed = np.ascontiguousarray(values, dtype="<u4" if is_index else "<f4")
        accessor: Json = {
            "bufferView": self.view(packed.tobytes(), target),
            "componentType": UNSIGNED_INT if is_index else FLOAT,
            "count": len(packed),
            "type": kind,
        }
        if bounds:
            accessor |= {"min": packed.min(axis=0).tolist(), "max": packed.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def view(self, content: bytes, target: int | None = None) -> int:
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(content)}
        self.views.append(view | ({"target": target} if target is not None else {}))
        self.buffer += content + bytes(-len(content) % 4)
        return len(self.views) - 1

    def number_of(self, material: Json) -> int:
        if material not in self.materials:
            self.materials.append(material)
        return self.materials.index(material)

    def material(self, mesh: Mesh) -> Json:
        """Lambertian: rough, no metal, no specular reflection. Seen from the front only."""
        surface: Json = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
        extensions: Json = {"KHR_materials_specular": {"specularFactor": 0.0}}
        material: Json = {"doubleSided": False}
        match mesh.material:
            case Diffuse(reflectance=Texture() as texture) | Layered(reflectance=Texture() as texture):
                surface["baseColorTexture"] = {"index": self.texture(texture)}
            case Diffuse(reflectance=reflectance) | Layered(reflectance=reflectance):
                assert not isinstance(reflectance, Texture)
                surface["baseColorFactor"] = [*reflectance, 1.0]
            case Translucent() as translucent:
                sigma_a, sigma_s = (c.tolist() for c in coefficients(translucent, self.scene.length_unit))
                surface["baseColorFactor"] = [1.0, 1.0, 1.0, 1.0]
                medium = {"type": "translucent", "sigma_a": sigma_a, "sigma_s": sigma_s}
                material["extras"] = {"lightgauge": medium}
            case Principled(base_color=color):
                surface["baseColorFactor"] = [*color, 1.0]
            case Interface(ior=ior):
                surface["roughnessFactor"] = 0.0
                extensions = {
                    "KHR_materials_transmission": {"transmissionFactor": 1.0},
                    "KHR_materials_ior": {"ior": ior},
                }
        if isinstance(mesh.material, Layered | Principled):
            material["extras"] = {"lightgauge": mesh.material.model_dump(mode="json")}
        if mesh.radiance is not None and max(mesh.radiance) > 0:
            strength = max(mesh.radiance)
            material["emissiveFactor"] = [c / strength for c in mesh.radiance]
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
            if mesh.pattern is not None:
                material["emissiveTexture"] = {"index": self.texture(mesh.pattern)}
        return material | {"pbrMetallicRoughness": surface, "extensions": extensions}

    def texture(self, texture: Texture) -> int:
        """glTF's textures of colours are sRGB-encoded, whatever the file holds."""
        if texture not in self.numbers:
            self.numbers[texture] = len(self.images)
            png = _png(texture_of(self.scene, texture))
            self.images.append({"name": texture.path, "mimeType": "image/png", "bufferView": self.view(png)})
        return self.numbers[texture]


def _png(linear: Float32) -> bytes:
    import PIL.Image

    content = io.BytesIO()
    codes = np.rint(255 * srgb.encode(linear)).astype(np.uint8)
    PIL.Image.fromarray(codes).save(content, format="PNG", optimize=True)
    return content.getvalue()


def _camera(sensor: Perspective) -> Json:
    aspect = sensor.width / sensor.height
    tangent = math.tan(math.radians(sensor.fov_deg) / 2)
    perspective = {
        "yfov": 2 * math.atan(tangent / aspect if sensor.fov_axis == "x" else tangent),
        "aspectRatio": aspect,
        "znear": NEAR * math.dist(sensor.origin, sensor.target),
    }
    return {"type": "perspective", "perspective": perspective}


def _camera_node(sensor: Perspective) -> Json:
    """A camera looks along its own -z, with +y up."""
    backward = normalised(np.array(sensor.origin) - np.array(sensor.target))
    right = normalised(np.cross(sensor.up, backward))
    pose = _matrix(right, np.cross(backward, right), backward, sensor.origin)
    return {"name": "sensor", "camera": 0, "matrix": pose, "extras": {"lightgauge": sensor.model_dump(mode="json")}}


def _matrix(x: Float64, y: Float64, z: Float64, origin: Vec3) -> list[float]:
    """Column after column: where the axes and the origin of a node go."""
    return [float(c) for column, last in ((x, 0), (y, 0), (z, 0), (origin, 1)) for c in (*column, last)]


def _punctual(light: PointLight | DirectionalLight) -> Json:
    if isinstance(light, PointLight):
        return {"type": "point"} | _coloured(light.intensity)
    return {"type": "directional"} | _coloured(light.irradiance)


def _coloured(rgb: Rgb) -> Json:
    """A colour up to 1, and its factor."""
    strength = max(rgb)
    return {"color": [c / strength for c in rgb] if strength > 0 else [1.0, 1.0, 1.0], "intensity": strength}


def _light_node(number: int, light: PointLight | DirectionalLight) -> Json:
    node: Json = {"name": f"light-{number}", "extensions": {"KHR_lights_punctual": {"light": number}}}
    if isinstance(light, PointLight):
        return node | {"translation": list(light.position)}
    backward = -normalised(np.array(light.direction))
    helper = np.eye(3)[int(np.argmin(np.abs(backward)))]
    right = normalised(np.cross(helper, backward))
    return node | {"matrix": _matrix(right, np.cross(backward, right), backward, (0.0, 0.0, 0.0))}


def _extras(scene: Scene) -> Json:
    """What an engine's own importer may want to know: in the scene's keys, as in its TOML."""
    skies = [light for light in scene.emitters if isinstance(light, ConstantLight | EnvironmentLight)]
    eyes = [shape for shape in scene.shapes if isinstance(shape, Eye)]
    extras: Json = {
        "title": scene.title,
        "length_unit": scene.length_unit,
        "units_of_light": UNITS,
        "subject": list(scene.subject),
    }
    if skies:
        extras["emitters"] = [light.model_dump(mode="json") for light in skies]
    if eyes:
        extras["eyes"] = [eye.model_dump(mode="json") for eye in eyes]
    if scene.hair:
        extras["hair"] = [hair.model_dump(mode="json") for hair in scene.hair]
    if eyes or scene.hair:
        extras["materials"] = {name: material.model_dump(mode="json") for name, material in scene.materials.items()}
    return extras


def _notes(scene: Scene) -> Iterator[str]:
    """What glTF cannot say, as far as the scene has it."""
    yield f"Light is radiometric: {UNITS}."
    yield "Surfaces are Lambertian (specularFactor 0) and one-sided: their backs are black, not see-through."
    if scene.length_unit != "m":
        yield f"Lengths are in {scene.length_unit}, not in glTF's metres: whoever rescales them must rescale light."
    if isinstance(scene.sensor, ThinLens):
        yield (
            f"The camera has a lens of radius {scene.sensor.aperture_radius:g}, focused at "
            f"{scene.sensor.focus_distance:g}: in the extras of its node. Quantities other than defocus_radiance and "
            "full_radiance look through its centre."
        )
    kinds = {type(emitter) for emitter in scene.emitters}
    if kinds & {ConstantLight, EnvironmentLight}:
        yield "Light from infinitely far away (constant, environment) is in the extras of the scene."
    if any(isinstance(material, Translucent) for material in scene.materials.values()):
        yield "Translucent bodies are white shells; their sigma_a and sigma_s are in the extras of their material."
    if any(isinstance(material, Layered | Principled) for material in scene.materials.values()):
        yield "Layered and principled surfaces show their base alone; the rest is in the extras of their material."
    if any(isinstance(shape, Eye) for shape in scene.shapes):
        yield "An eye has its sclera and its cornea as meshes; iris and pupil are in the extras of the scene."
    if scene.hair:
        yield "Hair is no mesh here: what grows where, and its fibres, are in the extras of the scene."
    if left_out := _files_left_out(scene):
        yield f"The extras name files that are not in this one: {', '.join(left_out)}. They are beside the scene."
    if _has_texture(scene):
        yield "Textures are PNG of 8 bits, sRGB-encoded, filtered linearly, repeated."


def _files_left_out(scene: Scene) -> list[str]:
    """Paths of what the extras name and no mesh shows: parts of metals, irises, controls of hair, skies."""
    parts = [metal.weight for it in scene.materials.values() if isinstance(it, Layered) for metal in it.metals]
    irises = [scene.materials[shape.iris] for shape in scene.shapes if isinstance(shape, Eye)]
    colors = [it.reflectance for it in irises if isinstance(it, Diffuse)]
    controls = [texture for hair in scene.hair for texture in hair.textures]
    textures = [it.path for it in [*parts, *colors, *controls] if isinstance(it, Texture)]
    return sorted({*textures, *(light.path for light in scene.emitters if isinstance(light, EnvironmentLight))})


def _has_texture(scene: Scene) -> bool:
    reflected = [m.reflectance for m in scene.materials.values() if isinstance(m, Diffuse | Layered)]
    emitted = [getattr(emitter, "texture", None) for emitter in scene.emitters]
    return any(isinstance(it, Texture) for it in [*reflected, *emitted])
