"""Curves over logarithmic axes, as SVG that stands alone and follows the page's colours.

Series differ by colour and by the shape of their marks, so that they can be told apart without colour.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
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

MOST_SERIES = len(COLOURS) * len(MARKS)
"""Each series has a pair of colour and mark of its own."""

LONGEST_NAME = 20
"""Characters of a series that the legend surely has room for; a longer name is squeezed into `LEGEND_WIDTH`."""

LEGEND_WIDTH = 138.0

MOST_TICKS = 7
"""There is room for so many labels along the x axis."""

MUTED_MARK = "M-3,-3L3,3M-3,3L3,-3"
LINE_MARK = "M-6,0H6"
DASHED_MARK = "M-6,0h5m2,0h5"
FAINT = ' opacity=".4"'


@dataclass(frozen=True)
class Point:
    """A measured value; `low` and `high` are its interval, if it has one. `x` is positive.

    What is 0 stands at the lower edge, a hollow mark. `title` is shown under the pointer, `address` is where a click
    leads; both may be empty. What `is_dim` stands back.
    """

    x: float
    y: float
    low: float | None = None
    high: float | None = None
    title: str = ""
    address: str = ""
    is_dim: bool = False


@dataclass(frozen=True)
class Series:
    """Points that belong together.

    is_joined : a line runs through the points
    is_muted  : small crosses in the colour of the text, for context
    is_line   : nothing but the line, in the colour of the text; a fit, or what bounds the others
    is_dashed : of the line, to tell two of them apart
    """

    name: str
    points: Sequence[Point]
    is_joined: bool = True
    is_muted: bool = False
    is_line: bool = False
    is_dashed: bool = False

    def look(self, index: int) -> tuple[str, str]:
        """Mark and colour of the series with that number."""
        if self.is_line:
            return (DASHED_MARK if self.is_dashed else LINE_MARK), "currentColor"
        if self.is_muted:
            return MUTED_MARK, "currentColor"
        return MARKS[(index + index // len(COLOURS)) % len(MARKS)], COLOURS[index % len(COLOURS)]


@dataclass(frozen=True)
class _Axis:
    """From `least` to `most` onto `start` to `end`, logarithmically; what is less stands at `start`."""

    least: float
    most: float
    start: float
    end: float

    def at(self, value: float) -> float:
        share = math.log(max(value, self.least) / self.least) / math.log(self.most / self.least)
        return self.start + share * (self.end - self.start)

    def ticks(self) -> list[float]:
        """Powers of ten, `MOST_TICKS` at most; with less than two of them their doubles and fives too."""
        decades = range(math.floor(math.log10(self.least)), math.ceil(math.log10(self.most)) + 1)
        inside = [10.0**n for n in decades if self.least <= 10.0**n <= self.most]
        if len(inside) >= 2:
            return inside[:: math.ceil(len(inside) / MOST_TICKS)]
        finer = (digit * 10.0**n for n in decades for digit in (1, 2, 5))
        return [value for value in finer if self.least <= value <= self.most]


def loglog_plot(
    title: str, x_label: str, y_label: str, series: Sequence[Series], *, x_text: Callable[[float], str] = "{:g}".format
) -> str:
    """An SVG of some series, at most `MOST_SERIES`; `x_text` writes the numbers along the x axis.

    Raises
    ------
    ValueError
        There is no point, none above 0, too many series, an x that is not positive, or a y below 0.
    """
    points = [point for one in series for point in one.points]
    if not points or len(series) > MOST_SERIES:
        raise ValueError(f"{len(series)} series of {len(points)} points; 1 to {MOST_SERIES} with a point are allowed")
    heights = [value for p in points for value in (p.y, p.low, p.high) if value is not None]
    if min(heights) < 0:
        raise ValueError(f"found {min(heights):g}; a logarithmic axis has no place for it")
    x = _Axis(*_range(p.x for p in points), LEFT, WIDTH - RIGHT)
    y = _Axis(*_range(value for value in heights if value > 0), HEIGHT - BOTTOM, TOP)
    parts = [*_frame(x, y, title, x_label, y_label, x_text)]
    numbers = iter(range(MOST_SERIES))
    for row, one in enumerate(series):
        mark, colour = one.look(0 if one.is_muted or one.is_line else next(numbers))
        parts += _drawn(one, mark, colour, x, y)
        parts.append(_legend(one.name, mark, colour, TOP + 10 + 20 * row))
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
    if min(found, default=0.0) <= 0:
        raise ValueError(f"found {min(found, default=0.0):g}; a logarithmic axis has positive values only")
    return min(found) / 1.25, max(found) * 1.25


def _frame(x: _Axis, y: _Axis, title: str, x_label: str, y_label: str, x_text: Callable[[float], str]) -> Iterator[str]:
    yield f'<text x="{LEFT:g}" y="20" font-size="14" font-weight="600">{escape(title)}</text>'
    for value in x.ticks():
        at = x.at(value)
        yield f'<path d="M{at:.1f},{TOP:g}V{HEIGHT - BOTTOM:g}" stroke="currentColor" stroke-opacity=".15"/>'
        yield f'<text x="{at:.1f}" y="{HEIGHT - BOTTOM + 18:g}" text-anchor="middle">{escape(x_text(value))}</text>'
    for value in y.ticks():
        at = y.at(value)
        yield f'<path d="M{LEFT:g},{at:.1f}H{WIDTH - RIGHT:g}" stroke="currentColor" stroke-opacity=".15"/>'
        yield f'<text x="{LEFT - 8:g}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>'
    middle = (TOP + HEIGHT - BOTTOM) / 2
    yield f'<text x="{(LEFT + WIDTH - RIGHT) / 2:g}" y="{HEIGHT - 12:g}" text-anchor="middle">{escape(x_label)}</text>'
    yield f'<text transform="translate(16 {middle:g}) rotate(-90)" text-anchor="middle">{escape(y_label)}</text>'


def _drawn(series: Series, mark: str, colour: str, x: _Axis, y: _Axis) -> Iterator[str]:
    if series.is_joined:
        corners = " ".join(f"{x.at(p.x):.1f},{y.at(p.y):.1f}" for p in series.points)
        stroke = 'stroke-width="1.25" stroke-opacity=".55"' if series.is_line else 'stroke-width="1.5"'
        stroke += ' stroke-dasharray="5 3"' if series.is_dashed else ""
        yield f'<polyline points="{corners}" fill="none" stroke="{colour}" {stroke}/>'
    for p in () if series.is_line else series.points:
        faint = FAINT if p.is_dim else ""
        across = x.at(p.x)
        if p.low is not None and p.high is not None:
            bar = f"M{across:.1f},{y.at(p.low):.1f}V{y.at(p.high):.1f}"
            yield f'<path d="{bar}" stroke="{colour}" stroke-width="1.5"{faint}/>'
        paint = _paint(colour, is_hollow=p.y == 0, is_muted=series.is_muted)
        title = f"<title>{escape(p.title or f'{p.x:.3g}: {p.y:.3g}')}</title>"
        drawn = f'<path d="{mark}" transform="translate({across:.1f} {y.at(p.y):.1f})" {paint}{faint}>{title}</path>'
        yield f'<a href="{escape(p.address)}" tabindex="-1">{drawn}</a>' if p.address else drawn


def _paint(colour: str, *, is_hollow: bool, is_muted: bool) -> str:
    if is_muted:
        return f'fill="none" stroke="{colour}" stroke-opacity=".45" stroke-width="1.25"'
    return f'fill="none" stroke="{colour}" stroke-width="1.5"' if is_hollow else f'fill="{colour}"'


def _legend(name: str, mark: str, colour: str, height: float) -> str:
    across = WIDTH - RIGHT + 16
    paint = _paint(colour, is_hollow=False, is_muted=mark in (MUTED_MARK, LINE_MARK, DASHED_MARK))
    fit = f' textLength="{LEGEND_WIDTH:g}" lengthAdjust="spacingAndGlyphs"' if len(name) > LONGEST_NAME else ""
    return (
        f'<path d="{mark}" transform="translate({across:g} {height:g})" {paint}/>'
        f'<text x="{across + 12:g}" y="{height + 4:g}"{fit}>{escape(name)}</text>'
    )
