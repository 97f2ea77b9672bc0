"""Light that an eye sends to the camera, through the surfaces themselves: no mesh is involved.

What the camera sees at a point of the eye's outside is the sum of
  - a mirror image of the emitters, weighted by the Fresnel reflectance F;
  - on the sclera, what its Lambertian surface reflects under a smooth film;
  - through the cornea, what the Lambertian iris reflects. The pupil reflects nothing.

Along a ray the basic radiance L / n² is constant but for Fresnel losses (Nicodemus 1963, "Radiance"), so that this is
what is carried inside the eye. With the irradiance E inside the eye at a point of the iris,
    L / n² = rho (E / (pi n²) + mean of the basic radiance that comes back from the cornea and the iris).
E is of lamps, by `reference.integrators.eye_focus`; light of the sky is found by the rays that leave the cornea from
inside, and by no others. From the iris a ray is followed in a direction with the cosine's distribution; the cornea
reflects it with the probability F, which is 1 beyond the critical angle; the wall beside the iris is black.

Left out is light of lamps that enters through the cornea and is reflected by it from inside before it meets the iris
for the first time, and light that the cornea throws on the sclera or the sclera on the cornea. The straight shadows of
the cornea's bulge on the sclera and of the sclera on the cornea are there, as are those of disk lights.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import drjit as dr
import numpy as np

from reference.eye_rays import Ball, eye_of, optics_of
from reference.integrators.eye_focus import Focus, irradiance
from reference.integrators.eye_lights import Lights, require_no_caustic_lines
from reference.integrators.eye_surfaces import Surfaces
from reference.integrators.light_paths import RUSSIAN_ROULETTE_FROM, SURVIVAL_AT_MOST
from reference.stage import Stage
from scenes.errors import SceneError
from scenes.geometry import diffuse_reflectance, texture_of
from scenes.materials import Texture
from scenes.model import Scene


def fresnel_diffuse_inside(ior: float) -> float:
    """Reflectance of a smooth surface for diffuse light from inside.

    By reciprocity the diffuse transmittance from inside is 1 / n² of that from outside, whose integrand is smooth
    (Duntley 1942, "The Optical Properties of Diffusing Materials").
    """
    nodes, weights = np.polynomial.legendre.leggauss(64)
    cos_i = (nodes + 1) / 2
    cos_t = np.sqrt(1 - (1 - cos_i**2) / ior**2)
    s, p = (cos_i - ior * cos_t) / (cos_i + ior * cos_t), (ior * cos_i - cos_t) / (ior * cos_i + cos_t)
    outside = float(weights @ (cos_i * (s**2 + p**2) / 2))
    return 1 - (1 - outside) / ior**2


def eye_radiance(stage: Stage, sampler: Any, ray: Any) -> Any:
    """Radiance along camera rays from the whole eye."""
    scene, mi = stage.description, stage.mi
    lights = _lights(stage, "caustic")
    at, optics = lights.surfaces, lights.surfaces.optics
    o, d = at.ray(ray)
    t, on_cornea, on_sclera = at.outer_hit(o, d)
    p = o + dr.select(on_cornea | on_sclera, t, 0.0) * d
    radiance = _through_cornea(stage, lights, "caustic", sampler, p, d, on_cornea)
    for hit, own, other in ((on_cornea, optics.cornea, optics.sclera), (on_sclera, optics.sclera, optics.cornea)):
        n = at.normal(p, own)
        cos_o = -dr.dot(d, n)
        F = mi.fresnel(cos_o, own.ior)[0]
        radiance += dr.select(hit, F * lights.mirrored(p, d + 2.0 * cos_o * n, other), 0.0)
    n = at.normal(p, optics.sclera)
    rho = mi.Color3f(*_sclera_reflectance(scene))
    return radiance + dr.select(on_sclera, _sclera_radiance(lights, sampler, p, n, -dr.dot(d, n), rho), 0.0)


def iris_radiance(focus: Focus, stage: Stage, sampler: Any, ray: Any) -> Any:
    """Radiance along camera rays of what the iris reflects."""
    lights = _lights(stage, focus)
    o, d = lights.surfaces.ray(ray)
    t, on_cornea, _ = lights.surfaces.outer_hit(o, d)
    p = o + dr.select(on_cornea, t, 0.0) * d
    return _through_cornea(stage, lights, focus, sampler, p, d, on_cornea)


def _lights(stage: Stage, focus: Focus) -> Lights:
    """The lights and the surfaces of a scene whose only shape besides lights is an eye."""
    if focus != "straight":
        require_no_caustic_lines(stage.description)
    return Lights(stage, Surfaces(stage.mi, optics_of(eye_of(stage.description))))


def _through_cornea(stage: Stage, lights: Lights, focus: Focus, sampler: Any, p: Any, d: Any, active: Any) -> Any:
    """Radiance of the iris as seen at points p of the cornea by rays that come along d."""
    x, transmittance, sees = look_inside(lights.surfaces, p, d)
    sees &= active
    reflectance = _iris_reflectance(stage, lights.surfaces)
    lit = partial(irradiance, lights, sampler, focus)
    basic = _iris_paths(lights, reflectance, lit, sampler, dr.select(sees, x, 0.0), sees)
    return dr.select(sees, transmittance * basic, 0.0)


def look_inside(at: Surfaces, p: Any, d: Any) -> tuple[Any, Any, Any]:
    """The iris' point that a ray sees which meets the cornea at p, the transmittance, and whether it sees one."""
    optics = at.optics
    o, ball = p, optics.endothelium
    d, F = at.bent(d, at.normal(p, optics.cornea), optics.cornea.ior)
    transmittance = 1.0 - F
    if ball is not None:
        ratio = ball.ior / optics.cornea.ior
        near, _ = at.roots(o, d, ball)
        enters = (near > 0.0) & (near < at.iris_hit(o, d))
        o, d, transmittance = _crossed(at, ball, o, d, transmittance, near, enters, ratio)
        _, far = at.roots(o, d, ball)
        leaves = enters & (far < at.iris_hit(o, d))
        o, d, transmittance = _crossed(at, ball, o, d, transmittance, far, leaves, 1.0 / ratio)
    t = at.iris_hit(o, d)
    _, far = at.roots(o, d, optics.cornea)
    leaves_sideways = (o.y + far * d.y > optics.limbus_y) & (far < t)
    return o + t * d, transmittance, dr.isfinite(t) & ~leaves_sideways


