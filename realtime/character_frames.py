"""One frame as others that share what it has uploaded: from another camera, or about another part of the scene.

So every pass that draws a frame's subject from its camera can draw a scene part by part, through any point of the lens.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from realtime.camera import Camera
from realtime.frame import Frame
from realtime.graph import Pass
from scenes.checks import SettingValue
from scenes.geometry import geometry_of, heights_of
from scenes.mesh import Mesh
from scenes.model import Scene
from scenes.procedural import rotation_xyz
from scenes.shapes import Box, Relief

OF_THE_CAMERA = ("camera", "clip_planes")
OF_THE_MESHES = ("bounds", "subject_box", "boxes", "closed", *OF_THE_CAMERA)
"""What a frame derives once; another one derives it anew."""


def seen_by(frame: Frame, camera: Camera, grid: int) -> Frame:
    """The frame from another camera with that many samples along each side of a pixel.

    It begins with the resources of `frame`; what it writes is its own.
    """
    view = copy(frame)
    view.grid = grid
    view.resources = dict(frame.resources)
    view.__dict__["camera"] = camera
    return view


def about(
    frame: Frame,
    name: str,
    subject: tuple[str, ...],
    settings: Mapping[str, SettingValue],
    which: Callable[[Mesh], bool] = lambda mesh: True,
) -> Frame:
    """The frame as if these shapes were the subject, and nothing there but the meshes for which `which` holds.

    What it uploads stays from frame to frame, by its `name`; its resources begin empty.
    """

    def make() -> Frame:
        part = copy(frame)
        part.scene = frame.scene.model_copy(update={"subject": subject})
        part.meshes = tuple(replace(mesh, is_subject=mesh.shape in subject) for mesh in frame.meshes if which(mesh))
        part._made_once, part._arrays = {}, {}
        for derived in OF_THE_MESHES:
            part.__dict__.pop(derived, None)
        return part

    part = frame.once(("about", name), make)
    part.clock, part.settings, part.grid = frame.clock, settings, frame.grid
    part.resources = {}
    return part


def with_settings(frame: Frame, settings: Mapping[str, SettingValue]) -> Frame:
    """The same frame for passes that go by other settings; what they write, it has."""
    other = copy(frame)
    other.settings = settings
    return other


def without_relief(step: Callable[[Frame], None]) -> Callable[[Frame], None]:
    """A pass' work on a scene whose reliefs are flat, as high as they are on the whole."""

    def work(frame: Frame) -> None:
        flat = frame.once("flat", lambda: _flattened(frame))
        flat.clock, flat.settings, flat.resources, flat.skipped = (
            frame.clock,
            frame.settings,
            frame.resources,
            frame.skipped,
        )
        step(flat)

    return work


def _flattened(frame: Frame) -> Frame:
    flat = copy(frame)
    shapes = tuple(_flat(frame.scene, s) if isinstance(s, Relief) else s for s in frame.scene.shapes)
    flat.scene = frame.scene.model_copy(update={"shapes": shapes})
    flat.meshes = geometry_of(flat.scene)
    flat._made_once, flat._arrays = {}, {}
    for derived in OF_THE_MESHES:
        flat.__dict__.pop(derived, None)
    return flat


def _flat(scene: Scene, relief: Relief) -> Box:
    height = relief.depth * float(heights_of(scene, relief).mean())
    middle = relief.scale * (height / 2 - relief.depth) * rotation_xyz(relief.rotation_deg)[:, 2]
    return Box(
        type="box",
        name=relief.name,
        material=relief.material,
        position=tuple(np.array(relief.position) + middle),
        rotation_deg=relief.rotation_deg,
        scale=relief.scale,
        size=(*relief.size, height),
    )


def run(frame: Frame, passes: Iterable[Pass]) -> None:
    """Run the passes that nothing speaks against; what is baked stays from frame to frame."""
    for step in passes:
        if step.skip:
            continue
        if step.is_baked:
            frame.resources |= frame.once(("baked", step.name), lambda own=step: _written(frame, own))  # type: ignore[misc]
        else:
            step.run(frame)


def _written(frame: Frame, step: Pass) -> dict[str, Any]:
    step.run(frame)
    return {name: frame.resources[name] for name in step.writes if name in frame.resources}
