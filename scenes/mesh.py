"""A triangle mesh as arrays, ready for either renderer."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.image import Float32
from scenes.materials import Material, Texture
from scenes.units import Rgb


@dataclass(frozen=True)
class Surface:
    """Triangles in world space.

    positions : (V, 3) float32, in the scene's unit of length
    normals   : (V, 3) float32, unit length, on the side from which the counter-clockwise faces are seen
    uvs       : (V, 2) float32, v upward: (0, 0) is the lower left corner of a texture
    faces     : (F, 3) uint32
    """

    positions: Float32
    normals: Float32
    uvs: Float32
    faces: NDArray[np.uint32]


@dataclass(frozen=True)
class Interface:
    """A smooth surface of something clear with the refractive index `ior`: the cornea of an eye."""

    ior: float


@dataclass(frozen=True)
class Mesh:
    """A surface placed in a scene: which shape it came from, what it is made of, what it emits.

    A `pattern` over (u, v) scales the radiance that the front side emits.
    """

    name: str
    shape: str
    surface: Surface
    material: Material | Interface
    radiance: Rgb | None
    is_subject: bool
    pattern: Texture | None = None
