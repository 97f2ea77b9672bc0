"""Closed bodies that light shines through: a slab, a wedge, a finger, a ring, an ear. And a glowing tube."""

import math
from functools import partial

import numpy as np

from scenes.distances import ellipsoid_bound, gradient, isosurface, smooth_union, vesica
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


def _ear_distance(x: Float64, y: Float64, z: Float64, thickness: float) -> Float64:
    """The ear of height 1, with a dish that is `thickness` thick; a bound on the distance but close to the surface."""
    beyond_outline = np.maximum(vesica(x, y, (EAR_WIDTH, 1.0), EAR_TIP_RADIUS) + 0.5 * thickness, 0)
    membrane = np.hypot(_torus_patch(x, y, z), beyond_outline) - 0.5 * thickness
    body = ellipsoid_bound(x, y - EAR_BODY_CENTRE[1], z - EAR_BODY_CENTRE[2], EAR_BODY_RADII)
    return smooth_union(membrane, body, EAR_BLEND)


def _torus_patch(x: Float64, y: Float64, z: Float64) -> Float64:
    """Distance to the outer part of a torus about a line along x, which passes the origin and is concave towards +z."""
    across, along = EAR_BEND_RADII
    distance: Float64 = np.hypot(x, np.hypot(y, z - along) - (along - across)) - across
    return distance
