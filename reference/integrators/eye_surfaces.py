"""The surfaces of an eye in its own frame, for Mitsuba's types: what `reference.eye_rays` is in float64."""

from types import ModuleType
from typing import Any

import drjit as dr
import numpy as np

from reference.eye_rays import Ball, Optics
from scenes.image import Float64
from scenes.units import Vec3

NEAR = 1e-4
"""Distances below this part of the limbus' radius are of the surface that a ray starts on."""


class Surfaces:
    """Points and directions are in the eye's frame, which is turned and moved, never scaled."""

    def __init__(self, mi: ModuleType, optics: Optics) -> None:
        self.mi = mi
        self.optics = optics
        self.near = NEAR * optics.limbus_radius

    def point(self, p: Vec3) -> Any:
        """A point of the world."""
        return self.mi.Point3f(self.optics.into(np.array(p)).tolist())

    def direction(self, v: Vec3) -> Any:
        """A direction of the world, made a unit vector."""
        turned: Float64 = np.array(v) @ self.optics.to_world
        return self.mi.Vector3f((turned / np.linalg.norm(turned)).tolist())

    def ray(self, ray: Any) -> tuple[Any, Any]:
        """Origin and direction of a ray of the world."""
        matrix = self.mi.Matrix3f(self.optics.to_world.T.tolist())
        return self.mi.Point3f(matrix @ (ray.o - self.mi.Point3f(self.optics.position.tolist()))), matrix @ ray.d

    def in_world(self, d: Any) -> Any:
        """A direction of the eye's frame in the world."""
        return self.mi.Matrix3f(self.optics.to_world.tolist()) @ d

    def from_centre(self, p: Any, ball: Ball) -> Any:
        return self.mi.Vector3f(p.x, p.y - ball.y, p.z)

    def normal(self, p: Any, ball: Ball) -> Any:
        """Outward unit normal of a sphere at a point of it."""
        return dr.normalize(self.from_centre(p, ball))

    def on(self, outward: Any, ball: Ball) -> Any:
        """The point of a sphere with an outward unit normal."""
        return self.mi.Point3f(ball.radius * outward.x, ball.y + ball.radius * outward.y, ball.radius * outward.z)

    def roots(self, o: Any, d: Any, ball: Ball) -> tuple[Any, Any]:
        """Distances to where a ray enters and leaves a sphere, infinite if it passes by; see `reference.eye_rays`."""
        f = self.from_centre(o, ball)
        b = -dr.dot(f, d)
        closest = f + b * d
        discriminant = ball.radius**2 - dr.dot(closest, closest)
        q = b + dr.copysign(dr.sqrt(dr.maximum(discriminant, 0.0)), b)
        away = dr.norm(f)
        other = dr.select(q == 0.0, 0.0, (away - ball.radius) * (away + ball.radius) / q)
        meets = discriminant >= 0.0
        return dr.select(meets, dr.minimum(q, other), dr.inf), dr.select(meets, dr.maximum(q, other), dr.inf)

    def outer_hit(self, o: Any, d: Any) -> tuple[Any, Any, Any]:
        """Distance to the eye from outside, whether the cornea is met there, and whether the sclera."""
        optics = self.optics
        cornea, _ = self.roots(o, d, optics.cornea)
        sclera, _ = self.roots(o, d, optics.sclera)
        cornea = dr.select((cornea > 0.0) & (o.y + cornea * d.y > optics.limbus_y), cornea, dr.inf)
        sclera = dr.select((sclera > 0.0) & (o.y + sclera * d.y <= optics.limbus_y), sclera, dr.inf)
        on_cornea = cornea < sclera
        return dr.minimum(cornea, sclera), on_cornea, ~on_cornea & dr.isfinite(sclera)

    def is_hidden(self, o: Any, d: Any, distance: Any, other: Ball) -> Any:
        """Whether a ray from the outside of the sclera or the cornea meets the `other` one before a distance."""
        t, _ = self.roots(o, d, other)
        is_beyond = o.y + t * d.y > self.optics.limbus_y
        is_there = is_beyond if other is self.optics.cornea else ~is_beyond
        return (t > self.near) & (t < distance) & is_there

    def iris_hit(self, o: Any, d: Any) -> Any:
        """Distance to the iris of a ray inside the eye, infinite if it misses it."""
        optics = self.optics
        plane = (optics.iris_y - o.y) / d.y
        passes_rim = (d.y < 0.0) & (plane > 0.0) & self._is_within(o + plane * d)
        if optics.bowl is None:
            return dr.select(passes_rim, plane, dr.inf)
        near, far = self.roots(o, d, optics.bowl)
        is_in_bowl = (o.y <= optics.iris_y) & (near < self.near) & (far > self.near)
        stays = is_in_bowl & (o.y + far * d.y <= optics.iris_y)
        return dr.select(passes_rim | stays, far, dr.inf)

    def iris_normal(self, x: Any) -> Any:
        if self.optics.bowl is None:
            return self.mi.Vector3f(0.0, 1.0, 0.0)
        return -self.normal(x, self.optics.bowl)

    def is_clear(self, x: Any, p: Any) -> Any:
        """Whether limbus and iris' rim let a straight line pass from a point inside to one of the cornea."""
        optics = self.optics
        clear = self.mi.Bool(True)
        for y in {optics.limbus_y} if optics.bowl is None else {optics.limbus_y, optics.iris_y}:
            s = (y - x.y) / (p.y - x.y)
            clear &= ~((s > 0.0) & (s < 1.0)) | self._is_within(x + s * (p - x))
        return clear

    def _is_within(self, p: Any) -> Any:
        return dr.square(p.x) + dr.square(p.z) <= self.optics.limbus_radius**2

    def is_aqueous(self, x: Any) -> Any:
        """Whether a point lies within the sphere of the endothelium."""
        ball = self.optics.endothelium
        return self.mi.Bool(False) if ball is None else dr.norm(self.from_centre(x, ball)) < ball.radius

    def index_at(self, x: Any) -> Any:
        """Refractive index at a point inside the eye."""
        optics = self.optics
        inner = optics.cornea if optics.endothelium is None else optics.endothelium
        return dr.select(self.is_aqueous(x), self.mi.Float(inner.ior), optics.cornea.ior)

    def bent(self, d: Any, n: Any, eta: Any) -> tuple[Any, Any]:
        """A direction behind a surface, and what part of the light is reflected: all, where nothing passes.

        n : the normal against the ray; eta : refractive index behind the surface over that before it
        """
        cos_i = -dr.dot(d, n)
        F, cos_t, _, ratio = self.mi.fresnel(cos_i, eta)
        return dr.normalize(ratio * d + (ratio * cos_i - dr.abs(cos_t)) * n), F
