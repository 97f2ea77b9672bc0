"""Synthetic truths with known errors: what is called wrong, how often by mistake, and what is missed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from comparisons import significance as module
from comparisons.metrics import Samples
from comparisons.significance import FALSE_DISCOVERY_RATE, MIN_JUDGED, Significance, significance
from scenes.errors import ImageError
from scenes.image import Bool, Float64

K = 16
REPETITIONS = 200


def everywhere(height: int, width: int) -> Bool:
    return np.ones((height, width), dtype=np.bool_)


def gaussian(rng: np.random.Generator, spp: int, size: int = 64, channels: int = 1) -> Float64:
    """Accumulators of a truth of 1; the coefficient of variation of a sample is 1."""
    return 1 + rng.normal(scale=(K / spp) ** 0.5, size=(K, size, size, channels))


def gamma(rng: np.random.Generator, spp: int, variation: float, size: int = 64) -> Float64:
    """Accumulators of a truth of 1; samples have gamma noise, so that their skewness is twice their `variation`."""
    shape = spp / K / variation**2
    return rng.gamma(shape, 1 / shape, size=(K, size, size, 1))


def log_normal(rng: np.random.Generator, sigma: float, size: int = 64) -> Float64:
    """Accumulators of a truth of 1 of one log-normal sample each, 16 spp in all."""
    return rng.lognormal(-(sigma**2) / 2, sigma, size=(K, size, size, 1))


def found_in(image: NDArray[np.floating], accumulators: NDArray[np.floating]) -> Significance:
    found = significance(image, Samples(accumulators, everywhere(*image.shape[:2])))
    assert found is not None
    return found


def false_alarms(truths: list[Float64]) -> int:
    """How many truths of 1 call a perfect image wrong anywhere."""
    return sum(bool(found_in(np.ones(truth.shape[1:]), truth).wrong.any()) for truth in truths)


def most_by_chance(repetitions: int, probability: float = FALSE_DISCOVERY_RATE) -> float:
    """Exceeded once in a thousand tests."""
    from scipy.stats import binom

    return float(binom.ppf(0.999, repetitions, probability))


@pytest.mark.parametrize(("t", "wrong"), [(2.12, False), (2.14, True), (-2.12, False), (-2.14, True)])
def test_a_single_tile_is_judged_by_student_t(t: float, wrong: bool) -> None:
    """The two-sided 5 % point of Student's t with 15 degrees of freedom is 2.131: any table."""
    accumulators = gaussian(np.random.default_rng(1), spp=16, size=8)
    means = accumulators.mean(axis=(1, 2, 3), keepdims=True)
    standard = (accumulators - means.mean()) / means.std(ddof=1) * K**0.5
    found = found_in(np.full((8, 8, 1), t), standard)
    assert bool(found.wrong.all()) is bool(found.wrong.any()) is wrong


@pytest.mark.parametrize("variation", [1.0, 2.0])
@pytest.mark.parametrize("spp", [16, 64])
def test_skewed_noise_raises_few_false_alarms(variation: float, spp: int) -> None:
    rng = np.random.default_rng(2)
    truths = [gamma(rng, spp, variation) for _ in range(REPETITIONS)]
    assert false_alarms(truths) <= most_by_chance(REPETITIONS)


@pytest.mark.parametrize(("channels", "size"), [(1, 64), (3, 32)])
def test_gaussian_noise_raises_few_false_alarms(channels: int, size: int) -> None:
    rng = np.random.default_rng(3)
    truths = [gaussian(rng, 16, size, channels) for _ in range(REPETITIONS)]
    assert false_alarms(truths) <= most_by_chance(REPETITIONS)


