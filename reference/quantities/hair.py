"""What the camera sees of hair: how much of a pixel, and how much light.

`hair_coverage` is the part of a pixel in which hair is nearer than all else. `hair_radiance` is the light that hair
sends to the sensor, 0 where there is none: light of the emitters that was scattered by hair and reflected by all other
things any number of times, by hair last. Hairs are round curves with the fibre's own scattering; the colour texture
scales what a hair sends to the sensor, not what it sends to other hairs.
"""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.quantities.hair_frames import refuses_without_hair
from reference.quantity import Integrator, Quantity
from reference.sampling import darkness, pixel_means
from reference.stage import Stage
from reference.worker import Means, means_elsewhere
from scenes.features import Features
from scenes.image import Float64
from scenes.model import Scene

MOST_RADII = 3000.0
"""The longest that hair may be: of rays aimed at such curves 1e-4 miss, of 5000 radii .3 to 1 %."""


def coverage_means(scene: Scene, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None) -> Float64:
    """Where hair is met first; see `reference.worker.Means`. Nothing is ever clamped: a sample is 0 or 1."""
    from reference.curves import stage_with_hair

    seen = pixel_means(_is_hair, stage_with_hair(scene), pixels, seed, spp, None)[:, :1]
    return seen if clamp is None else np.concatenate([seen, np.zeros_like(seen)], axis=1)


def _is_hair(stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    si = stage.scene.ray_intersect(ray)
    seen = stage.mi.Float(stage.is_subject(si.shape, si.is_valid()))
    return stage.mi.Color3f(0.0), stage.mi.Color3f(seen)


def radiance_means(scene: Scene, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None) -> Float64:
    """Light that hair sends to the sensor; see `reference.worker.Means`."""
    from reference.curves import stage_with_hair

    return pixel_means(_light_of_hair, stage_with_hair(scene), pixels, seed, spp, clamp)


def _light_of_hair(stage: Any, sampler: Any, ray: Any) -> tuple[Any, Any]:
    from reference.integrators.light_paths import trace_light_paths

    _, scattered = trace_light_paths(stage, sampler, ray, fewest=1)
    return stage.mi.Color3f(0.0), scattered * stage.color_seen(ray)


def hair_block(
    means: Means, stage: Stage, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None = None
) -> Float64:
    """One block, rendered by a worker, which builds the stage with hair; see `reference.quantity.BlockRender`."""
    return means_elsewhere(means, stage.description, pixels, seed, spp, clamp)


def _coverage(features: Features) -> Integrator:
    return Integrator(
        "ray casts at round curves",
        "hairs may be thinner than any grid of rays: places in the pixel are sampled, and no light is transported",
        block=partial(hair_block, coverage_means),
    )


def _radiance(features: Features) -> Integrator:
    """The first of these that suffices: a closed form, path tracing."""
    if features.is_dark:
        return Integrator("closed form: 0", "no emitter is present", exact=darkness)
    return Integrator(
        "path tracing among fibres",
        "light is scattered any number of times by hair, which is most of what light hair shows",
        block=partial(hair_block, radiance_means),
    )


def _refuses_media(features: Features) -> str:
    if features.has_media or features.has_eye:
        return "its paths end at surfaces, and this scene has a translucent body or an eye"
    return _refuses_thin(features)


def _refuses_thin(features: Features) -> str:
    return too_thin(features) or refuses_without_hair(features)


def too_thin(features: Features) -> str:
    """Why hair of a scene cannot be traced; nothing if it can, or if there is none."""
    if features.longest_hair <= MOST_RADII:
        return ""
    return (
        f"hair is up to {features.longest_hair:.0f} of its radii long, and Mitsuba's rays miss curves of more than "
        f"{MOST_RADII:.0f} where they bend"
    )


QUANTITIES = {
    q.name: q
    for q in (
        Quantity(
            "hair_coverage",
            "1",
            "fraction of the pixel that hair covers",
            "unit",
            channels=1,
            is_sampled=True,
            integrator=_coverage,
            refuses=_refuses_thin,
        ),
        Quantity(
            "hair_radiance",
            "W/(length² sr)",
            "radiance of the hair alone",
            "radiance",
            channels=3,
            is_sampled=True,
            integrator=_radiance,
            refuses=_refuses_media,
        ),
    )
}
