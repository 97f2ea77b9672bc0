"""Metrics for images that must agree exactly: planted shifts, mirrors, offsets."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comparisons.metrics import Samples, evaluate
from scenes.errors import ImageError
from scenes.image import Bool, Float64

HEIGHT, WIDTH = 56, 72
DIAGONAL = float(np.hypot(HEIGHT, WIDTH))
Noisy = Callable[[Float64, float], Samples]
Exact = Callable[[Float64], Samples]


def depth(shift: tuple[float, float] = (0.0, 0.0)) -> tuple[Float64, Bool]:
    """A bumpy blob with a smaller one in front of it, point-sampled: hard edges inside and around. Background is 0."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    y, x = rows + shift[0], columns + shift[1]
    surface = 2 + 0.3 * np.sin(x / 7) * np.cos(y / 9 + 0.3) + 0.1 * np.sin((x + 2 * y) / 11)
    surface = surface - 0.9 * ((x - 26) ** 2 + (y - 20) ** 2 < 64)
    blob = (x - 36) ** 2 + 1.3 * (y - 28) ** 2 < 25**2
    return np.where(blob, surface, 0.0)[..., None], blob


TRUTH, MASK = depth()
SAMPLES = Samples(TRUTH[None], MASK)


@settings(max_examples=30, deadline=None)
@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_a_planted_shift_is_recovered(rows: float, columns: float) -> None:
    estimate = evaluate("shift_px", depth((rows, columns))[0], SAMPLES)
    assert estimate.value == pytest.approx(np.hypot(rows, columns), abs=1e-3)


@pytest.mark.parametrize("shift", [(0.0, 0.01), (0.5, 0.0), (0.5, 0.5), (-1.0, 0.0), (4.0, 3.0)])
def test_named_shifts(shift: tuple[float, float]) -> None:
    assert evaluate("shift_px", depth(shift)[0], SAMPLES).value == pytest.approx(np.hypot(*shift), abs=1e-4)


def test_equal_images_are_not_shifted() -> None:
    assert evaluate("shift_px", TRUTH, SAMPLES).value == 0.0
    assert evaluate("shift_px", TRUTH.astype(np.float32), SAMPLES).value < 1e-6


def test_flipped_edge_pixels_do_not_shift_the_image() -> None:
    """A rasteriser may decide an edge pixel the other way; that says nothing about a hundredth of a pixel."""
    image = TRUTH.copy()
    image[20, 34] = image[20, 33]
    assert abs(float(TRUTH[20, 34, 0]) - float(image[20, 34, 0])) > 0.5
    assert evaluate("shift_px", image, SAMPLES).value < 1e-9


@pytest.mark.parametrize(
    "image",
    [
        TRUTH[:, ::-1],
        TRUTH[::-1],
        TRUTH[::-1, ::-1],
        np.zeros_like(TRUTH),
        np.random.default_rng(5).uniform(size=TRUTH.shape),
    ],
    ids=["mirrored", "flipped", "turned", "blank", "unrelated"],
)
def test_what_no_shift_aligns_reads_as_the_diagonal(image: Float64) -> None:
    estimate = evaluate("shift_px", image, SAMPLES)
    assert estimate.value == pytest.approx(DIAGONAL)
    assert "mirrored" in estimate.note


@pytest.mark.parametrize("slope", [0.0, 0.3], ids=["constant", "ramp"])
def test_a_truth_without_structure_is_refused(slope: float, exact: Exact) -> None:
    truth = 2.0 + slope * np.tile(np.arange(32.0), (32, 1))[..., None]
    with pytest.raises(ImageError, match="cannot tell a shift"):
        evaluate("shift_px", truth, exact(truth))


@pytest.mark.parametrize("moved", [0.0, 0.02, 0.3, 1.0])
def test_cards_that_are_flat_tell_a_shift_by_their_edges(moved: float, exact: Exact) -> None:
    """A turned square, each pixel the mean over 16 x 16 positions."""

    def card(moved: float) -> Float64:
        at = (np.arange(32 * 16) + 0.5) / 16
        y, x = np.meshgrid(at - 15, at - 17 - moved, indexing="ij")
        inside = np.maximum(np.abs(0.8 * x + 0.6 * y), np.abs(0.8 * y - 0.6 * x)) < 9
        pixels: Float64 = inside.reshape(32, 16, 32, 16).mean(axis=(1, 3))
        return pixels[..., None]

    estimate = evaluate("shift_px", card(moved), exact(card(0.0)))
    assert estimate.value == pytest.approx(moved, rel=0.1, abs=1e-9)


