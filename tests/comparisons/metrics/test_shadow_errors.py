"""Errors of shadows: closed forms, what noise does to them, and whose pixels count."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from comparisons.metrics import Samples, evaluate
from comparisons.metrics.penumbra_rmse import near_edges
from comparisons.metrics.rmse import mean_squared_errors
from scenes.errors import ImageError
from scenes.image import Float64

Noisy = Callable[[Float64, float], Samples]
Exact = Callable[[Float64], Samples]

HEIGHT, WIDTH = 32, 60
ROWS, COLUMNS = np.mgrid[:HEIGHT, :WIDTH]
EVERYWHERE = np.ones((HEIGHT, WIDTH), dtype=bool)
REPETITIONS = 200

Y, X = np.mgrid[:24, :20]
LEVELS: Float64 = (1.2 + np.sin(Y / 3) * np.cos(X / 4))[..., None] * np.array([1.0, 0.6])
PATTERN: Float64 = (np.sin(X / 2) + (Y < 6))[..., None] * np.array([1.0, -0.5])


def soft_edge(half_width: float) -> Float64:
    """(H, W, 1), a disk of light behind a slanted straight edge, whose shadow is 2 `half_width` pixels wide."""
    z = np.clip((COLUMNS - 25.3 - 0.23 * ROWS) / half_width, -1, 1)
    seen: Float64 = 0.5 + (z * np.sqrt(1 - z**2) + np.arcsin(z)) / np.pi
    return seen[..., None]


def counted(truth: Float64, samples: int, rng: np.random.Generator) -> Samples:
    """16 accumulators of shadow rays that are lit or not: as noisy as visibility can be."""
    return Samples(rng.binomial(samples, truth, size=(16, *truth.shape)) / samples, EVERYWHERE)


def root_mean_square(values: Float64) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_a_shadow_that_is_moved_is_misclassified_over_its_shift(exact: Exact) -> None:
    """A straight edge that is 3 of 60 columns off; one that is a quarter of a column off."""
    truth = (COLUMNS >= 20)[..., None].astype(float)
    moved = (COLUMNS >= 23)[..., None].astype(float)
    assert evaluate("misclassified", moved, exact(truth)).value == pytest.approx(3 / WIDTH)
    assert evaluate("misclassified", 1 - truth, exact(truth)).value == 1
    assert evaluate("misclassified", truth, exact(truth)).high == 0
    blended = np.where(COLUMNS[..., None] == 20, 0.75, truth)
    assert evaluate("misclassified", blended, exact(truth)).value == pytest.approx(0.25 / WIDTH)


def test_only_judged_pixels_are_misclassified() -> None:
    truth = (COLUMNS >= 20)[..., None].astype(float)
    samples = Samples(truth[None], COLUMNS < 20)
    assert evaluate("misclassified", np.ones_like(truth), samples).value == 1
    assert evaluate("misclassified", np.zeros_like(truth), samples).value == 0


def test_a_noisy_truth_is_not_classified(noisy: Noisy) -> None:
    with pytest.raises(ImageError, match="misclassified takes the truth as exact"):
        evaluate("misclassified", np.ones((8, 8, 1)), noisy(np.full((8, 8, 1), 0.5), 0.1))


@pytest.mark.parametrize("metric", ["misclassified", "penumbra_rmse"])
def test_a_truth_that_is_no_fraction_is_refused(metric: str, exact: Exact) -> None:
    with pytest.raises(ImageError, match=rf"{metric} judges fractions.*from -1 to 2"):
        evaluate(metric, np.zeros((4, 6, 1)), exact(np.linspace(-1, 2, 24).reshape(4, 6, 1)))


def test_closed_forms_of_rmse(exact: Exact) -> None:
    """An offset reads as itself whatever the truth; a gain of 1.1 as a tenth of the truth's root mean square."""
    for truth in (LEVELS, LEVELS - LEVELS.mean(), np.zeros_like(LEVELS)):
        assert evaluate("rmse", truth - 0.25, exact(truth)).value == pytest.approx(0.25)
    samples = exact(LEVELS)
    estimate = evaluate("rmse", 1.1 * LEVELS, samples)
    assert estimate.low == estimate.value == estimate.high == pytest.approx(0.1 * root_mean_square(LEVELS))
    assert estimate == evaluate("rms", 1.1 * LEVELS, samples)
    assert estimate.value == pytest.approx(evaluate("nrmse", 1.1 * LEVELS, samples).value * LEVELS.mean())


