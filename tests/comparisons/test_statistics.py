import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons.statistics import (
    effective_count,
    firefly_note,
    squared_errors,
    student_quantile,
)
from scenes.image import Float64


def pairwise(differences: Float64) -> Float64:
    """Mean of d_i . d_j over all pairs of different accumulators, written as the definition says."""
    k = len(differences)
    products = [differences[i] * differences[j] for i in range(k) for j in range(k) if i != j]
    values: Float64 = np.sum(np.mean(products, axis=0), axis=-1)
    return values


def test_quantiles_are_those_of_the_tables() -> None:
    assert student_quantile(0.025, 15) == pytest.approx(2.131450, abs=1e-6)
    assert student_quantile(0.025, np.inf) == pytest.approx(1.959964, abs=1e-6)


def test_estimate_is_the_mean_over_pairs() -> None:
    differences = np.random.default_rng(1).normal(size=(6, 5, 3))
    np.testing.assert_allclose(squared_errors(differences).values, pairwise(differences))


def test_deviations_are_those_of_leaving_one_out() -> None:
    differences = np.random.default_rng(2).normal(size=(6, 5, 3))
    left_out = [pairwise(np.delete(differences, i, axis=0)) - pairwise(differences) for i in range(6)]
    np.testing.assert_allclose(squared_errors(differences).deviations, left_out)


def test_estimate_has_no_noise_floor_and_the_naive_one_has() -> None:
    """The naive squared error of a perfect image reads the truth's variance, 1 / K here; the corrected one 0."""
    differences = np.random.default_rng(3).normal(size=(16, 20000, 1))
    corrected = squared_errors(differences).values
    naive = differences.mean(axis=0)[:, 0] ** 2
    standard_error = corrected.std() / 20000**0.5
    assert abs(corrected.mean()) < 3 * standard_error
    assert naive.mean() == pytest.approx(1 / 16, rel=0.05)
    assert naive.mean() > 30 * standard_error


@pytest.mark.parametrize("error", [0.0, 0.1, 1.0])
def test_standard_error_matches_the_spread_over_repetitions(error: float) -> None:
    rng = np.random.default_rng(4)
    shape = (16, 400, 3)
    runs = [squared_errors(error + rng.normal(size=shape)) for _ in range(200)]
    spread = np.std([run.values.mean() for run in runs])
    claimed = np.sqrt(np.mean([run.standard_error_of_mean**2 for run in runs]))
    assert claimed == pytest.approx(spread, rel=0.2)


@given(st.integers(1, 50), st.floats(0.1, 10.0), st.integers(0, 50))
def test_equal_contributions_count_as_many_as_they_are(count: int, size: float, nothing: int) -> None:
    assert effective_count(np.array([size] * count + [0.0] * nothing)) == pytest.approx(count)


def test_nothing_contributes_to_no_noise() -> None:
    assert effective_count(np.zeros(5)) == np.inf
    assert firefly_note(np.zeros((16, 20, 3))) == ""


def test_even_noise_is_no_firefly() -> None:
    assert firefly_note(np.random.default_rng(5).normal(size=(16, 100, 3))) == ""


def test_few_samples_with_most_of_the_variance_are_fireflies() -> None:
    deviations = np.random.default_rng(6).normal(size=(16, 1000, 3))
    deviations[3, :12] = 1000.0
    assert "rests on about 12 bright samples (64 are needed)" in firefly_note(deviations)


def test_a_local_error_is_no_firefly() -> None:
    """What counts is the noise of the truth, not where the image is wrong: the variance of its error is local too."""
    rng = np.random.default_rng(7)
    noise = rng.normal(size=(16, 400, 3))
    local = np.zeros((400, 3))
    local[:5] = 100.0
    estimate = squared_errors(local + noise)
    assert effective_count(estimate.variances) < 10
    assert firefly_note(noise - noise.mean(axis=0)) == ""


def test_an_interval_that_rests_on_few_pixels_is_wider() -> None:
    rng = np.random.default_rng(8)
    many, few = (squared_errors(1.0 + rng.normal(size=(16, pixels, 3))) for pixels in (4000, 12))
    assert many.half_width(0.025) == pytest.approx(1.96 * many.standard_error_of_mean, rel=0.01)
    assert few.half_width(0.025) > 2.1 * few.standard_error_of_mean
