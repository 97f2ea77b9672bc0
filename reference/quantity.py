"""What a quantity is: how its truth is made for a scene, by which integrator and why that one suffices."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float32, Float64

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


@dataclass(frozen=True)
class Quantity:
    """A quantity that both sides can produce. `is_sampled` if there are scenes that have no exact truth of it."""

    name: str
    unit: str
    summary: str
    display: Literal["radiance", "normal", "unit", "depth"]
    channels: int
    is_sampled: bool
    integrator: Callable[[Features], Integrator]
