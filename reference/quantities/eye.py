"""What is seen of an eye: which point of the iris through the cornea, and how much light.

`iris_coverage` and `iris_uv` are exact: rays in float64 through the surfaces themselves, never through their meshes.

`eye_radiance` is everything, mirror images of the emitters included. `iris_radiance` is what the iris reflects and the
cornea lets through to the camera. Two variants of it ignore the focus of light by the cornea, which "ignoring caustics"
leaves open: `iris_radiance_flat`, where light is bent but its beam is not focused, and `iris_radiance_straight`, where
it is not even bent (`reference.integrators.eye_focus.Focus` has the formulas). In both that holds for light of a lamp
on its way to the iris; the camera's rays and the light that the cornea and the iris throw back on the iris are as they
are.
"""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from reference.eye_rays import iris_coverage, iris_uv
from reference.quantity import Display, Integrator, Quantity
from reference.sampling import darkness, pixel_means
from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float32, Float64
from scenes.model import Scene

if TYPE_CHECKING:
    from reference.integrators.eye_focus import Focus


def eye_block(
    focus: "Focus | None", stage: Stage, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None = None
) -> Float64:
    """Mean radiance of `spp` independent samples at each pixel; see `reference.quantity.BlockRender`.

    focus : of what the iris reflects; None for the whole eye
    """
    return pixel_means(partial(_trace, focus), stage, pixels, seed, spp, clamp)


def _trace(focus: "Focus | None", stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    from reference.integrators.eye_light import eye_radiance, iris_radiance

    radiance = eye_radiance(stage, sampler, ray) if focus is None else iris_radiance(focus, stage, sampler, ray)
    return stage.mi.Color3f(0.0), radiance


def _radiance_integrator(focus: "Focus | None", features: Features) -> Integrator:
    """The first of these that suffices: a closed form, paths inside the eye."""
    if features.is_dark:
        return Integrator("closed form: 0", "no emitter is present", exact=darkness)
    return Integrator(
        "light paths through the cornea",
        "the point where light of a lamp enters the cornea is solved for, which no path tracer finds by chance; light "
        "that the cornea throws back on the iris is traced",
        block=partial(eye_block, focus),
    )


_RAYS = "geometry is a deterministic function of the primary rays: no light is transported"


def _rays_integrator(image: Callable[[Scene], Float32], features: Features) -> Integrator:
    return Integrator("exact rays through the cornea", _RAYS, exact=lambda stage: image(stage.description))


def _refuses(features: Features) -> str:
    if not features.has_eye:
        return "the scene has no eye"
    if not features.has_one_eye:
        return "the scene has several eyes, which could hide, shadow or light each other"
    if not features.is_body_alone:
        return "other things beside the eye could hide it, shadow it or light it; only lights may be there"
    return ""


def _refuses_sky(features: Features) -> str:
    if features.has_sky:
        return "to ignore the focus of light has a meaning for lamps, not for light that comes from everywhere"
    return _refuses(features)


def _rays(name: str, summary: str, display: Display, image: Callable[[Scene], Float32], where: str) -> Quantity:
    channels = 2 if display == "uv" else 1
    integrator = partial(_rays_integrator, image)
    return Quantity(name, "1", summary, display, channels, False, integrator, judged_where=where, refuses=_refuses)


def _radiance(
    name: str,
    summary: str,
    focus: "Focus | None",
    where: str,
    refuses: Callable[[Features], str] = _refuses,
    variants: tuple[str, ...] = (),
) -> Quantity:
    integrator = partial(_radiance_integrator, focus)
    return Quantity(
        name,
        "W/(length² sr)",
        summary,
        "radiance",
        channels=3,
        is_sampled=True,
        integrator=integrator,
        judged_where=where,
        refuses=refuses,
        variants=variants,
    )


ON_IRIS = "iris_coverage"
QUANTITIES = {
    q.name: q
    for q in (
        _rays(ON_IRIS, "fraction of the pixel that sees the iris or the pupil", "unit", iris_coverage, ""),
        _rays("iris_uv", "iris coordinate that is seen at the pixel's centre", "uv", iris_uv, ON_IRIS),
        _radiance("eye_radiance", "radiance of the eye, mirror images included", None, "coverage"),
        _radiance(
            "iris_radiance",
            "radiance that the iris reflects, seen through the cornea",
            "caustic",
            ON_IRIS,
            variants=("iris_radiance_flat", "iris_radiance_straight"),
        ),
        _radiance("iris_radiance_flat", "the same, as if no light were focused", "flat", ON_IRIS, refuses=_refuses_sky),
        _radiance(
            "iris_radiance_straight", "the same, as if no light were bent", "straight", ON_IRIS, refuses=_refuses_sky
        ),
    )
}
