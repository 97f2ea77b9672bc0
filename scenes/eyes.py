"""The geometry of an eye in its own frame: gaze +y, the centre of the sclera's sphere at the origin.

What both renderers must agree on: where its spheres and planes lie. All lie on the axis, so that one number is enough.

    sclera     sphere of radius sclera_radius about 0, below the plane of the limbus
    cornea     sphere of radius cornea_radius about `cornea_centre`, above that plane
    iris       disk of radius limbus_radius at `iris_plane`, or the part of a sphere about `iris_centre` behind its rim
"""

import math
from dataclasses import replace

import numpy as np

from scenes.image import Float64
from scenes.mesh import Surface
from scenes.procedural import revolved
from scenes.shapes import Eye


def limbus_height(eye: Eye) -> float:
    """The y of the circle in which the cornea meets the sclera."""
    return math.sqrt(eye.sclera_radius**2 - eye.limbus_radius**2)


def cornea_centre(eye: Eye) -> float:
    """The y of the centre of the cornea's sphere, of which the eye has less than a half."""
    return limbus_height(eye) - math.sqrt(eye.cornea_radius**2 - eye.limbus_radius**2)


def apex(eye: Eye) -> float:
    """The y of the foremost point of the cornea."""
    return cornea_centre(eye) + eye.cornea_radius


def endothelium_centre(eye: Eye) -> float | None:
    """The y of the centre of the endothelium's sphere, if there is one."""
    return None if eye.endothelium is None else apex(eye) - eye.endothelium.thickness - eye.endothelium.radius


def iris_plane(eye: Eye) -> float:
    """The y of the iris' rim."""
    return limbus_height(eye) if eye.iris_depth is None else apex(eye) - eye.iris_depth


def iris_centre(eye: Eye) -> float | None:
    """The y of the centre of the sphere on which a bowl-shaped iris lies; None for a flat one.

    The iris is the part behind its rim, which a ray from the cornea meets where it leaves the sphere.
    """
    if eye.iris_curvature is None:
        return None
    return iris_plane(eye) + math.sqrt(eye.iris_curvature**2 - eye.limbus_radius**2)


def eye_problem(eye: Eye) -> tuple[str, str] | None:
    """What does not fit into the eye, as what was found and what is allowed; None when all does."""
    depth, least = apex(eye) - iris_plane(eye), apex(eye) - limbus_height(eye)
    if depth < (1 - 1e-5) * least:  # so that the bound as told, in six digits, will do
        return f"iris_depth = {depth:g}", f"at least {least:.6g}, where the cornea is as wide as the iris"
    if eye.endothelium is not None and eye.endothelium.thickness >= depth:
        return f"endothelium.thickness = {eye.endothelium.thickness:g}", f"less than {depth:.6g}, the depth of the iris"
    return None


def sclera(eye: Eye) -> Surface:
    """The sphere below the limbus, with exact normals and the texture coordinates of the whole sphere."""
    top = math.asin(limbus_height(eye) / eye.sclera_radius)
    normals = _arc(-0.5 * math.pi, top, eye.detail)
    normals[0] = (0.0, -1.0)
    profile = eye.sclera_radius * normals
    profile[-1] = (eye.limbus_radius, limbus_height(eye))
    surface = revolved(profile, normals, eye.detail)
    v = 0.5 + np.arcsin(np.clip(surface.positions[:, 1] / eye.sclera_radius, -1, 1)) / np.pi
    return replace(surface, uvs=np.column_stack([surface.uvs[:, 0], v]).astype(np.float32))


def cornea(eye: Eye) -> Surface:
    """The cap of the cornea's sphere beyond the limbus, with exact normals and the texture coordinates of the iris."""
    bottom = math.acos(eye.limbus_radius / eye.cornea_radius)
    normals = _arc(bottom, 0.5 * math.pi, eye.detail)
    normals[-1] = (0.0, 1.0)
    profile = eye.cornea_radius * normals + (0.0, cornea_centre(eye))
    profile[0] = (eye.limbus_radius, limbus_height(eye))
    surface = revolved(profile, normals, eye.detail)
    uvs = 0.5 + surface.positions[:, [0, 2]] * (0.5, -0.5) / eye.limbus_radius
    return replace(surface, uvs=np.clip(uvs, 0, 1).astype(np.float32))


def _arc(start: float, end: float, detail: int) -> Float64:
    """Points (R, 2) of the unit circle between two angles from +x to +y, as far apart as those of `detail` round it."""
    rings = max(math.ceil(detail * (end - start) / (2 * math.pi)), 2)
    angle = np.linspace(start, end, rings + 1)
    return np.column_stack([np.cos(angle), np.sin(angle)])
