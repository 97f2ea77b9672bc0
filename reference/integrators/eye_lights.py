"""The emitters of a scene in the frame of its eye, for Mitsuba's types."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import drjit as dr
import numpy as np

from reference.eye_rays import Ball, eye_of, folds, optics_of
from reference.integrators.eye_surfaces import Surfaces
from reference.stage import Stage
from scenes.errors import SceneError
from scenes.model import ConstantLight, DirectionalLight, DiskLight, EnvironmentLight, PointLight, Scene
from scenes.shapes import Eye

Lamp = PointLight | DirectionalLight | DiskLight
KNOWN = (PointLight, DirectionalLight, DiskLight, ConstantLight, EnvironmentLight)


@dataclass(frozen=True)
class Source:
    """One point of a light that stands for all of it.

    point    : its place; None if it is infinitely far away
    toward   : unit vector to it then
    strength : radiant intensity [W/sr], or irradiance if it is far away
    normal   : of a disk, which shines to that side with the cosine
    """

    point: Any
    toward: Any
    strength: Any
    normal: Any

    def seen_from(self, p: Any, detour: Any = 0.0) -> tuple[Any, Any, Any]:
        """Direction and distance to it, and the irradiance across the beam after `detour` more than the distance."""
        if self.point is None:
            return self.toward, type(p.x)(dr.inf), self.strength
        away = self.point - p
        distance = dr.norm(away)
        to_light = away / distance
        shine = 1.0 if self.normal is None else dr.maximum(-dr.dot(to_light, self.normal), 0.0)
        return to_light, distance, self.strength * (shine / dr.square(distance + detour))


def lamps_of(scene: Scene) -> tuple[Lamp, ...]:
    """The emitters that are connected to, which is all but the sky.

    Raises
    ------
    SceneError
        There are others.
    """
    for light in scene.emitters:
        if not isinstance(light, KNOWN):
            raise SceneError(
                f"Scene '{scene.name}': found a light of type {light.type} beside an eye; allowed are point, "
                "directional, disk, constant and environment. Put a disk in its place."
            )
    return tuple(light for light in scene.emitters if isinstance(light, PointLight | DirectionalLight | DiskLight))


def require_no_caustic_lines(scene: Scene) -> None:
    """See that light of each lamp reaches every point of the iris in one way at most.

    Raises
    ------
    SceneError
        It is not so for some lamp.
    """
    for lamp in lamps_of(scene):
        if _makes_caustic_lines(eye_of(scene), lamp):
            raise SceneError(
                f"Scene '{scene.name}': found a {lamp.type} light so far to the side of the eye that the cornea "
                "focuses it to a line on the iris; allowed are lights of which each point of the iris sees one image. "
                "Move it to the front of the eye: to within 85 degrees of its gaze, if the eye is like a human one."
            )


@cache
def _makes_caustic_lines(eye: Eye, lamp: Lamp) -> bool:
    optics = optics_of(eye)
    if isinstance(lamp, DirectionalLight):
        direction = np.array(lamp.direction) @ optics.to_world
        return folds(optics, -direction / np.linalg.norm(direction), is_far=True)
    if isinstance(lamp, PointLight):
        return folds(optics, optics.into(np.array(lamp.position)), is_far=False)
    normal = np.array(lamp.normal) / np.linalg.norm(lamp.normal)
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    turns = 2 * np.pi * np.arange(8) / 8
    rim = lamp.radius * (np.cos(turns)[:, None] * u + np.sin(turns)[:, None] * np.cross(normal, u))
    places = optics.into(np.array(lamp.position) + np.concatenate([np.zeros((1, 3)), rim]))
    return any(folds(optics, place, is_far=False) for place in places)


class Lights:
    """What shines on the eye, and what is in its way outside."""

    def __init__(self, stage: Stage, surfaces: Surfaces) -> None:
        self.surfaces = surfaces
        self.lamps = lamps_of(stage.description)
        self.disks = [lamp for lamp in self.lamps if isinstance(lamp, DiskLight)]
        self.environment = stage.scene.environment()

    def sample(self, lamp: Lamp, sampler: Any) -> Source:
        """A point of a lamp, uniform on a disk."""
        mi, at = self.surfaces.mi, self.surfaces
        match lamp:
            case DirectionalLight():
                return Source(None, -at.direction(lamp.direction), mi.Color3f(*lamp.irradiance), None)
            case PointLight():
                return Source(at.point(lamp.position), None, mi.Color3f(*lamp.intensity), None)
            case DiskLight():
                normal = at.direction(lamp.normal)
                across = lamp.radius * mi.warp.square_to_uniform_disk_concentric(sampler.next_2d())
                place = at.point(lamp.position) + mi.Frame3f(normal).to_world(mi.Vector3f(across.x, across.y, 0.0))
                return Source(place, None, mi.Color3f(*lamp.radiance) * (np.pi * lamp.radius**2), normal)

    def reaches(self, p: Any, to_light: Any, distance: Any, other: Ball) -> Any:
        """Whether neither a disk light nor the eye's `other` sphere is between the eye's outside and a light."""
        free = ~self.surfaces.is_hidden(p, to_light, distance, other)
        for disk in self.disks:
            free &= self._disk_distance(disk, p, to_light) >= 0.9999 * distance
        return free

    def sky(self, p: Any, d: Any, other: Ball) -> Any:
        """Radiance of the sky, 0 where something is in the way."""
        mi = self.surfaces.mi
        if self.environment is None:
            return mi.Color3f(0.0)
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi = -self.surfaces.in_world(d)
        return dr.select(self.reaches(p, d, mi.Float(dr.inf), other), self.environment.eval(si), 0.0)

    def mirrored(self, p: Any, d: Any, other: Ball) -> Any:
        """Radiance that a reflected ray runs into: the nearest disk's on its front, the sky's, or nothing."""
        mi = self.surfaces.mi
        nearest, radiance = mi.Float(dr.inf), mi.Color3f(0.0)
        for disk in self.disks:
            t = self._disk_distance(disk, p, d)
            shines = dr.dot(d, self.surfaces.direction(disk.normal)) < 0.0
            radiance = dr.select(t < nearest, dr.select(shines, mi.Color3f(*disk.radiance), 0.0), radiance)
            nearest = dr.minimum(nearest, t)
        is_free = ~self.surfaces.is_hidden(p, d, nearest, other)
        return dr.select(is_free, radiance, 0.0) + self.sky(p, d, other)

    def _disk_distance(self, disk: DiskLight, o: Any, d: Any) -> Any:
        """Distance to a disk light from either side, infinite if the ray misses it."""
        centre, normal = self.surfaces.point(disk.position), self.surfaces.direction(disk.normal)
        t = dr.dot(centre - o, normal) / dr.dot(d, normal)
        return dr.select((t > 0.0) & (dr.norm(o + t * d - centre) <= disk.radius), t, dr.inf)
