"""Path tracing of everything at once: surfaces of any kind, hair, clear corneas and bodies that scatter evenly.

Light is followed from the sensor. At every vertex, on a surface or inside a body, the path is joined to an emitter, and
goes on in a direction that the surface or the body chooses; both ways to light are weighted by the power heuristic
(Veach & Guibas 1995). What lies beyond a smooth cornea is found by the path itself alone, with its full weight.

A path carries with it the extinction of what it runs through, which changes where it crosses the surface of a body. A
body ends at its surface and nowhere else: what sticks in it, such as a neck in a garment, need not fit it. It knows one
body at a time. Bodies that overlap, or lie in one another, are not handled: where the path leaves the second it is in
none. Neither is a camera inside of a body, as a path begins in none.
"""

from typing import Any

import drjit as dr

from reference.integrators.light_paths import SURVIVAL_AT_MOST, power_heuristic
from reference.integrators.media import JUST_BEFORE, RUSSIAN_ROULETTE_BELOW, Bodies, free_path
from reference.stage import Stage

PATIENCE = 256
"""Vertices after which a path may end by chance whatever its throughput: in a white room it would go on for ever."""


def trace_full_paths(stage: Stage, sampler: Any, ray: Any) -> Any:
    """Radiance along one path for each camera ray from everything but the emitter that the ray itself meets."""
    mi = stage.mi
    return _loop(mi, stage.scene, Bodies(mi, stage.scene.shapes()), sampler, mi.Ray3f(ray), mi.Bool(True))


@dr.syntax  # type: ignore[untyped-decorator]
def _loop(mi: Any, scene: Any, bodies: Any, sampler: Any, ray: Any, active: Any) -> Any:
    radiance = mi.Color3f(0.0)
    beta = mi.Color3f(1.0)
    sigma_s, sigma_t = mi.Color3f(0.0), mi.Color3f(0.0)  # of what the ray runs through
    vertices = mi.UInt32(0)
    previous = dr.zeros(mi.Interaction3f)
    previous_pdf = mi.Float(0.0)
    was_smooth = mi.Bool(True)
    is_first = mi.Bool(True)

    while active:
        si = scene.ray_intersect(ray, active)
        is_body, inner_s, inner_t = bodies.at(mi, si.shape)
        in_medium = active & (dr.max(sigma_t) > 0)

        scatters, distance, weight = free_path(sampler, beta, sigma_s, sigma_t, in_medium, si.t)
        beta *= weight
        position = ray(distance)

        # Light that the path ran into by itself, but not at once: that is what the caller adds.
        met = active & ~scatters & ~is_first
        radiance += _met(mi, scene, si, beta, previous, previous_pdf, was_smooth, met)
        is_first = mi.Bool(False)

        # Bodies let light pass; here it runs on in the body, or out of it.
        active &= scatters | si.is_valid()
        crosses = active & ~scatters & is_body
        enters = crosses & (dr.dot(ray.d, si.n) < 0)
        on_surface = active & ~scatters & ~is_body
        here = _vertex(mi, si, position, scatters)

        # Light that arrives at the vertex straight from an emitter.
        light, arriving = scene.sample_emitter_direction(here, sampler.next_2d(), False, scatters | on_surface)
        value = _spread(mi, si, light, beta, scatters, on_surface)
        connects = (scatters | on_surface) & (light.pdf > 0) & dr.any(value * arriving != 0.0)
        towards, left = _towards(mi, si, light, position, scatters)
        reaching = _transmittance(mi, scene, bodies, towards, left, sigma_t, mi.Bool(connects))
        radiance += dr.select(connects, value * arriving * reaching, 0.0)

        # Continue the path.
        sample, bsdf_weight = si.bsdf().sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d(), on_surface)
        anywhere = mi.warp.square_to_uniform_sphere(sampler.next_2d())
        onward = dr.select(on_surface, si.to_world(sample.wo), ray.d)
        begin = dr.select(on_surface, si.spawn_ray(onward).o, ray(distance + dr.select(crosses, bodies.step, 0.0)))
        ray = mi.Ray3f(begin, dr.select(scatters, anywhere, onward))
        beta = dr.select(on_surface, beta * bsdf_weight, beta)
        sigma_s = dr.select(enters, inner_s, dr.select(crosses, 0.0, sigma_s))
        sigma_t = dr.select(enters, inner_t, dr.select(crosses, 0.0, sigma_t))
        is_vertex = scatters | on_surface
        previous = dr.select(is_vertex, mi.Interaction3f(here), previous)
        previous_pdf = dr.select(scatters, dr.inv_four_pi, dr.select(on_surface, sample.pdf, previous_pdf))
        smooth = on_surface & mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        was_smooth = dr.select(is_vertex, smooth, was_smooth)
        vertices += dr.select(is_vertex, mi.UInt32(1), 0)
        active &= dr.any(beta != 0.0)

        survival = dr.minimum(dr.max(beta), SURVIVAL_AT_MOST)
        plays = is_vertex & ((survival < RUSSIAN_ROULETTE_BELOW) | (vertices >= PATIENCE))
        active &= ~plays | (sampler.next_1d() < survival)
        beta[plays & active] = beta / survival

    return radiance


