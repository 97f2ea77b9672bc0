"""What a truth loses when it leaves something out: its named variants, held against the truth in full."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from comparisons.metrics.nrmse import relative_mse
from comparisons.statistics import student_quantile
from reference.estimator import Truth
from reference.quantities import quantity

ALPHA = 0.025
"""On either side: an interval for readers, on which nothing is decided."""


def costs_of_variants(truth: Truth, truth_at: Callable[[str, int], Truth]) -> tuple[dict[str, Any], ...]:
    """The error of each variant of a quantity, without the noise of either truth.

    Parameters
    ----------
    truth_at : gives the truth of a quantity with at least so many samples a pixel.

    Returns
    -------
    For each variant its `quantity`, its `summary`, its `nrmse` with `low` and `high` (95 %), and its `energy_bias`.
    """
    return tuple(_cost(truth, truth_at(name, truth.spp), name) for name in quantity(truth.quantity).variants)


def _cost(truth: Truth, variant: Truth, name: str) -> dict[str, Any]:
    full, left = (t.accumulators[:, truth.mask].astype(np.float64) for t in (truth, variant))
    value, low, high = _nrmse(left, full)
    return {
        "quantity": name,
        "summary": quantity(name).summary,
        "nrmse": value,
        "low": low,
        "high": high,
        "energy_bias": float(left.mean() / full.mean()) - 1,
    }


def _nrmse(left: Any, full: Any) -> tuple[float, float, float]:
    """Root mean square difference over the mean of `full`, both (K, P, C), and its interval.

    The difference of two accumulators is an unbiased estimate of the difference of the truths: the squared error from
    products of different ones has no noise floor, whichever of the two the noise comes from.
    """
    if len(left) == 1 or len(full) == 1:
        error = float(np.sqrt(np.mean((left.mean(axis=0) - full.mean(axis=0)) ** 2)) / full.mean())
        return error, error, error
    relative, terms = relative_mse(left, full)
    half_width = student_quantile(ALPHA, len(full[0])) * terms.standard_error_of_mean
    value, low, high = (math.sqrt(max(0.0, x)) for x in (relative, relative - half_width, relative + half_width))
    return value, low, high
