"""A scene as data: what is seen, by which sensor, under which light, and which checks it must pass.

Everything is frozen and strict: an unknown key, a wrong type, a NaN or an infinity is an error. Lengths are metres,
angles carry the suffix `_deg`, colours are linear RGB with Rec. 709 primaries. Axes are right-handed with +Y up. A
scene of small things may choose another unit of length; areas and coefficients then go by that unit too.
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from scenes.checks import Check
from scenes.materials import Material, Texture
from scenes.shapes import Hair, Shape
from scenes.strict import Strict
from scenes.units import LengthUnit, Name, NonNegative, Positive, Rgb, Vec3

PIXEL_GRID = 8
"""Geometric quantities are means over a regular grid of this many positions along each side of a pixel."""


MOST_SPP = 1 << 22
"""More samples a pixel than a truth may cost."""


class Perspective(Strict):
    """A pinhole camera. `fov_deg` spans the image along `fov_axis` (x: its width, y: its height)."""

    type: Literal["perspective"]
    origin: Vec3
    target: Vec3
    up: Vec3 = (0.0, 1.0, 0.0)
    fov_deg: Annotated[float, Field(gt=0, lt=180)]
    fov_axis: Literal["x", "y"] = "x"
    width: Annotated[int, Field(ge=1, le=8192)] = 128
    height: Annotated[int, Field(ge=1, le=8192)] = 128

    @model_validator(mode="after")
    def _has_a_direction(self) -> "Perspective":
        forward = [t - o for t, o in zip(self.target, self.origin, strict=True)]
        u = self.up
        cross = (
            forward[1] * u[2] - forward[2] * u[1],
            forward[2] * u[0] - forward[0] * u[2],
            forward[0] * u[1] - forward[1] * u[0],
        )
        if sum(c * c for c in cross) < 1e-12:
            raise ValueError("target must differ from origin, and up must not be parallel to the view direction")
        return self


class ThinLens(Perspective):
    """A camera whose lens is a disk. Quantities that are defined for a pinhole look through the lens' centre."""

    type: Literal["thin_lens"]  # type: ignore[assignment]  # a narrower tag than the base's is what makes the union work
    aperture_radius: NonNegative
    focus_distance: Positive


Sensor = Annotated[Perspective | ThinLens, Field(discriminator="type")]


class PointLight(Strict):
    """`intensity` [W/sr], the same in every direction."""

    type: Literal["point"]
    position: Vec3
    intensity: Rgb


class DirectionalLight(Strict):
    """`irradiance` [W/m²] on a plane that faces the light, which travels along `direction`."""

    type: Literal["directional"]
    direction: Vec3
    irradiance: Rgb

    @model_validator(mode="after")
    def _has_a_direction(self) -> "DirectionalLight":
        if sum(c * c for c in self.direction) < 1e-12:
            raise ValueError("direction must not be the zero vector")
        return self


class AreaLight(Strict):
    """The front side of a shape emits `radiance` [W/(m² sr)], times a `texture` over its (u, v) if there is one."""

    type: Literal["area"]
    shape: Name
    radiance: Rgb
    texture: Texture | None = None


class DiskLight(Strict):
    """A disk that emits `radiance` [W/(m² sr)] on the side of `normal` and reflects nothing."""

    type: Literal["disk"]
    position: Vec3
    normal: Vec3
    radius: Positive
    radiance: Rgb

    @model_validator(mode="after")
    def _has_a_normal(self) -> "DiskLight":
        if sum(c * c for c in self.normal) < 1e-12:
            raise ValueError("normal must not be the zero vector")
        return self


class SphereLight(Strict):
    """A ball that emits `radiance` [W/(m² sr)] evenly and reflects nothing."""

    type: Literal["sphere"]
    position: Vec3
    radius: Positive
    radiance: Rgb


class LineLight(Strict):
    """A thin glowing tube from `start` to `end`, such as a beam of plasma. It emits `radiance` and reflects nothing."""

    type: Literal["line"]
    start: Vec3
    end: Vec3
    radius: Positive
    radiance: Rgb

    @model_validator(mode="after")
    def _has_a_length(self) -> "LineLight":
        if self.start == self.end:
            raise ValueError("start and end must differ")
        return self


class ConstantLight(Strict):
    """Uniform `radiance` [W/(m² sr)] from infinitely far away."""

    type: Literal["constant"]
    radiance: Rgb


class EnvironmentLight(Strict):
    """A latitude-longitude EXR of radiance, relative to the scene.

    The centre of row 0 is +Y, that of the last row -Y; the middle column is -Z.
    """

    type: Literal["environment"]
    path: str
    scale: Positive = 1.0


Emitter = Annotated[
    PointLight | SphereLight | DirectionalLight | AreaLight | DiskLight | LineLight | ConstantLight | EnvironmentLight,
    Field(discriminator="type"),
]


class TruthSettings(Strict):
    """What the truth may cost, and whether rare bright paths count.

    max_spp : the most samples a pixel before a check is INCONCLUSIVE
    clamp   : samples brighter than this are scaled down to it, in the quantity's unit. That is another truth than the
        unclamped one, and a darker one: every result tells how much energy was removed.
    """

    max_spp: Annotated[int, Field(ge=64, le=MOST_SPP)] = 4096
    clamp: Positive | None = None


class Scene(Strict):
    """`subject` names the shapes (the talk's "character") whose pixels are judged; the rest is their environment."""

    name: str
    folder: Path
    title: str
    description: str = ""
    length_unit: LengthUnit = "m"
    sensor: Sensor
    materials: dict[Name, Material]
    shapes: Annotated[tuple[Shape, ...], Field(min_length=1)]
    hair: tuple[Hair, ...] = ()
    emitters: tuple[Emitter, ...] = ()
    subject: Annotated[tuple[Name, ...], Field(min_length=1)]
    truth: TruthSettings = TruthSettings()
    checks: tuple[Check, ...] = ()
