"""Clipped at display white: what counts, and that noise near white does not make the interval dishonest."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from comparisons.metrics import Samples, evaluate
from comparisons.metrics.rel_mse import EPSILON
from comparisons.tonemap import MEAN_VALUE
from scenes.image import Float64

Noisy = Callable[[Float64, float], Samples]
Exact = Callable[[Float64], Samples]

ROWS, COLUMNS = np.mgrid[:24, :20]
TRUTH: Float64 = (1.2 + np.sin(ROWS / 3) * np.cos(COLUMNS / 4))[..., None] * np.array([1.0, 0.6, 0.3])
CLIPPED = "rel_mse_clipped"
LAMP = (ROWS < 2) & (COLUMNS < 3)


def white_of(truth: Float64) -> float:
    return float(truth.mean()) / MEAN_VALUE


def with_lamp(level: float) -> Float64:
    """The truth with a lamp of so many times the white that is shown then."""
    share = LAMP.mean()
    rest = TRUTH[~LAMP].mean() * (1 - share)
    white = rest / (MEAN_VALUE - level * share)
    truth: Float64 = np.where(LAMP[..., None], level * white, TRUTH)
    assert white_of(truth) == pytest.approx(white)
    return truth


def true_error(image: Float64, truth: Float64) -> float:
    x, y = (np.minimum(a, white_of(truth)) for a in (image, truth))
    return float(np.mean((x - y) ** 2 / (y**2 + (EPSILON * y.mean()) ** 2)))


def test_below_white_it_is_the_plain_metric(exact: Exact, noisy: Noisy) -> None:
    for samples in (exact(TRUTH), noisy(TRUTH, 0.1)):
        assert evaluate(CLIPPED, 1.1 * TRUTH, samples) == evaluate("rel_mse_eps1e-2", 1.1 * TRUTH, samples)


def test_highlights_count_up_to_white(exact: Exact) -> None:
    """A lamp that is drawn half as bright, but above white, is no error; drawn black, it is all wrong: its share."""
    truth = with_lamp(4.0)
    half = np.where(LAMP[..., None], 0.5 * truth, truth)
    assert evaluate(CLIPPED, half, exact(truth)).value == 0.0
    assert evaluate("rel_mse_eps1e-2", half, exact(truth)).value == pytest.approx(0.25 * LAMP.mean(), rel=1e-3)
    black = np.where(LAMP[..., None], 0.0, truth)
    assert evaluate(CLIPPED, black, exact(truth)).value == pytest.approx(LAMP.mean(), rel=1e-3)


def test_what_is_drawn_too_bright_counts_up_to_white(exact: Exact) -> None:
    truth = with_lamp(4.0)
    for factor in (50.0, 1e6):
        image = np.where(LAMP[..., None], truth, factor * truth)
        assert evaluate(CLIPPED, image, exact(truth)).value == pytest.approx(true_error(image, truth))
    assert true_error(image, truth) < (white_of(truth) / TRUTH.min()) ** 2


@pytest.mark.parametrize("level", [0.8, 1.0, 1.2, 4.0])
@pytest.mark.parametrize("error", [0.0, 0.05, -0.2])
def test_the_truth_lies_in_the_interval_wherever_highlights_are(level: float, error: float, noisy: Noisy) -> None:
    """Noise of 30 % in an accumulator lowers a clipped lamp at white by 12 %: its pixels then are that far off."""
    truth = with_lamp(level)
    image = truth * (1 + error)
    true = true_error(image, truth)
    estimates = [evaluate(CLIPPED, image, replace(noisy(truth, 0.3), alpha=0.001)) for _ in range(100)]
    assert sum(not e.low <= true <= e.high for e in estimates) <= 2
    assert all(e.low <= e.value <= e.high for e in estimates)


def test_the_interval_grows_by_what_clipping_does_and_by_little_more(noisy: Noisy) -> None:
    """An image without error: the value is too high by the square of what the lamp loses, 0.4 s at white."""
    truth, noise = with_lamp(1.0), 0.3
    samples = [noisy(truth, noise) for _ in range(100)]
    clipped = [evaluate(CLIPPED, truth, s) for s in samples]
    plain = [evaluate("rel_mse_eps1e-2", truth, s) for s in samples]
    loss = LAMP.mean() * (noise / np.sqrt(2 * np.pi)) ** 2
    wider = np.mean([c.high for c in clipped]) - np.mean([p.high for p in plain])
    assert np.mean([c.value for c in clipped]) > 0.5 * loss
    assert loss < wider < 5 * loss


def test_noise_that_is_small_costs_nothing(noisy: Noisy) -> None:
    truth = with_lamp(1.3)
    samples = noisy(truth, 0.03)
    clipped, plain = (evaluate(name, 1.02 * truth, samples) for name in (CLIPPED, "rel_mse_eps1e-2"))
    assert clipped.high - clipped.low == pytest.approx(plain.high - plain.low, rel=0.02)


def test_the_floor_is_what_noise_adds_to_a_plain_reading(noisy: Noisy) -> None:
    assert evaluate(CLIPPED, 1.1 * TRUTH, noisy(TRUTH, 0.2)).floor == pytest.approx(0.2**2 / 16, rel=0.15)
