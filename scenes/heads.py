"""A head-like body: skull, brow, nose, lips, chin, ears, neck, and eyelids round two sockets.

Lengths are in units of the head's height from chin to crown; the origin is the middle between the eyes' centres and the
head looks along +z. It is mirror-symmetric about x = 0: every part is described for x >= 0.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.distances import ellipsoid_bound, gradient, isosurface, smooth_union, vesica
from scenes.errors import SceneError
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.procedural import make_surface, normalised
from scenes.units import Vec3

EYE: Vec3 = (0.15, 0.0, 0.0)
SOCKET_RADIUS = 0.070
"""For an eyeball of radius 0.066: a cornea that protrudes by a fifth of that fits behind the lids."""

LID_RADIUS = 0.090
OPENING = (0.062, 0.130)
"""Height and width of the slit between the lids."""

OPENING_TIP = 0.008

ELLIPSOIDS: tuple[tuple[Vec3, Vec3, float], ...] = (
    ((0.0, -0.13, -0.19), (0.230, 0.31, 0.235), 0.12),  # face
    ((0.0, -0.405, -0.065), (0.085, 0.070, 0.085), 0.10),  # chin
    ((0.135, -0.13, -0.085), (0.080, 0.070, 0.080), 0.08),  # cheek
)
"""Centre, radii and blend of what is joined to the skull."""

SKULL: tuple[Vec3, Vec3] = (0.0, 0.14, -0.33), (0.315, 0.36, 0.375)

CAPSULES: tuple[tuple[Vec3, Vec3, float, float, float], ...] = (
    ((0.05, 0.095, 0.012), (0.20, 0.085, -0.062), 0.034, 0.026, 0.05),  # brow
    ((0.0, 0.055, 0.022), (0.0, -0.150, 0.098), 0.024, 0.036, 0.05),  # bridge and tip of the nose
    ((0.0, -0.172, 0.060), (0.036, -0.172, 0.046), 0.026, 0.022, 0.02),  # wings of the nose
    ((0.0, -0.262, 0.026), (0.066, -0.278, -0.004), 0.018, 0.006, 0.02),  # upper lip
    ((0.0, -0.301, 0.020), (0.058, -0.288, -0.006), 0.021, 0.007, 0.015),  # lower lip
    ((0.0, -0.34, -0.34), (0.0, -0.74, -0.39), 0.135, 0.168, 0.08),  # neck
)
"""Ends, radii at them and blend."""

EAR_CENTRE: Vec3 = (0.342, 0.0, -0.33)
EAR_TURN = math.radians(52)
"""Of the ear's face, from ahead to aside."""

EAR_LEAN = math.radians(12)
EAR_SIZE = (0.19, 0.32)
EAR_TIP = 0.035
EAR_THICKNESS = 0.030
EAR_BEND = 0.22
"""Radius of the sphere on which the ear lies; it is concave towards its face."""

EAR_BLEND = 0.035
BOUNDS = ((-0.50, 0.50), (-0.95, 0.51), (-0.74, 0.20))

CHART_CENTRE: Vec3 = (0.0, 0.1, -0.33)

THINNEST = EAR_THICKNESS
"""The thinnest part, which the grid must resolve."""


def head(height: float, cells: int) -> Surface:
    """The surface of a head on a grid of `cells` along its `height`; closed, faces outward.

    The chart goes round the axis through the ears: u = 0.25 straight ahead, 0.5 at the crown, 0.75 at the back, with
    its seam below, in the neck; v runs from 0 at the side of +x to 1 at that of -x. So the scalp is a rectangle of it,
    where it is one-to-one and dP/du x dP/dv looks outward; elsewhere it folds over itself. Vertices along the seam are
    there twice, with u and u + 1 (textures repeat).

    Raises
    ------
    SceneError
        The ears are thinner than two cells: then the grid may have no sample between their middle and their surface.
    """
    if cells * THINNEST < 2:
        raise SceneError(
            f"found a grid of {cells} cells along a head; allowed is one that puts two cells or more into an ear. Use "
            f"at least {math.ceil(2 / THINNEST)} cells."
        )
    margin = 2 / cells
    axes = [np.arange(low - margin, high + margin, 1 / cells) for low, high in BOUNDS]
    positions, faces = isosurface(distance, axes)
    normals = normalised(gradient(distance, positions, 1e-2 / cells))
    return _split_at_the_seam(make_surface(height * positions, normals, _chart(positions), faces))


