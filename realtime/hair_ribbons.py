"""Hair drawn: as ribbons that face the sensor, or as lines. What both need is in realtime/hair.py.

A ribbon stands for the near side of a round hair: where it ends, and where it meets the skin, is found for each
fragment. Its alpha is the part of a sample that it covers, so it covers what the hair covers, however narrow that is.
Alphas are blended one over another, so that a sample in the end is as opaque as independent layers are; for radiance
from the farthest segment to the nearest, for coverage in any order.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from realtime.camera import Camera
from realtime.frame import Frame, columns
from realtime.graph import Pass
from realtime.hair import HairSamples, Strands
from realtime.shader import set_uniforms

if TYPE_CHECKING:
    import moderngl

DEPTH_CLAMP = 0x864F
"""GL_DEPTH_CLAMP: hair stands out of the meshes between whose depths the near and the far plane lie."""

RIBBON = ("hair/ribbon.vert", "hair/ribbon.frag")
LINE = ("hair/line.vert", "hair/line.frag")

INVOCATIONS = 512
"""Of a group of the sort, which holds two segments for each: half of what OpenGL 4.3 allows at least."""


def order_pass() -> Pass:
    """Write `hair_order`, all segments from the farthest to the nearest."""
    return Pass("sort hair", _sort, reads=("hair_samples",), writes=("hair_order",))


def draw_pass(shaded: bool, lines: bool = False) -> Pass:
    """Write `hair`, premultiplied radiance and coverage at each sample of what the scene's meshes do not hide.

    Unless hair is `shaded`, there is coverage alone. Ribbons that are shaded need `hair_order`.
    """
    order = ("hair_order",) if shaded and not lines else ()
    radiance = ("hair_radiance",) if shaded else ()
    return Pass(
        "draw hair",
        lambda frame: _draw(frame, shaded, lines),
        reads=("strands", "hair_samples", *order, *radiance),
        writes=("hair",),
    )


def _sort(frame: Frame) -> None:
    """Batcher's bitonic sort: what is within a block is sorted there, the other steps are one dispatch each."""
    strands, samples = _hair(frame)
    segments = samples.per_hair - 1
    count, block = strands.count * segments, 2 * INVOCATIONS
    size = block
    while size < count:
        size *= 2
    order = frame.once(("hair order", size), lambda: frame.context.buffer(reserve=size * 8))
    samples.bind()
    order.bind_to_storage_buffer(4)
    eye = tuple(frame.camera.eye)
    within, between = frame.program("hair/sort.comp", INVOCATIONS=INVOCATIONS), frame.program("hair/sort.comp")
    keys = frame.program("hair/keys.comp", SEGMENTS=segments)
    frame.dispatch(keys, size, group=(64, 1), count=count, padded=size, eye=eye)
    frame.dispatch(within, size // 2, group=(INVOCATIONS, 1), first_run=2, last_run=block)
    run = 2 * block
    while run <= size:
        stride = run // 2
        while stride >= block:
            frame.dispatch(between, size // 2, group=(64, 1), run=run, stride=stride, pairs=size // 2)
            stride //= 2
        frame.dispatch(within, size // 2, group=(INVOCATIONS, 1), first_run=run, last_run=run)
        run *= 2
    frame.resources["hair_order"] = order


def _hair(frame: Frame) -> tuple[Strands, HairSamples]:
    return frame.resources["strands"], frame.resources["hair_samples"]


def _draw(frame: Frame, shaded: bool, lines: bool) -> None:
    context = frame.context
    drawn, depth = frame.texture(frame.size, 4), context.depth_renderbuffer(frame.size)
    meshes = context.framebuffer([], depth)
    meshes.use()
    frame.submit(meshes.clear)
    context.enable_only(context.DEPTH_TEST)
    frame.draw(frame.program("raster/mesh.vert", "defocus/depth.frag"), frame.camera)
    framebuffer = context.framebuffer([drawn], depth)
    framebuffer.depth_mask = False
    frame.submit(framebuffer.clear)
    framebuffer.depth_mask = True
    (draw_lines if lines else draw_ribbons)(frame, frame.camera, framebuffer, shaded)
    frame.resources["hair"] = drawn


def draw_ribbons(frame: Frame, camera: Camera, framebuffer: moderngl.Framebuffer, shaded: bool) -> None:
    """Blend ribbons over what a framebuffer holds, hidden by its depth, which stays as it is.

    They are premultiplied: what is seen is added, and what was there is dimmed by the part that hair covers. If they
    are `shaded`, `hair_order` and `hair_radiance` are those of the frame's camera, which may be close to `camera`.
    """
    framebuffer.use()
    if shaded:
        frame.resources["hair_order"].bind_to_storage_buffer(4)
    with _blending(frame.context, framebuffer):
        _submit(frame, camera, framebuffer, RIBBON, frame.context.TRIANGLES, 6, shaded)


@contextmanager
def _blending(context: moderngl.Context, framebuffer: moderngl.Framebuffer) -> Iterator[None]:
    """Put premultiplied colours over what is there, and leave its depth as it is."""
    framebuffer.depth_mask = False
    context.enable_only(context.DEPTH_TEST | context.BLEND)
    context.blend_func = context.ONE, context.ONE_MINUS_SRC_ALPHA
    try:
        yield
    finally:
        context.blend_func = context.SRC_ALPHA, context.ONE_MINUS_SRC_ALPHA
        context.disable(context.BLEND)
        framebuffer.depth_mask = True


@contextmanager
def _depth_clamped(context: moderngl.Context) -> Iterator[None]:
    """Draw what lies beyond the near and the far plane at their depths, and at the far one before the background."""
    context.enable_direct(DEPTH_CLAMP)
    context.depth_func = "<="
    try:
        yield
    finally:
        context.depth_func = "<"
        context.disable_direct(DEPTH_CLAMP)


def draw_lines(frame: Frame, camera: Camera, framebuffer: moderngl.Framebuffer, shaded: bool) -> None:
    """Draw lines of one sample's width over what a framebuffer holds, the nearest on top."""
    framebuffer.use()
    frame.context.enable_only(frame.context.DEPTH_TEST)
    _submit(frame, camera, framebuffer, LINE, frame.context.LINES, 2, shaded)


def _submit(
    frame: Frame,
    camera: Camera,
    framebuffer: moderngl.Framebuffer,
    shaders: tuple[str, str],
    mode: int,
    vertices: int,
    shaded: bool,
) -> None:
    strands, samples = _hair(frame)
    strands.bind()
    samples.bind()
    defines: dict[str, Any] = {"SEGMENTS": samples.per_hair - 1}
    if shaded:
        frame.resources["hair_radiance"].bind_to_storage_buffer(3)
        defines["SHADED"] = 1
    shader = frame.program(*shaders, **defines)
    set_uniforms(
        shader,
        world_to_clip=columns(camera.matrix),
        eye=tuple(camera.eye),
        half_size=(framebuffer.width / 2, framebuffer.height / 2),
    )
    array = frame.once(("hair", shader), lambda: frame.context.vertex_array(shader, []))
    with _depth_clamped(frame.context):
        frame.submit(array.render, mode, vertices=vertices * strands.count * (samples.per_hair - 1))
