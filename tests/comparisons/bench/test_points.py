from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from comparisons.bench.points import FIRST_SPP, Judge
from reference.estimator import Reference
from reference.store import Store
from scenes.model import Scene


def unheard(what: str, fraction: float) -> None:
    pass


@pytest.fixture
def make_judge(make_scene: Callable[..., Scene], tmp_path: Path, mi: object) -> Callable[..., Judge]:
    """Makes a judge of SMALL_ROOM: make_judge(max_spp=4096, quantity="indirect_radiance", metric="nrmse")."""

    def make(max_spp: int = 4096, quantity: str = "indirect_radiance", metric: str = "nrmse") -> Judge:
        scene = make_scene(truth={"max_spp": max_spp})
        return Judge(Reference(scene, Store(tmp_path / "store"), unheard), quantity, metric)

    return make


def test_truth_grows_until_the_interval_is_narrow(make_judge: Callable[..., Judge]) -> None:
    judge = make_judge()
    truth = judge.truth.accumulators.mean(axis=0)
    judged = truth[judge.truth.mask]
    easy = judge.judged(2 * truth)
    assert (easy.spp, easy.note) == (FIRST_SPP, "")
    assert easy.error.value == pytest.approx(np.sqrt(np.mean(judged**2)) / judged.mean(), rel=0.05)
    assert easy.error.high - easy.error.low <= 0.1 * easy.error.value
    close = judge.judged(1.05 * truth)
    assert close.spp > FIRST_SPP


def test_an_interval_that_stays_wide_is_told(make_judge: Callable[..., Judge]) -> None:
    judge = make_judge(max_spp=256)
    found = judge.judged(1.001 * judge.truth.accumulators.mean(axis=0))
    assert found.spp == 256
    assert "the scene allows 256 spp" in found.note


def test_a_fitted_image_is_judged_by_its_shape_alone(make_judge: Callable[..., Judge]) -> None:
    judge = make_judge()
    half = np.float32(0.5) * judge.truth.accumulators.mean(axis=0)
    assert judge.judged(half).error.value == pytest.approx(0.58, abs=0.1)
    assert judge.judged(half, is_fitted=True).error.value < 0.1


def test_an_exact_truth_needs_no_samples(make_judge: Callable[..., Judge]) -> None:
    judge = make_judge(quantity="visibility", metric="rmse")
    truth = judge.truth.accumulators[0]
    found = judge.judged(truth - np.float32(0.25))
    assert found.error.low == found.error.value == found.error.high == pytest.approx(0.25)
    assert (found.spp, found.note) == (0, "")
