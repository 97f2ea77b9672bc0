"""Truths with known errors: the part of the error that is gone, and how often its interval holds it."""

from collections.abc import Callable

import numpy as np
import pytest

from comparisons.fit.gain import Pair, gain
from comparisons.metrics import Samples, evaluate
from comparisons.metrics.rel_mse import EPSILON
from scenes.image import Float64

SamplesOf = Callable[..., Samples]
REPETITIONS = 200


def squared(metric: str, image: Float64, truth: Float64) -> float:
    floor = 0 if metric == "nrmse" else (EPSILON * truth.mean()) ** 2
    weight = 1 / truth.mean() ** 2 if metric == "nrmse" else 1 / (truth**2 + floor)
    return float(np.mean(weight * (image - truth) ** 2))


@pytest.mark.parametrize("metric", ["nrmse", "rel_mse_eps1e-2"])
def test_of_exact_truths_the_gain_is_exact(
    truth: Float64, pattern: Float64, samples_of: SamplesOf, metric: str
) -> None:
    before, after = truth + 0.2 * pattern, truth + 0.1 * pattern
    found = gain(metric, [Pair(before, after, samples_of(truth))])
    assert found is not None
    assert found.low == found.value == found.high == pytest.approx(0.75)


def test_over_scenes_the_errors_are_summed(truth: Float64, pattern: Float64, samples_of: SamplesOf) -> None:
    """Half as bright a scene has the same relative error: the gains are weighted by errors alone."""
    pairs = [
        Pair(truth + 0.3 * pattern, truth + 0.1 * pattern, samples_of(truth)),
        Pair(0.5 * truth + 0.1 * pattern, 0.5 * truth + 0.2 * pattern, samples_of(0.5 * truth)),
    ]
    found = gain("nrmse", pairs)
    assert found is not None
    assert found.value == pytest.approx(1 - (0.1**2 + 0.4**2) / (0.3**2 + 0.2**2))
    assert found.value < 0


@pytest.mark.parametrize(("metric", "shift"), [("nrmse", 0.05), ("nrmse", -0.02), ("rel_mse_eps1e-2", -0.02)])
def test_the_interval_covers_a_known_gain(
    truth: Float64, pattern: Float64, samples_of: SamplesOf, metric: str, shift: float
) -> None:
    """Nominal is 95 %; of 200, fewer than 183 or more than 199 would be found once in 100 such tests.

    That of relative errors is widened for the noise of its weights, and may hold more.
    """
    other = 0.7 * truth
    images = [
        (1.1 * truth + 0.1 * pattern, (1.1 - shift) * truth + 0.1 * pattern),
        (0.9 * other, (0.9 + shift) * other),
    ]
    truths = (truth, other)
    before, after = (sum(squared(metric, pair[i], t) for pair, t in zip(images, truths, strict=True)) for i in (0, 1))
    rng = np.random.default_rng(7)
    found = [
        gain(metric, [Pair(a, b, samples_of(t, 0.3, rng)) for (a, b), t in zip(images, truths, strict=True)])
        for _ in range(REPETITIONS)
    ]
    held = sum(g is not None and g.low <= 1 - after / before <= g.high for g in found)
    assert held >= 183
    if metric == "nrmse":
        assert held <= 199


def test_of_an_error_that_may_be_zero_no_part_is_stated(truth: Float64, samples_of: SamplesOf) -> None:
    assert gain("nrmse", [Pair(truth, 1.1 * truth, samples_of(truth, 0.5))]) is None
    assert gain("nrmse", [Pair(truth, truth, samples_of(truth))]) is None


def test_the_same_image_gains_nothing_for_certain(truth: Float64, samples_of: SamplesOf) -> None:
    found = gain("nrmse", [Pair(1.3 * truth, 1.3 * truth, samples_of(truth, 0.5))])
    assert found is not None
    assert found.low == found.value == found.high == pytest.approx(0.0)


def test_common_noise_nearly_cancels(truth: Float64, samples_of: SamplesOf) -> None:
    """What is gained is known ten times better than each of the errors."""
    samples = samples_of(truth, 2.0)
    alone = evaluate("nrmse", 1.5 * truth, samples)
    found = gain("nrmse", [Pair(1.5 * truth, 1.49 * truth, samples)])
    assert found is not None
    assert 0 < found.high - found.low < (alone.high**2 - alone.low**2) / alone.value**2 / 10
    assert found.low <= 1 - (0.49 / 0.5) ** 2 <= found.high
