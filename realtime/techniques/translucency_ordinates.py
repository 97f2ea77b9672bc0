"""Translucency by transport of light: discrete ordinates on a grid of the subject, and exact single scattering.

Light that reaches a point without having been scattered is found exactly, from lists of all faces as each light sees
them. Where it is first scattered it becomes the source of light that is scattered again and again, which is smooth
and is solved on a coarse grid in a few directions (Chandrasekhar 1960, "Radiative Transfer", chapter II; Languenou,
Bouatouch, Chelle 1994, "Global Illumination in Presence of Participating Media with General Properties"). The camera's
rays gather both. Light that leaves sideways, or crosses from one part of the subject to another, comes out by itself.
"""

from __future__ import annotations

from collections.abc import Mapping

from realtime.backlight import scene_backlights
from realtime.face_lists import light_view, list_camera_faces
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.lights import light_rows
from realtime.ordinates import LEVEL_SYMMETRIC
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
from realtime.technique import Parameter, Technique
from realtime.techniques.translucency_additive import ALLOW_OPEN, PIECES
from realtime.thickness import additive_passes
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.model import Scene

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
        Pass("content", measure_content, writes=("content",), skip=dark, is_baked=True),
        Pass(
            "single scattering",
            _scatter_once,
            reads=("faces", "shaded", "content"),
            writes=("cells", "shaded"),
            skip=dark,
        ),
        Pass("ordinates", solve, reads=("cells",), writes=("fluence",), skip=dark or once),
        Pass("gather", _gather, reads=("faces", "shaded", "fluence"), writes=("shaded",), skip=dark or once),
        resolve_pass("shaded"),
    ]


def _list_camera_faces(frame: Frame) -> None:
    frame.resources["faces"] = list_camera_faces(frame, int(frame.settings["layers"]))
    shaded = frame.texture(frame.size, 4)
    frame.submit(frame.context.framebuffer([shaded]).clear)
    frame.resources["shaded"] = shaded


def _scatter_once(frame: Frame) -> None:
    cells = int(frame.settings["cells"])
    lights = scene_backlights(frame, int(frame.settings[PIECES.name]))
    content = frame.resources["content"]
    lit = frame.resources["cells"] = frame.context.buffer(reserve=content.size)
    frame.submit(frame.context.copy_buffer, lit, content)
    rows = frame.context.buffer(light_rows(lights).tobytes())
    collide = scattering_program(frame, "first_collisions", SUBCELLS=SUBCELLS)
    gather = scattering_program(frame, "gather", SINGLE=1)
    centre, radius = ball_around(frame)
    for index, light in enumerate(lights):
        seen = bind_view(frame, light_view(light, centre, radius), int(frame.settings["light_side"]))
        uniforms = seen | {"light_index": index, "centre": tuple(centre)}
        rows.bind_to_storage_buffer(3)
        lit.bind_to_storage_buffer(0)
        frame.dispatch(collide, cells**3, group=(64, 1), **uniforms, **grid_uniforms(frame), **medium_uniforms(frame))
        gather_with(frame, gather, **uniforms)


def _gather(frame: Frame) -> None:
    frame.resources["fluence"].use(0)
    gather_with(frame, scattering_program(frame, "gather", SINGLE=0))


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
