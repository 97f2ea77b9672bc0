import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from comparisons.gate import CriterionResult, Verdict, fit_exposure, judge, spp_needed, worst
from comparisons.metrics import Estimate, Samples, evaluate
from scenes.checks import Criterion, RendererBounds
from scenes.errors import ImageError

NUMBERS = st.floats(-10, 10)
BOUNDS = st.none() | NUMBERS
TRUTH = np.random.default_rng(0).uniform(0.5, 1.5, size=(20, 20, 3))
MASK = np.ones((20, 20), dtype=bool)


def criterion(low: float | None, high: float | None) -> Criterion:
    return Criterion(metric="nrmse", min=low, max=high, reason="a bound for a test")


def judged(estimate: Estimate, low: float | None = None, high: float | None = None) -> CriterionResult:
    return judge(criterion(low, high), estimate)


@pytest.mark.parametrize(
    ("interval", "bounds", "verdict"),
    [
        ((1, 2), (None, 3), Verdict.PASS),
        ((1, 2), (None, 2), Verdict.PASS),
        ((1, 2), (None, 1.5), Verdict.INCONCLUSIVE),
        ((1, 2), (None, 1), Verdict.INCONCLUSIVE),
        ((1, 2), (None, 0.5), Verdict.FAIL),
        ((1, 2), (0, None), Verdict.PASS),
        ((1, 2), (1.5, None), Verdict.INCONCLUSIVE),
        ((1, 2), (3, None), Verdict.FAIL),
        ((1, 2), (0, 3), Verdict.PASS),
        ((1, 2), (1.2, 1.8), Verdict.INCONCLUSIVE),
        ((2, 2), (None, 2), Verdict.PASS),
        ((-0.1, 0.1), (-0.2, 0.2), Verdict.PASS),
    ],
)
def test_truth_table(
    interval: tuple[float, float], bounds: tuple[float | None, float | None], verdict: Verdict
) -> None:
    low, high = interval
    assert judged(Estimate((low + high) / 2, low, high), *bounds).verdict is verdict


@given(st.lists(NUMBERS, min_size=3, max_size=3), BOUNDS, BOUNDS)
def test_a_verdict_holds_for_every_value_in_the_interval(
    numbers: list[float], least: float | None, most: float | None
) -> None:
    """PASS if and only if the whole interval is within the bounds, FAIL if and only if it is wholly outside one."""
    assume(least is not None or most is not None)
    assume(least is None or most is None or least <= most)
    low, value, high = sorted(numbers)
    verdict = judged(Estimate(value, low, high), least, most).verdict
    above_least = [least is None or x >= least for x in (low, high)]
    below_most = [most is None or x <= most for x in (low, high)]
    assert (verdict is Verdict.PASS) == (all(above_least) and all(below_most))
    assert (verdict is Verdict.FAIL) == (not any(above_least) or not any(below_most))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("position", [0, 1, 2])
def test_a_number_that_is_not_finite_is_an_error(bad: float, position: int) -> None:
    value, low, high = (bad if position == i else 0.0 for i in range(3))
    assert judged(Estimate(value, low, high), high=1.0).verdict is Verdict.ERROR


def test_an_estimate_that_is_not_valid_decides_nothing() -> None:
    result = judged(Estimate(0.1, 0.1, 0.1, valid=False, note="fireflies"), high=1.0)
    assert result.verdict is Verdict.INCONCLUSIVE
    assert result.note == "fireflies"


def test_the_result_repeats_the_criterion() -> None:
    result = judged(Estimate(0.2, 0.1, 0.3), low=0.0, high=1.0)
    assert (result.metric, result.min, result.max, result.reason) == ("nrmse", 0.0, 1.0, "a bound for a test")
    assert (result.value, result.low, result.high) == (0.2, 0.1, 0.3)


def test_the_worst_verdict_wins() -> None:
    order = [Verdict.PASS, Verdict.INCONCLUSIVE, Verdict.REGRESSED, Verdict.FAIL, Verdict.ERROR]
    for rank, verdict in enumerate(order):
        assert worst(order[: rank + 1]) is verdict
        assert worst(reversed(order[: rank + 1])) is verdict


def test_nothing_judged_is_an_error() -> None:
    assert worst([]) is Verdict.ERROR


@given(st.floats(0.01, 100.0))
def test_a_gain_is_fitted_exactly(gain: float) -> None:
    assert fit_exposure(TRUTH / gain, Samples(TRUTH[None], MASK)) == pytest.approx(gain)


def test_the_fitted_exposure_is_not_biased_by_noise() -> None:
    """The other way round, 1 / fit(y to x), noise of 1.0 in each of 16 accumulators would add 1 / 16."""
    rng = np.random.default_rng(1)
    fits = [fit_exposure(TRUTH, Samples(TRUTH * rng.exponential(size=(16, *TRUTH.shape)), MASK)) for _ in range(100)]
    assert np.mean(fits) == pytest.approx(1.0, abs=3 * float(np.std(fits)) / 10)


