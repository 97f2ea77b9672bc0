"""Curves over logarithmic axes, as SVG that stands alone and follows the page's colours.

Series differ by colour and by the shape of their marks, so that they can be told apart without colour.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 640.0, 400.0
LEFT, RIGHT, TOP, BOTTOM = 70.0, 170.0, 36.0, 52.0
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Okabe & Ito 2008, "Color Universal Design": distinct for all common kinds of colour vision."""

MARKS = (
    "M-4,0a4,4 0 1,0 8,0a4,4 0 1,0 -8,0z",
    "M-4,-4h8v8h-8z",
    "M0,-5l5,9h-10z",
    "M0,-5l5,5l-5,5l-5,-5z",
    "M0,5l5,-9h-10z",
    "M-5,-1.5h3.5v-3.5h3v3.5h3.5v3h-3.5v3.5h-3v-3.5h-3.5z",
)


@dataclass(frozen=True)
class Point:
    """A measured value; `low` and `high` are its interval, if it has one. All positive."""

    x: float
    y: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Series:
    name: str
    points: Sequence[Point]


@dataclass(frozen=True)
class _Axis:
    """From `least` to `most` onto `start` to `end`, logarithmically."""

    least: float
    most: float
    start: float
    end: float

    def at(self, value: float) -> float:
        share = math.log(value / self.least) / math.log(self.most / self.least)
        return self.start + share * (self.end - self.start)

    def ticks(self) -> list[float]:
        """Powers of ten; with less than two of them their doubles and fives too."""
        decades = range(math.floor(math.log10(self.least)), math.ceil(math.log10(self.most)) + 1)
        inside = [10.0**n for n in decades if self.least <= 10.0**n <= self.most]
        if len(inside) >= 2:
            return inside
        finer = (digit * 10.0**n for n in decades for digit in (1, 2, 5))
        return [value for value in finer if self.least <= value <= self.most]


def loglog_plot(title: str, x_label: str, y_label: str, series: Sequence[Series]) -> str:
    """An SVG of some series, each at most as many as there are COLOURS.

    Raises
    ------
    ValueError
        There is no point, more series than colours, or a value that is not positive.
    """
    points = [point for one in series for point in one.points]
    if not points or len(series) > len(COLOURS):
        raise ValueError(f"{len(series)} series of {len(points)} points; 1 to {len(COLOURS)} with a point are allowed")
    heights = [value for p in points for value in (p.y, p.low, p.high) if value is not None]
    x = _Axis(*_range(p.x for p in points), LEFT, WIDTH - RIGHT)
    y = _Axis(*_range(heights), HEIGHT - BOTTOM, TOP)
    parts = [*_frame(x, y, title, x_label, y_label)]
    for index, one in enumerate(series):
        parts += _drawn(one, COLOURS[index], MARKS[index], x, y)
        parts.append(_legend(one.name, COLOURS[index], MARKS[index], TOP + 10 + 20 * index))
    described = "; ".join(f"{s.name}: " + ", ".join(f"{p.x:.3g} {p.y:.3g}" for p in s.points) for s in series)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" class="plot" '
        'font-family="system-ui, sans-serif" font-size="12" fill="currentColor">'
        f"<title>{escape(title)}</title><desc>{escape(described)}</desc>"
        f"<style>.plot{{color:#222}}@media(prefers-color-scheme:dark){{.plot{{color:#ddd}}}}</style>"
        f"{''.join(parts)}</svg>\n"
    )


def _range(values: Iterable[float]) -> tuple[float, float]:
    """The least and the greatest value, a little apart at either end."""
    found = list(values)
    if min(found) <= 0:
        raise ValueError(f"found {min(found):g}; a logarithmic axis has positive values only")
    return min(found) / 1.25, max(found) * 1.25


def _frame(x: _Axis, y: _Axis, title: str, x_label: str, y_label: str) -> Iterator[str]:
    yield f'<text x="{LEFT:g}" y="20" font-size="14" font-weight="600">{escape(title)}</text>'
    for value in x.ticks():
        at = x.at(value)
        yield f'<path d="M{at:.1f},{TOP:g}V{HEIGHT - BOTTOM:g}" stroke="currentColor" stroke-opacity=".15"/>'
        yield f'<text x="{at:.1f}" y="{HEIGHT - BOTTOM + 18:g}" text-anchor="middle">{value:g}</text>'
    for value in y.ticks():
        at = y.at(value)
        yield f'<path d="M{LEFT:g},{at:.1f}H{WIDTH - RIGHT:g}" stroke="currentColor" stroke-opacity=".15"/>'
        yield f'<text x="{LEFT - 8:g}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>'
    middle = (TOP + HEIGHT - BOTTOM) / 2
    yield f'<text x="{(LEFT + WIDTH - RIGHT) / 2:g}" y="{HEIGHT - 12:g}" text-anchor="middle">{escape(x_label)}</text>'
    yield f'<text transform="translate(16 {middle:g}) rotate(-90)" text-anchor="middle">{escape(y_label)}</text>'


def _drawn(series: Series, colour: str, mark: str, x: _Axis, y: _Axis) -> Iterator[str]:
    corners = " ".join(f"{x.at(p.x):.1f},{y.at(p.y):.1f}" for p in series.points)
    yield f'<polyline points="{corners}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
    for p in series.points:
        across = x.at(p.x)
        if p.low is not None and p.high is not None:
            bar = f"M{across:.1f},{y.at(p.low):.1f}V{y.at(p.high):.1f}"
            yield f'<path d="{bar}" stroke="{colour}" stroke-width="1.5"/>'
        place = f"translate({across:.1f} {y.at(p.y):.1f})"
        yield f'<path d="{mark}" transform="{place}" fill="{colour}"><title>{p.x:.3g}: {p.y:.3g}</title></path>'


def _legend(name: str, colour: str, mark: str, height: float) -> str:
    across = WIDTH - RIGHT + 16
    return (
        f'<path d="{mark}" transform="translate({across:g} {height:g})" fill="{colour}"/>'
        f'<text x="{across + 12:g}" y="{height + 4:g}">{escape(name)}</text>'
    )
