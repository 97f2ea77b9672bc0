"""The built-in functions of GLSL, each operation rounded to the type of its operands.

OpenGL Shading Language 4.60, chapter 8. What it leaves undefined is NaN here, so that a shader that relies on it is
found: the power of a negative number, the angle of (0, 0), a clamp between swapped bounds.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from comparisons.glsl.values import Array, aligned, flushed

Builtin = Callable[..., Array]


def _by_double(function: Callable[[Any], Any]) -> Builtin:
    """A transcendental function, correctly rounded to narrower types: the same on every processor."""
    return lambda x: flushed(function(x.astype(np.float64)).astype(x.dtype))


def _where(condition: Array, value: Array) -> Array:
    """`value` where it is defined, else NaN."""
    return np.where(condition, value, np.array(np.nan, value.dtype))


def _pow(x: Array, y: Array) -> Array:
    x, y = aligned(x, y)
    made = np.power(x.astype(np.float64), y.astype(np.float64)).astype(x.dtype)
    return _where((x > 0) | ((x == 0) & (y > 0)), flushed(made))


def _atan(y: Array, x: Array | None = None) -> Array:
    if x is None:
        return _by_double(np.arctan)(y)
    y, x = aligned(y, x)
    made = np.arctan2(y.astype(np.float64), x.astype(np.float64)).astype(y.dtype)
    return _where((x != 0) | (y != 0), made)


def _min(x: Array, y: Array) -> Array:
    x, y = aligned(x, y)
    return np.where(y < x, y, x)


def _max(x: Array, y: Array) -> Array:
    x, y = aligned(x, y)
    return np.where(x < y, y, x)


def _clamp(x: Array, low: Array, high: Array) -> Array:
    x, low, high = aligned(x, low, high)
    made = _min(_max(x, low), high)
    return made if made.dtype.kind in "iu" else _where(low <= high, made)


def _mix(x: Array, y: Array, a: Array) -> Array:
    x, y, a = aligned(x, y, a)
    if a.dtype == np.bool_:
        return np.where(a, y, x)
    return np.asarray(x * (1 - a) + y * a)


def _step(edge: Array, x: Array) -> Array:
    edge, x = aligned(edge, x)
    return (x >= edge).astype(x.dtype)


def _smoothstep(low: Array, high: Array, x: Array) -> Array:
    low, high, x = aligned(low, high, x)
    zero, one = np.zeros(1, x.dtype), np.ones(1, x.dtype)
    t = _clamp((x - low) / (high - low), zero, one)
    return _where(low < high, t * t * (3 - 2 * t))


def dot(x: Array, y: Array) -> Array:
    """Sum from the first component on, without fused operations."""
    if x.ndim == 1:
        return x * y
    products = x * y
    total = products[:, 0]
    for k in range(1, products.shape[1]):
        total = total + products[:, k]
    return flushed(total)


def _cross(x: Array, y: Array) -> Array:
    return np.asarray(x[:, [1, 2, 0]] * y[:, [2, 0, 1]] - x[:, [2, 0, 1]] * y[:, [1, 2, 0]])


def _length(x: Array) -> Array:
    return np.sqrt(dot(x, x))


def _inversesqrt(x: Array) -> Array:
    return 1 / np.sqrt(_where(x >= 0, x))


def _normalize(x: Array) -> Array:
    vector, scale = aligned(x, _inversesqrt(dot(x, x)))
    return vector * scale


def _reflect(incident: Array, normal: Array) -> Array:
    twice, normal = aligned(2 * dot(normal, incident), normal)
    return np.asarray(incident - twice * normal)


def _faceforward(normal: Array, incident: Array, reference: Array) -> Array:
    return np.where((dot(reference, incident) < 0)[:, None], normal, -normal)


def _refract(incident: Array, normal: Array, eta: Array) -> Array:
    cosine = dot(normal, incident)
    k = 1 - eta * eta * (1 - cosine * cosine)
    scale, _ = aligned(eta * cosine + np.sqrt(np.maximum(k, 0)), normal)
    eta, _ = aligned(eta, incident)
    return np.where((k < 0)[:, None], np.zeros(1, incident.dtype), eta * incident - scale * normal)


def _compared(function: Callable[[Any, Any], Any]) -> Builtin:
    return lambda x, y: function(*aligned(x, y))


def _mod(x: Array, y: Array) -> Array:
    x, y = aligned(x, y)
    return np.asarray(x - y * np.floor(x / y))


BUILTINS: dict[str, Builtin] = {
    "abs": np.abs,
    "sign": np.sign,
    "floor": np.floor,
    "ceil": np.ceil,
    "trunc": np.trunc,
    "round": np.rint,
    "fract": lambda x: x - np.floor(x),
    "mod": _mod,
    "min": _min,
    "max": _max,
    "clamp": _clamp,
    "mix": _mix,
    "step": _step,
    "smoothstep": _smoothstep,
    "sqrt": np.sqrt,
    "inversesqrt": _inversesqrt,
    "pow": _pow,
    "atan": _atan,
    **{name: _by_double(getattr(np, name)) for name in ("exp", "exp2", "log", "log2", "sin", "cos", "tan")},
    **{name: _by_double(getattr(np, name)) for name in ("sinh", "cosh", "tanh", "radians", "degrees")},
    "asin": _by_double(np.arcsin),
    "acos": _by_double(np.arccos),
    "dot": dot,
    "cross": _cross,
    "length": _length,
    "distance": lambda x, y: _length(x - y),
    "normalize": _normalize,
    "reflect": _reflect,
    "refract": _refract,
    "faceforward": _faceforward,
    "lessThan": _compared(np.less),
    "lessThanEqual": _compared(np.less_equal),
    "greaterThan": _compared(np.greater),
    "greaterThanEqual": _compared(np.greater_equal),
    "equal": _compared(np.equal),
    "notEqual": _compared(np.not_equal),
    "any": lambda x: x.any(axis=1),
    "all": lambda x: x.all(axis=1),
    "not": np.logical_not,
    "isnan": np.isnan,
    "isinf": np.isinf,
    "transpose": lambda m: m.transpose(0, 2, 1),
}
