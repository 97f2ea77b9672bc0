"""A grid around all hair: how much of it is in each cell and which way it runs, and the skin that it grows on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realtime.fibre import table_layers
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.hair import HairSamples, Strands
from realtime.lights import directions, facets_of
from realtime.technique import Parameter
from scenes.geometry import diffuse_reflectance, texture_of
from scenes.image import Float32, Float64
from scenes.materials import Fibre, Texture
from scenes.mesh import Mesh
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl

TANGENTS = 256
"""Directions for which scattering between ordinates is baked: a cell's tangent is within 8 degrees of one."""

SKIN_POINTS = 1 << 14
"""Points that stand for each surface on which hair grows."""

SUMS = 16
"""Of whole numbers for each cell: see hair_light/sums.glsl."""

ROOM = 1 << 30
"""The most that one of them may become."""

LONGEST = 4.0
"""No hair is longer than so many times its length: a Bezier curve is shorter than the lines between its points."""

CELL_FLOATS = 24
STEPS_A_CELL = 1
"""Of rays towards a light, along the axis along which they cross most cells."""

FIBRE_UNIT = 4


TRANSMITTANCE = Parameter(
    "transmittance",
    "oriented",
    ("oriented", "area", "none"),
    "of hair on light's way. oriented: by the area that it shows to the light; area: by its area, however it lies",
    off="none",
)
HOT_SPOT = Parameter(
    "hot_spot",
    True,
    (False, True),
    "whether light's way to a hair is as free of others as the eye's way beside it must be",
    off=False,
)
CELLS = Parameter("cells", 32, (8, 16, 24, 32, 44), "cells along each edge of the grid around all hair", (4, 45))
"""A plane of 45 x 45 vec4 is what fits into the 32 KiB that a work group is promised to share."""


@dataclass(frozen=True)
class Voxels:
    """What glsl/hair_light/grid.glsl, march.glsl and rows.glsl read.

    across, between : textures of hair's area and its second moments, per unit of volume
    """

    cells: int
    bounds: moderngl.Buffer
    across: moderngl.Texture3D
    between: moderngl.Texture3D
    rows: moderngl.Buffer

    def bind(self) -> None:
        """Bind the grid, and the textures that glsl/hair_light/march.glsl reads."""
        self.bounds.bind_to_storage_buffer(4)
        self.across.use(0)
        self.between.use(1)


def fibres_pass() -> Pass:
    """Write `fibres`, the table of each hair's fibre."""
    return Pass("fibre tables", _bake_fibres, writes=("fibres",), is_baked=True)


def voxels_passes() -> list[Pass]:
    """Write `voxels`: a grid with the setting of CELLS."""
    return [
        Pass("skin under hair", _list_skin, writes=("skin_facets",), is_baked=True),
        Pass("hair voxels", _fill, reads=("strands", "hair_samples", "skin_facets"), writes=("voxels",)),
    ]


def fibre_of(scene: Scene, name: str) -> Fibre:
    """The fibre of a hair's material, which the scene was checked to have."""
    fibre = scene.materials[name]
    assert isinstance(fibre, Fibre), "hair is of fibres"
    return fibre


def thickest(scene: Scene) -> float:
    """The largest radius of a hair."""
    return max(hair.radius for hair in scene.hair)


def _bake_fibres(frame: Frame) -> None:
    layers = table_layers([fibre_of(frame.scene, hair.material) for hair in frame.scene.hair])
    count, height, width, _ = layers.shape
    made = frame.context.texture_array((width, height, count), 4, layers.tobytes(), dtype="f4")
    made.filter = (frame.context.LINEAR, frame.context.LINEAR)
    made.repeat_x = made.repeat_y = False
    frame.resources["fibres"] = made


def march_defines(frame: Frame) -> dict[str, int]:
    """What glsl/hair_light/light.glsl needs defined, by the setting of TRANSMITTANCE."""
    chosen = frame.settings[TRANSMITTANCE.name]
    return {
        "SHADOWED": int(chosen != "none"),
        "ORIENTED": int(chosen == "oriented"),
        "JOINT": int(bool(frame.settings[HOT_SPOT.name])),
        "STEPS_A_CELL": STEPS_A_CELL,
    }


def _list_skin(frame: Frame) -> None:
    grown_on = {hair.on for hair in frame.scene.hair}
    rows = [_facet_rows(frame.scene, mesh) for mesh in frame.meshes if mesh.shape in grown_on]
    facets = np.concatenate(rows)
    frame.resources["skin_facets"] = frame.context.buffer(facets.tobytes()), len(facets), float(facets[:, 1, 3].sum())


