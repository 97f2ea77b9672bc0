"""Metamorphic laws: what becomes of the image of a technique when the scene is changed in a way whose effect is known.

Chen, Cheung & Yiu 1998, "Metamorphic Testing: A New Approach for Generating Next Test Cases". Each law draws a subject
under a stress of some magnitude, and returns how far it is from what must hold.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from comparisons.stress import transforms
from comparisons.stress.laws import Case, Subject
from comparisons.stress.slivers import with_meshes
from scenes.errors import InputError
from scenes.image import Float64
from scenes.model import AreaLight, Scene
from scenes.placing import moved, vec3

Law = Callable[[Subject, float], float]

AXIS = (0.3, 0.8, -0.5)
"""An odd axis: no plane of a room or of a grid is parallel to it."""

DIRECTION = (0.48, 0.6, 0.64)
"""An odd direction, of length 1."""

NUDGE_DEG = 1e-4
"""Turns what is seen by less than a hundredth of a pixel, and by more than what float32 rounds."""

VECTORS = ("normal", "hair_geometry", "hair_tangent")
"""Quantities that turn with the scene."""

EVEN = 1e-3
"""Pixels differ by this part of the brightest at least, where their deviation is what an error is measured by."""

STRIP_ROWS = 3
"""Rows on either side of the middle between whose means that of a strip must lie."""


def unchanged(change: Callable[..., Scene]) -> Law:
    """The image stays as it is."""
    return lambda subject, m: subject.difference(subject.draw(subject.case.of(change, m)), subject.base)


def scale(subject: Subject, factor: float) -> float:
    """Lengths grow with the scene, all else stays."""
    expected = subject.base * (factor if subject.is_length else 1.0)
    return subject.difference(subject.draw(subject.case.of(transforms.scaled, factor)), expected)


def offset(subject: Subject, distance: float) -> float:
    """Where the origin lies is nobody's business."""
    by = vec3(distance * transforms.viewing_distance(subject.case.scene) * np.array(DIRECTION))
    return subject.difference(subject.draw(subject.case.of(moved, by)), subject.base)


def rotation(subject: Subject, degrees: float) -> float:
    """Vectors turn with the scene, all else stays."""
    rotation = transforms.axis_rotation(AXIS, degrees)
    expected = subject.base @ rotation.T if subject.quantity in VECTORS else subject.base
    return subject.difference(subject.draw(subject.case.of(transforms.turned, rotation)), expected)


def exposure(subject: Subject, factor: float) -> float:
    """Radiance is linear in what is emitted; what is no radiance stays."""
    expected = subject.base * (factor if subject.is_radiance else 1.0)
    return subject.difference(subject.draw(subject.case.of(transforms.exposed, factor)), expected)


def pinhole(subject: Subject, factor: float) -> float:
    """A lens of no width is a pinhole."""
    expected = subject.draw(subject.case.of(transforms.with_pinhole))
    return subject.difference(subject.draw(subject.case.of(transforms.with_aperture, factor)), expected)


def small_light(subject: Subject, size: float) -> float:
    """A ball of light of no radius is a point of light."""
    points = subject.case.of(transforms.with_points)
    radius = size * transforms.viewing_distance(points.scene)
    return subject.difference(subject.draw(points.of(transforms.with_balls, radius)), subject.draw(points))


def black(change: Callable[..., Scene]) -> Law:
    """Nothing is left to see."""

    def law(subject: Subject, magnitude: float) -> float:
        image = subject.draw(subject.case.of(change))
        return float(np.abs(image).max()) / float(np.abs(subject.base).mean())

    return law


def white_sky(subject: Subject, radiance: float) -> float:
    """Under a sky of one radiance, what absorbs nothing sends out no more than that, however light bounces."""
    scene = transforms.exposed(transforms.under_white_sky(subject.case.scene), radiance)
    image = subject.draw(Case(scene, subject.case.settings))
    if not image.any():
        raise InputError("the technique knows no light from the sky")
    return float(image.max()) / radiance - 1