def _met(
    mi: Any, scene: Any, si: Any, beta: Any, previous: Any, previous_pdf: Any, was_smooth: Any, active: Any
) -> Any:
    """Light of the emitters that paths ran into, weighted against joining the vertex before to them."""
    emitter = si.emitter(scene, active)
    counts = active & (emitter != None)  # noqa: E711
    direction = mi.DirectionSample3f(scene, si, previous)
    pdf = scene.pdf_emitter_direction(previous, direction, counts & ~was_smooth)
    weight = dr.select(was_smooth, 1.0, power_heuristic(previous_pdf, pdf))
    return dr.select(counts, beta * emitter.eval(si, counts) * weight, 0.0)


def _vertex(mi: Any, si: Any, position: Any, scatters: Any) -> Any:
    """What is joined to emitters: the surface, or a place in a body, which has no normal."""
    inside = dr.zeros(mi.SurfaceInteraction3f)
    inside.p = position
    return dr.select(scatters, inside, si)


def _spread(mi: Any, si: Any, light: Any, beta: Any, scatters: Any, on_surface: Any) -> Any:
    """Part of the light of sampled emitters that vertices send on to the sensor, weighted against running into them."""
    bsdf = si.bsdf()
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(light.d), on_surface & (light.pdf > 0))
    value = dr.select(scatters, mi.Color3f(dr.inv_four_pi), value)
    pdf = dr.select(scatters, dr.inv_four_pi, pdf)
    return beta * value * dr.select(light.delta, 1.0, power_heuristic(light.pdf, pdf))


def _towards(mi: Any, si: Any, light: Any, position: Any, scatters: Any) -> tuple[Any, Any]:
    """The ray from a vertex to an emitter, and its length."""
    ray = si.spawn_ray_to(light.p)
    origin = dr.select(scatters, position, ray.o)
    return mi.Ray3f(origin, light.d), dr.select(scatters, light.dist * JUST_BEFORE, ray.maxt)


@dr.syntax  # type: ignore[untyped-decorator]
def _transmittance(mi: Any, scene: Any, bodies: Any, ray: Any, left: Any, sigma_t: Any, active: Any) -> Any:
    """Part of the light that bodies let pass along a ray of length `left`; 0 where something else is in the way.

    sigma_t : of what the ray starts in
    """
    passed = mi.Color3f(1.0)
    sigma_t = mi.Color3f(sigma_t)
    left = mi.Float(left)

    while active:
        si = scene.ray_intersect(mi.Ray3f(ray, left), ray_flags=+mi.RayFlags.Minimal, coherent=False, active=active)
        passed *= dr.select(active & (dr.max(sigma_t) > 0), dr.exp(-sigma_t * dr.minimum(si.t, left)), 1.0)
        active &= si.is_valid()
        is_body, _, inner_t = bodies.at(mi, si.shape)
        passed = dr.select(active & ~is_body, 0.0, passed)
        active &= is_body
        sigma_t = dr.select(dr.dot(ray.d, si.n) < 0, inner_t, mi.Color3f(0.0))
        left -= si.t + bodies.step
        ray = mi.Ray3f(ray(si.t + bodies.step), ray.d)

    return passed
