"""One row for each technique of a run: how wrong it is at best and at worst, where, how sure that is, what it costs."""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from comparisons.metrics import METRICS
from comparisons.report.check import SEVERITY, CheckView
from comparisons.report.numbers import format_interval, format_percent, format_range, format_seconds

SCALE = (1e-4, 10.0)
"""What the drawn range reaches from and to, on a logarithmic scale: 0.01 % to 1,000 % of errors that are ratios."""


@dataclass(frozen=True)
class Glance:
    """`error` tells the metric's least and largest value over the checks; `worst` is the check of the latter.

    `how` tells what sets the row apart from others of its technique, `way` the same in short. `reach` is where the
    values lie along `SCALE`, from 0 to 1; None for errors that have a unit. `wrong` is the share of the judged pixels
    that are wrong beyond noise in the worst; `verdict` is the most severe one.
    """

    technique: str
    quantity: str
    how: str
    way: str
    checks: int
    metric: str
    error: str
    interval: str
    reach: tuple[float, float] | None
    worst: CheckView
    wrong: str
    verdict: str
    realtime: str
    truth: str


@dataclass(frozen=True)
class Group:
    """The techniques of one effect, and how many checks judge them."""

    effect: str
    checks: int
    rows: tuple[Glance, ...]


def groups_of(views: Iterable[CheckView], effects: Sequence[str]) -> tuple[Group, ...]:
    """The effects in their order, each with the rows of `glances_of`; those without a measured check are left out."""
    found = list(views)
    groups = ((effect, [view for view in found if view.effect == effect]) for effect in effects)
    rows = ((effect, members, glances_of(members)) for effect, members in groups)
    return tuple(Group(effect, len(members), glances) for effect, members, glances in rows if glances)


def in_columns(groups: Sequence[Group], count: int = 2) -> tuple[tuple[Group, ...], ...]:
    """The groups in columns of about equal height: the tallest first, each into the shortest; then in their order."""
    columns: list[list[Group]] = [[] for _ in range(count)]
    for group in sorted(groups, key=_height, reverse=True):
        min(columns, key=lambda column: sum(map(_height, column))).append(group)
    ordered = (tuple(group for group in groups if group in column) for column in columns)
    return tuple(sorted(filter(None, ordered), key=lambda column: groups.index(column[0])))


def _height(group: Group) -> int:
    """In rows; the heading takes about one."""
    return len(group.rows) + 1


def glances_of(views: Iterable[CheckView]) -> tuple[Glance, ...]:
    """Rows in the order of their worst error, the largest first; errors that have a unit come after the ratios.

    Checks without a measured criterion are left out.
    """
    groups: dict[tuple[str, str, str], list[CheckView]] = {}
    for view in views:
        first = next(iter(view.raw.get("criteria") or []), None)
        if first is not None and first.get("value") is not None:
            groups.setdefault((view.raw["technique"], _how(view), first["metric"]), []).append(view)
    ordered = sorted(groups.items(), key=lambda group: (not _is_ratio(group[1][0]), -max(map(_size, group[1]))))
    return tuple(_row(key, members) for key, members in ordered)


def _how(view: CheckView) -> str:
    """The ways of a technique that are told apart: settings that are names, and a fitted exposure."""
    named = [f"{key} = {value}" for key, value in (view.raw.get("settings") or {}).items() if isinstance(value, str)]
    return ", ".join([*named, *(["exposure fitted"] if view.raw.get("fit_exposure") else [])])


def _is_ratio(view: CheckView) -> bool:
    """Whether the first criterion measures without a unit."""
    metric = METRICS.get(_first(view)["metric"])
    if metric is None:
        return False
    return (view.raw.get("unit") if metric.unit == "quantity" else metric.unit) in ("1", "")


def _first(view: CheckView) -> dict[str, Any]:
    first: dict[str, Any] = view.raw["criteria"][0]
    return first


def _size(view: CheckView) -> float:
    return abs(float(_first(view)["value"]))


def _row(key: tuple[str, str, str], members: Sequence[CheckView]) -> Glance:
    technique, how, metric = key
    best, worst = min(members, key=_size), max(members, key=_size)
    unit = worst.raw.get("unit") or ""
    first = _first(worst)
    return Glance(
        technique=technique,
        quantity=worst.raw["quantity"],
        how=how,
        way=", ".join(part.rpartition(" = ")[2] for part in how.split(", ")),
        checks=len(members),
        metric=metric,
        error=format_range(metric, _first(best)["value"], first["value"], unit),
        interval=format_interval(metric, first.get("low"), first.get("high")),
        reach=(_place(_size(best)), _place(_size(worst))) if _is_ratio(worst) else None,
        worst=worst,
        wrong=format_percent((worst.raw.get("significance") or {}).get("share"), trim=True),
        verdict=min((view.verdict for view in members), key=SEVERITY.__getitem__),
        realtime=_median(members, "realtime"),
        truth=_median(members, "reference"),
    )


def _place(value: float) -> float:
    """Where a value lies along `SCALE`, from 0 to 1; what is beyond stands at its end."""
    least, most = SCALE
    return round(math.log(min(max(value, least), most) / least) / math.log(most / least), 3)


def _median(members: Sequence[CheckView], side: str) -> str:
    seconds = [(view.raw.get("seconds") or {}).get(side) for view in members]
    known = [taken for taken in seconds if taken is not None]
    return format_seconds(statistics.median(known) if known else None)
