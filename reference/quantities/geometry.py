"""What a pixel sees, by ray casts: depth, normal, albedo, and how much of the pixel the subject covers.

Each value is the mean over a regular grid of 8 x 8 positions in the pixel. Both sides use that grid, so their
images agree to rounding wherever camera, geometry and materials agree: this is the parity that must hold before any
radiance is compared. Positions that see nothing count as 0. Hair is left out, whatever stands behind it is seen:
`hair_coverage` tells where it is.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from reference.integrators.ray_casts import Hit, mean_over_pixels, reflectance
from reference.quantity import Integrator, Quantity
from scenes.features import Features


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


def _coverage(hit: Hit) -> list[Any]:
    mi = hit.stage.mi
    inside = hit.stage.is_subject(hit.si.shape, hit.valid)
    return [mi.Float(inside)]


def _quantity(
    name: str, unit: str, summary: str, display: Any, count: int, channels: Callable[[Hit], list[Any]]
) -> Quantity:
    why = "geometry is a deterministic function of the primary rays: no light is transported"
    casts = Integrator("ray casts", why, exact=partial(mean_over_pixels, channels=channels))

    def integrator(features: Features) -> Integrator:
        return casts

    return Quantity(name, unit, summary, display, count, is_sampled=False, integrator=integrator)


QUANTITIES = {
    q.name: q
    for q in (
        _quantity("depth", "length", "distance along the viewing axis", "depth", 1, _depth),
        _quantity("normal", "1", "shading normal in world space", "normal", 3, _normal),
        _quantity("albedo", "1", "diffuse reflectance of the first surface", "unit", 3, reflectance),
        _quantity("coverage", "1", "fraction of the pixel that the subject covers", "unit", 1, _coverage),
    )
}
