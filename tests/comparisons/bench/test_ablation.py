"""Parts of techniques left out: which there are, what they add to the error, and how sure that is."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons.bench.ablation import GROUP, ablations, added_error, parts_of
from comparisons.metrics import Samples, evaluate
from comparisons.statistics import student_quantile
from realtime.techniques import technique
from reference.store import Store
from scenes.checks import Check, Criterion
from scenes.load import find_scene, load_scene
from scenes.model import Scene

MakeScene = Callable[..., Scene]

CAPTURE: dict[str, Any] = {"side": 12, "block": 6, "shadow_side": 32}


def noisy(rng: np.random.Generator, truth: np.ndarray[Any, Any], alpha: float = 0.025) -> Samples:
    """Sixteen accumulators with the skewed noise of rare bright paths."""
    noise = rng.gamma(0.5, 2.0, (16, *truth.shape)) - 1.0
    return Samples(truth * (1 + 0.3 * noise), np.ones(truth.shape[:2], dtype=bool), alpha)


def names(scene: str, of: str, **settings: Any) -> list[str]:
    return [part.name for part in parts_of(technique(of), load_scene(find_scene(scene)), settings)]


def test_parts_are_settings_with_an_off_value_and_passes_that_nothing_relies_on() -> None:
    assert names("small-room-ellipsoid", "indirect.irradiance") == ["shadow atlas", "subject surfels", "bounce"]
    found = names("small-room-ellipsoid", "indirect.talk")
    assert found == ["c_height", "step_rad", "far_brightness", "draw surroundings", "blur X", "blur Y", "blur Z"]


def test_a_part_that_is_off_is_not_switched_off_again() -> None:
    assert "c_height" not in names("small-room-ellipsoid", "indirect.talk", c_height=0.0)


def test_a_pass_that_goes_with_a_setting_is_not_named_again() -> None:
    found = names("eye-human-view30-light40", "cornea.anatomical")
    assert "interreflection" in found
    assert "iris bounces" not in found


def test_a_pass_without_which_others_find_nothing_to_read_is_no_part() -> None:
    assert not {"capture", "reduce", "lights", "resolve"} & {*names("small-room-knot", "indirect.grid")}


def test_an_exact_truth_leaves_no_doubt() -> None:
    samples = Samples(np.ones((1, 4, 4, 3)), np.ones((4, 4), dtype=bool))
    found = added_error(lambda some: float(some.mean.mean()), samples)
    assert (found.value, found.low, found.high) == (1.0, 1.0, 1.0)


def test_of_a_mean_the_interval_is_students() -> None:
    """The jackknife of a linear statistic is its textbook standard error, from the means of groups."""
    samples = noisy(np.random.default_rng(3), np.ones((6, 5, 3)))
    groups = samples.masked.mean(axis=(1, 2)).reshape(-1, GROUP).mean(axis=1)
    half = student_quantile(0.025, len(groups) - 1) * groups.std(ddof=1) / np.sqrt(len(groups))
    found = added_error(lambda some: float(some.masked.mean()), samples)
    np.testing.assert_allclose([found.low, found.value, found.high], groups.mean() + half * np.array([-1, 0, 1]))


def test_common_noise_cancels() -> None:
    """The difference of two errors is known far better than either."""
    rng = np.random.default_rng(5)
    truth = rng.uniform(0.5, 2.0, (24, 24, 3))
    samples = noisy(rng, truth)
    one, other = 1.05 * truth, 1.06 * truth
    both = added_error(lambda s: evaluate("nrmse", other, s).value - evaluate("nrmse", one, s).value, samples)
    alone = added_error(lambda s: evaluate("nrmse", other, s).value, samples)
    assert both.low > 0
    assert both.high - both.low < 0.5 * (alone.high - alone.low)


def test_the_interval_holds_the_true_difference_as_often_as_it_says() -> None:
    """In 95 % of all cases, and of 300 of them not in fewer than 92 % or in more than 98 %."""
    rng = np.random.default_rng(8)
    truth = rng.uniform(0.5, 2.0, (8, 8, 3))
    one, other = truth + 0.2 * rng.normal(size=truth.shape), truth + 0.3 * rng.normal(size=truth.shape)
    exact = Samples(truth[None], np.ones((8, 8), dtype=bool))

    def added(some: Samples) -> float:
        return evaluate("nrmse", other, some).value - evaluate("nrmse", one, some).value

    expected = added(exact)
    found = [added_error(added, noisy(rng, truth)) for _ in range(300)]
    assert 0.92 <= np.mean([each.low <= expected <= each.high for each in found]) <= 0.98


def check_of(**settings: Any) -> Check:
    criterion = Criterion(metric="nrmse", max=1.0, reason="any error will do here")
    return Check(
        quantity="indirect_radiance", technique="indirect.irradiance", settings=settings, criteria=(criterion,)
    )


def test_in_a_closed_room_bounces_are_worth_their_time(make_scene: MakeScene, tmp_path: Path) -> None:
    """You should see the error grow without them, and the same whole image in all rows."""
    steps: list[str] = []
    scene = make_scene(truth={"max_spp": 256})
    store = Store(tmp_path / "store")
    found = {x.part: x for x in ablations(scene, check_of(**CAPTURE), store, lambda what, done: steps.append(what))}
    assert list(found) == ["shadow atlas", "subject surfels", "bounce"]
    assert len({one.error_with for one in found.values()}) == 1
    assert found["bounce"].added.low > 0
    for one in found.values():
        assert one.added.value == pytest.approx(one.error_without.value - one.error_with.value)
        assert min(one.seconds_with, one.seconds_without) > 0
    assert any("without bounce" in step for step in steps)


def test_a_part_that_the_technique_needs_is_reported_as_such(
    make_scene: MakeScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left: list[tuple[str, str]] = []

    def fails(frame: Any, lights: Any) -> None:
        raise KeyError("shadow_atlas")

    monkeypatch.setattr("realtime.capture.unshadowed", fails)
    scene, store = make_scene(truth={"max_spp": 64}), Store(tmp_path / "store")
    found = ablations(scene, check_of(**CAPTURE), store, lambda what, done: None, lambda *of: left.append(of))
    assert [one.part for one in found] == ["subject surfels", "bounce"]
    ((what, why),) = left
    assert what == "scene, indirect.irradiance without shadow atlas"
    assert why == "needed: a later pass finds no 'shadow_atlas' without it."


def test_parts_are_judged_by_an_error_even_where_the_check_judges_a_bias_first(
    make_scene: MakeScene, tmp_path: Path
) -> None:
    bias = Criterion(metric="energy_bias", min=-1.0, max=1.0, reason="any bias will do here")
    check = check_of(**CAPTURE)
    check = check.model_copy(update={"criteria": (bias, *check.criteria)})
    scene, store = make_scene(truth={"max_spp": 64}), Store(tmp_path / "store")
    first = next(ablations(scene, check, store, lambda what, done: None))
    assert first.metric == "nrmse"
    assert first.error_with.value >= 0
