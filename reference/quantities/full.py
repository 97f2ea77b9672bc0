"""The picture that the sensor takes of everything: `full_radiance`.

Whatever a scene may hold counts: translucent bodies, corneas and irises, layered materials, hair, lamps and sky, light
that went from any of them to any other, seen through the sensor's lens. Every pixel is judged.

A scene with an eye may have no lamp without extent. Light gets past a cornea by the path itself alone, which never
meets such a lamp: an iris would be black under it, and a mirror image of it missing.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.quantities.hair import too_thin
from reference.quantity import Integrator, Quantity
from reference.sampling import darkness, pixel_means
from reference.stage import Stage
from reference.worker import means_elsewhere
from scenes.features import Features
from scenes.image import Float64
from scenes.model import Scene


def full_means(scene: Scene, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None) -> Float64:
    """Mean radiance of `spp` samples at each pixel, for a worker; see `reference.worker.Means`."""
    from reference.integrators.full_stage import full_stage

    return _means(full_stage(scene), pixels, seed, spp, clamp)


def full_block(stage: Stage, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None = None) -> Float64:
    """Mean radiance of `spp` samples at each pixel; see `reference.quantity.BlockRender`.

    Among hair Mitsuba may crash: such a scene is rendered by a worker.
    """
    if stage.description.hair:
        return means_elsewhere(full_means, stage.description, pixels, seed, spp, clamp)
    from reference.integrators.full_stage import full_stage

    return _means(full_stage(stage.description), pixels, seed, spp, clamp)


def _means(stage: Stage, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None) -> Float64:
    return pixel_means(_trace, stage, pixels, seed, spp, clamp, through_lens=True)


def _trace(stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    from reference.integrators.emitted_light import emitted_light_through_lens
    from reference.integrators.full_paths import trace_full_paths

    return emitted_light_through_lens(stage, ray), trace_full_paths(stage, sampler, ray)


def _integrator(features: Features) -> Integrator:
    if features.is_dark:
        return Integrator("closed form: 0", "no emitter is present", exact=darkness)
    return Integrator(
        "path tracing of everything",
        "light is reflected, bent and scattered any number of times, on surfaces, in bodies, corneas and hair",
        block=full_block,
    )


def _refuses(features: Features) -> str:
    if features.has_eye and (features.has_point_lights or features.has_directional_lights):
        return "light of a lamp without extent cannot be followed through a cornea; give it a radius"
    if features.has_painted_hair:
        return (
            "a colour texture of hair scales what a hair sends to the sensor, but not what it sends elsewhere, and all "
            "light counts; leave out `color`, or judge hair_radiance"
        )
    return too_thin(features)


QUANTITIES = {
    "full_radiance": Quantity(
        "full_radiance",
        "W/(length² sr)",
        "radiance that reaches the sensor through its lens, from everything by every way",
        "radiance",
        channels=3,
        is_sampled=True,
        integrator=_integrator,
        refuses=_refuses,
    )
}
