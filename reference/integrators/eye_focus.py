"""How much light of a lamp reaches a point of the iris through the cornea that bends it.

The point where light enters is solved for: on one sphere by Fermat's principle in the plane of the lamp, the iris'
point and the sphere's centre, as a function of one angle. With an endothelium that is the start of a Newton iteration
in both tangents of the cornea; the sphere has the refractive index of the aqueous humour then, because two parallel
surfaces bend light like one. Light must reach every point in one way only, see `require_no_caustic_lines`.

The derivatives of the point of arrival X by the point of entry p (Igehy 1999, "Tracing Ray Differentials", section 3)
give the focus without further approximation: with the irradiance E0 across the beam where it enters at the angle i, and
the transmittance T by Fresnel's equations,
    E = E0 cos(i) T / |dX / dp|.
On one sphere and in the light of a distant lamp this is what Coddington's equations give, with the cosines at the
cornea and at the iris, the curvature k = (n cos(t) - cos(i)) / (n R) and the distance s from there to the iris:
    E = E0 T (cos(i) / cos(t)) cos(x) / |(1 - s k) (1 - s k / cos²(t))|.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import drjit as dr

from reference.eye_rays import Ball
from reference.integrators.eye_lights import Lights, Source
from reference.integrators.eye_surfaces import Surfaces

Focus = Literal["caustic", "flat", "straight"]
"""How lamps light the iris: as they do, or as if the cornea were flat where light enters it, or as if it bent nothing.

flat     : light is bent as it is, but its beam neither converges nor diverges more than it did in air: across it, on
    its way of length D from the lamp, there is the irradiance E0(D), and E = E0 T (cos(i) / cos(t)) cos(x)
straight : light comes on the straight line from the lamp, E = E0 T cos(x), with T where that line passes the cornea
"""

NEWTON_STEPS = 16
"""From the whole arc to the precision of float32: 4 would do but for the iris' rim, where that touches the cornea."""

ENDOTHELIUM_STEPS = 3
"""Newton steps from the solution of one surface to that of two: more change nothing."""

ASTRAY = 1e-3
"""A way that misses its point of the iris by more of the limbus' radius is none."""


@dataclass(frozen=True)
class Beam:
    """A ray with its derivatives by two coordinates of the point of entry, and what happened to it on its way.

    o, d          : point and direction
    pu, pv        : derivatives of the point
    du, dv        : derivatives of the direction
    transmittance : by Fresnel's equations
    widening      : product of cos(i) / cos(t)
    length        : of the way since it entered
    """

    o: Any
    d: Any
    pu: Any
    pv: Any
    du: Any
    dv: Any
    transmittance: Any
    widening: Any
    length: Any

    def moved(self, t: Any, n: Any) -> "Beam":
        """At the distance t, on a surface with the normal n there (Igehy 1999, "Transfer")."""
        across = 1.0 / dr.dot(self.d, n)
        pu, pv = self.pu + t * self.du, self.pv + t * self.dv
        return Beam(
            self.o + t * self.d,
            self.d,
            pu - self.d * (dr.dot(pu, n) * across),
            pv - self.d * (dr.dot(pv, n) * across),
            self.du,
            self.dv,
            self.transmittance,
            self.widening,
            self.length + t,
        )

    def refracted(self, surfaces: Surfaces, n: Any, eta: float, curvature: float) -> "Beam":
        """Behind a sphere on which the beam is (Igehy 1999, "Refraction").

        n         : its normal, against the beam
        eta       : refractive index behind it over that before it
        curvature : 1 / radius, negative if the normal points to the centre
        """
        d, F = surfaces.bent(self.d, n, eta)
        cos_i, cos_t = -dr.dot(self.d, n), -dr.dot(d, n)
        mu = cos_i / eta - cos_t
        slope = (1.0 - cos_i / (eta * cos_t)) / eta

        def turned(dp: Any, dd: Any) -> Any:
            dn = curvature * dp
            return dd / eta - (slope * (dr.dot(dd, n) + dr.dot(self.d, dn))) * n + mu * dn

        return Beam(
            self.o,
            d,
            self.pu,
            self.pv,
            turned(self.pu, self.du),
            turned(self.pv, self.dv),
            self.transmittance * (1.0 - F),
            self.widening * cos_i / cos_t,
            self.length,
        )


