"""Path tracing of indirect light alone, as a Dr.Jit loop."""

from typing import Any

import drjit as dr

from reference.stage import Stage

RUSSIAN_ROULETTE_FROM = 5
"""Bounces that are always traced. Paths end by chance after that; their survivors are weighted up, so nothing is
lost.
"""

SURVIVAL_AT_MOST = 0.95
"""Bounds the length of a path in a white furnace, where throughput never falls."""


def trace_indirect(stage: Stage, sampler: Any, ray: Any) -> Any:
    """One path for each camera ray: the radiance of everything beyond the direct light of the subject."""
    mi = stage.mi
    return _loop(mi, stage.scene, stage.is_subject, sampler, mi.Ray3f(ray), mi.Bool(True))


@dr.syntax  # type: ignore[untyped-decorator]
def _loop(mi: Any, scene: Any, is_subject: Any, sampler: Any, ray: Any, active: Any) -> Any:
    context = mi.BSDFContext()
    radiance = mi.Color3f(0.0)
    beta = mi.Color3f(1.0)
    bounce = mi.UInt32(0)
    previous = dr.zeros(mi.Interaction3f)
    previous_pdf = mi.Float(1.0)

    while active:
        si = scene.ray_intersect(ray, active)

        # Only paths that start on the subject count.
        active &= (bounce > 0) | is_subject(si.shape, active)

        # Light that the BSDF sample ran into; at the first bounce it would be direct light of the subject.
        emitter = si.emitter(scene, active)
        direction = mi.DirectionSample3f(scene, si, previous)
        sees = active & (bounce > 1)
        emitter_pdf = scene.pdf_emitter_direction(previous, direction, sees & (emitter != None))  # noqa: E711
        emitted = emitter.eval(si, sees)
        radiance += dr.select(sees, beta * emitted * _power(previous_pdf, emitter_pdf), 0.0)

        active &= si.is_valid()
        bsdf = si.bsdf()

        # Light sampled from this vertex, unless it is the subject's point that the sensor sees.
        connects = active & (bounce > 0)
        light, arriving = scene.sample_emitter_direction(si, sampler.next_2d(), True, connects)
        connects &= light.pdf > 0
        wo = si.to_local(light.d)
        value, pdf = bsdf.eval_pdf(context, si, wo, connects)
        weight = dr.select(light.delta, 1.0, _power(light.pdf, pdf))
        radiance += dr.select(connects, beta * value * arriving * weight, 0.0)

        # Continue the path.
        sample, bsdf_weight = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), active)
        beta *= bsdf_weight
        ray = si.spawn_ray(si.to_world(sample.wo))
        previous = mi.Interaction3f(si)
        previous_pdf = mi.Float(sample.pdf)
        bounce += 1
        active &= dr.any(beta != 0.0)

        survival = dr.minimum(dr.max(beta), SURVIVAL_AT_MOST)
        plays = bounce >= RUSSIAN_ROULETTE_FROM
        active &= ~plays | (sampler.next_1d() < survival)
        beta[plays & active] = beta / survival

    return radiance


def _power(own: Any, other: Any) -> Any:
    """Veach & Guibas 1995, the power heuristic with exponent 2.

    Written with the ratio of the densities: a light seen edge-on has an infinite density, whose square over itself is
    NaN.
    """
    ratio = other / own
    return dr.select(dr.isfinite(ratio), 1.0 / (1.0 + ratio * ratio), 0.0)
