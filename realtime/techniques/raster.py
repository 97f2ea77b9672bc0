"""What the rasteriser sees: the real-time half of parity."""

from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.technique import Technique
from scenes.model import PIXEL_GRID

_LIMITS = "Triangles only; the mean over a regular grid of samples, so edges are exact to one sample."


def _draw_emission(frame: Frame) -> None:
    emitted = frame.texture(frame.size, 4)
    framebuffer = frame.context.framebuffer([emitted], frame.context.depth_renderbuffer(frame.size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    frame.context.enable_only(frame.context.DEPTH_TEST)
    frame.draw(frame.program("raster/mesh.vert", "raster/view.frag"), frame.camera)
    frame.resources["emission"] = emitted


GBUFFER = gbuffer_pass()
EMISSION = Pass("emission", _draw_emission, writes=("emission",))


def _raster(name: str, summary: str, source: str, channels: tuple[int, ...], first: Pass = GBUFFER) -> Technique:
    return Technique(
        name=f"raster.{name}",
        approximates=name,
        summary=summary,
        source="opengl-4.6",
        limits=_LIMITS,
        passes=lambda scene, features, settings: [first, resolve_pass(source)],
        channels=channels,
        grid=PIXEL_GRID,
    )


TECHNIQUES = {
    t.name: t
    for t in (
        _raster("depth", "distance along the viewing axis", "albedo", (3,)),
        _raster("normal", "shading normal in world space", "normal", (0, 1, 2)),
        _raster("albedo", "diffuse reflectance of the first surface", "albedo", (0, 1, 2)),
        _raster("emission", "radiance that the first surface emits", "emission", (0, 1, 2), EMISSION),
        _raster("coverage", "fraction of the pixel that the subject covers", "normal", (3,)),
    )
}
