"""What must hold between the images of a scene and of what a stress makes of it: laws that need no truth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from realtime.instrument import NO_INSTRUMENT, Instrument
from realtime.render import Renderer
from realtime.technique import Technique
from scenes.checks import SettingValue
from scenes.errors import RenderError
from scenes.image import Float64
from scenes.model import Scene

OF_BASE = "of the unstressed image"


@dataclass(frozen=True)
class Tolerance:
    """How far an image may be from what the law says, as `unit` in words, and why that is right."""

    value: float
    unit: str
    reason: str


PARITY = "what parity allows: samples that fall on the other side of an edge"
TOLERANCES: Mapping[str, Tolerance] = {
    "depth": Tolerance(5e-3, f"rms, {OF_BASE}'s own", PARITY),
    "normal": Tolerance(2.5e-3, "rms", PARITY),
    "coverage": Tolerance(4e-3, "rms", PARITY),
    "albedo": Tolerance(2e-2, f"rms, {OF_BASE}'s own", PARITY),
    "emission": Tolerance(2e-2, f"rms, {OF_BASE}'s own", PARITY),
    "thickness": Tolerance(1e-3, f"rms, {OF_BASE}'s own", "a membrane's radiance changes by less than that"),
    "visibility": Tolerance(5e-3, "rms", "a quarter of the strictest budget of a shadow"),
    "hair_geometry": Tolerance(1e-4, f"rms, {OF_BASE}'s own", "some micrometres where hair is centimetres long"),
    "hair_tangent": Tolerance(1e-4, "rms", "hair of a hundred pixels ends within a hundredth of one"),
    "hair_coverage": Tolerance(1e-2, "rms", "a quarter of its budget"),
    "iris_uv": Tolerance(1e-3, "rms", "a texel of an iris 1000 texels wide"),
    "displaced_uv": Tolerance(1e-2, "texels, rms", "a hundredth of what counts as off"),
}
RADIANCE = Tolerance(1e-2, f"rms over the mean {OF_BASE}", "a third of the strictest budget of what is not closed-form")
SHARES = frozenset({"visibility", "coverage", "albedo", "hair_coverage"})
"""Quantities that lie between 0 and 1."""

ROUNDING = 1e-4
"""Sums of shares in float32 may pass 1 by so much."""


@dataclass(frozen=True)
class Case:
    """What is drawn."""

    scene: Scene
    settings: Mapping[str, SettingValue]

    def of(self, change: Callable[..., Scene], *arguments: Any, **named: Any) -> "Case":
        """The case with its scene changed."""
        return replace(self, scene=change(self.scene, *arguments, **named))


@dataclass(frozen=True)
class Subject:
    """A technique on a small scene; `unit` is that of its quantity. Its images are drawn under an `instrument`."""

    technique: Technique
    case: Case
    unit: str
    instrument: Instrument = NO_INSTRUMENT

    @property
    def quantity(self) -> str:
        return self.technique.approximates

    @property
    def is_radiance(self) -> bool:
        return self.unit.startswith("W")

    @property
    def is_length(self) -> bool:
        return self.unit == "length"

    @property
    def tolerance(self) -> Tolerance:
        return TOLERANCES.get(self.quantity, RADIANCE)

    @cached_property
    def base(self) -> Float64:
        """The image without any stress."""
        return self.draw(self.case)

    def has_parameter(self, name: str) -> bool:
        """Whether the technique has a setting of that name."""
        return any(parameter.name == name for parameter in self.technique.parameters)

    def require_image(self) -> None:
        """Raises LightgaugeError where the technique cannot even draw the scene without any stress."""
        if not self.base.any():
            raise RenderError(f"{self.technique.name} draws nothing of '{self.case.scene.name}': no law can be held.")

    def draw(self, case: Case) -> Float64:
        """The image (H, W, C) of a case.

        Raises
        ------
        LightgaugeError
            The technique refuses the case, or fails at it: NaN, infinities, shares beyond 0 to 1.
        """
        rendered = Renderer(case.scene, self.instrument).render(self.technique, dict(case.settings), timed=False)
        pixels = rendered.image.pixels.astype(np.float64)
        if self.quantity in SHARES and not (pixels.min() >= -ROUNDING and pixels.max() <= 1 + ROUNDING):
            raise RenderError(f"found {self.quantity} from {pixels.min():g} to {pixels.max():g}; allowed is 0 to 1")
        return pixels

    def difference(self, image: Float64, expected: Float64) -> float:
        """How far an image is from the expected one, in the unit of `tolerance`.

        Raises
        ------
        RenderError
            Nothing is expected anywhere, so that no error can be told from it.
        """
        error, scale = rms(image - expected), self.scale(expected)
        if scale == 0:
            raise RenderError("the image that the law expects is blank")
        return error / scale

    def scale(self, expected: Float64) -> float:
        """What errors are divided by to be in the unit of `tolerance`."""
        if self.quantity in ("emission", "albedo") or self.is_length:
            return rms(expected)
        return abs(float(expected.mean())) if self.is_radiance else 1.0


def rms(values: Float64) -> float:
    """Root of the mean of squares."""
    return float(np.sqrt(np.mean(values**2)))
