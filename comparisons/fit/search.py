"""The settings with the least error, where an error takes a drawing and its slope is unknown.

The search has three steps. The corners of each axis, its middle and a Sobol sequence (Sobol, 1967, "On the distribution
of points in a cube and the approximate evaluation of integrals") look everywhere. From the best of these, COBYQA
(Ragonneau, 2022, "Model-based derivative-free optimization methods and software") follows quadratic models within
bounds. Last, whole numbers, over which such a model is blind, are stepped up and down. Nothing is random: the same
search finds the same settings.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from comparisons.fit.space import Axis, Choice, Part
from scenes.checks import SettingValue
from scenes.image import Float64

Settings = Mapping[str, SettingValue]
Objective = Callable[[Settings], float]
"""The error with some settings; infinite where there is none."""

Places = Sequence[float] | Float64
"""Coordinates from 0 to 1, one for each axis."""

FIRST_RADIUS, LAST_RADIUS = 0.15, 1e-3
"""Of the trust region, in parts of each range: at the end, the third digit of a setting hardly moves."""

SCATTERED = 4
"""Points of the Sobol sequence for each axis, at least."""

NO_EFFECT = 1e-9
"""Of the error: what changes it by less has no effect."""

EVALUATIONS = 40
"""For each axis, if nobody says otherwise."""


@dataclass(frozen=True)
class Found:
    settings: dict[str, SettingValue]
    error: float


def best_settings(error: Objective, parts: Sequence[Part], start: Settings, evaluations: int) -> Found:
    """The settings with the least error that `evaluations` drawings for each combination of choices find.

    Parameters
    ----------
    error : of settings of all `parts`; asked twice for the same ones, it should remember.
    parts : at least one.
    start : settings of all parts, the first to be tried.
    """
    axes = [part for part in parts if isinstance(part, Axis)]
    choices = [part for part in parts if isinstance(part, Choice)]
    combinations = itertools.product(*(choice.values for choice in choices))
    names = [choice.name for choice in choices]
    found = [
        _among_numbers(error, axes, {**start, **dict(zip(names, values, strict=True))}, evaluations)
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


def _among_numbers(error: Objective, axes: Sequence[Axis], start: Settings, evaluations: int) -> Found:
    if not axes:
        return Found(dict(start), error(start))
    tried: dict[tuple[float, ...], float] = {}

    def at(places: Places) -> float:
        settings = _settings(axes, start, places)
        key = tuple(float(settings[axis.name]) for axis in axes)
        if key not in tried:
            tried[key] = error(settings)
        return tried[key]

    origin = [axis.place(float(start[axis.name])) for axis in axes]
    seen = min(_scattered(origin), key=at)
    best = _stepped(at, axes, _descended(at, seen, evaluations - len(tried)))
    given = Found(dict(start), error(start))
    found = Found(_settings(axes, start, best), at(best))
    return found if found.error < given.error else given


def _settings(axes: Sequence[Axis], start: Settings, places: Places) -> dict[str, SettingValue]:
    return {**start, **{axis.name: axis.value(float(p)) for axis, p in zip(axes, places, strict=True)}}


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
