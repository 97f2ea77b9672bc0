"""The triangles of a scene, placed in the world, and its textures as arrays."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import assert_never

import numpy as np

from scenes import bodies, eyes, heads, limbs, procedural, relief, srgb
from scenes.errors import ImageError, SceneError
from scenes.exr import read_exr
from scenes.image import Float32, Float64
from scenes.materials import Diffuse, Layered, Material, Texture
from scenes.mesh import Interface, Mesh, Surface
from scenes.mesh_files import load_mesh
from scenes.model import AreaLight, DiskLight, LineLight, Scene, SphereLight
from scenes.shapes import (
    MOST_SAMPLES,
    Box,
    Capsule,
    DisplacedIcosphere,
    Ear,
    Ellipsoid,
    Eye,
    Head,
    Limb,
    MeshFile,
    Rectangle,
    Relief,
    Room,
    Shape,
    ShapeBase,
    Slab,
    Sphere,
    Torus,
    TorusKnot,
    Wedge,
)
from scenes.topology import is_watertight, signed_volume
from scenes.units import Albedo, Vec3

TEXTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".exr")
EIGHT_BIT_MODES = ("1", "L", "LA", "P", "RGB", "RGBA")
SPHERE_LIGHT_DETAIL = 4
"""Its silhouette is 0.12 % smaller than the sphere's."""

BLACK = Diffuse(type="diffuse", reflectance=(0.0, 0.0, 0.0))


def geometry_of(scene: Scene) -> tuple[Mesh, ...]:
    """One mesh a shape, in the order of the scene, and one a disk, line or sphere light ("emitter-3").

    A room has one a wall ("name/left"), an eye has two ("name/sclera", "name/cornea").

    Raises
    ------
    SceneError
        Some shapes cannot be built or name an unknown material; the message has one line for each.
    """
    meshes: list[Mesh] = []
    problems: list[str] = []
    emitted = {light.shape: light for light in scene.emitters if isinstance(light, AreaLight)}
    names = {shape.name for shape in scene.shapes}
    problems += [f'an area light names the unknown shape "{name}".' for name in emitted if name not in names]
    for shape in scene.shapes:
        try:
            meshes.extend(_meshes_of(scene, shape, emitted.get(shape.name)))
        except SceneError as error:
            problems.append(f'shape "{shape.name}": {error}')
    if problems:
        raise SceneError("\n".join(problems))
    return (*meshes, *_light_meshes(scene))


def _light_meshes(scene: Scene) -> Iterator[Mesh]:
    for i, light in enumerate(scene.emitters):
        if isinstance(light, DiskLight):
            yield disk_light_mesh(f"emitter-{i}", light)
        elif isinstance(light, LineLight):
            yield line_light_mesh(f"emitter-{i}", light)
        elif isinstance(light, SphereLight):
            yield sphere_light_mesh(f"emitter-{i}", light)


def _meshes_of(scene: Scene, shape: Shape, light: AreaLight | None) -> Iterator[Mesh]:
    for suffix, material, surface in _surfaces_of(scene, shape):
        yield Mesh(
            name=shape.name + suffix,
            shape=shape.name,
            surface=placed(surface, shape),
            material=material if isinstance(material, Interface) else _material_of(scene, material),
            radiance=light.radiance if light else None,
            is_subject=shape.name in scene.subject,
            pattern=light.texture if light else None,
        )


def _material_of(scene: Scene, name: str) -> Material:
    if name not in scene.materials:
        raise SceneError(f'unknown material "{name}"; allowed: {", ".join(scene.materials) or "none is defined"}.')
    return scene.materials[name]


def diffuse_reflectance(material: Material | Interface) -> Albedo | Texture:
    """The reflectance of a Lambertian surface; nothing for any other material."""
    return material.reflectance if isinstance(material, Diffuse) else (0.0, 0.0, 0.0)


def _surfaces_of(scene: Scene, shape: Shape) -> Iterator[tuple[str, str | Interface, Surface]]:
    """For each surface of a shape what its name adds to the shape's, its material or the name of it, itself."""
    match shape:
        case Room():
            for wall, surface in procedural.room_walls(shape.size).items():
                yield f"/{wall}", shape.walls.get(wall, shape.material), surface
        case Eye():
            yield "/sclera", shape.material, eyes.sclera(shape)
            yield "/cornea", Interface(shape.ior), eyes.cornea(shape)
        case _:
            yield "", shape.material, _surface_of(scene, shape)


