"""Translucency by transport of light: discrete ordinates on a grid of the subject, and exact single scattering.

Light that reaches a point without having been scattered is found exactly, from lists of all faces as each light sees
them. Where it is first scattered it becomes the source of light that is scattered again and again, which is smooth
and is solved on a coarse grid in a few directions (Chandrasekhar 1960, "Radiative Transfer", chapter II; Languenou,
Bouatouch, Chelle 1994, "Global Illumination in Presence of Participating Media with General Properties"). The camera's
rays gather both. Light that leaves sideways, or crosses from one part of the subject to another, comes out by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from realtime.backlight import scene_backlights, single_scattering_albedo, subject_medium
from realtime.face_lists import Faces, View, light_view, list_camera_faces, list_view_faces, parallel_view
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.lights import light_rows
from realtime.ordinates import LEVEL_SYMMETRIC, chebyshev, largest_eigenvalue, level_symmetric
from realtime.technique import Parameter, Technique
from realtime.techniques.translucency_additive import ALLOW_OPEN, PIECES
from realtime.thickness import additive_passes, centred_uniforms, subject_diagonal
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.image import Float64
from scenes.model import Scene

SUBCELLS = 4
"""Points along each edge of a cell at which its content is sampled."""

CONTENT_SIDE = 256
"""Texels along an edge of the view that measures the cells' content. It holds a ball around the subject: a column of a
compact body has a texel or more, one of a slender body a part of one, between which its faces count as planes.
"""

PARAMETERS = (
    ALLOW_OPEN,
    PIECES,
    Parameter("cells", 32, (8, 16, 24, 32), "cells along each edge of the grid of scattered light", (4, 32)),
    Parameter(
        "iterations", 16, (0, 2, 4, 8, 16, 32), "times that scattered light is scattered again", (0, 1000), off=0
    ),
    Parameter("order", 4, tuple(LEVEL_SYMMETRIC), "N of the S_N set of directions: 24, 48 or 80 of them", (4, 8)),
    Parameter("light_side", 1024, (128, 256, 512, 1024), "texels along an edge of what a light sees", (1, 4096)),
    Parameter("layers", 4, (2, 4, 8), "most layers of the subject that a ray may cross", (1, 32)),
)


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    dark = "no emitter: nothing is lit" if features.is_dark else ""
    if settings["order"] not in LEVEL_SYMMETRIC:
        raise InputError(f"Setting 'order' is {settings['order']}; allowed: {', '.join(map(str, LEVEL_SYMMETRIC))}.")
    once = "iterations = 0: light is scattered once" if settings["iterations"] == 0 else ""
    return [
        *additive_passes(bool(settings[ALLOW_OPEN.name])),
        Pass("faces", _list_camera_faces, reads=("thickness",), writes=("faces", "shaded")),
        Pass("content", _measure_content, writes=("content",), skip=dark, is_baked=True),
        Pass(
            "single scattering",
            _scatter_once,
            reads=("faces", "shaded", "content"),
            writes=("cells", "shaded"),
            skip=dark,
        ),
        Pass("ordinates", _solve, reads=("cells",), writes=("fluence",), skip=dark or once),
        Pass("gather", _gather, reads=("faces", "shaded", "fluence"), writes=("shaded",), skip=dark or once),
        resolve_pass("shaded"),
    ]


def _list_camera_faces(frame: Frame) -> None:
    frame.resources["faces"] = list_camera_faces(frame, int(frame.settings["layers"]))
    shaded = frame.texture(frame.size, 4)
    frame.submit(frame.context.framebuffer([shaded]).clear)
    frame.resources["shaded"] = shaded


def _grid(frame: Frame) -> dict[str, Any]:
    """Corner of the grid, seen from the subject's centre, and size of its cells."""
    low, high = frame.subject_box
    cells = int(frame.settings["cells"])
    size = (high - low) * (1 + 1e-4) / cells
    return {"corner": tuple(-size * cells / 2), "cell_size": tuple(size)}


def _medium(frame: Frame) -> dict[str, Any]:
    sigma_a, sigma_s = subject_medium(frame.scene)
    return {"sigma_s": tuple(sigma_s), "sigma_t": tuple(sigma_a + sigma_s)}


def _program(frame: Frame, name: str, **defines: int) -> Any:
    slots, cells = 2 * int(frame.settings["layers"]), int(frame.settings["cells"])
    return frame.program(f"translucency/{name}.comp", SLOTS=slots, CELLS=cells, **defines)


def _ball(frame: Frame) -> tuple[Float64, float]:
    """Centre and radius of a ball around the subject, with some air for what rounding moves."""
    return np.array(centred_uniforms(frame)["centre"]), 0.501 * subject_diagonal(frame)


def _bind_view(frame: Frame, view: View, side: int) -> dict[str, Any]:
    """List the faces that a view sees, bind the lists, and return the uniforms to read them with.

    The frame keeps the lists: what nobody holds is deleted.
    """
    faces = list_view_faces(frame, view, side, int(frame.settings["layers"]))
    faces.counts.bind_to_image(1)
    faces.faces.bind_to_storage_buffer(2)
    frame.resources["view_faces"] = faces
    return view.uniforms()


