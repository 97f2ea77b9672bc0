"""The time that a run still needs."""

import statistics
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from comparisons.times import Times, Work

PRIOR_SECONDS = 20.0
"""A run starts as if so many seconds had gone as predicted: one quick check says little about the pace of the rest."""


@dataclass(frozen=True)
class Prediction:
    """Seconds of each check by its name, and the names of those for which that is only a guess."""

    seconds: dict[str, float]
    guessed: frozenset[str]


def predict(work: Mapping[str, Work], known: Times) -> Prediction | None:
    """What each check will take, from what checks took before; None if nothing is known of any.

    A check that was never timed for this work gets the median of those that were: of its technique if there are any,
    else of all for the same work, else of all.
    """
    seconds: dict[str, float] = {name: 0.0 for name, todo in work.items() if todo is Work.NOTHING}
    seconds |= {name: known[name][todo] for name, todo in work.items() if todo in known.get(name, ())}
    guessed = frozenset(work) - frozenset(seconds)
    samples: dict[tuple[str, ...], list[float]] = defaultdict(list)
    for name, times in known.items():
        for todo, taken in times.items():
            for group in _groups(name, todo):
                samples[group].append(taken)
    if guessed and not samples:
        return None
    medians = {group: statistics.median(taken) for group, taken in samples.items()}
    for name in guessed:
        seconds[name] = next(medians[group] for group in _groups(name, work[name]) if group in medians)
    return Prediction(seconds, guessed)


def _groups(name: str, work: str) -> tuple[tuple[str, ...], ...]:
    """What a check is alike to, the most alike first."""
    technique = name.partition("/")[2].partition("[")[0]
    return (technique, work), (work,), ()


def _by_scene(prediction: Prediction) -> dict[str, float]:
    scenes: dict[str, float] = defaultdict(float)
    for name, seconds in prediction.seconds.items():
        scenes[name.partition("/")[0]] += seconds
    return dict(scenes)


def seconds_left(scenes: Iterable[float], jobs: int, predicted: float, taken: float) -> float:
    """The time until the last of several processes is done.

    Parameters
    ----------
    scenes : predicted seconds of what is left of each scene; a scene is run by one process.
    predicted, taken : of the checks that are done.
    """
    left = [seconds for seconds in scenes if seconds > 0]
    pace = (PRIOR_SECONDS + taken) / (PRIOR_SECONDS + predicted)
    return pace * max(sum(left) / min(jobs, len(left)), max(left)) if left else 0.0


@dataclass(frozen=True)
class Estimate:
    """Seconds left when it was made, None if nothing is known, and those of them that wait for a check to end."""

    left: float | None
    waiting: float
    guessed: int

    def after(self, seconds: float) -> float | None:
        """The seconds left that much later."""
        return None if self.left is None else max(self.left - seconds, self.waiting)


def said(seconds: float | None, guessed: int) -> str:
    """The time left in words; `guessed` of the checks were never timed.

    >>> said(7, 0), said(43, 0), said(250, 12)
    ('a few seconds left', 'about 40 s left', 'about 4 min left (12 checks never timed)')
    >>> said(9000, 1), said(None, 3)
    ('about 2.5 h left (1 check never timed)', 'time left unknown (3 checks never timed)')
    """
    if seconds is None:
        text = "time left unknown"
    elif seconds < 10:
        text = "a few seconds left"
    elif seconds < 55:
        text = f"about {round(seconds, -1):.0f} s left"
    elif seconds < 90 * 60:
        text = f"about {max(seconds / 60, 1):.0f} min left"
    else:
        text = f"about {seconds / 3600:.1f} h left"
    return text + _never_timed(guessed)


def _never_timed(count: int) -> str:
    return f" ({count} check{'s' if count > 1 else ''} never timed)" if count else ""


class Countdown:
    """Follows a run, and says how long it will still take.

    After each check the rest is predicted anew. Until the next one that time runs down, though not below the share of
    those checks that no process can have begun.
    """

    def __init__(self, work: Mapping[str, Work], known: Times, jobs: int = 1) -> None:
        self._left = dict(work)
        self._known = {name: dict(times) for name, times in known.items()}
        self._jobs = jobs
        self._first = predict(work, known) or Prediction({}, frozenset(work))
        self._predicted = self._taken = 0.0
        self._begun: float | None = None
        self._estimate: Estimate | None = None
        self.measured: Times = {}

    def took(self, name: str, seconds: float) -> None:
        """A check has taken that time."""
        work = self._left.get(name, Work.NOTHING)
        todo = Work.JUDGE if work is Work.NOTHING else work  # what seemed to be finished had to be judged anew
        for times in (self._known, self.measured):
            times.setdefault(name, {})[todo] = seconds
        if work is not Work.NOTHING and name not in self._first.guessed:
            self._predicted += self._first.seconds[name]
            self._taken += seconds

    def finished(self, name: str, now: float) -> None:
        """A check is done, at the time `now` in seconds of any clock."""
        self._left.pop(name, None)
        self._estimate, self._begun = None, now

    def said(self, now: float) -> str:
        """The time left in words; nothing if there is nothing left to do."""
        if not self._left:
            return ""
        self._begun = now if self._begun is None else self._begun
        self._estimate = self._estimate or self._estimated()
        return said(self._estimate.after(now - self._begun), self._estimate.guessed)

    def scenes(self) -> dict[str, float]:
        """The seconds that were predicted for each scene when the run began; none if nothing was known."""
        return _by_scene(self._first)

    def _estimated(self) -> "Estimate":
        prediction = predict(self._left, self._known)
        if prediction is None:
            return Estimate(None, 0.0, len(self._left))
        left = seconds_left(_by_scene(prediction).values(), self._jobs, self._predicted, self._taken)
        begun = sum(sorted(prediction.seconds.values())[-self._jobs :])
        whole = sum(prediction.seconds.values())
        return Estimate(left, left * (1 - begun / whole) if whole else 0.0, len(prediction.guessed))
