"""Radiance that reaches the sensor from the subject, by how often the light was reflected on its way.

`direct_radiance` was reflected once, by the subject; `indirect_radiance` at least once elsewhere before; `radiance` is
both and what the subject emits. Light of a constant or image environment that falls on the subject is direct. All are
defined at pixels that the subject covers completely, seen through a pinhole: edges are the business of parity, blur
that of defocus.

Equation (Kajiya 1986, "The Rendering Equation", unrolled): with x1 the point seen, throughput beta_k after k - 1
reflections and the direct radiance L_dir of emitters at a vertex,
    L = L_e(x1) + L_dir(x1) + sum over k >= 2 of beta_k L_dir(x_k).
L_dir is estimated by emitter and BSDF sampling, combined by the balance of their densities (Veach & Guibas 1995,
"Optimally Combining Sampling Techniques for Monte Carlo Rendering", power heuristic).
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.integrators.ray_casts import mean_over_pixels, reflectance
from reference.quantity import BlockRender, Integrator, Quantity
from reference.sampling import darkness, pixel_means
from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float32, Float64


def light_paths_block(
    fewest: int,
    most: int | None,
    stage: Stage,
    pixels: NDArray[np.int64],
    seed: int,
    spp: int,
    clamp: float | None = None,
) -> Float64:
    """Mean radiance of `spp` samples at each pixel, of light that was reflected `fewest` to `most` times.

    Parameters
    ----------
    fewest, most : number of reflections; None for any number
    pixels : (P,) flat indices, row by row from the top
    seed : 32-bit seed
    spp : samples a pixel
    clamp : largest radiance of a channel of a sample; see `reference.quantity.BlockRender`

    Returns
    -------
    (P, 3) radiance [W/(m² sr)], or (P, 6) with a clamp
    """
    return pixel_means(partial(_trace, fewest, most), stage, pixels, seed, spp, clamp)


def _trace(fewest: int, most: int | None, stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    from reference.integrators.light_paths import UNBOUNDED, trace_light_paths

    seen, reflected = trace_light_paths(stage, sampler, ray, fewest, UNBOUNDED if most is None else most)
    return seen, reflected


indirect_block: BlockRender = partial(light_paths_block, 2, None)


def _under_a_constant_sky(stage: Stage) -> Float32:
    """Radiance of a convex Lambertian surface that sees nothing but a sky of radiance L: its reflectance times L."""
    sky = stage.scene.environment().eval(stage.mi.SurfaceInteraction3f())
    return mean_over_pixels(stage, lambda hit: [rho * level for rho, level in zip(reflectance(hit), sky, strict=True)])


def _integrator(fewest: int, most: int | None, features: Features) -> Integrator:
    """The first of these that suffices: a closed form, direct light only, paths of any length."""
    if features.is_dark:
        return Integrator("closed form: 0", "no emitter is present", exact=darkness)
    if features.subject_is_convex and features.subject_is_alone:
        if fewest > 1:
            return Integrator(
                "closed form: 0", "a convex subject on its own: what it reflects never comes back", exact=darkness
            )
        if features.is_lit_by_constant_sky_alone:
            return Integrator(
                "closed form: reflectance times sky",
                "a convex subject on its own sees a constant sky in every direction",
                exact=_under_a_constant_sky,
            )
        most = 1
    if most == 1:
        return Integrator(
            "direct light only",
            "no light is reflected twice on its way" if fewest == 0 else "only light that was reflected once counts",
            block=partial(light_paths_block, fewest, 1),
        )
    if fewest > 1:
        why = "only light that was reflected elsewhere before counts: direct light is never traced"
        return Integrator("indirect-only path tracing", f"{why}; {_DIFFUSE}", block=indirect_block)
    return Integrator("path tracing", f"light is reflected any number of times; {_DIFFUSE}", block=_path_block)


def refuses_all_but_diffuse(features: Features) -> str:
    """Why paths that meet diffuse surfaces only do not suffice, or nothing."""
    if features.has_other_than_diffuse:
        return (
            "its paths meet diffuse surfaces only, and this scene has a translucent body, an eye, a layered material "
            "or hair"
        )
    return ""


_DIFFUSE = "every material is diffuse and no medium is present; only pixels that the subject covers are sampled"
_path_block: BlockRender = partial(light_paths_block, 0, None)


def _quantity(name: str, summary: str, fewest: int, most: int | None) -> Quantity:
    integrator: Callable[[Features], Integrator] = partial(_integrator, fewest, most)
    return Quantity(
        name,
        "W/(length² sr)",
        summary,
        "radiance",
        channels=3,
        is_sampled=True,
        integrator=integrator,
        judged_where="coverage",
        refuses=refuses_all_but_diffuse,
    )


QUANTITIES = {
    q.name: q
    for q in (
        _quantity("radiance", "radiance of the subject, from all light", 0, None),
        _quantity("direct_radiance", "radiance of the subject from light that comes straight from an emitter", 1, 1),
        _quantity("indirect_radiance", "radiance of the subject from light that has bounced elsewhere before", 2, None),
    )
}
