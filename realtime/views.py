"""What a camera sees: emitted light, and direct light reflected once.

For effects that need pictures of the scene from anywhere, such as defocus. Textures are read with their nearest mip
level alone, the sharpest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from realtime.camera import Camera
from realtime.capture import bind_lights
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.shadows import lights_pass, shadow_pass
from realtime.technique import Parameter
from scenes.errors import InputError
from scenes.features import Features
from scenes.model import ConstantLight, EnvironmentLight

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


LIMITS = (
    "Light is emitted, or direct and reflected once. A constant sky is seen but lights nothing; one from an image is "
    "refused."
)
"""What `draw_view` leaves out, for the cards of techniques that call it."""

SHADING_USES = ("lights", "shadow_atlas")
"""What a pass that calls `draw_view` declares in `uses`."""


def background(frame: Frame) -> tuple[float, float, float]:
    """Radiance where no surface is seen.

    Raises
    ------
    InputError
        The sky is an image.
    """
    if any(isinstance(e, EnvironmentLight) for e in frame.scene.emitters):
        raise InputError(
            f"Scene '{frame.scene.name}' has a sky from an image, and this technique draws constant skies only. Use a "
            "constant emitter, or leave out the check."
        )
    red, green, blue = (
        sum(e.radiance[c] for e in frame.scene.emitters if isinstance(e, ConstantLight)) for c in range(3)
    )
    return red, green, blue


def draw_view(
    frame: Frame,
    camera: Camera,
    framebuffer: moderngl.Framebuffer,
    depth_func: str = "<",
    front_sides_only: bool = False,
) -> None:
    """Draw the scene over what the framebuffer holds: radiance, alpha 1, into its first target.

    The back of a surface hides what is behind it, and is black, unless there are `front_sides_only`: for a camera whose
    near plane cuts bodies open.
    """
    context = frame.context
    lit = not frame.features.nothing_reflects
    defines = ({"LIT": 1} if lit else {}) | ({"MULTISAMPLED": 1} if framebuffer.samples else {})
    shader = frame.program("raster/mesh.vert", "raster/view.frag", **defines)
    framebuffer.use()
    context.enable_only(context.DEPTH_TEST | (context.CULL_FACE if front_sides_only else 0))
    context.depth_func = depth_func
    if lit:
        for name, value in bind_lights(frame).items():
            if name in shader:
                shader[name] = value
    frame.draw(shader, camera)
    context.depth_func = "<"


def draw_pinhole(frame: Frame) -> None:
    """Draw `image` as a pinhole sees it: the mean over GRID x GRID samples of each pixel."""
    seen = frame.texture(frame.size, 4)
    framebuffer = frame.context.framebuffer([seen], frame.context.depth_renderbuffer(frame.size))
    frame.submit(framebuffer.clear, *background(frame), 1.0)
    draw_view(frame, frame.camera, framebuffer)
    frame.resources["pinhole"] = seen
    resolve_pass("pinhole").run(frame)
