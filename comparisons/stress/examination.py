"""One shader function on many inputs, in a precision, against itself in double precision."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from comparisons.glsl.interpreter import Evaluation, Program
from comparisons.glsl.machine import Site
from comparisons.glsl.source import preprocessed
from comparisons.glsl.syntax import parse
from comparisons.glsl.values import Array, Value, parts
from comparisons.stress.domain import Domain, Measure
from comparisons.stress.domains import BY_NAME, DOMAINS
from comparisons.stress.inputs import Inputs, Kind, number, place, taken, vector, whole
from realtime.shader import load
from scenes.errors import InputError, unknown_name

Real = type[np.floating[Any]]
NUDGES, NUDGES_IN_DOUBT = 4, 64
"""How often inputs are moved a little, to learn what that costs: no function can do better than its inputs allow."""
NUDGE = 2.0
"""By how many units in the last place, up or down; rounding alone moves them by half a unit."""

BY_TYPE: dict[str, Kind] = {
    "float": number(0.0, 1.0),
    "int": whole(0, 8),
    "vec2": vector(number(0.0, 1.0), number(0.0, 1.0)),
    "vec3": place(0.01, 100.0),
}


@dataclass(frozen=True)
class Subject:
    """A function to be stressed."""

    name: str
    program: Program
    function: str
    domain: Domain
    kinds: Mapping[str, Kind]

    def evaluate(self, inputs: Inputs, real: Real, *, traced: bool = False) -> Evaluation:
        """What a precision makes of inputs in single precision; double precision gets what they are meant to be."""
        used = {name: inputs[name] for name in self.program.inputs(self.function)}
        if real is np.float64:
            used = {name: self.kinds[name].meant(value) for name, value in used.items()}
        return self.program.evaluate(self.function, used, real, traced=traced)


@dataclass(frozen=True)
class Examination:
    """What a precision made of N inputs, against double precision.

    error (N,) : in the unit of the domain's measure; infinite where the result is not finite
    own (N,) : the part of it that is the function's fault, for rounding the inputs does not explain it
    decides (N,) : whether a decision falls otherwise that rounding the inputs does not turn
    counts (N,) : whether the error means something: in both precisions the function says that there is a result
    lawless (N,) : how far the result is from what it must be, in that unit
    first (N,), faults : the index of the site at which the first number stopped being finite, or -1
    """

    error: Array
    own: Array
    decides: Array
    counts: Array
    lawless: Array
    first: Array
    faults: tuple[Site, ...]

    def fails(self, tolerance: float) -> Array:
        """(N,): whether anything is wrong with an input's result."""
        return (self.first >= 0) | self.decides | (self.own > tolerance) | (self.lawless > tolerance)


@cache
def subject(name: str) -> Subject:
    """The function FILE:FUNCTION.

    Raises
    ------
    InputError
        There is no such function, or it cannot be run by itself.
    """
    if name not in DOMAINS:
        beside = [known for known in DOMAINS if known.partition(":")[0] == name.partition(":")[0]]
        raise unknown_name("shader function", name, beside or DOMAINS)
    domain, (file, _, function) = DOMAINS[name], name.rpartition(":")
    program = program_of(file, tuple(domain.defines.items()))
    needed = program.inputs(function)
    kinds: dict[str, Kind] = {}
    for key, kind in needed.items():
        if key not in domain.kinds:
            kinds[key] = _usual(key, kind.name, name)
    return Subject(name, program, function, domain, kinds | dict(domain.kinds))


def _usual(name: str, kind: str, function: str) -> Kind:
    made = BY_NAME.get(name, BY_TYPE.get(kind))
    if made is None:
        raise InputError(
            f"Nothing is known of the input '{name}' ({kind}) of {function}: its domain must say what it is."
        )
    return made


@cache
def program_of(file: str, defines: tuple[tuple[str, int], ...] = ()) -> Program:
    """A shader file of glsl/, ready to run its functions."""
    source = load(file)
    return Program(source, parse(preprocessed(source, dict(defines)).text))


