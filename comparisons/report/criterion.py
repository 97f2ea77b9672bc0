"""A criterion in words, and its error as a bar against its budget."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from comparisons.metrics import METRICS
from comparisons.report.numbers import (
    format_bound,
    format_interval,
    format_metric,
    format_number,
    format_percent,
)

BAR_LENGTH = 96
BAR_BUDGET = 64


@dataclass(frozen=True)
class Bar:
    """An error against its budget, in the units of the drawing; the budget stands at `BAR_BUDGET`."""

    value: float
    low: float
    high: float
    label: str
    overflow: str


@dataclass(frozen=True)
class CriterionView:
    """One criterion in words; `use` is the share of the budget that the error takes, above 1 when it exceeds it.

    `accepted` is what was last accepted, `change` the factor from there to the error now; empty and None where there is
    none. `floor` is what the noise of the truth reads by itself; empty where it is removed or cannot add. `renderer`
    names the OpenGL renderer that the bounds are written for, empty if they are for all.
    """

    metric: str
    value: str
    interval: str
    accepted: str
    change: float | None
    floor: str
    bound: str
    verdict: str
    reason: str
    note: str
    place: str
    renderer: str
    use: float | None
    bar: Bar | None


def criterion_of(raw: Mapping[str, Any], unit: str, accepted: Mapping[str, Any]) -> CriterionView:
    """A criterion of results.json in words.

    Parameters
    ----------
    unit : that of the quantity
    accepted : what was last accepted for the check, or {}
    """
    metric, low, high = raw["metric"], raw.get("min"), raw.get("max")
    before = _accepted_value(metric, accepted)
    return CriterionView(
        metric=metric,
        value=format_metric(metric, raw.get("value"), unit),
        interval=format_interval(metric, raw.get("low"), raw.get("high")),
        accepted="" if before is None else f"accepted {format_metric(metric, before, unit)} on {accepted.get('date')}",
        change=abs(raw["value"] / before) if before and raw.get("value") is not None else None,
        floor=_floor(raw, unit),
        bound=format_bound(metric, low, high, unit),
        verdict=raw["verdict"],
        reason=raw.get("reason") or "",
        note=raw.get("note") or "",
        place=raw.get("place") or "",
        renderer=raw.get("renderer") or "",
        use=budget_use(raw.get("value"), low, high),
        bar=_bar(raw),
    )


def use_of(criterion: CriterionView | None) -> float:
    """The share of its budget that a criterion takes; -1 where that is not known."""
    return -1.0 if criterion is None or criterion.use is None else criterion.use


def budget_use(value: float | None, low: float | None, high: float | None) -> float | None:
    """The share of its budget that an error takes: 0 is perfect, 1 is the bound, more exceeds it.

    Two bounds: the distance from their middle over half their distance. An upper bound: value / bound. A lower bound
    below 1 is that of a similarity, whose ideal is 1: (1 - value) / (1 - bound); other lower bounds: bound / value.
    None where this has no meaning, such as a bound of zero.
    """
    if value is None or not math.isfinite(value) or (low is None and high is None):
        return None
    if low is not None and high is not None:
        return abs(value - (low + high) / 2) / ((high - low) / 2) if high > low else None
    if high is not None:
        return max(0.0, value / high) if high > 0 else None
    assert low is not None
    if low < 1:
        return max(0.0, (1 - value) / (1 - low))
    return low / value if value > 0 else None


def is_noise_removed(metric: str) -> bool:
    """Whether the metric takes the noise of the truth out of its value."""
    return metric in METRICS and METRICS[metric].noise_power is not None


def _accepted_value(metric: str, accepted: Mapping[str, Any]) -> float | None:
    measured = (accepted.get("criteria") or {}).get(metric)
    return float(measured[0]) if measured else None


def _floor(raw: Mapping[str, Any], unit: str) -> str:
    """What two truths differ by, for the metrics that cannot tell their noise from an error."""
    if raw.get("floor") is None or is_noise_removed(raw["metric"]):
        return ""
    return f"noise reads {format_metric(raw['metric'], raw['floor'], unit)}"


def _bar(raw: Mapping[str, Any]) -> Bar | None:
    low, high = raw.get("min"), raw.get("max")
    use = budget_use(raw.get("value"), low, high)
    if use is None:
        return None
    measured = [budget_use(end, low, high) for end in (raw.get("low"), raw.get("high"))]
    ends = sorted(use if end is None else end for end in measured)
    if low is not None and high is not None and _straddles(raw, (low + high) / 2):
        ends[0] = 0.0
    spread = f", interval {format_percent(ends[0])} to {format_percent(ends[1])}" if ends[0] < ends[1] else ""
    return Bar(
        value=_length(use),
        low=_length(ends[0]),
        high=_length(ends[1]),
        label=f"The error takes {format_percent(use)} of its budget{spread}.",
        overflow=f"{format_number(use)}×" if use * BAR_BUDGET > BAR_LENGTH else "",
    )


def _straddles(raw: Mapping[str, Any], middle: float) -> bool:
    low, high = raw.get("low"), raw.get("high")
    return low is not None and high is not None and low < middle < high


def _length(use: float) -> float:
    return round(min(use * BAR_BUDGET, BAR_LENGTH), 2)