OfOneSurface = (
    Sphere
    | Ellipsoid
    | DisplacedIcosphere
    | TorusKnot
    | Box
    | Rectangle
    | Slab
    | Wedge
    | Capsule
    | Torus
    | Ear
    | Relief
    | Limb
    | Head
    | MeshFile
)


def _surface_of(scene: Scene, shape: OfOneSurface) -> Surface:  # noqa: C901 - one line a shape
    match shape:
        case Sphere():
            return procedural.sphere(shape.radius, shape.detail)
        case Ellipsoid():
            return procedural.ellipsoid(shape.radii, shape.detail)
        case DisplacedIcosphere():
            return procedural.displaced_icosphere(
                shape.radius, shape.amplitude, shape.frequency, shape.seed, shape.detail
            )
        case TorusKnot():
            return procedural.torus_knot(shape.p, shape.q, shape.radius, shape.tube, shape.segments, shape.sides)
        case Box():
            return procedural.box(shape.size)
        case Rectangle():
            return procedural.rectangle(shape.size)
        case Slab():
            return bodies.slab(shape.thickness, shape.width)
        case Wedge():
            return bodies.wedge(shape.size, shape.thin, shape.thick)
        case Capsule():
            return bodies.capsule(shape.radius, shape.length, shape.detail)
        case Torus():
            return bodies.torus(shape.radius, shape.tube, shape.segments, shape.sides)
        case Ear():
            return bodies.ear(shape.height, shape.membrane, shape.cells)
        case Relief():
            return relief.relief(shape, heights_of(scene, shape))
        case Limb():
            return limbs.limb(shape).deformed
        case Head():
            return heads.head(shape.height, shape.cells)
        case MeshFile():
            return load_mesh(scene.folder / shape.path, shape.shading, shape.closed)
        case _:
            assert_never(shape)


def placed(surface: Surface, shape: ShapeBase) -> Surface:
    """The surface scaled, turned and moved as the shape says."""
    return _moved(surface, shape.scale, procedural.rotation_xyz(shape.rotation_deg), shape.position)


def _moved(surface: Surface, scale: float, rotation: Float64, position: Vec3) -> Surface:
    positions = scale * surface.positions.astype(np.float64) @ rotation.T + np.array(position)
    normals = procedural.normalised(surface.normals.astype(np.float64) @ rotation.T)
    return replace(surface, positions=positions.astype(np.float32), normals=normals.astype(np.float32))


def disk_light_mesh(name: str, light: DiskLight) -> Mesh:
    """A disk that faces along the light's normal, emits its radiance and reflects nothing."""
    surface = _moved(procedural.disk(light.radius), 1.0, _basis(light.normal), light.position)
    return Mesh(name, name, surface, BLACK, light.radiance, is_subject=False)


def line_light_mesh(name: str, light: LineLight) -> Mesh:
    """A closed tube between the light's ends that emits its radiance and reflects nothing."""
    start, end = np.array(light.start), np.array(light.end)
    along_y = np.roll(_basis(tuple(end - start)), -1, axis=1)
    unplaced = bodies.tube(light.radius, float(np.linalg.norm(end - start)))
    surface = _moved(unplaced, 1.0, along_y, tuple(0.5 * (start + end)))
    return Mesh(name, name, surface, BLACK, light.radiance, is_subject=False)


def sphere_light_mesh(name: str, light: SphereLight) -> Mesh:
    """A ball that emits the light's radiance and reflects nothing; its vertices lie on the sphere."""
    surface = _moved(procedural.sphere(light.radius, SPHERE_LIGHT_DETAIL), 1.0, np.eye(3), light.position)
    return Mesh(name, name, surface, BLACK, light.radiance, is_subject=False)


def _basis(normal: Vec3) -> Float64:
    """A rotation (3, 3) that takes +z to `normal`. Duff et al. 2017, "Building an orthonormal basis, revisited"."""
    x, y, z = procedural.normalised(np.array(normal, dtype=np.float64))
    sign = np.copysign(1.0, z)
    a = -1 / (sign + z)
    b = x * y * a
    return np.array([[1 + sign * x * x * a, b, x], [sign * b, sign + y * y * a, y], [-sign * x, -y, z]])


