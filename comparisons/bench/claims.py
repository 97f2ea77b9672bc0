"""What a millisecond buys, in words: each technique against a path tracer that is to reach the same error."""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from comparisons.bench.pareto import group_of, on_front
from comparisons.bench.result import Interval, Point, Slope, Traced
from comparisons.report.numbers import format_count, format_interval, format_metric, format_number, format_seconds
from comparisons.result import check_id


@dataclass(frozen=True)
class Needed:
    """What the path tracer needs for some error; `is_measured` unless that is beyond all images that were rendered."""

    spp: float
    seconds: float
    is_measured: bool


def claims(points: Sequence[Point], traced: Sequence[Traced], slopes: Sequence[Slope]) -> tuple[str, ...]:
    """Sentences for each technique at its defaults, and for both ends of the front, wherever paths were traced beside.

    The ends are the quickest point and the most exact one.
    """
    chosen = _chosen(points)
    return tuple(
        claim(point, rivals, _slope(point, slopes))
        for index, point in enumerate(points)
        if index in chosen and (rivals := _rivals(point, traced))
    )


def _chosen(points: Sequence[Point]) -> set[int]:
    """Indices of the points that a sentence is about."""
    chosen = {index for index, point in enumerate(points) if not point.swept}
    fronts: dict[Any, list[int]] = defaultdict(list)
    for index, is_best in enumerate(on_front(points)):
        if is_best:
            fronts[group_of(points[index])].append(index)
    for front in fronts.values():
        chosen.add(min(front, key=lambda index: points[index].cost.seconds.value))
        chosen.add(min(front, key=lambda index: points[index].error.value))
    return chosen


def _rivals(point: Point, traced: Sequence[Traced]) -> list[Traced]:
    """The path tracer's images of the same thing, by their samples."""
    same = [t for t in traced if (t.scene, t.quantity, t.metric, t.width, t.height) == group_of(point)]
    return sorted(same, key=lambda t: t.spp)


def _slope(point: Point, slopes: Sequence[Slope]) -> Slope | None:
    return next((s for s in slopes if (s.scene, s.quantity, s.metric, s.width, s.height) == group_of(point)), None)


def claim(point: Point, traced: Sequence[Traced], slope: Slope | None) -> str:
    """What a technique reaches in which time, and what the path tracer needs for that; `traced` by rising spp."""
    name = check_id(point.technique, dict(point.settings), point.is_fitted)
    error = f"{format_metric(point.metric, point.error.value)}{_within(point.metric, point.error)}"
    reaches = f"{point.scene}: {name} reaches {point.metric} {error} in {format_seconds(point.cost.seconds.value)}"
    return f"{reaches}; {_against(point, traced, slope)}."


def _within(metric: str, error: Interval) -> str:
    return "" if error.low == error.high else f" {format_interval(metric, error.low, error.high)}"


def _against(point: Point, traced: Sequence[Traced], slope: Slope | None) -> str:
    """What the path tracer has to say to a point."""
    first, own = traced[0], point.cost.seconds
    if first.spp == 0:
        return f"the exact image, by {first.integrator}, takes {_ratio_in_words(first.seconds, own)}"
    if point.error.value >= first.error.value:
        better = f"path tracing with {first.spp} spp is better ({format_metric(point.metric, first.error.value)})"
        if first.seconds.value <= own.value:
            return f"{better} and quicker ({format_seconds(first.seconds.value)})"
        return f"{better}, and takes {_ratio_in_words(first.seconds, own)}"
    if point.error.value <= 0:
        return "no number of samples makes path tracing as good"
    needed = needed_for(point.error.value, traced, slope)
    spp = f"{format_count(max(1, round(needed.spp)))} spp{'' if needed.is_measured else ', by its slope'}"
    return f"the path tracer needs {_ratio_in_words(time_needed(point.error, traced, slope), own, f' ({spp})')}"


def time_needed(error: Interval, traced: Sequence[Traced], slope: Slope | None) -> Interval:
    """Seconds that the path tracer needs for an error less than that of its first image, `traced` by rising spp.

    The interval is that of the time for the greatest error in its interval, by a path tracer at its quickest and best,
    to that for the least one, at its slowest and worst: infinite if that is 0, or if no samples may suffice.
    """
    quickest = [replace(t, seconds=_only(t.seconds.low), error=_only(t.error.low or t.error.value)) for t in traced]
    slowest = [replace(t, seconds=_only(t.seconds.high), error=_only(t.error.high)) for t in traced]
    steep, flat = slope, slope
    if slope is not None:
        steep = replace(slope, exponent=_only(slope.exponent.low))
        flat = replace(slope, exponent=_only(slope.exponent.high))
    low = needed_for(min(error.high, quickest[0].error.value), quickest, steep).seconds
    high = math.inf
    if error.low > 0:
        worst = needed_for(min(error.low, slowest[0].error.value), slowest, flat)
        if worst.is_measured or flat is None or flat.exponent.value < 0:
            high = worst.seconds
    return Interval(needed_for(error.value, traced, slope).seconds, low, high)


def _only(value: float) -> Interval:
    return Interval(value, value, value)


def _ratio_in_words(rival: Interval, own: Interval, aside: str = "") -> str:
    """Seconds of the path tracer, and how often a frame of the technique fits into them, with an interval."""
    ratio = Interval(rival.value / own.value, rival.low / own.high, rival.high / own.low)
    time = f"{format_seconds(rival.value)}{aside}"
    if ratio.low <= 1 <= ratio.high:
        return f"{time}: as long, as far as can be told ({_numbers(ratio)} times)"
    if ratio.value < 1:
        return f"{time}: {_numbers(Interval(1 / ratio.value, 1 / ratio.high, 1 / ratio.low))} times less"
    return f"{time}: {_numbers(ratio)} times as long"


def _numbers(found: Interval) -> str:
    return f"{format_number(found.value)} [{format_number(found.low)}, {format_number(found.high)}]"


def needed_for(error: float, traced: Sequence[Traced], slope: Slope | None) -> Needed:
    """What the path tracer needs for an error that is no greater than that of its first image.

    Between its images both error and time are interpolated as powers of the samples. Beyond the last one the error
    falls by the fitted slope, and the time grows in proportion.
    """
    usable = [t for t in traced if t.error.value > 0]
    errors = np.log([t.error.value for t in usable])
    spp = np.log([t.spp for t in usable])
    seconds = np.log([t.seconds.value for t in usable])
    falling = np.minimum.accumulate(errors)
    wanted = np.log(error)
    if wanted >= falling[-1]:
        at = float(np.interp(-wanted, -falling, spp))
        return Needed(float(np.exp(at)), float(np.exp(np.interp(at, spp, seconds))), True)
    exponent = slope.exponent.value if slope is not None and slope.exponent.value < 0 else -0.5
    growth = float(np.exp((wanted - falling[-1]) / exponent))
    return Needed(usable[-1].spp * growth, usable[-1].seconds.value * growth, False)
