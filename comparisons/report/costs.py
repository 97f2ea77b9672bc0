"""What an error costs in time: for each effect, its checks as points over logarithmic axes."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from comparisons.report.check import CheckView
from comparisons.report.criterion import is_noise_removed
from comparisons.report.numbers import format_interval, format_metric, format_seconds, is_share
from comparisons.report.plot import MOST_SERIES, Point, Series, loglog_plot

LEAST_POINTS = 2


@dataclass(frozen=True)
class CostPlot:
    """The time of each check of an effect against its error by one metric; `others` have been left out.

    `has_truth` tells whether path tracing stands in it too.
    """

    effect: str
    metric: str
    svg: str
    points: int
    others: int
    has_truth: bool


def costs_of(views: Iterable[CheckView], effects: Sequence[str]) -> tuple[CostPlot, ...]:
    """A plot for each effect with at least `LEAST_POINTS` checks that were timed and measured by one metric."""
    found = list(views)
    plots = (_plot(effect, [view for view in found if view.effect == effect]) for effect in effects)
    return tuple(plot for plot in plots if plot is not None)


def _plot(effect: str, views: Sequence[CheckView]) -> CostPlot | None:
    timed = [view for view in views if _seconds(view, "realtime")]
    metric = _common_metric(timed)
    shown = [(view, criterion) for view in timed if (criterion := _measured(view, metric)) is not None]
    if len(shown) < LEAST_POINTS or not any(_error(criterion)[0] > 0 for _, criterion in shown):
        return None
    points: dict[str, list[Point]] = {}
    for view, criterion in shown:
        points.setdefault(view.raw["technique"], []).append(_point(view, criterion))
    techniques = sorted(points)[:MOST_SERIES]
    truth = [point for view, criterion in shown for point in _truth_point(view, criterion)]
    series = [Series(name, points[name], is_joined=False) for name in techniques]
    if truth:
        series.insert(0, Series("path tracing", truth, is_joined=False, is_muted=True))
    drawn = sum(len(points[name]) for name in techniques)
    unit = "%" if is_share(metric) else ""
    title = f"{effect[:1].upper()}{effect[1:]}"
    label = f"{metric} [{unit}]" if unit else metric
    svg = loglog_plot(title, "time", label, series, x_text=lambda seconds: format_seconds(seconds, trim=True))
    return CostPlot(effect, metric, svg, drawn, len(views) - drawn, bool(truth))


def _common_metric(views: Iterable[CheckView]) -> str:
    """The metric that most checks are measured by; of equals, the one that more of them name first."""
    carried: Counter[str] = Counter()
    first: Counter[str] = Counter()
    for view in views:
        metrics = [criterion["metric"] for criterion in view.raw.get("criteria") or []]
        carried.update(set(metrics))
        first.update(metrics[:1])
    return max(sorted(carried), key=lambda metric: (carried[metric], first[metric]), default="")


def _measured(view: CheckView, metric: str) -> dict[str, Any] | None:
    criteria: Iterable[dict[str, Any]] = view.raw.get("criteria") or []
    return next((c for c in criteria if c["metric"] == metric and c.get("value") is not None), None)


def _point(view: CheckView, criterion: dict[str, Any]) -> Point:
    value, low, high = _error(criterion)
    metric, seconds = criterion["metric"], _seconds(view, "realtime")
    name = f"{view.raw['scene']}, {view.raw['technique']}{f' ({view.how})' if view.how else ''}"
    error = f"{format_metric(metric, criterion['value'], view.raw.get('unit') or '')} {_interval(criterion)}".strip()
    title = f"{name}: {metric} {error} in {format_seconds(seconds)}"
    return Point(seconds, value, low if high > low else None, high if high > low else None, title, view.address)


def _truth_point(view: CheckView, criterion: dict[str, Any]) -> Iterable[Point]:
    """Path tracing at the samples of this check: its noise, by the same metric, for its time."""
    metric, floor, seconds = criterion["metric"], criterion.get("floor"), _seconds(view, "reference")
    if view.raw.get("spp") and floor and seconds and is_noise_removed(metric):
        noise = format_metric(metric, floor)
        title = (
            f"{view.raw['scene']}, path tracing at {view.raw['spp']} spp: {metric} {noise} in {format_seconds(seconds)}"
        )
        yield Point(seconds, floor * _scale(metric), title=title, address=view.address)


def _error(criterion: dict[str, Any]) -> tuple[float, float, float]:
    """The distance from 0 and its interval, as the axis counts it."""
    from comparisons.baseline import error_of  # which itself writes numbers as the report does

    value = criterion["value"]
    low, high = (value if criterion.get(end) is None else criterion[end] for end in ("low", "high"))
    error, least, most = (size * _scale(criterion["metric"]) for size in error_of((value, low, high)))
    return error, least, most


def _interval(criterion: dict[str, Any]) -> str:
    return format_interval(criterion["metric"], criterion.get("low"), criterion.get("high"))


def _scale(metric: str) -> float:
    return 100.0 if is_share(metric) else 1.0


def _seconds(view: CheckView, side: str) -> float:
    return float((view.raw.get("seconds") or {}).get(side) or 0.0)
