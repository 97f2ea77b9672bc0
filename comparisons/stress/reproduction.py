"""The input of a shader function as JSON, and what becomes of it step by step."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from comparisons.glsl.values import Type, Value, parts
from comparisons.stress.examination import Subject
from comparisons.stress.inputs import Inputs, drawn, rounded
from scenes.errors import InputError

PRECISIONS = (np.float16, np.float32, np.float64)
Numbers = tuple[float, ...]
"""Of a scalar, a vector or a matrix."""


def to_json(inputs: Inputs) -> dict[str, Any]:
    """Inputs (1, ...) as JSON, in the digits that single precision needs."""
    return {name: _plain(value) for name, value in inputs.items()}


def _plain(value: Value) -> Any:
    if isinstance(value, dict):
        return to_json(value)
    if isinstance(value, list):
        return [_plain(item) for item in value]
    one = np.asarray(value)[0]
    if one.ndim:
        return [_plain(item[None]) for item in one]
    return float(str(np.float32(one))) if one.dtype.kind == "f" else one.item()


def from_json(of: Subject, text: str) -> dict[str, Value]:
    """Inputs (1, ...) of a function from JSON.

    Raises
    ------
    InputError
        It is no JSON, or not all inputs of the function and nothing else.
    """
    needed = of.program.inputs(of.function)
    try:
        read = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(f"The input is no JSON: {error}. It is written as {example_of(of)}.") from error
    if not isinstance(read, dict) or not needed.keys() <= read.keys() <= needed.keys() | of.kinds.keys():
        given = ", ".join(read) if isinstance(read, dict) else text
        raise InputError(
            f"{of.name} takes {', '.join(needed)}, but the input gives {given}. "
            f"An input is, for instance, {example_of(of)}."
        )
    return {name: _value(of, name, kind, read[name]) for name, kind in needed.items()}


def example_of(of: Subject) -> str:
    """An input of a function in JSON."""
    return json.dumps(to_json(used(of, drawn(of.kinds, np.random.default_rng(1), 1))))


def used(of: Subject, inputs: Inputs) -> Inputs:
    """What a function reads of inputs that were drawn for it."""
    return {name: _fields(of, kind, inputs[name]) for name, kind in of.program.inputs(of.function).items()}


def _fields(of: Subject, kind: Type, value: Value) -> Value:
    if kind.name not in of.program.structs:
        return value
    return {field: _fields(of, inner, value[field]) for field, inner in of.program.structs[kind.name]}


def _value(of: Subject, name: str, kind: Type, given: Any) -> Value:
    if kind.name in of.program.structs:
        fields = of.program.structs[kind.name]
        if not isinstance(given, Mapping) or not {field for field, _ in fields} <= given.keys():
            raise InputError(f"'{name}' of {of.name} is a {kind.name} with {', '.join(field for field, _ in fields)}.")
        return {field: _value(of, f"{name}.{field}", inner, given[field]) for field, inner in fields}
    try:
        made = np.array(given, np.float64 if kind.dtype(np.float32) is np.float32 else kind.dtype(np.float32))
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(f"'{name}' of {of.name} is a {kind.name}, not {given!r}.") from error
    if made.shape != (kind.shape or ()):
        raise InputError(f"'{name}' of {of.name} is a {kind.name}, not {given!r}.")
    return rounded(made[None])


@dataclass(frozen=True)
class Step:
    """One intermediate in each precision: numbers, or None where that precision took another way."""

    place: str
    text: str
    values: tuple[Numbers | None, ...]
    is_wrong: bool


def traced(of: Subject, inputs: Inputs) -> list[Step]:
    """Each intermediate of a function on an input (1, ...), in half, single and double precision.

    A step is wrong if a number is not finite in single or double precision, or if single precision differs from
    double by more than a part in a thousand.
    """
    runs = [of.evaluate(inputs, real, traced=True).trace for real in PRECISIONS]
    steps = []
    for k, (site, exact) in enumerate(runs[2]):
        values = [run[k][1] if k < len(run) and run[k][0] == site else None for run in runs]
        numbers = tuple(None if v is None else _listed(v) for v in values)
        steps.append(Step(f"{site.file}:{site.line}", site.text, numbers, _is_wrong(values[1], exact)))
    return steps


def _is_wrong(single: Value | None, exact: Value) -> bool:
    if single is None:
        return True
    with np.errstate(all="ignore"):
        distance = np.abs(np.asarray(single, np.float64) - exact).max()
        size = np.abs(np.asarray(exact, np.float64)).max()
    return not np.isfinite(size) or not distance <= 1e-3 * size


def results(of: Subject, inputs: Inputs) -> dict[str, tuple[Numbers, ...]]:
    """What a function gives in half, single and double precision, by the names of its results and their fields."""
    half, single, double = (parts(of.evaluate(inputs, real).outputs) for real in PRECISIONS)
    return {name: tuple(_listed(made[name]) for made in (half, single, double)) for name in double}


def _listed(value: Value) -> Numbers:
    return tuple(float(x) for x in np.ravel(value))