def _crossed(at: Surfaces, ball: Ball, o: Any, d: Any, T: Any, t: Any, where: Any, eta: float) -> tuple[Any, Any, Any]:
    """A ray and its transmittance, beyond a sphere at the distance t where it crosses that."""
    p = o + t * d
    n = at.normal(p, ball)
    bent, F = at.bent(d, dr.select(dr.dot(d, n) < 0.0, n, -n), eta)
    return dr.select(where, p, o), dr.select(where, bent, d), dr.select(where, T * (1.0 - F), T)


def _iris_reflectance(stage: Stage, at: Surfaces) -> Callable[[Any], Any]:
    mi, scene, optics = stage.mi, stage.description, at.optics
    value = diffuse_reflectance(scene.materials[eye_of(scene).iris])
    texels = texture_of(scene, value) if isinstance(value, Texture) else np.array(value, dtype=np.float32)[None, None]
    texture = mi.Texture2f(mi.TensorXf(texels), wrap_mode=dr.WrapMode.Clamp)

    def reflectance(x: Any) -> Any:
        column, row = 0.5 + 0.5 * x.x / optics.limbus_radius, 0.5 + 0.5 * x.z / optics.limbus_radius
        rho = mi.Color3f(texture.eval(mi.Point2f(column, row)))
        return dr.select(dr.square(x.x) + dr.square(x.z) < optics.pupil_radius**2, 0.0, rho)

    return reflectance


@dr.syntax  # type: ignore[untyped-decorator]
def _iris_paths(lights: Any, reflectance: Any, irradiance: Any, sampler: Any, x: Any, active: Any) -> Any:
    """Basic radiance that points x of the iris reflect, by one path from each."""
    at = lights.surfaces
    mi = at.mi
    total, beta, reflections = mi.Color3f(0.0), mi.Color3f(1.0), mi.UInt32(0)
    x, active = mi.Point3f(x), mi.Bool(active)
    while active:
        beta *= reflectance(x)
        active &= dr.any(beta > 0.0)
        total += dr.select(active, beta * irradiance(x, active) / (dr.pi * dr.square(at.index_at(x))), 0.0)

        reflections += 1
        survival = dr.minimum(dr.max(beta), SURVIVAL_AT_MOST)
        plays = reflections >= RUSSIAN_ROULETTE_FROM
        active &= ~plays | (sampler.next_1d() < survival)
        beta[plays & active] = beta / survival

        # Follow a reflected ray until it meets the iris again or is lost.
        d = mi.Frame3f(at.iris_normal(x)).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
        o = mi.Point3f(x)
        is_aqueous = mi.Bool(at.is_aqueous(x))
        walks = mi.Bool(active)
        active = mi.Bool(False)
        while walks:
            p, is_iris, is_cornea, is_endothelium, n, eta = _next_surface(at, o, d, is_aqueous)
            bent, F = at.bent(d, n, eta)

            # What the cornea lets through sees the sky.
            leaves = walks & is_cornea & (F < 1.0)
            total += dr.select(leaves, beta * (1.0 - F) * lights.sky(p, bent, at.optics.sclera), 0.0)

            is_reflected = sampler.next_1d() < F
            passes = is_endothelium & ~is_reflected
            active |= walks & is_iris
            x = dr.select(walks & is_iris, p, x)
            walks &= passes | ((is_cornea | is_endothelium) & is_reflected)
            d = dr.select(passes, bent, d - 2.0 * dr.dot(d, n) * n)
            is_aqueous ^= passes
            o = mi.Point3f(p)
    return total


