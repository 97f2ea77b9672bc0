"""A scene as Mitsuba's dictionary: first plain data, testable without rendering, then Mitsuba's own objects."""

from collections.abc import Callable, Iterable
from types import ModuleType
from typing import Any

import numpy as np

from reference.layers import layered_dict
from reference.plain import Plain, rgb
from scenes.errors import SceneError
from scenes.geometry import texture_of
from scenes.image import Float32
from scenes.materials import Fibre, Layered, Material, Principled, Texture, Translucent
from scenes.media import coefficients
from scenes.mesh import Interface, Mesh, Surface
from scenes.model import ConstantLight, DirectionalLight, EnvironmentLight, PointLight, Scene, Sensor, ThinLens
from scenes.shapes import Relief
from scenes.units import LengthUnit, Rgb

FARTHEST_FOCUS = 1e9
"""A lens that is focused farther away is focused here. Mitsuba squares the distance in float32 and is silently black
from 2e19 on; with lenses of a metre and images of 8192 pixels, blur differs from that of infinity by 1e-5 px.
"""


def sensor_dict(sensor: Sensor) -> Plain:
    """The camera with a one-sample box filter. Mitsuba refuses a lens of radius 0, which is a pinhole."""
    view: Plain = {
        "to_world": {"look_at": (sensor.origin, sensor.target, sensor.up)},
        "fov": sensor.fov_deg,
        "fov_axis": sensor.fov_axis,
        "near_clip": 1e-4,
        "far_clip": 1e7,
        "film": {
            "type": "hdrfilm",
            "width": sensor.width,
            "height": sensor.height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
        },
    }
    if isinstance(sensor, ThinLens) and sensor.aperture_radius > 0:
        focus = min(sensor.focus_distance, FARTHEST_FOCUS)
        return {"type": "thinlens", **view, "aperture_radius": sensor.aperture_radius, "focus_distance": focus}
    return {"type": "perspective", **view}


def bsdf_dict(material: Material | Interface, read_texture: Callable[[Texture], Float32]) -> Plain:
    """A material's surface, with textures left as linear arrays."""
    if isinstance(material, Translucent):
        return {"type": "null"}
    if isinstance(material, Interface):
        return {"type": "dielectric", "int_ior": material.ior, "ext_ior": 1.0}
    if isinstance(material, Layered | Principled):
        return layered_dict(material, read_texture)
    if isinstance(material, Fibre):
        raise SceneError('a "fibre" is what hair is made of; give the surface another material.')
    reflectance = material.reflectance
    if isinstance(reflectance, Texture):
        return {
            "type": "diffuse",
            "reflectance": {"type": "bitmap", "pixels": read_texture(reflectance), "wrap_mode": "repeat"},
        }
    return {"type": "diffuse", "reflectance": rgb(reflectance)}


def medium_dict(material: Translucent, length_unit: LengthUnit) -> Plain:
    """What fills a translucent body. Mitsuba takes colours up to 1 only, so a factor makes up for the rest."""
    sigma_a, sigma_s = coefficients(material, length_unit)
    sigma_t = sigma_a + sigma_s
    albedo = np.divide(sigma_s, sigma_t, out=np.zeros(3), where=sigma_t > 0)
    scale = float(sigma_t.max()) or 1.0
    return {
        "type": "homogeneous",
        "scale": scale,
        "sigma_t": rgb(tuple((sigma_t / scale).tolist())),
        "albedo": rgb(tuple(albedo.tolist())),
        "phase": {"type": "isotropic"},
    }


def mesh_dict(mesh: Mesh, read_texture: Callable[[Texture], Float32], length_unit: LengthUnit = "m") -> Plain:
    """A mesh with its surface left as arrays."""
    plain: Plain = {"type": "mesh", "surface": mesh.surface, "bsdf": bsdf_dict(mesh.material, read_texture)}
    if isinstance(mesh.material, Translucent):
        plain["interior"] = medium_dict(mesh.material, length_unit)
    if mesh.radiance is not None:
        plain["emitter"] = {"type": "area", "radiance": _emitted(mesh, mesh.radiance, read_texture)}
    return plain


