from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from comparisons.bench.points import Judge
from comparisons.bench.traced import HEADROOM, Tracer, expected_error, peak_bytes, slope_of, traced_of, tracing_tasks
from comparisons.metrics import Estimate
from reference.estimator import ACCUMULATORS, Reference
from reference.store import Store
from scenes.model import Scene


def unheard(what: str, fraction: float) -> None:
    pass


@pytest.fixture
def judge(make_scene: Callable[..., Scene], tmp_path: Path, mi: ModuleType) -> Judge:
    """Of the indirect light in a small room."""
    scene = make_scene(truth={"max_spp": 4096})
    return Judge(Reference(scene, Store(tmp_path), unheard), "indirect_radiance", "nrmse")


def tracer_of(judge: Judge) -> Tracer:
    return Tracer(judge.reference.studio, judge.truth)


def test_errors_of_rendered_images_are_what_the_spread_of_the_truth_foretells(judge: Judge) -> None:
    """The accumulators of a truth of 16 spp are images of 1 spp: their variance is the squared error of one."""
    first = judge.reference.truth("indirect_radiance", ACCUMULATORS)
    judge.grow(4096)
    mean = judge.truth.accumulators[:, judge.truth.mask].mean()
    spread = np.sqrt(first.accumulators[:, first.mask].astype(np.float64).var(axis=0, ddof=1).mean()) / mean
    tracer = tracer_of(judge)
    found = expected_error("nrmse", [judge.estimate(tracer.image(1)[0]) for _ in range(24)])
    assert found.low <= spread <= found.high
    assert found.high - found.low < 0.4 * found.value


def test_images_have_noise_of_their_own_and_the_truth_as_their_mean(judge: Judge) -> None:
    judge.grow(4096)
    tracer = tracer_of(judge)
    images = np.stack([tracer.image(16)[0][judge.truth.mask] for _ in range(16)])
    assert not np.array_equal(images[0], images[1])
    truth = judge.truth.accumulators[:, judge.truth.mask].mean(axis=0)
    error = images.mean() - truth.mean()
    noise = np.hypot(images.mean(axis=(1, 2)).std(ddof=1) / 4, judge.truth.accumulators.mean(axis=(1, 2, 3)).std() / 4)
    assert abs(error) < 4 * noise


def test_more_samples_than_a_launch_may_have_are_added_up(judge: Judge, monkeypatch: pytest.MonkeyPatch) -> None:
    tracer = tracer_of(judge)
    monkeypatch.setattr("comparisons.bench.traced.LARGEST_BLOCK", 16)
    monkeypatch.setattr("comparisons.bench.traced.PATHS_A_LAUNCH", 160)
    image, seconds = tracer.image(40)
    truth = judge.truth.accumulators.mean(axis=0)
    assert seconds > 0
    assert image[judge.truth.mask].mean() == pytest.approx(truth[judge.truth.mask].mean(), rel=0.2)
    assert not image[~judge.truth.mask].any()


def test_what_is_timed_is_judged_by_a_truth_of_many_more_samples(judge: Judge) -> None:
    tracer = tracer_of(judge)
    tasks = tracing_tasks(tracer, judge, most=5)
    assert list(tasks)[:7] == [1, 2, 4, 8, 16, 32, 64]
    assert HEADROOM * max(tasks) <= judge.truth.spp
    for spp in (1, 2, 4, 8, 16):
        for _ in range(8):
            tasks[spp].once()
    found = [traced_of("indirect light", tracer, "nrmse", spp, tasks[spp], 0) for spp in (1, 2, 4, 8, 16)]
    slope = slope_of(found)
    assert slope is not None
    assert slope.exponent.value == pytest.approx(-0.5, abs=0.12)
    assert all(one.seconds.value > 0 for one in found)
    assert peak_bytes(tracer, 4) > 0


def test_an_exact_truth_is_timed_without_samples(make_scene: Callable[..., Scene], tmp_path: Path, mi: object) -> None:
    judge = Judge(Reference(make_scene(), Store(tmp_path), unheard), "visibility", "rmse")
    tracer = tracer_of(judge)
    tasks = tracing_tasks(tracer, judge, most=5)
    assert list(tasks) == [0]
    tasks[0].once()
    found = traced_of("shadows", tracer, "rmse", 0, tasks[0], peak_bytes(tracer, 0))
    assert (found.spp, found.error.value, found.error.high) == (0, 0.0, 0.0)
    assert found.seconds.value > 0


def test_roots_are_averaged_as_squares_and_the_interval_has_both_sources() -> None:
    errors = [Estimate(value, value, value) for value in (3.0, 4.0)]
    assert expected_error("nrmse", errors).value == pytest.approx(np.sqrt(12.5))
    assert expected_error("flip", errors).value == pytest.approx(3.5)
    vague = [Estimate(3.5, 3.0, 4.5), Estimate(3.5, 3.0, 4.5)]
    found = expected_error("flip", vague)
    assert (found.value, found.low, found.high) == pytest.approx((3.5, 3.0, 4.5))
