from dataclasses import replace

import numpy as np
import pytest

from comparisons.clamping import clamp_note, removed_energy
from reference.estimator import Truth
from reference.quantity import Integrator

MASK = np.ones((8, 8), dtype=bool)


@pytest.fixture
def clamped() -> Truth:
    """Of 2 units of energy a pixel, 0.5 are removed, both with noise."""
    rng = np.random.default_rng(1)
    kept, removed = (level * rng.gamma(4.0, 0.25, size=(16, 8, 8, 3)).astype(np.float32) for level in (1.5, 0.5))
    return Truth("indirect_radiance", "key", kept, MASK, 64, 0.0, Integrator("fake", "a test"), removed)


def test_the_share_that_was_removed_lies_in_its_interval(clamped: Truth) -> None:
    share, low, high = removed_energy(clamped)
    assert low < 0.25 < high
    assert share == pytest.approx(0.25, abs=0.01)
    assert high - low < 0.02


def test_the_interval_covers_over_repetitions() -> None:
    """95 %, with 200 repetitions: 93 % or more in all but one of a thousand tests would be 90 % or more."""
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(200):
        kept, removed = (level * rng.gamma(1.0, 1.0, size=(16, 8, 8, 3)) for level in (1.5, 0.5))
        truth = Truth(
            "q", "k", kept.astype(np.float32), MASK, 16, 0.0, Integrator("f", "t"), removed.astype(np.float32)
        )
        _, low, high = removed_energy(truth)
        held += low <= 0.25 <= high
    assert 180 <= held <= 199


def test_a_clamped_truth_says_what_it_is(clamped: Truth) -> None:
    note = clamp_note(clamped, 20.0)
    assert note.startswith("The truth is clamped: no sample counts for more than 20. That removes 25.")
    assert "may be larger" not in note


def test_a_share_that_rests_on_few_paths_is_doubted(clamped: Truth) -> None:
    removed = np.zeros((16, 8, 8, 3), dtype=np.float32)
    removed[3, 2, 2] = 500.0
    assert "may be larger" in clamp_note(replace(clamped, removed=removed), 20.0)


def test_an_unclamped_truth_says_nothing(clamped: Truth) -> None:
    assert clamp_note(replace(clamped, removed=None), None) == ""
