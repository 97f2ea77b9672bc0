"""The picture of what a part of a technique changes."""

import base64
import io

import numpy as np
from PIL import Image

from comparisons.bench.stills import GAP, strip
from reference.estimator import Truth
from reference.quantity import Integrator
from scenes.image import Float32

H, W = 4, 6


def truth_of(name: str, level: float) -> Truth:
    values = np.full((2, H, W, 3), level, dtype=np.float32)
    return Truth(name, "key", values, np.ones((H, W), dtype=bool), 32, 0.0, Integrator("made up", "for a test"))


def level(value: float) -> Float32:
    return np.full((H, W, 3), value, dtype=np.float32)


def test_a_strip_shows_with_without_and_the_change() -> None:
    """You should see two greys, the second one darker, and the blue of what is too dark."""
    png = base64.b64decode(strip(level(1.0), level(0.0), truth_of("full_radiance", 1.0)))
    pixels = np.asarray(Image.open(io.BytesIO(png)))
    assert pixels.shape == (H, 3 * W + 2 * GAP, 3)
    with_part, without, change = pixels[0, 0], pixels[0, W + GAP], pixels[0, -1]
    assert with_part[0] > 100
    assert without.max() == 0
    assert change[2] > change[0]


def test_what_is_no_radiance_and_what_is_black_has_no_picture() -> None:
    assert strip(level(1.0), level(0.0), truth_of("depth", 1.0)) == ""
    assert strip(level(1.0), level(0.0), truth_of("full_radiance", 0.0)) == ""