def _select(mask: Any, yes: Beam, no: Beam) -> Beam:
    return Beam(*(dr.select(mask, a, b) for a, b in zip(vars(yes).values(), vars(no).values(), strict=True)))


def irradiance(lights: Lights, sampler: Any, focus: Focus, x: Any, active: Any) -> Any:
    """Irradiance inside the eye at points of the iris, from all lamps; one sample of each disk light."""
    total = lights.surfaces.mi.Color3f(0.0)
    for lamp in lights.lamps:
        source = lights.sample(lamp, sampler)
        if focus == "straight":
            total += dr.select(active, straight_irradiance(lights, source, x), 0.0)
        else:
            total += bent_irradiance(lights, source, focus, x, active)
    return total


def straight_irradiance(lights: Lights, source: Source, x: Any) -> Any:
    """Without refraction; see `Focus`."""
    at, optics = lights.surfaces, lights.surfaces.optics
    to_light, distance, across = source.seen_from(x)
    _, t = at.roots(x, to_light, optics.cornea)
    p = x + t * to_light
    cos_x = dr.dot(at.iris_normal(x), to_light)
    F = at.mi.fresnel(dr.dot(at.normal(p, optics.cornea), to_light), optics.cornea.ior)[0]
    arrives = (cos_x > 0.0) & (p.y > optics.limbus_y) & (t < distance) & at.is_clear(x, p)
    arrives &= lights.reaches(p, to_light, distance - t, optics.sclera)
    return dr.select(arrives, across * ((1.0 - F) * cos_x), 0.0)


def bent_irradiance(lights: Lights, source: Source, focus: Focus, x: Any, active: Any) -> Any:
    """Of the light that is bent towards the point.

    Lengths are in radii of the cornea, about whose centre the plane of entry is spanned by the direction to the lamp
    and the one across it to the iris' point (x1, x2). closeness : 1 / the lamp's distance, 0 if it is far away.
    """
    at, ball, inner = lights.surfaces, lights.surfaces.optics.cornea, lights.surfaces.optics.endothelium
    mi = at.mi
    ior = ball.ior if inner is None else inner.ior
    if source.point is None:
        along, closeness = source.toward, mi.Float(0.0)
    else:
        away = at.from_centre(source.point, ball)
        along, closeness = dr.normalize(away), ball.radius / dr.norm(away)
    inside = at.from_centre(x, ball) / ball.radius
    x1 = dr.dot(inside, along)
    x2 = dr.norm(inside - x1 * along)
    across = dr.select(x2 > 1e-6, (inside - x1 * along) / x2, mi.coordinate_system(along)[0])

    def slope(angle: Any) -> tuple[Any, Any]:
        return path_slope(angle, x1, x2, closeness, ior)

    horizon = mi.Float(dr.acos(dr.minimum(closeness, 1.0)))
    farthest = dr.minimum(dr.atan2(x2, x1), horizon)
    active &= (closeness < 1.0) & (slope(farthest)[0] <= 0.0)
    s, c = dr.sincos(_zero(slope, mi.Float(0.0), farthest))
    return dr.select(active, _arriving(lights, source, focus, x, c * along + s * across), 0.0)


def path_slope(angle: Any, x1: Any, x2: Any, closeness: Any, ior: float) -> tuple[Any, Any]:
    """Minus the derivative of the optical path by the angle at which it enters a unit circle, and its derivative.

    The path leads from a point at (1 / closeness, 0) over (cos(angle), sin(angle)) to (x1, x2) inside the circle. Where
    the slope vanishes the way is light's (Fermat), because it is n sin(t) - sin(i).
    """
    s, c = dr.sincos(angle)
    a, b = x2 * c - x1 * s, x1 * c + x2 * s
    inside = dr.rsqrt(dr.square(a) + dr.square(b - 1.0))
    outside = dr.rsqrt(dr.square(s * closeness) + dr.square(1.0 - c * closeness))
    value = ior * a * inside - s * outside
    behind = ior * inside * (dr.square(a * inside) - b)
    before = outside * (c - closeness * dr.square(s * outside))
    return value, behind - before


