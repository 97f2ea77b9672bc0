"""A scene to fit on or to test on: its truth, and the error of what a technique draws of it.

An error E (`comparisons.difference.ERRORS`) is a mean over products (x - Y_i) (x - Y_j) of different accumulators of
the truth. It differs from (x - Y)², Y being a mean of them, by something that is the same for every image x. All
settings are held against the same samples, so their noise is a constant that moves no minimum: the fit is that to Y,
which is as far from the truth as its error bars say, and the errors themselves are unbiased.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from comparisons.difference import error_named, with_accumulators
from comparisons.fit.search import Settings
from comparisons.metrics import Samples, check_image
from comparisons.metrics.rel_mse import denominator_floor
from comparisons.metrics.sample import positive_mean
from scenes.errors import ImageError
from scenes.image import Float64
from scenes.model import Scene

Draw = Callable[[Settings], Float64]
"""The image (H, W, C) with some settings."""


@dataclass(frozen=True)
class Parabola:
    """The error E of an image times a factor s: `square` s² - 2 `linear` s + `constant`."""

    square: float
    linear: float
    constant: float

    def at(self, factor: float) -> float:
        return self.square * factor**2 - 2 * self.linear * factor + self.constant


def best_factor(parabolas: Sequence[Parabola]) -> float:
    """The one factor on all images for which the sum of their errors is least.

    Raises
    ------
    ImageError
        It is not positive.
    """
    square, linear = sum(p.square for p in parabolas), sum(p.linear for p in parabolas)
    if square <= 0 or linear <= 0:
        raise ImageError(
            "No exposure can be fitted: the images are black, or darker where the truth is brighter. See what the "
            "technique draws."
        )
    return linear / square


class Example:
    """One scene. What was drawn once is not drawn again for its error.

    spp : samples a pixel of the truth, 0 if that is exact
    rough : the same scene in a form that is quick to draw, if that is needed
    drawings : how many images were drawn
    """

    def __init__(
        self, scene: Scene, metric: str, samples: Samples, spp: int, draw: Draw, rough: "Example | None" = None
    ) -> None:
        self.scene = scene
        self.metric = metric
        self.samples = samples
        self.spp = spp
        self.draw = draw
        self.rough = rough or self
        self.drawings = 0
        self._known: dict[tuple[object, ...], Parabola] = {}

    def parabola(self, settings: Settings) -> Parabola:
        """The error with some settings, for all exposures."""
        key = tuple(sorted(settings.items()))
        if key not in self._known:
            image = self._drawn(settings)
            constant, there, back = self._black, self._error(image), self._error(-image)
            self._known[key] = Parabola((there + back) / 2 - constant, (back - there) / 4, constant)
        return self._known[key]

    def weighted(self, settings: Settings) -> tuple[Float64, Float64]:
        """Image and truth, flat and weighted: the squared distance between them is the error, and a constant."""
        image, truth = self._drawn(settings), self.samples.masked.mean(axis=0)
        return (self._weights * image).ravel(), (self._weights * truth).ravel()

    @cached_property
    def _weights(self) -> Float64:
        truth = self.samples.masked.mean(axis=0)
        if self.metric == "nrmse":
            size = np.full(truth.shape, positive_mean(self.samples, self.metric))
        else:
            size = np.sqrt(truth**2 + denominator_floor(self.samples))
        return np.asarray(1 / (size * np.sqrt(truth.size)))

    def _drawn(self, settings: Settings) -> Float64:
        self.drawings += 1
        return check_image(self.draw(settings), self.samples)[self.samples.mask]

    @cached_property
    def _black(self) -> float:
        return self._error(np.zeros(self.samples.masked.shape[1:]))

    @cached_property
    def _accumulators(self) -> Samples:
        return with_accumulators(self.samples)

    def _error(self, judged: Float64) -> float:
        return error_named(self.metric)(judged, self._accumulators)[0]
