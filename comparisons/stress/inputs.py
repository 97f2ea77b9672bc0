"""Kinds of inputs of shader functions: how they are drawn, what is extreme about them, and which are simple.

Inputs are drawn one after another, so that one can depend on those before it: a normal that faces a ray, a height that
is a part of a radius. All are arrays (N, ...) of float64 or int64, structs are dicts of them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from comparisons.glsl.values import Array, Value

Rng = np.random.Generator
Inputs = Mapping[str, Value]

NEARLY_ONE = (1 - 2.0**-24, 1 + 2.0**-23)
"""The numbers of single precision next to 1: what rounding makes of the cosine of no angle."""


@dataclass(frozen=True)
class Kind:
    """What an input may be.

    draw : (rng, N, reach, inputs before) -> values in use; `reach` widens ranges that have no end of their own
    extremes : (rng, N, inputs before) -> values at the ends of what is allowed, or None if there are no ends
    simple : (a value (1, ...), inputs before) -> values (1, ...) that are easier to read, the easiest first
    allows : (a value (1, ...), inputs before) -> whether it fits those before it
    meant : (values in single precision) -> what they stand for: directions have a length of exactly 1
    """

    draw: Callable[[Rng, int, float, Inputs], Value]
    extremes: Callable[[Rng, int, Inputs], Value] | None = None
    simple: Callable[[Value, Inputs], Sequence[Value]] = lambda value, made: ()
    allows: Callable[[Value, Inputs], bool] = lambda value, made: True
    meant: Callable[[Value], Value] = lambda value: value


def number(low: float, high: float, *extremes: float, log: bool = False) -> Kind:
    """A float from low to high, with its ends as extremes; `log`: over orders of magnitude, which `reach` adds to."""
    ends = np.array([low, high, *extremes])

    def draw(rng: Rng, count: int, reach: float, made: Inputs) -> Array:
        if log:
            return np.exp(rng.uniform(np.log(low / reach), np.log(high * reach), count))
        return rng.uniform(low, high, count)

    def simple(value: Value, made: Inputs) -> list[Array]:
        candidates = [1.0, 0.0, 0.5, 2.0, 10.0, *(_shortened(float(value[0]), digits) for digits in (1, 2, 3))]
        bounds = (min(low, float(value[0])), max(high, float(value[0])))
        return [np.array([x]) for x in candidates if bounds[0] <= x <= bounds[1]]

    return Kind(draw, lambda rng, count, made: rng.choice(ends, count), simple)


def whole(low: int, high: int) -> Kind:
    """An integer from low to high, both included."""
    return Kind(
        lambda rng, count, reach, made: rng.integers(low, high + 1, count),
        lambda rng, count, made: rng.choice(np.array([low, high]), count),
        lambda value, made: [np.array([x]) for x in (low, *range(low + 1, min(low + 4, high + 1)))],
    )


def choice(*values: float) -> Kind:
    """One of some numbers."""
    listed = np.array(values)
    return Kind(lambda rng, count, reach, made: rng.choice(listed, count))


def cosine() -> Kind:
    """A cosine in [0, 1], or what rounding makes of one."""
    return number(0.0, 1.0, -0.0, 1e-20, 1e-7, 1e-3, *NEARLY_ONE)


_AXES = np.concatenate([np.eye(3), -np.eye(3)])
_SPECIAL = np.concatenate(
    [_AXES, [[1, 1, 1], [1, -1, 0], [0, 1, 1e-4], [1e-4, 1, 0], [1e-20, 1, 0], [0, 0.9, -0.435889894]]]
)


def unit() -> Kind:
    """A direction; the extremes are the axes, diagonals, and what is next to them."""
    return Kind(
        lambda rng, count, reach, made: unit_of(rng.normal(size=(count, 3))),
        lambda rng, count, made: unit_of(rng.choice(_SPECIAL, count)),
        lambda value, made: _simple_directions(value),
        meant=unit_of,
    )


def facing(other: str, sign: float = -1.0) -> Kind:
    """A direction against the one named `other`, or with it if `sign` is 1: straight and grazing ones are extreme."""

    def draw(rng: Rng, count: int, reach: float, made: Inputs) -> Array:
        d = unit_of(rng.normal(size=(count, 3)))
        return d * np.where(np.sign(dot(d, made[other])) == sign, 1.0, -1.0)[:, None]

    def extremes(rng: Rng, count: int, made: Inputs) -> Array:
        axis = unit_of(made[other]) * sign
        across = unit_of(np.cross(axis, unit_of(rng.normal(size=(count, 3)))))
        sine = rng.choice(np.array([0.0, 1e-7, 1e-4]), count)[:, None]
        grazing = rng.choice(np.array([0.0, 1e-7, 1e-4]), count)[:, None]
        return np.where(rng.random((count, 1)) < 0.5, unit_of(axis + sine * across), unit_of(across + grazing * axis))

    def simple(value: Value, made: Inputs) -> list[Array]:
        straight = unit_of(made[other]) * sign
        return [straight, *(d for d in _simple_directions(value) if allows(d, made))]

    def allows(value: Value, made: Inputs) -> bool:
        return bool(sign * dot(value, made[other])[0] >= 0)

    return Kind(draw, extremes, simple, allows, unit_of)


def or_opposite(kind: Kind, other: str) -> Kind:
    """A direction of a kind, or the opposite of the one named `other`."""
    assert kind.extremes is not None
    extremes = kind.extremes
    return Kind(
        kind.draw,
        lambda rng, count, made: np.where(rng.random((count, 1)) < 0.3, -made[other], extremes(rng, count, made)),
        lambda value, made: [-made[other], *kind.simple(value, made)],
        lambda value, made: bool((value == -made[other]).all()) or kind.allows(value, made),
        unit_of,
    )


def place(low: float, high: float) -> Kind:
    """A point or an unnormalised vector in any direction, as long as low to high over orders of magnitude."""
    length = number(low, high, log=True)
    return Kind(
        lambda rng, count, reach, made: (
            unit_of(rng.normal(size=(count, 3))) * length.draw(rng, count, reach, made)[:, None]
        ),
        lambda rng, count, made: unit_of(rng.choice(_SPECIAL, count)) * rng.choice(np.array([low, high]), (count, 1)),
        lambda value, made: _simple_places(value),
    )


def colour(low: float, high: float) -> Kind:
    """Three numbers over orders of magnitude, of which some are 0."""
    part = number(low, high, log=True)

    def draw(rng: Rng, count: int, reach: float, made: Inputs) -> Array:
        made_ = np.stack([part.draw(rng, count, reach, made) for _ in range(3)], axis=1)
        return made_ * (rng.random((count, 3)) > 0.05)

    return Kind(
        draw,
        lambda rng, count, made: rng.choice(np.array([0.0, low, high]), (count, 3)),
        lambda value, made: [np.ones((1, 3)), np.array([[_shortened(x, 1) for x in value[0]]])],
    )


def vector(*kinds: Kind) -> Kind:
    """A vector whose components are those of the kinds, one after another."""

    def joined(values: Sequence[Array]) -> Array:
        return np.concatenate([v.reshape(len(v), -1) for v in values], axis=1)

    def extremes(rng: Rng, count: int, made: Inputs) -> Array:
        return joined([_either(rng, kind, count, made, 0.5) for kind in kinds])

    def simple(value: Value, made: Inputs) -> list[Array]:
        found = []
        for k, kind in enumerate(kinds):
            at = [_width(kind, made) for kind in kinds]
            start, end = sum(at[:k]), sum(at[: k + 1])
            own = value[:, start] if end - start == 1 else value[:, start:end]
            found += [joined([value[:, :start], v, value[:, end:]]) for v in kind.simple(own, made)]
        return found

    def meant(value: Array) -> Array:
        ends = np.cumsum([0] + [_width(kind, {}) for kind in kinds])
        own = [value[:, a:b] for a, b in pairwise(ends)]
        return joined([kind.meant(v if v.shape[1] > 1 else v[:, 0]) for kind, v in zip(kinds, own, strict=True)])

    return Kind(
        lambda rng, n, reach, made: joined([k.draw(rng, n, reach, made) for k in kinds]), extremes, simple, meant=meant
    )


def struct(**fields: Kind) -> Kind:
    """A struct of those fields, which may depend on each other in that order."""

    def draw(rng: Rng, count: int, reach: float, made: Inputs) -> Value:
        values: dict[str, Value] = {}
        for name, kind in fields.items():
            values[name] = kind.draw(rng, count, reach, {**made, **values})
        return values

    def extremes(rng: Rng, count: int, made: Inputs) -> Value:
        values: dict[str, Value] = {}
        for name, kind in fields.items():
            values[name] = _either(rng, kind, count, {**made, **values}, 0.3)
        return values

    def simple(value: Value, made: Inputs) -> list[Value]:
        candidates = []
        for name, kind in fields.items():
            candidates += [{**value, name: v} for v in kind.simple(value[name], {**made, **value})]
        return candidates

    def meant(value: Value) -> Value:
        return {name: fields[name].meant(part) for name, part in value.items()}

    return Kind(draw, extremes, simple, meant=meant)


def derived(function: Callable[[Inputs], Value], meant: Callable[[Value], Value] = lambda value: value) -> Kind:
    """What follows from the inputs before it."""

    def draw(rng: Rng, count: int, reach: float, made: Inputs) -> Value:
        return function(made)

    return Kind(draw, None, lambda value, made: [function(made)], lambda value, made: False, meant)


def scaled(kind: Kind, by: Callable[[Inputs], Array]) -> Kind:
    """Values of a kind times something that follows from the inputs before it."""

    def times(value: Value, made: Inputs) -> Array:
        factor = by(made)
        return np.asarray(value * factor.reshape(factor.shape + (1,) * (value.ndim - 1)))

    extremes = kind.extremes
    return Kind(
        lambda rng, count, reach, made: times(kind.draw(rng, count, reach, made), made),
        None if extremes is None else lambda rng, count, made: times(extremes(rng, count, made), made),
        lambda value, made: [times(v, made) for v in kind.simple(times(value, made) / by(made)[0] ** 2, made)],
    )


def drawn(kinds: Mapping[str, Kind], rng: Rng, count: int, reach: float = 1.0, extremes: int = 0) -> dict[str, Value]:
    """Inputs of a function, in single precision: in use, or with that many of them at their extremes."""
    with_ends = [name for name, kind in kinds.items() if kind.extremes is not None]
    order = np.argsort(rng.random((count, len(with_ends))), axis=1) if with_ends else np.zeros((count, 0))
    made: dict[str, Value] = {}
    for name, kind in kinds.items():
        value = kind.draw(rng, count, reach, made)
        if extremes and kind.extremes is not None:
            forced = order[:, with_ends.index(name)] < extremes
            value = _mixed(forced, kind.extremes(rng, count, made), value)
        made[name] = rounded(value)
    return made


def rounded(value: Value) -> Value:
    """Floats as single precision holds them, for a shader gets them so; normal numbers only."""
    if isinstance(value, dict):
        return {name: rounded(v) for name, v in value.items()}
    value = np.asarray(value)
    if value.dtype.kind != "f":
        return value
    single = value.astype(np.float32)
    return np.where(np.abs(single) < np.finfo(np.float32).tiny, 0.0 * single, single).astype(np.float64)


def taken(value: Value, which: Array) -> Value:
    """Some of N values, by their indices."""
    if isinstance(value, dict):
        return {name: taken(v, which) for name, v in value.items()}
    return np.asarray(value)[which]


def lane(value: Value, index: int) -> Value:
    """One of N values, with N = 1."""
    return taken(value, np.array([index]))


def dot(a: Array, b: Array) -> Array:
    """Of vectors (N, 3), one for each."""
    return np.asarray(np.sum(a * b, axis=-1))


def unit_of(v: Array) -> Array:
    """Vectors (N, 3) scaled to length 1."""
    return np.asarray(v / np.sqrt(np.sum(v * v, axis=-1, keepdims=True)))


def _either(rng: Rng, kind: Kind, count: int, made: Inputs, share: float) -> Value:
    value = kind.draw(rng, count, 1.0, made)
    return value if kind.extremes is None else _mixed(rng.random(count) < share, kind.extremes(rng, count, made), value)


def _mixed(mask: Array, a: Value, b: Value) -> Value:
    if isinstance(a, dict):
        return {name: _mixed(mask, v, b[name]) for name, v in a.items()}
    return np.where(mask.reshape(mask.shape + (1,) * (np.asarray(a).ndim - 1)), a, b)


def _width(kind: Kind, made: Inputs) -> int:
    return int(np.size(kind.draw(np.random.default_rng(0), 1, 1.0, made)))


def _shortened(x: float, digits: int) -> float:
    return float(f"{x:.{digits}g}")


def _simple_directions(value: Value) -> list[Array]:
    rough = [np.asarray(np.round(value, digits)) for digits in (0, 1, 2)]
    return [np.eye(3)[k : k + 1] for k in (1, 0, 2)] + [unit_of(v) for v in rough if np.linalg.norm(v) > 0]


def _simple_places(value: Value) -> list[Array]:
    size = float(np.linalg.norm(value))
    along = [size * np.eye(3)[k : k + 1] for k in (1, 0, 2)]
    return [np.array([[_shortened(x, 1) for x in v[0]]]) for v in (*along, value)]
