"""What a technique is: its card, its parameters, its passes."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from realtime.graph import Pass
from realtime.shader import NO_SHADERS, OwnShaders
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.model import Scene

LOOK = "look"
"""The name of the parameter that chooses among the looks of a technique that has some."""


@dataclass(frozen=True)
class Parameter:
    """A setting with its default, the values that a benchmark sweeps, and the least and the most that is allowed.

    The values that the sweep of a text lists are all that are allowed. `off` is the value at which a part of the
    technique is left out, for settings that have one. `tuned` marks a constant that was chosen by eye: the range in
    which `lightgauge fit` looks for a better one.
    """

    name: str
    default: SettingValue
    sweep: tuple[SettingValue, ...]
    summary: str
    bounds: tuple[float, float] = (-math.inf, math.inf)
    off: SettingValue | None = None
    tuned: tuple[float, float] | None = None


@dataclass(frozen=True)
class Technique:
    """A real-time way to approximate one quantity.

    `passes` gets the scene, its features and the settings, and returns the passes in order; the last ones write
    `image`. `source` is a key of the bibliography, or for a user's technique any text. `channels` picks the quantity
    out of the four channels of `image`. `shaders` are the files that a user's technique brings; loading it sets them.

    `sliders` are more numbers than a report could show or a benchmark sweep. A look sets them together: `looks` holds
    the values of each, by its name, and the defaults stand for what a look does not say. Settings may override them.
    `look_of` is the name of the technique that a user's own look makes this one of.
    """

    name: str
    approximates: str
    summary: str
    source: str
    limits: str
    passes: Callable[[Scene, Features, Mapping[str, SettingValue]], list[Pass]]
    parameters: tuple[Parameter, ...] = ()
    channels: tuple[int, ...] = (0, 1, 2)
    grid: int = 2
    shaders: OwnShaders = NO_SHADERS
    sliders: tuple[Parameter, ...] = ()
    looks: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    look_of: str = ""

    @property
    def settable(self) -> tuple[Parameter, ...]:
        """Parameters and sliders."""
        return (*self.parameters, *self.sliders)

    def settings(self, given: Mapping[str, SettingValue]) -> dict[str, Any]:
        """The defaults, overridden by the look that is chosen, overridden by what is given.

        Raises
        ------
        InputError
            A name that is no parameter, or a value of another type, out of bounds, or not among the choices.
        """
        known = {p.name: p for p in self.settable}
        for name, value in given.items():
            if name not in known:
                names = ", ".join(p.name for p in self.parameters) or "none"
                sliders = f", and the sliders of a look, such as {self.sliders[0].name}" if self.sliders else ""
                raise InputError(f"Technique '{self.name}' has no setting '{name}'. It has: {names}{sliders}.")
            default = known[name].default
            number = isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool)
            if type(value) is not type(default) and not number:
                raise InputError(
                    f"Setting '{name}' of '{self.name}' is {value!r}; a {type(default).__name__} such as "
                    f"{default!r} is allowed."
                )
            least, most = known[name].bounds
            if isinstance(value, str):
                if value not in known[name].sweep:
                    allowed = ", ".join(map(repr, known[name].sweep))
                    raise InputError(f"Setting '{name}' of '{self.name}' is {value!r}; allowed: {allowed}.")
            elif not least <= value <= most:
                raise InputError(f"Setting '{name}' of '{self.name}' is {value!r}; {least:g} to {most:g} is allowed.")
        chosen = {p.name: given.get(p.name, p.default) for p in self.parameters}
        look = self.looks.get(str(chosen.get(LOOK)), {})
        return chosen | {p.name: given.get(p.name, look.get(p.name, p.default)) for p in self.sliders}