def test_a_subject_too_thin_to_align_is_refused() -> None:
    mask = np.zeros_like(MASK)
    mask[20:22] = True
    with pytest.raises(ImageError, match="render the subject larger"):
        evaluate("shift_px", TRUTH, Samples(TRUTH[None], mask))


def test_closed_forms_of_an_offset(exact: Exact) -> None:
    truth = np.full((10, 10, 1), 4.0)
    for metric, expected in [("rms", 0.2), ("p99_abs", 0.2), ("max_abs", 0.2), ("rel_rms", 0.05)]:
        estimate = evaluate(metric, truth - 0.2, exact(truth))
        assert estimate.low == estimate.value == estimate.high
        assert estimate.value == pytest.approx(expected)


def test_one_bad_pixel_in_a_thousand(exact: Exact) -> None:
    """It is the largest difference, no percentile sees it, and it adds 1 / sqrt(1000) to the rms."""
    truth = np.ones((50, 20, 1))
    image = truth.copy()
    image[3, 4] = 2.0
    samples = exact(truth)
    assert evaluate("max_abs", image, samples).value == 1.0
    assert evaluate("p99_abs", image, samples).value == 0.0
    assert evaluate("rms", image, samples).value == pytest.approx(1000**-0.5)


def test_a_relative_difference_from_nothing_is_refused(exact: Exact) -> None:
    with pytest.raises(ImageError, match="divides by the truth"):
        evaluate("rel_rms", np.ones((4, 4, 1)), exact(np.zeros((4, 4, 1))))


def turned(truth: Float64, degrees: float) -> Float64:
    """Vectors turned about z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.asarray(truth @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))


@given(degrees=st.floats(1e-6, 180), length=st.floats(1e-3, 1e3))
def test_the_angle_of_turned_vectors_whatever_their_length(degrees: float, length: float) -> None:
    truth = np.tile(np.array([0.6, -0.8, 0.0]), (4, 4, 1))
    samples = Samples(truth[None], np.ones((4, 4), dtype=bool))
    assert evaluate("p99_angle_deg", length * turned(truth, degrees), samples).value == pytest.approx(degrees, rel=1e-6)


def test_a_vector_without_length_is_half_a_turn_off(exact: Exact) -> None:
    truth = np.tile(np.array([0.0, 0.0, 1.0]), (4, 4, 1))
    assert evaluate("p99_angle_deg", np.zeros_like(truth), exact(truth)).value == pytest.approx(180)
    assert evaluate("p99_angle_deg", truth, exact(truth)).value == 0


def test_no_angle_to_what_has_no_direction(exact: Exact) -> None:
    with pytest.raises(ImageError, match="16 pixels without a direction"):
        evaluate("p99_angle_deg", np.ones((4, 4, 3)), exact(np.zeros((4, 4, 3))))
    with pytest.raises(ImageError, match="the truth has 1 channels"):
        evaluate("p99_angle_deg", np.ones((4, 4, 1)), exact(np.ones((4, 4, 1))))


@pytest.mark.parametrize("metric", ["shift_px", "rms", "rel_rms", "p99_abs", "p99_angle_deg", "max_abs", "off_by_1"])
def test_a_noisy_truth_is_refused(metric: str, noisy: Noisy) -> None:
    with pytest.raises(ImageError, match="takes the truth as exact"):
        evaluate(metric, TRUTH + 1.0, noisy(TRUTH + 1.0, 0.1))


@given(share=st.floats(0, 1), level=st.integers(0, 100))
def test_what_is_off_by_more_than_1_counts_once_however_far(share: float, level: int) -> None:
    """The vector counts, not its channels: (0.8, 0.8) is off by 1.13; (1, 0) is not off by more than 1."""
    truth = np.full((20, 10, 2), float(level))
    image = truth + np.array([1.0, 0.0])
    wild = np.arange(200) < round(200 * share)
    image.reshape(-1, 2)[wild] = level + np.where(np.arange(200) % 2, 0.8, 1e6)[wild, None]
    samples = Samples(truth[None], np.ones((20, 10), dtype=bool))
    assert evaluate("off_by_1", image, samples).value == pytest.approx(wild.mean())
