"""A scene with everything in it: what `reference.stage` leaves out of eyes, and hair.

The white of an eye gets the smooth film that lies on it, and behind its cornea come the iris, a disk or a bowl with a
hole for the pupil, and the ball of the endothelium. All else in there is black, as the insides of surfaces are.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from reference.curves import curve_dicts, for_the_latest_scene
from reference.plain import Plain, rgb
from reference.stage import Stage
from reference.start import mitsuba
from reference.strands import strands_of
from reference.to_mitsuba import bsdf_dict, instantiate, scene_dict
from scenes import eyes
from scenes.errors import SceneError
from scenes.geometry import geometry_of, placed, texture_of
from scenes.mesh import Surface
from scenes.model import Scene, SphereLight
from scenes.procedural import revolved, sphere
from scenes.shapes import Eye

ENDOTHELIUM_DETAIL = 5
IRIS_RINGS = 24


@for_the_latest_scene
def full_stage(scene: Scene) -> Stage:
    """The stage of the whole scene.

    Raises
    ------
    SceneError
        The scene has hair that is painted or not of a fibre, or a shape's chart cannot hold it.
    """
    mi = mitsuba()
    with tempfile.TemporaryDirectory() as folder:
        loaded = instantiate(mi, full_dict(scene) | _curves(scene, Path(folder)))
    return Stage(mi, scene, loaded, loaded.sensors()[0], (), scene.sensor.width, scene.sensor.height)


def _curves(scene: Scene, folder: Path) -> Plain:
    """The scene's hair, with its curves in files in `folder`."""
    painted = [hair.name for hair in scene.hair if hair.color is not None]
    if painted:
        raise SceneError(
            f"Scene '{scene.name}': found hair with a colour texture ({', '.join(painted)}); allowed is hair without "
            "one, as full_radiance says. Leave out `color`."
        )
    return curve_dicts(scene, strands_of(scene), folder) if scene.hair else {}


def full_dict(scene: Scene) -> Plain:
    """Everything but hair as plain data; see `reference.to_mitsuba.scene_dict`."""
    meshes = geometry_of(scene)
    plain = scene_dict(scene, meshes)
    balls = {f"emitter-{i}": light for i, light in enumerate(scene.emitters) if isinstance(light, SphereLight)}
    eyes_of = {f"{shape.name}/sclera": shape for shape in scene.shapes if isinstance(shape, Eye)}
    for i, mesh in enumerate(meshes):
        if mesh.name in eyes_of:
            dry = plain[f"mesh_{i}"]["bsdf"]
            plain[f"mesh_{i}"]["bsdf"] = {
                "type": "plastic",
                "int_ior": eyes_of[mesh.name].ior,
                "ext_ior": 1.0,
                "nonlinear": True,
                "diffuse_reflectance": dry["reflectance"],
            }
    plain |= {
        f"mesh_{i}": {
            "type": "sphere",
            "center": list(light.position),
            "radius": light.radius,
            "bsdf": {"type": "diffuse", "reflectance": rgb((0.0, 0.0, 0.0))},
            "emitter": {"type": "area", "radiance": rgb(light.radiance)},
        }
        for i, mesh in enumerate(meshes)
        for light in [balls.get(mesh.name)]
        if light is not None
    }
    for eye in eyes_of.values():
        for name, surface, bsdf in _inside(scene, eye):
            plain[f"{eye.name}_{name}"] = {"type": "mesh", "surface": placed(surface, eye), "bsdf": bsdf}
    return plain


def _inside(scene: Scene, eye: Eye) -> Iterator[tuple[str, Surface, Plain]]:
    """What lies behind a cornea: names, surfaces in the eye's frame and what they are made of."""
    yield "iris", iris(eye), bsdf_dict(scene.materials[eye.iris], lambda texture: texture_of(scene, texture))
    centre, inner = eyes.endothelium_centre(eye), eye.endothelium
    if centre is not None and inner is not None:
        ball = sphere(inner.radius, ENDOTHELIUM_DETAIL)
        moved = replace(ball, positions=ball.positions + np.array([0, centre, 0], dtype=np.float32))
        yield "endothelium", moved, {"type": "dielectric", "int_ior": inner.ior, "ext_ior": eye.ior}


def iris(eye: Eye) -> Surface:
    """The iris without its pupil, with exact normals and the texture coordinates that the cornea has."""
    rho = np.linspace(eye.limbus_radius, eye.pupil_radius, IRIS_RINGS + 1)
    centre = eyes.iris_centre(eye)
    if centre is None or eye.iris_curvature is None:
        profile = np.column_stack([rho, np.full_like(rho, eyes.iris_plane(eye))])
        normals = np.tile([0.0, 1.0], (len(rho), 1))
    else:
        profile = np.column_stack([rho, centre - np.sqrt(eye.iris_curvature**2 - rho**2)])
        normals = (np.array([0.0, centre]) - profile) / eye.iris_curvature
    surface = revolved(profile, normals, eye.detail)
    uvs = 0.5 + surface.positions[:, [0, 2]] * (0.5, -0.5) / eye.limbus_radius
    return replace(surface, uvs=np.clip(uvs, 0, 1).astype(np.float32))
