"""Light of emitters that a camera sees directly, through a lens that may blur lamps far beyond their size.

A lamp out of focus spreads over a disk. At a pixel in that disk few rays through the lens meet the lamp: one in a
thousand if the lamp has a radius of half a pixel and the disk one of 16. So each sample aims at a lamp, too, through
the same position on the film. In camera coordinates, with the lens in the plane z = 0, the view along z, the focus
distance z_f, and g the x and y of the ray through the lens' centre at z = 1, the ray that meets a point p crosses the
lens at

    u = (p_xy - g p_z) / (1 - p_z / z_f).

For all points of a ball with the centre c and the radius r, which holds the lamp, u lies in a disk around that of c,
the lamp's shadow on the lens. With s = 1 - c_z / z_f its radius is at most

    rho = r (sqrt(1 + g²) + |u(c)| / z_f) / (|s| - r / z_f).

Of the N lamps whose shadows overlap the lens one is chosen evenly, and a place in its shadow evenly. Per area of the
lens, that has the density p_lamp(u) = (1 / N) sum over the shadows that u lies in of 1 / (pi rho²). Rays drawn from the
lens have p_lens = 1 / (pi R²). Light of these lamps that is found by one or by the other counts p_lens / (p_lens +
p_lamp) times, and both are added: the balance heuristic of Veach & Guibas 1995, "Optimally Combining Sampling
Techniques for Monte Carlo Rendering".
"""

from typing import Any

import drjit as dr
import numpy as np

from reference.stage import Stage
from reference.to_mitsuba import FARTHEST_FOCUS
from scenes.image import Float64
from scenes.model import ThinLens

SMALL = 0.35
"""Lamps are aimed at whose shadow on the lens has a radius below this part of the lens': of the rays through a pixel,
at most one in eight would meet them by chance.
"""


def emitted_light(stage: Stage, ray: Any) -> Any:
    """Radiance of what camera rays meet first, or of the sky."""
    si = stage.scene.ray_intersect(ray)
    return si.emitter(stage.scene).eval(si)


def emitted_light_through_lens(stage: Stage, ray: Any) -> Any:
    """One sample for each camera ray, whose mean over the lens is that of `emitted_light`."""
    sensor = stage.description.sensor
    if isinstance(sensor, ThinLens) and sensor.aperture_radius > 0:
        lens = Lens(stage, sensor)
        if lens.lamps:
            return lens.emitted_light(ray)
    return emitted_light(stage, ray)