def examined(of: Subject, inputs: Inputs, real: Real) -> Examination:
    """Run a function on inputs (N, ...) in a precision and in double precision."""
    count = max(len(part) for value in inputs.values() for part in parts(value).values())
    truth, made = of.evaluate(inputs, np.float64), of.evaluate(inputs, real)
    measure = of.domain.measure
    error, decides, counts = compared(truth.outputs, made.outputs, measure, count)
    step = NUDGE * float(np.finfo(real).eps)
    explained, turned = _cost_of_nudges(of, inputs, truth, step, NUDGES, count)
    doubtful = np.flatnonzero((error > explained + measure.tolerance) | (decides & ~turned))
    if len(doubtful):
        few = {name: taken(value, doubtful) for name, value in inputs.items()}
        again = of.evaluate(few, np.float64)
        explained[doubtful], turned[doubtful] = _cost_of_nudges(of, few, again, step, NUDGES_IN_DOUBT, len(doubtful))
    own = np.where(np.isinf(error), np.inf, np.maximum(error - np.minimum(explained, 1e300), 0.0))
    law = of.domain.law
    lawless = np.zeros(count) if law is None else np.nan_to_num(np.broadcast_to(law(made.outputs), count), nan=np.inf)
    own = np.where(counts & ~turned, own, 0.0)
    first = np.broadcast_to(made.first, count)
    return Examination(error, own, decides & ~turned, counts, lawless, first, made.faults)


def _cost_of_nudges(
    of: Subject, inputs: Inputs, truth: Evaluation, step: float, times: int, count: int
) -> tuple[Array, Array]:
    """The largest change (N,) of the exact result when its inputs move a little, and whether a decision turns."""
    rng = np.random.default_rng(0)
    explained, turned = np.zeros(count), np.zeros(count, bool)
    for _ in range(times):
        nudged = of.evaluate({name: _moved(value, rng, step) for name, value in inputs.items()}, np.float64)
        cost, turns, _ = compared(truth.outputs, nudged.outputs, of.domain.measure, count)
        explained, turned = np.maximum(explained, cost), turned | turns
    return explained, turned


def compared(
    truth: Mapping[str, Value], made: Mapping[str, Value], measure: Measure, count: int
) -> tuple[Array, Array, Array]:
    """Errors (N,) of results, whether decisions in them differ, and whether the error counts.

    Integers and truths are decisions. Where one differs, or where the function returns false, the rest means nothing.
    """
    exact, other = parts(dict(truth)), parts(dict(made))
    error, differs, counts = np.zeros(count), np.zeros(count, bool), np.ones(count, bool)
    for name, value in exact.items():
        if value.dtype.kind == "f":
            error = np.maximum(error, _distance(value, other[name], measure))
        else:
            differs = differs | (value != other[name]).reshape(len(value), -1).any(axis=1)
            if name == "return" and value.dtype == np.bool_:
                counts = counts & (value if len(exact) > 1 else True)
    return np.where(counts & ~differs, error, 0.0), differs, counts & ~differs


def _distance(exact: Array, other: Array, measure: Measure) -> Array:
    with np.errstate(all="ignore"):
        exact = exact.reshape(len(exact), -1)
        distance = np.linalg.norm(other.reshape(len(other), -1).astype(np.float64) - exact, axis=1)
        if measure.is_relative:
            distance = distance / np.maximum(np.linalg.norm(exact, axis=1), measure.floor)
    return np.where(np.isfinite(distance), distance, np.inf)


def _moved(value: Value, rng: np.random.Generator, step: float) -> Value:
    """A value with each number moved by a part of itself, up or down."""
    if isinstance(value, dict):
        return {name: _moved(v, rng, step) for name, v in value.items()}
    value = np.asarray(value)
    if value.dtype.kind != "f":
        return value
    return value * (1.0 + step * rng.choice(np.array([-1.0, 1.0]), value.shape))