@pytest.mark.parametrize("error", [0.0, 0.02, 0.2])
def test_rmse_squared_is_unbiased(error: float, noisy: Noisy) -> None:
    image = LEVELS + error * PATTERN
    values = [mean_squared_errors(image, noisy(LEVELS, 0.4)).values.mean() for _ in range(REPETITIONS)]
    true = root_mean_square(image - LEVELS) ** 2
    assert np.mean(values) == pytest.approx(true, abs=3 * np.std(values) / REPETITIONS**0.5)


@pytest.mark.parametrize(("error", "noise"), [(0.0, 0.3), (0.05, 0.3), (0.3, 0.05)])
def test_the_interval_of_rmse_holds_the_truth(error: float, noise: float, noisy: Noisy) -> None:
    """Each side may be missed with probability 0.1 %: 4 misses in 200 would happen once in 1000 tests."""
    image = LEVELS + error * PATTERN
    true = root_mean_square(image - LEVELS)
    estimates = [evaluate("rmse", image, replace(noisy(LEVELS, noise), alpha=0.001)) for _ in range(REPETITIONS)]
    assert sum(not estimate.low <= true <= estimate.high for estimate in estimates) <= 3
    assert all(estimate.low <= estimate.value <= estimate.high for estimate in estimates)


def test_the_interval_of_rmse_is_no_wider_than_it_must_be(noisy: Noisy) -> None:
    image = LEVELS + 0.08 * PATTERN
    estimates = [evaluate("rmse", image, noisy(LEVELS, 0.08)) for _ in range(REPETITIONS)]
    half_width = np.mean([(estimate.high - estimate.low) / 2 for estimate in estimates])
    assert half_width / 2.326 == pytest.approx(np.std([estimate.value for estimate in estimates]), rel=0.25)


def test_the_floor_is_what_noise_adds_to_a_plain_reading(noisy: Noisy) -> None:
    samples = noisy(LEVELS, 0.4)
    naive = root_mean_square(LEVELS - samples.mean)
    estimate = evaluate("rmse", LEVELS, samples)
    assert estimate.floor == pytest.approx(naive, rel=0.05)
    assert estimate.value < 0.3 * naive
    assert estimate.low == 0


def test_fireflies_make_rmse_invalid(noisy: Noisy) -> None:
    samples = noisy(LEVELS, 0.1)
    accumulators = samples.accumulators.copy()
    accumulators[3, 5, 7:10] = 500.0
    estimate = evaluate("rmse", LEVELS, Samples(accumulators, samples.mask))
    assert not estimate.valid
    assert "fireflies" in estimate.note


def test_the_neighbourhood_is_a_disk_of_four_pixels() -> None:
    """Of the points with whole coordinates, 49 lie within 4 of the origin: the circle problem of Gauss."""
    truth = np.ones((HEIGHT, WIDTH, 1))
    truth[20, 30] = 0.5
    chosen = near_edges(truth, EVERYWHERE)
    assert np.count_nonzero(chosen) == 49
    assert chosen[20, 34]
    assert not chosen[20, 35]
    assert not chosen[23, 33]


@pytest.mark.parametrize(("level", "is_edge"), [(0.0, 0), (0.02, 0), (0.021, 1), (0.979, 1), (0.98, 0), (1.0, 0)])
def test_an_edge_is_neither_dark_nor_lit(level: float, is_edge: bool) -> None:
    truth = np.ones((HEIGHT, WIDTH, 1))
    truth[20, 30] = level
    assert near_edges(truth, EVERYWHERE).any() == is_edge


