"""The error near the outline of a subject, on disks and squares."""

from collections.abc import Callable

import numpy as np
import pytest

from comparisons.metrics import Samples, evaluate
from comparisons.metrics.limb_nrmse import limb
from scenes.errors import ImageError
from scenes.image import Bool, Float64

Noisy = Callable[[Float64, float], Samples]

Y, X = np.mgrid[:96, :96] + 0.5 - 48.0
RADIUS = 40.0
DISK: Bool = np.hypot(X, Y) <= RADIUS


def test_the_limb_of_a_disk_is_the_ring_of_a_tenth_of_its_radius() -> None:
    ring = limb(DISK)
    r = np.hypot(X, Y)
    assert (ring <= DISK).all()
    assert ring[DISK & (r > 0.9 * RADIUS + 1)].all()
    assert not ring[r < 0.9 * RADIUS - 1].any()
    assert ring.sum() == pytest.approx(np.pi * RADIUS**2 * (1 - 0.9**2), rel=0.1)


def test_it_grows_with_the_picture_and_never_vanishes() -> None:
    small = np.zeros((9, 9), dtype=bool)
    small[2:7, 2:7] = True
    np.testing.assert_array_equal(limb(small), small & ~np.pad(np.ones((3, 3), dtype=bool), 3))
    large = np.kron(DISK, np.ones((4, 4), dtype=bool))
    assert limb(large).sum() == pytest.approx(16 * limb(DISK).sum(), rel=0.1)


def test_what_the_border_cuts_off_is_outline() -> None:
    everywhere = np.ones((40, 60), dtype=bool)
    ring = limb(everywhere)
    assert ring[0].all()
    assert ring[:, -1].all()
    assert not ring[10:-10, 10:-10].any()


def test_errors_away_from_the_limb_do_not_count() -> None:
    """On the ring the truth is 2 and the image 2.5: 25 %, whatever lies within."""
    truth = np.where(limb(DISK), 2.0, 100.0)[..., None]
    image = np.where(limb(DISK), 2.5, -7.0)[..., None]
    assert evaluate("limb_nrmse", image, Samples(truth[None], DISK)).value == pytest.approx(0.25)


def test_noise_of_the_truth_is_taken_out(noisy: Noisy) -> None:
    truth = np.full((96, 96, 3), 1.0)
    estimate = evaluate("limb_nrmse", 1.1 * truth, noisy(truth, 0.3))
    assert estimate.low < 0.1 < estimate.high
    assert estimate.high - estimate.low < 0.02


def test_a_black_limb_is_refused() -> None:
    truth = np.where(limb(DISK), 0.0, 1.0)[..., None]
    with pytest.raises(ImageError, match="divides by the mean of the truth"):
        evaluate("limb_nrmse", truth, Samples(truth[None], DISK))
