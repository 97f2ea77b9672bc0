"""The whole picture, from all light: `defocus_radiance` through the sensor's lens, `frame_radiance` through a pinhole.

Every pixel is judged, edges and background included. The lens is thin and evenly lit (Potmesil & Chakravarty 1982,
"Synthetic Image Generation with a Lens and Aperture Camera Model"): a point at planar depth z spreads evenly over a
disk of radius |K (1 / z_f - 1 / z)| px, without vignetting, and keeps its energy. A sensor that has no lens, or one of
radius 0, shows the same picture in both.
"""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.quantities.radiance import refuses_all_but_diffuse
from reference.quantity import Integrator, Quantity
from reference.sampling import Trace, darkness, pixel_means
from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float64


def picture_block(
    trace: Trace,
    through_lens: bool,
    stage: Stage,
    pixels: NDArray[np.int64],
    seed: int,
    spp: int,
    clamp: float | None = None,
) -> Float64:
    """Mean radiance of `spp` samples at each pixel; see `reference.quantity.BlockRender`."""
    return pixel_means(trace, stage, pixels, seed, spp, clamp, through_lens)


def _seen(through_lens: bool, stage: Stage, ray: Any) -> Any:
    from reference.integrators.emitted_light import emitted_light, emitted_light_through_lens

    return emitted_light_through_lens(stage, ray) if through_lens else emitted_light(stage, ray)


def _trace_emitted(through_lens: bool, stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    return _seen(through_lens, stage, ray), stage.mi.Color3f(0.0)


def _trace_everything(through_lens: bool, stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    from reference.integrators.light_paths import UNBOUNDED, anything, trace_light_paths

    _, reflected = trace_light_paths(stage, sampler, ray, 1, UNBOUNDED, anything)
    return _seen(through_lens, stage, ray), reflected


def _integrator(through_lens: bool, features: Features) -> Integrator:
    """The first of these that suffices: nothing, one ray a sample, paths of any length."""
    if features.is_dark:
        return Integrator("closed form: 0", "no emitter is present", exact=darkness)
    if features.nothing_reflects:
        return Integrator(
            "emitted light alone",
            "every surface is black: a sample ends at what its ray meets first",
            block=partial(picture_block, partial(_trace_emitted, through_lens), through_lens),
        )
    return Integrator(
        "path tracing",
        "light is reflected any number of times; every material is diffuse and no medium is present",
        block=partial(picture_block, partial(_trace_everything, through_lens), through_lens),
    )


def _quantity(name: str, summary: str, through_lens: bool) -> Quantity:
    return Quantity(
        name,
        "W/(length² sr)",
        summary,
        "radiance",
        channels=3,
        is_sampled=True,
        integrator=partial(_integrator, through_lens),
        refuses=refuses_all_but_diffuse,
    )


QUANTITIES = {
    q.name: q
    for q in (
        _quantity("defocus_radiance", "radiance that reaches the sensor through its lens, from everything", True),
        _quantity("frame_radiance", "radiance that reaches the sensor through a pinhole, from everything", False),
    )
}
