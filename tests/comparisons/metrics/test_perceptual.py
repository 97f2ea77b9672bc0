"""Perceptual metrics against closed forms for uniform images, and their bracket under noise."""

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from comparisons.metrics import Samples, evaluate
from comparisons.metrics.delta_e_itp import WHITE_CD_M2, difference_itp
from comparisons.metrics.dssim import ssim_map
from comparisons.metrics.flip import flip_image, flip_map
from comparisons.tonemap import MEAN_VALUE
from scenes import srgb
from scenes.errors import ImageError
from scenes.image import Float64

flip_module = importlib.import_module("comparisons.metrics.flip")  # whose name in the package is the metric

PERCEPTUAL = ["flip", "dssim_tonemapped", "delta_e_itp"]
ROWS, COLUMNS = np.mgrid[:32, :32]
TRUTH: Float64 = (1.2 + np.sin(ROWS / 5) * np.cos(COLUMNS / 6))[..., None] * np.array([1.0, 0.6, 0.3])
Noisy = Callable[[Float64, float], Samples]
Exact = Callable[[Float64], Samples]


def grey(display: float, size: int = 32) -> Float64:
    return np.full((size, size, 3), display)


def lightness(display: float) -> float:
    """CIE 1976 L* of an sRGB grey."""
    y = float(srgb.decode(np.array(display)))
    return 116 * y ** (1 / 3) - 16 if y > (6 / 29) ** 3 else y * (29 / 3) ** 3


def pq(luminance: Float64) -> Float64:
    """SMPTE ST 2084, inverse EOTF."""
    m1, m2, c1, c2, c3 = 1305 / 8192, 2523 / 32, 107 / 128, 2413 / 128, 2392 / 128
    power = (luminance / 10000) ** m1
    encoded: Float64 = ((c1 + c2 * power) / (1 + c3 * power)) ** m2
    return encoded


def ictcp(rgb709: Float64) -> Float64:
    """ITU-R BT.2087 (709 to 2020), then BT.2100 table 7."""
    to_2020 = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])
    to_lms = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096
    to_ictcp = np.array([[2048, 2048, 0], [6610, -13613, 7003], [17933, -17390, -543]]) / 4096
    coded: Float64 = to_ictcp @ pq(to_lms @ (to_2020 @ rgb709))
    return coded


@pytest.mark.parametrize("metric", PERCEPTUAL)
def test_identical_images_have_no_error(metric: str, exact: Exact) -> None:
    estimate = evaluate(metric, TRUTH, exact(TRUTH))
    assert [estimate.low, estimate.value, estimate.high] == pytest.approx([0.0] * 3, abs=1e-6)


@pytest.mark.parametrize("metric", PERCEPTUAL)
def test_a_larger_error_reads_larger(metric: str, exact: Exact) -> None:
    small, large = (evaluate(metric, TRUTH * [1.0, 1.0 - e, 1.0 + e], exact(TRUTH)).value for e in (0.05, 0.2))
    assert 0 < small < large


@pytest.mark.parametrize(("first", "second"), [(0.5, 0.6), (0.2, 0.25), (0.9, 0.7)])
def test_flip_of_two_greys(first: float, second: float) -> None:
    """Andersson et al. 2020, section 4: |dL*|^0.7, where 0.4 of the largest (41.27, green to blue) maps to 0.95."""
    expected = 0.95 * abs(lightness(first) - lightness(second)) ** 0.7 / (0.4 * 41.27)
    np.testing.assert_allclose(flip_map(grey(first), grey(second)), expected, rtol=2e-3)


def test_flip_of_black_and_white_is_near_its_largest() -> None:
    """|dL*| = 100 lies past the knee: 0.95 + 0.05 (100^0.7 - 0.4 * 41.27) / (0.6 * 41.27)."""
    expected = 0.95 + 0.05 * (100**0.7 - 0.4 * 41.27) / (0.6 * 41.27)
    np.testing.assert_allclose(flip_map(grey(0.0), grey(1.0)), expected, rtol=1e-4)


@pytest.mark.parametrize(("first", "second"), [(0.5, 0.6), (0.0, 1.0), (0.9, 0.1)])
def test_ssim_of_two_greys(first: float, second: float) -> None:
    """Without structure only the luminance term is left: (2 a b + C1) / (a² + b² + C1) with C1 = 0.01²."""
    expected = (2 * first * second + 1e-4) / (first**2 + second**2 + 1e-4)
    np.testing.assert_allclose(ssim_map(grey(first), grey(second)), expected, rtol=1e-9)


def test_inverted_structure_has_a_large_dssim(exact: Exact) -> None:
    checks = 0.5 + 0.4 * (-1.0) ** (ROWS + COLUMNS)[..., None] * np.ones(3)
    assert evaluate("dssim_tonemapped", 1.0 - checks, exact(checks)).value > 1.0


def test_pq_of_published_luminances() -> None:
    """ITU-R BT.2408, table 1: 203 cd/m² is 58 % PQ, 100 cd/m² 51 %, 1000 cd/m² 75 %."""
    np.testing.assert_allclose(pq(np.array([203.0, 100.0, 1000.0])), [0.58, 0.51, 0.75], atol=5e-3)


@pytest.mark.parametrize("luminances", [(100.0, 203.0), (1.0, 1.1), (500.0, 505.0)])
def test_delta_e_itp_of_two_greys(luminances: tuple[float, float]) -> None:
    """Greys differ in I alone, and I of a grey is its PQ value: 720 |dI|."""
    first, second = (np.full((1, 3), luminance) for luminance in luminances)
    expected = 720 * abs(pq(first) - pq(second))[0, 0]
    np.testing.assert_allclose(difference_itp(first, second), expected, rtol=1e-3)


