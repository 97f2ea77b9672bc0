"""Emitters as a list of small lights, each with a place in the shadow atlas."""

from dataclasses import dataclass

import numpy as np

from scenes.geometry import texture_of
from scenes.image import Float32, Float64
from scenes.mesh import Mesh, Surface
from scenes.model import DirectionalLight, PointLight, Scene, SphereLight

POINT, FACET, PARALLEL = 0, 1, 2

POINTS_OF_RADIUS = 0.75**0.5
"""Where the points of a ball lie: seen from afar they are spread as far from its middle as the disk that it is seen as,
by the mean of squares, so that penumbrae are as wide.

What a plane receives of a point is a harmonic function of the point's place. Its mean over a sphere is that of the
centre: the points light what they all see as the ball does, but for their number, with 16 to 0.6 % at five radii.
"""


@dataclass(frozen=True)
class Light:
    """A light small enough for one shadow map.

    POINT: `place` is its position, `strength` its intensity [W/sr]. FACET: a piece of an emitting surface, `strength`
    its radiance times its area [W/sr], shining to the side of `axis`. PARALLEL: `axis` is where the light travels to,
    `strength` its irradiance [W/m²]. `source` tells the emitters apart. `mesh` is what it shines through, by name: the
    surface of a ball that it stands for. `emitter` is the name of the mesh that it is a part of, if there is one:
    "emitter-" and the number of a disk, line or ball among the scene's emitters.
    """

    kind: int
    place: Float64
    axis: Float64
    strength: Float64
    area: float
    source: int
    mesh: str = ""
    emitter: str = ""


def lights_of(scene: Scene, meshes: tuple[Mesh, ...], facets: int) -> list[Light]:
    """All emitters but the sky; every ball becomes `facets` points, every other emitting mesh facets of equal area."""
    zero = np.zeros(3)
    lights = []
    balls = {f"emitter-{i}": light for i, light in enumerate(scene.emitters) if isinstance(light, SphereLight)}
    for source, emitter in enumerate((*scene.emitters, *(mesh for mesh in meshes if mesh.radiance is not None))):
        match emitter:
            case PointLight():
                lights.append(Light(POINT, np.array(emitter.position), zero, np.array(emitter.intensity), 0.0, source))
            case DirectionalLight():
                direction = np.array(emitter.direction) / np.linalg.norm(emitter.direction)
                lights.append(Light(PARALLEL, zero, direction, np.array(emitter.irradiance), 0.0, source))
            case Mesh(name=name) if name in balls:
                ball = balls[name]
                strength = np.pi * ball.radius**2 / facets * np.array(ball.radiance)
                places = np.array(ball.position) + POINTS_OF_RADIUS * ball.radius * directions(facets)
                lights += [Light(POINT, place, zero, strength, 0.0, source, name, name) for place in places]
            case Mesh():
                spread = facets_of(emitter.surface, facets)
                strengths = np.array(emitter.radiance) * spread.area * _pattern(scene, emitter, spread.uvs)
                facing = zip(spread.places, spread.normals, strengths, strict=True)
                lights += [
                    Light(FACET, p, n, strength, spread.area, source, emitter=emitter.name) for p, n, strength in facing
                ]
    return lights


def light_rows(lights: list[Light]) -> Float32:
    """The structs (N, 3, 4) of glsl/lib/lights.glsl; one dark row if there is no light."""
    rows = np.zeros((max(1, len(lights)), 3, 4), dtype=np.float32)
    for row, light in zip(rows, lights, strict=False):
        row[:] = [[*light.place, light.kind], [*light.axis, light.area], [*light.strength, 0.0]]
    return rows


def _pattern(scene: Scene, mesh: Mesh, uvs: Float64) -> Float64:
    """The factor (N, 3) by which an emitter's pattern scales its radiance: its nearest texel, as it repeats."""
    if mesh.pattern is None:
        return np.ones((len(uvs), 3))
    texels = texture_of(scene, mesh.pattern)[::-1]
    height, width, _ = texels.shape
    column, row = (np.floor(uvs % 1 * (width, height)).astype(int) % (width, height)).T
    factors: Float64 = texels[row, column].astype(float)
    return factors


def directions(count: int) -> Float64:
    """Unit vectors (count, 3) spread evenly, none of them along an axis.

    Swinbank & Purser 2006, "Fibonacci grids: A novel approach to global modelling".
    """
    i = np.arange(count)
    y, angle = 1 - (2 * i + 1) / count, i * np.pi * (3 - np.sqrt(5))
    around = np.sqrt(1 - y**2)
    return np.stack([around * np.cos(angle), y, around * np.sin(angle)], axis=1)


@dataclass(frozen=True)
class Facets:
    """`places`, face `normals` (N, 3) and `uvs` (N, 2) of points that each stand for an equal `area` of a surface."""

    places: Float64
    normals: Float64
    uvs: Float64
    area: float


def facets_of(surface: Surface, count: int) -> Facets:
    """Points spread evenly over a surface by area.

    Points follow the R2 sequence (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences").
    """
    corners = surface.positions.astype(float)[surface.faces.astype(np.int64)]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(cross, axis=1) / 2
    cumulative = np.cumsum(areas) / areas.sum()
    plastic = 1.32471795724474602596
    step = np.array([1 / plastic, 1 / plastic**2])
    u = (0.5 + np.outer(np.arange(count), step)) % 1
    chosen = np.minimum(np.searchsorted(cumulative, (np.arange(count) + 0.5) / count), len(areas) - 1)
    root = np.sqrt(u[:, 0])
    weights = np.stack([1 - root, root * (1 - u[:, 1]), root * u[:, 1]], axis=1)
    places = np.einsum("nk,nkc->nc", weights, corners[chosen])
    uvs = np.einsum("nk,nkc->nc", weights, surface.uvs.astype(float)[surface.faces.astype(np.int64)][chosen])
    normals = cross[chosen] / np.linalg.norm(cross[chosen], axis=1, keepdims=True)
    return Facets(places, normals, uvs, float(areas.sum() / count))
