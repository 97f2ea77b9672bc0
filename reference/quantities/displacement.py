"""What is seen of a relief, a height field over a rectangle: which place of it, and how much light.

`displaced_uv` is exact: rays in float64 through the bilinear field itself, never through its mesh. `displaced_radiance`
is direct light with the shadows that the relief casts on itself, by the same rays. What more reflections would add is
left out: none of the techniques for displacement has it.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.quantity import Integrator, Quantity
from reference.relief_rays import displaced_uv
from reference.sampling import darkness, pixel_means
from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float64


def displaced_block(
    stage: Stage, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None = None
) -> Float64:
    """Mean radiance of `spp` independent samples at each pixel; see `reference.quantity.BlockRender`."""
    return pixel_means(_trace, stage, pixels, seed, spp, clamp)


def _trace(stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    from reference.integrators.relief_light import direct_light

    return direct_light(stage, sampler, ray)


def _exact_rays(features: Features) -> Integrator:
    return Integrator(
        "exact rays through the height field",
        "geometry is a deterministic function of the primary rays: no light is transported",
        exact=lambda stage: displaced_uv(stage.description),
    )


def _direct_light(features: Features) -> Integrator:
    """The first of these that suffices: a closed form, direct light only."""
    if features.is_dark:
        return Integrator("closed form: 0", "no emitter is present", exact=darkness)
    return Integrator(
        "direct light through the height field",
        "only light that was reflected once counts, and rays through the field itself need no mesh",
        block=displaced_block,
    )


def _refuses(features: Features) -> str:
    if not features.subject_is_relief:
        return "the subject is not one relief, whose height field it is defined on"
    return "hair could hide the relief, and is left out here" if features.has_hair else ""


def _refuses_light(features: Features) -> str:
    if why := _refuses(features):
        return why
    if features.has_other_than_diffuse:
        return "it is defined on diffuse surfaces, and the scene has others"
    if not features.subject_is_alone:
        return (
            "other things beside the relief could throw a shadow on it; only lights without a surface may be there: "
            "points, directional lights, a sky"
        )
    return ""


QUANTITIES = {
    q.name: q
    for q in (
        Quantity(
            "displaced_uv",
            "texel",
            "place of the height field that is seen at the pixel's centre, in its samples",
            "uv",
            channels=2,
            is_sampled=False,
            integrator=_exact_rays,
            judged_where="coverage",
            refuses=_refuses,
        ),
        Quantity(
            "displaced_radiance",
            "W/(length² sr)",
            "radiance of the relief from light that comes straight from an emitter",
            "radiance",
            channels=3,
            is_sampled=True,
            integrator=_direct_light,
            judged_where="coverage",
            refuses=_refuses_light,
        ),
    )
}
