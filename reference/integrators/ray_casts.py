"""Deterministic means over pixels of what primary rays hit."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.stage import Stage, pixel_grid
from scenes.image import Float32
from scenes.model import PIXEL_GRID

RAYS_A_LAUNCH = 1 << 22


@dataclass(frozen=True)
class Hit:
    stage: Stage
    ray: Any
    si: Any
    valid: Any


def reflectance(hit: Hit) -> list[Any]:
    """Reflectance of the first surface if it is Lambertian; 0 for any other."""
    import drjit as dr

    bsdf, flags = hit.si.bsdf(), hit.stage.mi.BSDFFlags
    is_lambertian = bsdf.flags() == (flags.DiffuseReflection | flags.FrontSide)
    rgb = dr.select(is_lambertian, bsdf.eval_diffuse_reflectance(hit.si, hit.valid), 0.0)
    return [rgb.x, rgb.y, rgb.z]


def mean_over_pixels(stage: Stage, channels: Callable[[Hit], list[Any]]) -> Float32:
    """(H, W, C), the mean of each channel over a regular grid in each pixel; what hits nothing counts as 0."""
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
