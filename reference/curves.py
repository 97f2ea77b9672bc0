"""Hair in Mitsuba: a stage that has the scene's hair as curves beside its meshes.

Mitsuba 3.9 finds the segment of a hit a second time, for the derivatives there, from a coordinate along all segments of
a shape that is rounded to float32. At the very tip of the last curve that is a segment too many: it reads beyond its
arrays, at an address that is anything, and crashes now and then (Dr.Jit's debug mode says "out-of-bounds read from
position N in an array of size N"). So every shape ends with a speck inside its last hair, which no ray from outside
meets unless it misses the hair itself: with hair longer than 3000 radii some do. Elsewhere a hit so close to a tip gets
the derivatives of the next curve's root; with few curves a shape, such hits are few.
"""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numpy as np

from reference.plain import Plain, rgb
from reference.stage import Stage
from reference.start import mitsuba
from reference.strands import Strands, strands_of
from reference.to_mitsuba import instantiate, scene_dict
from scenes.errors import SceneError
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.materials import Fibre
from scenes.mesh import Mesh
from scenes.model import Scene
from scenes.topology import Integers

TO_BSPLINE = np.array([[6.0, -7.0, 2.0, 0.0], [0.0, 2.0, -1.0, 0.0], [0.0, -1.0, 2.0, 0.0], [0.0, 2.0, -7.0, 6.0]])
"""Control points of the uniform cubic B-spline segment that is a given cubic Bezier curve, ends included.

The inverse of: p0 = (b0 + 4 b1 + b2) / 6, p1 = (2 b1 + b2) / 3, p2 = (b1 + 2 b2) / 3, p3 = (b1 + 4 b2 + b3) / 6.
"""

HAIRS_A_SHAPE = 2048
"""So that hits within 1e-4 of a hair's length from its tip are those with the wrong derivatives."""

SPECK = 1e-3
"""The size of the speck at the end of a shape, as part of its last hair: so short a piece is straight."""

StageType = TypeVar("StageType", bound=Stage)


def for_the_latest_scene(make: Callable[[Scene], StageType]) -> Callable[[Scene], StageType]:
    """`make`, with its stage kept until another scene is asked for: a process renders many launches of one."""
    kept: list[StageType] = []

    @wraps(make)
    def stage(scene: Scene) -> StageType:
        if not kept or kept[0].description != scene:
            kept[:] = [make(scene)]
        return kept[0]

    return stage


@dataclass(frozen=True)
class HairStage(Stage):
    """A stage whose subject is the scene's hair.

    colors : the factors (N + 1, 3) of the hairs of each of its shapes, the last hair's again for the speck in it
    """

    colors: tuple[Float64, ...]

    def color_seen(self, ray: Any) -> Any:
        """The factor of the hair that each ray meets first."""
        import drjit as dr

        mi = self.mi
        factor = mi.Color3f(1.0)
        if all((color == 1).all() for color in self.colors):
            return factor
        si = self.scene.ray_intersect(ray)
        for shape, color in zip(self.subject, self.colors, strict=True):
            own = si.is_valid() & (si.shape == mi.ShapePtr(shape))
            factor[own] = dr.gather(mi.Color3f, mi.Float(color.ravel().astype(np.float32)), si.prim_index, own)
        return factor


@for_the_latest_scene
def stage_with_hair(scene: Scene) -> HairStage:
    """The stage of a scene; see `hair_stage`."""
    return hair_stage(mitsuba(), scene, geometry_of(scene))


def hair_stage(mi: ModuleType, scene: Scene, meshes: tuple[Mesh, ...]) -> HairStage:
    """The scene with its hair in Mitsuba.

    Raises
    ------
    SceneError
        A shape's chart cannot hold hair, or hair is not of a fibre.
    """
    strands = strands_of(scene)
    own = tufts(strands)
    with tempfile.TemporaryDirectory() as folder:
        loaded = instantiate(mi, scene_dict(scene, meshes) | curve_dicts(scene, strands, Path(folder)))
    shapes = {shape.id(): shape for shape in loaded.shapes()}
    return HairStage(
        mi,
        scene,
        loaded,
        loaded.sensors()[0],
        tuple(shapes[name] for name in own),
        scene.sensor.width,
        scene.sensor.height,
        tuple(strands.color[[*rows, rows[-1]]] for rows in own.values()),
    )


def tufts(strands: Strands) -> dict[str, Integers]:
    """The hairs of each shape by its name: a few, and all of one material."""
    each = [
        part
        for rows in (np.flatnonzero(strands.system == system) for system in np.unique(strands.system))
        for part in np.array_split(rows, -(-len(rows) // HAIRS_A_SHAPE))
    ]
    return {f"hair_{i}": rows for i, rows in enumerate(each)}


def curve_dicts(scene: Scene, strands: Strands, folder: Path) -> dict[str, Plain]:
    """Plain data of the shapes of a scene's hair, by the names of `tufts`, with their curves in files in `folder`.

    Raises
    ------
    SceneError
        Hair is not of a fibre.
    """
    dicts: dict[str, Plain] = {}
    for name, rows in tufts(strands).items():
        path = folder / f"{name}.txt"
        path.write_text(curve_text(strands.points[rows], strands.radius[rows]), encoding="ascii")
        bsdf = fibre_dict(_fibre(scene, strands.system[rows[0]]))
        dicts[name] = {"type": "bsplinecurve", "filename": str(path), "bsdf": bsdf}
    return dicts


def _fibre(scene: Scene, system: int) -> Fibre:
    name = scene.hair[system].material
    material = scene.materials.get(name)
    if not isinstance(material, Fibre):
        raise SceneError(f'hair "{scene.hair[system].name}": the material "{name}" is not a fibre.')
    return material


def curve_text(points: Float64, radius: Float64) -> str:
    """Bezier curves (N, 4, 3) as the text file of B-splines that Mitsuba reads, in digits enough for float32.

    One more follows, the speck: a piece from the middle of the last hair, on its axis, so that the hair is around it
    however much it bends.
    """
    middle, tangent = np.array([[1, 3, 3, 1], [-6, -6, 6, 6]]) / 8 @ points[-1]
    speck = middle + SPECK * np.linspace(-0.5, 0.5, 4)[:, None] * tangent
    curves = TO_BSPLINE @ np.concatenate([points, speck[None]])
    widths = np.append(radius, SPECK * radius[-1])
    splines = np.concatenate([curves, np.broadcast_to(widths[:, None, None], (len(curves), 4, 1))], axis=2)
    return "\n\n".join("\n".join(" ".join(f"{x:.9g}" for x in point) for point in curve) for curve in splines) + "\n"


def fibre_dict(fibre: Fibre) -> Plain:
    """What a hair is made of, in air of index 1."""
    return {
        "type": "hair",
        "int_ior": fibre.ior,
        "ext_ior": 1.0,
        "longitudinal_roughness": fibre.beta_m,
        "azimuthal_roughness": fibre.beta_n,
        "scale_tilt": fibre.tilt_deg,
        "sigma_a": rgb(fibre.sigma_a),
    }
