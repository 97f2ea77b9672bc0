"""What a camera sees: emitted light, and direct light reflected once.

For effects that need pictures of the scene from anywhere, such as defocus. Textures are read with their nearest mip
level alone, the sharpest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from realtime.camera import Camera
from realtime.capture import bind_lights
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.shadows import lights_pass, shadow_pass
from realtime.technique import Parameter
from scenes.features import Features
from scenes.model import ConstantLight

if TYPE_CHECKING:
    import moderngl

SHADING = (
    Parameter("shadow_side", 512, (128, 512, 1024), "texels along an edge of a shadow tile", (1, 4096)),
    Parameter("facets", 16, (1, 4, 16), "point lights that stand for each emitting surface", (1, 4096)),
)


def shading_passes(features: Features, settings: Any) -> list[Pass]:
    """What `draw_view` reads where something reflects light, by the settings of SHADING."""
    black = "nothing reflects light: what is seen is emitted" if features.nothing_reflects else ""
    unlit = black or ("" if features.has_local_or_directional_lights else "no emitter but the sky")
    side, facets = (int(settings[p.name]) for p in SHADING)
    lights, atlas = lights_pass(facets), shadow_pass(side, skip=unlit)
    return [Pass(lights.name, lights.run, lights.writes, skip=black), atlas]


SHADING_USES = ("lights", "shadow_atlas")
"""What a pass that calls `draw_view` declares in `uses`."""


def background(frame: Frame) -> tuple[float, float, float]:
    """Radiance where no surface is seen."""
    red, green, blue = (
        sum(e.radiance[c] for e in frame.scene.emitters if isinstance(e, ConstantLight)) for c in range(3)
    )
    return red, green, blue


def draw_view(frame: Frame, camera: Camera, framebuffer: moderngl.Framebuffer, depth_func: str = "<") -> None:
    """Draw the scene over what the framebuffer holds: radiance, alpha 1, into its first target."""
    framebuffer.use()
    frame.context.enable_only(frame.context.DEPTH_TEST)
    frame.context.depth_func = depth_func
    lit = not frame.features.nothing_reflects
    shader = frame.program("raster/mesh.vert", "raster/view.frag", **({"LIT": 1} if lit else {}))
    if lit:
        for name, value in bind_lights(frame).items():
            if name in shader:
                shader[name] = value
    frame.draw(shader, camera)
    frame.context.depth_func = "<"
