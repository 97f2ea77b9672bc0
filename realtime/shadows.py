"""Distance maps of all lights in one atlas: a strip of six tiles for each light, the strips in columns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from realtime.camera import Camera, cube_cameras, parallel_camera
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.lights import PARALLEL, Light, light_rows, lights_of
from scenes.errors import InputError
from scenes.mesh import Mesh

if TYPE_CHECKING:
    import moderngl

NOTHING_THERE = 3e38
"""Distance where a map shows nothing."""


def lights_pass(facets: int) -> Pass:
    """List the lights; every emitting surface becomes `facets` of them."""
    return Pass("lights", lambda frame: _collect(frame, facets), writes=("lights",))


def _collect(frame: Frame, facets: int) -> None:
    frame.resources["lights"] = scene_lights(frame, facets)


def scene_lights(frame: Frame, facets: int) -> list[Light]:
    """The `lights_of` the scene that a frame shows, listed once."""
    return frame.once(("lights", facets), lambda: lights_of(frame.scene, frame.meshes, facets))


def is_outside(light: Light, mesh: Mesh) -> bool:
    """Whether a mesh may hide a light: all but the one that the light shines through."""
    return mesh.name != light.mesh


def shadow_pass(side: int, skip: str = "", casts: Callable[[Light, Mesh], bool] = is_outside) -> Pass:
    """`side` texels along each edge of a tile; `casts` tells which meshes are in a light's maps."""
    return Pass(
        "shadow atlas",
        lambda frame: _draw(frame, side, casts),
        reads=("lights",),
        writes=("shadow_atlas",),
        skip=skip,
    )


@dataclass(frozen=True)
class ShadowAtlas:
    """`texture` holds the strips of tiles of `side` texels, `lights` what indirect/direct_light.glsl reads."""

    texture: moderngl.Texture
    side: int
    lights: moderngl.Buffer


def strip_corners(count: int, side: int, largest: int) -> list[tuple[int, int]]:
    """Lower left corners of `count` strips of 6 x 1 tiles in columns that fit into a texture of side `largest`.

    Raises
    ------
    InputError
        They do not fit.
    """
    rows = min(count, largest // side)
    if rows == 0 or -(-count // rows) * 6 * side > largest:
        raise InputError(
            f"Found {count} small lights with shadow maps of {side} x {side}; their atlas does not fit into a texture "
            f"of {largest} x {largest}. Set shadow_side or facets lower."
        )
    return [(i // rows * 6 * side, i % rows * side) for i in range(count)]


def _draw(frame: Frame, side: int, casts: Callable[[Light, Mesh], bool]) -> None:
    lights: list[Light] = frame.resources["lights"]
    atlas, corners = _empty_atlas(frame, lights, side)
    framebuffer = frame.context.framebuffer([atlas.texture], frame.context.depth_renderbuffer(atlas.texture.size))
    framebuffer.use()
    frame.submit(framebuffer.clear, red=NOTHING_THERE)
    frame.context.enable_only(frame.context.DEPTH_TEST)
    shader = frame.program("raster/mesh.vert", "raster/distance.frag")
    for (x, y), light in zip(corners, lights, strict=False):
        for tile, camera in enumerate(_cameras(frame, light)):
            framebuffer.viewport = (x + tile * side, y, side, side)
            shader["parallel"] = light.kind == PARALLEL
            frame.draw(shader, camera, lambda mesh, own=light: casts(own, mesh))  # type: ignore[misc]
    frame.resources["shadow_atlas"] = atlas


def unshadowed(frame: Frame, lights: list[Light]) -> ShadowAtlas:
    """The atlas of lights that nothing hides."""
    atlas, _ = frame.once("unshadowed", lambda: _empty_atlas(frame, lights, side=1))
    frame.submit(frame.context.framebuffer([atlas.texture]).clear, red=NOTHING_THERE)
    return atlas


def _empty_atlas(frame: Frame, lights: list[Light], side: int) -> tuple[ShadowAtlas, list[tuple[int, int]]]:
    """An atlas that nothing is drawn into, and the corners of its strips."""
    corners = strip_corners(max(1, len(lights)), side, int(frame.context.info["GL_MAX_TEXTURE_SIZE"]))
    size = (corners[-1][0] + 6 * side, max(y for _, y in corners) + side)
    rows = light_rows([_placed(frame, light) for light in lights])
    return ShadowAtlas(frame.texture(size, 1), side, frame.context.buffer(rows.tobytes())), corners


def _cameras(frame: Frame, light: Light) -> tuple[Camera, ...]:
    centre, radius = frame.bounds
    if light.kind == PARALLEL:
        return (parallel_camera(light.axis, centre, radius),)
    near = frame.near_plane(light.place, lambda mesh: mesh.radiance is None)
    return cube_cameras(light.place, near, float(np.linalg.norm(light.place - centre)) + 1.01 * radius)


def _placed(frame: Frame, light: Light) -> Light:
    """The light; for a PARALLEL one with the place of its camera."""
    centre, radius = frame.bounds
    return replace(light, place=centre - 2 * radius * light.axis) if light.kind == PARALLEL else light
