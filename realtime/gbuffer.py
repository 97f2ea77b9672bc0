"""What the sensor sees, drawn at GRID x GRID samples a pixel, and the mean over each pixel."""

from __future__ import annotations

from realtime.frame import Frame
from realtime.graph import Pass


def gbuffer_pass() -> Pass:
    """Write `position` (w: hit), `normal` (w: subject) and `albedo` (w: depth) of every sample."""
    return Pass("gbuffer", _draw, writes=("position", "normal", "albedo"))


def _draw(frame: Frame) -> None:
    context, size = frame.context, frame.size
    targets = [frame.texture(size, 4) for _ in range(3)]
    framebuffer = context.framebuffer(targets, context.depth_renderbuffer(size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST)
    frame.draw(frame.program("raster/mesh.vert", "raster/gbuffer.frag"), frame.camera)
    frame.resources |= dict(zip(("position", "normal", "albedo"), targets, strict=True))


def resolve_pass(source: str) -> Pass:
    """Average a texture over the samples of each pixel into `image`."""
    return Pass("resolve", lambda frame: _resolve(frame, source), reads=(source,), writes=("image",))


def _resolve(frame: Frame, source: str) -> None:
    sensor = frame.scene.sensor
    image = frame.texture((sensor.width, sensor.height), 4)
    frame.resources[source].use(0)
    image.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("raster/resolve.comp", GRID=frame.grid), sensor.width, sensor.height)
    frame.resources["image"] = image