def test_an_edge_that_is_not_judged_has_no_neighbourhood() -> None:
    truth = np.ones((HEIGHT, WIDTH, 1))
    truth[20, 30] = 0.5
    mask = COLUMNS > 31
    assert not near_edges(truth, mask).any()
    truth[20, 32] = 0.5
    assert (near_edges(truth, mask) <= mask).all()


def test_errors_far_from_edges_do_not_count(exact: Exact) -> None:
    """An offset around the edges reads as itself, whatever the image holds elsewhere and however large it is."""
    truth = soft_edge(3)
    chosen = near_edges(truth, EVERYWHERE)[..., None]
    image = truth + np.where(chosen, 0.1, 0.7)
    assert evaluate("penumbra_rmse", image, exact(truth)).value == pytest.approx(0.1)
    wider = [np.pad(values, ((0, 0), (0, 40), (0, 0)), mode="edge") for values in (image, truth)]
    assert evaluate("penumbra_rmse", wider[0], exact(wider[1])).value == pytest.approx(0.1)


def test_a_picture_without_shadow_edges_is_refused(exact: Exact) -> None:
    truth = (COLUMNS >= 20)[..., None].astype(float)
    with pytest.raises(ImageError, match=r"needs shadow edges.*0\.02 and 0\.98; there is none"):
        evaluate("penumbra_rmse", truth, exact(truth))


def hardened(truth: Float64) -> Float64:
    """The shadow of a point in place of a disk."""
    return (truth > 0.5).astype(float)


def wrong_where_it_counts(truth: Float64) -> Float64:
    """0.1 too bright at exactly the pixels that the noise-free truth chooses: the choice matters most here."""
    return truth + 0.1 * near_edges(truth, EVERYWHERE)[..., None]


def wrong_where_it_does_not_count(truth: Float64) -> Float64:
    return truth + 0.1 * ~near_edges(truth, EVERYWHERE)[..., None]


@pytest.mark.parametrize("half_width", [1.0, 4.0, 12.0])
@pytest.mark.parametrize(
    "technique", [np.copy, hardened, wrong_where_it_counts, wrong_where_it_does_not_count], ids=lambda f: f.__name__
)
def test_the_interval_around_edges_holds_the_truth(
    half_width: float, technique: Callable[[Float64], Float64], rng: np.random.Generator
) -> None:
    """The noise of the choice included: 64 samples a pixel choose other pixels than 4096 do."""
    truth = soft_edge(half_width)
    image = technique(truth)
    true = root_mean_square((image - truth)[near_edges(truth, EVERYWHERE)])
    for samples in (4, 256):
        made = [counted(truth, samples, rng) for _ in range(40)]
        estimates = [evaluate("penumbra_rmse", image, replace(one, alpha=0.001)) for one in made]
        assert sum(not e.low <= true <= e.high for e in estimates) <= 1
        assert all(e.low <= e.value <= e.high for e in estimates)


@pytest.mark.parametrize("half_width", [1.0, 4.0, 12.0])
def test_what_the_choice_costs(half_width: float, rng: np.random.Generator) -> None:
    """Expected loss: 64 samples a pixel read a wrong shadow up to 2 % too large or small, 1024 up to 0.5 %."""
    truth = soft_edge(half_width)
    for technique in (hardened, wrong_where_it_counts):
        image = technique(truth)
        true = root_mean_square((image - truth)[near_edges(truth, EVERYWHERE)])
        for samples, most in ((4, 0.02), (64, 0.005)):
            values = [evaluate("penumbra_rmse", image, counted(truth, samples, rng)).value for _ in range(40)]
            assert np.mean(values) == pytest.approx(true, rel=most)


def test_noise_is_removed_around_edges_too(rng: np.random.Generator) -> None:
    """A perfect image against 256 samples a pixel: a plain reading is the noise, 0.02."""
    truth = soft_edge(4.0)
    samples = counted(truth, 16, rng)
    naive = root_mean_square((truth - samples.mean)[near_edges(truth, EVERYWHERE)])
    estimate = evaluate("penumbra_rmse", truth, samples)
    assert naive > 0.015
    assert estimate.floor == pytest.approx(naive, rel=0.15)
    assert estimate.low == 0
    assert estimate.value < 0.4 * naive
