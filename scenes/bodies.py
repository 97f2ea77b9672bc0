"""Closed bodies that light shines through: a slab, a wedge, a finger, a ring, an ear. And a glowing tube."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from scenes.errors import SceneError
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.procedural import box, make_surface, normalised, revolved
from scenes.topology import face_vectors

LINE_SIDES = 64

# The ear, in units of its dish's height.
EAR_WIDTH = 0.62
EAR_TIP_RADIUS = 0.06
EAR_BEND_RADII = (0.42, 1.2)  # across, along
EAR_BODY_CENTRE = (0.0, -0.62, 0.08)
EAR_BODY_RADII = (0.34, 0.26, 0.30)
EAR_BLEND = 0.08
EAR_BOUNDS = ((-0.34, 0.34), (-0.88, 0.5), (-0.22, 0.38))


def slab(thickness: float, width: float) -> Surface:
    """A square plate about the origin, `width` along x and y and `thickness` along z."""
    return box((width, width, thickness))


def wedge(size: tuple[float, float], thin: float, thick: float) -> Surface:
    """A slice `size` along x and y, mirror-symmetric about z = 0; along z `thin` at -x, `thick` at +x, even between."""
    unit = box((1.0, 1.0, 1.0))
    corners = unit.positions.astype(np.float64)
    thickness = thin + (thick - thin) * (corners[:, 0] + 0.5)
    positions = corners * np.column_stack(
        [np.full_like(thickness, size[0]), np.full_like(thickness, size[1]), thickness]
    )
    normals = np.repeat(normalised(face_vectors(positions, unit.faces))[::2], 4, axis=0)
    return make_surface(positions, normals, unit.uvs.astype(np.float64), unit.faces)


def capsule(radius: float, length: float, detail: int) -> Surface:
    """All points within `radius` of the line of `length` along y about the origin, with exact normals.

    `detail` segments go round the axis and about as many round each end from pole to pole and back.
    """
    rings = max(detail // 4, 2)
    angle = 0.5 * np.pi * np.arange(rings + 1) / rings
    arc = np.column_stack([np.cos(angle), np.sin(angle)])
    arc[-1] = (0.0, 1.0)
    normals = np.concatenate([arc[::-1] * (1, -1), arc])
    profile = radius * normals + np.outer(np.sign(np.arange(len(normals)) - rings - 0.5), (0.0, 0.5 * length))
    return revolved(profile, normals, detail)


def torus(radius: float, tube: float, segments: int, sides: int) -> Surface:
    """A ring about y: a tube of radius `tube` whose middle is `radius` from the axis, with exact normals."""
    angle = 2 * np.pi * (np.arange(sides + 1) % sides) / sides
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    return revolved((radius, 0.0) + tube * normals, normals, segments)


def tube(radius: float, length: float) -> Surface:
    """A closed cylinder of `length` along y about the origin, a prism whose sides have exactly the cylinder's area."""
    step = 2 * np.pi / LINE_SIDES
    circumradius = radius * 0.5 * step / np.sin(0.5 * step)
    low, high = (0.0, -0.5 * length), (0.0, 0.5 * length)
    parts = [
        ([low, (circumradius, low[1])], (0.0, -1.0)),
        ([(circumradius, low[1]), (circumradius, high[1])], (1.0, 0.0)),
        ([(circumradius, high[1]), high], (0.0, 1.0)),
    ]
    return joined([revolved(np.array(ends), np.tile(normal, (2, 1)), LINE_SIDES) for ends, normal in parts])


def joined(surfaces: list[Surface]) -> Surface:
    """Several surfaces as one."""
    starts = np.cumsum([0] + [len(surface.positions) for surface in surfaces[:-1]])
    return Surface(
        positions=np.concatenate([surface.positions for surface in surfaces]),
        normals=np.concatenate([surface.normals for surface in surfaces]),
        uvs=np.concatenate([surface.uvs for surface in surfaces]),
        faces=np.concatenate(
            [np.uint32(start) + surface.faces for start, surface in zip(starts, surfaces, strict=True)]
        ),
    )


def ear(height: float, membrane: float, cells: int) -> Surface:
    """A bat's ear: a dish `height` tall along y about the origin, that opens towards +z, on a round body below.

    The dish is everything within half of `membrane` of a pointed patch of a torus that is bent more strongly across
    than along, and so equally thick up to its round rim. A smooth union joins it to an ellipsoid. The surface is found
    on a grid of `cells` along the dish; the normals are the gradients of the signed distance.

    Raises
    ------
    SceneError
        The membrane is thinner than two cells: then the grid may have no sample between its middle and its surface.
    """
    if cells * membrane < 2 * height:
        raise SceneError(
            f"found a membrane of {membrane:g} on a grid of cells of {height / cells:.3g}; allowed is one of two cells "
            f"or more. Use at least {math.ceil(2 * height / membrane)} cells, or a thicker membrane."
        )
    thickness = membrane / height
    margin = 0.5 * thickness + 2 / cells
    axes = [np.arange(low - margin, high + margin, 1 / cells) for low, high in EAR_BOUNDS]
    positions, faces = isosurface(partial(_ear_distance, thickness=thickness), axes)
    normals = normalised(gradient(partial(_ear_distance, thickness=thickness), positions, 1e-2 / cells))
    low, high = np.array(EAR_BOUNDS).T
    uvs = np.clip((positions - low) / (high - low), 0, 1)[:, :2]
    return make_surface(height * positions, normals, uvs, faces)


