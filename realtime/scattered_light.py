"""Light inside a translucent subject: what each light brings into the cells of a grid, and what scattering makes of it.

The steps of realtime/techniques/translucency_ordinates.py, by the settings `cells`, `iterations`, `order`, `light_side`
and `layers`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from realtime.backlight import single_scattering_albedo, subject_medium
from realtime.camera import ray_axes
from realtime.face_lists import Faces, View, list_view_faces, parallel_view
from realtime.frame import Frame
from realtime.ordinates import chebyshev, largest_eigenvalue, level_symmetric
from realtime.thickness import centred_uniforms, subject_diagonal
from scenes.image import Float64

SUBCELLS = 4
"""Points along each edge of a cell at which its content is sampled."""

CONTENT_SIDE = 256
"""Texels along an edge of the view that measures the cells' content. It holds a ball around the subject: a column of a
compact body has a texel or more, one of a slender body a part of one, between which its faces count as planes.
"""


def grid_uniforms(frame: Frame) -> dict[str, Any]:
    """Corner of the grid, seen from the subject's centre, and size of its cells."""
    low, high = frame.subject_box
    cells = int(frame.settings["cells"])
    size = (high - low) * (1 + 1e-4) / cells
    return {"corner": tuple(-size * cells / 2), "cell_size": tuple(size)}


def medium_uniforms(frame: Frame) -> dict[str, Any]:
    """What the subject is filled with."""
    sigma_a, sigma_s = subject_medium(frame.scene)
    return {"sigma_s": tuple(sigma_s), "sigma_t": tuple(sigma_a + sigma_s)}


def scattering_program(frame: Frame, name: str, **defines: int) -> Any:
    """A shader of glsl/translucency, for lists and a grid of the settings' size."""
    slots, cells = 2 * int(frame.settings["layers"]), int(frame.settings["cells"])
    return frame.program(f"translucency/{name}.comp", SLOTS=slots, CELLS=cells, **defines)


def ball_around(frame: Frame) -> tuple[Float64, float]:
    """Centre and radius of a ball around the subject, with some air for what rounding moves."""
    return np.array(centred_uniforms(frame)["centre"]), 0.501 * subject_diagonal(frame)


def bind_view(frame: Frame, view: View, side: int) -> dict[str, Any]:
    """List the faces that a view sees, bind the lists, and return the uniforms to read them with.

    The frame keeps the lists: what nobody holds is deleted.
    """
    faces = list_view_faces(frame, view, side, int(frame.settings["layers"]))
    faces.counts.bind_to_image(1)
    faces.faces.bind_to_storage_buffer(2)
    frame.resources["view_faces"] = faces
    return view.uniforms()


def measure_content(frame: Frame) -> None:
    """Write `content`: of each cell the part that is inside the subject."""
    cells = int(frame.settings["cells"])
    content = frame.context.buffer(reserve=16 * cells**3)
    seen = bind_view(frame, parallel_view(np.array([0.0, 0.0, 1.0]), *ball_around(frame)), CONTENT_SIDE)
    content.bind_to_storage_buffer(0)
    shader = scattering_program(frame, "content", SUBCELLS=SUBCELLS)
    frame.dispatch(shader, cells**3, group=(64, 1), **seen, **grid_uniforms(frame))
    frame.resources["content"] = content


def gather_with(frame: Frame, shader: Any, **lit: Any) -> None:
    """Add to `shaded` what is scattered towards the camera along each sample's `faces`."""
    faces: Faces = frame.resources["faces"]
    frame.resources["shaded"].bind_to_image(0)
    faces.counts.bind_to_image(2)
    faces.faces.bind_to_storage_buffer(1)
    forward, right, up = ray_axes(frame.camera)
    width, height = frame.size
    frame.dispatch(
        shader,
        width,
        height,
        offset=centred_uniforms(frame)["offset"],
        forward=tuple(forward),
        right=tuple(right),
        up=tuple(up),
        **lit,
        **grid_uniforms(frame),
        **medium_uniforms(frame),
    )


def solve(frame: Frame) -> None:
    """Write `fluence`, a 3D texture, of light whose first collisions are in `cells`; and what is in it as a buffer."""
    context, cells = frame.context, int(frame.settings["cells"])
    (sigma_a, sigma_s), medium, grid = subject_medium(frame.scene), medium_uniforms(frame), grid_uniforms(frame)
    quadrature = level_symmetric(int(frame.settings["order"]))
    optical_size = np.outer(sigma_a + sigma_s, np.array(grid["cell_size"]) * cells)
    largest = largest_eigenvalue(single_scattering_albedo(sigma_a, sigma_s), optical_size)
    damping, omegas = chebyshev(largest, int(frame.settings["iterations"]))
    now, before, along, directions = frame.once(
        ("scattered light", cells, len(quadrature)),
        lambda: (
            *(context.buffer(reserve=16 * count * cells**3) for count in (1, 1, len(quadrature))),
            context.buffer(quadrature.tobytes()),
        ),
    )
    for cleared in (now, before):
        frame.submit(cleared.clear)
    sweep, collect = scattering_program(frame, "sweep"), scattering_program(frame, "collect")
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
    frame.resources |= {"fluence": fluence, "fluence_cells": now}
