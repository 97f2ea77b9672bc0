"""What layered materials reflect of light that comes evenly from all around."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realtime.frame import Frame
from realtime.layers import bind_layers
from scenes.image import Float64
from scenes.materials import Layered, Principled

if TYPE_CHECKING:
    import moderngl

COSINES = 64
POINTS = 512
"""Directions from each of the four ways to choose them; they are off by less than 1 % of the albedo together."""


@dataclass(frozen=True)
class CoatAlbedo:
    """The albedo of a material: as a row of texels by the cosine of the view, and (3,) under light from all around.

    Textures count with their mean.
    """

    by_cosine: moderngl.Texture
    on_the_whole: Float64


def albedo_of(frame: Frame, material: Layered | Principled) -> CoatAlbedo:
    """The albedo of a material, found once."""
    return frame.once(("albedo", material), lambda: _found(frame, material))


def _found(frame: Frame, material: Layered | Principled) -> CoatAlbedo:
    context = frame.context
    found, points = context.buffer(reserve=16 * COSINES), context.buffer(_points().astype("<f4").tobytes())
    defines, uniforms = bind_layers(frame, material)
    found.bind_to_storage_buffer(0)
    points.bind_to_storage_buffer(1)
    shader = frame.program("layered/albedo.comp", COSINES=COSINES, POINTS=POINTS, **defines)
    frame.dispatch(shader, COSINES, group=(64, 1), **uniforms)
    values = np.frombuffer(found.read(), dtype="<f4").reshape(1, COSINES, 4)
    row = context.texture((COSINES, 1), 4, values.tobytes(), dtype="f4")
    row.repeat_x = row.repeat_y = False
    cosines = (np.arange(COSINES) + 0.5) / COSINES
    return CoatAlbedo(row, 2 * (cosines[:, None] * values[0, :, :3]).mean(axis=0))


def _points() -> Float64:
    """(POINTS, 4) in the unit cube, evenly: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences"."""
    root = 1.0
    for _ in range(64):  # the positive solution of x^5 = x + 1
        root = (1 + root) ** (1 / 5)
    return (0.5 + np.outer(np.arange(1, POINTS + 1), root ** -np.arange(1.0, 5.0))) % 1
