"""What is usually wrong with an image from another program: turned, moved, encoded, scaled.

Each `Suspicion` mends an image as if it were so. Where that surely takes most of the error away, it is the likely
cause. Causes are looked for one after the other, each in what the former has mended: an image may be upside down and in
other units as well.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from comparisons.gate import fit_exposure
from comparisons.image_files import ColorSpace
from comparisons.metrics import Estimate, Samples
from comparisons.metrics.shift_px import moved
from comparisons.statistics import squared_errors
from scenes import srgb
from scenes.errors import ImageError
from scenes.image import Bool, Float64

EXPLAINS = 0.25
"""A cause takes at least three quarters of the squared error away: half of the error."""

MOST_CAUSES = 4

LARGEST_MOVE = 2
"""Half pixels to either side."""

NO_ERROR = 1e-12
"""That share of a squared error is left by rounding."""

NAMED_FACTORS = {
    683.0: "683 lm/W: photometric against radiometric units",
    math.pi: "π: the irradiance of a Lambertian surface against its radiance",
    2 * math.pi: "2 π: a hemisphere",
    4 * math.pi: "4 π: a light's whole power against its intensity",
    100.0: "centimetres against metres",
    1000.0: "millimetres against metres",
}
LOOKS_ENCODED: dict[ColorSpace, str] = {
    "linear": "its values look sRGB-encoded: save linear ones, or say --color-space srgb",
    "srgb": "its values look sRGB-encoded twice: save them without a display transform",
}
LOOKS_DECODED: dict[ColorSpace, str] = {
    "linear": "its values look decoded from sRGB although they were linear: save them as they are rendered",
    "srgb": "its values look linear already: say --color-space linear",
}

FACTOR_TOLERANCE = 0.03


Mend = Callable[[Float64], Float64]
"""Undoes a fault in an image (H, W, C)."""


@dataclass(frozen=True)
class Suspicion:
    """A fault in words, and what undoes it; a move has an `opposite`, and an image in another scale a `factor`.

    Moving an image takes noise away, as it interpolates, whichever way it is moved. Only a real move gets worse by the
    opposite one: that is what a move is held against.
    """

    says: str
    mend: Mend
    opposite: Mend | None = None
    factor: float = 1.0


@dataclass(frozen=True)
class Diagnosis:
    """Faults that explain most of an error, in words; how many times too large all values are; the image without both.

    falls_by : how many times smaller the root mean square error of `mended` is.
    """

    causes: tuple[str, ...]
    factor: float
    mended: Float64
    falls_by: float

    @property
    def sentences(self) -> tuple[str, ...]:
        return self.causes if self.factor == 1 else (*self.causes, factor_says(self.factor))


def diagnose(image: Float64, samples: Samples, *, read_as: ColorSpace | None) -> Diagnosis:
    """What surely explains most of the error of a finite image (H, W, C).

    read_as : what the values of a colour image were taken for; None if it shows no colours.
    """
    found = Diagnosis((), 1.0, image, 1.0)
    for _ in range(MOST_CAUSES):
        simple = _best(found.mended, samples, _simple_suspicions(found.mended, samples, read_as))
        both = _best(found.mended, samples, _turned_and_scaled(found.mended, samples))
        if both is not None and (simple is None or simple[1] < both[1] * math.sqrt(EXPLAINS)):
            simple = both
        if simple is None:
            break
        suspicion, falls_by = simple
        found = Diagnosis(
            found.causes + ((suspicion.says,) if suspicion.says else ()),
            found.factor * suspicion.factor,
            suspicion.mend(found.mended),
            found.falls_by * falls_by,
        )
    return found


def _best(image: Float64, samples: Samples, suspicions: Iterable[Suspicion]) -> tuple[Suspicion, float] | None:
    """The suspicion that makes the error fall most, and by what; None if none surely explains most of it."""
    away_from_edges = _eroded(samples.mask, LARGEST_MOVE)
    inner = replace(samples, mask=away_from_edges) if away_from_edges.any() else None
    found = []
    for suspicion in suspicions:
        judged = samples if suspicion.opposite is None else inner
        if judged is None:
            continue
        mended_image = suspicion.mend(image)
        if _distance(mended_image, judged) >= _distance(image, judged):
            continue
        before, mended = _squared_error(image, judged), _squared_error(mended_image, judged)
        bar = before if suspicion.opposite is None else _squared_error(suspicion.opposite(image), judged)
        if mended.high < EXPLAINS * bar.low and mended.high < before.low:
            least = max(mended.value, mended.high - mended.value, NO_ERROR * before.value)
            found.append((suspicion, math.sqrt(before.value / least)))
    return max(found, key=lambda pair: pair[1], default=None)


def _distance(image: Float64, samples: Samples) -> float:
    """Mean squared difference from the mean of the truth, noise included: quick, and enough to see what is no help."""
    return float(np.mean((image[samples.mask] - samples.masked.mean(axis=0)) ** 2))


def _squared_error(image: Float64, samples: Samples) -> Estimate:
    """Mean squared error at the judged pixels, without the truth's noise."""
    differences = image[samples.mask] - samples.masked
    if samples.is_exact:
        return Estimate.exact(float(np.mean(np.sum(differences[0] ** 2, axis=1))))
    errors = squared_errors(differences)
    value, half_width = float(errors.values.mean()), errors.half_width(samples.alpha)
    return Estimate(value, value - half_width, value + half_width)


