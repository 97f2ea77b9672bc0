"""A grid of probes over the subject's box: the radiance around each as nine harmonics, interpolated in between.

Greger, Shirley, Hubbard, Greenberg 1998, "The Irradiance Volume". The probes hold radiance, not irradiance, so that
what reads them may hide a part of it: the convolution with the cosine, or with anything else, comes last.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.capture import FLOATS_A_SURFEL, Surfels, reflected
from realtime.frame import Frame
from realtime.graph import Pass, Skip
from scenes.image import Float64

if TYPE_CHECKING:
    import moderngl

ENOUGH = ((24.0, 1), (4.0, 2))
"""Half diagonals of the subject's box between it and all surroundings, and how many probes a side are enough from there
on: fewer err by less than 1 % of the mean (measured for a tall ellipsoid in rooms of many sizes).
"""


@dataclass(frozen=True)
class ProbeGrid:
    """A box in `per_side` cells along each axis, with a probe in the middle of each.

    Probes on its faces would be nearer to what the subject stands on than the subject mostly is, and light changes fast
    there.

    coefficients : (per_side³, 9) vec4, radiance in the harmonics of glsl/lib/sh.glsl; x runs fastest
    """

    low: Float64
    high: Float64
    per_side: int
    coefficients: moderngl.Buffer

    def uniforms(self) -> dict[str, Any]:
        """What the shaders that read the grid need to know."""
        return {"box_low": tuple(self.low), "box_high": tuple(self.high), "per_side": self.per_side}


def probe_passes(per_side: int) -> list[Pass]:
    """Write the radiance of the bounced surroundings around each probe: `probes`."""
    return [
        Pass(
            "place probes",
            lambda frame: _place(frame, per_side),
            reads=("surfels",),
            writes=("probe_grid",),
            is_baked=True,
        ),
        Pass("probes", _project, reads=("surfels", "probe_grid", "lit"), uses=("reflected",), writes=("probes",)),
    ]


def clearance(low: Float64, high: Float64, places: Float64, areas: Float64) -> float:
    """Distance from a box to the nearest of some disks, at least, in half diagonals of the box.

    Parameters
    ----------
    low, high : (3,) corners of the box
    places, areas : (N, 3) and (N,) of the disks

    Returns
    -------
    At least 0; infinite if there is no disk.
    """
    outside = np.maximum(np.maximum(low - places, places - high), 0)
    distances = np.linalg.norm(outside, axis=1) - np.sqrt(areas / math.pi)
    half_diagonal = float(np.linalg.norm(high - low)) / 2
    return max(0.0, float(np.min(distances, initial=math.inf))) / half_diagonal


def probes_enough(far: float, per_side: int) -> int:
    """As many probes a side as are wanted, or as are enough at that clearance if those are fewer."""
    return min([per_side, *(count for least, count in ENOUGH if far > least)])


def _place(frame: Frame, wanted: int) -> None:
    surfels: Surfels = frame.resources["surfels"]
    low, high = frame.subject_box
    far = clearance(low, high, *_surfaces(surfels))
    per_side = probes_enough(far, wanted)
    if per_side < wanted:
        why = f"the surroundings are {far:.3g} half diagonals of the subject's box away: {per_side}³ are enough"
        frame.skipped.append(Skip(f"{wanted**3 - per_side**3} of {wanted}³ probes", why))
    coefficients = frame.context.buffer(reserve=per_side**3 * 9 * 16)
    frame.resources["probe_grid"] = ProbeGrid(low, high, per_side, coefficients)


def _project(frame: Frame) -> None:
    surfels: Surfels = frame.resources["surfels"]
    grid: ProbeGrid = frame.resources["probe_grid"]
    for binding, buffer in enumerate((surfels.buffer, reflected(frame), grid.coefficients)):
        buffer.bind_to_storage_buffer(binding)
    shader = frame.program("indirect_grid/project.comp")
    frame.dispatch(shader, grid.per_side**3, group=(1, 1), **surfels.uniforms(), **grid.uniforms())
    frame.resources["probes"] = grid


def _surfaces(surfels: Surfels) -> tuple[Float64, Float64]:
    """Places (N, 3) and areas (N,) of the surroundings without the sky."""
    data = surfels.buffer.read(4 * FLOATS_A_SURFEL * surfels.surroundings)
    rows = np.frombuffer(data, dtype=np.float32).reshape(-1, FLOATS_A_SURFEL)[:, :4].astype(float)
    surfaces = rows[rows[:, 3] > 0]
    return surfaces[:, :3], surfaces[:, 3]
