"""The eye by rays through its true spheres, with the light that its cornea bends, focuses, mirrors and throws back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.eye import (
    EyeModel,
    bind_surroundings,
    diffuse_internal_reflectance,
    disks_in_eye_frame,
    eye_uniforms,
    iris_texture,
    lights_in_eye_frame,
    mirrored_passes,
    sclera_albedo,
    sky_pass,
    the_eye,
    with_one_surface,
)
from realtime.eye_exchange import RINGS, SECTORS, iris_exchange
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.lights import light_rows
from realtime.shadows import scene_lights
from realtime.technique import Parameter, Technique
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.image import Float32
from scenes.model import Scene
from scenes.shapes import Eye

if TYPE_CHECKING:
    import moderngl

BOUNCES = 16
"""The cornea throws back less than a half of what leaves the iris on the whole: 1e-5 of it is left after so many."""

GRID = 4
"""Samples along each side of a pixel: two leave an error of 2 % where the iris' texture is finer than a pixel."""

GEOMETRY = (
    Parameter("keratometric_index", 1.3375, (1.3315, 1.336, 1.3375), "of an eye with an endothelium", (1.01, 3)),
)
CAUSTICS = {"focus": {}, "flat": {"FLAT": 1}, "straight": {"STRAIGHT": 1}}
"""What each choice defines for eye/iris_light.glsl."""

LIGHT = (
    Parameter(
        "caustics",
        "focus",
        tuple(CAUSTICS),
        "focus: light is bent and focused; flat: bent alone; straight: neither",
        off="straight",
    ),
    Parameter(
        "interreflection", True, (False, True), "whether light goes back and forth between iris and cornea", off=False
    ),
    Parameter("bend_steps", 4, (0, 1, 2, 4, 8), "Newton steps to where light enters the cornea", (0, 100), off=0),
    Parameter("facets", 16, (1, 4, 16, 64), "points that stand for each disk light", (1, 4096)),
    Parameter("sky_rays", 128, (32, 128, 512), "directions in which a point looks for the sky", (1, 4096)),
)
MIRROR = (
    Parameter("side", 128, (64, 128, 256), "texels along an edge of the captured surroundings' faces", (1, 2048)),
    Parameter("shadow_side", 256, (64, 128, 256), "texels along an edge of a shadow tile", (1, 2048)),
)


def _model(frame: Frame) -> tuple[Eye, EyeModel]:
    eye = the_eye(frame.scene)
    return eye, with_one_surface(eye, float(frame.settings["keratometric_index"]))


def _uv_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    the_eye(scene)
    return [Pass("eye", _uv, writes=("shaded",)), resolve_pass("shaded")]


def _uv(frame: Frame) -> None:
    shaded = frame.texture(frame.size, 4)
    shaded.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("cornea_anatomical/uv.comp"), *frame.size, **eye_uniforms(frame, *_model(frame)))
    frame.resources["shaded"] = shaded


def _iris_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [sky_pass(features), *_light_passes(scene, settings)]


def _eye_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    side, shadow_side = (int(settings[p.name]) for p in MIRROR)
    return [*mirrored_passes(features, side, shadow_side), *_light_passes(scene, settings, WHOLE_EYE=1)]


def _light_passes(scene: Scene, settings: Mapping[str, SettingValue], **seen: int) -> list[Pass]:
    """What comes after the surroundings; `seen` tells the shader what to show besides the iris."""
    the_eye(scene)
    return [
        Pass("lights on the eye", _lights, writes=("eye_lights",)),
        *returned_passes(settings),
        Pass(
            "eye",
            lambda frame: _shade(frame, **seen),
            reads=("eye_lights",),
            uses=("returned", "sky", "cube_radiance"),
            writes=("shaded",),
        ),
        resolve_pass("shaded"),
    ]


def returned_passes(settings: Mapping[str, SettingValue]) -> list[Pass]:
    """Write `returned`, the light that the cornea throws back onto the iris, of `eye_lights` and `sky`."""
    off = "" if settings["interreflection"] else "interreflection is switched off"
    return [
        Pass("iris cells", _cells, reads=("eye_lights",), uses=("sky",), writes=("cells",), skip=off),
        Pass("iris exchange", _exchange, writes=("exchange",), skip=off, is_baked=True),
        Pass("iris bounces", _bounces, reads=("cells", "exchange"), writes=("returned",), skip=off),
    ]


def _lights(frame: Frame) -> None:
    lights = scene_lights(frame, int(frame.settings["facets"]))
    rows = light_rows(lights_in_eye_frame(the_eye(frame.scene), lights))
    frame.resources["eye_lights"] = frame.context.buffer(rows.tobytes()), len(lights)


