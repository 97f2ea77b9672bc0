"""The light that arrives at one thing from all around but from the lamps, past all other things."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from realtime.bvh import TRIANGLES_A_LEAF
from realtime.character_light import Hierarchy, place_rows
from realtime.frame import Frame
from realtime.lights import PARALLEL, Light
from realtime.sky import sky_texture
from scenes.image import Float32, Float64
from scenes.mesh import Mesh

if TYPE_CHECKING:
    import moderngl

AROUND_PLACES = 64
"""Places on a body at which it is looked for."""


def arriving(
    frame: Frame, shape: str, places: Float32 | Float64, normals: Float32 | Float64, directions: Float64
) -> moderngl.Buffer:
    """A vec4 for each direction (D, 3): the radiance that arrives from there at a shape, the mean over places of it."""
    hierarchy: Hierarchy = frame.resources["hierarchy"]
    toward = np.zeros((len(directions), 4), dtype=np.float32)
    toward[:, :3] = directions
    make = frame.context.buffer
    found, given, rows = (
        make(reserve=16 * len(toward)),
        make(toward.tobytes()),
        make(place_rows(places, normals).tobytes()),
    )
    uniforms = hierarchy.bind()
    for binding, buffer in ((0, given), (1, frame.resources["radiosity"]), (2, rows), (7, found)):
        buffer.bind_to_storage_buffer(binding)
    sky_texture(frame).use(5)
    frame.dispatch(
        frame.program("character/environment.comp", TRIANGLES_A_LEAF=TRIANGLES_A_LEAF),
        len(toward),
        group=(64, 1),
        direction_count=len(toward),
        place_count=len(places),
        own=float(hierarchy.shapes.index(shape)),
        **uniforms,
    )
    return found


def light_around(frame: Frame, body: Mesh, directions: Float64) -> list[Light]:
    """Parallel lights that stand for what arrives at a body from all around but from the lamps.

    directions : (D, 4), unit vectors to where it comes from, and the part of all directions that each stands for
    """
    chosen = np.linspace(0, len(body.surface.positions) - 1, AROUND_PLACES).astype(int)
    places, normals = body.surface.positions[chosen], body.surface.normals[chosen]
    found = arriving(frame, body.shape, places, normals, directions[:, :3])
    radiance = np.frombuffer(found.read(), dtype=np.float32).reshape(-1, 4)[:, :3].astype(np.float64)
    return [
        Light(PARALLEL, np.zeros(3), -direction[:3], 4 * np.pi * direction[3] * strength, 0.0, source)
        for source, (direction, strength) in enumerate(zip(directions, radiance, strict=True))
    ]
