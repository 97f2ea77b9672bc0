"""Depth of field as NVIDIA's talk on the GeForce 7800 GTX demos ("Mad Mod Mike", 2005) publishes it.

The scene is drawn twice, behind a boundary and in front of it. The far pass is blurred on its way into the near pass,
where it is the background; the near pass is blurred too, except where that background shows. How much is a ramp over
the depth buffer's hyperbolic value: at each pixel an inner sum of taps counts fully, outer sums by the ramp. The talk's
future work, a third layer in front with blurred alpha, is there as `layers` = 3.

What the talk leaves open is read so. Kernels keep their size relative to the width of the picture; the far pass keeps
its part of the near pass' resolution. The talk's 65 pixels are the diameter of a disk, whose thirds are the inner sum
and the two outer ones. The near pass' inner sum is the pixel itself, and its outer sum has the size of the far pass'
inner one, so that the two meet at the boundary. The near plane is just before what is nearest. The boundary is where
the near pass' ramp begins at the subject's farthest point, "so that he's in focus"; if no boundary does that, it is
just behind the subject. The third layer uses the far pass' ramp the other way round, and is not antialiased, as its
formula knows alphas of 0 and 1 only. Colours are half floats: the talk names no format. The hardware of 2005 could
multisample 8 bits only, which `eight_bit` stands for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import sensor_camera
from realtime.frame import Frame
from realtime.graph import Pass, Skip
from realtime.lens import coc_scale
from realtime.shader import set_uniforms
from realtime.technique import Parameter, Technique
from realtime.views import LIMITS, SHADING, SHADING_USES, background, draw_pinhole, draw_view, shading_passes
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.model import PIXEL_GRID, Scene

if TYPE_CHECKING:
    import moderngl

FAR_WIDTH, NEAR_WIDTH = 912, 1280
"""Pixels across the two passes in Mad Mod Mike."""

FAR_SAMPLES, NEAR_SAMPLES = 2, 4
"""Of their antialiasing."""

RAMP_START = 0.85
"""Depth value from which the near pass is blurred, as published."""

TAPS = 45
"""Of the far pass: 5 in the inner sum, 15 and 25 in the outer ones. The talk's number is not published."""

