"""Which checks can fail, and which cannot."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from comparisons.answers.selftest import lines_of, selftest_lines, status_of
from comparisons.gate import Verdict
from comparisons.mutants import MUTANTS
from comparisons.request import request_of
from comparisons.selftest import Outcome, Trial, claims, trials_of
from reference.estimator import Truth
from reference.quantity import Integrator
from reference.store import Store
from scenes.checks import Check, Criterion
from scenes.image import Float32
from scenes.load import load_scene

Write = Callable[..., Path]

MASK = np.ones((64, 48), dtype=bool)
KILLED, SURVIVED = Outcome.KILLED, Outcome.SURVIVED


def lit() -> Float32:
    """A smooth image without symmetry."""
    y, x = np.mgrid[0:64, 0:48]
    level = 1.05 + 0.6 * np.sin(x / 9 + 0.3) * np.cos(y / 13) + 0.35 * np.sin(y / 7 + x / 31)
    return np.stack([level, 0.8 * level**1.2, 0.5 * level + 0.02 * x], axis=2).astype(np.float32)


TRUTH = lit()


def exact(truth: Float32 = TRUTH) -> Callable[[int], Truth]:
    return lambda spp: Truth("indirect_radiance", "", truth[None], MASK, 0, 0.0, Integrator("none", "a test"))


def sampled(spp: int) -> Truth:
    """Sixteen accumulators whose noise falls as it does with samples."""
    shape = spp / 16 / 4
    noise = np.random.default_rng(spp).gamma(shape, 1 / shape, size=(16, *TRUTH.shape))
    accumulators = (TRUTH * noise).astype(np.float32)
    return Truth("indirect_radiance", "", accumulators, MASK, spp, 0.0, Integrator("noise", "a test"))


def bound(metric: str, least: float | None = None, most: float | None = None) -> Criterion:
    return Criterion(metric=metric, min=least, max=most, reason="a bound for a test")


def check(*criteria: Criterion, fit_exposure: bool = False) -> Check:
    return Check(quantity="indirect_radiance", technique="indirect.probe", criteria=criteria, fit_exposure=fit_exposure)


def tried(
    tested: Check, image: Float32 = TRUTH, truth_at: Callable[[int], Truth] | None = None, limit: int = 4096
) -> dict[str, Trial]:
    trials = trials_of("scene/check", tested, "W", image, truth_at or exact(), limit)
    assert [t.mutant for t in trials] == list(MUTANTS)
    return {t.mutant: t for t in trials}


def outcomes(trials: dict[str, Trial]) -> dict[str, Outcome]:
    return {name: trial.outcome for name, trial in trials.items()}


def test_a_tight_check_kills_all_that_it_claims() -> None:
    found = tried(check(bound("nrmse", most=0.01)))
    assert outcomes(found) == dict.fromkeys(MUTANTS, KILLED) | {"shift": Outcome.UNCLAIMED}
    assert {found[name].by for name in MUTANTS if name not in ("shift", "nan_pixel")} == {"nrmse"}


def test_a_check_that_cannot_fail_is_reported() -> None:
    found = tried(check(bound("nrmse", most=5.0)))
    assert outcomes(found) == dict.fromkeys(MUTANTS, SURVIVED) | {
        "shift": Outcome.UNCLAIMED,
        "nan_pixel": KILLED,
    }
    assert found["gain"].verdict is Verdict.PASS
    assert found["gain"].note.startswith("Tighten the max of nrmse: it reads 10.")
    assert found["gain"].note.endswith("with it and 0\u202f% without, its bound is ≤ 500\u202f%.")


def test_a_pixel_that_is_not_a_number_is_refused_before_it_is_measured() -> None:
    trial = tried(check(bound("nrmse", most=0.01)))["nan_pixel"]
    assert (trial.outcome, trial.by, trial.verdict) == (KILLED, "", Verdict.ERROR)


def test_a_check_with_one_bound_lets_through_what_moves_the_other_way() -> None:
    found = tried(check(bound("energy_bias", most=0.01)))
    assert found["gain"].outcome is KILLED
    assert found["black_tile"].outcome is SURVIVED
    assert found["black_tile"].note.startswith("Give energy_bias a min: it reads −")


def test_where_the_bound_cannot_help_another_metric_is_named() -> None:
    """The largest difference is one pixel's, whatever else is wrong with less."""
    image = TRUTH.copy()
    image[0, 0] += 50
    trial = tried(check(bound("max_abs", most=60.0)), image)["black_tile"]
    assert trial.outcome is SURVIVED
    assert trial.note.startswith("Add nrmse: it reads ")


def test_a_second_criterion_kills_what_the_first_lets_through() -> None:
    found = tried(check(bound("nrmse", most=5.0), bound("energy_bias", -0.01, 0.01)))
    assert (found["gain"].outcome, found["gain"].by) == (KILLED, "energy_bias")
    assert found["flip_y"].outcome is SURVIVED


def test_a_symmetric_image_upside_down_counts_neither_way() -> None:
    truth = ((TRUTH + TRUTH[::-1]) / 2).astype(np.float32)
    assert tried(check(bound("nrmse", most=0.01)), truth, exact(truth))["flip_y"].outcome is Outcome.EQUIVALENT