def _simple_suspicions(image: Float64, samples: Samples, read_as: ColorSpace | None) -> Iterator[Suspicion]:
    yield from _turns(image)
    steps = range(-LARGEST_MOVE, LARGEST_MOVE + 1)
    for right, down in ((x / 2, y / 2) for x in steps for y in steps if (x, y) != (0, 0)):
        there, opposite = (partial(_moved_back, sign * right, sign * down) for sign in (1, -1))
        yield Suspicion(_moved_says(right, down), there, opposite)
    judged = image[samples.mask]
    if read_as is not None and judged.min() >= 0 and judged.max() <= 1:
        yield Suspicion(LOOKS_ENCODED[read_as], srgb.decode)
        yield Suspicion(LOOKS_DECODED[read_as], srgb.encode)
    factor = _factor(image, samples)
    if factor is not None:
        yield Suspicion("", partial(np.multiply, factor), factor=1 / factor)


def _turns(image: Float64) -> Iterator[Suspicion]:
    yield Suspicion("it is upside down: row 0 must be the top one", lambda x: x[::-1])
    yield Suspicion("it is mirrored, left against right: see that both use right-handed axes", lambda x: x[:, ::-1])
    yield Suspicion("it is turned by 180 degrees", lambda x: x[::-1, ::-1])
    if image.shape[0] == image.shape[1]:
        yield Suspicion("its rows and columns are swapped", lambda x: x.swapaxes(0, 1))


def _turned_and_scaled(image: Float64, samples: Samples) -> Iterator[Suspicion]:
    """A factor that is fitted to an image of the wrong side up says nothing."""
    for turn in _turns(image):
        turned = turn.mend(image)
        factor = _factor(turned, samples)
        if factor is not None:
            yield Suspicion(turn.says, partial(_turned_times, turn.mend, factor), factor=1 / factor)


def _turned_times(turn: Mend, factor: float, image: Float64) -> Float64:
    return factor * turn(image)


def _moved_says(right: float, down: float) -> str:
    ways = [(right, "right", "left"), (down, "down", "up")]
    moves = [f"{abs(by):g} px {there if by > 0 else back}" for by, there, back in ways if by]
    return f"it is moved by about {' and '.join(moves)}: a pixel's centre lies at +0.5, and the camera must be the same"


def _moved_back(right: float, down: float, image: Float64) -> Float64:
    return moved(image, np.array([down, right]))


def _factor(image: Float64, samples: Samples) -> float | None:
    """What the image is to be multiplied by, if that says anything."""
    try:
        return fit_exposure(image, samples)
    except ImageError:  # black, or nothing in common with the truth
        return None


def factor_says(factor: float) -> str:
    """How much too large all values are.

    >>> factor_says(99.0)
    'all its values are about 99 times too large (centimetres against metres)'
    """
    size = f"{factor:.4g} times too large" if factor > 1 else f"{1 / factor:.4g} times too small"
    larger = max(factor, 1 / factor)
    named = [f" ({why})" for value, why in NAMED_FACTORS.items() if abs(larger / value - 1) < FACTOR_TOLERANCE]
    return f"all its values are about {size}{''.join(named)}"


def _eroded(mask: Bool, pixels: int) -> Bool:
    """The pixels of the mask so far away from its border."""
    from scipy.ndimage import binary_erosion

    inner: Bool = binary_erosion(mask, np.ones((3, 3)), iterations=pixels)
    return inner