RINGS = {"INNER": TAPS // 9, "MIDDLE": 4 * TAPS // 9}
"""Where the sums end: a third and two thirds of the radius."""

NEAR_TAPS = 16
FRONT_TAPS = 4 * TAPS
"""The third layer cannot filter four texels at once, so it takes four times the taps, as the talk says."""

JUST = 1e-3
"""A plane just behind or before something leaves this part of its depth between them."""

PARAMETERS = (
    Parameter("layers", 2, (2, 3), "2 as published; 3 with the talk's future work, a layer in front", (2, 3), off=2),
    Parameter(
        "kernel",
        65.0,
        (33.0, 65.0, 129.0),
        "diameter of the largest blur, in 1/912 of the width",
        (1, 912),
        off=1.0,
        tuned=(5, 260),
    ),
    Parameter(
        "near_start",
        RAMP_START,
        (0.5, RAMP_START, 0.95),
        "depth value from which the near pass is blurred",
        (0.01, 0.999),
        tuned=(0.1, 0.99),
    ),
    Parameter(
        "far_ramp",
        1.0,
        (0.5, 1.0, 2.0),
        "depth value of the far pass at which its blur is the largest",
        (1e-3, 1e3),
        tuned=(0.05, 10),
    ),
    Parameter("boundary", 0.0, (0.0,), "planar depth that parts near and far; 0: the subject is in focus", (0, 1e9)),
    Parameter("front", 0.0, (0.0,), "planar depth behind the third layer; 0: just before the subject", (0, 1e9)),
    Parameter("near_plane", 0.0, (0.0,), "planar depth of the near plane; 0: just before what is nearest", (0, 1e9)),
    Parameter("depth_bits", 24, (16, 24), "of the depth buffer that the near pass' blur reads", (16, 24)),
    Parameter("eight_bit", False, (False, True), "colours with 8 bits, which clamp radiance to 1"),
)


@dataclass(frozen=True)
class Planes:
    """Planar depths of the clip planes; `front` is `near` where there is no third layer."""

    near: float
    front: float
    boundary: float
    far: float


@dataclass(frozen=True)
class Picture:
    color: moderngl.Texture
    depth: moderngl.Texture


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    sharp = "" if coc_scale(scene.sensor) else "the camera is a pinhole: everything is sharp"
    lens = "" if sharp else "the camera has a lens"
    third = sharp or ("" if settings["layers"] == 3 else "layers = 2, as published")
    return [
        *shading_passes(features, settings),
        Pass("pinhole", draw_pinhole, uses=SHADING_USES, writes=("image",), skip=lens),
        Pass("planes", _place, writes=("planes",), skip=sharp),
        Pass("far pass", _draw_far, reads=("planes",), uses=SHADING_USES, writes=("far",), skip=sharp),
        Pass("blur far", blur_far, reads=("far",), writes=("background",), skip=sharp),
        Pass("near pass", _draw_near, reads=("planes", "background"), uses=SHADING_USES, writes=("close",), skip=sharp),
        Pass("blur near", blur_near, reads=("close",), writes=("image",), skip=sharp),
        Pass("third layer", _draw_front, reads=("planes",), uses=SHADING_USES, writes=("in_front",), skip=third),
        Pass("blend", _blend, reads=("in_front", "image"), writes=("image",), skip=third),
    ]


def focused_boundary(near: float, farthest: float, ramp_start: float = RAMP_START) -> float:
    """Far plane with which the near pass' ramp begins at `farthest`; just behind that if there is none.

    Depth values are (1 / near - 1 / z) / (1 / near - 1 / far). With a near plane so close that `farthest` would have a
    value above `ramp_start` whatever the far plane, the ramp blurs it.
    """
    inverse = 1 / near - (1 / near - 1 / farthest) / ramp_start
    behind = farthest * (1 + JUST)
    return max(behind, 1 / inverse) if inverse > 0 else behind


def planes_of(frame: Frame) -> Planes:
    """The clip planes of a frame, as its settings say.

    Raises
    ------
    InputError
        They are not in order.
    """
    camera, settings = frame.camera, frame.settings
    least, most = frame.clip_planes
    depths = {m.name: (m.surface.positions.astype(float) - camera.eye) @ camera.forward for m in frame.meshes}
    nearest = min(float(d.min()) for d in depths.values())
    near = float(settings["near_plane"]) or max(least, nearest * (1 - JUST))
    subject = np.concatenate([depths[m.name] for m in frame.meshes if m.is_subject])
    front = near
    if settings["layers"] == 3:
        front = float(settings["front"]) or max(near, float(subject.min()) * (1 - JUST))
    farthest = max(float(subject.max()), front * (1 + JUST))
    boundary = float(settings["boundary"]) or focused_boundary(front, farthest, float(settings["near_start"]))
    if not near <= front < boundary:
        raise InputError(
            f"Found near_plane = {near:g}, front = {front:g} and boundary = {boundary:g}; each must be farther away "
            "than the one before. Set boundary farther, the others nearer, or one of them to 0."
        )
    return Planes(near, front, boundary, max(most, boundary * (1 + JUST)))


def _place(frame: Frame) -> None:
    frame.resources["planes"] = planes_of(frame)


def _format(frame: Frame) -> str:
    return "f1" if frame.settings["eight_bit"] else "f2"


def _target(frame: Frame, size: tuple[int, int]) -> moderngl.Texture:
    made = frame.context.texture(size, 4, dtype=_format(frame))
    made.repeat_x = made.repeat_y = False
    return made


def _near_size(frame: Frame) -> tuple[int, int]:
    return frame.scene.sensor.width, frame.scene.sensor.height


def far_size(frame: Frame) -> tuple[int, int]:
    """Pixels of the far pass, across and down."""
    width, height = _near_size(frame)
    return max(1, round(width * FAR_WIDTH / NEAR_WIDTH)), max(1, round(height * FAR_WIDTH / NEAR_WIDTH))


def _radius(frame: Frame, width: int) -> float:
    """Of the largest kernel, in texels of a pass of that width."""
    return float(frame.settings["kernel"]) / 2 / FAR_WIDTH * width


def depth_alone(frame: Frame, size: tuple[int, int], near: float, far: float, cut: bool) -> moderngl.Texture:
    """The talk's auxiliary depth buffer: one sample a pixel, nothing shaded."""
    context = frame.context
    depth = context.depth_texture(size)
    depth.compare_func = ""
    depth.filter = (context.NEAREST, context.NEAREST)
    framebuffer = context.framebuffer(depth_attachment=depth)
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST | (context.CULL_FACE if cut else 0))
    frame.draw(frame.program("raster/mesh.vert", "defocus/depth.frag"), sensor_camera(frame.scene.sensor, near, far))
    return depth


def _draw_far(frame: Frame) -> None:
    planes: Planes = frame.resources["planes"]
    size = far_size(frame)
    target = _multisampled(frame, size, FAR_SAMPLES)
    frame.submit(target.clear, *background(frame), 1.0)
    camera = sensor_camera(frame.scene.sensor, planes.boundary, planes.far)
    draw_view(frame, camera, target, front_sides_only=True)
    depth = depth_alone(frame, size, planes.boundary, planes.far, cut=True)
    frame.resources["far"] = Picture(_resolved(frame, target), depth)


def _multisampled(frame: Frame, size: tuple[int, int], samples: int) -> moderngl.Framebuffer:
    context = frame.context
    color = context.renderbuffer(size, 4, samples=samples, dtype=_format(frame))
    return context.framebuffer([color], context.depth_renderbuffer(size, samples=samples))


