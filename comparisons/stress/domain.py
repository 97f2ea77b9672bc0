"""What a shader function is used with, what its result means, and how exact that has to be."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from comparisons.glsl.values import Array, Value
from comparisons.stress.inputs import Kind

Law = Callable[[Mapping[str, Value]], Array]
"""How far outputs (N, ...) are from what they must be, in the unit of the result (N,)."""


@dataclass(frozen=True)
class Measure:
    """Unit of the error of a result, the largest one that nobody sees, and whether it is relative to its size.

    floor : sizes below this count as this; what is darker or nearer does not matter
    """

    unit: str
    tolerance: float
    is_relative: bool = False
    floor: float = 1e-6


SHARE = Measure("of 1", 1e-3)  # a weight, an albedo or a fraction; a tenth of what the eye tells apart
RADIANCE = Measure("relative radiance", 1e-3, is_relative=True)
DIRECTION = Measure("rad", 1e-4)  # a tenth of a pixel where a thousand see a radian
LENGTH = Measure("relative length", 1e-4, is_relative=True)
UV = Measure("uv", 1e-4)  # a tenth of a texel of a map of 1024
TEXELS = Measure("texels", 0.1)
RADII = Measure("radii of the eye, or rad", 1e-4)
SOLID_ANGLE = Measure("relative solid angle, or sr below 1", 1e-3, is_relative=True, floor=1.0)
EXACT = Measure("of 1", 0.0)


@dataclass(frozen=True)
class Domain:
    """A function's inputs in use by name, its result, and what it must obey.

    defines : macros that its file needs
    """

    measure: Measure
    kinds: Mapping[str, Kind] = field(default_factory=dict)
    law: Law | None = None
    defines: Mapping[str, int] = field(default_factory=dict)


def between(low: float, high: float) -> Law:
    """All floats of the result lie between two numbers."""

    def excess(outputs: Mapping[str, Value]) -> Array:
        value = np.asarray(outputs["return"], np.float64)
        value = value.reshape(len(value), -1)
        return np.asarray(np.maximum(np.maximum(low - value, value - high), 0.0).max(axis=1))

    return excess


def is_direction(name: str = "return") -> Law:
    """A vector has length 1."""
    return lambda outputs: np.abs(np.linalg.norm(np.asarray(outputs[name], np.float64), axis=1) - 1.0)