def glowing_room(subject: Subject, reflectance: float) -> float:
    """In a closed room whose walls emit 1, no radiance exceeds 1 / (1 - reflectance): the series of its bounces.

    What has bounced before is reflectance / (1 - reflectance) of that, and the subject reflects its part of it.
    """
    bound = reflectance**2 / (1 - reflectance)
    image = subject.draw(subject.case.of(transforms.glowing_room, reflectance))
    return float(image.max()) / bound - 1


def wide_lens(subject: Subject, factor: float) -> float:
    """Blur is a mean: no pixel is brighter than the brightest emitter."""
    scene = transforms.with_aperture(subject.case.scene, factor)
    brightest = max(max(light.radiance) for light in scene.emitters if isinstance(light, AreaLight))
    return float(subject.draw(Case(scene, subject.case.settings)).max()) / brightest - 1


def continuous(change: Callable[[Scene, float], Scene]) -> Law:
    """Where a surface is only just seen or lit, a nudge far below a pixel changes nothing much."""

    def law(subject: Subject, angle: float) -> float:
        image, nudged = (subject.draw(subject.case.of(change, 90 - angle + nudge)) for nudge in (0, NUDGE_DEG))
        if not image.any():
            raise InputError("nothing is seen from there, or by that light")
        return subject.difference(nudged, image)

    return law


def slivers(subject: Subject, height: float) -> float:
    """The same surface, however it is cut into triangles."""
    with tempfile.TemporaryDirectory() as folder:
        whole, cut = (subject.draw(subject.case.of(with_meshes, Path(folder), each)) for each in (None, height))
    return subject.difference(cut, whole)


def setting(name: str, of: Callable[[float], Any]) -> Law:
    """A setting that must not be seen in the image."""

    def law(subject: Subject, magnitude: float) -> float:
        case = Case(subject.case.scene, dict(subject.case.settings) | {name: of(magnitude)})
        return subject.difference(subject.draw(case), subject.base)

    return law


def depth_bits(subject: Subject, bits: float) -> float:
    """How depth is stored is not seen."""
    if subject.has_parameter("depth_bits"):
        return setting("depth_bits", int)(subject, bits)
    return setting("depth_format", lambda bits: f"D{bits:.0f}")(subject, bits)


def _square(subject: Subject, side: int) -> Float64:
    return subject.draw(subject.case.of(transforms.with_sensor, width=side, height=side, fov_axis="x"))


def _square_base(subject: Subject) -> Float64:
    image = _square(subject, subject.case.scene.sensor.width)
    if not image.any():
        raise InputError("nothing is seen in a square picture")
    return image


def few_pixels(subject: Subject, side: float) -> float:
    """The mean of an image of few pixels is that of many, but for the luck of where so few samples fall."""
    base, image = _square_base(subject), _square(subject, int(side))
    deviation = max(float(base.std(axis=(0, 1)).max()), EVEN * float(np.abs(base).max()))
    samples = image.shape[0] * image.shape[1] * subject.technique.grid**2
    away = float(np.abs(image.mean(axis=(0, 1)) - base.mean(axis=(0, 1))).max())
    return away * float(np.sqrt(samples)) / deviation


def strip(subject: Subject, width: float) -> float:
    """A row of very many pixels shows the middle of the image: its mean is between those of the rows there."""
    base = _square_base(subject)
    case = subject.case.of(transforms.with_sensor, width=int(width), height=1, fov_axis="x")
    image = subject.draw(case).mean(axis=(0, 1))
    middle = base.shape[0] // 2
    rows = base[middle - STRIP_ROWS : middle + STRIP_ROWS].mean(axis=1)
    beyond = float(np.maximum(rows.min(axis=0) - image, image - rows.max(axis=0)).max())
    return max(0.0, beyond) / float(np.abs(base).mean())
