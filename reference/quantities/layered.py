"""Radiance of surfaces made of layers: metal flakes, a rough film, a clear coat.

Point and directional lights reach a convex subject on its own in one way only, and a material's reflection of them is a
closed form: such scenes have an exact truth. Wherever light has a size or may come back, paths are traced. All is
defined at pixels that the subject covers completely, seen through a pinhole.

Equation: L = sum over lights of f(wi, wo) |N.wo| E, with E the irradiance of a light on a plane that faces it. A light
below the plane of a triangle does not reach it, whatever normals its corners have for shading: of a convex mesh that is
all the shadow there is.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from reference.integrators.ray_casts import Hit, mean_over_pixels
from reference.quantities.radiance import light_paths_block
from reference.quantity import Integrator, Quantity
from reference.sampling import darkness
from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float32
from scenes.model import DirectionalLight, Emitter, PointLight

Arriving = Callable[[Any], tuple[Any, Any]]
"""Direction to a light and irradiance on a plane that faces it, at some interactions."""


def _reflected_lights(stage: Stage) -> Float32:
    arrivals = [_arriving(stage, emitter) for emitter in stage.description.emitters]
    return mean_over_pixels(stage, lambda hit: _reflected(hit, arrivals))


def _reflected(hit: Hit, arrivals: list[Arriving]) -> list[Any]:
    import drjit as dr

    mi, si = hit.stage.mi, hit.si
    bsdf, total = si.bsdf(), mi.Color3f(0.0)
    for arriving in arrivals:
        toward, irradiance = arriving(si)
        faces = hit.valid & (dr.dot(si.n, toward) > 0)
        value = bsdf.eval(mi.BSDFContext(), si, si.to_local(toward), faces)
        total += dr.select(faces, value * irradiance, 0.0)
    return [*total]


def _arriving(stage: Stage, emitter: Emitter) -> Arriving:
    """Numbers of the light are variables: literals would compile the kernel anew for each scene."""
    import drjit as dr

    mi = stage.mi
    if isinstance(emitter, DirectionalLight):
        toward = dr.normalize(-mi.Vector3f(*emitter.direction))
        irradiance = mi.Color3f(*emitter.irradiance)
        dr.make_opaque(toward, irradiance)
        return lambda si: (toward, irradiance)
    assert isinstance(emitter, PointLight)
    place, intensity = mi.Point3f(*emitter.position), mi.Color3f(*emitter.intensity)
    dr.make_opaque(place, intensity)
    return partial(_from_point, place, intensity)


def _from_point(place: Any, intensity: Any, si: Any) -> tuple[Any, Any]:
    import drjit as dr

    away = place - si.p
    return dr.normalize(away), intensity / dr.squared_norm(away)


def _integrator(features: Features) -> Integrator:
    """The first of these that suffices: a closed form, direct light only, paths of any length."""
    if features.is_dark:
        return Integrator("closed form: 0", "no emitter is present", exact=darkness)
    if not (features.subject_is_convex and features.subject_is_alone):
        why = "light is reflected any number of times; what it meets are surfaces, whose reflection is sampled"
        return Integrator("path tracing", why, block=partial(light_paths_block, 0, None))
    if features.has_surface_lights or features.has_sky:
        why = "a convex subject on its own: no light is reflected twice, and it comes from more than one direction"
        return Integrator("direct light only", why, block=partial(light_paths_block, 0, 1))
    why = "a convex subject on its own, lit from single directions: its material's reflection is evaluated, not sampled"
    return Integrator("closed form: reflected lights", why, exact=_reflected_lights)


def _refuses(features: Features) -> str:
    if features.has_media or features.has_eye or features.has_hair:
        return "its paths meet surfaces only, and this scene has a translucent body, an eye or hair"
    return ""


QUANTITIES = {
    "layered_radiance": Quantity(
        "layered_radiance",
        "W/(length² sr)",
        "radiance of a subject made of layers, from all light",
        "radiance",
        channels=3,
        is_sampled=True,
        integrator=_integrator,
        judged_where="coverage",
        refuses=_refuses,
    )
}
