"""A scene as data: what is seen, by which sensor, under which light, and which checks it must pass.

Everything is frozen and strict: an unknown key, a wrong type, a NaN or an infinity is an error. Lengths are metres,
angles carry the suffix `_deg`, colours are linear RGB with Rec. 709 primaries. Axes are right-handed with +Y up. A
scene of small things may choose another unit of length; areas and coefficients then go by that unit too.
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from scenes.checks import Check
from scenes.strict import Strict

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Reflectance = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")]
Rgb = tuple[NonNegative, NonNegative, NonNegative]
Albedo = tuple[Reflectance, Reflectance, Reflectance]


LengthUnit = Literal["m", "mm"]

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


class Texture(Strict):
    """An image file, relative to the scene. `srgb` values are decoded to linear when read."""

    path: str
    color_space: Literal["srgb", "linear"] = "srgb"


class Diffuse(Strict):
    """A Lambertian surface, seen from its front side only."""

    type: Literal["diffuse"]
    reflectance: Albedo | Texture


class Translucent(Strict):
    """A body that light enters, is scattered in and leaves again; its shape must be closed.

    The medium is homogeneous and scatters evenly in all directions with the reduced coefficient sigma_s' = (1 - g)
    sigma_s, which stands for a forward scattering medium after a few events (similarity theory: van de Hulst 1980,
    "Multiple Light Scattering", section 14.1). Its refractive index is that of the surroundings: nothing is reflected
    or refracted at the surface.

    medium  : a name from `scenes.media`, whose coefficients are measured; or instead of it
    sigma_a : absorption, sigma_s : reduced scattering, both per unit of length of the scene
    """

    type: Literal["translucent"]
    medium: str | None = None
    sigma_a: Rgb | None = None
    sigma_s: Rgb | None = None

    @model_validator(mode="after")
    def _has_one_medium(self) -> "Translucent":
        numbers = [self.sigma_a is not None, self.sigma_s is not None]
        if self.medium is not None and any(numbers):
            raise ValueError("give either medium, or sigma_a and sigma_s")
        if self.medium is None and not all(numbers):
            raise ValueError("give medium, or both sigma_a and sigma_s")
        return self


Material = Annotated[Diffuse | Translucent, Field(discriminator="type")]


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
    walls: dict[WallName, Name] = Field(default_factory=dict)


class Rectangle(ShapeBase):
    """In the xy plane, facing +z."""

    type: Literal["rectangle"]
    size: tuple[Positive, Positive]


class Slab(ShapeBase):
    """A plane-parallel layer between z = -thickness / 2 and z = thickness / 2, faces outward.

    It stands for one that has no edge: make `width` so large that the camera sees nothing of where it ends.
    """

    type: Literal["slab"]
    thickness: Positive
    width: Positive


class Wedge(ShapeBase):
    """A slice whose thickness along z grows evenly from `thin` at -x to `thick` at +x; closed, faces outward."""

    type: Literal["wedge"]
    size: tuple[Positive, Positive]
    thin: Positive
    thick: Positive


class Capsule(ShapeBase):
    """All points within `radius` of a line of `length` along y: a finger."""

    type: Literal["capsule"]
    radius: Positive
    length: Positive
    detail: Annotated[int, Field(ge=8, le=512)] = 64


class Torus(ShapeBase):
    """A ring around y: a tube of radius `tube`, its middle at `radius` from the axis."""

    type: Literal["torus"]
    radius: Positive
    tube: Positive
    segments: Annotated[int, Field(ge=8, le=4096)] = 192
    sides: Annotated[int, Field(ge=3, le=512)] = 64

    @model_validator(mode="after")
    def _has_a_hole(self) -> "Torus":
        if self.tube >= self.radius:
            raise ValueError("tube must be smaller than radius")
        return self


class Ear(ShapeBase):
    """A bat's ear: a thin dish of `membrane` thickness that grows out of a round body, faces outward.

    The dish is `height` tall along y, stands on the body and opens towards +z. Its surface is the zero set of a
    signed distance, on a grid of `cells` along its height.
    """

    type: Literal["ear"]
    height: Positive
    membrane: Positive
    cells: Annotated[int, Field(ge=32, le=512)] = 160


class Endothelium(Strict):
    """The back of the cornea: a sphere of `radius`, `thickness` behind the apex, with the index `ior` behind it."""

    radius: Positive
    thickness: Positive
    ior: Annotated[float, Field(ge=1, le=3)]


class Eye(ShapeBase):
    """An eye that looks along its own +y, with the centre of the sclera's sphere at its origin.

    sclera_radius    : the white of the eye; its material is the shape's, under a smooth film of index `ior`
    cornea_radius    : sphere of the cornea, which meets the sclera in the limbus
    limbus_radius    : of that circle, and of the iris
    ior              : refractive index behind the cornea's front (inside the cornea, if there is an endothelium)
    endothelium      : the second refracting surface, if there is one
    iris             : its material; a texture spans the disk, u along +x, v along -z
    iris_depth       : from the cornea's apex back to the plane of the iris' rim; the plane of the limbus if not given
    iris_curvature   : radius of the concave sphere (a bowl that opens towards the cornea) on which the iris lies; flat
        if not given
    pupil_radius     : of the disk in the iris' middle that reflects nothing
    """

    type: Literal["eye"]
    sclera_radius: Positive
    cornea_radius: Positive
    limbus_radius: Positive
    ior: Annotated[float, Field(gt=1, le=3)]
    endothelium: Endothelium | None = None
    iris: Name
    iris_depth: Positive | None = None
    iris_curvature: Positive | None = None
    pupil_radius: NonNegative = 0.0
    detail: Annotated[int, Field(ge=16, le=1024)] = 192

    @model_validator(mode="after")
    def _fits_together(self) -> "Eye":
        if self.limbus_radius >= min(self.sclera_radius, self.cornea_radius):
            raise ValueError("limbus_radius must be smaller than sclera_radius and cornea_radius")
        if self.cornea_radius > self.sclera_radius:
            raise ValueError("cornea_radius must not exceed sclera_radius")
        if self.iris_curvature is not None and self.iris_curvature <= self.limbus_radius:
            raise ValueError("iris_curvature must exceed limbus_radius")
        if self.pupil_radius >= self.limbus_radius:
            raise ValueError("pupil_radius must be smaller than limbus_radius")
        return self


class MeshFile(ShapeBase):
    """Triangles from a PLY, OBJ, STL or GLB file relative to the scene; `closed` demands a watertight surface."""

    type: Literal["mesh"]
    path: str
    shading: Literal["smooth", "flat"] = "smooth"
    closed: bool = False


Shape = Annotated[
    Sphere
    | Ellipsoid
    | DisplacedIcosphere
    | TorusKnot
    | Box
    | Room
    | Rectangle
    | Slab
    | Wedge
    | Capsule
    | Torus
    | Ear
    | Eye
    | MeshFile,
    Field(discriminator="type"),
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
    emitters: tuple[Emitter, ...] = ()
    subject: Annotated[tuple[Name, ...], Field(min_length=1)]
    truth: TruthSettings = TruthSettings()
    checks: tuple[Check, ...] = ()
