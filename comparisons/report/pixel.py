"""The worst pixel of a check, as numbers to read."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from comparisons.report.numbers import MISSING, format_number

CHANNELS = {1: ("value",), 2: ("u", "v"), 3: ("red", "green", "blue")}
DIRECTIONS = ("x", "y", "z")


@dataclass(frozen=True)
class ChannelView:
    """One channel; `sigmas` is the error over the truth's standard error, a dash where that is 0."""

    name: str
    realtime: str
    truth: str
    sigma: str
    error: str
    sigmas: str


@dataclass(frozen=True)
class PixelView:
    """A pixel, `x` and `y` counted from the top left."""

    x: int
    y: int
    channels: tuple[ChannelView, ...]


def pixel_of(raw: Mapping[str, Any]) -> PixelView | None:
    """The pixel to look at first; None for results that don't tell."""
    worst = raw.get("worst")
    if not worst:
        return None
    count = len(worst["truth"])
    is_direction = raw.get("display") == "normal" and count == len(DIRECTIONS)
    names = DIRECTIONS if is_direction else CHANNELS.get(count, tuple(map(str, range(count))))
    values = zip(names, worst["realtime"], worst["truth"], worst["sigma"], strict=True)
    return PixelView(worst["x"], worst["y"], tuple(_channel(*row) for row in values))


def pixel_text(worst: Mapping[str, Any], unit: str) -> str:
    """The worst pixel in one line: `(5, 12) from the top left: real-time 1.11; truth 1.25 ± 0.0360 W/(m² sr)`."""
    truth = [
        format_number(value) + (f" ± {format_number(sigma)}" if sigma else "")
        for value, sigma in zip(worst["truth"], worst["sigma"], strict=True)
    ]
    values = f"real-time {', '.join(map(format_number, worst['realtime']))}; truth {', '.join(truth)}"
    return f"({worst['x']}, {worst['y']}) from the top left: {values}{'' if unit == '1' else f' {unit}'}"


def _channel(name: str, realtime: float, truth: float, sigma: float) -> ChannelView:
    error = realtime - truth
    return ChannelView(
        name=name,
        realtime=format_number(realtime),
        truth=format_number(truth),
        sigma=format_number(sigma) if sigma > 0 else "",
        error=format_number(error) if error <= 0 else f"+{format_number(error)}",
        sigmas=format_number(abs(error) / sigma) if sigma > 0 else MISSING,
    )
