"""Translucent bodies of a scene in which other things stand: lit by lamps, and by all that is around them.

Lamps light a body as in realtime/techniques/translucency_ordinates.py. All other light, of the sky and of what
reflects, comes from a few directions, from each with the radiance that arrives there at the body; where it is not
scattered yet it is as coarse as the grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.character_around import light_around
from realtime.character_frames import about, seen_by
from realtime.face_lists import Faces, light_view, list_camera_faces
from realtime.frame import Frame
from realtime.lights import Light, light_rows, lights_of
from realtime.ordinates import level_symmetric
from realtime.scattered_light import (
    SUBCELLS,
    ball_around,
    bind_view,
    gather_with,
    grid_uniforms,
    measure_content,
    medium_uniforms,
    scattering_program,
    solve,
)
from scenes.materials import Translucent
from scenes.mesh import Mesh

if TYPE_CHECKING:
    import moderngl


AROUND = level_symmetric(4).astype(np.float64)
"""Directions from which light comes that is not a lamp's."""


@dataclass(frozen=True)
class LitBody:
    """A body with the light in it: `part` is the frame as if it were the subject, with its `fluence`.

    lamps : the lights as rows for shaders; what each sees of the body, and the uniforms of that view
    """

    part: Frame
    rows: moderngl.Buffer
    lamps: tuple[tuple[Faces, dict[str, Any]], ...]


def bodies_of(frame: Frame) -> list[Mesh]:
    """The translucent meshes of the scene."""
    return [mesh for mesh in frame.meshes if isinstance(mesh.material, Translucent)]


def _part(frame: Frame, body: Mesh) -> Frame:
    settings = {name: frame.settings[name] for name in ("cells", "iterations", "order", "light_side", "layers")}
    return about(frame, body.name, (body.shape,), settings, lambda mesh: mesh.name == body.name)


def measure_bodies(frame: Frame) -> None:
    """Write `contents`, what part of each cell of its grid each body fills."""
    contents = {}
    for body in bodies_of(frame):
        part = _part(frame, body)
        measure_content(part)
        contents[body.name] = part.resources["content"]
    frame.resources["contents"] = contents


def light_bodies(frame: Frame) -> None:
    """Write `bodies`, a `LitBody` each."""
    frame.resources["bodies"] = [_lit(frame, body) for body in bodies_of(frame)]


def _lit(frame: Frame, body: Mesh) -> LitBody:
    part, count = _part(frame, body), int(frame.settings["pieces"])
    content: moderngl.Buffer = frame.resources["contents"][body.name]
    lamps = frame.once(("lamps", count), lambda: lights_of(frame.scene, frame.meshes, count))
    cells, rows, seen = _collide(part, content, lamps)
    evenly = _collide(part, content, light_around(frame, body, AROUND))[0] if "radiosity" in frame.resources else None
    if evenly is not None:
        _add_evenly(part, evenly, cells)
    part.resources["cells"] = cells
    solve(part)
    if evenly is not None:
        within = part.resources["fluence_cells"]
        _add_evenly(part, evenly, within, FLUENCE=1)
        part.submit(part.resources["fluence"].write, within)
    return LitBody(part, rows, seen)


def _collide(
    part: Frame, start: moderngl.Buffer, lights: list[Light]
) -> tuple[moderngl.Buffer, moderngl.Buffer, tuple[tuple[Faces, dict[str, Any]], ...]]:
    """Where lights are scattered for the first time, added to `start`; the lights as rows, and what each sees."""
    cells = int(part.settings["cells"])
    lit = part.context.buffer(reserve=start.size)
    part.submit(part.context.copy_buffer, lit, start)
    rows = part.context.buffer(light_rows(lights).tobytes())
    collide = scattering_program(part, "first_collisions", SUBCELLS=SUBCELLS)
    centre, radius = ball_around(part)
    views = []
    for index, light in enumerate(lights):
        seen = bind_view(part, light_view(light, centre, radius), int(part.settings["light_side"]))
        uniforms = seen | {"light_index": index, "centre": tuple(centre)}
        rows.bind_to_storage_buffer(3)
        lit.bind_to_storage_buffer(0)
        part.dispatch(collide, cells**3, group=(64, 1), **uniforms, **grid_uniforms(part), **medium_uniforms(part))
        views.append((part.resources["view_faces"], uniforms))
    return lit, rows, tuple(views)


def _add_evenly(part: Frame, evenly: moderngl.Buffer, to: moderngl.Buffer, **defines: int) -> None:
    count = int(part.settings["cells"]) ** 3
    evenly.bind_to_storage_buffer(0)
    to.bind_to_storage_buffer(1)
    sigma_s = medium_uniforms(part)["sigma_s"]
    part.dispatch(
        part.program("character/even_light.comp", **defines), count, group=(64, 1), count=count, sigma_s=sigma_s
    )


def put_bodies(view: Frame) -> None:
    """Put the bodies over `shaded`, as the camera of `view` sees them and what lies behind and in them.

    The farthest is put first, by its middle: of two that reach around each other one is all in front.
    """
    eye = np.array(view.camera.eye)
    for body in sorted(view.resources["bodies"], key=lambda body: -float(np.linalg.norm(body.part.bounds[0] - eye))):
        _put(view, body)


def _put(view: Frame, body: LitBody) -> None:
    part = seen_by(body.part, view.camera, view.grid)
    context, size = view.context, view.size
    shaded, passed = part.texture(size, 4), part.texture(size, 4)
    part.submit(context.framebuffer([shaded]).clear)
    part.submit(context.framebuffer([passed]).clear, 1.0, 1.0, 1.0, 1.0)
    part.resources |= {"shaded": shaded, "faces": list_camera_faces(part, int(part.settings["layers"]))}
    view.resources["position"].use(4)
    cut = {"eye": tuple(view.camera.eye)}
    single = scattering_program(part, "gather", SINGLE=1, CUT=1)
    for faces, uniforms in body.lamps:
        passed.bind_to_image(3)
        faces.counts.bind_to_image(1)
        faces.faces.bind_to_storage_buffer(2)
        body.rows.bind_to_storage_buffer(3)
        gather_with(part, single, **cut, **uniforms)
    part.resources["fluence"].use(0)
    passed.bind_to_image(3)
    gather_with(part, scattering_program(part, "gather", SINGLE=0, CUT=1), **cut)
    shaded.use(0)
    passed.use(1)
    view.resources["shaded"].bind_to_image(0)
    view.dispatch(view.program("character/body.comp"), *size)
