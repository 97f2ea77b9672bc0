"""What a function of GLSL works on while it runs for many invocations at once."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from comparisons.glsl.values import Array, Structs, Value, flushed, is_finite


@dataclass(frozen=True)
class Site:
    """Where an expression stands: a file of glsl/ and its line, and its text."""

    file: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.text}"


@dataclass
class Run:
    """The state of `count` invocations that compute with `real`.

    active (count,) : those that the present statement is for; `broken` and `continued` wait for the end of the loop
    slots : the values of variables. GLSL knows no recursion, so that each has one place for good.
    faults : the sites at which a number stopped being finite
    first (count,) : the index of each invocation's first one, or -1
    trace : every intermediate in the order of the run where it is wanted
    """

    real: type[np.floating[Any]]
    count: int
    structs: Structs
    slots: dict[int, Value] = field(default_factory=dict)
    faults: list[Site] = field(default_factory=list)
    trace: list[tuple[Site, Value]] | None = None

    def __post_init__(self) -> None:
        self.active = np.ones(self.count, bool)
        self.first = np.full(self.count, -1)
        self.forget_jumps()

    def forget_jumps(self) -> None:
        self.broken: Array = np.zeros(self.count, bool)
        self.continued: Array = np.zeros(self.count, bool)

    def looked_at(self, site: Site, value: Array) -> Array:
        """An intermediate as the next operation gets it, noted if it is not finite in an active invocation."""
        value = flushed(value)
        if value.dtype.kind == "f":
            bad = ~is_finite(value) & self.active & (self.first < 0)
            if bad.any():
                self.first[bad] = len(self.faults)
                self.faults.append(site)
        if self.trace is not None:
            self.trace.append((site, value))
        return value


Expression = Callable[[Run], Value]
Statement = Callable[[Run], None]
