"""The surroundings of the subject as surfels: captured in a cube map at its centre, lit, reduced, bounced.

The talk's idea (GeForce 7800 demos, "Indirect Lighting") with what it leaves out: shadows, the lights' physical falloff, and
the light that has bounced more than once. The bounces are radiosity among the captured texels, so no second capture is needed.
"""

from __future__ import annotations

import math

import numpy as np

from realtime.camera import cube_cameras
from realtime.frame import Frame, is_environment
from realtime.graph import Pass
from realtime.shadows import lights_pass, shadow_pass
from realtime.sky import sky_pixels
from scenes.features import Features

FLOATS_A_SURFEL = 16
BOUNCES_LEFT = 1e-3
"""Bounces go on until less than this part of the light is left."""

MOST_BOUNCES = 24


def bounces_for(brightest_reflectance: float) -> int:
    """How many bounces leave BOUNCES_LEFT of the energy at that reflectance."""
    if brightest_reflectance <= 0:
        return 0
    if brightest_reflectance >= 1:
        return MOST_BOUNCES
    return min(MOST_BOUNCES, math.ceil(math.log(BOUNCES_LEFT) / math.log(brightest_reflectance)))


def surfel_passes(features: Features, side: int, block: int, shadow_side: int, facets: int) -> list[Pass]:
    """Everything up to `surfels` and what each of them reflects (`reflected`).

    Parameters
    ----------
    side : texels along an edge of the captured faces
    block : texels along an edge of a surfel
    shadow_side : texels along an edge of a shadow tile
    facets : pieces that each emitting surface is cut into
    """
    unlit = "" if features.has_local_or_directional_lights else "no emitter but the sky: nothing casts a shadow map"
    dark = "" if features.brightest_reflectance > 0 else "the surroundings reflect nothing"
    return [
        lights_pass(facets),
        shadow_pass(shadow_side, skip=unlit),
        Pass("capture", lambda f: _capture(f, side), writes=("cube_position", "cube_normal", "cube_albedo")),
        Pass(
            "relight",
            _relight,
            reads=("lights", "cube_position"),
            uses=("shadow_atlas", "light_buffer"),
            writes=("cube_radiance",),
        ),
        Pass(
            "reduce",
            lambda f: _reduce(f, block),
            reads=("cube_position", "cube_radiance"),
            writes=("surfels", "reflected"),
        ),
        Pass("bounce", _bounce, reads=("surfels", "reflected"), writes=("reflected",), skip=dark),
    ]


def _capture(frame: Frame, side: int) -> None:
    context, size = frame.context, (6 * side, side)
    targets = [frame.texture(size, 4) for _ in range(3)]
    framebuffer = context.framebuffer(targets, context.depth_renderbuffer(size))
    framebuffer.use()
    framebuffer.clear()
    context.enable_only(context.DEPTH_TEST)
    shader = frame.program("raster/mesh.vert", "raster/gbuffer.frag")
    _, radius = frame.bounds
    for face, camera in enumerate(cube_cameras(frame.subject_centre, 1e-3 * radius, 3 * radius)):
        framebuffer.viewport = (face * side, 0, side, side)
        frame.draw(shader, camera, is_environment)
    frame.resources |= dict(zip(("cube_position", "cube_normal", "cube_albedo"), targets, strict=True))


def _relight(frame: Frame) -> None:
    resources = frame.resources
    size = resources["cube_position"].size
    radiance = frame.texture(size, 4)
    for unit, name in enumerate(("cube_position", "cube_normal", "cube_albedo", "shadow_atlas")):
        if name in resources:
            resources[name].use(unit)
    count = len(resources["lights"])
    if count:
        resources["light_buffer"].bind_to_storage_buffer(0)
    radiance.bind_to_image(0, read=False, write=True)
    shader = frame.program("indirect/relight.comp")
    frame.dispatch(shader, *size, light_count=count, scene_radius=frame.bounds[1])
    resources["cube_radiance"] = radiance


def _reduce(frame: Frame, block: int) -> None:
    resources, context = frame.resources, frame.context
    side = resources["cube_position"].height
    count = 6 * (side // block) ** 2
    for unit, name in enumerate(("cube_position", "cube_normal", "cube_albedo", "cube_radiance")):
        resources[name].use(unit)
    pixels = sky_pixels(frame.scene)
    sky = context.texture((pixels.shape[1], pixels.shape[0]), 3, pixels.tobytes(), dtype="f4")
    sky.filter = (context.LINEAR, context.LINEAR)
    sky.use(4)
    surfels = context.buffer(reserve=count * FLOATS_A_SURFEL * 4)
    surfels.bind_to_storage_buffer(0)
    shader = frame.program("indirect/reduce.comp", BLOCK=block)
    frame.dispatch(shader, count, group=(64, 1), centre=tuple(frame.subject_centre), surfel_count=count)
    resources["surfels"] = surfels
    data = np.frombuffer(surfels.read(), dtype=np.float32).reshape(count, 4, 4)
    resources["closed"] = float(np.all(data[:, 0, 3] > 0))
    resources["reflected"] = context.buffer(np.ascontiguousarray(data[:, 3]).tobytes())
    resources["surfel_count"] = count


def _bounce(frame: Frame) -> None:
    resources, context = frame.resources, frame.context
    count = resources["surfel_count"]
    before, after = resources["reflected"], context.buffer(reserve=count * 16)
    resources["surfels"].bind_to_storage_buffer(0)
    shader = frame.program("indirect/bounce.comp")
    for _ in range(bounces_for(frame.features.brightest_reflectance)):
        before.bind_to_storage_buffer(1)
        after.bind_to_storage_buffer(2)
        frame.dispatch(shader, count, group=(64, 1), surfel_count=count, closed=resources["closed"])
        before, after = after, before
    resources["reflected"] = before
