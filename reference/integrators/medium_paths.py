"""Path tracing inside homogeneous bodies that scatter evenly and do not refract, as a Dr.Jit loop.

Light is followed from the sensor. A path scatters inside bodies, passes from one to another, and is joined to an
emitter wherever it scatters; emitters that it runs into by itself count nothing, so light that was never scattered is
left out.

No state says what a ray is inside of: the stretch before a back face of a body lies in that body, all else in the
open. Rounding can put a point on the wrong side of a surface, but then only a stretch of that size is wrong.
"""

from typing import Any

import drjit as dr

from reference.integrators.media import JUST_BEFORE, RUSSIAN_ROULETTE_BELOW, Bodies, free_path
from reference.stage import Stage


def trace_medium_paths(stage: Stage, sampler: Any, ray: Any) -> Any:
    """Radiance along one path for each camera ray: light that was scattered at least once inside the subject.

    The subject consists of translucent bodies that neither overlap nor hold the surface of an emitter; all else in the
    scene reflects nothing.
    """
    mi = stage.mi
    return _loop(mi, stage.scene, Bodies(mi, stage.subject), sampler, mi.Ray3f(ray), mi.Bool(True))


@dr.syntax  # type: ignore[untyped-decorator]
def _loop(mi: Any, scene: Any, bodies: Any, sampler: Any, ray: Any, active: Any) -> Any:
    radiance = mi.Color3f(0.0)
    beta = mi.Color3f(1.0)

    while active:
        si = _hit(mi, scene, ray, active)
        is_body, sigma_s, sigma_t = bodies.at(mi, si.shape)
        active &= si.is_valid() & is_body
        in_medium = active & (dr.dot(ray.d, si.n) > 0)

        scatters, distance, weight = free_path(sampler, beta, sigma_s, sigma_t, in_medium, si.t)
        beta *= weight
        position = ray(dr.select(scatters, distance, distance + bodies.step))

        # Light that arrives at this vertex straight from an emitter.
        here = dr.zeros(mi.SurfaceInteraction3f)
        here.p = position
        light, arriving = scene.sample_emitter_direction(here, sampler.next_2d(), False, scatters)
        connects = scatters & (light.pdf > 0) & dr.any(arriving != 0.0)
        towards = mi.Ray3f(position, light.d)
        reaching = arriving * _transmittance(mi, scene, bodies, towards, light.dist * JUST_BEFORE, mi.Bool(connects))
        radiance += dr.select(connects, beta * reaching * dr.inv_four_pi, 0.0)

        # Continue the path, from a vertex in any direction.
        anywhere = mi.warp.square_to_uniform_sphere(sampler.next_2d())
        ray = mi.Ray3f(position, dr.select(scatters, anywhere, ray.d))

        survival = dr.max(beta)
        plays = survival < RUSSIAN_ROULETTE_BELOW
        active &= ~plays | (sampler.next_1d() < survival)
        beta[plays & active] = beta / survival

    return radiance


@dr.syntax  # type: ignore[untyped-decorator]
def _transmittance(mi: Any, scene: Any, bodies: Any, ray: Any, left: Any, active: Any) -> Any:
    """Part of the light that passes all bodies along a ray of length `left`; 0 where something else is in the way.

    What the ray would meet beyond its end says whether that lies in a body.
    """
    passed = mi.Color3f(1.0)

    while active:
        si = _hit(mi, scene, ray, active)
        active &= si.is_valid()
        is_body, _, sigma_t = bodies.at(mi, si.shape)
        in_medium = active & is_body & (dr.dot(ray.d, si.n) > 0)
        passed *= dr.select(in_medium, dr.exp(-sigma_t * dr.minimum(si.t, left)), 1.0)
        active &= si.t < left
        passed = dr.select(active & ~is_body, 0.0, passed)
        active &= is_body
        left -= si.t + bodies.step
        ray = mi.Ray3f(ray(si.t + bodies.step), ray.d)

    return passed


def _hit(mi: Any, scene: Any, ray: Any, active: Any) -> Any:
    """What a ray meets: distance, place, normal of the face and shape."""
    return scene.ray_intersect(ray, ray_flags=+mi.RayFlags.Minimal, coherent=False, active=active)