def test_delta_e_itp_of_two_colours() -> None:
    """ITU-R BT.2124 equation 1: 720 sqrt(dI² + dT² + dP²) with T = Ct / 2."""
    first, second = np.array([120.0, 30.0, 10.0]), np.array([100.0, 40.0, 12.0])
    expected = 720 * np.linalg.norm((ictcp(first) - ictcp(second)) * [1.0, 0.5, 1.0])
    np.testing.assert_allclose(difference_itp(first[None], second[None]), expected, rtol=1e-3)


def test_delta_e_itp_shows_the_mean_at_its_declared_luminance(exact: Exact) -> None:
    mean = MEAN_VALUE * WHITE_CD_M2
    expected = 720 * (pq(np.array(2 * mean)) - pq(np.array(mean)))
    assert evaluate("delta_e_itp", grey(14.0), exact(grey(7.0))).value == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("noise", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("gain", [(1.0, 1.0, 1.0), (0.95, 1.0, 1.1), (0.8, 1.0, 1.4)], ids=["equal", "near", "far"])
@pytest.mark.parametrize("metric", PERCEPTUAL)
def test_the_bracket_holds_the_truth(
    metric: str, gain: tuple[float, ...], noise: float, exact: Exact, noisy: Noisy
) -> None:
    """Expected loss: random ups and downs of 1 % are not in the bracket, see its docstring."""
    true = evaluate(metric, TRUTH * gain, exact(TRUTH)).value
    estimate = evaluate(metric, TRUTH * gain, noisy(TRUTH, noise))
    assert estimate.low <= 1.01 * true + 1e-9
    assert estimate.low <= estimate.value <= estimate.high
    assert estimate.high >= 0.99 * true


@pytest.mark.parametrize("metric", PERCEPTUAL)
def test_the_extrapolation_is_closer_than_the_raw_value(metric: str, exact: Exact, noisy: Noisy) -> None:
    image = TRUTH * 1.1
    true = evaluate(metric, image, exact(TRUTH)).value
    estimates = [evaluate(metric, image, noisy(TRUTH, 0.3)) for _ in range(8)]
    raw, extrapolated = (np.mean([getattr(e, key) for e in estimates]) - true for key in ("high", "value"))
    assert raw > 0
    assert abs(extrapolated) < 0.7 * raw


@pytest.mark.parametrize("metric", PERCEPTUAL)
def test_the_floor_is_what_two_noisy_truths_differ_by(metric: str, exact: Exact, noisy: Noisy) -> None:
    floors = [evaluate(metric, TRUTH, noisy(TRUTH, noise)).floor for noise in (0.1, 0.3)]
    assert None not in floors
    assert 0 < floors[0] < floors[1]  # type: ignore[operator]
    first, second = noisy(TRUTH, 0.3).half_means
    assert floors[1] == pytest.approx(evaluate(metric, second, exact(first)).value, rel=0.2)
    assert evaluate(metric, TRUTH, exact(TRUTH)).floor is None


@pytest.mark.parametrize("metric", PERCEPTUAL)
def test_noise_adds_to_the_error_of_a_perfect_image(metric: str, noisy: Noisy) -> None:
    values = [evaluate(metric, TRUTH, noisy(TRUTH, noise)).high for noise in (0.1, 0.3, 1.0)]
    assert 0 < values[0] < values[1] < values[2]


@pytest.mark.parametrize("metric", PERCEPTUAL)
def test_the_outside_of_the_mask_is_ignored(metric: str) -> None:
    mask = (ROWS - 16) ** 2 + (COLUMNS - 16) ** 2 < 100
    truth = np.where(mask[..., None], TRUTH, np.inf)
    image = np.where(mask[..., None], TRUTH, np.nan)
    assert evaluate(metric, image, Samples(truth[None], mask)).value == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("metric", PERCEPTUAL)
def test_only_colours_are_judged(metric: str, exact: Exact) -> None:
    with pytest.raises(ImageError, match="needs 3 channels; the truth has 1"):
        evaluate(metric, TRUTH[..., :1], exact(TRUTH[..., :1]))


def test_dssim_refuses_an_image_smaller_than_its_window(exact: Exact) -> None:
    with pytest.raises(ImageError, match="11x11 pixels; the image has 32x8"):
        evaluate("dssim_tonemapped", TRUTH[:8], exact(TRUTH[:8]))


def test_a_flip_map_of_the_same_images_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []
    make = flip_module._evaluated

    def counted(true: Any, test: Any) -> Any:
        made.append(1)
        return make(true, test)

    monkeypatch.setattr(flip_module, "_evaluated", counted)
    monkeypatch.setattr(flip_module, "_maps", {})
    one, other = TRUTH / TRUTH.max(), 0.9 * TRUTH / TRUTH.max()
    maps = [flip_map(one, other), flip_map(one.copy(), other.copy()), flip_map(other, one), flip_map(one, one)]
    assert len(made) == 3
    np.testing.assert_array_equal(maps[0], maps[1])
    assert np.any(maps[0] != maps[3])
    for index in range(2 * flip_module.MAPS_KEPT):
        flip_map(one, one * index / 100)
    assert len(flip_module._maps) == flip_module.MAPS_KEPT


def test_the_flip_image_has_the_raw_error_as_its_mean(noisy: Noisy) -> None:
    samples = noisy(TRUTH, 0.3)
    mask = ROWS + COLUMNS < 40
    judged = Samples(samples.accumulators, mask)
    errors = flip_image(TRUTH * 1.2, judged)
    assert errors.shape == mask.shape
    assert evaluate("flip", TRUTH * 1.2, judged).high == pytest.approx(float(errors[mask].mean()), rel=1e-6)
