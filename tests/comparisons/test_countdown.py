"""The time that a run still needs, from what its checks took before."""

import itertools
import random

import pytest

from comparisons.countdown import PRIOR_SECONDS, Countdown, predict, seconds_left
from comparisons.times import Times, Work

RENDER, JUDGE, NOTHING = Work.RENDER_AND_JUDGE, Work.JUDGE, Work.NOTHING


def test_a_check_is_predicted_to_take_what_it_took_for_the_same_work() -> None:
    known: Times = {"room/talk": {RENDER: 30.0, JUDGE: 2.0}}
    for work, seconds in ((RENDER, 30.0), (JUDGE, 2.0), (NOTHING, 0.0)):
        found = predict({"room/talk": work}, known)
        assert found is not None
        assert found.seconds == {"room/talk": seconds}
        assert not found.guessed


@pytest.mark.parametrize(
    ("known", "guess"),
    [
        ({"a/talk": {RENDER: 30.0}, "b/talk[x=1]": {RENDER: 50.0}, "c/probe": {RENDER: 1.0}}, 40.0),
        ({"a/soft": {RENDER: 30.0}, "b/soft": {RENDER: 50.0}, "c/probe": {RENDER: 1.0}}, 30.0),
        ({"a/talk": {JUDGE: 3.0}, "b/soft": {RENDER: 50.0}}, 50.0),
        ({"a/soft": {JUDGE: 3.0}, "b/talk": {JUDGE: 5.0}}, 4.0),
    ],
)
def test_a_check_that_was_never_timed_gets_the_median_of_those_that_are_most_alike(known: Times, guess: float) -> None:
    found = predict({"new/talk": RENDER}, known)
    assert found is not None
    assert found.seconds == {"new/talk": guess}
    assert found.guessed == {"new/talk"}


def test_nothing_is_predicted_from_nothing() -> None:
    assert predict({"room/talk": RENDER}, {}) is None
    assert predict({"room/talk": NOTHING}, {}) is not None


@pytest.mark.parametrize(
    ("scenes", "jobs", "seconds"),
    [
        ([], 2, 0.0),
        ([0.0, 0.0], 2, 0.0),
        ([10.0, 20.0, 30.0], 1, 60.0),
        ([10.0, 20.0, 30.0], 2, 30.0),
        ([10.0, 20.0, 90.0], 2, 90.0),  # one process does the longest scene alone
        ([10.0, 20.0, 30.0], 8, 30.0),
        ([40.0], 8, 40.0),
    ],
)
def test_processes_share_the_scenes_that_are_left(scenes: list[float], jobs: int, seconds: float) -> None:
    assert seconds_left(scenes, jobs, predicted=0.0, taken=0.0) == pytest.approx(seconds)


def test_the_rest_goes_on_at_the_pace_of_what_is_done() -> None:
    assert seconds_left([100.0], 1, predicted=1e6, taken=2e6) == pytest.approx(200.0, rel=1e-3)
    assert seconds_left([100.0], 1, predicted=0.0, taken=PRIOR_SECONDS) == pytest.approx(200.0)
    assert seconds_left([100.0], 1, predicted=0.1, taken=0.3) < 102.0, "a first quick check says little"


def test_a_countdown_runs_down_but_not_below_what_nobody_can_have_begun() -> None:
    names = ("a/talk", "a/probe", "b/talk")
    countdown = Countdown(dict.fromkeys(names, RENDER), {name: {RENDER: 600.0} for name in names})
    assert countdown.said(100.0) == "about 30 min left"
    assert countdown.said(400.0) == "about 25 min left"
    assert countdown.said(5000.0) == "about 20 min left"
    countdown.took("a/talk", 600.0)
    countdown.finished("a/talk", 5001.0)
    assert countdown.said(5001.0) == "about 20 min left"


def test_checks_that_are_finished_in_the_store_take_no_time() -> None:
    work = {"a/talk": NOTHING, "b/talk": RENDER}
    countdown = Countdown(work, {"a/talk": {RENDER: 9000.0}, "b/talk": {RENDER: 30.0}})
    assert countdown.said(0.0) == "about 30 s left"
    assert countdown.scenes() == {"a": 0.0, "b": 30.0}
    countdown.finished("a/talk", 1.0)
    assert countdown.said(1.0) == "about 30 s left"
    assert countdown.measured == {}


def test_what_was_never_timed_is_counted_and_learnt_from() -> None:
    countdown = Countdown({"a/talk": RENDER, "b/talk": RENDER, "c/soft": RENDER}, {})
    assert countdown.said(0.0) == "time left unknown (3 checks never timed)"
    countdown.took("a/talk", 120.0)
    countdown.finished("a/talk", 120.0)
    assert countdown.said(120.0) == "about 4 min left (2 checks never timed)"
    assert countdown.measured == {"a/talk": {RENDER: 120.0}}


def test_what_seemed_to_be_finished_but_was_judged_anew_is_learnt_as_judged() -> None:
    countdown = Countdown({"a/talk": NOTHING}, {})
    countdown.took("a/talk", 3.0)
    assert countdown.measured == {"a/talk": {JUDGE: 3.0}}


def test_at_the_end_nothing_is_said() -> None:
    countdown = Countdown({"a/talk": RENDER}, {})
    countdown.finished("a/talk", 1.0)
    assert countdown.said(1.0) == ""
    assert Countdown({}, {}).said(0.0) == ""


@pytest.mark.parametrize("jobs", [1, 3])
def test_the_estimate_of_a_steady_run_never_rises_by_much_and_is_right_half_way(jobs: int) -> None:
    """Scenes of several checks, each as long as remembered up to 20 %, on a machine that is slower by a half."""
    dice = random.Random(1)
    known: Times = {f"{scene}/{check}": {RENDER: dice.uniform(5.0, 60.0)} for scene in range(30) for check in range(5)}
    taken = {name: 1.5 * times[RENDER] * dice.uniform(0.8, 1.2) for name, times in known.items()}
    countdown = Countdown(dict.fromkeys(known, RENDER), known, jobs)
    free = [0.0] * jobs
    ends: list[tuple[float, str]] = []
    for _, checks in itertools.groupby(known, lambda name: name.partition("/")[0]):
        process = free.index(min(free))
        for name in checks:
            free[process] += taken[name]
            ends.append((free[process], name))
    estimates = []
    for now, name in sorted(ends):
        countdown.took(name, taken[name])
        countdown.finished(name, now)
        if countdown.said(now):
            assert countdown._estimate is not None
            left = countdown._estimate.left
            assert left is not None
            estimates.append((now, left))
    end = max(free)
    assert all(left > 0 for _, left in estimates)
    middle = [left / (end - now) for now, left in estimates if 0.3 * end < now < 0.7 * end]
    assert len(middle) > 10
    assert all(0.75 < ratio < 1.25 for ratio in middle)
    rises = [after - before for (_, before), (_, after) in itertools.pairwise(estimates[10:])]
    assert max(rises) < 0.05 * end
