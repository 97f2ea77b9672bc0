"""What a quantity is: how its truth is made for a scene, by which integrator and why that one suffices."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float32, Float64
from scenes.model import Scene

ExactRender = Callable[[Stage], Float32]
"""The whole image (H, W, C), free of noise."""

BlockRender = Callable[[Stage, NDArray[np.int64], int, int, float | None], Float64]
"""Mean of `spp` samples at each of P pixels: (stage, flat pixel indices (P,), 32-bit seed, spp, clamp) -> (P, C).

With a clamp each sample is scaled down until its largest channel is at most that, and the result is (P, 2 C): what is
kept, then what was removed. What an emitter sends to the sensor directly is never clamped.
"""


@dataclass(frozen=True)
class Integrator:
    """The cheapest way that is sufficient for a scene, and the reason in words.

    `exact` renders a noise-free image at once; `block` renders one independent block of samples. Exactly one is given.
    """

    name: str
    why: str
    exact: ExactRender | None = None
    block: BlockRender | None = None


def _never(features: Features) -> str:
    return ""


Display = Literal["radiance", "normal", "unit", "depth", "uv"]
"""How values become visible; see `comparisons.report.pictures.visible`."""


@dataclass(frozen=True)
class Quantity:
    """A quantity that both sides can produce.

    unit         : "length" in it stands for the scene's unit of length; see `unit_in`
    is_sampled   : whether there are scenes that have no exact truth of it
    judged_where : the exact quantity that is 1 at the pixels where this one is judged; everywhere if empty
    variants     : quantities that leave something out of this one, whose cost a report shows
    refuses      : for a scene on which the quantity is not defined, the reason in words
    """

    name: str
    unit: str
    summary: str
    display: Display
    channels: int
    is_sampled: bool
    integrator: Callable[[Features], Integrator]
    judged_where: str = ""
    refuses: Callable[[Features], str] = _never
    variants: tuple[str, ...] = ()

    def unit_in(self, scene: Scene) -> str:
        """The unit of the quantity's values in a scene."""
        return self.unit.replace("length", scene.length_unit)
