"""How much of the light a surface sees: the shadows, apart from how bright the light and the surface are.

`visibility` is the fraction of the light's solid angle that a surface point sees. What other surfaces hide is not seen,
nor what lies below the surface's own horizon, the plane of its triangle. A point light is seen or not; its truth is
exact. All surfaces receive shadows and cast them, from both sides, but the light's own: a ball shines from its whole
sphere. `receiver_coverage` leaves hair out, as all of parity does.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.integrators.ray_casts import Hit, mean_over_pixels
from reference.quantity import Integrator, Quantity
from reference.sampling import film_and_lens
from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float32, Float64
from scenes.model import PointLight, SphereLight


def _light(stage: Stage) -> PointLight | SphereLight:
    return next(e for e in stage.description.emitters if isinstance(e, PointLight | SphereLight))


def _of_point(stage: Stage) -> Float32:
    from reference.integrators.visibility import sees_point

    light = _light(stage)
    assert isinstance(light, PointLight)
    return mean_over_pixels(stage, lambda hit: [sees_point(stage, light, hit.si)])


def ball_block(stage: Stage, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None = None) -> Float64:
    """Mean over `spp` samples at each pixel, stratified over film and cone; see `reference.quantity.BlockRender`.

    Nothing is ever clamped: a sample is 0 or 1.
    """
    import drjit as dr

    from reference.integrators.visibility import sees_ball

    light = _light(stage)
    assert isinstance(light, SphereLight)
    mi = stage.mi
    u, v, *cone = film_and_lens(mi, len(pixels), spp, seed)
    x = np.repeat((pixels % stage.width).astype(np.float32), spp)
    y = np.repeat((pixels // stage.width).astype(np.float32), spp)
    si = stage.scene.ray_intersect(stage.rays(mi.Float(x) + u, mi.Float(y) + v))
    seen = dr.block_sum(sees_ball(stage, light, si, mi.Point2f(*cone)), spp).numpy().astype(np.float64)[:, None] / spp
    return seen if clamp is None else np.concatenate([seen, np.zeros_like(seen)], axis=1)


def _integrator(features: Features) -> Integrator:
    """The first of these that suffices: one shadow ray a position, a light's cone sampled."""
    if features.has_sphere_light:
        return Integrator(
            "shadow rays into the ball's cone",
            "the ball is seen in part: directions are sampled, and none that could not meet it",
            block=ball_block,
        )
    return Integrator(
        "ray casts and shadow rays", "a point is seen or not: a deterministic function of the ray", exact=_of_point
    )


def _refuses(features: Features) -> str:
    if not features.has_one_omni_light:
        return "it is the fraction seen of one point or sphere light, and the scene does not have exactly one"
    if features.has_media or features.has_eye:
        return "light passes through a translucent body or an eye, so that a surface's shadow is no matter of yes or no"
    if features.has_hair:
        return "hair throws shadows, which are left out here"
    return ""


def _receives(hit: Hit) -> list[Any]:
    mi = hit.stage.mi
    return [mi.Float(hit.valid & ~hit.si.shape.is_emitter())]


def _receiver_coverage(features: Features) -> Integrator:
    why = "geometry is a deterministic function of the primary rays: no light is transported"
    return Integrator("ray casts", why, exact=lambda stage: mean_over_pixels(stage, _receives))


RECEIVERS = "receiver_coverage"
QUANTITIES = {
    q.name: q
    for q in (
        Quantity(
            RECEIVERS,
            "1",
            "fraction of the pixel that sees a surface which emits nothing",
            "unit",
            channels=1,
            is_sampled=False,
            integrator=_receiver_coverage,
        ),
        Quantity(
            "visibility",
            "1",
            "fraction of the light that the surface sees",
            "unit",
            channels=1,
            is_sampled=True,
            integrator=_integrator,
            judged_where=RECEIVERS,
            refuses=_refuses,
        ),
    )
}
