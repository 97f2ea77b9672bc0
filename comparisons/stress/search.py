"""The simplest input that still fails."""

from collections.abc import Callable, Mapping
from random import Random

import numpy as np
from hypothesis import HealthCheck, Phase, find, settings
from hypothesis import strategies as st
from hypothesis.errors import NoSuchExample

from comparisons.glsl.values import Value, parts
from comparisons.stress.inputs import Inputs, Kind, rounded

MOST_EXAMPLES = 200
MOST_TRIALS = 600
"""Inputs that are tried for one failure, in all: so many seconds at most, and the same ones on every machine."""


def simplest(kinds: Mapping[str, Kind], found: Inputs, fails: Callable[[Inputs], bool]) -> Inputs:
    """An input that fails as `found` does, put together from simple values and those of `found`.

    Hypothesis draws each input from a list that begins with the simplest values of its kind and ends with the one
    found, and shrinks what fails towards the beginnings of the lists (MacIver & Donaldson 2020, "Test-Case Reduction
    via Test-Case Generation"). What is left of `found` at the end is what the failure needs.

    Parameters
    ----------
    kinds : of the function's inputs
    found : inputs (1, ...) that fail
    fails : whether inputs (1, ...) do
    """
    known: dict[bytes, bool] = {}

    def still_fails(inputs: dict[str, Value]) -> bool:
        key = b"".join(np.asarray(part).tobytes() for value in inputs.values() for part in parts(value).values())
        if key not in known:
            known[key] = len(known) < MOST_TRIALS and fails(inputs)
        return known[key]

    @st.composite
    def candidates(draw: st.DrawFn) -> dict[str, Value]:
        made: dict[str, Value] = {}
        for name, kind in kinds.items():
            values = [rounded(value) for value in kind.simple(found[name], made)]
            if not values or kind.allows(found[name], made):
                values.append(found[name])
            made[name] = values[draw(st.integers(0, len(values) - 1))]
        return made

    limits = settings(
        max_examples=MOST_EXAMPLES,
        database=None,
        deadline=None,
        derandomize=True,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
    try:
        return find(candidates(), still_fails, settings=limits, random=Random(0))
    except NoSuchExample:
        return found