def test_a_map_of_single_pixels_would_raise_them_on_every_image(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected loss: the noise for which the tiles above hold their rate."""
    monkeypatch.setattr(module, "TILE_SIZES", (1,))
    monkeypatch.setattr(module, "MIN_JUDGED", 1)
    rng = np.random.default_rng(4)
    assert false_alarms([gamma(rng, 16, 1.0) for _ in range(20)]) == 20


def test_very_heavy_tails_break_the_rate() -> None:
    """Expected loss: log-normal samples of σ = 1.5 have a skewness of 33; the mean over a small tile keeps 4 of it."""
    rng = np.random.default_rng(5)
    alarms = false_alarms([log_normal(rng, 1.5) for _ in range(100)])
    assert most_by_chance(100) < alarms <= most_by_chance(100, 0.32)


def test_few_of_the_pixels_called_wrong_are_right() -> None:
    """Half the image is 2.5 % too bright, which is found in part; at most 5 % of what is found is elsewhere."""
    rng = np.random.default_rng(6)
    image = np.ones((64, 64, 1))
    image[:, :32] = 1.025
    shares, sizes = [], []
    for _ in range(100):
        wrong = found_in(image, gamma(rng, 64, 1.0)).wrong
        shares.append(wrong[:, 32:].sum() / max(1, wrong.sum()))
        sizes.append(wrong[:, :32].mean())
    assert 0.1 < np.mean(sizes) < 0.9
    assert np.mean(shares) <= FALSE_DISCOVERY_RATE + 3 * np.std(shares) / 100**0.5


@pytest.mark.parametrize(("row", "column"), [(0, 0), (5, 11), (26, 37), (50, 49)])
def test_an_error_of_5_percent_on_12_by_12_pixels_is_found_and_placed(row: int, column: int) -> None:
    rng = np.random.default_rng(7)
    image = np.ones((64, 64, 1))
    image[row : row + 12, column : column + 12] = 1.05
    around = np.zeros((64, 64), dtype=bool)
    around[max(0, row - 15) : row + 27, max(0, column - 15) : column + 27] = True
    for _ in range(10):
        found = found_in(image, gamma(rng, 1024, 2.0))
        assert found.wrong[row + 2 : row + 10, column + 2 : column + 10].any()
        assert (found.signed[found.wrong & around] > 0).all()
        assert found.wrong[~around].mean() < 0.2


def test_an_error_whose_channels_cancel_is_found() -> None:
    rng = np.random.default_rng(8)
    error = np.array([0.1, -0.1, 0.0])
    accumulators = gaussian(rng, 256) * np.ones(3)
    found = found_in(np.ones((64, 64, 3)) + error, accumulators)
    assert found.share == 1.0
    np.testing.assert_allclose(np.abs(found.signed), 0.1, atol=0.05)


def test_a_grey_error_loses_nothing_by_testing_channels() -> None:
    """Channels of the same noise give the same p-value, and Simes combines equal ones to themselves."""
    rng = np.random.default_rng(9)
    accumulators = gamma(rng, 64, 1.0)
    image = np.full((64, 64, 1), 1.03)
    grey = found_in(image, accumulators)
    colour = found_in(image * np.ones(3), accumulators * np.ones(3))
    assert 0 < grey.share < 1
    np.testing.assert_array_equal(colour.wrong, grey.wrong)
    np.testing.assert_allclose(colour.signed, grey.signed)


def test_the_smallest_significant_tile_says_the_error() -> None:
    """A quarter of a large tile is 0.4 too dark: the small tile there reads all of it, the rest reads the mean."""
    image = np.ones((16, 32, 3), dtype=np.float32)
    image[:8, 8:16] -= np.float32(0.4)
    found = found_in(image, np.ones((K, 16, 32, 3), dtype=np.float32))
    expected = np.zeros((16, 32))
    expected[:, :16] = -0.1
    expected[:8, 8:16] = -0.4
    np.testing.assert_allclose(found.signed, expected, atol=1e-7)
    np.testing.assert_array_equal(found.wrong, expected != 0)
    assert found.share == 0.5


def test_the_channel_that_is_most_certainly_wrong_says_the_error() -> None:
    rng = np.random.default_rng(10)
    accumulators = 1 + np.array([1.0, 0.01]) * rng.normal(size=(K, 16, 16, 2))
    found = found_in(np.array([1.3, 0.9]) * np.ones((16, 16, 1)), accumulators)
    np.testing.assert_allclose(found.signed, -0.1, atol=0.01)


@pytest.mark.parametrize("value", [0.0, 1e-30, 0.3, 1e30])
def test_a_truth_without_noise_that_is_met_shows_nothing(value: float) -> None:
    image = np.full((16, 16, 3), value, dtype=np.float32)
    found = found_in(image, np.repeat(image[None], K, axis=0))
    assert found.share == 0.0
    assert not found.signed.any()


def test_the_last_digit_of_a_float_is_no_error() -> None:
    image = np.full((16, 16, 3), 0.3, dtype=np.float32)
    truth = np.repeat(np.nextafter(image, np.float32(1))[None], K, axis=0)
    assert found_in(image, truth).share == 0.0
    assert found_in(image * np.float32(1.00001), truth).share == 1.0


def test_light_where_the_truth_is_black_is_wrong_and_black_where_it_is_lit_too() -> None:
    black, lit = np.zeros((8, 8, 3), dtype=np.float32), np.full((8, 8, 3), 1e-3, dtype=np.float32)
    assert found_in(lit, np.repeat(black[None], K, axis=0)).signed == pytest.approx(1e-3)
    assert found_in(black, np.repeat(lit[None], K, axis=0)).signed == pytest.approx(-1e-3)


def test_an_exact_truth_has_nothing_to_test() -> None:
    assert significance(np.ones((8, 8, 1)), Samples(np.zeros((1, 8, 8, 1)), everywhere(8, 8))) is None


@pytest.mark.parametrize(("height", "width", "tiles"), [(8, 8, 2), (4, 4, 2), (20, 20, 13), (17, 8, 3), (64, 64, 80)])
def test_tiles_cut_off_by_the_edge_are_tested_if_enough_is_left(height: int, width: int, tiles: int) -> None:
    """Of 17 rows, the last is left alone in both sizes, and its 8 pixels are too few."""
    accumulators = gaussian(np.random.default_rng(11), 16)[:, :height, :width]
    assert found_in(np.ones((height, width, 1)), accumulators).tiles == tiles


def test_a_tile_needs_enough_judged_pixels() -> None:
    """One pixel less than needed in a small tile, then as many, but some of them in the small tile beside it."""
    mask = np.zeros((16, 16), dtype=bool)
    mask[:2, : MIN_JUDGED // 2] = True
    mask[0, 0] = False
    accumulators = np.ones((K, 16, 16, 1))
    assert significance(np.zeros((16, 16, 1)), Samples(accumulators, mask)) is None
    mask[0, 8] = True
    found = significance(np.zeros((16, 16, 1)), Samples(accumulators, mask))
    assert found is not None
    assert found.tiles == 1
    np.testing.assert_array_equal(found.wrong, mask)


def test_what_is_not_judged_does_not_matter() -> None:
    rng = np.random.default_rng(12)
    mask = rng.random((32, 32)) < 0.6
    accumulators = gaussian(rng, 256, size=32)
    image = np.where(np.arange(32) < 16, 1.1, 1.0)[:, None] * np.ones((32, 32, 1))
    spoilt, spoilt_truth = image.copy(), accumulators.copy()
    spoilt[~mask] = np.nan
    spoilt_truth[:, ~mask] = np.inf
    clean = significance(np.where(mask[..., None], image, 1e9), Samples(accumulators, mask))
    found = significance(spoilt, Samples(spoilt_truth, mask))
    assert clean is not None
    assert found is not None
    np.testing.assert_array_equal(found.signed, clean.signed)
    assert not found.wrong[~mask].any()
    assert found.share == found.wrong.sum() / mask.sum()
    assert 0 < found.share < 1


@given(exponent=st.integers(-20, 20), seed=st.integers(0, 2**32 - 1))
def test_the_unit_and_the_order_of_accumulators_do_not_matter(exponent: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    accumulators = rng.gamma(1.0, size=(6, 18, 20, 3))
    image = rng.gamma(20.0, 0.05, size=(18, 20, 3))
    factor = 2.0**exponent
    found = found_in(image, accumulators)
    other = found_in(factor * image, factor * rng.permutation(accumulators))
    np.testing.assert_array_equal(other.wrong, found.wrong)
    np.testing.assert_allclose(other.signed, factor * found.signed)


def test_the_summary_is_what_results_need() -> None:
    found = found_in(np.ones((16, 16, 1)), np.zeros((K, 16, 16, 1)))
    assert found.summary == {"share": 1.0, "false_discovery_rate": 0.05, "tiles": 5}
    assert {type(value) for value in found.summary.values()} == {float, int}


def test_an_image_of_another_size_is_refused() -> None:
    with pytest.raises(ImageError, match="scene's resolution"):
        significance(np.ones((8, 9, 1)), Samples(np.ones((K, 8, 8, 1)), everywhere(8, 8)))
