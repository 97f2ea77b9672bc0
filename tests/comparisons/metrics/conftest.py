from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from comparisons.metrics import Samples
from scenes.image import Float64

NoisySamples = Callable[[Float64, float], Samples]
ExactSamples = Callable[[NDArray[Any]], Samples]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240607)


@pytest.fixture
def exact() -> ExactSamples:
    """Makes an exact truth of an image, judged at every pixel."""
    return lambda truth: Samples(truth[None], np.ones(truth.shape[:2], dtype=bool))


@pytest.fixture
def noisy(rng: np.random.Generator) -> NoisySamples:
    """Makes 16 accumulators with skewed (gamma) noise of a given relative size around an image."""

    def make(truth: Float64, noise: float) -> Samples:
        factors = rng.gamma(noise**-2, noise**2, size=(16, *truth.shape))
        return Samples(truth * factors, np.ones(truth.shape[:2], dtype=bool))

    return make