def _facet_rows(scene: Scene, mesh: Mesh) -> Float32:
    facets = facets_of(mesh.surface, SKIN_POINTS)
    rows = np.zeros((SKIN_POINTS, 3, 4), dtype=np.float32)
    rows[:, 0, :3], rows[:, 1, :3], rows[:, 1, 3] = facets.places, facets.normals, facets.area
    reflectance = diffuse_reflectance(mesh.material)
    if isinstance(reflectance, Texture):
        texels = texture_of(scene, reflectance)[::-1]
        height, width, _ = texels.shape
        column, row = (np.floor(facets.uvs % 1 * (width, height)).astype(int) % (width, height)).T
        rows[:, 2, :3] = texels[row, column]
    else:
        rows[:, 2, :3] = reflectance
    return rows


def _most_area(frame: Frame) -> float:
    """No less than the area, diameter times length, of all hair."""
    strands: Strands = frame.resources["strands"]
    return strands.count * max(2 * hair.radius * LONGEST * hair.length for hair in frame.scene.hair)


def _fill(frame: Frame) -> None:
    context, cells = frame.context, int(frame.settings[CELLS.name])
    samples: HairSamples = frame.resources["hair_samples"]
    strands: Strands = frame.resources["strands"]
    facets, facet_count, skin_area = frame.resources["skin_facets"]
    volume = cells**3
    sums, systems, voxels = frame.once(("hair voxels", cells), lambda: _room(frame, cells))
    for cleared in (sums, systems):
        frame.submit(cleared.clear)
    frame.submit(voxels.bounds.write, np.array([0xFFFFFFFF] * 3 + [0] * 3, dtype=np.uint32).tobytes())
    samples.bind()
    strands.bind()
    voxels.bounds.bind_to_storage_buffer(4)
    sums.bind_to_storage_buffer(0)
    systems.bind_to_storage_buffer(1)
    count = strands.count * samples.per_hair
    hair_scale, skin_scale = ROOM / _most_area(frame), ROOM / skin_area
    frame.dispatch(frame.program("hair_light/bounds.comp", CELLS=cells), count, group=(64, 1), count=count)
    frame.dispatch(
        frame.program("hair_light/deposit.comp", CELLS=cells),
        count,
        group=(64, 1),
        count=count,
        per_hair=samples.per_hair,
        area_scale=hair_scale,
    )
    facets.bind_to_storage_buffer(1)
    frame.dispatch(
        frame.program("hair_light/deposit_skin.comp", CELLS=cells),
        facet_count,
        group=(64, 1),
        count=facet_count,
        area_scale=skin_scale,
    )
    tangents = frame.once("hair tangents", lambda: context.buffer(_padded(directions(TANGENTS)).tobytes()))
    systems.bind_to_storage_buffer(1)
    tangents.bind_to_storage_buffer(2)
    voxels.rows.bind_to_storage_buffer(6)
    voxels.across.bind_to_image(0, read=False, write=True)
    voxels.between.bind_to_image(1, read=False, write=True)
    frame.dispatch(
        frame.program("hair_light/cells.comp", CELLS=cells, TANGENTS=TANGENTS),
        volume,
        group=(64, 1),
        hair_scale=hair_scale,
        skin_scale=skin_scale,
        radius=thickest(frame.scene),
    )
    frame.resources["voxels"] = voxels


def _room(frame: Frame, cells: int) -> tuple[moderngl.Buffer, moderngl.Buffer, Voxels]:
    """Sums and which hair for each cell, and what is made of them: the same in each frame."""
    make, volume = frame.context.buffer, cells**3
    across, between = (_volume(frame, cells) for _ in range(2))
    voxels = Voxels(cells, make(reserve=24), across, between, make(reserve=4 * CELL_FLOATS * volume))
    return make(reserve=4 * SUMS * volume), make(reserve=4 * volume), voxels


def _padded(vectors: Float64) -> Float32:
    rows = np.zeros((len(vectors), 4), dtype=np.float32)
    rows[:, :3] = vectors
    return rows


def _volume(frame: Frame, cells: int) -> moderngl.Texture3D:
    made = frame.context.texture3d((cells, cells, cells), 4, dtype="f4")
    made.filter = (frame.context.LINEAR, frame.context.LINEAR)
    made.repeat_x = made.repeat_y = made.repeat_z = False
    return made
