"""Eyes among other things: each drawn by the passes of `cornea.anatomical`, under the light that reaches it there.

Lamps count by the part of them that the eye sees on the whole. What it mirrors, and what lights it evenly, is what
arrives at its cornea from all directions, as an image of its own; lamps are mirrored as the disks that they look like.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realtime.capture import bind_lights
from realtime.character_around import arriving
from realtime.character_frames import about, run, seen_by
from realtime.character_light import place_rows
from realtime.character_parts import part_kind
from realtime.eye import lights_in_eye_frame, to_eye_frame
from realtime.frame import Frame
from realtime.lights import Light, light_rows
from realtime.sky import sky_directions
from realtime.techniques.cornea_anatomical import returned_passes, shade_eye
from scenes.image import Float32
from scenes.model import DiskLight, SphereLight
from scenes.procedural import rotation_xyz
from scenes.shapes import Eye

if TYPE_CHECKING:
    import moderngl

SKY_SIZE = (32, 17)
"""Directions from which light is gathered: columns and rows of an image as glsl/lib/sky.glsl reads it."""

PLACES = 12
"""Places on a cornea at which light is looked for."""


@dataclass(frozen=True)
class LitEye:
    """An eye with its light: `part` is the frame as if it were the subject. `disks` are the lamps that it mirrors."""

    part: Frame
    kind: float
    disks: Float32


def light_eyes(frame: Frame) -> None:
    """Write `eyes`, a `LitEye` each."""
    frame.resources["eyes"] = [_lit(frame, eye) for eye in frame.scene.shapes if isinstance(eye, Eye)]


def _lit(frame: Frame, eye: Eye) -> LitEye:
    names = ("keratometric_index", "caustics", "interreflection", "bend_steps", "sky_rays")
    settings = {name: frame.settings[name] for name in names}
    part = about(frame, eye.name, (eye.name,), settings, lambda mesh: mesh.shape == eye.name)
    cornea = next(mesh.surface for mesh in part.meshes if mesh.name == f"{eye.name}/cornea")
    chosen = np.linspace(0, len(cornea.positions) - 1, PLACES).astype(int)
    places = cornea.positions[chosen], cornea.normals[chosen]
    lights: list[Light] = frame.resources["lights"]
    shares = _weigh(frame, eye, lights, *places)
    part.resources["eye_lights"] = shares, len(lights)
    if "radiosity" in frame.resources:
        part.resources["sky"] = _surroundings(frame, eye, *places)
    run(part, returned_passes(settings))
    return LitEye(part, part_kind(frame.scene, eye.name), _disks(frame, eye, shares))


def _weigh(frame: Frame, eye: Eye, lights: list[Light], positions: Float32, normals: Float32) -> moderngl.Buffer:
    """The lights in the eye's frame, each as strong as the part of it that the eye sees."""
    rows = light_rows(lights_in_eye_frame(eye, lights))
    weighed = frame.context.buffer(rows.tobytes())
    if lights:
        places = place_rows(positions, normals)
        held = frame.context.buffer(places.tobytes())
        weighed.bind_to_storage_buffer(0)
        held.bind_to_storage_buffer(2)
        shader = frame.program("character/eye_lights.comp")
        frame.dispatch(shader, len(lights), group=(64, 1), place_count=len(places), **bind_lights(frame))
    return weighed


def _surroundings(frame: Frame, eye: Eye, positions: Float32, normals: Float32) -> moderngl.Texture:
    width, height = SKY_SIZE
    found = arriving(frame, eye.name, positions, normals, sky_directions(height, width)[0])
    made: moderngl.Texture = frame.context.texture(SKY_SIZE, 4, dtype="f4")
    frame.submit(made.write, found)
    made.filter = (frame.context.LINEAR, frame.context.LINEAR)
    made.repeat_x, made.repeat_y = True, False
    return made


def _disks(frame: Frame, eye: Eye, weighed: moderngl.Buffer) -> Float32:
    """Ball and disk lights as the disks (N, 3, 4) that the eye mirrors, each as bright as the eye sees it."""
    lights: list[Light] = frame.resources["lights"]
    rows = np.frombuffer(weighed.read(), dtype=np.float32).reshape(-1, 3, 4)
    disks = []
    for source, light in enumerate(frame.scene.emitters):
        if not isinstance(light, SphereLight | DiskLight):
            continue
        own = [i for i, each in enumerate(lights) if each.emitter == f"emitter-{source}"]
        full = sum(lights[i].strength.sum() for i in own)
        share = float(rows[own, 2, :3].sum()) / full if full > 0 else 0.0
        centre = to_eye_frame(eye, np.array(light.position))
        normal = -centre if isinstance(light, SphereLight) else np.array(light.normal) @ rotation_xyz(eye.rotation_deg)
        disks.append(
            [[*centre, light.radius], [*normal / np.linalg.norm(normal), 0.0], [*(share * np.array(light.radiance)), 0]]
        )
    return np.array(disks, dtype=np.float32).reshape(-1, 3, 4)


def shade_eyes(view: Frame) -> None:
    """Draw the eyes into `shaded`, where the camera of `view` sees them."""
    for eye in view.resources["eyes"]:
        part = seen_by(eye.part, view.camera, view.grid)
        view.resources["around"].use(3)
        shade_eye(part, view.resources["shaded"], eye.disks, WHOLE_EYE=1, AMONG=int(eye.kind))