def _bind_light(frame: Frame) -> tuple[dict[str, int], dict[str, Any]]:
    """Bind what eye/iris_light.glsl reads; returns its defines and uniforms."""
    settings = frame.settings
    eye, model = _model(frame)
    buffer, count = frame.resources["eye_lights"]
    buffer.bind_to_storage_buffer(3)
    iris_texture(frame, eye).use(1)
    defines = {
        **bind_surroundings(frame),
        **CAUSTICS[str(settings["caustics"])],
        "BEND_STEPS": int(settings["bend_steps"]),
        "SKY_RAYS": int(settings["sky_rays"]),
    }
    return defines, {**eye_uniforms(frame, eye, model), "light_count": count}


def _cells(frame: Frame) -> None:
    defines, uniforms = _bind_light(frame)
    radiosity, reflectance = (frame.context.buffer(reserve=RINGS * SECTORS * 16) for _ in range(2))
    radiosity.bind_to_storage_buffer(0)
    reflectance.bind_to_storage_buffer(1)
    shader = frame.program("eye/cells.comp", RINGS=RINGS, SECTORS=SECTORS, **defines)
    frame.dispatch(shader, RINGS * SECTORS, group=(64, 1), **uniforms)
    frame.resources["cells"] = radiosity, reflectance


def _exchange(frame: Frame) -> None:
    _, model = _model(frame)
    frame.resources["exchange"] = frame.context.buffer(iris_exchange(model).tobytes())


def _bounces(frame: Frame) -> None:
    for binding, buffer in enumerate((*frame.resources["cells"], frame.resources["exchange"])):
        buffer.bind_to_storage_buffer(binding)
    returned = frame.filtered_texture(np.zeros((RINGS, SECTORS, 4), dtype=np.float32))
    returned.repeat_y = False
    returned.bind_to_image(0, read=False, write=True)
    shader = frame.program("eye/bounces.comp", RINGS=RINGS, SECTORS=SECTORS, CELLS=RINGS * SECTORS, BOUNCES=BOUNCES)
    frame.dispatch(shader, 1, group=(1, 1))
    frame.resources["returned"] = returned


def _shade(frame: Frame, **seen: int) -> None:
    shaded = frame.texture(frame.size, 4)
    shade_eye(frame, shaded, disks_in_eye_frame(the_eye(frame.scene), frame.scene), **seen)
    frame.resources["shaded"] = shaded


def shade_eye(frame: Frame, shaded: moderngl.Texture, disks: Float32, **seen: Any) -> None:
    """Draw the eye that is the frame's subject into a texture; `disks` are what it mirrors, as eye.comp reads them."""
    eye = the_eye(frame.scene)
    defines, uniforms = _bind_light(frame)
    if "returned" in frame.resources:
        frame.resources["returned"].use(2)
        defines["INTERREFLECTION"] = 1
    mirrored = frame.context.buffer(disks.tobytes() or bytes(16))
    mirrored.bind_to_storage_buffer(5)
    shaded.bind_to_image(0, read=False, write=True)
    frame.dispatch(
        frame.program("cornea_anatomical/eye.comp", **defines, **seen),
        *frame.size,
        **uniforms,
        disk_count=len(disks),
        sclera_albedo=sclera_albedo(frame.scene, eye),
        internal_reflectance=diffuse_internal_reflectance(eye.ior),
    )


LIMITS = (
    "A cornea of two surfaces is taken as one of the keratometric index. Nothing hides the eye or casts a shadow on "
    "it; cornea and sclera shade one another, but do not mirror or light one another."
)
LIGHT_LIMITS = (
    f"{LIMITS} Of several ways in which a light reaches one point of the iris only one counts. What the cornea throws "
    f"back is one value for each of {RINGS} x {SECTORS} cells of the iris."
)

TECHNIQUES = {
    t.name: t
    for t in (
        Technique(
            name="cornea.anatomical_uv",
            approximates="iris_uv",
            summary="the point of the iris that is seen through the true spheres of cornea and sclera",
            source="haines-2019",
            limits=LIMITS,
            passes=_uv_passes,
            parameters=GEOMETRY,
            channels=(0, 1),
            grid=1,
        ),
        Technique(
            name="cornea.anatomical_iris",
            approximates="iris_radiance",
            summary="the iris under light that the cornea bends and focuses, and throws back to it",
            source="kingslake-2010",
            limits=LIGHT_LIMITS,
            passes=_iris_passes,
            parameters=(*GEOMETRY, *LIGHT),
            grid=GRID,
        ),
        Technique(
            name="cornea.anatomical",
            approximates="eye_radiance",
            summary="iris through the true cornea, sclera under its wet film, mirror image of disk lights and sky",
            source="kingslake-2010",
            limits=(
                f"{LIGHT_LIMITS} Mirrored are disk lights, the sky, and surroundings as lit without bounces, which "
                "light the eye in no other way."
            ),
            passes=_eye_passes,
            parameters=(*GEOMETRY, *LIGHT, *MIRROR),
            grid=GRID,
        ),
    )
}
