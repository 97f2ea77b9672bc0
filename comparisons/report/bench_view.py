"""What the page of a benchmark shows, in words and numbers."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from comparisons.bench.claims import needed_for
from comparisons.bench.pareto import group_of, on_front
from comparisons.bench.result import Ablation, Bench, Point, Scaling, Slope, Traced
from comparisons.report.names import stem_of
from comparisons.report.numbers import (
    MINUS,
    NARROW_SPACE,
    format_count,
    format_interval,
    format_metric,
    format_number,
    format_percent,
    format_seconds,
)

DOUBTS = "doubts"
"""The key of the environment under which stands why times may not be what they seem."""


@dataclass(frozen=True)
class Row:
    """A point in words. `is_front`: nothing measured at its resolution is both quicker and better."""

    point: Point
    how: str
    resolution: str
    error: str
    interval: str
    frame: str
    frame_interval: str
    start: str
    start_parts: str
    memory: str
    is_front: bool


@dataclass(frozen=True)
class Answer:
    """A point of the front, what the path tracer needs for its error, and how many frames fit into that."""

    row: Row
    traced: str
    times: str


@dataclass(frozen=True)
class Group:
    """What competes: one quantity of one scene by one metric.

    `answers` are the front at the scene's own `resolution`, from the quickest to the most exact; `traced` and `slope`
    are the path tracer's at that resolution. `rows` hold other resolutions too.
    """

    effect: str
    scene: str
    quantity: str
    metric: str
    resolution: str
    rows: tuple[Row, ...]
    traced: tuple[Traced, ...]
    slope: Slope | None
    answers: tuple[Answer, ...]
    claims: tuple[str, ...]

    @property
    def name(self) -> str:
        """For files and addresses."""
        return stem_of(f"{self.effect}-{self.scene}-{self.quantity}-{self.metric}")


@dataclass(frozen=True)
class ScalingRow:
    """`doubling`: how many times as long a frame takes when the size doubles."""

    law: Scaling
    exponent: str
    interval: str
    r2: str
    doubling: str
    sizes: str


@dataclass(frozen=True)
class AblationRow:
    ablation: Ablation
    how: str
    error_with: str
    error_without: str
    added: str
    added_interval: str
    saved_seconds: float
    saved: str
    saved_share: str


@dataclass(frozen=True)
class BenchView:
    """`claims` are those that belong to no group; `clocks` tells how frames were timed."""

    sentence: str
    machine: str
    doubts: tuple[str, ...]
    clocks: str
    groups: tuple[Group, ...]
    claims: tuple[str, ...]
    scaling: tuple[ScalingRow, ...]
    ablations: tuple[AblationRow, ...]
    skipped: tuple[Mapping[str, str], ...]
    environment: Mapping[str, Any]
    started: str


def view_of(bench: Bench) -> BenchView:
    """Everything that the page shows but the plots."""
    groups = _groups(bench)
    told = {claim for group in groups for claim in group.claims}
    environment = {key: value for key, value in bench.environment.items() if value not in (None, "") and key != DOUBTS}
    return BenchView(
        sentence=_sentence(bench),
        machine=" · ".join(str(environment[key]) for key in ("gl_renderer", "cpu", "variant") if key in environment),
        doubts=tuple(bench.environment.get(DOUBTS, ())),
        clocks=" or ".join(sorted({point.cost.clock for point in bench.points})),
        groups=groups,
        claims=tuple(claim for claim in bench.claims if claim not in told),
        scaling=tuple(map(_scaling_row, bench.scaling)),
        ablations=tuple(map(_ablation_row, bench.ablations)),
        skipped=bench.skipped,
        environment=environment,
        started=bench.started,
    )


def _sentence(bench: Bench) -> str:
    if not bench.points:
        return "Nothing was measured against truth"
    seconds = [point.cost.seconds.value for point in bench.points]
    techniques, effects = ({getattr(point, key) for point in bench.points} for key in ("technique", "effect"))
    return (
        f"What a millisecond buys: {len(techniques)} technique{_s(techniques)} for {len(effects)} effect{_s(effects)}, "
        f"{len(bench.points)} points from {format_seconds(min(seconds))} to {format_seconds(max(seconds))} a frame"
    )


def _s(several: Sequence[Any] | set[Any]) -> str:
    return "" if len(several) == 1 else "s"


def _groups(bench: Bench) -> tuple[Group, ...]:
    """In the order of their first points."""
    rows: dict[tuple[str, ...], list[Row]] = {}
    for point, is_front in zip(bench.points, on_front(bench.points), strict=True):
        key = (point.effect, point.scene, point.quantity, point.metric)
        rows.setdefault(key, []).append(_row(point, is_front))
    return tuple(_group(members, bench) for members in rows.values())


def _group(rows: Sequence[Row], bench: Bench) -> Group:
    own = next((row for row in rows if row.point.swept != "sensor"), rows[0])
    key = group_of(own.point)
    traced = sorted(
        (t for t in bench.traced if (t.scene, t.quantity, t.metric, t.width, t.height) == key), key=lambda t: t.spp
    )
    slope = next((s for s in bench.slopes if (s.scene, s.quantity, s.metric, s.width, s.height) == key), None)
    front = [row for row in rows if row.is_front and group_of(row.point) == key]
    return Group(
        effect=own.point.effect,
        scene=own.point.scene,
        quantity=own.point.quantity,
        metric=own.point.metric,
        resolution=own.resolution,
        rows=tuple(rows),
        traced=tuple(traced),
        slope=slope,
        answers=tuple(
            _answer(row, traced, slope) for row in sorted(front, key=lambda row: row.point.cost.seconds.value)
        ),
        claims=_claims_on(rows, bench.claims),
    )


def _claims_on(rows: Iterable[Row], claims: Iterable[str]) -> tuple[str, ...]:
    starts = tuple({f"{row.point.scene}: {row.point.technique}{end}" for row in rows for end in " ["})
    return tuple(claim for claim in claims if claim.startswith(starts))


def _row(point: Point, is_front: bool) -> Row:
    cost = point.cost
    return Row(
        point=point,
        how=_how(point.settings, is_fitted=point.is_fitted),
        resolution=f"{point.width} × {point.height}",
        error=format_metric(point.metric, point.error.value),
        interval=format_interval(point.metric, point.error.low, point.error.high),
        frame=format_seconds(cost.seconds.value),
        frame_interval=f"{format_seconds(cost.seconds.low)} to {format_seconds(cost.seconds.high)}",
        start=format_seconds(sum(cost.start_seconds.values())),
        start_parts=", ".join(f"{name} {format_seconds(seconds)}" for name, seconds in cost.start_seconds.items()),
        memory=f"{format_number(cost.peak_bytes / 1e6)}{NARROW_SPACE}MB",
        is_front=is_front,
    )


def _answer(row: Row, traced: Sequence[Traced], slope: Slope | None) -> Answer:
    error, frame = row.point.error.value, row.point.cost.seconds.value
    if not traced or (error <= 0 and traced[0].spp > 0):
        return Answer(row, "", "")
    first = traced[0]
    bound, needed = "", first.seconds.value
    if first.spp > 0 and error >= first.error.value:
        bound = f"<{NARROW_SPACE}"
    elif first.spp > 0:
        needed = needed_for(error, traced, slope).seconds
    return Answer(row, f"{bound}{format_seconds(needed)}", f"{bound}{format_number(needed / frame)}×")


def _scaling_row(law: Scaling) -> ScalingRow:
    return ScalingRow(
        law=law,
        exponent=format_number(law.exponent.value),
        interval=f"[{format_number(law.exponent.low)}, {format_number(law.exponent.high)}]",
        r2=f"{law.r2:.3f}",
        doubling=f"{format_number(2**law.exponent.value)}×",
        sizes=f"{format_count(round(min(law.sizes)))} to {format_count(round(max(law.sizes)))}",
    )


def _ablation_row(one: Ablation) -> AblationRow:
    saved = one.seconds_with - one.seconds_without
    return AblationRow(
        ablation=one,
        how=_how(one.settings),
        error_with=format_metric(one.metric, one.error_with.value),
        error_without=format_metric(one.metric, one.error_without.value),
        added=format_metric(one.metric, one.added.value),
        added_interval=format_interval(one.metric, one.added.low, one.added.high),
        saved_seconds=saved,
        saved=f"{MINUS if saved < 0 else ''}{format_seconds(abs(saved))}",
        saved_share=format_percent(saved / one.seconds_with),
    )


def _how(settings: Mapping[str, Any], *, is_fitted: bool = False) -> str:
    return ", ".join(
        [*(f"{key} = {value}" for key, value in settings.items()), *(["exposure fitted"] if is_fitted else [])]
    )
