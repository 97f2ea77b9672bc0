"""Truths that are known, and techniques whose best constants are."""

from collections.abc import Callable

import numpy as np
import pytest

from comparisons.fit.example import Draw, Example
from comparisons.metrics import Samples
from scenes.image import Float64
from scenes.load import find_scene, load_scene

ROWS, COLUMNS = np.mgrid[:16, :12]
MISSED = 0.025


@pytest.fixture(scope="session")
def truth() -> Float64:
    """An image (16, 12, 3) that is positive everywhere."""
    made: Float64 = (1.2 + np.sin(ROWS / 3) * np.cos(COLUMNS / 4))[..., None] * np.array([1.0, 0.6, 0.3])
    return made


@pytest.fixture(scope="session")
def pattern() -> Float64:
    """An image that resembles no truth."""
    made: Float64 = (np.sin(COLUMNS / 2) + (ROWS < 6))[..., None] * np.array([1.0, -0.5, 0.8])
    return made


@pytest.fixture(scope="session")
def samples_of() -> Callable[..., Samples]:
    """Samples of a truth: samples_of(image, noise=0.5, seed=1), with gamma noise; exact without any."""

    def make(image: Float64, noise: float = 0.0, seed: int | np.random.Generator = 1) -> Samples:
        everywhere = np.ones(image.shape[:2], dtype=bool)
        if noise == 0:
            return Samples(image[None], everywhere, MISSED)
        shape = 1 / noise**2
        factors = np.random.default_rng(seed).gamma(shape, 1 / shape, size=(16, *image.shape))
        return Samples(image * factors, everywhere, MISSED)

    return make


@pytest.fixture
def example_of(samples_of: Callable[..., Samples]) -> Callable[..., Example]:
    """Makes an example: example_of(truth, draw, name="a", noise=0.0)."""
    scene = load_scene(find_scene("small-room-ellipsoid"))

    def make(image: Float64, draw: Draw, name: str = "a", noise: float = 0.0) -> Example:
        named = scene.model_copy(update={"name": name})
        return Example(named, "nrmse", samples_of(image, noise, len(name)), 256 if noise else 0, draw)

    return make