def _zero(slope: Callable[[Any], tuple[Any, Any]], low: Any, high: Any) -> Any:
    """The angle between two at which a slope falls through 0, by Newton's method that is kept between them."""
    angle = 0.5 * (low + high)
    for _ in range(NEWTON_STEPS):
        value, change = slope(angle)
        low, high = dr.select(value >= 0.0, angle, low), dr.select(value >= 0.0, high, angle)
        newton = angle - value / change
        angle = dr.select((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
    return angle


def _arriving(lights: Lights, source: Source, focus: Focus, x: Any, outward: Any) -> Any:
    """Irradiance at x of the light that enters the cornea where its normal is `outward`, or close to that."""
    at, optics = lights.surfaces, lights.surfaces.optics
    n_x = at.iris_normal(x)
    beam = _beam(at, source, outward, x, n_x)
    for _ in range(0 if optics.endothelium is None else ENDOTHELIUM_STEPS):
        miss = x - beam.o
        area = dr.dot(dr.cross(beam.pu, beam.pv), n_x)
        u, v = dr.dot(dr.cross(miss, beam.pv), n_x) / area, dr.dot(dr.cross(beam.pu, miss), n_x) / area
        tu, tv = at.mi.coordinate_system(outward)
        outward = dr.normalize(outward + (u * tu + v * tv) / optics.cornea.radius)
        beam = _beam(at, source, outward, x, n_x)
    p = at.on(outward, optics.cornea)
    to_light, distance, across = source.seen_from(p)
    cos_i, cos_x = dr.dot(to_light, outward), -dr.dot(beam.d, n_x)
    area = dr.abs(dr.dot(dr.cross(beam.pu, beam.pv), n_x))
    arrives = (dr.norm(x - beam.o) < ASTRAY * optics.limbus_radius) & (cos_i > 0.0) & (cos_x > 0.0) & (area > 0.0)
    arrives &= (p.y > optics.limbus_y) & at.is_clear(x, p)
    arrives &= lights.reaches(p, to_light, distance, optics.sclera)
    if focus == "flat":
        _, _, spread = source.seen_from(p, beam.length)
        return dr.select(arrives, spread * (beam.transmittance * beam.widening * cos_x), 0.0)
    return dr.select(arrives, across * (beam.transmittance * cos_i / area), 0.0)


def _beam(at: Surfaces, source: Source, outward: Any, x: Any, n_x: Any) -> Beam:
    """Light that enters where the cornea's normal is `outward`, at the plane with the normal n_x through x."""
    cornea, inner = at.optics.cornea, at.optics.endothelium
    p = at.on(outward, cornea)
    tu, tv = at.mi.coordinate_system(outward)
    to_light, distance, _ = source.seen_from(p)
    du, dv = ((t - to_light * dr.dot(to_light, t)) / distance for t in (tu, tv))
    one, none = at.mi.Float(1.0), at.mi.Float(0.0)
    beam = Beam(p, -to_light, tu, tv, du, dv, one, one, none)
    beam = beam.refracted(at, outward, cornea.ior, 1.0 / cornea.radius)
    if inner is not None:
        beam = _through_endothelium(at, inner, beam, x, n_x)
    return beam.moved(_to_plane(beam, x, n_x), n_x)


def _to_plane(beam: Beam, x: Any, n_x: Any) -> Any:
    return dr.dot(x - beam.o, n_x) / dr.dot(beam.d, n_x)


def _through_endothelium(at: Surfaces, ball: Ball, beam: Beam, x: Any, n_x: Any) -> Beam:
    """The beam after it entered the sphere of the endothelium, and left it again if the plane through x is beyond."""
    ratio = ball.ior / at.optics.cornea.ior
    near, _ = at.roots(beam.o, beam.d, ball)
    n = at.normal(beam.o + near * beam.d, ball)
    enters = (near > 0.0) & (near < _to_plane(beam, x, n_x))
    beam = _select(enters, beam.moved(near, n).refracted(at, n, ratio, 1.0 / ball.radius), beam)
    _, far = at.roots(beam.o, beam.d, ball)
    n = -at.normal(beam.o + far * beam.d, ball)
    leaves = enters & (far < _to_plane(beam, x, n_x))
    return _select(leaves, beam.moved(far, n).refracted(at, n, 1.0 / ratio, -1.0 / ball.radius), beam)
