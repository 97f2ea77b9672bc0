"""The final lighting equation of NVIDIA's talk on the GeForce 7800 GTX demos ("Mad Mod Mike", 2005), for a whole frame.

diffuse = env_diffuse * (0.8 + 0.2 shadow_mult) + the sum over the lights of N.L * LightColor * shadow_mult. One blurred
cube map serves both: its RGB is the character's env_diffuse, its alpha the soft shadow that it casts on the rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.shader import set_uniforms
from realtime.talk_cube import (
    CHARACTER,
    SURROUNDINGS,
    cube_bound,
    cube_passes,
    lights_at_subject,
)
from realtime.technique import Technique
from realtime.techniques.indirect_talk import PARAMETERS, lookup_uniforms
from realtime.vcm import the_omni_light
from realtime.views import background
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene, SphereLight


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        *cube_passes(features, SURROUNDINGS, CHARACTER),
        Pass("shade", _shade, uses=("cube", SURROUNDINGS, CHARACTER), writes=("shaded",)),
        resolve_pass("shaded"),
    ]


def _shade(frame: Frame) -> None:
    context, size = frame.context, frame.size
    shaded = frame.texture(size, 4)
    framebuffer = context.framebuffer([shaded], context.depth_renderbuffer(size))
    framebuffer.use()
    frame.submit(framebuffer.clear, *background(frame))
    context.enable_only(context.DEPTH_TEST)
    with cube_bound(frame, 0) as captured:
        shader = frame.program("raster/mesh.vert", "lighting_talk/shade.frag", **captured)
        set_uniforms(shader, blurred=0, **_lights(frame), **lookup_uniforms(frame))
        frame.draw(shader, frame.camera)
    frame.resources["shaded"] = shaded


def _lights(frame: Frame) -> dict[str, Any]:
    """The talk's two lights, and which of them the character casts a soft shadow of."""
    lights = lights_at_subject(frame)
    uniforms: dict[str, Any] = {
        "light_places": [place for place, _ in lights],
        "light_colors": [tuple(color) for _, color in lights],
        "casts": [False, False],
    }
    if frame.features.has_one_omni_light:
        index, jetpack = the_omni_light(frame.scene)
        light = frame.scene.emitters[index]
        reach = light.radius if isinstance(light, SphereLight) else 0.0
        casts = [place[3] == 1 and float(np.linalg.norm(place[:3] - jetpack)) <= reach for place, _ in lights]
        uniforms |= {"casts": casts, "jetpack": tuple(jetpack)}
    return uniforms


TECHNIQUES = {
    "lighting.talk": Technique(
        name="lighting.talk",
        approximates="frame_radiance",
        summary="the talk's final equation: direct light, soft shadows, and indirect light on the character",
        source="nvidia-2005",
        limits=(
            "As published: two lights without falloff, indirect light for the character alone, soft shadows that it "
            "casts on the rest alone and without a depth test; the limits of indirect.talk and shadow.soft_talk. The "
            "talk's hard shadows are left out, of objects on each other and of the character on itself. What emits "
            "is drawn with its radiance, unclipped: 8 bits are the cube's alone."
        ),
        passes=_passes,
        parameters=PARAMETERS,
        grid=4,
    )
}
