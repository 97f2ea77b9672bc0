"""Pixels as means of independent samples: what all sampled truths share."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.stage import Stage
from scenes.image import Float32, Float64

Trace = Callable[[Stage, Any, Any], tuple[Any, Any]]
"""One sample for each camera ray: (stage, sampler, rays) -> radiance that comes straight from an emitter, all other."""


def pixel_means(
    trace: Trace, stage: Stage, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None
) -> Float64:
    """Mean of `spp` samples at each pixel (P,), box-filtered: see `reference.quantity.BlockRender`.

    Samples are independent. Mitsuba's multijittered ones halve the variance, but are biased in short sequences:
    measured on indirect light in the library's large room against independent ones, -6.3 % with 4 samples and -0.7 %
    with 16.
    """
    import drjit as dr

    mi = stage.mi
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(pixels) * spp)
    x = np.repeat((pixels % stage.width).astype(np.float32), spp)
    y = np.repeat((pixels // stage.width).astype(np.float32), spp)
    jitter = sampler.next_2d()
    ray = stage.rays(mi.Float(x) + jitter.x, mi.Float(y) + jitter.y)
    emitted, other = trace(stage, sampler, ray)
    channels = [*(emitted + other)]
    if clamp is not None:
        brightest = dr.max(other)
        kept = other * dr.select(brightest > clamp, clamp / brightest, 1.0)
        channels = [*(emitted + kept), *(other - kept)]
    sums = [dr.block_sum(c, spp).numpy().astype(np.float64) for c in channels]
    return np.stack(sums, axis=-1) / spp


def darkness(stage: Stage) -> Float32:
    """An image (H, W, 3) without light."""
    return np.zeros((stage.height, stage.width, 3), dtype=np.float32)
