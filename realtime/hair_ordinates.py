"""Light that goes from hair to hair, or comes from the sky: discrete ordinates on the grid of `realtime.hair_voxels`.

Chandrasekhar 1960, "Radiative Transfer", chapter II. Hair is taken as a medium whose extinction and phase function
depend on the direction against its tangent (Jakob et al. 2010, "A Radiative Transfer Framework for Rendering Materials
with Anisotropic Structure"); the skin that it grows on reflects what comes down to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.capture import bind_lights, large_buffer
from realtime.fibre import FibreTable, at_inclination, fibre_table, scattering
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.hair_voxels import FIBRE_UNIT, TANGENTS, Voxels, fibre_of, march_defines, thickest
from realtime.lights import directions
from realtime.ordinates import LEVEL_SYMMETRIC, level_symmetric
from realtime.sky import sky_directions, sky_pixels
from realtime.technique import Parameter
from scenes.image import Float32, Float64
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl


THREADS = 32
"""Along each side of a work group: OpenGL promises 1024 in all."""

BALANCING = 16
"""Times that rows and columns are scaled: they then agree within 1 %."""


@dataclass(frozen=True)
class HairOrdinates:
    """Light along `count` ordinates, a vec4 for each cell of each, and the rows of glsl/hair_light/ordinates.glsl."""

    along: moderngl.Buffer
    rows: moderngl.Buffer
    count: int

    def bind(self) -> None:
        """Bind both as hair_light/shade.comp reads them."""
        self.along.bind_to_storage_buffer(1)
        self.rows.bind_to_storage_buffer(2)


ITERATIONS = Parameter("iterations", 8, (0, 2, 4, 8, 16), "times that light goes on from hair to hair", (0, 256), off=0)
ORDER = Parameter("order", 6, tuple(LEVEL_SYMMETRIC), "N of the S_N set of directions: 24, 48 or 80 of them", (4, 8))


def ordinates_passes(dark: str, once: str, has_sky: bool) -> list[Pass]:
    """Write `hair_ordinates`, the light that comes to each cell along each ordinate.

    Parameters
    ----------
    dark : why none does, or nothing.
    once : why hair sends none of it on, or nothing. What is left then is the sky's light.
    """
    if once and has_sky:
        return [Pass("sky on hair", _carry_sky, reads=("voxels",), writes=("hair_ordinates",), skip=dark)]
    return [
        Pass("hair phases", _bake_phases, writes=("hair_phases",), is_baked=True, skip=dark or once),
        Pass(
            "hair ordinates",
            _solve,
            reads=("voxels", "fibres", "lights", "hair_phases"),
            uses=("shadow_atlas",),
            writes=("hair_ordinates",),
            skip=dark or once,
        ),
    ]


def phases(table: FibreTable, tangents: Float64, quadrature: Float64) -> Float64:
    """What a fibre sends along ordinate k of the radiance along ordinate j: (T, K, K, 3), at [tangent, k, j].

    Few directions hit or miss a lobe. What is sent of each in all, and what comes in all from even light, are known:
    columns and rows are scaled by turns until they agree (Sinkhorn 1964, "A Relationship Between Arbitrary Positive
    Matrices and Doubly Stochastic Matrices").
    """
    travel, weights = quadrature[:, :3], quadrature[:, 3]
    T, out, come = np.broadcast_arrays(tangents[:, None, None], travel[None, :, None], -travel[None, None, :])
    kernel: Float64 = 4 * np.pi * weights[:, None] * scattering(table, T, out, come)
    sine = np.sqrt(np.maximum(1 - np.einsum("tc,kc->tk", tangents, travel) ** 2, 0))
    albedo, sent = (at_inclination(values, sine) for values in (table.albedo, table.sent))
    shown = (weights * sine)[..., None]
    for _ in range(BALANCING):
        kernel *= (sent * shown / np.einsum("tkjc,tkx->tjc", kernel, shown))[:, None]
        kernel *= (albedo / kernel.sum(axis=2))[:, :, None]
    return kernel


def _bake_phases(frame: Frame) -> None:
    quadrature = level_symmetric(int(frame.settings[ORDER.name])).astype(float)
    tables = [fibre_table(fibre_of(frame.scene, hair.material)) for hair in frame.scene.hair]
    rows = np.zeros((len(tables), TANGENTS, len(quadrature), len(quadrature), 4), dtype=np.float32)
    for row, table in zip(rows, tables, strict=True):
        row[..., :3] = phases(table, directions(TANGENTS), quadrature)
    frame.resources["hair_phases"] = frame.context.buffer(rows.tobytes())


def ordinate_rows(scene: Scene, quadrature: Float32) -> Float32:
    """The structs (K, 2, 4) of glsl/hair_light/ordinates.glsl.

    The sky enters along the nearest ordinate of each direction, so that all of it does.
    """
    rows = np.zeros((len(quadrature), 2, 4), dtype=np.float32)
    rows[:, 0] = quadrature
    pixels = sky_pixels(scene).astype(float)
    if len(pixels) == 1:
        rows[:, 1, :3] = pixels[0, 0]
        return rows
    towards, solid_angles = sky_directions(*pixels.shape[:2])
    nearest = (-towards @ quadrature[:, :3].T).argmax(axis=1)
    for channel, light in enumerate((solid_angles[:, None] * pixels.reshape(-1, 3)).T):
        rows[:, 1, channel] = np.bincount(nearest, light, len(quadrature)) / (4 * np.pi * quadrature[:, 3])
    return rows


def _quadrature(frame: Frame) -> tuple[int, moderngl.Buffer]:
    """How many ordinates there are, and their rows."""
    quadrature = level_symmetric(int(frame.settings[ORDER.name]))
    rows = frame.once(
        ("hair ordinates", len(quadrature)),
        lambda: frame.context.buffer(ordinate_rows(frame.scene, quadrature).tobytes()),
    )
    return len(quadrature), rows


def _sweep(frame: Frame, cells: int, ordinates: int, **defines: int) -> Any:
    """The program that carries light through the grid, with no more threads than a work group may have."""
    each = -(-cells // THREADS)
    sides = {"EACH": each, "SIDE": -(-cells // each)}
    return frame.program("hair_light/sweep.comp", CELLS=cells, ORDINATES=ordinates, **sides, **defines)


def _carry_sky(frame: Frame) -> None:
    voxels: Voxels = frame.resources["voxels"]
    count, ordinates = _quadrature(frame)
    along = _rays(frame, "along", count * voxels.cells**3)
    voxels.bind()
    along.bind_to_storage_buffer(1)
    ordinates.bind_to_storage_buffer(2)
    voxels.rows.bind_to_storage_buffer(6)
    shadowed = march_defines(frame)["SHADOWED"]
    frame.dispatch(_sweep(frame, voxels.cells, count, SKY_ALONE=1, SHADOWED=shadowed), count, group=(1, 1))
    frame.resources["hair_ordinates"] = HairOrdinates(along, ordinates, count)


def _solve(frame: Frame) -> None:
    voxels: Voxels = frame.resources["voxels"]
    cells, volume = voxels.cells, voxels.cells**3
    count, ordinates = _quadrature(frame)
    defines = {"CELLS": cells, "ORDINATES": count}
    sources, along, sent = (_rays(frame, name, count * volume) for name in ("sources", "along", "sent"))
    for sums in (sources, along):
        frame.submit(sums.clear)
    voxels.bind()
    frame.resources["fibres"].use(FIBRE_UNIT)
    ordinates.bind_to_storage_buffer(2)
    voxels.rows.bind_to_storage_buffer(6)
    sources.bind_to_storage_buffer(0)
    frame.dispatch(
        frame.program("hair_light/sources.comp", **defines, **march_defines(frame)),
        volume,
        group=(64, 1),
        radius=thickest(frame.scene),
        **bind_lights(frame),
    )
    along.bind_to_storage_buffer(1)
    sent.bind_to_storage_buffer(5)
    frame.resources["hair_phases"].bind_to_storage_buffer(3)
    scatter = frame.program("hair_light/scatter.comp", TANGENTS=TANGENTS, **defines)
    sweep = _sweep(frame, cells, count, SHADOWED=1)
    for _ in range(int(frame.settings[ITERATIONS.name])):
        frame.dispatch(scatter, volume, count, group=(64, 1))
        frame.dispatch(sweep, count, group=(1, 1))
    frame.resources["hair_ordinates"] = HairOrdinates(along, ordinates, count)


def _rays(frame: Frame, name: str, count: int) -> moderngl.Buffer:
    what, remedy = "Light along each ordinate in each cell needs a list", "Set cells or order lower."
    return frame.once(("hair", name, count), lambda: large_buffer(frame, 16 * count, what, remedy))
