"""Power laws: how time grows with size, or error falls with samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from comparisons.bench.result import Interval
from scenes.errors import InputError
from scenes.image import Float64

LEAST_SIZES = 3
"""Different sizes. A line through two points says nothing about how well it fits."""


@dataclass(frozen=True)
class PowerLaw:
    """seconds = coefficient * size ** exponent; `r2` is how much of the variance of the logarithms it explains."""

    exponent: Interval
    coefficient: float
    r2: float

    def at(self, size: float) -> float:
        """What the law says of a size."""
        return float(self.coefficient * size**self.exponent.value)


def fit_power_law(sizes: Sequence[float], seconds: Sequence[float]) -> PowerLaw:
    """The straight line through (log size, log seconds) by least squares.

    The exponent has the 95 % interval of Student's t with n - 2 degrees of freedom (Draper & Smith 1998, "Applied
    Regression Analysis", section 1.4), which holds where deviations are a share of the value, even and independent.

    Raises
    ------
    InputError
        Less than three different sizes, or a value that is not positive and finite.
    """
    x, y = np.array(sizes, dtype=np.float64), np.array(seconds, dtype=np.float64)
    _require_fit(x, y)
    from scipy import stats

    line = stats.linregress(np.log(x), np.log(y))
    half = float(stats.t.ppf(0.975, len(x) - 2) * line.stderr)
    exponent = float(line.slope)
    return PowerLaw(
        Interval(exponent, exponent - half, exponent + half), float(np.exp(line.intercept)), float(line.rvalue**2)
    )


def _require_fit(x: Float64, y: Float64) -> None:
    different = len(np.unique(x))
    if len(x) != len(y) or different < LEAST_SIZES:
        raise InputError(
            f"A power law was asked for with {len(x)} sizes, {different} of them different, and {len(y)} values. "
            f"It takes as many values as sizes, and at least {LEAST_SIZES} different sizes: measure more of them."
        )
    values = np.concatenate([x, y])
    wrong = values[~((values > 0) & np.isfinite(values))]
    if len(wrong):
        raise InputError(
            f"A power law was asked for through {wrong[0]:g}; sizes and values must be positive and finite. "
            "Leave out what was not measured."
        )
