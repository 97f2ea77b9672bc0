import itertools
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons import sequential
from comparisons.gate import CriterionResult, Verdict
from comparisons.metrics import Estimate, Samples
from comparisons.sequential import FIRST_SPP, decide, fixed_spp, looks
from reference.estimator import ACCUMULATORS, Truth
from reference.quantity import Integrator
from scenes.checks import Check, Criterion
from scenes.errors import RenderError, SceneError
from scenes.image import Float32

SIZE = 16
IMAGE = np.random.default_rng(0).uniform(0.5, 1.5, size=(SIZE, SIZE, 3)).astype(np.float32)
MASK = np.ones((SIZE, SIZE), dtype=bool)
TruthAt = Callable[[int], Truth]


def truth(accumulators: Float32, spp: int) -> Truth:
    return Truth("indirect_radiance", "key", accumulators, MASK, spp, 0.0, Integrator("fake", "a test"))


@pytest.fixture
def truth_at() -> TruthAt:
    """Accumulators with gamma noise around IMAGE whose variance falls as 1 / spp; records nothing, keeps no state."""

    def at(spp: int) -> Truth:
        shape = spp / ACCUMULATORS / 2
        noise = np.random.default_rng(spp).gamma(shape, 1 / shape, size=(ACCUMULATORS, *IMAGE.shape))
        return truth((IMAGE * noise).astype(np.float32), spp)

    return at


def check(*criteria: Criterion, fit: bool = False) -> Check:
    return Check(quantity="indirect_radiance", technique="fake", criteria=criteria, fit_exposure=fit)


def at_most(bound: float, metric: str = "nrmse") -> Criterion:
    return Criterion(metric=metric, max=bound, reason="a bound for a test")


@given(st.integers(64, 1 << 22))
def test_looks_double_from_the_first_up_to_the_limit(limit: int) -> None:
    planned = looks(limit)
    assert planned[0] == FIRST_SPP
    assert all(b == 2 * a for a, b in itertools.pairwise(planned))
    assert planned[-1] <= limit < 2 * planned[-1]


@pytest.mark.parametrize(
    ("gain", "verdict"), [(1.05, Verdict.PASS), (1.5, Verdict.FAIL)], ids=["well within", "well beyond"]
)
def test_a_clear_case_takes_few_samples(truth_at: TruthAt, gain: float, verdict: Verdict) -> None:
    decision = decide(check(at_most(0.3)), gain * IMAGE, truth_at, 4096)
    assert decision.verdict is verdict
    assert decision.truth.spp <= 64


def test_an_error_at_its_budget_stays_open_to_the_limit(truth_at: TruthAt) -> None:
    exact = float(np.sqrt(np.mean((0.2 * IMAGE) ** 2)) / IMAGE.mean())
    decision = decide(check(at_most(exact)), 1.2 * IMAGE, truth_at, 1000)
    assert decision.verdict is Verdict.INCONCLUSIVE
    assert decision.truth.spp == 512