def _emitted(mesh: Mesh, radiance: Rgb, read_texture: Callable[[Texture], Float32]) -> Plain:
    """Colours of emitters may exceed 1, which a bitmap of floats can hold."""
    if mesh.pattern is None:
        return rgb(radiance)
    pixels = read_texture(mesh.pattern) * np.array(radiance, dtype=np.float32)
    return {"type": "bitmap", "pixels": pixels, "wrap_mode": "repeat"}


def emitter_dicts(scene: Scene) -> Plain:
    """The emitters that are not surfaces."""
    plain: Plain = {}
    for i, emitter in enumerate(scene.emitters):
        name = f"light_{i}"
        match emitter:
            case PointLight():
                plain[name] = {"type": "point", "position": list(emitter.position), "intensity": rgb(emitter.intensity)}
            case DirectionalLight():
                plain[name] = {
                    "type": "directional",
                    "direction": list(emitter.direction),
                    "irradiance": rgb(emitter.irradiance),
                }
            case ConstantLight():
                plain[name] = {"type": "constant", "radiance": rgb(emitter.radiance)}
            case EnvironmentLight():
                plain[name] = {
                    "type": "envmap",
                    "filename": str(scene.folder / emitter.path),
                    "scale": emitter.scale,
                    "to_world": {"rotate_y_deg": 180.0},
                }
    return plain


def scene_dict(scene: Scene, meshes: Iterable[Mesh]) -> Plain:
    """The whole scene as plain data: what `instantiate` turns into Mitsuba's objects.

    Of the rays that meet a relief, whose triangles are smaller than a pixel, 5 in 100 000 would slip through between
    them: there rays are intersected robustly, which takes a fifth more time.
    """
    plain: Plain = {"type": "scene", "sensor": sensor_dict(scene.sensor)}
    if any(isinstance(shape, Relief) for shape in scene.shapes):
        plain["embree_use_robust_intersections"] = True
    for i, mesh in enumerate(meshes):
        plain[f"mesh_{i}"] = mesh_dict(mesh, lambda texture: texture_of(scene, texture), scene.length_unit)
    return plain | emitter_dicts(scene)


def instantiate(mi: ModuleType, plain: Plain) -> Any:
    """Mitsuba's scene; every mesh stays an object of its own (Mitsuba would merge those with equal materials)."""
    return mi.load_dict({key: _resolved(mi, key, value) for key, value in plain.items()}, optimize=False)


def _resolved(mi: ModuleType, key: str, value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    if key == "to_world":
        return _transform(mi, value)
    if value.get("type") == "mesh":
        return _mesh(mi, key, value)
    inner = {k: _resolved(mi, k, v) for k, v in value.items() if k != "pixels"}
    if value.get("type") == "bitmap":
        inner |= {"bitmap": mi.Bitmap(np.ascontiguousarray(value["pixels"])), "raw": True}
    return inner


def _transform(mi: ModuleType, value: Plain) -> Any:
    transform = mi.ScalarTransform4f()
    if "look_at" in value:
        origin, target, up = value["look_at"]
        return transform.look_at(origin=list(origin), target=list(target), up=list(up))
    return transform.rotate([0, 1, 0], value["rotate_y_deg"])


def _mesh(mi: ModuleType, name: str, value: Plain) -> Any:
    surface: Surface = value["surface"]
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(_resolved(mi, "bsdf", value["bsdf"]))
    if "emitter" in value:
        properties["mesh_emitter"] = mi.load_dict(_resolved(mi, "emitter", value["emitter"]))
    if "interior" in value:
        properties["interior"] = mi.load_dict(_resolved(mi, "interior", value["interior"]))
    mesh = mi.Mesh(
        name,
        vertex_count=len(surface.positions),
        face_count=len(surface.faces),
        has_vertex_normals=True,
        has_vertex_texcoords=True,
        props=properties,
    )
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = surface.positions.ravel()
    parameters["vertex_normals"] = surface.normals.ravel()
    # Mitsuba's bitmaps have v = 0 in their first row; the contract's v points up.
    parameters["vertex_texcoords"] = np.stack([surface.uvs[:, 0], 1 - surface.uvs[:, 1]], axis=1).ravel()
    parameters["faces"] = surface.faces.ravel()
    parameters.update()
    return mesh
