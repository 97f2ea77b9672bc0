"""Shapes made by formula.

Everything is computed in float64 and handed out as float32. Faces are counter-clockwise seen from their normals' side.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.errors import SceneError
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.shapes import WallName
from scenes.units import Vec3

Faces = NDArray[np.int64]

BUMP_WAVES = 4
KNOT_MINOR_RATIO = 0.5
DISK_SIDES = 128

X, Y, Z = np.eye(3)
WALL_NORMALS: dict[WallName, Float64] = {"left": X, "right": -X, "floor": Y, "ceiling": -Y, "back": Z, "front": -Z}


def make_surface(positions: Float64, normals: Float64, uvs: Float64, faces: NDArray[np.integer]) -> Surface:
    """The arrays in the types of `Surface`, each contiguous."""
    return Surface(
        positions=np.ascontiguousarray(positions, dtype=np.float32),
        normals=np.ascontiguousarray(normals, dtype=np.float32),
        uvs=np.ascontiguousarray(uvs, dtype=np.float32),
        faces=np.ascontiguousarray(faces, dtype=np.uint32),
    )


def normalised(vectors: Float64) -> Float64:
    """Vectors (..., 3) scaled to length 1."""
    lengths: Float64 = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / lengths


def rotation_xyz(degrees: Vec3) -> Float64:
    """The matrix (3, 3) that turns column vectors about x, then y, then z, counter-clockwise seen from the tips."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    turned: Float64 = about_z @ about_y @ about_x
    return turned


def icosphere(detail: int) -> tuple[Float64, Faces]:
    """Unit directions (10 * 4^detail + 2, 3) and faces (20 * 4^detail, 3) of a subdivided icosahedron."""
    g = (1 + math.sqrt(5)) / 2
    corners = [(s * 1.0, t * g, 0.0) for t in (1, -1) for s in (-1, 1)]
    directions = normalised(np.array([np.roll(c, k) for k in range(3) for c in corners]))
    faces = _icosahedron_faces(directions)
    for _ in range(detail):
        directions, faces = _subdivided(directions, faces)
    return directions, faces


def _icosahedron_faces(corners: Float64) -> Faces:
    """The 20 triples of mutually nearest corners, counter-clockwise from outside."""
    distances = np.linalg.norm(corners[:, None] - corners[None], axis=-1)
    near = np.isclose(distances, distances[distances > 0].min())
    triples = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    outward = [t if np.linalg.det(corners[list(t)]) > 0 else (t[0], t[2], t[1]) for t in triples]
    return np.array(outward, dtype=np.int64)


