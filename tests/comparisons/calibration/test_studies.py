"""The experiments themselves, on synthetic pools: they must see what is right, and what is not."""

import numpy as np
import pytest

from comparisons.answers.calibrate import RATIOS
from comparisons.calibration.pool import DISTANCES_M, Pool, world
from comparisons.calibration.studies import alarms, cases_of, coverage, verdicts
from comparisons.statistics import PixelEstimates
from reference.estimator import ACCUMULATORS

SIDE = 16


def quiet(what: str, fraction: float) -> None:
    pass


@pytest.fixture(scope="module")
def pool() -> Pool:
    """Gamma noise with a coefficient of variation of 1.8, that of indirect light in a small room."""
    rng = np.random.default_rng(4)
    level = rng.uniform(0.5, 1.5, size=(SIDE * SIDE, 1, 3))
    samples = level * rng.gamma(0.3, 1 / 0.3, size=(SIDE * SIDE, 512, 1))
    return Pool("synthetic", samples.astype(np.float32), np.ones((SIDE, SIDE), dtype=bool))


def test_the_truths_of_a_pool_have_its_mean(pool: Pool) -> None:
    means = [samples.masked.mean() for samples in pool.repetitions(40, 256, 0.01, seed=1)]
    spread = float(np.std(means, ddof=1)) / len(means) ** 0.5
    assert np.mean(means) == pytest.approx(float(pool.truth.mean()), abs=4 * spread)
    assert spread < 0.003


def test_a_truth_that_grows_keeps_its_samples(pool: Pool) -> None:
    truth_at = pool.truths(np.random.default_rng(1))
    first, more, again = truth_at(64), truth_at(128), truth_at(64)
    assert (first.spp, more.spp, again.spp) == (64, 128, 128)
    residual = 2 * more.accumulators - first.accumulators
    assert first.accumulators.shape == (ACCUMULATORS, SIDE, SIDE, 3)
    noise, rest = (a - pool.image(pool.truth) for a in (first.accumulators, residual))
    assert abs(np.corrcoef(noise.ravel(), rest.ravel())[0, 1]) < 0.02, "what was added is independent"


def test_every_world_is_a_room_with_a_light_inside() -> None:
    for name in DISTANCES_M:
        scene = world(name)
        (light,) = scene.emitters
        assert abs(light.position[0]) < scene.shapes[0].size[0] / 2  # type: ignore[union-attr]
    assert world("hard").emitters != world("easy").emitters


@pytest.mark.slow
def test_intervals_cover_what_they_say(pool: Pool) -> None:
    """95 % of 200; and means within three of their standard errors: twelve are looked at."""
    for row in coverage(pool, 200, quiet):
        assert row.coverage >= 0.91, row
        assert row.valid == 1
        if row.metric != "rel_mse_eps1e-2":  # its interval allows for what its weights cost
            assert row.coverage <= 0.995, row
            assert abs(row.bias) < 3.5, row


def test_intervals_that_are_too_narrow_are_found_out(pool: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = PixelEstimates.half_width
    monkeypatch.setattr(PixelEstimates, "half_width", lambda self, alpha: 0.6 * whole(self, alpha))
    rows = [row for row in coverage(pool, 60, quiet) if row.metric == "nrmse, squared"]
    assert np.mean([row.coverage for row in rows]) < 0.88


def test_verdicts_are_right_and_open_only_at_the_budget(pool: Pool) -> None:
    rows = {row.ratio: row for row in verdicts(pool, 0.3, RATIOS, 20, quiet)}
    assert rows[0.5].passed == rows[2.0].failed == 1
    assert all(row.failed == 0 for ratio, row in rows.items() if ratio < 1)
    assert all(row.passed == 0 for ratio, row in rows.items() if ratio > 1)
    assert rows[1.0].open >= 0.9
    assert rows[0.5].spp < 64 < rows[0.9].spp < rows[1.0].spp


def test_the_error_of_an_image_is_its_ratio_times_the_budget(pool: Pool) -> None:
    truth = pool.truth
    image = cases_of(pool)["local, 50 % on a 20th"]
    assert np.count_nonzero((image != truth).any(axis=1)) == len(truth) // 20
    np.testing.assert_allclose(image[0], 1.5 * truth[0])


def test_the_map_is_quiet_without_an_error_and_finds_one(pool: Pool) -> None:
    rows = {(row.case, row.spp): row for row in alarms(pool, (256,), 40, quiet)}
    assert rows["no error", 256].images <= 0.15
    assert rows["10 % on 12 x 12 px", 256].images >= 0.9
