"""An eye as the shaders need it: its geometry, the sensor and the lights in its own frame, its iris, what it mirrors.

All lengths are those of the scene; the eye's frame only turns and moves (see scenes/eyes.py).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import ray_axes
from realtime.capture import surfel_passes
from realtime.frame import Frame, columns
from realtime.fresnel import fresnel_dielectric
from realtime.graph import Pass
from realtime.lights import Light
from realtime.sky import sky_texture
from scenes import eyes
from scenes.errors import InputError
from scenes.features import Features
from scenes.geometry import diffuse_reflectance
from scenes.image import Float32, Float64
from scenes.materials import Texture
from scenes.mesh import Mesh
from scenes.model import DiskLight, Scene
from scenes.procedural import rotation_xyz
from scenes.shapes import Eye

if TYPE_CHECKING:
    import moderngl


@dataclass(frozen=True)
class EyeModel:
    """The struct of glsl/lib/eye.glsl. `iris_curvature` and `iris_centre` are 0 if the iris is flat."""

    sclera_radius: float
    cornea_radius: float
    cornea_centre: float
    limbus_radius: float
    limbus_height: float
    apex: float
    iris_plane: float
    iris_curvature: float
    iris_centre: float
    pupil_radius: float
    ior: float
    front_ior: float

    @property
    def cap_cosine(self) -> float:
        """Cosine of the angle between the axis and the cornea's rim, seen from the centre of the cornea's sphere."""
        return math.sqrt(1 - (self.limbus_radius / self.cornea_radius) ** 2)


def the_eye(scene: Scene) -> Eye:
    """The eye that is judged.

    Raises
    ------
    InputError
        The subject holds no eye, more than one, or one whose sclera has a texture.
    """
    found = [shape for shape in scene.shapes if isinstance(shape, Eye) and shape.name in scene.subject]
    if len(found) != 1:
        raise InputError(
            f"Found {len(found)} eyes in the subject of '{scene.name}'; the techniques of the cornea draw exactly one. "
            'Name one shape of type "eye" in `subject`.'
        )
    if isinstance(diffuse_reflectance(scene.materials[found[0].material]), Texture):
        raise InputError(
            f"Found a texture on the sclera of '{found[0].name}'; the techniques of the cornea draw a sclera of one "
            "colour. Give its material a constant reflectance."
        )
    return found[0]


def eye_model(eye: Eye) -> EyeModel:
    """The geometry of an eye in lengths of the scene."""
    lengths = {
        "sclera_radius": eye.sclera_radius,
        "cornea_radius": eye.cornea_radius,
        "cornea_centre": eyes.cornea_centre(eye),
        "limbus_radius": eye.limbus_radius,
        "limbus_height": eyes.limbus_height(eye),
        "apex": eyes.apex(eye),
        "iris_plane": eyes.iris_plane(eye),
        "iris_curvature": eye.iris_curvature or 0.0,
        "iris_centre": eyes.iris_centre(eye) or 0.0,
        "pupil_radius": eye.pupil_radius,
    }
    scaled = {name: eye.scale * length for name, length in lengths.items()}
    return EyeModel(**scaled, ior=eye.ior, front_ior=eye.ior)


def with_one_surface(eye: Eye, keratometric_index: float) -> EyeModel:
    """An eye whose cornea has two surfaces as one with a single surface: the front one, before the keratometric index.

    The index is chosen so that the front surface alone has the power of both: 1.3375 for human eyes (Olsen 1986, "On
    the calculation of power from curvature of the cornea"). An eye without an endothelium stays as it is.
    """
    model = eye_model(eye)
    return model if eye.endothelium is None else replace(model, ior=keratometric_index)


def eye_uniforms(frame: Frame, eye: Eye, model: EyeModel) -> dict[str, Any]:
    """The uniforms of eye/uniforms.glsl, and the sensor's axes for shaders that make their own rays."""
    camera, rotation = frame.camera, rotation_xyz(eye.rotation_deg)
    forward, right, up = ray_axes(camera)
    axes = {"view_forward": forward, "view_right": right, "view_up": up}
    return {
        **{f"eyeball.{name}": value for name, value in asdict(model).items()},
        "view_origin": tuple(to_eye_frame(eye, camera.eye)),
        "eye_to_world": columns(rotation),
        **{name: tuple(axis @ rotation) for name, axis in axes.items()},
    }


def to_eye_frame(eye: Eye, points: Float64) -> Float64:
    """World positions (..., 3) in the eye's frame."""
    moved: Float64 = (points - np.array(eye.position)) @ rotation_xyz(eye.rotation_deg)
    return moved


def lights_in_eye_frame(eye: Eye, lights: list[Light]) -> list[Light]:
    """The lights moved and turned."""
    rotation = rotation_xyz(eye.rotation_deg)
    return [replace(x, place=to_eye_frame(eye, x.place), axis=x.axis @ rotation) for x in lights]


def disks_in_eye_frame(eye: Eye, scene: Scene) -> Float32:
    """The disk lights as rows (N, 3, 4): centre and radius, normal, radiance."""
    rotation = rotation_xyz(eye.rotation_deg)
    disks = [light for light in scene.emitters if isinstance(light, DiskLight)]
    rows = np.zeros((len(disks), 3, 4), dtype=np.float32)
    for row, disk in zip(rows, disks, strict=True):
        normal = np.array(disk.normal) / np.linalg.norm(disk.normal) @ rotation
        row[:] = (*to_eye_frame(eye, np.array(disk.position)), disk.radius), (*normal, 0.0), (*disk.radiance, 0.0)
    return rows


def sclera_albedo(scene: Scene, eye: Eye) -> tuple[float, ...]:
    """The constant reflectance of the white."""
    reflectance = diffuse_reflectance(scene.materials[eye.material])
    assert not isinstance(reflectance, Texture), "the_eye refuses textures"
    return reflectance


def iris_texture(frame: Frame, eye: Eye) -> moderngl.Texture:
    """The reflectance over the iris' coordinate, filtered linearly."""

    def upload() -> moderngl.Texture:
        made = frame.reflectance_texture(frame.scene.materials[eye.iris])
        made.repeat_y = False
        return made

    return frame.once("iris", upload)


def diffuse_internal_reflectance(ior: float) -> float:
    """The part of diffuse light inside a medium that its smooth surface throws back: 2 times the integral of F cos.

    By Gauss-Legendre in the squared sine, cut at the critical angle, beyond which all of it is thrown back.
    """
    nodes, weights = np.polynomial.legendre.leggauss(64)
    # sin² = (1 - (1 - x)²) / n², x in [0, 1], puts the nodes close to the critical angle, where F has no finite slope.
    x, w = (nodes + 1) / 2, weights / 2
    sin2 = (1 - (1 - x) ** 2) / ior**2
    inside = np.sum(w * 2 * (1 - x) / ior**2 * fresnel_dielectric(np.sqrt(1 - sin2), 1 / ior))
    return float(inside + 1 - 1 / ior**2)


def sky_pass(features: Features) -> Pass:
    """Write `sky`, if there is one."""
    return Pass("sky", _sky, writes=("sky",), skip="" if features.has_sky else "there is no sky")


def mirrored_passes(features: Features, side: int, shadow_side: int) -> list[Pass]:
    """What the eye mirrors: `sky`, and the surroundings in `cube_radiance` if they reflect any light.

    Parameters
    ----------
    side : texels along an edge of the captured faces
    shadow_side : texels along an edge of a shadow tile of the lights on the surroundings
    """
    black = "" if features.brightest_reflectance > 0 else "nothing around the eye reflects light"
    captured = surfel_passes(features, side, side, shadow_side, facets=16)
    return [*(replace(step, skip=step.skip or black) for step in captured), sky_pass(features)]


def _sky(frame: Frame) -> None:
    frame.resources["sky"] = sky_texture(frame)


def bind_surroundings(frame: Frame) -> dict[str, int]:
    """Bind what eye/surroundings.glsl reads; returns its defines."""
    defines = {}
    for unit, name, define in ((4, "cube_radiance", "SURROUNDINGS"), (5, "sky", "SKY")):
        if name in frame.resources:
            frame.resources[name].use(unit)
            defines[define] = 1
    return defines


def is_eye(eye: Eye, mesh: Mesh) -> bool:
    """Whether a mesh is a part of that eye."""
    return mesh.shape == eye.name
