"""A scene as data: what is seen, by which sensor, under which light, and which checks it must pass.

Everything is frozen and strict: an unknown key, a wrong type, a NaN or an infinity is an error. Lengths are metres,
angles carry the suffix `_deg`, colours are linear RGB with Rec. 709 primaries. Axes are right-handed with +Y up.
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Reflectance = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")]
Rgb = tuple[NonNegative, NonNegative, NonNegative]
Albedo = tuple[Reflectance, Reflectance, Reflectance]
Sentence = Annotated[str, Field(min_length=8)]


PIXEL_GRID = 8
"""Geometric quantities are means over a regular grid of this many positions along each side of a pixel."""


MOST_SPP = 1 << 22
"""More samples a pixel than a truth may cost."""


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


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


class Texture(Strict):
    """An image file, relative to the scene. `srgb` values are decoded to linear when read."""

    path: str
    color_space: Literal["srgb", "linear"] = "srgb"


class Diffuse(Strict):
    """A Lambertian surface, seen from its front side only."""

    type: Literal["diffuse"]
    reflectance: Albedo | Texture


Material = Diffuse


class ShapeBase(Strict):
    """Scaled, then rotated about x, y and z in that order, then moved to `position`."""

    name: Name
    material: Name
    position: Vec3 = (0.0, 0.0, 0.0)
    rotation_deg: Vec3 = (0.0, 0.0, 0.0)
    scale: Positive = 1.0


class Sphere(ShapeBase):
    type: Literal["sphere"]
    radius: Positive = 1.0
    detail: Annotated[int, Field(ge=0, le=7)] = 5


class Ellipsoid(ShapeBase):
    type: Literal["ellipsoid"]
    radii: tuple[Positive, Positive, Positive]
    detail: Annotated[int, Field(ge=0, le=7)] = 5


class DisplacedIcosphere(ShapeBase):
    """A sphere whose radius is modulated by smooth bumps: r (1 + amplitude * b), |b| <= 1."""

    type: Literal["displaced_icosphere"]
    radius: Positive = 1.0
    amplitude: Annotated[float, Field(ge=0, lt=1)] = 0.2
    frequency: Positive = 3.0
    seed: Annotated[int, Field(ge=0)] = 0
    detail: Annotated[int, Field(ge=0, le=7)] = 5


class TorusKnot(ShapeBase):
    """A tube around the (p, q) torus knot that winds p times round the axis of symmetry (y)."""

    type: Literal["torus_knot"]
    p: Annotated[int, Field(ge=1, le=16)] = 2
    q: Annotated[int, Field(ge=1, le=16)] = 3
    radius: Positive = 1.0
    tube: Positive = 0.25
    segments: Annotated[int, Field(ge=8, le=4096)] = 256
    sides: Annotated[int, Field(ge=3, le=256)] = 24


class Box(ShapeBase):
    """A closed box, faces outward."""

    type: Literal["box"]
    size: tuple[Positive, Positive, Positive]


WallName = Literal["left", "right", "floor", "ceiling", "back", "front"]


class Room(ShapeBase):
    """A box seen from inside: its faces point inward.

    `walls` gives single walls a material of their own: left -x, right +x, floor -y, ceiling +y, back -z, front +z.
    """

    type: Literal["room"]
    size: tuple[Positive, Positive, Positive]
    walls: dict[WallName, Name] = {}


class Rectangle(ShapeBase):
    """In the xy plane, facing +z."""

    type: Literal["rectangle"]
    size: tuple[Positive, Positive]


class MeshFile(ShapeBase):
    """Triangles from a PLY, OBJ, STL or GLB file relative to the scene; `closed` demands a watertight surface."""

    type: Literal["mesh"]
    path: str
    shading: Literal["smooth", "flat"] = "smooth"
    closed: bool = False


Shape = Annotated[
    Sphere | Ellipsoid | DisplacedIcosphere | TorusKnot | Box | Room | Rectangle | MeshFile, Field(discriminator="type")
]


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
    """The front side of a shape emits `radiance` [W/(m² sr)]."""

    type: Literal["area"]
    shape: Name
    radiance: Rgb


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
    PointLight | DirectionalLight | AreaLight | DiskLight | ConstantLight | EnvironmentLight,
    Field(discriminator="type"),
]


class Criterion(Strict):
    """`min <= metric <= max`, and why that bound is the right one."""

    metric: str
    max: float | None = None
    min: float | None = None
    reason: Sentence

    @model_validator(mode="after")
    def _has_a_bound(self) -> "Criterion":
        if self.max is None and self.min is None:
            raise ValueError("give max, min or both")
        if self.max is not None and self.min is not None and self.min > self.max:
            raise ValueError(f"min ({self.min:g}) must not exceed max ({self.max:g})")
        return self


SettingValue = bool | int | float | str


class Check(Strict):
    """A technique held against the truth of a quantity.

    With `fit_exposure` the technique's image is first multiplied by the one factor that fits the truth best, which is
    reported: what remains is the error of shape and colour.
    """

    quantity: str
    technique: str
    settings: dict[str, SettingValue] = {}
    fit_exposure: bool = False
    criteria: Annotated[tuple[Criterion, ...], Field(min_length=1)]


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
    sensor: Sensor
    materials: dict[Name, Material]
    shapes: Annotated[tuple[Shape, ...], Field(min_length=1)]
    emitters: tuple[Emitter, ...] = ()
    subject: Annotated[tuple[Name, ...], Field(min_length=1)]
    truth: TruthSettings = TruthSettings()
    checks: tuple[Check, ...] = ()
