"""One row for each technique of a run: how wrong it is at best and at worst, where, how sure that is, what it costs."""

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from comparisons.metrics import METRICS
from comparisons.report.numbers import format_interval, format_metric, format_percent, format_seconds


@dataclass(frozen=True)
class Glance:
    """`least` and `most` are the metric's values over the checks; `where`, `wrong` and `picture` belong to `most`.

    `wrong` is the share of the judged pixels that are wrong beyond noise.
    """

    technique: str
    quantity: str
    how: str
    checks: int
    metric: str
    least: str
    most: str
    interval: str
    where: str
    wrong: str
    anchor: str
    picture: str
    realtime: str
    truth: str


def glances_of(checks: Sequence[tuple[str, Mapping[str, Any]]]) -> tuple[Glance, ...]:
    """Rows in the order of their worst error, the largest first; errors that have a unit come after the ratios.

    Parameters
    ----------
    checks : pairs of a check's anchor on the page and its results. Those without a measured criterion are left out.
    """
    groups: dict[tuple[str, str, str], list[tuple[str, Mapping[str, Any]]]] = {}
    for anchor, raw in checks:
        first = next(iter(raw.get("criteria") or []), None)
        if first is not None and first.get("value") is not None:
            key = (raw["technique"], _how(raw), first["metric"])
            groups.setdefault(key, []).append((anchor, raw))
    ordered = sorted(
        groups.items(), key=lambda group: (not _is_ratio(group[0][2]), -max(_size(r) for _, r in group[1]))
    )
    return tuple(_row(key, members) for key, members in ordered)


def _how(raw: Mapping[str, Any]) -> str:
    """The ways of a technique that are told apart: settings that are names, and a fitted exposure."""
    named = [f"{key} = {value}" for key, value in (raw.get("settings") or {}).items() if isinstance(value, str)]
    return ", ".join([*named, *(["exposure fitted"] if raw.get("fit_exposure") else [])])


def _is_ratio(metric: str) -> bool:
    return metric in METRICS and METRICS[metric].unit == "1"


def _size(raw: Mapping[str, Any]) -> float:
    return abs(float(raw["criteria"][0]["value"]))


def _row(key: tuple[str, str, str], members: Sequence[tuple[str, Mapping[str, Any]]]) -> Glance:
    technique, how, metric = key
    anchor, worst = max(members, key=lambda member: _size(member[1]))
    best = min((raw for _, raw in members), key=_size)
    first = worst["criteria"][0]
    unit = worst.get("unit") or ""
    return Glance(
        technique=technique,
        quantity=worst["quantity"],
        how=how,
        checks=len(members),
        metric=metric,
        least=format_metric(metric, best["criteria"][0]["value"], unit),
        most=format_metric(metric, first["value"], unit),
        interval=format_interval(metric, first.get("low"), first.get("high")),
        where=worst["scene"],
        wrong=format_percent((worst.get("significance") or {}).get("share"), trim=True),
        anchor=anchor,
        picture=(worst.get("images") or {}).get("error") or "",
        realtime=_median(members, "realtime"),
        truth=_median(members, "reference"),
    )


def _median(members: Sequence[tuple[str, Mapping[str, Any]]], side: str) -> str:
    known = [raw["seconds"][side] for _, raw in members if (raw.get("seconds") or {}).get(side) is not None]
    return format_seconds(statistics.median(known) if known else None)
