"""Translucent bodies: how far a pixel's rays run inside them, and the light that comes out towards the sensor.

`thickness` is exact: all layers of the subject, as if nothing else were there, hair neither.

`transmitted_radiance` is light that was scattered at least once inside the subject, on whichever side it entered. Light
that passes straight through is not part of it: under lights without extent it never reaches a camera, and an emitter
seen through a body is a picture of its own.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.integrators.ray_casts import Hit, mean_over_pixels
from reference.quantity import Integrator, Quantity
from reference.sampling import darkness, pixel_means
from reference.slab import slab_radiance
from reference.stage import Stage
from scenes.errors import SceneError
from scenes.features import Features
from scenes.image import Float32, Float64
from scenes.materials import Translucent
from scenes.media import coefficients
from scenes.model import DirectionalLight
from scenes.procedural import rotation_xyz
from scenes.shapes import Slab

FACES = 0.999
"""Cosine between a normal and the slab's axis above which a face is one of the two large ones: the others have 0."""

GRAZING = 1e-6
"""Cosine of light's incidence below which nothing enters the slab."""


def _thickness(stage: Stage) -> Float32:
    from reference.integrators.chords import length_inside

    return mean_over_pixels(stage, lambda hit: [length_inside(hit.stage, hit.ray)])


def _thickness_integrator(features: Features) -> Integrator:
    why = "the length of a ray inside closed surfaces is a deterministic function of the ray: no light is transported"
    return Integrator("ray casts through all layers", why, exact=_thickness)


def _through_a_slab(stage: Stage) -> Float32:
    """Light of directional emitters after it was scattered in a slab without an edge.

    Raises
    ------
    SceneError
        The camera sees where the slab ends, or is in it.
    """
    scene, mi = stage.description, stage.mi
    slab = next(shape for shape in scene.shapes if isinstance(shape, Slab) and shape.name in scene.subject)
    material = scene.materials[slab.material]
    assert isinstance(material, Translucent)
    sigma_a, sigma_s = coefficients(material, scene.length_unit)
    sigma_t = sigma_a + sigma_s
    albedo = np.divide(sigma_s, sigma_t, out=np.zeros(3), where=sigma_t > 0)
    tau = sigma_t * slab.thickness * slab.scale
    normal = rotation_xyz(slab.rotation_deg)[:, 2]
    lights = [light for light in scene.emitters if isinstance(light, DirectionalLight)]

    def radiance(hit: Hit) -> list[Any]:
        cosine = np.array(hit.ray.d).T @ normal
        if not (-np.sign(cosine) * (np.array(hit.si.n).T @ normal) > FACES).all():
            raise SceneError(
                f"Scene '{scene.name}': found a slab '{slab.name}' of which the camera sees an end or the inside; "
                "allowed is one that fills the image, as its truth is that of one without an edge. Make it wider, move "
                "the camera, or use a box."
            )
        total = np.zeros((len(cosine), 3))
        for light in lights:
            arriving = float(np.array(light.direction) @ normal / np.linalg.norm(light.direction))
            if abs(arriving) < GRAZING:
                continue
            is_same_side = np.sign(cosine) == np.sign(arriving)
            for channel in range(3):
                R, T = slab_radiance(albedo[channel], tau[channel], np.abs(cosine), abs(arriving))
                total[:, channel] += np.where(is_same_side, R, T) * abs(arriving) * light.irradiance[channel]
        return [mi.Float(column) for column in total.T]

    return mean_over_pixels(stage, radiance)


def medium_paths_block(
    stage: Stage, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None = None
) -> Float64:
    """Mean over `spp` independent samples at each pixel; see `reference.quantity.BlockRender`."""
    return pixel_means(_trace, stage, pixels, seed, spp, clamp)


def _trace(stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    from reference.integrators.medium_paths import trace_medium_paths

    return stage.mi.Color3f(0.0), trace_medium_paths(stage, sampler, ray)


def _transmitted_integrator(features: Features) -> Integrator:
    """The first of these that suffices: nothing, plane-parallel theory, paths."""
    if features.is_dark:
        return Integrator("closed form: 0", "no emitter is present", exact=darkness)
    if features.subject_is_slab and features.is_lit_by_directional_lights_alone:
        return Integrator(
            "adding and doubling",
            "a slab on its own under directional light: the same at every point, a matter of two angles",
            exact=_through_a_slab,
        )
    return Integrator(
        "path tracing in media",
        "light is scattered any number of times inside bodies of any shape; only pixels that the subject covers are "
        "sampled",
        block=medium_paths_block,
    )


def _refuses_thickness(features: Features) -> str:
    return "an eye's surfaces are open where they meet, and light bends at them" if features.has_eye else ""


def _refuses(features: Features) -> str:
    if not features.subject_is_translucent:
        return "light is scattered inside translucent bodies only, and not all of the subject is translucent"
    if not features.is_body_alone:
        return "something besides the subject and its emitters reflects or scatters light, which is not followed"
    return ""


QUANTITIES = {
    q.name: q
    for q in (
        Quantity(
            "thickness",
            "length",
            "length of the ray inside the subject, over all its layers",
            "depth",
            channels=1,
            is_sampled=False,
            integrator=_thickness_integrator,
            refuses=_refuses_thickness,
        ),
        Quantity(
            "transmitted_radiance",
            "W/(length² sr)",
            "radiance that leaves the subject after it was scattered inside",
            "radiance",
            channels=3,
            is_sampled=True,
            integrator=_transmitted_integrator,
            judged_where="coverage",
            refuses=_refuses,
        ),
    )
}
