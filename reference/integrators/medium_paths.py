"""Path tracing inside homogeneous bodies that scatter evenly and do not refract, as a Dr.Jit loop.

Light is followed from the sensor. A path scatters inside bodies, passes from one to another, and is joined to an
emitter wherever it scatters; emitters that it runs into by itself count nothing, so light that was never scattered is
left out.

Free paths are drawn for one channel, chosen anew each time in proportion to the throughput beta_c, so that their
density is that of all channels together: with s_c = beta_c / sum(beta),
    scattering after t:  beta_c <- beta_c sigma_s,c exp(-sigma_t,c t) / sum over k of s_k sigma_t,k exp(-sigma_t,k t),
    passing a length l:  beta_c <- beta_c exp(-sigma_t,c l) / sum over k of s_k exp(-sigma_t,k l).
The sum of beta never grows. That is the balance heuristic over channels of Miller, Georgiev, Jarosz 2019, "A
null-scattering path integral formulation of light transport" (spectral MIS), with the choice by throughput of Chiang,
Kutz, Burley 2016, "Practical and controllable subsurface scattering for production path tracing".

No state says what a ray is inside of: the stretch before a back face of a body lies in that body, all else in the
open. Rounding can put a point on the wrong side of a surface, but then only a stretch of that size is wrong.
"""

from typing import Any

import drjit as dr
import numpy as np

from reference.stage import Stage

STEP = 2.0**-20
"""A ray is cast anew this far behind each hit, as part of the subject's largest coordinate: 8 spacings of float32."""

JUST_BEFORE = 1 - 1e-4
"""Part of the way to an emitter that is searched for what hides it: the emitter itself does not."""

RUSSIAN_ROULETTE_BELOW = 0.5
"""Throughput under which paths end by chance; the weights of survivors grow, so that nothing is lost."""


class Bodies:
    """The subject's closed shapes, each filled with its medium; constants of the loops below."""

    def __init__(self, stage: Stage) -> None:
        mi = stage.mi
        corners = [np.array([shape.bbox().min, shape.bbox().max]) for shape in stage.subject]
        self.step = STEP * float(np.abs(corners).max())
        self.media = []
        for shape in stage.subject:
            medium = shape.interior_medium()
            sigma_s, _, sigma_t = medium.get_scattering_coefficients(dr.zeros(mi.MediumInteraction3f))
            self.media.append((mi.ShapePtr(shape), sigma_s, sigma_t))

    def at(self, mi: Any, shape: Any) -> tuple[Any, Any, Any]:
        """Whether shapes that were hit are bodies, and their sigma_s and sigma_t per unit of length, as colours."""
        is_body, sigma_s, sigma_t = mi.Bool(False), mi.Color3f(0.0), mi.Color3f(0.0)
        for own, scattering, extinction in self.media:
            is_own = shape == own
            is_body |= is_own
            sigma_s = dr.select(is_own, scattering, sigma_s)
            sigma_t = dr.select(is_own, extinction, sigma_t)
        return is_body, sigma_s, sigma_t


def trace_medium_paths(stage: Stage, sampler: Any, ray: Any) -> Any:
    """Radiance along one path for each camera ray: light that was scattered at least once inside the subject.

    The subject consists of translucent bodies that neither overlap nor hold the surface of an emitter; all else in the
    scene reflects nothing.
    """
    mi = stage.mi
    return _loop(mi, stage.scene, Bodies(stage), sampler, mi.Ray3f(ray), mi.Bool(True))


@dr.syntax  # type: ignore[untyped-decorator]
def _loop(mi: Any, scene: Any, bodies: Any, sampler: Any, ray: Any, active: Any) -> Any:
    radiance = mi.Color3f(0.0)
    beta = mi.Color3f(1.0)

    while active:
        si = _hit(mi, scene, ray, active)
        is_body, sigma_s, sigma_t = bodies.at(mi, si.shape)
        active &= si.is_valid() & is_body
        in_medium = active & (dr.dot(ray.d, si.n) > 0)

        # Sample a free path for one channel and weight it by what all channels would have done.
        share = beta / dr.sum(beta)
        free_path = -dr.log(1.0 - sampler.next_1d()) / chosen_channel(share, sigma_t, sampler.next_1d())
        scatters = in_medium & (free_path < si.t)
        distance = dr.select(scatters, free_path, si.t)
        transmittance = dr.select(in_medium, dr.exp(-sigma_t * distance), 1.0)
        scattered = sigma_s / dr.sum(share * sigma_t * transmittance)
        passed = 1.0 / dr.sum(share * transmittance)
        beta *= transmittance * dr.select(scatters, scattered, passed)
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


def chosen_channel(share: Any, value: Any, sample: Any) -> Any:
    """The channel of `value` that a number in [0, 1) falls on when the channels have these shares."""
    return dr.select(sample < share.x, value.x, dr.select(sample < share.x + share.y, value.y, value.z))
