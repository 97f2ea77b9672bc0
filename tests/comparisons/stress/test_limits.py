"""A break is news unless it is documented; a limit that no longer holds is news too."""

import pytest

from comparisons.stress.limits import Limit, Standing, documented, is_broken, standing, with_limit
from comparisons.stress.result import Outcome, Trial


def outcome(
    *passed: float, failing: float | None = None, limit: float | None = None, is_rising: bool = True, unfit: str = ""
) -> Outcome:
    trials = [Trial(magnitude, 0.0) for magnitude in passed]
    trials += [] if failing is None else [Trial(failing, 1.0)]
    return Outcome(
        "indirect.talk", "offset", "rms", 0.1, tuple(trials), failing, "", limit, "", is_rising=is_rising, unfit=unfit
    )


STANDINGS = {
    "nothing fails": (outcome(1, 10, 100), Standing.HOLDS),
    "nobody knew": (outcome(1, failing=10), Standing.BROKEN),
    "as documented": (outcome(1, failing=10, limit=10), Standing.KNOWN),
    "earlier than documented": (outcome(1, failing=10, limit=100), Standing.BROKEN),
    "later than documented": (outcome(1, 10, failing=100, limit=10), Standing.STALE),
    "it holds by now": (outcome(1, 10, 100, limit=10), Standing.STALE),
    "falling, as documented": (outcome(0.1, failing=0.01, limit=0.01, is_rising=False), Standing.KNOWN),
    "falling, earlier": (outcome(failing=0.1, limit=0.01, is_rising=False), Standing.BROKEN),
    "falling, it holds": (outcome(0.1, 0.01, limit=0.01, is_rising=False), Standing.STALE),
    "one magnitude, beyond the limit": (outcome(failing=1e6, limit=10), Standing.KNOWN),
    "one magnitude beyond the limit holds, as it may": (outcome(1000, limit=10), Standing.HOLDS),
    "one magnitude, before the limit": (outcome(1, limit=10), Standing.HOLDS),
    "not for this one": (outcome(unfit="the camera is a pinhole"), Standing.UNFIT),
    "refused further on": (outcome(1, 10, unfit="refused at 100"), Standing.HOLDS),
}


@pytest.mark.parametrize(("found", "expected"), STANDINGS.values(), ids=STANDINGS.keys())
def test_how_an_outcome_stands_to_its_limit(found: Outcome, expected: Standing) -> None:
    assert standing(found) is expected


def test_only_what_is_not_documented_is_broken() -> None:
    assert is_broken([outcome(1), outcome(1, failing=10)])
    assert not is_broken([outcome(1), outcome(1, failing=10, limit=10), outcome(1, 10, limit=10)])


def test_a_limit_is_attached_by_subject_and_stress() -> None:
    limits = {("indirect.talk", "offset"): Limit(10, "half floats"), ("indirect.talk", "bright"): Limit(1, "other")}
    found = with_limit(outcome(1, failing=10), limits)
    assert (found.limit, found.why) == (10, "half floats")
    assert with_limit(outcome(1, failing=10), {}).limit is None


def test_limits_name_subjects_and_stresses_that_exist() -> None:
    from comparisons.stress import functions, intermediates, techniques

    known = {
        (subject, stress)
        for module in (functions, intermediates, techniques)
        for subject in module.subjects()
        for stress in module.STRESSES
    }
    assert documented().keys() <= known
    assert all(limit.why.endswith(".") for limit in documented().values())


def test_limits_begin_at_magnitudes_that_are_tried() -> None:
    """You should be told of every limit that no longer holds."""
    from comparisons.stress import functions, intermediates, techniques

    for (subject, stress), limit in documented().items():
        modules = [
            m for m in (functions, intermediates, techniques) if subject in m.subjects() and stress in m.STRESSES
        ]
        assert all(limit.magnitude in module.magnitudes(stress) for module in modules), (subject, stress)
