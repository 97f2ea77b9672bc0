"""The pixel that a failure names."""

import numpy as np
import pytest

from comparisons.metrics import Samples
from comparisons.worst_pixel import worst_pixel

RNG = np.random.default_rng(3)


def noisy(sigma: float) -> Samples:
    accumulators = 1.0 + sigma * RNG.standard_normal((16, 12, 20, 3))
    return Samples(accumulators, np.ones((12, 20), dtype=bool))


def test_a_planted_error_is_found_with_its_values() -> None:
    samples = noisy(0.01)
    image = samples.mean.copy()
    image[7, 13] += (0.0, -0.4, 0.0)
    found = worst_pixel(image, samples)
    assert (found["x"], found["y"]) == (13, 7)
    assert found["realtime"] == image[7, 13].tolist()
    assert found["truth"] == samples.mean[7, 13].tolist()
    assert found["sigma"] == pytest.approx([0.01 / 4] * 3, rel=0.5)


def test_a_small_sure_error_stands_out_more_than_a_large_noisy_one() -> None:
    accumulators = np.ones((16, 4, 4, 1))
    accumulators[:, 0, 0, 0] += np.linspace(-8, 8, 16)
    samples = Samples(accumulators, np.ones((4, 4), dtype=bool))
    image = np.ones((4, 4, 1))
    image[0, 0], image[2, 3] = 1.5, 1.1
    found = worst_pixel(image, samples)
    assert (found["x"], found["y"]) == (3, 2)


def test_what_is_not_judged_is_never_the_worst() -> None:
    mask = np.zeros((4, 4), dtype=bool)
    mask[1, 2] = True
    samples = Samples(np.ones((1, 4, 4, 1)), mask)
    image = np.full((4, 4, 1), np.nan)
    image[1, 2] = 1.0
    found = worst_pixel(image, samples)
    assert (found["x"], found["y"], found["sigma"]) == (2, 1, [0.0])
