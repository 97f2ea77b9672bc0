"""Synthetic truths with known errors: which of two images is closer, and how often that is said wrongly."""

import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comparisons import difference as module
from comparisons.difference import (
    ABSOLUTE_MARGIN,
    RELATIVE_MARGIN,
    Candidate,
    Comparison,
    Difference,
    Preference,
    compare,
    difference,
)
from comparisons.linear import read_linear, write_linear
from comparisons.metrics import Estimate, Samples, evaluate
from comparisons.metrics.rel_mse import EPSILON, weights_are_blurred
from reference.estimator import Truth
from reference.quantity import Integrator
from scenes.errors import CorruptImage, ImageError, InputError
from scenes.image import Bool, Float64, Image
from scenes.load import find_scene, load_scene
from scenes.model import Scene

ROWS, COLUMNS = np.mgrid[:16, :12]
TRUTH: Float64 = (1.2 + np.sin(ROWS / 3) * np.cos(COLUMNS / 4))[..., None] * np.array([1.0, 0.6, 0.3])
PATTERN: Float64 = (np.sin(COLUMNS / 2) + (ROWS < 6))[..., None] * np.array([1.0, -0.5, 0.8])
PATCH: Float64 = ((abs(ROWS - 8) < 2) & (abs(COLUMNS - 6) < 2))[..., None] * np.ones(3)
EVERYWHERE = np.ones(TRUTH.shape[:2], dtype=bool)
MISSED = 0.025
REPETITIONS = 200
PAIRS = {
    "settings that are close": (1.05 * TRUTH + 0.02 * PATTERN, 1.055 * TRUTH + 0.02 * PATTERN),
    "another kind of error": (1.05 * TRUTH + 0.1 * PATTERN, 0.97 * TRUTH),
    "right against wrong": (0.3 * TRUTH, 1.02 * TRUTH),
    "equally wrong": (TRUTH + 0.1 * PATTERN, TRUTH - 0.1 * PATTERN),
    "wrong in nine pixels": (TRUTH + 0.05 * PATTERN, TRUTH + 0.05 * PATTERN + 0.3 * PATCH),
}


def noisy(spp: int, seed: int | np.random.Generator, noise: float = 1.5, truth: Float64 = TRUTH) -> Samples:
    """Accumulators of samples with gamma noise: `noise` is a sample's standard deviation over its mean."""
    shape = spp / 16 / noise**2
    factors = np.random.default_rng(seed).gamma(shape, 1 / shape, size=(16, *truth.shape))
    return Samples(truth * factors, EVERYWHERE, MISSED)


def true_error(metric: str, image: Float64) -> float:
    """E, as its definition says."""
    weight = 1 / TRUTH.mean() ** 2 if metric == "nrmse" else 1 / (TRUTH**2 + (EPSILON * TRUTH.mean()) ** 2)
    return float(np.mean(weight * (image - TRUTH) ** 2))


def found_by(metric: str, a: Float64, b: Float64, spp: int, noise: float) -> list[Difference]:
    rng = np.random.default_rng(spp)
    return [difference(metric, a, b, noisy(spp, rng, noise)) for _ in range(REPETITIONS)]


@pytest.mark.parametrize("pair", ["settings that are close", "right against wrong", "wrong in nine pixels"])
@pytest.mark.parametrize("spp", [16, 64, 256])
def test_the_difference_is_unbiased_and_its_interval_covers(pair: str, spp: int) -> None:
    """Nominal is 95 %; of 200, fewer than 183 or more than 199 would be found once in 100 such tests."""
    a, b = PAIRS[pair]
    true = true_error("nrmse", a) - true_error("nrmse", b)
    found = found_by("nrmse", a, b, spp, noise=1.5)
    values = [d.value for d in found]
    assert np.mean(values) == pytest.approx(true, abs=3 * np.std(values) / REPETITIONS**0.5)
    assert 183 <= sum(d.low <= true <= d.high for d in found) <= 199


@pytest.mark.parametrize("pair", ["settings that are close", "another kind of error"])
def test_the_relative_difference_covers_once_its_weights_are_sharp(pair: str) -> None:
    a, b = PAIRS[pair]
    true = true_error("rel_mse_eps1e-2", a) - true_error("rel_mse_eps1e-2", b)
    found = found_by("rel_mse_eps1e-2", a, b, 256, noise=1.0)
    assert not any(d.note for d in found)
    assert 183 <= sum(d.low <= true <= d.high for d in found) <= 199


