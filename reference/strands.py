"""All hair of a scene in the world, in float64: roots on the deformed skin, frames there, control points.

What a frame is, and that hair grows in every place that a chart is used for, is said in `scenes.grooming`.
"""

from dataclasses import dataclass

import numpy as np

from scenes.errors import SceneError
from scenes.geometry import geometry_of
from scenes.grooming import film_uv, groom, rooted_faces, shape_at
from scenes.image import Bool, Float64
from scenes.limbs import limb
from scenes.model import Scene
from scenes.procedural import normalised, rotation_xyz
from scenes.shapes import Hair, Limb
from scenes.topology import Integers


@dataclass(frozen=True)
class Strands:
    """Hairs as cubic Bezier curves in the world.

    points : (N, 4, 3) control points, the first on the skin
    radius : (N,)
    color  : (N, 3) factor on the light that a hair sends to the sensor
    system : (N,) which of the scene's hair it is
    """

    points: Float64
    radius: Float64
    color: Float64
    system: Integers


@dataclass(frozen=True)
class Chart:
    """The faces of a deformed skin on which hair may be rooted, in the world.

    positions, normals : (F, 3, 3) of their corners
    uvs                : (F, 3, 2)
    """

    positions: Float64
    normals: Float64
    uvs: Float64

    @property
    def doubled_areas(self) -> Float64:
        """Of the faces (F,) in (u, v): negative where the chart is mirrored."""
        a, b, c = self.uvs.transpose(1, 0, 2)
        return _cross(b - a, c - a)


@dataclass(frozen=True)
class Frames:
    """Places on the skin: positions (N, 3), and matrices (N, 3, 3) whose rows are unit tangent, side and normal."""

    position: Float64
    axes: Float64

    def to_world(self, shape: Float64) -> Float64:
        """Control points (N, K, 3) given in the frames."""
        points: Float64 = self.position[:, None] + shape @ self.axes
        return points


def strands_of(scene: Scene) -> Strands:
    """Every hair of the scene.

    Raises
    ------
    SceneError
        A shape's chart cannot hold hair, or no root of a hair lies in it.
    """
    each = [_grown(scene, hair) for hair in scene.hair]
    counts = [len(points) for points, _ in each]
    return Strands(
        points=np.concatenate([points for points, _ in each]),
        radius=np.repeat([hair.radius for hair in scene.hair], counts),
        color=np.concatenate([color for _, color in each]),
        system=np.repeat(np.arange(len(counts)), counts),
    )


def _grown(scene: Scene, hair: Hair) -> tuple[Float64, Float64]:
    grown = groom(scene, hair)
    chart = chart_of(scene, hair)
    root, face = roots(chart, grown.uv)
    if len(root) == 0:
        raise SceneError(
            f'hair "{hair.name}": none of {len(grown.uv)} roots lies on a face of "{hair.on}" in (u, v). Choose a '
            "region that its texture coordinates cover."
        )
    return frames(chart, face, grown.uv[root]).to_world(grown.shape[root]), grown.color[root]


def film_frames(scene: Scene, width: int, height: int) -> tuple[Frames, Float64]:
    """Frames where the pixels of an image over the chart of the scene's first hair stand, and hair there (N, 4, 3).

    Raises
    ------
    SceneError
        No face of the chart holds some pixel's place.
    """
    hair, chart = scene.hair[0], chart_of(scene, scene.hair[0])
    shape = next(shape for shape in scene.shapes if shape.name == hair.on)
    uv, mirrored = film_uv(shape, hair, width, height)
    root, face = roots(chart, uv)
    meant = (chart.doubled_areas[face] < 0) == mirrored[root]
    held, first = np.unique(root[meant], return_index=True)
    if len(held) < len(uv):
        raise SceneError(
            f'hair "{hair.name}": {len(uv) - len(held)} of {len(uv)} places of its region lie on no face of '
            f'"{hair.on}" in (u, v). Choose a region that its texture coordinates cover.'
        )
    return frames(chart, face[meant][first], uv), shape_at(scene, hair, uv)


