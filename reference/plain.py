"""Parts of Mitsuba's dictionaries as plain data."""

from typing import Any

from scenes.units import Rgb

Plain = dict[str, Any]


def rgb(value: Rgb) -> Plain:
    """A colour."""
    return {"type": "rgb", "value": list(value)}