class Lens:
    """The sensor's lens, and the small lamps that are aimed at through it."""

    def __init__(self, stage: Stage, sensor: ThinLens) -> None:
        mi = self.mi = stage.mi
        self.scene = stage.scene
        nearness = 1 / min(sensor.focus_distance, FARTHEST_FOCUS)
        self.to_world = stage.sensor.world_transform()
        self.to_camera = self.to_world.inverse()
        self.lamps: list[Any] = []
        balls: list[tuple[Float64, float]] = []
        for shape in stage.scene.shapes():
            if shape.is_emitter():
                centre, radius = self._ball(shape)
                stretch = abs(1 - centre[2] * nearness)
                is_in_front = centre[2] > radius and stretch > 2 * radius * nearness
                if is_in_front and radius < SMALL * sensor.aperture_radius * stretch:
                    self.lamps.append(mi.ShapePtr(shape))
                    balls.append((centre, radius))
        self.centres = mi.Point3f(np.array([centre for centre, _ in balls], dtype=np.float32).reshape(-1, 3).T)
        self.radii = mi.Float([radius for _, radius in balls])
        # Variables: literals would compile the kernel anew for each scene.
        self.radius = dr.opaque(mi.Float, sensor.aperture_radius)
        self.nearness = dr.opaque(mi.Float, nearness)
        self.count = dr.opaque(mi.UInt32, len(balls))

    def _ball(self, shape: Any) -> tuple[Float64, float]:
        """Centre, in camera coordinates, and radius of a ball that holds a shape, which is a mesh or a ball."""
        matrix = np.array(self.to_camera.matrix, dtype=np.float64).reshape(4, 4)
        low, high = np.array([shape.bbox().min, shape.bbox().max], dtype=np.float64)
        centre, radius = (low + high) / 2, float((high - low).max() / 2)
        if shape.is_mesh():
            positions = np.array(self.mi.traverse(shape)["vertex_positions"], dtype=np.float64).reshape(-1, 3)
            radius = float(np.linalg.norm(positions - centre, axis=1).max())
        return matrix[:3, :3] @ centre + matrix[:3, 3], radius

    def emitted_light(self, ray: Any) -> Any:
        """See `emitted_light_through_lens`."""
        mi = self.mi
        origin, direction = self.to_camera @ ray.o, self.to_camera @ ray.d
        slope = mi.Point2f(direction.x, direction.y) / direction.z
        place = mi.Point2f(origin.x, origin.y) - slope * origin.z
        chief = slope + place * self.nearness
        candidates = _count(self, chief)

        # What the ray meets; it may be a lamp that could have been aimed at.
        found, is_lamp = self._meets(ray, mi.Bool(True))
        light = found * dr.select(is_lamp, self._share(place, chief, candidates), 1.0)

        # The numbers that chose the place on the lens choose once more, as they are stratified.
        numbers = dr.clip(mi.warp.uniform_disk_to_square_concentric(place / self.radius), 0, 1)
        scaled = numbers.x * mi.Float(candidates)
        chosen = dr.minimum(mi.UInt32(scaled), dr.maximum(candidates, 1) - 1)
        middle, reach = self.shadow(_pick(self, chief, chosen), chief)
        within = mi.warp.square_to_uniform_disk_concentric(mi.Point2f(scaled - mi.Float(chosen), numbers.y))
        place = middle + reach * within
        active = (candidates > 0) & (dr.norm(place) < self.radius)
        toward = chief - place * self.nearness
        start, ahead = mi.Point3f(place.x, place.y, 0.0), mi.Vector3f(toward.x, toward.y, 1.0)
        found, is_lamp = self._meets(mi.Ray3f(self.to_world @ start, self.to_world @ dr.normalize(ahead)), active)
        return light + dr.select(active & is_lamp, found * self._share(place, chief, candidates), 0.0)

    def shadow(self, lamp: Any, chief: Any) -> tuple[Any, Any]:
        """Middle and radius of a lamp's shadow on the lens, for rays that leave it towards `chief`."""
        centre, radius = dr.gather(self.mi.Point3f, self.centres, lamp), dr.gather(self.mi.Float, self.radii, lamp)
        stretch = 1 - centre.z * self.nearness
        middle = (self.mi.Point2f(centre.x, centre.y) - chief * centre.z) / stretch
        across = dr.sqrt(1 + dr.squared_norm(chief)) + dr.norm(middle) * self.nearness
        return middle, radius * across / (dr.abs(stretch) - radius * self.nearness)

    def _meets(self, ray: Any, active: Any) -> tuple[Any, Any]:
        """Radiance of what rays meet, and whether that is one of the lamps."""
        si = self.scene.ray_intersect(ray, active)
        is_lamp = self.mi.Bool(False)
        for lamp in self.lamps:
            is_lamp |= si.shape == lamp
        return si.emitter(self.scene, active).eval(si, active), is_lamp

    def _share(self, place: Any, chief: Any, candidates: Any) -> Any:
        """p_lens / (p_lens + p_lamp) at places on the lens."""
        density = _sum_of_densities(self, place, chief) / self.mi.Float(dr.maximum(candidates, 1))
        return 1 / (1 + dr.square(self.radius) * density)


@dr.syntax  # type: ignore[untyped-decorator]
def _count(lens: Any, chief: Any) -> Any:
    """How many shadows overlap the lens."""
    lamp, found = lens.mi.UInt32(0), lens.mi.UInt32(0)
    while lamp < lens.count:
        middle, reach = lens.shadow(lamp, chief)
        found += dr.select(dr.norm(middle) < lens.radius + reach, lens.mi.UInt32(1), 0)
        lamp += 1
    return found


@dr.syntax  # type: ignore[untyped-decorator]
def _pick(lens: Any, chief: Any, rank: Any) -> Any:
    """The lamp whose shadow is the one of that rank, from 0, among those that overlap the lens; lamp 0 if none is."""
    lamp, found, picked = lens.mi.UInt32(0), lens.mi.UInt32(0), lens.mi.UInt32(0)
    while lamp < lens.count:
        middle, reach = lens.shadow(lamp, chief)
        overlaps = dr.norm(middle) < lens.radius + reach
        picked = dr.select(overlaps & (found == rank), lamp, picked)
        found += dr.select(overlaps, lens.mi.UInt32(1), 0)
        lamp += 1
    return picked


@dr.syntax  # type: ignore[untyped-decorator]
def _sum_of_densities(lens: Any, place: Any, chief: Any) -> Any:
    """pi times the sum of the densities of places drawn from each of the shadows."""
    lamp, total = lens.mi.UInt32(0), lens.mi.Float(0.0)
    while lamp < lens.count:
        middle, reach = lens.shadow(lamp, chief)
        total += dr.select(dr.norm(place - middle) < reach, 1 / dr.square(reach), 0.0)
        lamp += 1
    return total
