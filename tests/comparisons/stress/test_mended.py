"""What once broke under stress, and was mended."""

import pytest

from comparisons.stress.stresses import STRESSES
from comparisons.stress.techniques import outcome, subject_of

MENDED = {
    "raster.depth": ("offset", 1e6),
    "shadow.soft": ("far-card", 1e7),
    "indirect.talk": ("small-light", 1e-3),
    "indirect.probe": ("small-light", 1e-6),
}


@pytest.mark.usefixtures("gl")
@pytest.mark.parametrize("technique", MENDED)
def test_it_holds_now(technique: str) -> None:
    stress, magnitude = MENDED[technique]
    found = outcome(subject_of(technique), stress, STRESSES[stress], magnitude)
    assert [trial.magnitude for trial in found.trials] == [magnitude]
    assert found.first_failing is None, found