@pytest.mark.parametrize("fitted", [(True, False), (True, True)])
def test_a_fitted_exposure_keeps_the_coverage(fitted: tuple[bool, bool]) -> None:
    images = 0.4 * TRUTH + 0.05 * PATTERN, 0.9 * TRUTH - 0.1 * PATTERN
    best = [x * float((x * TRUTH).sum() / (x**2).sum()) if fit else x for x, fit in zip(images, fitted, strict=True)]
    true = true_error("nrmse", best[0]) - true_error("nrmse", best[1])
    rng = np.random.default_rng(5)
    hits = []
    for _ in range(REPETITIONS):
        samples = noisy(64, rng)
        a, b = (Candidate(x, fit).exposed(samples) for x, fit in zip(images, fitted, strict=True))
        d = difference("nrmse", a, b, samples)
        hits.append(d.low <= true <= d.high)
    assert 183 <= sum(hits) <= 199


def test_the_saving_covers_its_true_value() -> None:
    a, b = PAIRS["another kind of error"]
    true = 1 - true_error("nrmse", b) / true_error("nrmse", a)
    savings = [d.saving for d in found_by("nrmse", a, b, 1024, noise=1.5)]
    assert all(savings)
    assert 183 <= sum(s.low <= true <= s.high for s in savings if s) <= 199


def test_the_difference_is_linear_in_the_truth() -> None:
    """(a - b) . (a + b - 2 Y) with the mean Y of all accumulators: no product of two of them is left."""
    a, b = PAIRS["another kind of error"]
    samples = noisy(16, 1)
    mean = samples.masked.mean()
    expected = np.mean((a - b) * (a + b - 2 * samples.mean)) / mean**2
    assert difference("nrmse", a, b, samples).value == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("metric", module.ERRORS)
def test_the_difference_is_that_of_the_separate_estimates(metric: str) -> None:
    a, b = PAIRS["right against wrong"]
    samples = noisy(4096, 2)
    d = difference(metric, a, b, samples)
    each = [evaluate(metric, x, samples) for x in (a, b)]
    power = 2 if metric == "nrmse" else 1
    assert [d.a, d.b] == each
    assert d.value == pytest.approx(each[0].value ** power - each[1].value ** power, rel=1e-9)
    assert d.saving is not None
    assert d.saving.value == pytest.approx(1 - (each[1].value / each[0].value) ** power, rel=1e-9)


@pytest.mark.parametrize("metric", module.ERRORS)
def test_an_image_does_not_differ_from_itself(metric: str) -> None:
    """Not even where fireflies spoil the estimate of its error."""
    samples = noisy(16, 3)
    samples.accumulators[3, 5, 7:10] = 500.0
    image = PAIRS["right against wrong"][0]
    d = difference(metric, image, image, samples)
    assert (d.low, d.value, d.high) == (0.0, 0.0, 0.0)
    assert d.preference is Preference.NEITHER
    assert d.variance_reduction == math.inf


