"""Translucency by the exact thickness, and what a slab so thick would let through.

One pass sums the distances of back faces less those of front faces, which is right for concave subjects too, whatever
the order of drawing. The colour comes from tables of a slab's transmission and reflection, solved by adding-doubling.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from realtime.backlight import scene_backlights, subject_medium
from realtime.camera import Camera
from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.lights import light_rows
from realtime.shader import set_uniforms
from realtime.slab import PER_OCTAVE, slab_table
from realtime.technique import Parameter, Technique
from realtime.thickness import additive_passes, centred_uniforms, draw_faces, is_subject, subject_diagonal
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.image import Float32
from scenes.model import PIXEL_GRID, Scene

if TYPE_CHECKING:
    import moderngl

PADDING = 3.0
"""How much wider and higher than the frame the mask is that coverage is read from."""

TAPS = 96
"""Places at which coverage is read: more move a pixel by a few per cent, and the error of an image by less than .01."""

DIFFUSE_COSINE = 0.5
"""One beam at 60 degrees stands for diffuse light: it has the mean path of diffuse light through a thin layer."""

ALLOW_OPEN = Parameter("allow_open", False, (False, True), "whether faces that do not pair up are accepted")
PIECES = Parameter("pieces", 16, (4, 16, 64), "small lights that stand for each emitting surface or line", (1, 4096))
SPREAD = Parameter(
    "spread", 0.7, (0.0, 0.35, 0.7, 1.0), "standard deviation of the coverage blur, in thicknesses", (0, 10), off=0.0
)


def _thickness_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [*additive_passes(bool(settings[ALLOW_OPEN.name])), resolve_pass("thickness")]


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    one_layer = "the subject is convex: a ray enters it once" if features.subject_is_convex else ""
    return [
        gbuffer_pass(),
        *additive_passes(bool(settings[ALLOW_OPEN.name])),
        Pass("nearest layer", _draw_first_back, writes=("first_back",), skip=one_layer),
        Pass("mask", _draw_mask, writes=("mask",)),
        Pass("slab tables", _bake_tables, writes=("slab_tables",), is_baked=True),
        Pass(
            "slab lookup",
            _shade,
            reads=("position", "normal", "thickness", "mask", "slab_tables"),
            uses=("first_back",),
            writes=("shaded",),
        ),
        resolve_pass("shaded"),
    ]


def _draw_first_back(frame: Frame) -> None:
    shader = frame.program("translucency/centred.vert", "translucency/first_back.frag")
    set_uniforms(shader, **centred_uniforms(frame))
    frame.resources["first_back"] = draw_faces(frame, shader, frame.texture(frame.size, 2), culled="front")


def _draw_mask(frame: Frame) -> None:
    """Coverage in a frame PADDING times as wide and high, so that the subject does not end where the image does."""
    context, sensor = frame.context, frame.scene.sensor
    size = int(sensor.width * PADDING), int(sensor.height * PADDING)
    mask = context.texture(size, 1, dtype="f2")
    mask.filter = (context.LINEAR_MIPMAP_LINEAR, context.LINEAR)
    mask.repeat_x = mask.repeat_y = False
    framebuffer = context.framebuffer([mask])
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.NOTHING)
    wider = np.diag([1 / PADDING, 1 / PADDING, 1, 1]) @ frame.camera.matrix
    shader = frame.program("raster/mesh.vert", "translucency/mask.frag")
    frame.draw(shader, Camera(frame.camera.eye, wider, frame.camera.forward), is_subject)
    frame.build_mipmaps(mask)
    frame.resources["mask"] = mask


def _table(frame: Frame, entries: Float32) -> moderngl.Texture:
    angles, steps, _ = entries.shape
    texture = frame.context.texture((steps, angles), 3, entries.tobytes(), dtype="f4")
    texture.filter = (frame.context.LINEAR, frame.context.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture


def _bake_tables(frame: Frame) -> None:
    tables = slab_table(*subject_medium(frame.scene), subject_diagonal(frame))
    textures = _table(frame, tables.transmitted), _table(frame, tables.reflected)
    frame.resources["slab_tables"] = textures, tables.thinnest


def _shade(frame: Frame) -> None:
    context, resources, settings = frame.context, frame.resources, frame.settings
    sigma_a, sigma_s = subject_medium(frame.scene)
    lights = scene_backlights(frame, int(settings[PIECES.name]))
    tables, thinnest = resources["slab_tables"]
    shaded = frame.texture(frame.size, 4)
    for unit, name in enumerate(("thickness", "position", "normal", "first_back", "mask")):
        if name in resources:
            resources[name].use(unit)
    for unit, table in enumerate(tables, 5):
        table.use(unit)
    rows = context.buffer(light_rows(lights).tobytes())
    rows.bind_to_storage_buffer(0)
    shaded.bind_to_image(0, read=False, write=True)
    tan_half = np.tan(np.radians(frame.scene.sensor.fov_deg) / 2)
    across = frame.size[0] if frame.scene.sensor.fov_axis == "x" else frame.size[1]
    frame.dispatch(
        frame.program(
            "translucency/additive.comp",
            PER_OCTAVE=PER_OCTAVE,
            TAPS=TAPS,
            GRID=frame.grid,
            DIFFUSE_COSINE=DIFFUSE_COSINE,
        ),
        *frame.size,
        light_count=len(lights),
        is_layered="first_back" in resources,
        eye=tuple(frame.camera.eye),
        forward=tuple(frame.camera.forward),
        sigma_t=tuple(sigma_a + sigma_s),
        thinnest=thinnest,
        spread=float(settings[SPREAD.name]),
        padding=PADDING,
        pixels_at_unit_depth=float(across / (2 * tan_half)),
        **centred_uniforms(frame),
    )
    resources["shaded"] = shaded


TECHNIQUES = {
    "translucency.additive_thickness": Technique(
        name="translucency.additive_thickness",
        approximates="thickness",
        summary="distances of all back faces less those of all front faces, blended additively about the centre",
        source="opengl-4.6",
        limits=(
            "The subject must be closed and must not cut through itself; nothing else hides it. Triangles only, and "
            "vertices are rounded to a 256th of a sample."
        ),
        passes=_thickness_passes,
        parameters=(ALLOW_OPEN,),
        channels=(0,),
        grid=PIXEL_GRID,
    ),
    "translucency.additive": Technique(
        name="translucency.additive",
        approximates="transmitted_radiance",
        summary="a slab's transmission and reflection by exact thickness and angle, less what leaves past the edges",
        source="prahl-1995",
        limits=(
            "Every ray sees a slab that faces the camera: right for sheets, too bright in round bodies, which lose "
            "light sideways, and wrong where light comes from the side. Nothing else hides or shades it, or reflects "
            "light to it; the sky lights nothing."
        ),
        passes=_passes,
        parameters=(ALLOW_OPEN, PIECES, SPREAD),
    ),
}
