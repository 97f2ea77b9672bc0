"""The surroundings of the subject as surfels: captured in a cube map at its centre, lit, reduced, bounced.

The talk's idea (GeForce 7800 demos, "Indirect Lighting") with what it leaves out: shadows, the lights' physical
falloff, and the light that has bounced more than once. The bounces are radiosity among the captured texels, so no
second capture is needed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import cube_cameras
from realtime.frame import Frame, is_environment
from realtime.graph import Pass
from realtime.shadows import ShadowAtlas, lights_pass, shadow_pass, unshadowed
from realtime.sky import sky_texture
from scenes.errors import InputError
from scenes.features import Features

if TYPE_CHECKING:
    import moderngl

FLOATS_A_SURFEL = 12
BOUNCES_LEFT = 1e-3
"""Bounces go on until less than this part of the light is left."""

MOST_BOUNCES = 256
"""Enough for BOUNCES_LEFT up to a reflectance of 0.973; real surfaces are darker."""


def bounces_for(brightest_reflectance: float) -> int:
    """How many bounces leave BOUNCES_LEFT of the energy at that reflectance."""
    if brightest_reflectance <= 0:
        return 0
    if brightest_reflectance >= 1:
        return MOST_BOUNCES
    return min(MOST_BOUNCES, math.ceil(math.log(BOUNCES_LEFT) / math.log(brightest_reflectance)))


def surfel_passes(features: Features, side: int, block: int, shadow_side: int, facets: int) -> list[Pass]:
    """The surroundings as `surfels`, and the direct light that is reflected to the cube: `cube_radiance`.

    Parameters
    ----------
    side : texels along an edge of the captured faces
    block : texels along an edge of a surfel
    shadow_side : texels along an edge of a shadow tile
    facets : pieces that each emitting surface is cut into
    """
    unlit = "" if features.has_local_or_directional_lights else "no emitter but the sky: nothing casts a shadow map"
    return [
        Pass("capture", lambda f: _capture(f, side), writes=("cube",), is_baked=True),
        Pass("reduce", lambda f: _reduce(f, block), reads=("cube",), writes=("surfels",), is_baked=True),
        lights_pass(facets),
        shadow_pass(shadow_side, skip=unlit),
        Pass("relight", _relight, reads=("lights", "cube"), uses=("shadow_atlas",), writes=("cube_radiance",)),
    ]


def bounce_passes(features: Features, lights_itself: bool = False) -> list[Pass]:
    """Write `lit`, what all surfels reflect of direct light, and `reflected`, after bounces until little is left.

    A subject that `lights_itself` does so even where the surroundings are black.
    """
    dark = "" if features.brightest_reflectance > 0 or lights_itself else "the surroundings reflect nothing"
    return [
        Pass(
            "light surfels",
            _light,
            reads=("surfels", "cube", "cube_radiance", "lights"),
            uses=("shadow_atlas",),
            writes=("lit",),
        ),
        Pass(
            "transport",
            _transport,
            reads=("surfels",),
            uses=("visibility", "transfer"),
            writes=("transport",),
            skip=dark,
            is_baked=True,
        ),
        Pass(
            "bounce",
            lambda frame: _bounce(frame, lights_itself),
            reads=("surfels", "lit", "transport"),
            writes=("reflected",),
            skip=dark,
        ),
    ]


@dataclass(frozen=True)
class Surfels:
    """`buffer` holds `count` surfels, the first `surroundings` of them from the cube, the rest of the subject.

    A surfel stands for `block` x `block` texels of the cube. `closed` is 1 where the cube sees no sky.
    `own_reflectance` is the highest of the subject's.
    """

    buffer: moderngl.Buffer
    count: int
    surroundings: int
    block: int
    closed: float
    own_reflectance: float = 0.0

    def uniforms(self) -> dict[str, Any]:
        """What the shaders that read surfels need to know."""
        return {"surfel_count": self.count, "surroundings": self.surroundings, "closed": self.closed}


def _capture(frame: Frame, side: int) -> None:
    context, size = frame.context, (6 * side, side)
    targets = [frame.texture(size, 4) for _ in range(3)]
    framebuffer = context.framebuffer(targets, context.depth_renderbuffer(size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST)
    shader = frame.program("raster/mesh.vert", "raster/gbuffer.frag", AS_SEEN=1)
    _, radius = frame.bounds
    near = frame.near_plane(frame.subject_centre, is_environment)
    for face, camera in enumerate(cube_cameras(frame.subject_centre, near, 3 * radius)):
        framebuffer.viewport = (face * side, 0, side, side)
        frame.draw(shader, camera, is_environment)
    frame.resources["cube"] = targets


def bind_lights(frame: Frame) -> dict[str, Any]:
    """Bind what indirect/direct_light.glsl reads; returns its uniforms. Without an atlas, nothing casts."""
    lights = frame.resources["lights"]
    if not lights:
        return {"light_count": 0}
    atlas: ShadowAtlas = frame.resources.get("shadow_atlas") or unshadowed(frame, lights)
    atlas.texture.use(3)
    atlas.lights.bind_to_storage_buffer(3)
    return {"light_count": len(lights), "scene_radius": frame.bounds[1], "shadow_side": atlas.side}


def _relight(frame: Frame) -> None:
    cube = frame.resources["cube"]
    radiance = frame.texture(cube[0].size, 4)
    for unit, texture in enumerate(cube):
        texture.use(unit)
    radiance.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("indirect/relight.comp"), *radiance.size, **bind_lights(frame))
    frame.resources["cube_radiance"] = radiance


def _reduce(frame: Frame, block: int) -> None:
    cube = frame.resources["cube"]
    for unit, texture in enumerate(cube):
        texture.use(unit)
    count = 6 * (cube[0].height // block) ** 2
    buffer = frame.context.buffer(reserve=count * FLOATS_A_SURFEL * 4)
    buffer.bind_to_storage_buffer(0)
    shader = frame.program("indirect/reduce.comp", BLOCK=block)
    frame.dispatch(shader, count, group=(64, 1), centre=tuple(frame.subject_centre), surfel_count=count)
    areas = np.frombuffer(buffer.read(), dtype=np.float32).reshape(count, FLOATS_A_SURFEL)[:, 3]
    frame.resources["surfels"] = Surfels(buffer, count, count, block, float(np.all(areas > 0)))


def _light(frame: Frame) -> None:
    resources = frame.resources
    surfels: Surfels = resources["surfels"]
    lit = frame.context.buffer(reserve=surfels.count * 16)
    surfels.buffer.bind_to_storage_buffer(0)
    lit.bind_to_storage_buffer(1)
    resources["cube"][0].use(0)
    resources["cube_radiance"].use(3)
    sky_texture(frame).use(4)
    shader = frame.program("indirect/light_cube.comp", BLOCK=surfels.block)
    frame.dispatch(shader, surfels.surroundings, group=(64, 1), **surfels.uniforms())
    if own := surfels.count - surfels.surroundings:
        shader = frame.program("indirect/light_subject.comp")
        frame.dispatch(shader, own, group=(64, 1), **surfels.uniforms(), **bind_lights(frame))
    resources["lit"] = lit


def bind_visibility(frame: Frame) -> dict[str, int]:
    """Bind what the subject hides from itself, if that is known; returns the uniform of indirect/row.glsl."""
    visibility = frame.resources.get("visibility")
    if visibility is None:
        return {"words": 0}
    visibility.bits.bind_to_storage_buffer(6)
    return {"words": visibility.words}


def large_buffer(frame: Frame, size: int, what: str, remedy: str) -> moderngl.Buffer:
    """A buffer of `size` bytes, for `what` needs it.

    Raises
    ------
    InputError
        This GPU allows none as large; `remedy` says what to do.
    """
    largest = int(frame.context.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"])
    if size > largest:
        raise InputError(f"{what} of {size / 1e6:.0f} MB; this GPU allows buffers of {largest / 1e6:.0f} MB. {remedy}")
    return frame.context.buffer(reserve=size)


def _transport(frame: Frame) -> None:
    surfels: Surfels = frame.resources["surfels"]
    transport = large_buffer(
        frame,
        surfels.count**2 * 4,
        f"Light between {surfels.count} surfels needs a matrix",
        "Set block higher, or side or subject_surfels lower.",
    )
    transport.clear()
    surfels.buffer.bind_to_storage_buffer(0)
    transport.bind_to_storage_buffer(1)
    shader = frame.program("indirect/transport.comp")
    receivers = surfels.surroundings if "transfer" in frame.resources else surfels.count
    frame.dispatch(shader, receivers, group=(1, 1), **surfels.uniforms(), **bind_visibility(frame))
    frame.resources["transport"] = transport


def _bounce(frame: Frame, lights_itself: bool) -> None:
    surfels: Surfels = frame.resources["surfels"]
    lit: moderngl.Buffer = frame.resources["lit"]
    surfels.buffer.bind_to_storage_buffer(0)
    frame.resources["transport"].bind_to_storage_buffer(1)
    lit.bind_to_storage_buffer(4)
    shader = frame.program("indirect/bounce.comp")
    brightest = max(frame.features.brightest_reflectance, surfels.own_reflectance if lights_itself else 0.0)
    before, after, spare = lit, *(frame.context.buffer(reserve=lit.size) for _ in range(2))
    for _ in range(bounces_for(brightest)):
        before.bind_to_storage_buffer(2)
        after.bind_to_storage_buffer(3)
        frame.dispatch(shader, surfels.count, group=(64, 1), surfel_count=surfels.count)
        before, after, spare = after, spare, after
    frame.resources["reflected"] = before


def reflected(frame: Frame) -> moderngl.Buffer:
    """What each surfel reflects after the bounces, or of direct light alone if they were skipped."""
    buffer: moderngl.Buffer = frame.resources.get("reflected", frame.resources["lit"])
    return buffer
