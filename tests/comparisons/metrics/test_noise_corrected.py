"""Synthetic truths with known errors: each metric is unbiased, and its interval holds what it says."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from comparisons.metrics import Samples, evaluate
from comparisons.metrics.nrmse import relative_mse
from comparisons.metrics.rel_mse import EPSILON, weighted_errors
from scenes.image import Float64

Noisy = Callable[[Float64, float], Samples]
Exact = Callable[[Float64], Samples]

ROWS, COLUMNS = np.mgrid[:24, :20]
TRUTH: Float64 = (1.2 + np.sin(ROWS / 3) * np.cos(COLUMNS / 4))[..., None] * np.array([1.0, 0.6, 0.3])
PATTERN: Float64 = (np.sin(COLUMNS / 2) + (ROWS < 6))[..., None] * np.array([1.0, -0.5, 0.8])
REPETITIONS = 200


def true_nrmse(image: Float64) -> float:
    return float(np.sqrt(np.mean((image - TRUTH) ** 2)) / TRUTH.mean())


def true_rel_mse(image: Float64) -> float:
    return float(np.mean((image - TRUTH) ** 2 / (TRUTH**2 + (EPSILON * TRUTH.mean()) ** 2)))


@pytest.mark.parametrize("error", [0.0, 0.02, 0.2])
def test_nrmse_squared_is_unbiased(error: float, noisy: Noisy) -> None:
    image = TRUTH + error * PATTERN
    values = []
    for _ in range(REPETITIONS):
        samples = noisy(TRUTH, 0.4)
        values.append(relative_mse(image[samples.mask], samples.masked)[0])
    assert np.mean(values) == pytest.approx(true_nrmse(image) ** 2, abs=3 * np.std(values) / REPETITIONS**0.5)


def test_naive_nrmse_would_be_biased(noisy: Noisy) -> None:
    """Expected loss: a perfect image under noise of 0.4 in each of 16 accumulators reads about 0.4 / 4, not 0."""
    samples = noisy(TRUTH, 0.4)
    naive = float(np.sqrt(np.mean((TRUTH - samples.mean) ** 2)) / samples.mean.mean())
    estimate = evaluate("nrmse", TRUTH, samples)
    assert naive > 0.1
    assert estimate.low == 0.0
    assert estimate.value < 0.03 < naive


@pytest.mark.parametrize("metric", ["nrmse", "rel_mse_eps1e-2", "energy_bias", "signed_bias"])
@pytest.mark.parametrize(("error", "noise"), [(0.0, 0.3), (0.05, 0.3), (0.3, 0.05)])
def test_the_truth_lies_in_the_decision_interval(metric: str, error: float, noise: float, noisy: Noisy) -> None:
    """Each side may be missed with probability 0.1 %: 4 misses in 200 would happen once in 1000 tests."""
    image = TRUTH * (1 + error) + error * PATTERN
    true = {
        "nrmse": true_nrmse(image),
        "rel_mse_eps1e-2": true_rel_mse(image),
        "energy_bias": float(image.mean() / TRUTH.mean() - 1),
        "signed_bias": float(image.mean() - TRUTH.mean()),
    }[metric]
    estimates = [evaluate(metric, image, replace(noisy(TRUTH, noise), alpha=0.001)) for _ in range(REPETITIONS)]
    assert sum(not estimate.low <= true <= estimate.high for estimate in estimates) <= 3
    assert all(estimate.low <= estimate.value <= estimate.high for estimate in estimates)


@pytest.mark.parametrize(
    ("metric", "level"), [("nrmse", 2.326), ("rel_mse_eps1e-2", 2.326), ("energy_bias", 2.602), ("signed_bias", 2.602)]
)
def test_the_interval_is_no_wider_than_it_must_be(metric: str, level: float, noisy: Noisy) -> None:
    """The half-width over its level (z, or Student's t for 15 degrees) is the spread over repetitions."""
    image = TRUTH + 0.08 * PATTERN
    estimates = [evaluate(metric, image, noisy(TRUTH, 0.08)) for _ in range(REPETITIONS)]
    spread = np.std([estimate.value for estimate in estimates])
    half_width = np.mean([(estimate.high - estimate.low) / 2 for estimate in estimates])
    assert half_width / level == pytest.approx(spread, rel=0.25)


def test_the_floor_is_what_noise_adds_to_a_plain_reading(noisy: Noisy) -> None:
    samples = noisy(TRUTH, 0.4)
    naive = float(np.sqrt(np.mean((TRUTH - samples.mean) ** 2)) / samples.mean.mean())
    assert evaluate("nrmse", 1.1 * TRUTH, samples).floor == pytest.approx(naive, rel=0.05)
    assert evaluate("rel_mse_eps1e-2", 1.1 * TRUTH, samples).floor == pytest.approx(0.4**2 / 16, rel=0.1)
    assert evaluate("energy_bias", 1.1 * TRUTH, samples).floor is None


@pytest.mark.parametrize(("noise", "tolerance"), [(0.1, 0.01), (0.4, 0.02), (1.0, 0.2)])
def test_rel_mse_bias_is_small(noise: float, tolerance: float, noisy: Noisy) -> None:
    """Noise of 1.0 in each accumulator is past what the weights' correction can do: blurred weights cost some bias."""
    image = TRUTH * 1.3 + 0.1 * PATTERN
    values = []
    for _ in range(REPETITIONS):
        samples = noisy(TRUTH, noise)
        terms = weighted_errors(image[samples.mask], samples, (EPSILON * samples.masked.mean()) ** 2)
        values.append(terms.values.mean())
    true = true_rel_mse(image)
    slack = tolerance * true + 3 * np.std(values) / REPETITIONS**0.5
    assert np.mean(values) == pytest.approx(true, abs=slack)


@pytest.mark.parametrize("metric", ["nrmse", "rel_mse_eps1e-2", "energy_bias"])
def test_a_truth_without_noise_agrees_with_the_exact_one(metric: str, exact: Exact) -> None:
    image = 1.1 * TRUTH + 0.1 * PATTERN
    copies = Samples(np.repeat(TRUTH[None], 16, axis=0), np.ones(TRUTH.shape[:2], dtype=bool))
    estimate = evaluate(metric, image, copies)
    expected = evaluate(metric, image, exact(TRUTH)).value
    assert [estimate.low, estimate.value, estimate.high] == pytest.approx([expected] * 3, abs=1e-9)


def test_the_signed_bias_of_an_offset_is_the_offset_whatever_the_truth(exact: Exact) -> None:
    for truth in (TRUTH, TRUTH - TRUTH.mean(), -TRUTH):
        assert evaluate("signed_bias", truth + 0.25, exact(truth)).value == pytest.approx(0.25)


def test_closed_forms_of_a_gain(exact: Exact) -> None:
    """x = 1.1 y: nrmse is 0.1 rms(y) / mean(y), relative MSE just below 0.01, and energy 10 % too high."""
    samples = exact(TRUTH)
    nrmse = evaluate("nrmse", 1.1 * TRUTH, samples)
    assert nrmse.low == nrmse.value == nrmse.high
    assert nrmse.value == pytest.approx(0.1 * np.sqrt(np.mean(TRUTH**2)) / TRUTH.mean())
    assert 0.0095 < evaluate("rel_mse_eps1e-2", 1.1 * TRUTH, samples).value < 0.01
    assert evaluate("energy_bias", 1.1 * TRUTH, samples).value == pytest.approx(0.1)


def test_black_pixels_do_not_divide_by_zero(exact: Exact) -> None:
    """Where y = 0 the relative error is |x|² / (0.01 mean)²: an image that is off by 1 % of the mean there reads 1."""
    truth = TRUTH.copy()
    truth[:12] = 0.0
    image = truth.copy()
    image[:12] = EPSILON * truth.mean()
    assert evaluate("rel_mse_eps1e-2", image, exact(truth)).value == pytest.approx(0.5)


def test_only_the_mask_is_judged(noisy: Noisy) -> None:
    samples = noisy(TRUTH, 0.1)
    mask = COLUMNS > 8
    image = np.where(mask[..., None], TRUTH, 1e6)
    assert evaluate("nrmse", image, Samples(samples.accumulators, mask)).value < 0.05


@pytest.mark.parametrize("metric", ["nrmse", "rel_mse_eps1e-2", "energy_bias"])
def test_fireflies_make_the_estimate_invalid(metric: str, noisy: Noisy) -> None:
    samples = noisy(TRUTH, 0.1)
    accumulators = samples.accumulators.copy()
    accumulators[3, 5, 7:10] = 500.0
    estimate = evaluate(metric, TRUTH, Samples(accumulators, samples.mask))
    assert not estimate.valid
    assert "fireflies" in estimate.note