@pytest.mark.parametrize(("factor", "message"), [(0.0, "black at every judged pixel"), (-1.0, "best factor is -1")])
def test_an_exposure_that_cannot_be_fitted_is_refused(factor: float, message: str) -> None:
    with pytest.raises(ImageError, match=message):
        fit_exposure(factor * TRUTH, Samples(TRUTH[None], MASK))


@pytest.mark.parametrize(
    ("estimate", "low", "high", "expected"),
    [
        (Estimate(1.0, 0.8, 1.2), None, 1.1, 400),
        (Estimate(1.0, 0.8, 1.2), None, 0.9, 400),
        (Estimate(1.0, 0.8, 1.2), 0.9, None, 400),
        (Estimate(1.0, 0.8, 1.2), 0.95, 1.1, 1600),
        (Estimate(1.0, 0.8, 1.2), 0.5, 0.95, 1600),
        (Estimate(1.0, 0.8, 1.2), 1.1, 2.0, 400),
        (Estimate(0.0, 0.0, 0.4), None, 0.2, 400),
        (Estimate(0.6, 0.4, 1.0), None, 0.7, 1600),
    ],
    ids=["max above", "max below", "min", "nearer bound", "past max", "past min", "clipped", "raw above"],
)
def test_samples_needed(estimate: Estimate, low: float | None, high: float | None, expected: int) -> None:
    """Half the half-width costs four times the samples."""
    assert spp_needed(judged(estimate, low, high), 100) == pytest.approx(expected, abs=1)


@pytest.mark.parametrize(
    ("estimate", "high"),
    [
        (Estimate(1.0, 0.8, 1.2), 2.0),
        (Estimate(1.0, 0.8, 1.2), 0.5),
        (Estimate(1.0, 0.8, 1.2), 1.0),
        (Estimate(1.0, 0.8, 1.2), 1.001),
        (Estimate(1.0, 0.8, 1.2, valid=False), 1.1),
    ],
    ids=["passed", "failed", "equality", "near equality", "invalid"],
)
def test_no_number_of_samples_is_promised(estimate: Estimate, high: float) -> None:
    assert spp_needed(judged(estimate, high=high), 100) is None


def test_the_predicted_samples_do_decide() -> None:
    """An image 20 % too bright against 17 %: twice the predicted samples decide most open runs, none wrongly."""
    rng = np.random.default_rng(2)
    bound = 0.17 * float(np.sqrt(np.mean(TRUTH**2)) / TRUTH.mean())

    def measured(spp: int) -> CriterionResult:
        shape = spp / 16 / 2
        accumulators = TRUTH * rng.gamma(shape, 1 / shape, size=(16, *TRUTH.shape))
        return judged(evaluate("nrmse", 1.2 * TRUTH, Samples(accumulators, MASK, 0.001)), high=bound)

    starts = [measured(32) for _ in range(30)]
    needed = [spp for start in starts if (spp := spp_needed(start, 32)) is not None]
    verdicts = [measured(2 * spp).verdict for spp in needed]
    assert len(needed) > 20
    assert verdicts.count(Verdict.FAIL) > 0.6 * len(verdicts)
    assert Verdict.PASS not in verdicts


LLVMPIPE, H200 = "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5", "NVIDIA H200/PCIe/SSE2, OpenGL 4.3"


def test_bounds_for_a_renderer_replace_those_for_all() -> None:
    nvidia = RendererBounds(renderer="nvidia", max=0.2, reason="two samples instead of four")
    general = Criterion(metric="nrmse", max=0.1, reason="a bound for a test", by_renderer=(nvidia,))
    measured = Estimate(0.15, 0.14, 0.16)
    here, there = judge(general, measured, LLVMPIPE), judge(general, measured, H200)
    assert (here.verdict, here.max, here.reason, here.renderer) == (Verdict.FAIL, 0.1, "a bound for a test", "")
    assert (there.verdict, there.max, there.reason) == (Verdict.PASS, 0.2, "two samples instead of four")
    assert there.renderer == "nvidia"


def test_the_first_of_several_renderers_that_apply_counts() -> None:
    h200, nvidia = (
        RendererBounds(renderer=name, max=most, reason="measured there")
        for name, most in (("H200", 0.3), ("NVIDIA", 0.2))
    )
    general = Criterion(metric="nrmse", max=0.1, reason="a bound for a test", by_renderer=(h200, nvidia))
    assert general.bounds_on(H200) is h200
    assert general.bounds_on("NVIDIA GeForce RTX 4090") is nvidia
    assert general.bounds_on(LLVMPIPE) is general


def test_a_renderer_is_named_once() -> None:
    bounds = [RendererBounds(renderer=name, max=0.2, reason="measured there") for name in ("NVIDIA", "nvidia")]
    with pytest.raises(ValueError, match="twice"):
        Criterion(metric="nrmse", max=0.1, reason="a bound for a test", by_renderer=tuple(bounds))