def chart_of(scene: Scene, hair: Hair) -> Chart:
    """Where the hair may be rooted. A limb's skin is had in float64, other shapes as renderers get them."""
    shape = next(shape for shape in scene.shapes if shape.name == hair.on)
    mesh = next(mesh for mesh in geometry_of(scene) if mesh.shape == hair.on)
    positions, normals = mesh.surface.positions.astype(np.float64), mesh.surface.normals.astype(np.float64)
    if isinstance(shape, Limb):
        skin, turn = limb(shape), rotation_xyz(shape.rotation_deg)
        positions, normals = shape.scale * skin.positions @ turn.T + shape.position, skin.normals @ turn.T
    faces = mesh.surface.faces[rooted_faces(shape, mesh.surface)]
    return Chart(positions[faces], normals[faces], mesh.surface.uvs.astype(np.float64)[faces])


def frames(chart: Chart, face: Integers, uv: Float64) -> Frames:
    """The places of uv (N, 2) in faces (N,) that hold them."""
    corners, uvs = chart.positions[face], chart.uvs[face]
    inside = barycentric(uvs, uv)[:, :, None]
    normal = normalised(np.sum(inside * chart.normals[face], axis=1))
    (du1, dv1), (du2, dv2) = (uvs[:, 1] - uvs[:, 0]).T, (uvs[:, 2] - uvs[:, 0]).T
    determinant = du1 * dv2 - du2 * dv1
    edges = corners[:, 1:] - corners[:, :1]
    along_u = (dv2[:, None] * edges[:, 0] - dv1[:, None] * edges[:, 1]) / determinant[:, None]
    tangent = normalised(along_u - np.sum(along_u * normal, axis=1, keepdims=True) * normal)
    side = np.cross(normal, tangent) * np.sign(determinant)[:, None]
    return Frames(np.sum(inside * corners, axis=1), np.stack([tangent, side, normal], axis=1))


def barycentric(uvs: Float64, uv: Float64) -> Float64:
    """Weights (N, 3) of the corners (N, 3, 2) of faces at places (N, 2)."""
    a, b, c = uvs.transpose(1, 0, 2)
    parts = np.stack([_cross(c - b, uv - b), _cross(a - c, uv - c), _cross(b - a, uv - a)], axis=1)
    weights: Float64 = parts / _cross(b - a, c - a)[:, None]
    return weights


def roots(chart: Chart, uv: Float64) -> tuple[Integers, Integers]:
    """Every pair of a place of uv (N, 2) and a face that holds it, ordered by places, then by faces.

    Faces are sorted into a grid of about as many cells, so that few are tried for each place. A place on an edge
    belongs to the faces on either side.
    """
    side = max(int(np.sqrt(len(chart.uvs))), 1)
    low, high = _cells(chart.uvs.min(axis=1), side), _cells(chart.uvs.max(axis=1), side)
    span = high - low + 1
    which, place = _expanded(span.prod(axis=1))
    cell = low[which] + np.stack([place % span[which, 0], place // span[which, 0]], axis=1)
    code = cell @ (1, side)
    order = np.argsort(code, kind="stable")
    which, code = which[order], code[order]
    wanted = _cells(uv, side) @ (1, side)
    begin, end = np.searchsorted(code, wanted, "left"), np.searchsorted(code, wanted, "right")
    root, offset = _expanded(end - begin)
    face = which[begin[root] + offset]
    holds = _holds(chart, face, uv[root])
    return root[holds], face[holds]


def _holds(chart: Chart, face: Integers, uv: Float64) -> Bool:
    inside: Bool = np.all(barycentric(chart.uvs[face], uv) >= 0, axis=1)
    return inside


def _cells(uv: Float64, side: int) -> Integers:
    """Columns and rows (N, 2) of a grid over the chart; what lies beside it belongs to the cells at its border."""
    cells: Integers = np.clip(np.floor(uv * side), 0, side - 1).astype(np.int64)
    return cells


def _expanded(counts: Integers) -> tuple[Integers, Integers]:
    """Row i `counts[i]` times: the rows' indices, and the number of each repetition from 0 on."""
    rows = np.repeat(np.arange(len(counts)), counts)
    return rows, np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)


def _cross(a: Float64, b: Float64) -> Float64:
    product: Float64 = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product