def _resolved(frame: Frame, source: moderngl.Framebuffer) -> moderngl.Texture:
    color = _target(frame, source.size)
    frame.submit(frame.context.copy_framebuffer, frame.context.framebuffer([color]), source)
    return color


def _full_screen(frame: Frame, shader: Any, target: moderngl.Framebuffer) -> None:
    target.use()
    frame.screen(shader)


def _blur(frame: Frame, picture: Picture, name: str, radius: float, target: moderngl.Texture, **defines: int) -> None:
    shader = frame.program("raster/screen.vert", f"defocus_talk/{name}.frag", **defines)
    near_start, far_ramp = float(frame.settings["near_start"]), float(frame.settings["far_ramp"])
    set_uniforms(shader, radius=radius, near_start=near_start, far_slope=1 / far_ramp)
    picture.color.use(0)
    picture.depth.use(1)
    _full_screen(frame, shader, frame.context.framebuffer([target]))


def blur_far(frame: Frame) -> None:
    """Write `background`, the blurred `far` pass."""
    far: Picture = frame.resources["far"]
    frame.context.enable_only(frame.context.NOTHING)
    blurred = _target(frame, far.color.size)
    _blur(frame, far, "blur_far", _radius(frame, far.color.width), blurred, TAPS=TAPS, **RINGS)
    frame.resources["background"] = blurred


def _draw_near(frame: Frame) -> None:
    context, planes = frame.context, frame.resources["planes"]
    target = _multisampled(frame, _near_size(frame), NEAR_SAMPLES)
    frame.submit(target.clear)
    context.enable_only(context.DEPTH_TEST)
    context.depth_func = "1"
    frame.resources["background"].use(0)
    _full_screen(frame, frame.program("raster/screen.vert", "defocus_talk/background.frag"), target)
    cut = planes.front > planes.near
    camera = sensor_camera(frame.scene.sensor, planes.front, planes.boundary)
    draw_view(frame, camera, target, depth_func="<", front_sides_only=cut)
    depth = depth_alone(frame, _near_size(frame), planes.front, planes.boundary, cut)
    frame.resources["close"] = Picture(_resolved(frame, target), depth)


def blur_near(frame: Frame) -> None:
    """Write `image`, the `close` pass blurred where it is not the background."""
    frame.context.enable_only(frame.context.NOTHING)
    size = _near_size(frame)
    image = frame.texture(size, 4)
    bits = int(frame.settings["depth_bits"])
    _blur(
        frame,
        frame.resources["close"],
        "blur_near",
        _radius(frame, size[0]) / 3,
        image,
        TAPS=NEAR_TAPS,
        DEPTH_BITS=bits,
    )
    frame.resources["image"] = image


def _draw_front(frame: Frame) -> None:
    context, planes = frame.context, frame.resources["planes"]
    if planes.front <= planes.near:
        frame.skipped.append(Skip("third layer", "nothing is in front of the near pass"))
        frame.resources["in_front"] = None
        return
    size = _near_size(frame)
    color = _target(frame, size)
    depth = context.depth_texture(size)
    depth.compare_func = ""
    depth.filter = (context.NEAREST, context.NEAREST)
    framebuffer = context.framebuffer([color], depth)
    frame.submit(framebuffer.clear)
    draw_view(frame, sensor_camera(frame.scene.sensor, planes.near, planes.front), framebuffer)
    frame.resources["in_front"] = Picture(color, depth)


def _blend(frame: Frame) -> None:
    context, layer = frame.context, frame.resources["in_front"]
    if layer is None:
        return
    context.enable_only(context.BLEND)
    context.blend_func = context.SRC_ALPHA, context.ONE_MINUS_SRC_ALPHA
    radius = _radius(frame, layer.color.width)
    _blur(
        frame,
        layer,
        "blur_front",
        radius,
        frame.resources["image"],
        TAPS=FRONT_TAPS,
        **{k: 4 * v for k, v in RINGS.items()},
    )
    context.enable_only(context.NOTHING)


TECHNIQUES = {
    "defocus.talk": Technique(
        name="defocus.talk",
        approximates="defocus_radiance",
        summary="the talk's far and near pass, each blurred by ramps over the depth buffer's value",
        source="nvidia-2005",
        limits=(
            f"As published: a look, not a measurement. {LIMITS} The blur knows neither aperture nor focus distance; "
            "the ramps follow the depth buffer's hyperbola, and so the near plane. With two layers nothing is blurred "
            "in front of what is sharp. The third layer's edges stay hard outside, as empty pixels have the depth of "
            "its far plane."
        ),
        passes=_passes,
        parameters=(*PARAMETERS, *SHADING),
        grid=PIXEL_GRID,
    )
}
