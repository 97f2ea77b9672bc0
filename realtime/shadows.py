"""Distance maps of all lights in one atlas: a row of six tiles for each light."""

from __future__ import annotations

import numpy as np

from realtime.camera import Camera, cube_cameras, parallel_camera
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.lights import PARALLEL, Light, lights_of
from scenes.image import Float32

FLOATS_A_LIGHT = 12


def lights_pass(facets: int) -> Pass:
    """List the lights; every emitting surface becomes `facets` of them."""
    return Pass("lights", lambda frame: _collect(frame, facets), writes=("lights",))


def _collect(frame: Frame, facets: int) -> None:
    frame.resources["lights"] = lights_of(frame.scene, frame.meshes, facets)


def shadow_pass(side: int, skip: str = "") -> Pass:
    """`side` texels along each edge of a tile."""
    return Pass(
        "shadow atlas",
        lambda frame: _draw(frame, side),
        reads=("lights",),
        writes=("shadow_atlas",),
        skip=skip,
    )


def _draw(frame: Frame, side: int) -> None:
    context = frame.context
    lights: list[Light] = frame.resources["lights"]
    rows = max(1, len(lights))
    size = (6 * side, rows * side)
    atlas = frame.texture(size, 1)
    framebuffer = context.framebuffer([atlas], context.depth_renderbuffer(size))
    framebuffer.use()
    framebuffer.clear(red=3e38)
    context.enable_only(context.DEPTH_TEST)
    shader = frame.program("raster/mesh.vert", "raster/distance.frag")
    for row, light in enumerate(lights):
        for tile, camera in enumerate(_cameras(frame, light)):
            framebuffer.viewport = (tile * side, row * side, side, side)
            shader["parallel"] = light.kind == PARALLEL
            frame.draw(shader, camera)
    frame.resources["shadow_atlas"] = atlas
    frame.resources["light_buffer"] = context.buffer(_packed(frame, lights).tobytes())


def _cameras(frame: Frame, light: Light) -> tuple[Camera, ...]:
    centre, radius = frame.bounds
    if light.kind == PARALLEL:
        return (parallel_camera(light.axis, centre, radius),)
    near = 1e-3 * radius
    return cube_cameras(light.place, near, float(np.linalg.norm(light.place - centre)) + 1.01 * radius)


def _packed(frame: Frame, lights: list[Light]) -> Float32:
    """Rows of three vec4: place and kind, axis and area, strength. A PARALLEL light's place is its camera's eye."""
    centre, radius = frame.bounds
    packed = np.zeros((max(1, len(lights)), FLOATS_A_LIGHT), dtype=np.float32)
    for row, light in zip(packed, lights, strict=False):
        place = centre - 2 * radius * light.axis if light.kind == PARALLEL else light.place
        row[:] = [*place, light.kind, *light.axis, light.area, *light.strength, 0.0]
    return packed
