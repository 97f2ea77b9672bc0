"""What is fitted: settings of a technique, each within its range, as coordinates from 0 to 1."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from realtime.technique import Parameter, Technique
from scenes.checks import SettingValue
from scenes.errors import InputError, unknown_name

DECADE = 10.0
"""Where the ends of a positive range differ by more than this factor, equal steps are equal factors."""

DIGITS = 3
"""Significant digits of a fitted value: it is judged as it is printed."""

EDGE = 0.01
"""This part of a range, at either end, counts as its edge."""

BETWEEN = ".."


@dataclass(frozen=True)
class Axis:
    """A number between `low` and `high`; `published` is what the technique, or its look, sets it to."""

    name: str
    published: float
    low: float
    high: float
    is_whole: bool = False

    @property
    def is_log(self) -> bool:
        return self.low > 0 and self.high / self.low > DECADE

    def value(self, place: float) -> float:
        """The setting at a place from 0 to 1, with DIGITS digits, or whole."""
        exact = self.exact(place)
        rounded = round(exact) if self.is_whole else float(f"{exact:.{DIGITS}g}")
        return min(max(rounded, self.low), self.high)

    def exact(self, place: float) -> float:
        """The setting at a place with all digits: what changes as smoothly as the place does."""
        if self.is_log:
            return self.low * math.pow(self.high / self.low, place)
        return self.low + place * (self.high - self.low)

    def place(self, value: float) -> float:
        """Where a setting lies, from 0 to 1; at an end if it is beyond."""
        inside = min(max(value, self.low), self.high)
        if self.is_log:
            return math.log(inside / self.low) / math.log(self.high / self.low)
        return (inside - self.low) / (self.high - self.low)

    def edge(self, value: float) -> str:
        """The end of the range that a value lies at: "low", "high" or ""."""
        place = self.place(value)
        return "low" if place <= EDGE else "high" if place >= 1 - EDGE else ""


@dataclass(frozen=True)
class Choice:
    """A setting without an order: each of `values` is tried."""

    name: str
    published: SettingValue
    values: tuple[SettingValue, ...]


Part = Axis | Choice


def parts_of(technique: Technique, wanted: Sequence[str], pinned: Mapping[str, SettingValue]) -> tuple[Part, ...]:
    """What is fitted of a technique.

    Parameters
    ----------
    wanted : NAME or NAME=LOW..HIGH; if there are none, all constants that the technique declares as tuned by eye.
    pinned : settings that the user has set; they stay. A look among them says where its sliders start.

    Raises
    ------
    InputError
        A name is none of the technique's or pinned, or a range is missing, unclear or beyond what is allowed.
    """
    start = technique.settings(pinned)
    known = {p.name: replace(p, default=start[p.name]) for p in technique.settable}
    if not wanted:
        return tuple(_axis(technique, p, p.tuned) for p in known.values() if p.tuned and p.name not in pinned)
    asked = [text.partition("=") for text in wanted]
    names = [name.strip() for name, _, _ in asked]
    for name in names:
        if name not in known:
            raise unknown_name(f"parameter of {technique.name}", name, [p.name for p in _named(technique)])
        if name in pinned:
            raise InputError(
                f"'{name}' is both set, to {pinned[name]}, and to be fitted. Leave it out of the technique's brackets, "
                "or of --parameters."
            )
        if names.count(name) > 1:
            raise InputError(f"'{name}' is to be fitted twice. Name it once in --parameters.")
    return tuple(_part(technique, known[name], text) for name, (_, _, text) in zip(names, asked, strict=True))


def _named(technique: Technique) -> Iterator[Parameter]:
    """What a message lists: of sliders, those that are fitted unless others are named."""
    yield from technique.parameters
    yield from (slider for slider in technique.sliders if slider.tuned)


def _part(technique: Technique, parameter: Parameter, text: str) -> Part:
    if isinstance(parameter.default, bool | str):
        if text:
            raise InputError(
                f"'{parameter.name}' of '{technique.name}' is no number: all of "
                f"{', '.join(map(str, parameter.sweep))} are tried. Give it no range."
            )
        values = (False, True) if isinstance(parameter.default, bool) else parameter.sweep
        return Choice(parameter.name, parameter.default, values)
    return _axis(technique, parameter, _range(parameter.name, text) if text else parameter.tuned or _swept(parameter))


def _swept(parameter: Parameter) -> tuple[float, float] | None:
    numbers = [float(value) for value in parameter.sweep]
    return (min(numbers), max(numbers)) if len(set(numbers)) > 1 else None


def _range(name: str, text: str) -> tuple[float, float]:
    low, _, high = text.partition(BETWEEN)
    try:
        return float(low), float(high)
    except ValueError as error:
        raise InputError(
            f"The range '{text}' of '{name}' is not clear. Write two numbers, such as {name}=0.1{BETWEEN}0.5."
        ) from error


def _axis(technique: Technique, parameter: Parameter, span: tuple[float, float] | None) -> Axis:
    name, (least, most) = parameter.name, parameter.bounds
    if span is None:
        raise InputError(
            f"'{name}' of '{technique.name}' has no range. Give it one: --parameters {name}=LOW{BETWEEN}HIGH."
        )
    low, high = span
    if not (math.isfinite(low) and math.isfinite(high) and least <= low < high <= most):
        raise InputError(
            f"The range of '{name}' is {low:g} to {high:g}; it must rise, and lie within what '{technique.name}' "
            f"allows: {least:g} to {most:g}."
        )
    assert isinstance(parameter.default, int | float)
    return Axis(name, parameter.default, low, high, isinstance(parameter.default, int))
