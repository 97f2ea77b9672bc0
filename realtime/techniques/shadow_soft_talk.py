"""Soft omnidirectional shadows as NVIDIA's talk on the GeForce 7800 GTX demos ("Mad Mod Mike", 2005) publishes them.

The character, drawn from the light into the alpha of the cube map for indirect light and blurred with it, multiplies
the light that the surroundings get from there. Nothing tells what lies before the character from what lies behind it.
"""

from __future__ import annotations

from collections.abc import Mapping

from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.shader import set_uniforms
from realtime.talk_cube import CHARACTER, CUBE, cube_bound, cube_passes
from realtime.technique import Technique
from realtime.vcm import the_omni_light
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    the_omni_light(scene)
    return [
        *cube_passes(features, CHARACTER),
        Pass("receive", _receive, uses=("cube",), writes=("visibility",)),
        resolve_pass("visibility"),
    ]


def _receive(frame: Frame) -> None:
    context, size = frame.context, frame.size
    visibility = frame.texture(size, 4)
    framebuffer = context.framebuffer([visibility], context.depth_renderbuffer(size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST)
    _, light = the_omni_light(frame.scene)
    with cube_bound(frame, 0) as captured:
        shader = frame.program("raster/mesh.vert", "shadow_soft_talk/receive.frag", **captured)
        set_uniforms(shader, blurred=0, light=tuple(light))
        frame.draw(shader, frame.camera)
    frame.resources["visibility"] = visibility


TECHNIQUES = {
    "shadow.soft_talk": Technique(
        name="shadow.soft_talk",
        approximates="visibility",
        summary="the character as the light sees it, in the alpha of the talk's blurred cube",
        source="nvidia-2005",
        limits=(
            "As published: the character alone casts, on all that lies in a direction from the light, what stands "
            "before it too, but not on itself; the blur knows neither the light's size nor the receiver's distance; "
            "8 bits. What is lit by its own triangle's plane is a matter of yes or no."
        ),
        passes=_passes,
        parameters=CUBE,
        channels=(0,),
        grid=4,
    )
}
