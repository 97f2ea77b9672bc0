import numpy as np
import pytest

from comparisons import variants
from comparisons.variants import costs_of_variants
from reference.estimator import Truth
from reference.quantity import Integrator, Quantity
from scenes.image import Float32

SHAPE = (16, 12, 12, 3)


def quantity(name: str) -> Quantity:
    others = ("less",) if name == "full" else ()
    casts = Integrator("a test", "a test")
    return Quantity(name, "1", f"summary of {name}", "unit", 3, True, lambda features: casts, variants=others)


def truth(name: str, accumulators: Float32) -> Truth:
    mask = np.ones(accumulators.shape[1:3], dtype=bool)
    mask[0] = False
    return Truth(name, "key", accumulators, mask, len(accumulators) * 16, 0.0, Integrator("a test", "a test"))


@pytest.fixture(autouse=True)
def _registry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(variants, "quantity", quantity)


def noisy(rng: np.random.Generator, level: float) -> Float32:
    return (level + 0.5 * rng.normal(size=SHAPE)).astype(np.float32)


def test_the_cost_of_a_variant_is_free_of_the_noise_of_both_truths() -> None:
    """True values 1 and 0.9; the noise of a mean over accumulators is 0.125 in either, more than their difference."""
    rng = np.random.default_rng(1)
    full, less = truth("full", noisy(rng, 1.0)), truth("less", noisy(rng, 0.9))
    (cost,) = costs_of_variants(full, lambda name, spp: less)
    assert (cost["quantity"], cost["summary"]) == ("less", "summary of less")
    assert cost["low"] < 0.1 < cost["high"] < 0.13
    assert cost["energy_bias"] == pytest.approx(-0.1, abs=0.03)


def test_equal_truths_cost_nothing_beyond_noise() -> None:
    """Uncorrected, the noise of both means would read 0.125 times the square root of 2, which is 0.177."""
    rng = np.random.default_rng(2)
    full, same = truth("full", noisy(rng, 1.0)), truth("less", noisy(rng, 1.0))
    (cost,) = costs_of_variants(full, lambda name, spp: same)
    assert cost["low"] == 0
    assert cost["high"] < 0.12


def test_between_exact_truths_the_cost_is_exact() -> None:
    full, less = (
        truth(name, np.full((1, *SHAPE[1:]), level, np.float32)) for name, level in (("full", 2), ("less", 1))
    )
    (cost,) = costs_of_variants(full, lambda name, spp: less)
    assert (cost["nrmse"], cost["low"], cost["high"], cost["energy_bias"]) == (0.5, 0.5, 0.5, -0.5)


def test_the_variant_is_asked_for_with_as_many_samples_and_only_if_there_is_one() -> None:
    asked: list[tuple[str, int]] = []
    rng = np.random.default_rng(3)
    full, less = truth("full", noisy(rng, 1.0)), truth("less", noisy(rng, 1.0))

    def truth_at(name: str, spp: int) -> Truth:
        asked.append((name, spp))
        return less

    costs_of_variants(full, truth_at)
    assert costs_of_variants(less, truth_at) == ()
    assert asked == [("less", full.spp)]
