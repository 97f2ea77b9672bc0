import numpy as np
import pytest

from comparisons.tonemap import MEAN_VALUE, exposure_for, to_display
from scenes import srgb
from scenes.errors import ImageError

ALL = np.ones((8, 8), dtype=bool)


def test_a_uniform_truth_is_shown_as_a_grey_card() -> None:
    truth = np.full((8, 8, 3), 37.0)
    shown = to_display(truth, exposure_for(truth, ALL))
    np.testing.assert_allclose(srgb.decode(shown), MEAN_VALUE, rtol=1e-6)


def test_exposure_undoes_a_change_of_scale() -> None:
    truth = np.random.default_rng(0).uniform(size=(8, 8, 3))
    assert exposure_for(1000 * truth, ALL) == pytest.approx(exposure_for(truth, ALL) / 1000)


def test_a_saturated_colour_is_not_clipped() -> None:
    truth = np.tile([5.0, 0.1, 0.1], (8, 8, 1))
    assert to_display(truth, exposure_for(truth, ALL)).max() < 1.0


def test_pixels_outside_the_mask_do_not_count() -> None:
    truth = np.ones((8, 8, 3))
    truth[0] = 1e6
    mask = ALL.copy()
    mask[0] = False
    assert exposure_for(truth, mask) == MEAN_VALUE


@pytest.mark.parametrize(
    ("value", "mask", "message"),
    [(0.0, ALL, "must be positive"), (np.nan, ALL, "must be positive"), (1.0, ~ALL, "mask is empty")],
)
def test_what_cannot_be_exposed_is_refused(value: float, mask: np.ndarray, message: str) -> None:
    with pytest.raises(ImageError, match=message):
        exposure_for(np.full((8, 8, 3), value), mask)
