"""What operators, subscripts, fields and constructors of GLSL do with values."""

from collections.abc import Callable
from typing import Any

import numpy as np

from comparisons.glsl.builtins import dot
from comparisons.glsl.machine import Run
from comparisons.glsl.values import Array, Type, Value, aligned, cast, converted, select

SWIZZLES = {letter: k for letters in ("xyzw", "rgba", "stpq") for k, letter in enumerate(letters)}


def divided(a: Array, b: Array) -> Array:
    """Quotients; those of integers are cut towards zero."""
    if a.dtype.kind == "f":
        return np.asarray(a / b)
    safe = np.where(b == 0, 1, b)
    return np.asarray(np.trunc(a / safe).astype(a.dtype))


def times(a: Array, b: Array) -> Array:
    """Products: of two numbers or vectors by components, of matrices as in linear algebra."""
    if a.ndim == 3 and b.ndim == 2:
        return np.stack([dot(a[:, :, r], b) for r in range(a.shape[2])], axis=1)
    if a.ndim == 2 and b.ndim == 3:
        return np.stack([dot(a, b[:, c]) for c in range(b.shape[1])], axis=1)
    if a.ndim == b.ndim == 3:
        return np.stack([times(a, b[:, c]) for c in range(b.shape[1])], axis=1)
    a, b = aligned(a, b)
    return np.asarray(a * b)


def _by_component(function: Callable[[Any, Any], Any]) -> Callable[[Array, Array], Array]:
    return lambda a, b: np.asarray(function(*aligned(a, b)))


def _same(a: Value, b: Value) -> Array:
    if isinstance(a, dict):
        return np.asarray(np.logical_and.reduce([_same(a[name], b[name]) for name in a]))
    a, b = aligned(a, b)
    equal = np.asarray(a == b)
    return np.asarray(equal.reshape(len(equal), -1).all(axis=1))


BINARY: dict[str, Callable[[Any, Any], Array]] = {
    "+": _by_component(np.add),
    "-": _by_component(np.subtract),
    "*": times,
    "/": _by_component(divided),
    "%": _by_component(lambda a, b: np.fmod(a, np.where(b == 0, 1, b))),
    "<": _by_component(np.less),
    "<=": _by_component(np.less_equal),
    ">": _by_component(np.greater),
    ">=": _by_component(np.greater_equal),
    "==": _same,
    "!=": lambda a, b: ~_same(a, b),
    "^^": np.logical_xor,
    "&": _by_component(np.bitwise_and),
    "|": _by_component(np.bitwise_or),
    "^": _by_component(np.bitwise_xor),
    "<<": lambda a, b: np.left_shift(a, b.astype(a.dtype)),
    ">>": lambda a, b: np.right_shift(a, b.astype(a.dtype)),
}


def element(base: Value, index: Array) -> Value:
    """An element of an array, a component of a vector or a column of a matrix; beyond the ends, the last one."""
    count = len(base) if isinstance(base, list) else base.shape[1]
    at = np.clip(index, 0, count - 1)
    items = base if isinstance(base, list) else [base[:, k] for k in range(count)]
    made = items[int(at[0])]
    for k in np.unique(at):
        made = select(at == k, items[k], made)
    return made


def with_element(base: Value, index: Array, value: Value) -> Value:
    """`base` with one element replaced."""
    if isinstance(base, list):
        return [select(index == k, _as(item, value), item) for k, item in enumerate(base)]
    columns = [select(index == k, cast(value, base.dtype.type), base[:, k]) for k in range(base.shape[1])]
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def _as(old: Value, value: Value) -> Value:
    """What takes the place of `old`, in its type."""
    return cast(value, old.dtype.type) if isinstance(value, np.ndarray) else value


def with_field(base: Value, name: str, value: Value) -> Value:
    """`base` with a field of a struct or components of a vector replaced."""
    if isinstance(base, dict):
        return {**base, name: _as(base[name], value)}
    width = max(len(base), len(value))
    made = np.broadcast_to(base, (width, base.shape[1])).copy()
    for k, letter in enumerate(name):
        made[:, SWIZZLES[letter]] = value if value.ndim == 1 else value[:, k]
    return made


def constructed(kind: Type, values: list[Value], run: Run) -> Value:
    """What a constructor makes of its arguments."""
    if kind.length is not None:
        return [converted(value, kind.element, run.real, run.structs) for value in values]
    if kind.name in run.structs:
        fields = zip(run.structs[kind.name], values, strict=True)
        return {name: converted(value, field, run.real, run.structs) for (name, field), value in fields}
    dtype, shape = kind.dtype(run.real), kind.shape or ()
    if len(shape) == 2 and len(values) == 1:
        return cast(_square(values[0], *shape), dtype)
    numbers = [part for value in values for part in value.reshape(len(value), -1).T]
    if shape == ():
        return cast(numbers[0], dtype)
    size = int(np.prod(shape))
    listed = [cast(part, dtype) for part in (numbers * size if len(numbers) == 1 else numbers)[:size]]
    return np.stack(np.broadcast_arrays(*listed), axis=1).reshape(-1, *shape)


def _square(value: Array, columns: int, rows: int) -> Array:
    """A matrix with a number on its diagonal, or the corner of a larger one."""
    if value.ndim == 3:
        return value[:, :columns, :rows]
    return np.asarray(value[:, None, None] * np.eye(columns, rows, dtype=value.dtype))
