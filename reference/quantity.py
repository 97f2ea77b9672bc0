"""What a quantity is: how its truth is made for a scene, by which integrator and why that one suffices."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reference.stage import Stage
from scenes.image import Float32, Float64
from scenes.model import Scene


@dataclass(frozen=True)
class Integrator:
    """The cheapest way that is sufficient for a scene, and the reason in words."""

    name: str
    why: str


ExactRender = Callable[[Stage], Float32]
"""The whole image (H, W, C), free of noise."""

BlockRender = Callable[[Stage, NDArray[np.int64], int, int], Float64]
"""Mean of `spp` samples at each of P pixels: (stage, flat pixel indices (P,), 32-bit seed, spp) -> (P, C)."""


@dataclass(frozen=True)
class Quantity:
    """A quantity that both sides can produce.

    `exact` renders a noise-free image at once; `block` renders one independent block of samples. Exactly one is given.
    """

    name: str
    unit: str
    summary: str
    display: Literal["radiance", "normal", "unit", "depth"]
    channels: int
    integrator: Callable[[Scene], Integrator]
    exact: ExactRender | None = None
    block: BlockRender | None = None
