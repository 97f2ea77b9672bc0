"""What the parts of a scene are drawn as: each by the setting of its effect."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from realtime.frame import Frame
from scenes.checks import SettingValue
from scenes.materials import Layered, Principled, Translucent
from scenes.mesh import Interface, Mesh
from scenes.model import Scene
from scenes.shapes import Eye, Relief

DIFFUSE, EMITTER, PLAIN, FIRST_COAT, FIRST_PART = 1.0, 2.0, 3.0, 4.0, 1000.0
"""Kinds of surfaces; plain ones are as if they were Lambertian with what they reflect on the whole. Layered materials,
and shapes that are drawn by techniques of their own, count on from the last two.
"""

KINDS: dict[str, float] = {"DIFFUSE": DIFFUSE, "EMITTER": EMITTER, "PLAIN": PLAIN, "FIRST_COAT": FIRST_COAT}
"""What shaders that tell kinds apart are compiled with."""

ACCURATE, TALK, OFF = "accurate", "talk", "off"


def part_kind(scene: Scene, name: str) -> float:
    """The kind of the surfaces of a shape that is drawn by a technique of its own."""
    return FIRST_PART + [shape.name for shape in scene.shapes].index(name)


def coats_of(meshes: Iterable[Mesh]) -> list[Layered | Principled]:
    """The layered materials of a scene, each once."""
    return list(dict.fromkeys(m.material for m in meshes if isinstance(m.material, Layered | Principled)))


def is_solid(mesh: Mesh, settings: Mapping[str, SettingValue]) -> bool:
    """Whether a mesh is drawn as a surface that hides what is behind it. A cornea is, with what shows in it."""
    return not isinstance(mesh.material, Translucent) or settings["translucency"] != ACCURATE


def receives(mesh: Mesh, settings: Mapping[str, SettingValue]) -> bool:
    """Whether a mesh shows the light from all around that its vertices receive."""
    return mesh.radiance is None and not isinstance(mesh.material, Interface) and is_solid(mesh, settings)


def kind_of(frame: Frame, mesh: Mesh) -> float:
    """What kind of surface a mesh is, by the settings of its effect."""
    settings, shape = frame.settings, next((s for s in frame.scene.shapes if s.name == mesh.shape), None)
    if mesh.radiance is not None:
        return EMITTER
    is_coated = isinstance(mesh.material, Layered | Principled)
    for setting, is_one in (
        ("eyes", isinstance(shape, Eye)),
        ("translucency", isinstance(mesh.material, Translucent)),
        ("suit", is_coated),
    ):
        if is_one and settings[setting] == OFF:
            return PLAIN
        if is_one and (settings[setting] == TALK or setting == "eyes"):
            return part_kind(frame.scene, mesh.shape)
    if isinstance(shape, Relief) and settings["relief"] == TALK:
        return part_kind(frame.scene, mesh.shape)
    coats = coats_of(frame.meshes)
    return FIRST_COAT + coats.index(mesh.material) if mesh.material in coats else DIFFUSE
