"""A scene as one camera sees it: its surfaces first, then what lies in and before them.

A part of it may be drawn by a technique of its own (`DrawnPart`), as if it were the subject of the frame; its picture
then stands where that part is seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from realtime.camera import Camera
from realtime.capture import bind_lights
from realtime.character_frames import run, seen_by
from realtime.character_light import whole_of
from realtime.character_parts import ACCURATE, FIRST_COAT, KINDS, coats_of, is_solid, kind_of
from realtime.coat_albedo import albedo_of
from realtime.frame import PATTERN_UNIT, Frame
from realtime.graph import Pass
from realtime.layers import bind_layers
from realtime.relief import relief_gbuffer_pass
from realtime.shader import set_uniforms
from realtime.views import background
from scenes.mesh import Mesh
from scenes.shapes import Relief

if TYPE_CHECKING:
    import moderngl


@dataclass(frozen=True)
class Behind:
    """A picture of the surroundings from a planar depth on."""

    picture: moderngl.Texture
    depth: float


@dataclass(frozen=True)
class DrawnPart:
    """A part of the scene with the passes that draw it into `shaded`; `frame` is the one that it is the subject of."""

    kind: float
    frame: Frame
    passes: tuple[Pass, ...]


def see(frame: Frame, which: Callable[[Mesh], bool] = lambda mesh: True) -> None:
    """Write what each sample sees of the meshes for which `which` holds.

    `position`, `normal` and `albedo` are as raster/gbuffer.frag has them, `around`, `emitted` and `whole` as
    character/marks.frag has them. Of reliefs all six are found by rays.
    """
    context, size = frame.context, frame.size
    targets = [frame.texture(size, 4) for _ in range(3)]
    framebuffer = context.framebuffer(targets, context.depth_renderbuffer(size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST)
    shader = frame.program("character/marks.vert", "character/marks.frag", **KINDS)
    received = frame.resources.get("received", {})
    reliefs = {shape.name for shape in frame.scene.shapes if isinstance(shape, Relief)}
    for mesh in frame.meshes:
        if which(mesh) and is_solid(mesh, frame.settings) and mesh.shape not in reliefs:
            set_uniforms(shader, kind=kind_of(frame, mesh), on_the_whole=whole_of(frame, mesh))
            frame.draw(shader, frame.camera, lambda other, own=mesh.name: other.name == own, received)  # type: ignore[misc]
    frame.resources |= dict(zip(("around", "emitted", "whole"), targets, strict=True))
    relief_gbuffer_pass(
        lambda mesh: which(mesh) and is_solid(mesh, frame.settings), partial(_mark_relief, frame, targets)
    ).run(frame)


def _mark_relief(
    frame: Frame, targets: list[moderngl.Texture], relief: Relief
) -> tuple[dict[str, float], dict[str, Any]]:
    """Bind what character/relief_marks.glsl reads and writes; returns its defines and uniforms."""
    drawable = next(each for each in frame.drawables if each.mesh.shape == relief.name)
    mesh, received = drawable.mesh, frame.resources.get("received", {}).get(relief.name)
    for unit, target in enumerate(targets, 3):
        target.bind_to_image(unit, read=False, write=True)
    drawable.pattern.use(PATTERN_UNIT)
    if received is not None:
        received.bind_to_storage_buffer(0)
    uniforms = {
        "emission": mesh.radiance or (0.0, 0.0, 0.0),
        "emission_map": PATTERN_UNIT,
        "kind": kind_of(frame, mesh),
        "on_the_whole": whole_of(frame, mesh),
    }
    return KINDS | {"MARKED": 1} | ({} if received is None else {"RECEIVED": 1}), uniforms


def shade(frame: Frame) -> None:
    """Write `shaded`: the sky, emitters, Lambertian and layered surfaces."""
    width, height = frame.size
    shaded = frame.texture((width, height), 4)
    shaded.bind_to_image(0)
    for unit, name in enumerate(("position", "normal", "albedo")):
        frame.resources[name].use(unit)
    for unit, name in enumerate(("around", "emitted", "whole"), 4):
        frame.resources[name].use(unit)
    eye = tuple(frame.camera.eye)
    shader = frame.program("character/diffuse.comp", **KINDS)
    frame.dispatch(shader, width, height, background=background(frame), eye=eye, **bind_lights(frame))
    if frame.settings["suit"] == ACCURATE:
        for i, coat in enumerate(coats_of(frame.meshes)):
            albedo = albedo_of(frame, coat).by_cosine
            defines, uniforms = bind_layers(frame, coat, unit=7)
            frame.resources["emitted"].use(5)
            albedo.use(6)
            frame.dispatch(
                frame.program("character/layered.comp", **defines),
                width,
                height,
                kind=FIRST_COAT + i,
                eye=eye,
                **uniforms,
                **bind_lights(frame),
            )
    frame.resources["shaded"] = shaded


def put_behind(view: Frame, behind: Behind) -> None:
    """Put the surroundings of a picture into `shaded`, where nothing that is nearer is seen."""
    width, height = view.size
    view.resources["shaded"].bind_to_image(0)
    for unit, name in enumerate(("position", "normal")):
        view.resources[name].use(unit)
    behind.picture.use(7)
    camera = {"eye": tuple(view.camera.eye), "forward": tuple(view.camera.forward)}
    view.dispatch(view.program("character/behind.comp"), width, height, behind_from=behind.depth, **camera)


def draw_parts(view: Frame, camera: Camera, parts: Iterable[DrawnPart]) -> None:
    """Draw parts with techniques of their own, as a camera sees them, into `shaded` where they are seen in `view`."""
    for part in parts:
        own = seen_by(part.frame, camera, view.grid)
        run(own, part.passes)
        put_over(view, own.resources["shaded"], part.kind)


def put_over(frame: Frame, layer: moderngl.Texture, kind: float | None = None) -> None:
    """Put a premultiplied layer over `shaded`; of a `kind`, only where surfaces of it are seen."""
    layer.use(0)
    frame.resources["around"].use(1)
    frame.resources["shaded"].bind_to_image(0)
    defines: dict[str, Any] = {} if kind is None else {"AMONG": 1}
    width, height = frame.size
    frame.dispatch(frame.program("character/over.comp", **defines), width, height, kind=kind)