def test_looks_are_paid_for(truth_at: TruthAt, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each look gets its part of the probability of error, whichever look decides."""
    seen = []

    def evaluate(metric: str, image: Float32, samples: Samples) -> Estimate:
        seen.append(samples.alpha)
        return Estimate(0.0, 0.0, 1.0)

    monkeypatch.setattr(sequential, "evaluate", evaluate)
    decide(check(at_most(0.5)), IMAGE, truth_at, 4096)
    assert len(seen) == 9
    assert sum(seen) == pytest.approx(sequential.ALPHA_PER_SIDE)


def test_an_exact_truth_is_looked_at_once() -> None:
    calls = []

    def exact(spp: int) -> Truth:
        calls.append(spp)
        return truth(IMAGE[None], 0)

    decision = decide(check(at_most(0.001), at_most(2.0, "rms")), 1.1 * IMAGE, exact, 4096)
    assert [c.verdict for c in decision.criteria] == [Verdict.FAIL, Verdict.PASS]
    assert len(calls) == 1


def test_criteria_come_back_in_their_order_and_the_open_one_is_looked_at_first(
    truth_at: TruthAt, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, int]] = []

    def evaluate(metric: str, image: Float32, samples: Samples) -> Estimate:
        asked.append((metric, len(asked)))
        is_open = metric == "flip" and len(asked) < 4
        return Estimate(0.1, 0.0, 1.0 if is_open else 0.2)

    monkeypatch.setattr(sequential, "evaluate", evaluate)
    decision = decide(check(at_most(0.5), at_most(0.5, "flip"), at_most(0.5, "delta_e_itp")), IMAGE, truth_at, 4096)
    assert [c.metric for c in decision.criteria] == ["nrmse", "flip", "delta_e_itp"]
    assert [metric for metric, _ in asked] == ["nrmse", "flip", "flip", "flip", "nrmse", "delta_e_itp"]
    assert decision.truth.spp == 64


def test_every_criterion_is_judged_at_the_limit(truth_at: TruthAt, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sequential, "evaluate", lambda metric, image, samples: Estimate(0.0, 0.0, 1.0))
    decision = decide(check(at_most(0.5), at_most(2.0, "flip")), IMAGE, truth_at, 64)
    assert [c.verdict for c in decision.criteria] == [Verdict.INCONCLUSIVE, Verdict.PASS]


def test_the_exposure_is_fitted_before_anything_is_judged(truth_at: TruthAt) -> None:
    decision = decide(check(at_most(0.3), fit=True), 10 * IMAGE, truth_at, 4096)
    assert decision.verdict is Verdict.PASS
    assert decision.exposure == pytest.approx(0.1, rel=0.1)
    np.testing.assert_allclose(decision.image, 10 * decision.exposure * IMAGE, rtol=1e-6)


def test_blank_images_are_refused(truth_at: TruthAt) -> None:
    with pytest.raises(RenderError, match="but its truth is not"):
        decide(check(at_most(9.0)), 0 * IMAGE, truth_at, 64)
    with pytest.raises(SceneError, match="nothing to compare"):
        decide(check(at_most(9.0)), 0 * IMAGE, lambda spp: truth(0 * IMAGE[None], 0), 64)


def result(metric: str, value: float, high: float, bound: float, floor: float | None) -> CriterionResult:
    return CriterionResult(metric, value, 0.0, high, None, bound, Verdict.PASS, "because it is", "", floor=floor)


def test_a_fixed_reference_needs_its_noise_to_fit_between_error_and_budget() -> None:
    """Squares 0.01 and 0.04, noise 0.09 at 100 spp and no width: it fits at 300 spp."""
    assert fixed_spp([result("nrmse", 0.1, 0.1, 0.2, 0.3)], 100, 64) == pytest.approx(300, abs=1)
    assert fixed_spp([result("rel_mse_eps1e-2", 0.1, 0.1, 0.2, 0.3)], 100, 64) == pytest.approx(300, abs=1)
    assert fixed_spp([result("nrmse", 0.1, 0.15, 0.2, 0.3)], 100, 64) > 301


def test_where_noise_does_not_add_a_fixed_reference_is_no_worse() -> None:
    assert fixed_spp([result("energy_bias", 0.1, 0.15, 0.2, None)], 100, 64) == 100
    assert fixed_spp([result("flip", 0.1, 0.15, 0.2, 0.3)], 100, 64) == 100
    assert fixed_spp([result("nrmse", 0.2, 0.2, 0.2, 0.3)], 100, 64) == 100, "no number would do"


def test_the_fixed_reference_so_found_decides_and_half_of_it_does_not() -> None:
    """By the definition: the plain reading is 5 % of the budget's square away on the wrong side with half as many."""
    error, budget, noise_at_1 = 0.1, 0.12, 2.0
    floor = float(np.sqrt(noise_at_1 / 256))
    spp = fixed_spp([result("nrmse", error, error, budget, floor)], 256, 64)
    assert error**2 + noise_at_1 / spp <= budget**2 * 1.0001
    assert error**2 + noise_at_1 / (spp / 2) > budget**2
