"""The plots of a benchmark: time against error for what competes, and time against size."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from comparisons.bench.result import Scaling, Traced
from comparisons.report.bench_view import Group, Row
from comparisons.report.names import different, stem_of
from comparisons.report.numbers import format_count, format_metric, format_number, format_seconds, is_share
from comparisons.report.plot import MOST_SERIES, Point, Series, loglog_plot


@dataclass(frozen=True)
class Plot:
    """An SVG, and the name of its file without suffix."""

    name: str
    svg: str


def front_plot(group: Group) -> Plot | None:
    """Time against error of a group; None where no error is above 0, since a logarithmic axis has no place for it."""
    techniques = list(dict.fromkeys(row.point.technique for row in group.rows))[:MOST_SERIES]
    faint_first = sorted(group.rows, key=lambda row: row.is_front)
    series = [
        Series(name, [_point(group, row) for row in faint_first if row.point.technique == name], is_joined=False)
        for name in techniques
    ]
    if not any(point.y > 0 for one in series for point in one.points):
        return None
    front = [_point(group, answer.row) for answer in group.answers]
    context = [*_path_tracing(group), *([Series("front", front, is_line=True)] if len(front) > 1 else [])]
    label = f"{group.metric} [%]" if is_share(group.metric) else group.metric
    title = f"{group.scene}, {group.quantity}, {group.resolution}"
    svg = loglog_plot(title, "time of a frame", label, [*context, *series], x_text=_seconds)
    return Plot(group.name, svg)


def _seconds(value: float) -> str:
    return format_seconds(value, trim=True)


def _point(group: Group, row: Row) -> Point:
    point, error = row.point, row.point.error
    how = f"{point.technique}{f' ({row.how})' if row.how else ''}, {row.resolution}"
    is_sure = error.low == error.high
    return Point(
        point.cost.seconds.value,
        max(0.0, error.value) * _scale(group),
        None if is_sure else max(0.0, error.low) * _scale(group),
        None if is_sure else error.high * _scale(group),
        title=f"{how}: {point.metric} {row.error} {row.interval} in {row.frame}",
        is_dim=not row.is_front or row.resolution != group.resolution,
    )


def _path_tracing(group: Group) -> Iterator[Series]:
    """The path tracer's images, and the fitted power law of their error."""
    if group.traced:
        yield Series("path tracing", [_traced_point(group, t) for t in group.traced], is_joined=False, is_muted=True)
    if group.slope is not None and len(group.traced) > 1:
        slope = group.slope
        fitted = [
            Point(t.seconds.value, slope.coefficient * t.spp**slope.exponent.value * _scale(group))
            for t in group.traced
        ]
        yield Series(f"∝ spp^{format_number(slope.exponent.value)}", fitted, is_line=True, is_dashed=True)


def _traced_point(group: Group, traced: Traced) -> Point:
    what = f"path tracing at {format_count(traced.spp)} spp" if traced.spp else f"exact, by {traced.integrator}"
    error = format_metric(traced.metric, traced.error.value)
    title = f"{what}: {traced.metric} {error} in {format_seconds(traced.seconds.value)}"
    return Point(traced.seconds.value, max(0.0, traced.error.value) * _scale(group), title=title)


def _scale(group: Group) -> float:
    """What turns an error into the number along its axis."""
    return 100.0 if is_share(group.metric) else 1.0


def scaling_plots(laws: Sequence[Scaling]) -> tuple[Plot, ...]:
    """One plot for each scene and axis: a series for each technique."""
    groups: dict[tuple[str, str], list[Scaling]] = {}
    for law in laws:
        groups.setdefault((law.axis, law.scene), []).append(law)
    names = different(stem_of(f"scaling-{axis}-{scene}") for axis, scene in groups)
    return tuple(_scaling_plot(name, members) for name, members in zip(names, groups.values(), strict=True))


def _scaling_plot(name: str, laws: Sequence[Scaling]) -> Plot:
    axis, scene = laws[0].axis, laws[0].scene
    series = [
        Series(
            law.technique,
            [
                Point(size, 1e3 * seconds, title=f"{_size(size)} {axis}: {format_seconds(seconds)}")
                for size, seconds in zip(law.sizes, law.seconds, strict=True)
            ],
        )
        for law in laws[:MOST_SERIES]
    ]
    return Plot(name, loglog_plot(f"{scene}: {axis}", axis, "time of a frame [ms]", series, x_text=_size))


def _size(value: float) -> str:
    """`8`, `20k`, `1.31M`: a size along an axis."""
    for factor, unit in ((1e6, "M"), (1e3, "k")):
        if value >= factor:
            return f"{value / factor:.3g}{unit}"
    return f"{value:.3g}"