def texture_of(scene: Scene, texture: Texture) -> Float32:
    """Linear values (H, W, 3) in [0, 1], such as reflectances, row 0 at the top, from a PNG, JPEG or EXR file.

    Raises
    ------
    SceneError
        The file is missing, damaged or of another format, or holds something other than numbers from 0 to 1.
    """
    path = scene.folder / texture.path
    suffix = path.suffix.lower()
    if suffix not in TEXTURE_SUFFIXES:
        raise SceneError(
            f"{path}: found a texture that ends in {path.suffix or 'nothing'!r}; allowed are "
            f"{', '.join(TEXTURE_SUFFIXES)}. Convert it to one of these."
        )
    if suffix == ".exr" and texture.color_space != "linear":
        raise SceneError(f'{path}: an EXR texture holds linear values; say color_space = "linear".')
    values = _linear_values(path) if suffix == ".exr" else _code_values(path)
    linear = srgb.decode(values) if texture.color_space == "srgb" else values
    if not ((linear >= 0) & (linear <= 1)).all():
        raise SceneError(
            f"{path}: found values from {linear.min():g} to {linear.max():g}; allowed is 0 to 1 without NaN. "
            "Scale the texture."
        )
    return np.ascontiguousarray(linear, dtype=np.float32)


def require_textures(scene: Scene) -> None:
    """See that every texture of a scene can be used, whoever is to read it.

    Raises
    ------
    SceneError
        Some cannot; the message has one line for each.
    """
    problems: list[str] = []
    for texture in dict.fromkeys(_textures(scene)):
        try:
            texture_of(scene, texture)
        except SceneError as error:
            problems.append(str(error))
    if problems:
        raise SceneError("\n".join(problems))


def _textures(scene: Scene) -> Iterator[Texture]:
    """Those of materials, lamps and hair; a relief reads its own."""
    for material in scene.materials.values():
        if isinstance(material, Diffuse | Layered) and isinstance(material.reflectance, Texture):
            yield material.reflectance
        if isinstance(material, Layered):
            yield from (metal.weight for metal in material.metals if isinstance(metal.weight, Texture))
    yield from (light.texture for light in scene.emitters if isinstance(light, AreaLight) and light.texture)
    yield from (texture for hair in scene.hair for texture in hair.textures)


def _linear_values(path: Path) -> Float64:
    """The first three channels of an EXR, or its only one three times."""
    try:
        pixels = read_exr(path).pixels
    except ImageError as error:
        raise SceneError(str(error)) from error
    if pixels.shape[2] not in (1, 3, 4):
        raise SceneError(
            f"{path}: found a texture of {pixels.shape[2]} channels; allowed are 1, 3 or 4, whose alpha is left out."
        )
    return (
        np.repeat(pixels, 3, axis=2).astype(np.float64) if pixels.shape[2] == 1 else pixels[:, :, :3].astype(np.float64)
    )


def _code_values(path: Path) -> Float64:
    """An 8-bit image as code values in [0, 1]; grey is repeated, alpha is left out."""
    import PIL.Image

    try:
        with PIL.Image.open(path) as file:
            if file.mode not in EIGHT_BIT_MODES:
                raise SceneError(
                    f"{path}: found an image of PIL's mode {file.mode}; allowed are 8 bits of grey or RGB, with or "
                    "without alpha. Convert it, or use an EXR."
                )
            return np.asarray(file.convert("RGB"), dtype=np.float64) / 255
    except (OSError, ValueError, SyntaxError) as error:
        raise SceneError(
            f"{path}: cannot be read as an image ({error}). Correct the path or replace the file."
        ) from error


def heights_of(scene: Scene, shape: Relief) -> Float64:
    """The samples (N, M) of a relief in [0, 1]: row 0 at v = 0, column 0 at u = 0.

    Raises
    ------
    SceneError
        The image that holds them cannot be used.
    """
    if isinstance(shape.heights, Texture):
        image = texture_of(scene, shape.heights)
        rows, columns = image.shape[:2]
        if not (2 <= rows <= MOST_SAMPLES and 2 <= columns <= MOST_SAMPLES):
            raise SceneError(
                f"{scene.folder / shape.heights.path}: found {columns} x {rows} heights; allowed are 2 to "
                f"{MOST_SAMPLES} along each side. Scale the image."
            )
        return np.ascontiguousarray(image[::-1, :, 0], dtype=np.float64)
    return relief.field(shape.heights, shape.resolution, shape.seed)


def is_convex(surface: Surface) -> bool:
    """Whether the mesh is watertight, faces outward and fills its convex hull to 1e-3 of the hull's volume."""
    from scipy.spatial import ConvexHull, QhullError

    if not is_watertight(surface):
        return False
    try:
        hull_volume = float(ConvexHull(surface.positions.astype(np.float64)).volume)
    except QhullError:  # all vertices in one plane
        return False
    return abs(hull_volume - signed_volume(surface)) <= 1e-3 * hull_volume