def _subdivided(directions: Float64, faces: Faces) -> tuple[Float64, Faces]:
    """Each triangle split into four at the middles of its edges, which are pushed out to the unit sphere."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middles = normalised(directions[unique].sum(axis=1))
    m = (len(directions) + inverse).reshape(-1, 3)
    a, b, c = faces.T
    ab, bc, ca = m.T
    split = np.stack([a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca], axis=1).reshape(-1, 3)
    return np.concatenate([directions, middles]), split


def latitude_longitude(directions: Float64) -> Float64:
    """Texture coordinates (V, 2) of unit directions: u = 0.5 at +z and grows towards +x, v = 1 at +y.

    Vertices are shared across the meridian at -z, so that the faces there squeeze the whole texture.
    """
    u = 0.5 + np.arctan2(directions[:, 0], directions[:, 2]) / (2 * np.pi)
    v = 0.5 + np.arcsin(np.clip(directions[:, 1], -1, 1)) / np.pi
    return np.stack([u, v], axis=1)


def sphere(radius: float, detail: int) -> Surface:
    """A sphere about the origin with exact normals; its vertices lie on it, so the area is a little too small."""
    return ellipsoid((radius, radius, radius), detail)


def ellipsoid(radii: Sequence[float], detail: int) -> Surface:
    """x²/a² + y²/b² + z²/c² = 1 with radii (a, b, c) along the axes and exact normals."""
    directions, faces = icosphere(detail)
    semi_axes = np.array(radii, dtype=np.float64)
    return make_surface(
        directions * semi_axes, normalised(directions / semi_axes), latitude_longitude(directions), faces
    )


def displaced_icosphere(radius: float, amplitude: float, frequency: float, seed: int, detail: int) -> Surface:
    """A star-shaped blob: r(d) = radius (1 + amplitude b(d)) along the unit direction d.

    b(d) is the mean of four sinusoids sin(frequency k·d + phase) with unit vectors k and phases drawn from `seed`, so
    that |b| <= 1 and at most `frequency` waves go round a great circle. The normals are exact: with f = 1 + amplitude b
    the surface f d has the normal f d - amplitude ∇b, where ∇b is the gradient on the unit sphere.
    """
    directions, faces = icosphere(detail)
    wave_vectors, phases = _bump_waves(seed)
    argument = frequency * directions @ wave_vectors.T + phases
    bump = np.sin(argument).mean(axis=1, keepdims=True)
    gradient = frequency * np.cos(argument) @ wave_vectors / BUMP_WAVES
    tangential = gradient - np.sum(gradient * directions, axis=1, keepdims=True) * directions
    factor = 1 + amplitude * bump
    normals = normalised(factor * directions - amplitude * tangential)
    return make_surface(radius * factor * directions, normals, latitude_longitude(directions), faces)


def _bump_waves(seed: int) -> tuple[Float64, Float64]:
    """Unit wave vectors (4, 3) and phases (4,) from the raw PCG64 stream, which numpy promises never to change."""
    raw = np.random.PCG64(seed).random_raw(3 * BUMP_WAVES).reshape(3, BUMP_WAVES)
    uniform = (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53
    z, azimuth, phases = 2 * uniform[0] - 1, 2 * np.pi * uniform[1], 2 * np.pi * uniform[2]
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=1), phases


def torus_knot(p: int, q: int, radius: float, tube: float, segments: int, sides: int) -> Surface:
    """A tube of constant radius `tube` around the (p, q) knot on a torus of radii `radius` and `radius` / 2 about y.

    The torus normal is perpendicular to the knot, which lies on the torus. It serves as the first axis of the frame, so
    that the frame closes exactly and needs no Frenet normal. The normals are exact.

    Raises
    ------
    SceneError
        `knot_problem` finds one.
    """
    problem = knot_problem(p, q, radius, tube)
    if problem is not None:
        raise SceneError(f"torus knot: found {problem[0]}; allowed: {problem[1]}.")
    t = 2 * np.pi * np.arange(segments)[:, None] / segments
    a = 2 * np.pi * np.arange(sides)[None, :] / sides
    centre, tangent, _ = _knot_curve(p, q, radius, t[:, 0])
    across = np.concatenate([np.cos(q * t) * np.cos(p * t), np.sin(q * t), np.cos(q * t) * np.sin(p * t)], axis=1)
    binormal = np.cross(normalised(tangent), across)
    normals = np.cos(a)[..., None] * across[:, None] + np.sin(a)[..., None] * binormal[:, None]
    positions = centre[:, None] + tube * normals
    uvs = np.stack(np.broadcast_arrays(t / (2 * np.pi), a / (2 * np.pi)), axis=-1)
    return make_surface(
        positions.reshape(-1, 3), normals.reshape(-1, 3), uvs.reshape(-1, 2), _wrapped_grid_faces(segments, sides)
    )


def _knot_curve(p: int, q: int, radius: float, t: Float64) -> tuple[Float64, Float64, Float64]:
    """The knot's points and their first and second derivatives by t, each (T, 3).

    The knot is the x, y, z of ((1 + h cos qt) cos pt, h sin qt, (1 + h cos qt) sin pt) times the radius, h = 1/2.
    """
    h = KNOT_MINOR_RATIO
    ring, ring_1, ring_2 = 1 + h * np.cos(q * t), -h * q * np.sin(q * t), -h * q * q * np.cos(q * t)
    c, s = np.cos(p * t), np.sin(p * t)
    point = np.stack([ring * c, h * np.sin(q * t), ring * s], axis=1)
    first = np.stack([ring_1 * c - p * ring * s, h * q * np.cos(q * t), ring_1 * s + p * ring * c], axis=1)
    second = np.stack(
        [
            ring_2 * c - 2 * p * ring_1 * s - p * p * ring * c,
            -h * q * q * np.sin(q * t),
            ring_2 * s + 2 * p * ring_1 * c - p * p * ring * s,
        ],
        axis=1,
    )
    return radius * point, radius * first, radius * second


def knot_problem(p: int, q: int, radius: float, tube: float) -> tuple[str, str] | None:
    """Why there is no such knot, as what was found and what is allowed; None when there is one.

    A common divisor of p and q gives several curves, and a tube thicker than the tightest bend folds into itself.
    """
    if math.gcd(p, q) != 1:
        return f"p = {p} and q = {q}", "numbers without a common divisor, as others make several curves"
    _, first, second = _knot_curve(p, q, radius, np.linspace(0, 2 * np.pi, 4096))
    bend = float((np.linalg.norm(first, axis=1) ** 3 / np.linalg.norm(np.cross(first, second), axis=1)).min())
    if tube >= bend:
        return f"tube = {tube:g}", f"less than {bend:.4g}, the radius of the knot's tightest bend"
    return None


def _wrapped_grid_faces(rows: int, columns: int) -> Faces:
    """Two triangles a cell of a grid of vertices that closes in both directions."""
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    i_next, j_next = (i + 1) % rows, (j + 1) % columns
    a, b, c, d = i * columns + j, i_next * columns + j, i_next * columns + j_next, i * columns + j_next
    return np.stack([a, c, b, a, d, c], axis=-1).reshape(-1, 3)


def revolved(profile: Float64, normals: Float64, segments: int) -> Surface:
    """The surface that a curve sweeps when it turns about y.

    profile  : (R, 2) distances from the axis and heights, with the outside on the right of who walks along the curve
    normals  : (R, 2) the outward normals there, of unit length
    segments : how many parts a full turn has

    u = 0.5 at +z and grows towards +x, v grows with the length along the curve. Where the curve meets the axis there
    are triangles, quadrilaterals of two triangles elsewhere.
    """
    turn = 2 * np.pi * (np.arange(segments + 1) % segments) / segments - np.pi
    across = np.column_stack([np.sin(turn), np.cos(turn)])
    steps = np.linalg.norm(np.diff(profile, axis=0), axis=1)
    v = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    u = np.arange(segments + 1) / segments
    uvs = np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1)
    return make_surface(
        _turned(profile, across),
        _turned(normals, across),
        uvs.reshape(-1, 2),
        _strip_faces(profile[:, 0] == 0, segments),
    )


def _turned(curve: Float64, across: Float64) -> Float64:
    """Points (R, 2) of a half plane in each of the directions (C, 2) of x and z, row by row (R * C, 3)."""
    x, z = curve[:, :1] * across[:, 0], curve[:, :1] * across[:, 1]
    return np.stack(np.broadcast_arrays(x, curve[:, 1:], z), axis=-1).reshape(-1, 3)


def _strip_faces(is_pole: NDArray[np.bool_], segments: int) -> Faces:
    """Two triangles a cell of a grid with `segments` + 1 columns, but for those that a row in one point collapses."""
    i, j = np.meshgrid(np.arange(len(is_pole) - 1), np.arange(segments), indexing="ij")
    a = i * (segments + 1) + j
    b, c, d = a + 1, a + segments + 2, a + segments + 1
    lower = np.stack([a, b, c], axis=-1)[~is_pole[:-1]]
    upper = np.stack([a, c, d], axis=-1)[~is_pole[1:]]
    return np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)])


def rectangle(size: Sequence[float]) -> Surface:
    """A rectangle (width, height) about the origin in the xy plane, facing +z, u to the right and v up."""
    return _joined([_panel(np.zeros(3), Z, np.array([size[0], size[1], 0.0]))])


def box(size: Sequence[float]) -> Surface:
    """A closed box about the origin, facing outward; every face has its own four vertices and the whole texture."""
    extent = np.array(size, dtype=np.float64)
    return _joined([_panel(0.5 * extent * -inward, -inward, extent) for inward in WALL_NORMALS.values()])


def room_walls(size: Sequence[float]) -> dict[WallName, Surface]:
    """The six walls of a box about the origin, facing inward; every wall has the whole texture."""
    extent = np.array(size, dtype=np.float64)
    return {name: _joined([_panel(0.5 * extent * -inward, inward, extent)]) for name, inward in WALL_NORMALS.items()}


def disk(radius: float) -> Surface:
    """A disk about the origin in the xy plane, facing +z: a polygon of 128 sides with exactly the area π radius²."""
    step = 2 * np.pi / DISK_SIDES
    circumradius = radius * math.sqrt(step / math.sin(step))
    angle = step * np.arange(DISK_SIDES)
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    unit = np.concatenate([np.zeros((1, 3)), rim])
    i = np.arange(DISK_SIDES)
    faces = np.stack([np.zeros_like(i), 1 + i, 1 + (i + 1) % DISK_SIDES], axis=1)
    return make_surface(circumradius * unit, np.tile(Z, (len(unit), 1)), 0.5 + 0.5 * unit[:, :2], faces)


Panel = tuple[Float64, Float64]


def _panel(centre: Float64, normal: Float64, size: Float64) -> Panel:
    """Corners (4, 3) and normals (4, 3) of a face perpendicular to an axis, lower left first, counter-clockwise.

    v points to +y on upright faces, to -z on those that face up and to +z on those that face down.
    """
    up = Y if normal[1] == 0 else -normal[1] * Z
    right = np.cross(up, normal)
    corners = np.array([-right - up, right - up, right + up, -right + up])
    return centre + 0.5 * size * corners, np.tile(normal, (4, 1))


def _joined(panels: list[Panel]) -> Surface:
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    faces = np.concatenate([4 * k + quad for k in range(len(panels))])
    uvs = np.tile(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), (len(panels), 1))
    return make_surface(
        np.concatenate([corners for corners, _ in panels]), np.concatenate([n for _, n in panels]), uvs, faces
    )
