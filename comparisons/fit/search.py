"""The settings with the least error, where an error takes a drawing and its slope is unknown.

The search has three steps. The corners of each axis, its middle and a Sobol sequence (Sobol, 1967, "On the distribution
of points in a cube and the approximate evaluation of integrals") look everywhere. From the best of these, COBYQA
(Ragonneau, 2022, "Model-based derivative-free optimization methods and software") follows quadratic models within
bounds; where there are many numbers, `comparisons.fit.least_squares` follows what each does to every pixel. Last, whole
numbers, over which such models are blind, are stepped up and down. Nothing is random: the same search finds the same
settings.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from comparisons.fit.least_squares import least_squares_from
from comparisons.fit.space import Axis, Choice, Part
from scenes.checks import SettingValue
from scenes.image import Float64

Settings = Mapping[str, SettingValue]
Objective = Callable[[Settings], float]
"""The error with some settings; infinite where there is none."""

PixelErrors = Callable[[Settings], Float64]
"""What each pixel is off with some settings: the sum of squares is the error, but for what is the same for all."""


@dataclass(frozen=True)
class Errors:
    """Of the same settings: their error, and what each pixel is off."""

    error: Objective
    pixel_errors: PixelErrors


Places = Sequence[float] | Float64
"""Coordinates from 0 to 1, one for each axis."""

Tried = dict[tuple[float, ...], float]

FIRST_RADIUS, LAST_RADIUS = 0.15, 1e-3
"""Of the trust region, in parts of each range: at the end, the third digit of a setting hardly moves."""

SCATTERED = 4
"""Points of the Sobol sequence for each axis, at least."""

NO_EFFECT = 1e-9
"""Of the error: what changes it by less has no effect."""

EVALUATIONS = 40
"""For each axis, if nobody says otherwise."""

MANY = 12
"""Axes above which COBYQA's model, with a number for each pair of axes, takes too long to learn."""


@dataclass(frozen=True)
class Found:
    settings: dict[str, SettingValue]
    error: float


def takes_many(parts: Sequence[Part]) -> bool:
    """Whether there are more than `MANY` axes."""
    return sum(isinstance(part, Axis) for part in parts) > MANY


def best_settings(fine: Errors, rough: Errors, parts: Sequence[Part], start: Settings, evaluations: int) -> Found:
    """The settings with the least error that `evaluations` drawings for each combination of choices find.

    Parameters
    ----------
    fine : of settings of all `parts`; asked twice for the same ones, the error should remember.
    rough : much the same, and quicker to have: asked where there are more than `MANY` axes.
    parts : at least one.
    start : settings of all parts, the first to be tried.
    """
    axes = [part for part in parts if isinstance(part, Axis)]
    choices = [part for part in parts if isinstance(part, Choice)]
    combinations = itertools.product(*(choice.values for choice in choices))
    names = [choice.name for choice in choices]
    found = [
        _among_numbers(fine, rough, axes, {**start, **dict(zip(names, values, strict=True))}, evaluations)
        for values in combinations
    ]
    return min(found, key=lambda f: f.error)


def without_effect(error: Objective, parts: Sequence[Part], start: Settings) -> list[Part]:
    """The parts that change nothing while all others stay at `start`."""
    level = error(start)

    def is_still(part: Part) -> bool:
        tried = part.values if isinstance(part, Choice) else [part.value(place) for place in (0.0, 0.5, 1.0)]
        errors = [error({**start, part.name: value}) for value in tried]
        return all(abs(e - level) <= NO_EFFECT * abs(level) for e in errors)

    return [part for part in parts if is_still(part)]


def _among_numbers(fine: Errors, rough: Errors, axes: Sequence[Axis], start: Settings, evaluations: int) -> Found:
    if not axes:
        return Found(dict(start), fine.error(start))
    search = Search(axes, start)
    if takes_many(axes):
        low = _by_pixels(search, fine, rough, evaluations)
    else:
        low = _by_error(search, fine.error, evaluations)
    at, _ = search.remembered(fine.error)
    best = _stepped(at, axes, low)
    given = Found(dict(start), fine.error(start))
    found = Found(search.settings(best), at(best))
    return found if found.error < given.error else given


@dataclass(frozen=True)
class Search:
    """Where one takes place: its axes, and the settings it starts from."""

    axes: Sequence[Axis]
    start: Settings

    def settings(self, places: Places) -> dict[str, SettingValue]:
        return {**self.start, **{axis.name: axis.value(float(p)) for axis, p in zip(self.axes, places, strict=True)}}

    def exact(self, places: Places) -> dict[str, SettingValue]:
        """As `settings`, with all digits."""
        return {**self.start, **{axis.name: axis.exact(float(p)) for axis, p in zip(self.axes, places, strict=True)}}

    def scattered(self) -> Iterator[list[float]]:
        return _scattered([axis.place(float(self.start[axis.name])) for axis in self.axes])

    def remembered(self, error: Objective) -> tuple[Callable[[Places], float], Tried]:
        """The error at some places, and what was tried so far: nothing is tried twice."""
        tried: Tried = {}

        def at(places: Places) -> float:
            settings = self.settings(places)
            key = tuple(float(settings[axis.name]) for axis in self.axes)
            if key not in tried:
                tried[key] = error(settings)
            return tried[key]

        return at, tried


def _by_error(search: Search, error: Objective, evaluations: int) -> Places:
    at, tried = search.remembered(error)
    seen = min(search.scattered(), key=at)
    return _descended(at, seen, evaluations - len(tried))


def _by_pixels(search: Search, fine: Errors, rough: Errors, evaluations: int) -> Places:
    at, tried = search.remembered(rough.error)
    return least_squares_from(
        sorted(search.scattered(), key=at),
        lambda places: rough.pixel_errors(search.exact(places)),
        lambda places: fine.pixel_errors(search.exact(places)),
        evaluations - len(tried),
    )


def _scattered(origin: Sequence[float]) -> Iterator[list[float]]:
    """Where to look first: the origin, the ends and the middle along each axis, and evenly all over."""
    from scipy.stats.qmc import Sobol

    count = len(origin)
    yield list(origin)
    for index in range(count):
        for place in (0.0, 0.5, 1.0):
            yield [place if i == index else p for i, p in enumerate(origin)]
    yield from Sobol(count, scramble=False).random_base2(math.ceil(math.log2(SCATTERED * count))).tolist()


def _descended(at: Callable[[Places], float], start: Places, evaluations: int) -> Places:
    """Downhill from `start`, as far as the evaluations last."""
    from scipy.optimize import minimize

    if evaluations < 2 * len(start) + 2:  # what the first model takes
        return start
    unit = at(start) or 1.0
    found = minimize(
        lambda places: at(places) / unit,
        start,
        method="COBYQA",
        bounds=[(0.0, 1.0)] * len(start),
        options={"maxfev": evaluations, "initial_tr_radius": FIRST_RADIUS, "final_tr_radius": LAST_RADIUS},
    )
    return found.x if at(found.x) < at(start) else start


def _stepped(at: Callable[[Places], float], axes: Sequence[Axis], start: Places) -> Places:
    """One up and one down of each whole number, until nothing is better."""
    best = start
    while True:
        nearest = min(_neighbours(axes, best), key=at, default=best)
        if at(nearest) >= at(best):
            return best
        best = nearest


def _neighbours(axes: Sequence[Axis], places: Places) -> Iterator[list[float]]:
    for index, axis in enumerate(axes):
        if axis.is_whole:
            for step in (-1, 1):
                moved = axis.place(axis.value(places[index]) + step)
                yield [moved if i == index else float(p) for i, p in enumerate(places)]
