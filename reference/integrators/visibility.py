"""How much of a light a surface point sees: shadow rays to a point, or into the cone of directions that a ball fills.

What counts is the surface as it is, its triangles: light from below the plane of the triangle is not seen, whatever
normals the triangle's corners have for shading.
"""

from typing import Any

import drjit as dr
import numpy as np

from reference.stage import Stage
from scenes.model import PointLight, SphereLight

STEP = 1e-6
"""Shadow rays start this far above a surface and end this far before the light, as part of the largest coordinate.

That is 8 to 16 spacings of float32. The rounding of a hit, by which a surface could hide the light from itself, was
gone from 1e-7 on in a room; from 1e-5 on, rays missed what they should meet.
"""


def sees_point(stage: Stage, light: PointLight, si: Any) -> Any:
    """1 where the light is seen, else 0."""
    away = _place(stage, light) - si.p
    distance = dr.norm(away)
    return _reaches(stage, stage.scene, si, away / distance, distance)


def sees_ball(stage: Stage, light: SphereLight, si: Any, sample: Any) -> Any:
    """1 where the ball is seen in a direction, else 0; the directions are uniform over the cone that the ball fills.

    Shirley, Wang & Zimmerman 1996, "Monte Carlo Techniques for Direct Lighting Calculations", on spherical luminaires.
    With x = 1 - cos(theta), theta the angle to the ball's centre at the distance d, x is uniform up to
    1 - sqrt(1 - R²/d²) and sin²(theta) = x (2 - x): no small difference of large numbers.

    Parameters
    ----------
    sample : two numbers, uniform in [0, 1)
    """
    mi = stage.mi
    radius = dr.opaque(mi.Float, light.radius)
    away = _place(stage, light) - si.p
    d = dr.norm(away)
    sin_sqr_max = dr.minimum(dr.square(radius / d), 1.0)
    x = sample.x * sin_sqr_max / (1 + dr.sqrt(1 - sin_sqr_max))
    sin_sqr = x * (2 - x)
    sin_phi, cos_phi = dr.sincos(dr.two_pi * sample.y)
    sin_theta = dr.sqrt(sin_sqr)
    toward = mi.Frame3f(away / d).to_world(mi.Vector3f(sin_theta * cos_phi, sin_theta * sin_phi, 1 - x))
    half_chord = dr.sqrt(dr.maximum(dr.square(radius) - dr.square(d) * sin_sqr, 0.0))
    return _reaches(stage, _without_ball(stage, light), si, toward, d * (1 - x) - half_chord)


def _place(stage: Stage, light: PointLight | SphereLight) -> Any:
    """The light's centre, as a variable: a literal would compile the kernel anew for each scene."""
    place = stage.mi.Point3f(*light.position)
    dr.make_opaque(place)
    return place


def _without_ball(stage: Stage, light: SphereLight) -> Any:
    """A scene of the shapes that are not within the ball: its own mesh is, which rays could touch at the ball's rim.

    There the distance to the ball is as steep as a square root, and rounding moves it by thousandths of the radius.
    """
    shapes = {
        f"shape_{i}": shape for i, shape in enumerate(stage.scene.shapes()) if not _is_within(stage, shape, light)
    }
    return stage.mi.load_dict({"type": "scene", **shapes}, optimize=False)


def _is_within(stage: Stage, shape: Any, light: SphereLight) -> bool:
    corners = np.array(stage.mi.traverse(shape)["vertex_positions"], dtype=np.float64).reshape(-1, 3)
    distance = np.linalg.norm(corners - light.position, axis=1)
    rounding = np.finfo(np.float32).eps * np.abs(corners).max()
    return bool(distance.max() <= light.radius + rounding)


def _reaches(stage: Stage, blockers: Any, si: Any, direction: Any, distance: Any) -> Any:
    """1 where nothing is in the way from a surface's front side over a distance, else 0."""
    mi = stage.mi
    box = stage.scene.bbox()
    step = dr.opaque(mi.Float, STEP * float(np.abs([box.min, box.max]).max()))
    faces = si.is_valid() & (dr.dot(si.n, direction) > 0)
    ray = mi.Ray3f(si.p + step * si.n, direction, distance - step, 0.0, [])
    return dr.select(faces & ~blockers.ray_test(ray, faces), mi.Float(1.0), 0.0)