def _measure_content(frame: Frame) -> None:
    cells = int(frame.settings["cells"])
    content = frame.context.buffer(reserve=16 * cells**3)
    seen = _bind_view(frame, parallel_view(np.array([0.0, 0.0, 1.0]), *_ball(frame)), CONTENT_SIDE)
    content.bind_to_storage_buffer(0)
    shader = _program(frame, "content", SUBCELLS=SUBCELLS)
    frame.dispatch(shader, cells**3, group=(64, 1), **seen, **_grid(frame))
    frame.resources["content"] = content


def _scatter_once(frame: Frame) -> None:
    cells = int(frame.settings["cells"])
    lights = scene_backlights(frame, int(frame.settings[PIECES.name]))
    content = frame.resources["content"]
    lit = frame.resources["cells"] = frame.context.buffer(reserve=content.size)
    frame.submit(frame.context.copy_buffer, lit, content)
    rows = frame.context.buffer(light_rows(lights).tobytes())
    collide, gather = _program(frame, "first_collisions", SUBCELLS=SUBCELLS), _program(frame, "gather", SINGLE=1)
    centre, radius = _ball(frame)
    for index, light in enumerate(lights):
        seen = _bind_view(frame, light_view(light, centre, radius), int(frame.settings["light_side"]))
        uniforms = seen | {"light_index": index, "centre": tuple(centre)}
        rows.bind_to_storage_buffer(3)
        lit.bind_to_storage_buffer(0)
        frame.dispatch(collide, cells**3, group=(64, 1), **uniforms, **_grid(frame), **_medium(frame))
        _gather_with(frame, gather, **uniforms)


def _gather(frame: Frame) -> None:
    frame.resources["fluence"].use(0)
    _gather_with(frame, _program(frame, "gather", SINGLE=0))


def _gather_with(frame: Frame, shader: Any, **lit: Any) -> None:
    faces: Faces = frame.resources["faces"]
    frame.resources["shaded"].bind_to_image(0)
    faces.counts.bind_to_image(2)
    faces.faces.bind_to_storage_buffer(1)
    across, upward = frame.camera.matrix[:2, :3]
    width, height = frame.size
    frame.dispatch(
        shader,
        width,
        height,
        offset=centred_uniforms(frame)["offset"],
        forward=tuple(frame.camera.forward),
        right=tuple(across / (across @ across)),
        up=tuple(upward / (upward @ upward)),
        **lit,
        **_grid(frame),
        **_medium(frame),
    )


def _solve(frame: Frame) -> None:
    context, cells = frame.context, int(frame.settings["cells"])
    (sigma_a, sigma_s), medium, grid = subject_medium(frame.scene), _medium(frame), _grid(frame)
    quadrature = level_symmetric(int(frame.settings["order"]))
    optical_size = np.outer(sigma_a + sigma_s, np.array(grid["cell_size"]) * cells)
    largest = largest_eigenvalue(single_scattering_albedo(sigma_a, sigma_s), optical_size)
    damping, omegas = chebyshev(largest, int(frame.settings["iterations"]))
    now, before = (context.buffer(bytes(16 * cells**3)) for _ in range(2))
    along = context.buffer(reserve=16 * len(quadrature) * cells**3)
    directions = context.buffer(quadrature.tobytes())
    sweep, collect = _program(frame, "sweep"), _program(frame, "collect")
    for omega in omegas:
        frame.resources["cells"].bind_to_storage_buffer(0)
        now.bind_to_storage_buffer(1)
        along.bind_to_storage_buffer(2)
        directions.bind_to_storage_buffer(3)
        frame.dispatch(sweep, len(quadrature), group=(1, 1), cell_size=grid["cell_size"], **medium)
        along.bind_to_storage_buffer(0)
        before.bind_to_storage_buffer(2)
        frame.dispatch(
            collect,
            cells**3,
            group=(64, 1),
            direction_count=len(quadrature),
            damping=tuple(damping),
            omega=tuple(omega),
        )
        now, before = before, now
    fluence = context.texture3d((cells, cells, cells), 4, dtype="f4")
    frame.submit(fluence.write, now)
    fluence.filter = (context.LINEAR, context.LINEAR)
    fluence.repeat_x = fluence.repeat_y = fluence.repeat_z = False
    frame.resources["fluence"] = fluence


TECHNIQUES = {
    "translucency.ordinates": Technique(
        name="translucency.ordinates",
        approximates="transmitted_radiance",
        summary="exact single scattering, and the rest by discrete ordinates on a grid of the subject",
        source="chandrasekhar-1960",
        limits=(
            "Light that is scattered more than once is as coarse as the grid and travels in few directions, which "
            "shows where it crosses a gap; lights must be outside the ball around the subject. Nothing else "
            "hides or shades it, or reflects light to it; the sky lights nothing."
        ),
        passes=_passes,
        parameters=PARAMETERS,
        grid=4,
    )
}
