"""Path tracing of the light paths with a chosen number of reflections, as a Dr.Jit loop."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from reference.stage import Stage

RUSSIAN_ROULETTE_FROM = 5
"""Reflections that are always traced. Paths end by chance after that; their survivors are weighted up, so nothing is
lost.
"""

SURVIVAL_AT_MOST = 0.95
"""Bounds the length of a path in a white furnace, where throughput never falls."""

UNBOUNDED = 0xFFFFFFFF


Begins = Callable[[Any, Any], Any]
"""Which of the shapes that camera rays meet, None for the sky, are seen: (shapes, active) -> mask."""


def anything(shape: Any, active: Any) -> Any:
    """All of them, and the sky."""
    return active


def trace_light_paths(
    stage: Stage, sampler: Any, ray: Any, fewest: int, most: int = UNBOUNDED, begins: Begins | None = None
) -> tuple[Any, Any]:
    """One path for each camera ray that meets what is seen: light that was reflected `fewest` to `most` times.

    Light of an emitter that the sensor sees was reflected 0 times, direct light once. What is seen is the subject, or
    what `begins` says.

    Returns
    -------
    Radiance of the emitters that the sensor sees, and of all other paths.
    """
    mi = stage.mi
    bounds = mi.UInt32(fewest), mi.UInt32(most)
    begins = begins or stage.is_subject
    seen, reflected = _loop(mi, stage.scene, begins, sampler, mi.Ray3f(ray), mi.Bool(True), *bounds)
    return seen, reflected


@dr.syntax  # type: ignore[untyped-decorator]
def _loop(mi: Any, scene: Any, begins: Any, sampler: Any, ray: Any, active: Any, fewest: Any, most: Any) -> Any:
    """Radiance of the emitters that the sensor sees, and of all other paths."""
    context = mi.BSDFContext()
    seen = mi.Color3f(0.0)
    reflected = mi.Color3f(0.0)
    beta = mi.Color3f(1.0)
    reflections = mi.UInt32(0)
    previous = dr.zeros(mi.Interaction3f)
    previous_pdf = mi.Float(1.0)

    while active:
        si = scene.ray_intersect(ray, active)

        # Only paths that start on what is seen count.
        active &= (reflections > 0) | begins(si.shape, active)

        # Light that the ray ran into: seen by the sensor itself, or found by sampling a BSDF.
        emitter = si.emitter(scene, active)
        direction = mi.DirectionSample3f(scene, si, previous)
        counts = active & (reflections >= fewest)
        emitter_pdf = scene.pdf_emitter_direction(
            previous,
            direction,
            counts & (reflections > 0) & (emitter != None),  # noqa: E711
        )
        emitted = emitter.eval(si, counts)
        seen += dr.select(counts & (reflections == 0), emitted, 0.0)
        weight = power_heuristic(previous_pdf, emitter_pdf)
        reflected += dr.select(counts & (reflections > 0), beta * emitted * weight, 0.0)

        active &= si.is_valid() & (reflections < most)
        bsdf = si.bsdf()

        # Light sampled from this vertex, which adds one reflection.
        connects = active & (reflections + 1 >= fewest)
        light, arriving = scene.sample_emitter_direction(si, sampler.next_2d(), True, connects)
        connects &= light.pdf > 0
        wo = si.to_local(light.d)
        value, pdf = bsdf.eval_pdf(context, si, wo, connects)
        weight = dr.select(light.delta, 1.0, power_heuristic(light.pdf, pdf))
        reflected += dr.select(connects, beta * value * arriving * weight, 0.0)

        # Continue the path.
        sample, bsdf_weight = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), active)
        beta *= bsdf_weight
        ray = si.spawn_ray(si.to_world(sample.wo))
        previous = mi.Interaction3f(si)
        previous_pdf = mi.Float(sample.pdf)
        reflections += 1
        active &= dr.any(beta != 0.0)

        survival = dr.minimum(dr.max(beta), SURVIVAL_AT_MOST)
        plays = reflections >= RUSSIAN_ROULETTE_FROM
        active &= ~plays | (sampler.next_1d() < survival)
        beta[plays & active] = beta / survival

    return seen, reflected


def power_heuristic(own: Any, other: Any) -> Any:
    """Veach & Guibas 1995, the power heuristic with exponent 2.

    Written with the ratio of the densities: a light seen edge-on has an infinite density, whose square over itself is
    NaN.
    """
    ratio = other / own
    return dr.select(dr.isfinite(ratio), 1.0 / (1.0 + ratio * ratio), 0.0)
