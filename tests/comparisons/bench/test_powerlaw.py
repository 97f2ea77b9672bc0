import numpy as np
import pytest

from comparisons.bench.powerlaw import fit_power_law
from scenes.errors import InputError

SIZES = (1.0, 2.0, 4.0, 8.0, 16.0)


@pytest.mark.parametrize("exponent", [-0.5, 1.0, 2.0])
def test_an_exact_law_is_found_exactly(exponent: float) -> None:
    law = fit_power_law(SIZES, [3.0 * size**exponent for size in SIZES])
    assert law.exponent.value == pytest.approx(exponent)
    assert law.exponent.high - law.exponent.low < 1e-6
    assert law.coefficient == pytest.approx(3.0)
    assert law.r2 == pytest.approx(1.0)
    assert law.at(32.0) == pytest.approx(3.0 * 32.0**exponent)


def test_the_interval_holds_the_true_exponent_in_95_of_100_noisy_measurements() -> None:
    random = np.random.default_rng(1)
    laws = [fit_power_law(SIZES, [s**0.8 * np.exp(random.normal(0, 0.1)) for s in SIZES]) for _ in range(1500)]
    held = np.mean([law.exponent.low <= 0.8 <= law.exponent.high for law in laws])
    assert held == pytest.approx(0.95, abs=0.0225)  # four standard errors of a share of 1500


def test_what_does_not_depend_on_size_is_not_explained_by_it() -> None:
    law = fit_power_law(SIZES, [1.0, 1.2, 0.9, 1.2, 1.0])
    assert law.exponent.low < 0 < law.exponent.high
    assert law.r2 < 0.1


def test_the_interval_is_that_of_student_with_n_minus_2_degrees_of_freedom() -> None:
    """By hand: x = -1, 0, 1 and y = -1, 0.3, 1 have slope 1 and residuals -0.1, 0.2, -0.1.

    Their variance is 0.06 / 1, so the standard error sqrt(0.06 / 2); Student's t at 97.5 % with 1 degree of freedom is
    12.7062.
    """
    law = fit_power_law(np.exp([-1.0, 0.0, 1.0]).tolist(), np.exp([-1.0, 0.3, 1.0]).tolist())
    assert law.exponent.value == pytest.approx(1.0)
    assert law.exponent.high - law.exponent.value == pytest.approx(12.7062 * np.sqrt(0.03), rel=1e-5)


@pytest.mark.parametrize(
    ("sizes", "seconds", "found"),
    [
        ((1.0, 2.0), (1.0, 2.0), "2 sizes, 2 of them different"),
        ((1.0, 1.0, 2.0), (1.0, 1.0, 2.0), "3 sizes, 2 of them different"),
        ((1.0, 2.0, 3.0), (1.0, 2.0), "2 values"),
        ((1.0, 2.0, 0.0), (1.0, 2.0, 3.0), "through 0"),
        ((1.0, 2.0, 3.0), (1.0, 2.0, float("inf")), "through inf"),
        ((1.0, 2.0, 3.0), (1.0, 2.0, float("nan")), "through nan"),
    ],
)
def test_what_cannot_be_fitted_is_refused(sizes: tuple[float, ...], seconds: tuple[float, ...], found: str) -> None:
    with pytest.raises(InputError, match=found):
        fit_power_law(sizes, seconds)
