"""The settings with the least error where there are many: what each does to every pixel is known.

An error that is a sum of squares over pixels has a model that one number for each setting does not give: with one more
drawing for each setting, the change of every pixel with each of them is known, and with it a quadratic model of the
whole error. The trust-region reflective method follows it within bounds (Branch, Coleman, Li 1999, "A Subspace,
Interior, and Conjugate Gradient Method for Large-Scale Bound-Constrained Minimization Problems"). Such an error has
many minima: the search goes a few steps from several places, and then on from the best of them. Nearly all of this is
done with errors that are quick to have; the last steps follow the true ones.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from scenes.image import Float64

Residuals = Callable[[Float64], Float64]
"""What the pixels (R,) are off at some places (N,), in units in which the sum of squares is the error."""

STEP = 2e-3
"""Of a range: by this a place is moved to see the change. Much less would be lost in the rounding of the pixels."""

STARTS = 6
FIRST_PART, LAST_STEPS = 0.4, 4
"""What the first steps from several starts may take of all evaluations, and how many steps are taken last."""

INSIDE = 1e-3
"""How far from an end a start is moved: the method needs its starts within the bounds."""


def least_squares_from(
    starts: Sequence[Sequence[float]], rough: Residuals, fine: Residuals, evaluations: int
) -> Float64:
    """The places with the least error that `evaluations` drawings find, and the last steps.

    Parameters
    ----------
    starts : places, the best one first; the first `STARTS` are followed.
    rough, fine : much the same, but the rough ones are quicker to have.
    """
    first = [_followed(start, rough, int(FIRST_PART * evaluations / STARTS)) for start in starts[:STARTS]]
    best = min(first, key=lambda places: float(np.sum(rough(places) ** 2)))
    near = _followed(best, rough, int((1 - FIRST_PART) * evaluations))
    return _followed(near, fine, LAST_STEPS * (1 + len(near)))


def _followed(start: Sequence[float] | Float64, residuals: Residuals, evaluations: int) -> Float64:
    """Downhill from `start`. A step takes one drawing, and one more for each setting."""
    from scipy.optimize import least_squares

    begin: Float64 = np.clip(np.asarray(start, dtype=float), INSIDE, 1 - INSIDE)
    steps = evaluations // (1 + len(begin))
    if steps < 1:
        return begin
    found = least_squares(residuals, begin, jac=partial(_changes, residuals), bounds=(0.0, 1.0), max_nfev=steps)
    places: Float64 = found.x
    return places


def _changes(residuals: Residuals, places: Float64) -> Float64:
    """What each place changes (R, N): by a step away from the nearer end."""
    here = residuals(places)
    columns = []
    for index, place in enumerate(places):
        step = STEP if place < 0.5 else -STEP
        moved = places.copy()
        moved[index] += step
        columns.append((residuals(moved) - here) / step)
    return np.stack(columns, axis=1)
