"""The course of a check over runs, as SVG for a page: a panel for each metric, and one for its time.

It stands in the colour of the text around it, so it is readable on light and dark pages.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

from comparisons.gate import Verdict
from comparisons.history import Entry
from comparisons.report.numbers import format_bound, format_interval, format_metric, format_seconds

WIDTH = 640.0
LEFT, RIGHT, TOP = 84.0, 16.0, 26.0
ERROR_HEIGHT, TIME_HEIGHT, GAP, BOTTOM = 110.0, 70.0, 40.0, 40.0

SOUND, UNSOUND = "#0072b2", "#d55e00"
"""Okabe & Ito 2008, "Color Universal Design": what passed, and what did not."""

LEAST_DISTANCE = 64.0
"""Between the middles of two labels of the horizontal axis."""

MOST_RUNS = 40
"""More would stand too close to tell apart, and every one of hundreds of pages holds them."""

FAR = 4.0
"""A bound beyond this many times the largest error is named, but not drawn: it would flatten the curve."""


@dataclass(frozen=True)
class _Scale:
    """From `least` to `most` onto `bottom` to `top`, linearly."""

    least: float
    most: float
    bottom: float
    top: float

    def at(self, value: float) -> float:
        return self.bottom + (value - self.least) / (self.most - self.least) * (self.top - self.bottom)

    def ticks(self) -> list[float]:
        """Two to six round numbers."""
        rough = (self.most - self.least) / 5
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(digit * power for digit in (1, 2, 5, 10) if digit * power >= rough)
        first = math.ceil(self.least / step)
        return [step * n for n in range(first, math.floor(self.most / step) + 1)]


def trend_plot(entries: Sequence[Entry]) -> str:
    """An SVG of the course of one check: each metric with its intervals and budget, and the real-time time beneath.

    The newest `MOST_RUNS` runs stand at equal distances, the oldest at the left. Only those on a renderer of the family
    that drew last are shown: times on another cannot be compared. Where nothing was drawn, a check is an ERROR and has
    no renderer; it stands among the others. Empty if nothing was measured.
    """
    family = next((entry.renderer for entry in reversed(entries) if entry.renderer), "")
    shown = [entry for entry in entries if entry.renderer in (family, "")]
    runs = list(dict.fromkeys(id(entry.run) for entry in shown))[-MOST_RUNS:]
    shown = [entry for entry in shown if id(entry.run) in runs]
    metrics = list(dict.fromkeys(entry.metric for entry in shown if entry.value is not None))
    if not metrics:
        return ""
    left, right = (LEFT + 8, WIDTH - RIGHT - 8) if len(runs) > 1 else ((LEFT + WIDTH - RIGHT) / 2,) * 2
    step = (right - left) / max(1, len(runs) - 1)
    across = {run: left + step * index for index, run in enumerate(runs)}
    parts: list[str] = []
    top = TOP
    for metric in metrics:
        course = [entry for entry in shown if entry.metric in (metric, "")]
        parts += _error_panel(metric, course, lambda entry: across[id(entry.run)], step, top)
        top += ERROR_HEIGHT + GAP
    timed = list({id(entry.run): entry for entry in shown if entry.realtime_seconds is not None}.values())
    if timed:
        parts += _time_panel(timed, lambda entry: across[id(entry.run)], top)
        top += TIME_HEIGHT + GAP
    parts += _labels({id(entry.run): entry for entry in shown}, across, step, top - GAP + 16)
    height = top - GAP + BOTTOM
    title = f"Error and time of {shown[-1].check} over {len(runs)} run{'s' if len(runs) > 1 else ''}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {height:g}" role="img" class="trend" '
        'font-family="system-ui, sans-serif" font-size="11" fill="currentColor">'
        f"<title>{escape(title)}</title><desc>{escape(_described(shown, metrics))}</desc>{''.join(parts)}</svg>\n"
    )


def _described(entries: Sequence[Entry], metrics: Sequence[str]) -> str:
    """What the plot shows, for those who cannot see it."""
    newest = {metric: [e for e in entries if e.metric == metric and e.value is not None] for metric in metrics}
    return "; ".join(
        f"{metric} from {_value(course[0])} at {_name(course[0])} to {_value(course[-1])} at {_name(course[-1])}"
        for metric, course in newest.items()
    )


def _error_panel(
    metric: str, entries: Sequence[Entry], across: Callable[[Entry], float], step: float, top: float
) -> Iterator[str]:
    measured = [entry for entry in entries if entry.value is not None]
    scale = _error_scale(measured, top)
    newest = measured[-1]
    bound = format_bound(metric, newest.min, newest.max, newest.unit)
    yield f'<text x="{LEFT:g}" y="{top - 9:g}" font-weight="600">{escape(metric)}</text>'
    yield f'<text x="{WIDTH - RIGHT:g}" y="{top - 9:g}" text-anchor="end">budget {escape(bound)}</text>'
    yield from _grid(scale, lambda value: format_metric(metric, value, newest.unit, trim=True))
    half = step / 2 or WIDTH
    for entry in measured:
        for value in (entry.min, entry.max):
            if value is not None and scale.least <= value <= scale.most:
                ends = (max(across(entry) - half, LEFT), min(across(entry) + half, WIDTH - RIGHT))
                yield (
                    f'<path class="budget" d="M{ends[0]:.1f},{scale.at(value):.1f}H{ends[1]:.1f}" '
                    'stroke="currentColor" stroke-dasharray="5 3"/>'
                )
    yield _line([(across(entry), scale.at(entry.value)) for entry in measured if entry.value is not None])
    for entry in entries:
        yield from _error_mark(entry, across(entry), scale)


def _error_scale(measured: Sequence[Entry], top: float) -> _Scale:
    """All values with their intervals, and the bounds that are not `FAR` off; from 0 on where nothing bounds below."""
    ends = [v for e in measured for v in (e.value, e.low, e.high) if v is not None]
    reach = max(abs(value) for value in ends)
    bounds = [v for e in measured for v in (e.min, e.max) if v is not None]
    near = [bound for bound in bounds if abs(bound) <= FAR * reach]
    zero = [] if any(e.min is not None for e in measured) else [0.0]
    least, most = min(*ends, *near, *zero), max(*ends, *near, *zero)
    margin = 0.08 * (most - least) or 0.1 * abs(most) or 1.0
    return _Scale(least if least == 0 else least - margin, most + margin, top + ERROR_HEIGHT, top)


def _error_mark(entry: Entry, x: float, scale: _Scale) -> Iterator[str]:
    """A point with its interval; a cross at the foot where nothing was measured."""
    sound = entry.verdict == Verdict.PASS
    colour = SOUND if sound else UNSOUND
    title = f"<title>{escape(_told(entry))}</title>"
    if entry.value is None:
        yield (
            f'<path d="M{x - 4:.1f},{scale.bottom - 10:.1f}l8,8m0,-8l-8,8" stroke="{colour}" stroke-width="2" '
            f'fill="none">{title}</path>'
        )
        return
    y = scale.at(entry.value)
    if entry.low is not None and entry.high is not None and entry.low < entry.high:
        low, high = scale.at(entry.low), scale.at(entry.high)
        caps = f"M{x - 3:.1f},{low:.1f}h6M{x - 3:.1f},{high:.1f}h6"
        yield f'<path class="interval" d="M{x:.1f},{low:.1f}V{high:.1f}{caps}" stroke="{colour}" stroke-width="1.5"/>'
    shape = f"M{x - 4:.1f},{y:.1f}a4,4 0 1,0 8,0a4,4 0 1,0 -8,0z" if sound else f"M{x:.1f},{y - 6:.1f}l6,6l-6,6l-6,-6z"
    yield f'<path class="point" d="{shape}" fill="{colour}">{title}</path>'


def _time_panel(entries: Sequence[Entry], across: Callable[[Entry], float], top: float) -> Iterator[str]:
    seconds = [entry.realtime_seconds or 0.0 for entry in entries]
    scale = _Scale(0.0, 1.1 * max(seconds) or 1.0, top + TIME_HEIGHT, top)
    renderer = escape(entries[-1].renderer)
    yield f'<text x="{LEFT:g}" y="{top - 9:g}" font-weight="600">time of the technique</text>'
    yield f'<text x="{WIDTH - RIGHT:g}" y="{top - 9:g}" text-anchor="end">{renderer}</text>'
    yield from _grid(scale, lambda value: format_seconds(value) if value else "0")
    places = [(across(entry), scale.at(value)) for entry, value in zip(entries, seconds, strict=True)]
    yield _line(places)
    for entry, (x, y) in zip(entries, places, strict=True):
        yield (
            f'<path class="time" d="M{x - 3:.1f},{y - 3:.1f}h6v6h-6z" fill="currentColor">'
            f"<title>{escape(f'{_name(entry)}, {format_seconds(entry.realtime_seconds)}')}</title></path>"
        )


def _grid(scale: _Scale, text: Callable[[float], str]) -> Iterator[str]:
    for value in scale.ticks():
        y = scale.at(value)
        yield f'<path d="M{LEFT:g},{y:.1f}H{WIDTH - RIGHT:g}" stroke="currentColor" stroke-opacity=".18"/>'
        yield f'<text x="{LEFT - 8:g}" y="{y + 4:.1f}" text-anchor="end">{escape(text(value))}</text>'


def _line(places: Sequence[tuple[float, float]]) -> str:
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
    return f'<polyline points="{corners}" fill="none" stroke="currentColor" stroke-opacity=".45"/>'


def _labels(newest: dict[int, Entry], across: dict[int, float], step: float, y: float) -> Iterator[str]:
    """Commit and date of as many runs as there is room for, among them the newest."""
    every = math.ceil(LEAST_DISTANCE / step) if step else 1
    for index, (run, entry) in enumerate(newest.items()):
        if (len(newest) - 1 - index) % every == 0:
            x = min(max(across[run], LEFT), WIDTH - RIGHT - 22)
            yield f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle">{escape(_name(entry))}</text>'
            yield f'<text x="{x:.1f}" y="{y + 14:.1f}" text-anchor="middle" opacity=".75">{entry.when[5:10]}</text>'


def _name(entry: Entry) -> str:
    """The commit, short, with + for local changes; the time of day where there is none."""
    changed = "+" if entry.commit.endswith("+") else ""
    return entry.commit.rstrip("+")[:7] + changed if entry.commit else entry.when[11:]


def _value(entry: Entry) -> str:
    interval = format_interval(entry.metric, entry.low, entry.high)
    return f"{format_metric(entry.metric, entry.value, entry.unit)} {interval}".strip()


def _told(entry: Entry) -> str:
    """All about one entry, in words."""
    what = f"{entry.metric} {_value(entry)}, budget {format_bound(entry.metric, entry.min, entry.max, entry.unit)}"
    parts = (
        f"{_name(entry)}, {entry.when}",
        what if entry.metric else "",
        entry.verdict,
        f"{entry.spp} samples a pixel" if entry.spp else "",
        f"drawn in {format_seconds(entry.realtime_seconds)}" if entry.realtime_seconds is not None else "",
        "taken from the store: nothing that it depends on had changed" if entry.cached else "",
        f"measured beside {entry.run.jobs - 1} other scenes" if entry.run.jobs > 1 and not entry.cached else "",
    )
    return "\n".join(part for part in parts if part)
