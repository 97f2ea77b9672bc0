"""Values of GLSL for many invocations at once, with NumPy.

The first axis of every array are the invocations: as many as there are, or 1 for what is the same in all. A scalar is
an array (L,), a vector (L, k), a matrix (L, columns, rows); an array of GLSL is a list of values, a struct a dict by
the names of its fields.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

Value = Any
Array = np.ndarray[Any, np.dtype[Any]]
Structs = Mapping[str, tuple[tuple[str, "Type"], ...]]
"""The fields of each struct, in order."""

_VECTOR = re.compile(r"([biud]?)vec([234])")
_MATRIX = re.compile(r"mat([234])(?:x([234]))?")
_SCALARS = {"float": "", "bool": "b", "int": "i", "uint": "u"}


@dataclass(frozen=True)
class Type:
    """`name` as in GLSL; `length` of an array of it: None for none, 0 for one of any length."""

    name: str
    length: int | None = None

    @classmethod
    def parse(cls, text: str) -> Self:
        """A type as a declaration writes it: 'vec3', 'float[9]', 'vec2[]'."""
        name, bracket, size = text.partition("[")
        return cls(name.strip(), int(size.rstrip("] ") or 0) if bracket else None)

    @property
    def element(self) -> "Type":
        return Type(self.name)

    @property
    def shape(self) -> tuple[int, ...] | None:
        """Of one invocation; None for structs and void."""
        if self.name in _SCALARS:
            return ()
        if vector := _VECTOR.fullmatch(self.name):
            return (int(vector[2]),)
        if matrix := _MATRIX.fullmatch(self.name):
            return (int(matrix[1]), int(matrix[2] or matrix[1]))
        return None

    def dtype(self, real: type[np.floating[Any]]) -> type[np.generic]:
        vector = _VECTOR.fullmatch(self.name)
        letter = vector[1] if vector else _SCALARS.get(self.name, "")
        kinds: dict[str, type[np.generic]] = {"b": np.bool_, "i": np.int32, "u": np.uint32}
        return kinds.get(letter, real)


def undefined(kind: Type, real: type[np.floating[Any]], structs: Structs) -> Value:
    """What a variable holds before something is assigned: NaN, 0 or false."""
    if kind.length is not None:
        return [undefined(kind.element, real, structs) for _ in range(kind.length)]
    if kind.name in structs:
        return {name: undefined(field, real, structs) for name, field in structs[kind.name]}
    dtype = kind.dtype(real)
    return np.full((1, *(kind.shape or ())), np.nan if dtype is real else 0, dtype)


def converted(value: Value, kind: Type, real: type[np.floating[Any]], structs: Structs) -> Value:
    """A value as a parameter, variable or field of that type takes it: its floats are rounded to `real`."""
    if isinstance(value, list):
        return [converted(v, kind.element, real, structs) for v in value]
    if isinstance(value, dict):
        return {name: converted(value[name], field, real, structs) for name, field in structs[kind.name]}
    return cast(np.asarray(value), kind.dtype(real))


def cast(value: Array, dtype: type[np.generic]) -> Array:
    """Conversion between scalar types. A float that is no integer of 32 bits becomes one of its ends, NaN 0."""
    if value.dtype.kind == "f" and np.dtype(dtype).kind in "iu":
        limits = np.iinfo(np.dtype(dtype).name)
        whole = np.nan_to_num(np.trunc(value.astype(np.float64)))
        return np.asarray(np.clip(whole, limits.min, limits.max).astype(dtype))
    return value.astype(dtype, copy=False)


def flushed(value: Array) -> Array:
    """Single precision without subnormal numbers, as GPUs compute; half and double precision keep them."""
    if value.dtype != np.float32:
        return value
    return np.asarray(np.where(np.abs(value) < np.finfo(np.float32).tiny, np.float32(0.0) * value, value))


def aligned(*values: Array) -> tuple[Array, ...]:
    """Operands with scalars widened to the rank of vectors, and integers to floats beside floats."""
    rank = max(v.ndim for v in values)
    floats = [v.dtype for v in values if v.dtype.kind == "f"]
    made = []
    for v in values:
        wide = v.reshape(v.shape + (1,) * (rank - v.ndim))
        made.append(wide.astype(floats[0]) if floats and wide.dtype.kind in "iu" else wide)
    return tuple(made)


def select(mask: Array, chosen: Value, other: Value) -> Value:
    """`chosen` in the invocations of `mask` (L,), `other` in the rest."""
    if isinstance(chosen, list):
        return [select(mask, a, b) for a, b in zip(chosen, other, strict=True)]
    if isinstance(chosen, dict):
        return {name: select(mask, a, other[name]) for name, a in chosen.items()}
    if mask.all():
        return chosen
    return np.where(mask.reshape(mask.shape + (1,) * (chosen.ndim - 1)), chosen, other)


def parts(value: Value, name: str = "") -> dict[str, Array]:
    """The arrays that a value consists of, by their path: 'x', 'x.point' of a struct, 'x[2]' of an array."""
    if isinstance(value, list):
        return {k: v for i, item in enumerate(value) for k, v in parts(item, f"{name}[{i}]").items()}
    if isinstance(value, dict):
        return {k: v for field, item in value.items() for k, v in parts(item, f"{name}.{field}".lstrip(".")).items()}
    return {name: value}


def is_finite(value: Value) -> Array:
    """(L,): whether all numbers of a value are finite."""
    made = np.ones(1, bool)
    for part in parts(value).values():
        if part.dtype.kind == "f":
            made = made & np.isfinite(part).reshape(len(part), -1).all(axis=1)
    return made
