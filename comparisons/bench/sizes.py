"""The same scene in other sizes: more pixels, a subject of more triangles, more lights of the same power together."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

from pydantic import ValidationError

from scenes.errors import InputError, SceneError
from scenes.model import DirectionalLight, Emitter, PointLight, Scene, Sensor
from scenes.shapes import Capsule, DisplacedIcosphere, Ear, Ellipsoid, Eye, MeshFile, Shape, Sphere, Torus, TorusKnot

RESOLUTIONS = ((256, 256), (512, 512), (1024, 768), (1280, 1024), (1920, 1080))
FINENESS = (-2, -1, 0, 1)
"""Doublings of the edges along a curve of a formula: 64 times as many triangles from the first to the last."""

SUBDIVISIONS = (0, 1, 2, 3)
"""How often the triangles of a file are split into four: as far."""

COPIES = (1, 2, 4, 8)


def in_pixels(scene: Scene, folder: Path) -> Iterator[tuple[float, Scene]]:
    """Number of pixels and the scene, seen by sensors of other resolutions."""
    for width, height in RESOLUTIONS:
        yield width * height, scene.model_copy(update={"sensor": resized(scene.sensor, width, height)})


def resized(sensor: Sensor, width: int, height: int) -> Sensor:
    """A sensor of other pixels whose image plane keeps its area, so that the subject keeps its share of the pixels."""
    old, new = sensor.width / sensor.height, width / height
    if sensor.fov_axis == "y":
        old, new = 1 / old, 1 / new
    half = math.tan(math.radians(sensor.fov_deg) / 2) * math.sqrt(new / old)
    fov_deg = sensor.fov_deg if new == old else 2 * math.degrees(math.atan(half))
    return sensor.model_copy(update={"width": width, "height": height, "fov_deg": fov_deg})


def in_triangles(scene: Scene, folder: Path) -> Iterator[tuple[float, Scene]]:
    """Number of triangles of the whole scene, and the scene with a coarser or finer subject.

    Meshes from files are split into four over and over and written to `folder`; they keep their form. Other shapes are
    built anew by their formula, as far as that allows.

    Raises
    ------
    InputError
        No shape of the subject can have more triangles.
    """
    from scenes.geometry import geometry_of

    if not any(_is_refinable(shape) for shape in scene.shapes if shape.name in scene.subject):
        raise InputError(
            f"Scene '{scene.name}' has a subject whose number of triangles is fixed: boxes, rectangles, slabs and "
            "wedges have no finer mesh. Measure this on a scene with a curved subject or a mesh from a file."
        )
    for fineness, subdivisions in zip(FINENESS, SUBDIVISIONS, strict=True):
        try:
            shapes = tuple(
                _refined(scene, shape, fineness, subdivisions, folder) if shape.name in scene.subject else shape
                for shape in scene.shapes
            )
            changed = scene.model_copy(update={"shapes": shapes})
            size = sum(len(mesh.surface.faces) for mesh in geometry_of(changed))
        except (ValidationError, SceneError):
            if fineness == 0:  # the scene itself
                raise
            continue
        yield size, changed


def _is_refinable(shape: Shape) -> bool:
    by_formula = Sphere | Ellipsoid | DisplacedIcosphere | TorusKnot | Torus | Capsule | Eye | Ear
    return isinstance(shape, by_formula | MeshFile)


def _refined(scene: Scene, shape: Shape, fineness: int, subdivisions: int, folder: Path) -> Shape:
    """Raises ValidationError if the shape does not allow that many triangles."""
    factor = 2.0**fineness
    match shape:
        case Sphere() | Ellipsoid() | DisplacedIcosphere():
            return _rebuilt(shape, detail=shape.detail + fineness)
        case TorusKnot() | Torus():
            return _rebuilt(shape, segments=round(factor * shape.segments), sides=round(factor * shape.sides))
        case Capsule() | Eye():
            return _rebuilt(shape, detail=round(factor * shape.detail))
        case Ear():
            return _rebuilt(shape, cells=round(factor * shape.cells))
        case MeshFile():
            return _rebuilt(shape, path=str(_subdivided(scene.folder / shape.path, subdivisions, folder)))
        case _:
            return shape


def _rebuilt(shape: Shape, **changes: float | str) -> Shape:
    """The shape with other numbers, which are checked as those of a scene file are."""
    return type(shape).model_validate(shape.model_dump() | changes)


def _subdivided(path: Path, times: int, folder: Path) -> Path:
    """A copy of a mesh file in `folder`, each triangle split into 4 ** times."""
    import trimesh

    mesh = trimesh.load_mesh(path, process=False)
    for _ in range(times):
        mesh = mesh.subdivide()
    copy = folder.resolve() / f"{path.stem}-{times}.ply"
    mesh.export(copy)
    return copy


def in_lights(scene: Scene, folder: Path) -> Iterator[tuple[float, Scene]]:
    """Number of emitters, and the scene with several at each place of one, which share its power out.

    Raises
    ------
    InputError
        The scene has no emitter that can stand for several.
    """
    power = {place: _power_of(light) for place, light in enumerate(scene.emitters)}
    if not any(power.values()):
        kinds = ", ".join(sorted({light.type for light in scene.emitters})) or "none"
        raise InputError(
            f"Scene '{scene.name}' has no light that could be shared out among several (its emitters: {kinds}). "
            "Measure this on a scene with point, directional, disk, sphere or line lights."
        )
    for copies in COPIES:
        emitters = tuple(
            part
            for place, light in enumerate(scene.emitters)
            for part in (_shared(light, power[place], copies) if power[place] else (light,))
        )
        yield len(emitters), scene.model_copy(update={"emitters": emitters})


def _power_of(light: Emitter) -> str:
    """The key of the light's strength; empty for the sky, and for shapes that shine, which would hide one another."""
    match light:
        case PointLight():
            return "intensity"
        case DirectionalLight():
            return "irradiance"
        case _:
            return "radiance" if light.type in ("disk", "sphere", "line") else ""


def _shared(light: Emitter, key: str, copies: int) -> tuple[Emitter, ...]:
    strength = tuple(value / copies for value in getattr(light, key))
    return (light.model_copy(update={key: strength}),) * copies


AXES: dict[str, Callable[[Scene, Path], Iterator[tuple[float, Scene]]]] = {
    "pixels": in_pixels,
    "triangles": in_triangles,
    "lights": in_lights,
}
