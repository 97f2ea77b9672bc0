"""What a metric is given and what it returns."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.errors import ImageError
from scenes.image import Bool, Float64

# The jackknife of a half needs three accumulators, and there are two halves.
MIN_ACCUMULATORS = 6


@dataclass(frozen=True)
class Samples:
    """The truth: K independent estimates of it, and the pixels that are judged.

    accumulators : (K, H, W, C), each the mean of the same number of samples a pixel. K = 1 means exact, free of noise.
    mask         : (H, W) bool. What lies outside is never judged and need not be finite.
    alpha        : how probably an interval may miss the true value on either side.
    """

    accumulators: NDArray[Any]
    mask: Bool
    alpha: float = 0.01

    def __post_init__(self) -> None:
        if self.accumulators.ndim != 4:
            raise ImageError(
                f"the truth has shape {self.accumulators.shape}; allowed is (accumulators, height, width, channels): "
                "stack the accumulators along the first axis."
            )
        count = len(self.accumulators)
        if count != 1 and (count < MIN_ACCUMULATORS or count % 2):
            raise ImageError(
                f"the truth has {count} accumulators; allowed is 1 (exact) or an even number from {MIN_ACCUMULATORS}: "
                "render it again in blocks with seeds of their own."
            )
        if self.mask.dtype != np.bool_ or self.mask.shape != self.accumulators.shape[1:3]:
            raise ImageError(
                f"the mask is {self.mask.dtype} of shape {self.mask.shape}; allowed is bool of the truth's shape "
                f"{self.accumulators.shape[1:3]}: build the mask at the truth's resolution."
            )
        if not self.mask.any():
            raise ImageError(
                "the mask is empty: no pixel would be judged. At least one pixel is needed: check that the sensor sees "
                "the subject."
            )
        bad = int(np.count_nonzero(~np.isfinite(self.accumulators[:, self.mask])))
        if bad:
            raise ImageError(
                f"the truth has {bad} values inside the mask that are NaN or infinite; only finite values are allowed: "
                "render the truth again."
            )

    @property
    def is_exact(self) -> bool:
        return len(self.accumulators) == 1

    @cached_property
    def masked(self) -> Float64:
        """(K, P, C), the accumulators at the P pixels that are judged."""
        values: Float64 = self.accumulators[:, self.mask].astype(np.float64)
        return values

    @cached_property
    def mean(self) -> Float64:
        """(H, W, C), the best estimate of the truth; 0 outside the mask."""
        return self._spread(self.masked)

    @cached_property
    def half_means(self) -> tuple[Float64, Float64]:
        """Two (H, W, C) estimates, each from its own half of the accumulators; 0 outside the mask."""
        half = len(self.accumulators) // 2
        return self._spread(self.masked[:half]), self._spread(self.masked[half:])

    @cached_property
    def variance_of_mean(self) -> Float64:
        """(P, C), how noisy the mean of the accumulators is."""
        variance: Float64 = self.masked.var(axis=0, ddof=1) / len(self.masked)
        return variance

    @cached_property
    def standard_error(self) -> Float64:
        """(H, W, C), the standard error of `mean`; 0 where the truth is exact, and outside the mask."""
        image = np.zeros(self.accumulators.shape[1:])
        if not self.is_exact:
            image[self.mask] = np.sqrt(self.variance_of_mean)
        return image

    def _spread(self, values: Float64) -> Float64:
        image = np.zeros(self.accumulators.shape[1:])
        image[self.mask] = values.mean(axis=0)
        return image


@dataclass(frozen=True)
class Estimate:
    """A metric's value and the interval that decisions are made on.

    With an exact truth low == value == high. An estimate that is not `valid` decides nothing; `note` says why, or what
    else should be known about it. `floor` is what the truth's noise alone reads where nothing corrects for it; None
    where noise does not add to the metric.
    """

    value: float
    low: float
    high: float
    valid: bool = True
    note: str = ""
    floor: float | None = None

    @classmethod
    def exact(cls, value: float, note: str = "") -> "Estimate":
        return cls(value, value, value, note=note)


def positive_mean(samples: Samples, metric: str) -> float:
    """The truth's mean over pixels and channels, which relative metrics divide by."""
    mean = float(samples.masked.mean())
    if mean <= 0:
        raise ImageError(
            f"{metric} divides by the mean of the truth, which is {mean:g}; it must be positive: choose a metric in "
            "absolute units (rms, max_abs), or light the subject."
        )
    return mean


def require_rgb(samples: Samples, metric: str) -> None:
    """Refuse a truth that is not a colour image."""
    channels = samples.accumulators.shape[-1]
    if channels != 3:
        raise ImageError(
            f"{metric} judges colours and needs 3 channels; the truth has {channels}: choose a metric that takes any "
            "number of channels (nrmse, rms)."
        )


def require_exact(samples: Samples, metric: str) -> None:
    """Refuse a noisy truth."""
    if not samples.is_exact:
        raise ImageError(
            f"{metric} takes the truth as exact, but it has {len(samples.accumulators)} noisy accumulators, whose "
            "noise would count as error: choose a metric that corrects for noise (nrmse, rel_mse_eps1e-2, energy_bias)."
        )


def require_fractions(samples: Samples, metric: str) -> None:
    """Refuse a truth that is not between 0 and 1 everywhere."""
    low, high = float(samples.masked.min()), float(samples.masked.max())
    if low < 0 or high > 1:
        raise ImageError(
            f"{metric} judges fractions, such as visibility; the truth has values from {low:g} to {high:g}, allowed "
            "is 0 to 1: choose a metric for any quantity (rmse, nrmse)."
        )