@given(st.integers(0, 2**32 - 1), st.sampled_from(list(module.ERRORS)), st.sampled_from([16, 256, 4096]))
@settings(max_examples=40, deadline=None)
def test_the_difference_is_antisymmetric(seed: int, metric: str, spp: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = TRUTH * rng.uniform(0.5, 1.5, size=(2, 1, 1, 3)) + rng.uniform(0, 0.3, size=(2, 1, 1, 1)) * PATTERN
    samples = noisy(spp, rng)
    there, back = difference(metric, a, b, samples), difference(metric, b, a, samples)
    assert (back.low, back.value, back.high) == (-there.high, -there.value, -there.low)
    assert (back.a, back.b, back.saving, back.margin) == (there.b, there.a, there.saving, there.margin)
    swapped = {Preference.A: Preference.B, Preference.B: Preference.A}
    assert back.preference is swapped.get(there.preference, there.preference)


def test_common_samples_leave_little_of_the_variance() -> None:
    """What is claimed is compared with the spread over repetitions, with a truth for each image or one for both."""
    a, b = PAIRS["settings that are close"]
    found = found_by("nrmse", a, b, 16, noise=1.5)
    rng = np.random.default_rng(10)
    error_of = module.ERRORS["nrmse"]
    apart = [
        error_of(a[EVERYWHERE], noisy(16, rng))[0] - error_of(b[EVERYWHERE], noisy(16, rng))[0]
        for _ in range(REPETITIONS)
    ]
    measured = np.var(apart) / np.var([d.value for d in found])
    assert measured > 600
    assert np.median([d.variance_reduction for d in found]) == pytest.approx(measured, rel=0.4)


def test_an_exact_truth_gives_an_exact_difference() -> None:
    samples = Samples(TRUTH[None], EVERYWHERE)
    for metric in module.ERRORS:
        a, b = PAIRS["another kind of error"]
        d = difference(metric, a, b, samples)
        assert d.value == pytest.approx(true_error(metric, a) - true_error(metric, b), rel=1e-9)
        assert d.low == d.value == d.high
        assert d.preference is Preference.B


def a_difference(low: float, high: float, margin: float = ABSOLUTE_MARGIN, note: str = "") -> Difference:
    exact = Estimate.exact(0.1)
    return Difference(exact, exact, (low + high) / 2, low, high, None, margin, 1.0, note)


@pytest.mark.parametrize(
    ("low", "high", "preference"),
    [
        (-3.0, -2.0, Preference.A),
        (2.0, 3.0, Preference.B),
        (-3.0, 2.0, Preference.UNDECIDED),
        (-0.5, 2.0, Preference.UNDECIDED),
        (-1.0, 1.0, Preference.NEITHER),
        (0.5, 1.0, Preference.NEITHER),
        (0.5, 1.5, Preference.B),
    ],
)
def test_a_preference_needs_the_whole_interval(low: float, high: float, preference: Preference) -> None:
    assert a_difference(low, high, margin=1.0).preference is preference
    assert a_difference(low, high, margin=1.0, note="fireflies").preference is Preference.UNDECIDED


def test_what_does_not_matter_is_relative_for_large_errors_and_absolute_for_small_ones() -> None:
    samples = Samples(TRUTH[None], EVERYWHERE)
    assert difference("nrmse", 0.3 * TRUTH, TRUTH, samples).margin == pytest.approx(
        RELATIVE_MARGIN * true_error("nrmse", 0.3 * TRUTH)
    )
    flat = Samples(np.full((1, 4, 4, 3), 2.0), np.ones((4, 4), dtype=bool))
    nearly = difference("nrmse", np.full((4, 4, 3), 2.0), np.full((4, 4, 3), 2.0 * 1.0099), flat)
    assert nearly.preference is Preference.NEITHER, "an image that is 0.99 % too bright is as good as a perfect one"
    assert difference("nrmse", np.full((4, 4, 3), 2.0), np.full((4, 4, 3), 2.0 * 1.0101), flat).preference is (
        Preference.A
    )


@pytest.mark.parametrize(
    ("found", "needed"),
    [
        (a_difference(-0.01, 0.03), 256),  # half-width 0.02 to 0.01
        (a_difference(-2e-4, 2e-4), 256),  # 2e-4 to the margin
        (a_difference(-1.0, 1.0), None),  # 10,000 times narrower, 10^8 times the samples
        (a_difference(-0.01, 0.03, note="fireflies"), None),
    ],
)
def test_samples_needed_follow_from_the_width_of_the_interval(found: Difference, needed: int | None) -> None:
    assert found.spp_needed(64) == pytest.approx(needed, abs=1) if needed else found.spp_needed(64) is None


@pytest.mark.parametrize("noise", [0.3, 0.6, 0.8, 1.0, 1.5, 3.0])
def test_weights_are_known_to_be_blurred(noise: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether they are is decided in `rel_mse`; here it is only recognised."""
    samples = noisy(64, 4, noise)
    blurred = []

    def blur(mean: Float64, mask: Bool) -> Float64:
        blurred.append(mask)
        return mean

    monkeypatch.setattr(sys.modules["comparisons.metrics.rel_mse"], "_blur", blur)
    module.ERRORS["rel_mse_eps1e-2"](TRUTH[EVERYWHERE], samples)
    assert weights_are_blurred(samples) is bool(blurred)


def test_blurred_weights_decide_nothing() -> None:
    """Expected loss: by what both errors have in common, the difference is wrong far beyond its interval."""
    a, b = TRUTH + 0.1 * PATTERN, TRUTH + 0.11 * PATTERN
    true = true_error("rel_mse_eps1e-2", a) - true_error("rel_mse_eps1e-2", b)
    d = difference("rel_mse_eps1e-2", a, b, noisy(64, 5))
    assert not d.low <= true <= d.high
    assert "blurred" in d.note
    assert d.preference is Preference.UNDECIDED


def test_fireflies_decide_nothing() -> None:
    samples = noisy(64, 6)
    samples.accumulators[3, 5, 7:10] = 500.0
    d = difference("nrmse", *PAIRS["right against wrong"], samples)
    assert "fireflies" in d.note
    assert d.preference is Preference.UNDECIDED


def test_an_error_in_few_pixels_is_no_firefly() -> None:
    d = difference("nrmse", PAIRS["wrong in nine pixels"][0], TRUTH + 5.0 * PATCH, noisy(1024, 6))
    assert not d.note
    assert d.preference is Preference.A


def truth_of(samples: Samples, spp: int) -> Truth:
    integrator = Integrator("synthetic", "known")
    return Truth("radiance", "key", samples.accumulators.astype(np.float32), samples.mask, spp, 0.0, integrator)


@pytest.fixture
def asked() -> list[int]:
    """The samples a pixel that were asked for."""
    return []


@pytest.fixture
def truth_at(asked: list[int]) -> Callable[[int], Truth]:
    """Truths of independent noise, as `Reference.truth` gives them."""

    def at(spp: int) -> Truth:
        asked.append(spp)
        return truth_of(noisy(spp, spp, noise=0.5), spp)

    return at


def compared(a: Float64, b: Float64, truth_at: Callable[[int], Truth], limit: int = 4096) -> Comparison:
    return compare("nrmse", Candidate(a), Candidate(b), truth_at, limit)


def test_a_clear_difference_takes_the_fewest_samples(asked: list[int], truth_at: Callable[[int], Truth]) -> None:
    found = compared(0.9 * TRUTH, 0.95 * TRUTH, truth_at)
    assert found.difference.preference is Preference.B
    assert asked == [16]
    assert found.truth.spp == 16


def test_samples_double_while_a_difference_is_open(asked: list[int], truth_at: Callable[[int], Truth]) -> None:
    found = compared(TRUTH + 0.1 * PATTERN, TRUTH - 0.11 * PATTERN, truth_at, 1 << 14)
    assert found.difference.preference is Preference.A
    assert len(asked) > 1
    assert asked == [16 << i for i in range(len(asked))]


def test_the_limit_ends_it_with_the_samples_it_would_take(asked: list[int], truth_at: Callable[[int], Truth]) -> None:
    images = TRUTH + 0.1 * PATTERN, TRUTH - 0.11 * PATTERN
    found = compared(*images, truth_at, 40)
    assert found.difference.preference is Preference.UNDECIDED
    assert asked == [16, 32]
    needed = found.difference.spp_needed(32)
    assert needed is not None
    assert needed > 32


def test_equally_wrong_images_are_seldom_told_apart() -> None:
    """Each side may be missed in 1 % of all comparisons, over all looks: 8 of 100 would happen once in 1000 tests."""
    a, b = PAIRS["equally wrong"]
    rng = np.random.default_rng(8)
    found = [compared(a, b, lambda spp: truth_of(noisy(spp, rng), spp), 256).difference for _ in range(100)]
    assert sum(d.preference in (Preference.A, Preference.B) for d in found) < 8


def test_each_image_gets_its_own_exposure(truth_at: Callable[[int], Truth]) -> None:
    image = TRUTH + 0.1 * PATTERN
    same = compare("nrmse", Candidate(0.1 * image, True), Candidate(7.0 * image, True), truth_at, 4096)
    assert same.difference.value == pytest.approx(0.0, abs=1e-9)
    assert same.difference.preference is Preference.NEITHER
    half = compare("nrmse", Candidate(0.1 * image, True), Candidate(0.1 * image), truth_at, 4096)
    assert half.difference.preference is Preference.A


@pytest.mark.parametrize("metric", ["flip", "energy_bias", "nonsense"])
def test_a_metric_without_terms_is_refused(metric: str, truth_at: Callable[[int], Truth], asked: list[int]) -> None:
    with pytest.raises(InputError, match="nrmse or rel_mse_eps1e-2"):
        compare(metric, Candidate(TRUTH), Candidate(TRUTH), truth_at, 64)
    assert not asked


def test_an_image_of_another_shape_is_refused(truth_at: Callable[[int], Truth]) -> None:
    with pytest.raises(ImageError, match="shape"):
        compared(TRUTH, TRUTH[1:], truth_at)


@pytest.fixture
def scene() -> Scene:
    return load_scene(find_scene("small-room-ellipsoid"))


def test_a_linear_image_comes_back_as_it_was(tmp_path: Path, scene: Scene) -> None:
    pixels = np.random.default_rng(9).normal(size=(5, 4, 3)).astype(np.float32)
    path = write_linear(tmp_path, "check", Image(pixels, {"technique": "any"}), scene)
    assert path == "images/check-linear.exr"
    np.testing.assert_array_equal(read_linear(tmp_path / path, scene), pixels)


def test_a_linear_image_of_another_scene_is_refused(tmp_path: Path, scene: Scene) -> None:
    path = tmp_path / write_linear(tmp_path, "check", Image(np.zeros((5, 4, 3), dtype=np.float32)), scene)
    with pytest.raises(ImageError, match="Run the checks again"):
        read_linear(path, scene.model_copy(update={"emitters": ()}))
    unjudged = scene.model_copy(update={"checks": (), "title": "renamed"})
    assert read_linear(path, unjudged).shape == (5, 4, 3), "budgets and words change no image"


def test_a_damaged_linear_image_is_refused(tmp_path: Path, scene: Scene) -> None:
    path = tmp_path / write_linear(tmp_path, "check", Image(np.ones((5, 4, 3), dtype=np.float32)), scene)
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(CorruptImage):
        read_linear(path, scene)
