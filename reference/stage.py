"""A scene loaded into Mitsuba, and the rays that start at its sensor."""

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.to_mitsuba import instantiate, scene_dict
from scenes.mesh import Mesh
from scenes.model import Scene


@dataclass(frozen=True)
class Stage:
    """Mitsuba's scene and sensor. `description` is the scene as data, `subject` are the shapes that are judged."""

    mi: ModuleType
    description: Scene
    scene: Any
    sensor: Any
    subject: tuple[Any, ...]
    width: int
    height: int

    def is_subject(self, shape: Any, active: Any) -> Any:
        """Which of the shapes that rays have hit belong to the subject."""
        found = self.mi.Bool(False)
        for own in self.subject:
            found |= shape == self.mi.ShapePtr(own)
        return found & active

    def rays(self, x: Any, y: Any, lens: Any = None) -> Any:
        """Camera rays through film positions in pixels (0, 0 is the upper left corner of the image).

        lens : places on the lens as points of the unit square; the lens' centre, a pinhole, if not given
        """
        position = self.mi.Point2f(x / self.width, y / self.height)
        place = self.mi.Point2f(0.5) if lens is None else lens
        ray, _ = self.sensor.sample_ray_differential(0.0, 0.5, position, place)
        return ray


def build_stage(mi: ModuleType, scene: Scene, meshes: tuple[Mesh, ...]) -> Stage:
    """Load a scene."""
    loaded = instantiate(mi, scene_dict(scene, meshes))
    shapes = {shape.id(): shape for shape in loaded.shapes()}
    subject = tuple(shapes[f"mesh_{i}"] for i, mesh in enumerate(meshes) if mesh.is_subject)
    return Stage(mi, scene, loaded, loaded.sensors()[0], subject, scene.sensor.width, scene.sensor.height)


def pixel_grid(width: int, rows: range, side: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Film positions of a regular `side` x `side` grid in each pixel of some rows.

    Returns x and y, each (rows * width * side²,), pixel after pixel.
    """
    offsets = (np.arange(side) + 0.5) / side
    y, x, v, u = np.meshgrid(np.asarray(rows), np.arange(width), offsets, offsets, indexing="ij")
    return (x + u).astype(np.float32).ravel(), (y + v).astype(np.float32).ravel()