def _next_surface(at: Surfaces, o: Any, d: Any, is_aqueous: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    """What a ray inside the eye meets.

    Returns
    -------
    The point; whether it is on the iris, on the cornea's front, on the endothelium (on the black wall, if on none); the
    normal against the ray, and the refractive index beyond over that before, of the two latter.
    """
    optics = at.optics
    iris, (inner, n_inner, eta_inner), (_, outer) = (
        at.iris_hit(o, d),
        _endothelium(at, o, d, is_aqueous),
        at.roots(o, d, optics.cornea),
    )
    is_iris = (iris < inner) & (iris < outer)
    is_endothelium = ~is_iris & (inner < outer)
    p = o + dr.minimum(iris, dr.minimum(inner, outer)) * d
    is_cornea = ~is_iris & ~is_endothelium & (p.y > optics.limbus_y) & at.is_clear(o, p)
    n = dr.select(is_endothelium, n_inner, -at.normal(p, optics.cornea))
    return p, is_iris, is_cornea, is_endothelium, n, dr.select(is_endothelium, eta_inner, 1.0 / optics.cornea.ior)


def _endothelium(at: Surfaces, o: Any, d: Any, is_aqueous: Any) -> tuple[Any, Any, Any]:
    """Distance to the endothelium, the normal there against the ray, and the refractive index beyond it relatively."""
    ball = at.optics.endothelium
    if ball is None:
        return at.mi.Float(dr.inf), at.mi.Vector3f(0.0), at.mi.Float(1.0)
    near, far = at.roots(o, d, ball)
    t = dr.select(is_aqueous, far, dr.select(near > at.near, near, dr.inf))
    n = at.normal(o + t * d, ball)
    ratio = ball.ior / at.optics.cornea.ior
    return t, dr.select(is_aqueous, -n, n), dr.select(is_aqueous, at.mi.Float(1.0 / ratio), ratio)


def _sclera_reflectance(scene: Scene) -> tuple[float, float, float]:
    value = diffuse_reflectance(scene.materials[eye_of(scene).material])
    if isinstance(value, Texture):
        raise SceneError(
            f"Scene '{scene.name}': found a texture on the white of an eye; allowed is one reflectance. Give that, or "
            "judge the iris alone."
        )
    return value


def _sclera_radiance(lights: Lights, sampler: Any, p: Any, n: Any, cos_o: Any, rho: Any) -> Any:
    """Radiance of a Lambertian surface under a smooth film, with all reflections below the film.

    L = (1 - F_o) rho / (n² (1 - rho F_d)) * integral of (1 - F_i) dE_i / pi, as Mitsuba's `plastic` with nonlinear=True
    has it, but with F_d from Fresnel's equations instead of a fit to them.
    """
    at, mi = lights.surfaces, lights.surfaces.mi
    ior, cornea = at.optics.sclera.ior, at.optics.cornea
    d = mi.Frame3f(n).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
    total = (1.0 - mi.fresnel(dr.dot(n, d), ior)[0]) * lights.sky(p, d, cornea)
    for lamp in lights.lamps:
        to_light, distance, across = lights.sample(lamp, sampler).seen_from(p)
        cos_i = dr.dot(n, to_light)
        arrives = (cos_i > 0.0) & lights.reaches(p, to_light, distance, cornea)
        total += dr.select(arrives, across * (cos_i * (1.0 - mi.fresnel(cos_i, ior)[0]) / dr.pi), 0.0)
    leaves = (1.0 - mi.fresnel(cos_o, ior)[0]) / ior**2
    return leaves * rho / (1.0 - rho * fresnel_diffuse_inside(ior)) * total
