"""What a scene consists of: shapes by formula, and meshes from files."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from scenes.materials import Texture
from scenes.strict import Strict
from scenes.units import Name, NonNegative, Positive, Reflectance, Vec3


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


MOST_SAMPLES = 1024
"""Along each side of a relief: its mesh has nine vertices for each of its cells."""

FieldName = Literal["bumps", "brick", "gravel", "steps", "spikes", "noise"]


class Relief(ShapeBase):
    """A carved block: a height field over a rectangle in the xy plane that faces +z, with walls down from its border.

    Heights of 0 lie at z = -depth, heights of 1 at z = 0. Between its samples the field is bilinear. The sample (0, 0)
    stands at the lower left corner, u = v = 0, the last one at the upper right corner, u = v = 1.

    heights    : a field by name (see `scenes.relief`), or an image file of linear values, whose first channel is the
        height
    resolution : samples of a named field along each side; an image has its own
    """

    type: Literal["relief"]
    size: tuple[Positive, Positive]
    depth: Positive
    heights: FieldName | Texture
    resolution: Annotated[int, Field(ge=2, le=MOST_SAMPLES)] = 256
    seed: Annotated[int, Field(ge=0)] = 0


class Limb(ShapeBase):
    """A finger of two bones along y with the joint at the origin: first bulged (a morph target), then bent (skinned).

    u goes once round the axis, v from the lower end to the upper one.

    bend_deg : of the upper bone, about x; skin near the joint follows both bones (linear blend skinning)
    bulge    : weight of the morph target, which thickens the limb at the joint by `bulge` times its radius
    chart    : mirrored: the left half has the texture of the right half, mirrored, as game characters often have
    """

    type: Literal["limb"]
    radius: Positive
    length: Positive
    bend_deg: Annotated[float, Field(ge=-120, le=120)] = 0.0
    bulge: Annotated[float, Field(ge=-0.5, le=2)] = 0.0
    chart: Literal["plain", "mirrored"] = "plain"
    detail: Annotated[int, Field(ge=8, le=512)] = 64


class Head(ShapeBase):
    """A head-like body that looks along +z: skull, brow, nose, chin, ears, neck, and sockets for two eyes.

    Its chart is one-to-one on the scalp alone: in ears, nose, lips and sockets faces lie over one another in (u, v).
    `height` is that of the head without its neck. Its surface is the zero set of a signed distance, on a grid of
    `cells` along its height; the origin is the middle between the eyes' centres.
    """

    type: Literal["head"]
    height: Positive
    cells: Annotated[int, Field(ge=32, le=512)] = 128


class Hair(Strict):
    """Hair that grows on a shape: guides in texture space, and hairs interpolated between them.

    on             : the shape
    material       : a fibre
    count          : hairs at most: density and kill take some away, as do places in (u, v) that belong to no face
        (3 % on a sphere of detail 5, where the seam is)
    guides         : along each side of the chart (u, v): guides x guides
    length, radius : of a hair
    region         : (u, v) of two opposite corners of the part of the chart that has hair
    comb           : direction in which hair lies in the plane of the surface (along u, along v); its length against 1
        along the normal
    curl           : how far hairs wind about their course, in parts of their length
    spread         : by how much guides differ in direction (standard deviation, against 1 along the normal) and in
        length (at most, in parts of it)
    density, color, kill, length_map : control textures over the chart. Density is a probability, colour scales the
        light of a fibre, kill takes a hair away where it is above a half, length scales
    """

    name: Name
    on: Name
    material: Name
    count: Annotated[int, Field(ge=1, le=1 << 20)]
    guides: Annotated[int, Field(ge=2, le=256)] = 16
    length: Positive
    radius: Positive
    region: tuple[Reflectance, Reflectance, Reflectance, Reflectance] = (0.0, 0.0, 1.0, 1.0)
    comb: tuple[float, float] = (0.0, 0.0)
    curl: NonNegative = 0.0
    spread: Annotated[float, Field(ge=0, lt=1)] = 0.15
    seed: Annotated[int, Field(ge=0)] = 0
    density: Texture | None = None
    color: Texture | None = None
    kill: Texture | None = None
    length_map: Texture | None = None

    @property
    def textures(self) -> tuple[Texture, ...]:
        """All that control it."""
        return tuple(it for it in (self.density, self.color, self.kill, self.length_map) if it is not None)


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
    | Relief
    | Limb
    | Head
    | MeshFile,
    Field(discriminator="type"),
]
