import numpy as np
import pytest

from comparisons.statistics import (
    FIREFLY_PIXELS,
    firefly_note,
    normal_quantile,
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
    assert normal_quantile(0.025) == pytest.approx(1.959964, abs=1e-6)
    assert student_quantile(0.025, 15) == pytest.approx(2.131450, abs=1e-6)
    assert student_quantile(0.01, 10**8) == pytest.approx(normal_quantile(0.01), abs=1e-6)


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


def test_even_variance_is_no_firefly() -> None:
    assert firefly_note(np.ones(1000)) == ""
    assert firefly_note(np.ones(20)) == ""
    assert firefly_note(np.zeros(1000)) == ""


def test_few_pixels_with_most_variance_are_fireflies() -> None:
    variances = np.ones(1000)
    variances[:FIREFLY_PIXELS] = 1000.0
    assert "fireflies: 16 of 1000 pixels" in firefly_note(variances)
