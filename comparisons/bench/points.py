"""The error of an image with its interval, from as much truth as it takes to know it well."""

from dataclasses import dataclass

from comparisons.bench.result import Interval
from comparisons.gate import fit_exposure
from comparisons.metrics import Estimate, Samples, evaluate
from reference.estimator import Reference, Truth
from scenes.image import Float32

ALPHA = 0.025
"""On either side: an interval for readers, on which nothing is decided."""

FIRST_SPP = 256
"""Samples a pixel that a truth starts with, unless there are more at hand."""

NARROW = 0.1
"""Samples are added until the interval is narrower than this share of the value."""


@dataclass(frozen=True)
class Judged:
    """The error of an image, the samples a pixel of the truth that it is from, and what is doubtful about it."""

    error: Interval
    spp: int
    note: str = ""


class Judge:
    """Holds images against the truth of one quantity by one metric; the truth grows as they need it."""

    def __init__(self, reference: Reference, quantity: str, metric: str) -> None:
        self.reference = reference
        self.quantity = quantity
        self.metric = metric
        self._truth = reference.at_hand(quantity, min(FIRST_SPP, self.limit))

    @property
    def limit(self) -> int:
        """Samples a pixel that the scene allows for its truth."""
        return self.reference.scene.truth.max_spp

    @property
    def truth(self) -> Truth:
        """All that is known of it so far."""
        return self._truth

    def judged(self, image: Float32, is_fitted: bool = False) -> Judged:
        """The error of an image (H, W, C), multiplied by the factor that fits best first if it `is_fitted`.

        Raises
        ------
        ImageError
            The image cannot be judged by this metric.
        """
        while True:
            found = self.estimate(image, is_fitted)
            is_known = found.valid and found.value > 0 and found.high - found.low <= NARROW * found.value
            if is_known or self._truth.is_exact or 2 * self._truth.spp > self.limit:
                break
            self.grow(2 * self._truth.spp)
        doubt = [found.note] if found.note else []
        if not is_known and not self._truth.is_exact:
            doubt.append(f"the interval is wide: the scene allows {self.limit} spp for its truth (max_spp)")
        return Judged(Interval(found.value, found.low, found.high), self._truth.spp, "; ".join(doubt))

    def estimate(self, image: Float32, is_fitted: bool = False) -> Estimate:
        """The error by the samples that are at hand."""
        samples = Samples(self._truth.accumulators, self._truth.mask, ALPHA)
        factor = fit_exposure(image, samples) if is_fitted else 1.0
        return evaluate(self.metric, image * factor, samples)

    def grow(self, spp: int) -> None:
        """See that the truth has so many samples a pixel, or as many as the scene allows."""
        if not self._truth.is_exact and self._truth.spp < min(spp, self.limit):
            self._truth = self.reference.truth(self.quantity, min(spp, self.limit))