def distance(x: Float64, y: Float64, z: Float64) -> Float64:
    """Negative inside; a bound on the distance to the head of height 1 that is close to it near the surface."""
    x = np.abs(x)
    centre, radii = SKULL
    body = ellipsoid_bound(x - centre[0], y - centre[1], z - centre[2], radii)
    for centre, radii, blend in ELLIPSOIDS:
        body = smooth_union(body, ellipsoid_bound(x - centre[0], y - centre[1], z - centre[2], radii), blend)
    for start, end, first, last, blend in CAPSULES:
        body = smooth_union(body, _cone(x, y, z, start, end, first, last), blend)
    body = smooth_union(body, _ear(x, y, z), EAR_BLEND)
    to_eye = np.sqrt((x - EYE[0]) ** 2 + (y - EYE[1]) ** 2 + (z - EYE[2]) ** 2)
    body = smooth_union(body, to_eye - LID_RADIUS, 0.04)
    opening = np.maximum(vesica(y - EYE[1], x - EYE[0], OPENING, OPENING_TIP), -(z - EYE[2]))
    hollow = np.minimum(to_eye - SOCKET_RADIUS, opening)
    carved: Float64 = np.maximum(body, -hollow)
    return carved


def _cone(x: Float64, y: Float64, z: Float64, start: Vec3, end: Vec3, first: float, last: float) -> Float64:
    """About the distance to a capsule whose radius changes evenly between its ends."""
    (ax, ay, az), (bx, by, bz) = start, end
    dx, dy, dz = bx - ax, by - ay, bz - az
    along = ((x - ax) * dx + (y - ay) * dy + (z - az) * dz) / (dx * dx + dy * dy + dz * dz)
    t = np.clip(along, 0, 1)
    gap: Float64 = np.sqrt((x - ax - t * dx) ** 2 + (y - ay - t * dy) ** 2 + (z - az - t * dz) ** 2)
    return gap - (first + (last - first) * t)


def _ear(x: Float64, y: Float64, z: Float64) -> Float64:
    """A pointed patch of a sphere, EAR_THICKNESS thick with a round rim, that stands away from the head."""
    x, y, z = x - EAR_CENTRE[0], y - EAR_CENTRE[1], z - EAR_CENTRE[2]
    sin, cos = math.sin(EAR_TURN), math.cos(EAR_TURN)
    across, ahead = cos * x - sin * z, sin * x + cos * z
    sin, cos = math.sin(EAR_LEAN), math.cos(EAR_LEAN)
    across, up = cos * across - sin * y, sin * across + cos * y
    sheet = np.sqrt(across**2 + up**2 + (ahead - EAR_BEND) ** 2) - EAR_BEND
    beyond = np.maximum(vesica(across, up, EAR_SIZE, EAR_TIP) + 0.5 * EAR_THICKNESS, 0)
    thickness: Float64 = np.hypot(sheet, beyond) - 0.5 * EAR_THICKNESS
    return thickness


def _chart(positions: Float64) -> Float64:
    """(V, 2) of points (V, 3) of the head of height 1: turns about the axis through the ears, and angle from +x."""
    x, y, z = (positions - CHART_CENTRE).T
    u = np.arctan2(z, -y) / (2 * np.pi) % 1
    v = np.arctan2(np.hypot(y, z), x) / np.pi
    return np.column_stack([u, v])


def _split_at_the_seam(surface: Surface) -> Surface:
    """The surface with a second vertex, a turn further, where a face crosses the seam."""
    u = surface.uvs[surface.faces, 0]
    wraps = (u.max(axis=1, keepdims=True) - u > 0.5) & (u < 0.5)
    doubled, place = np.unique(surface.faces[wraps], return_inverse=True)
    faces: NDArray[np.uint32] = surface.faces.copy()
    faces[wraps] = (len(surface.positions) + place).astype(np.uint32)
    return replace(
        surface,
        positions=np.concatenate([surface.positions, surface.positions[doubled]]),
        normals=np.concatenate([surface.normals, surface.normals[doubled]]),
        uvs=np.concatenate([surface.uvs, surface.uvs[doubled] + np.array([1, 0], dtype=np.float32)]),
        faces=faces,
    )
