"""How long rays run inside closed bodies, as a Dr.Jit loop over all layers."""

from typing import Any

import drjit as dr
import numpy as np

from reference.stage import Stage
from scenes.image import Float64

STEP = 1e-6
"""A ray is cast anew this far behind each hit, as part of the largest distance between the camera and the body.

That is 8 to 16 spacings of float32, more than the rounding of a hit; a layer thinner than that is lost. Should the
same surface be hit once more, nothing is counted twice.
"""


def length_inside(stage: Stage, ray: Any) -> Any:
    """Length of camera rays inside the subject, in the scene's unit.

    For each body that is the sum over all pairs of a front face and the back face that follows it; if the camera is in
    the body, the first back face is paired with the camera. Other faces without a partner, as an open mesh has them,
    count nothing. Other shapes hide nothing, and bodies that overlap count each.
    """
    lengths = [_loop(stage.mi, *_alone(stage, body), ray.o, ray.d, stage.mi.Bool(True)) for body in stage.subject]
    total: Any = sum(lengths)
    return total


def _alone(stage: Stage, body: Any) -> tuple[Any, Any, Any]:
    """A scene of this body only, whose triangles leave no gap; the step behind its surface; if the camera is in it."""
    scene = stage.mi.load_dict({"type": "scene", "body": body, "embree_use_robust_intersections": True})
    origin = np.array(stage.sensor.world_transform().translation()).ravel()
    low, high = np.array(scene.bbox().min), np.array(scene.bbox().max)
    farthest = float(np.linalg.norm(np.maximum(np.abs(low - origin), np.abs(high - origin))))
    mesh = stage.mi.traverse(body)
    corners = np.array(mesh["vertex_positions"], dtype=np.float64).reshape(-1, 3)[
        np.array(mesh["faces"]).reshape(-1, 3)
    ]
    return scene, stage.mi.Float(STEP * farthest), stage.mi.Bool(winding_number(corners - origin) > 0.5)


def winding_number(corners: Float64) -> float:
    """How often triangles (F, 3, 3), counter-clockwise from outside, go round the origin: the sum of solid angles.

    Van Oosterom and Strackee 1983, "The Solid Angle of a Plane Triangle".
    """
    a, b, c = corners.transpose(1, 0, 2)
    (la, lb, lc) = np.linalg.norm(corners, axis=2).T
    along = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    return float(np.arctan2((a * np.cross(b, c)).sum(axis=1), along).sum() / (2 * np.pi))


@dr.syntax  # type: ignore[untyped-decorator]
def _loop(mi: Any, scene: Any, step: Any, is_inside: Any, origin: Any, direction: Any, active: Any) -> Any:
    """Distances are measured from the camera, so that no rounding of a restart adds up."""
    length = mi.Float(0.0)
    travelled = mi.Float(0.0)
    entered_at = mi.Float(0.0)

    while active:
        si = scene.ray_intersect(mi.Ray3f(origin + direction * travelled, direction), active)
        active &= si.is_valid()
        distance = travelled + si.t
        enters = dr.dot(direction, si.n) < 0
        length += dr.select(active & is_inside & ~enters, distance - entered_at, 0.0)
        entered_at = dr.select(enters, distance, entered_at)
        is_inside = mi.Bool(enters)
        travelled = distance + step

    return length