def test_a_fitted_exposure_takes_a_gain_out() -> None:
    fitted, free = (check(bound("nrmse", most=0.01), fit_exposure=fit) for fit in (True, False))
    assert not claims(fitted)["gain"]
    assert claims(free)["gain"] == free.criteria
    assert tried(fitted)["gain"].outcome is Outcome.UNCLAIMED
    assert tried(fitted)["flip_y"].outcome is KILLED


def test_a_large_error_masks_a_small_fault() -> None:
    """An image at 5 % is wrong by 95 %; upside down, it is as wrong as before to a per mille."""
    image = np.float32(0.05) * TRUTH
    found = tried(check(bound("nrmse", 0.0, 2.0)), image)
    assert found["flip_y"].outcome is Outcome.MASKED
    assert tried(check(bound("energy_bias", -1.0, 1.0)), image)["missing_shadow"].outcome is SURVIVED


def test_a_loose_bound_masks_nothing() -> None:
    for most in (0.5, 5.0, 500.0):
        assert Outcome.MASKED not in outcomes(tried(check(bound("nrmse", most=most)))).values()


def test_samples_are_added_until_a_mutant_is_decided() -> None:
    """10 % too bright reads 0.11 against 0.08: sixteen samples a pixel pass the image, but cannot tell."""
    asked: list[int] = []

    def truth_at(spp: int) -> Truth:
        asked.append(spp)
        return sampled(spp)

    found = tried(check(bound("nrmse", most=0.09)), truth_at=truth_at)
    assert found["gain"].outcome is KILLED
    assert asked == sorted(set(asked)), "no truth is made twice"


def test_a_mutant_that_stays_undecided_has_survived() -> None:
    found = tried(check(bound("nrmse", most=0.103)), truth_at=sampled, limit=64)
    assert (found["gain"].outcome, found["gain"].verdict) == (SURVIVED, Verdict.INCONCLUSIVE)


def test_a_check_that_fails_by_itself_is_not_tested() -> None:
    found = tried(check(bound("nrmse", least=0.5)))
    assert set(outcomes(found).values()) == {Outcome.UNTESTED}
    assert found["gain"].note == "the check is FAIL without any fault. Mend that first."
    assert status_of(found.values()) == 1


def test_trials_are_json() -> None:
    (first, *_) = tried(check(bound("nrmse", most=0.01))).values()
    assert json.loads(json.dumps(first.to_json())) == {
        "check": "scene/check",
        "mutant": "gain",
        "outcome": "killed",
        "by": "nrmse",
        "verdict": "FAIL",
        "note": "",
    }


def test_the_lines_tell_survivors_with_advice_and_count() -> None:
    trials = list(tried(check(bound("energy_bias", most=0.01))).values())
    lines = list(lines_of(trials))
    assert lines[0].split() == list(MUTANTS)
    assert lines[1].split() == ["scene/check", "killed", "-", "-", "killed", "killed", "SURVIVED", "killed"]
    assert lines[0].index("nan_pixel") == lines[1].rindex("killed")
    assert "-: no metric of the check claims to see it" in lines
    survivor = (
        "SURVIVED scene/check: black_tile (a tile of at most 16 x 16 pixels left black) is PASS. Give energy_bias"
    )
    assert lines[-2].startswith(survivor)
    assert lines[-1] == "1 check, 4 mutants killed, 1 survived, 0 equivalent, 2 not claimed"
    assert status_of(trials) == 1


def test_nothing_to_complain_about_is_status_0() -> None:
    trials = list(tried(check(bound("nrmse", most=0.01))).values())
    assert list(lines_of(trials))[-1] == "1 check, 6 mutants killed, 0 survived, 0 equivalent, 1 not claimed"
    assert status_of(trials) == 0


def test_a_check_that_was_not_tested_says_why_once() -> None:
    lines = list(lines_of(list(tried(check(bound("nrmse", least=0.5))).values())))
    assert [line for line in lines if line.startswith("UNTESTED")] == [
        "UNTESTED scene/check: the check is FAIL without any fault. Mend that first."
    ]


def test_a_loose_scene_is_found_out_and_a_tight_one_is_not(with_truth: Path, write_scene: Write) -> None:
    steps: list[str] = []

    def run() -> tuple[list[str], int]:
        request = request_of(load_scene(Path("tiny.toml")), "tiny.toml", lambda check_id: "irradiance" in check_id)
        return selftest_lines([request], Store(Path(".lightgauge")), lambda what, part: steps.append(what))

    lines, status = run()
    assert status == 1
    assert any(line.startswith("SURVIVED tiny/indirect.irradiance") and ": gain (" in line for line in lines)
    assert not any(line.startswith("SURVIVED tiny/raster") for line in lines)
    assert "mutants of tiny/raster.normal" in steps
    budget = 'max = 0.06, reason = "near what is reached" }, { metric = "energy_bias", min = -0.05, max = 0.05'
    write_scene(("max = 0.5", budget))
    lines, status = run()
    assert status == 0, "\n".join(lines)
    assert lines[-1].startswith("5 checks, ")


def test_a_scene_without_a_visible_subject_is_untested(with_truth: Path, write_scene: Write) -> None:
    write_scene(("target = [0.1, 0.05, 0.0]", "target = [0.2, 0.3, 2.0]"))
    request = request_of(load_scene(Path("tiny.toml")), "tiny.toml")
    lines, status = selftest_lines([request], Store(Path(".lightgauge")), lambda what, part: None)
    assert status == 1
    assert any(line.startswith("UNTESTED tiny/indirect.irradiance[side=24]: ") for line in lines)