Field = Callable[[Float64, Float64, Float64], Float64]
"""A signed distance, negative inside, of coordinates x, y, z of shapes that broadcast."""


def _ear_distance(x: Float64, y: Float64, z: Float64, thickness: float) -> Float64:
    """The ear of height 1, with a dish that is `thickness` thick; a bound on the distance but close to the surface."""
    beyond_outline = np.maximum(_vesica(x, y) + 0.5 * thickness, 0)
    membrane = np.hypot(_torus_patch(x, y, z), beyond_outline) - 0.5 * thickness
    body = _ellipsoid_bound(x, y - EAR_BODY_CENTRE[1], z - EAR_BODY_CENTRE[2], EAR_BODY_RADII)
    return _smooth_union(membrane, body, EAR_BLEND)


def _torus_patch(x: Float64, y: Float64, z: Float64) -> Float64:
    """Distance to the outer part of a torus about a line along x, which passes the origin and is concave towards +z."""
    across, along = EAR_BEND_RADII
    distance: Float64 = np.hypot(x, np.hypot(y, z - along) - (along - across)) - across
    return distance


def _vesica(x: Float64, y: Float64) -> Float64:
    """The signed distance in the plane to the lens that two circles share, with its tips rounded: 1 tall along y.

    Quilez 2020, "2D distance functions", vesica.
    """
    half_height, half_width = 0.5 - EAR_TIP_RADIUS, 0.5 * EAR_WIDTH - EAR_TIP_RADIUS
    offset = 0.5 * (half_height**2 / half_width - half_width)
    x, y = np.abs(x), np.abs(y)
    to_tip, to_side = np.hypot(x, y - half_height), np.hypot(x + offset, y) - (offset + half_width)
    distance: Float64 = np.where((y - half_height) * offset > x * half_height, to_tip, to_side) - EAR_TIP_RADIUS
    return distance


def _ellipsoid_bound(x: Float64, y: Float64, z: Float64, radii: tuple[float, float, float]) -> Float64:
    """An ellipsoid's distance to first order close to it. Quilez 2008, "Ellipsoid SDF"."""
    a, b, c = radii
    k0 = np.sqrt((x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2)
    k1 = np.sqrt((x / a**2) ** 2 + (y / b**2) ** 2 + (z / c**2) ** 2)
    distance: Float64 = k0 * (k0 - 1) / np.maximum(k1, 1e-12)  # at the centre both vanish; there only the sign counts
    return distance


def _smooth_union(a: Float64, b: Float64, radius: float) -> Float64:
    """The smaller of two distances, rounded where they differ by less than `radius`.

    Quilez 2013, "Smooth minimum", quadratic polynomial.
    """
    overlap = np.maximum(radius - np.abs(a - b), 0) / radius
    return np.minimum(a, b) - 0.25 * radius * overlap**2


def isosurface(field: Field, axes: list[Float64]) -> tuple[Float64, NDArray[np.integer]]:
    """Vertices (V, 3) and outward faces (F, 3) of a field's zero set on an even grid with these coordinates.

    Lewiner et al. 2003, "Efficient implementation of marching cubes' cases with topological guarantees". A sample of
    exactly 0 would collapse triangles into a vertex, so that none is left closer to 0 than a thousandth of a cell.
    """
    from skimage.measure import marching_cubes

    x, y, z = axes
    cell = x[1] - x[0]
    samples = np.empty((len(x), len(y), len(z)), dtype=np.float32)
    for i, at in enumerate(x):
        samples[i] = field(at, y[:, None], z[None, :])
    least = 1e-3 * cell
    is_close = np.abs(samples) < least
    samples[is_close] = np.copysign(least, samples[is_close])
    vertices, faces, _, _ = marching_cubes(samples, 0.0, gradient_direction="descent")
    origin = np.array([x[0], y[0], z[0]])
    return origin + cell * vertices.astype(np.float64), faces


def gradient(field: Field, points: Float64, step: float) -> Float64:
    """The gradient (V, 3) of a field at points (V, 3), by central differences."""
    differences: list[Float64] = [
        field(*(points + offset).T) - field(*(points - offset).T) for offset in step * np.eye(3)
    ]
    return np.stack(differences, axis=1) / (2 * step)
