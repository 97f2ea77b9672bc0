"""What a pixel sees, by ray casts: depth, normal, albedo, and how much of the pixel the subject covers.

Each value is the mean over a regular grid of GRID x GRID positions in the pixel. Both sides use that grid, so their
images agree to rounding wherever camera, geometry and materials agree: this is the parity that must hold before any
radiance is compared. Positions that see nothing count as 0.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.quantity import Integrator, Quantity
from reference.stage import Stage, pixel_grid
from scenes.image import Float32
from scenes.model import PIXEL_GRID, Scene

RAYS_A_LAUNCH = 1 << 22


@dataclass(frozen=True)
class Hit:
    stage: Stage
    ray: Any
    si: Any
    valid: Any


def _depth(hit: Hit) -> list[Any]:
    """Distance along the viewing axis, not along the ray."""
    import drjit as dr

    mi = hit.stage.mi
    axis = hit.stage.sensor.world_transform() @ mi.Vector3f(0, 0, 1)
    origin = hit.stage.sensor.world_transform().translation()
    return [dr.dot(hit.si.p - origin, axis)]


def _normal(hit: Hit) -> list[Any]:
    n = hit.si.sh_frame.n
    return [n.x, n.y, n.z]


def _albedo(hit: Hit) -> list[Any]:
    rgb = hit.si.bsdf().eval_diffuse_reflectance(hit.si, hit.valid)
    return [rgb.x, rgb.y, rgb.z]


def _coverage(hit: Hit) -> list[Any]:
    mi = hit.stage.mi
    inside = hit.stage.is_subject(hit.si.shape, hit.valid)
    return [mi.Float(inside)]


def _render(stage: Stage, channels: Callable[[Hit], list[Any]]) -> Float32:
    import drjit as dr

    rows_a_launch = max(1, RAYS_A_LAUNCH // (stage.width * PIXEL_GRID**2))
    bands = []
    for top in range(0, stage.height, rows_a_launch):
        rows = range(top, min(top + rows_a_launch, stage.height))
        x, y = pixel_grid(stage.width, rows, PIXEL_GRID)
        ray = stage.rays(stage.mi.Float(x), stage.mi.Float(y))
        si = stage.scene.ray_intersect(ray)
        valid = si.is_valid()
        values = [dr.select(valid, c, 0.0) for c in channels(Hit(stage, ray, si, valid))]
        means = [dr.block_sum(stage.mi.Float(v), PIXEL_GRID**2) / PIXEL_GRID**2 for v in values]
        bands.append(np.stack([m.numpy().reshape(len(rows), stage.width) for m in means], axis=-1))
    return np.concatenate(bands).astype(np.float32)


def _why(scene: Scene) -> Integrator:
    return Integrator("ray casts", "geometry is a deterministic function of the primary rays: no light is transported")


def _quantity(
    name: str, unit: str, summary: str, display: Any, count: int, channels: Callable[[Hit], list[Any]]
) -> Quantity:
    return Quantity(name, unit, summary, display, count, _why, exact=lambda stage: _render(stage, channels))


QUANTITIES = {
    q.name: q
    for q in (
        _quantity("depth", "m", "distance along the viewing axis", "depth", 1, _depth),
        _quantity("normal", "1", "shading normal in world space", "normal", 3, _normal),
        _quantity("albedo", "1", "diffuse reflectance of the first surface", "unit", 3, _albedo),
        _quantity("coverage", "1", "fraction of the pixel that the subject covers", "unit", 1, _coverage),
    )
}
