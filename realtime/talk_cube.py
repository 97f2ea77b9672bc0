"""The cube map of NVIDIA's talk on the GeForce 7800 GTX demos ("Luna", "Mad Mod Mike", 2005).

Its RGB holds the surroundings as the character's belly sees them, lit by a simplified shader: indirect light. Its alpha
holds the character as the light sees it: soft shadows. Both are blurred together in three passes; who reads one of them
alone pays for no drawing of the other. The talk's lights have colours without a radiometric scale and without falloff:
the colour of a light is set here so that the direct light at the character's centre, albedo * N.L * colour, is
physically right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import cube_cameras
from realtime.frame import Frame, is_environment
from realtime.graph import Pass
from realtime.lights import FACET, PARALLEL, Light
from realtime.shader import set_uniforms
from realtime.shadows import scene_lights
from realtime.technique import Parameter
from realtime.vcm import faces_apart, the_omni_light
from scenes.errors import InputError
from scenes.features import Features
from scenes.image import Float64
from scenes.mesh import Mesh

if TYPE_CHECKING:
    import moderngl

SEAM_BIAS = -0.0175
"""The talk's value for faces of 96²."""

JITTER = 0.01
"""The talk jitters every tap by "a little" constant amount that it does not state; this is a third of a texel."""

AT_CENTRE = 1e-3
"""Part of the subject's size within which a light counts as being at its centre."""

CUBE = (
    Parameter("side", 96, (32, 64, 96, 128), "texels along an edge of the cube's faces", (1, 4096)),
    Parameter(
        "step_rad",
        0.2,
        (0.1, 0.2, 0.34),
        "angle between neighbouring vectors of a blur pass",
        (0, 1),
        tuned=(0.005, 0.6),
        off=0.0,
    ),
)
FAR_BRIGHTNESS = Parameter(
    "far_brightness",
    0.2,
    (0.2, 1.0),
    "what is left of the brightness of the farthest surface",
    (0, 1),
    tuned=(0, 1),
    off=1.0,
)

SURROUNDINGS, CHARACTER = "cube_scale", "character"
"""What the passes write that draw into the RGB and into the alpha of the cube."""

_AXES = (("X", (1.0, 0.0, 0.0)), ("Y", (0.0, 1.0, 0.0)), ("Z", (0.0, 0.0, 1.0)))


def cube_passes(features: Features, *wanted: str) -> list[Pass]:
    """Write `cube` and what is `wanted` of SURROUNDINGS (the radiance that 1 stands for in its RGB) and CHARACTER.

    The settings CUBE are read, for SURROUNDINGS also FAR_BRIGHTNESS. Where nothing is drawn, RGB stays black and alpha
    1. If nothing of what is wanted is to be drawn, there is no cube.
    """
    reasons = {SURROUNDINGS: _dark(features), CHARACTER: _casts_nothing(features)}
    empty = "; ".join(reasons[name] for name in wanted) if all(reasons[name] for name in wanted) else ""
    return [
        Pass("clear cube", _clear, ("cube",), skip=empty),
        Pass("draw surroundings", _draw_surroundings, (SURROUNDINGS,), reads=("cube",), skip=reasons[SURROUNDINGS]),
        Pass("draw character", _draw_character, (CHARACTER,), reads=("cube",), skip=reasons[CHARACTER]),
        *(
            Pass(f"blur {name}", _blur(axis), ("cube",), reads=("cube",), uses=wanted, skip=empty)
            for name, axis in _AXES
        ),
    ]


def _dark(features: Features) -> str:
    if features.subject_is_alone:
        return "nothing surrounds the subject"
    return "" if features.has_local_or_directional_lights else "no light but the sky: the surroundings are black"


def _casts_nothing(features: Features) -> str:
    if features.subject_is_alone:
        return "nothing surrounds the subject to receive its shadow"
    return "" if features.has_one_omni_light else "the subject casts the soft shadow of one point or sphere light"


def two_lights(lights: list[Light], centre: Float64) -> list[tuple[tuple[float, ...], Float64]]:
    """The talk's two point lights: place (with w = 0 for a direction) and colour, the two brightest at `centre`.

    All parts of one emitting surface count as one light at their mean.
    """
    found: list[tuple[tuple[float, ...], Float64]] = []
    surfaces: dict[int, list[Light]] = {}
    for light in lights:
        if light.kind == PARALLEL:
            found.append(((*-light.axis, 0.0), light.strength / np.pi))
        else:
            surfaces.setdefault(light.source, []).append(light)
    for parts in surfaces.values():
        color = np.zeros(3)
        for part in parts:
            v = centre - part.place
            facing = max(0.0, float(v @ part.axis)) / np.linalg.norm(v) if part.kind == FACET else 1.0
            color += part.strength * facing / (np.pi * np.sum(v**2))
        found.append(((*np.mean([part.place for part in parts], axis=0), 1.0), color))
    found.sort(key=lambda light: -float(light[1].sum()))
    return [*found, *[((0.0, 1.0, 0.0, 0.0), np.zeros(3))] * 2][:2]


def lights_at_subject(frame: Frame) -> list[tuple[tuple[float, ...], Float64]]:
    """`two_lights` of the frame's scene.

    Raises
    ------
    InputError
        One of them is where the subject's centre is, and would have no finite colour.
    """
    centre, (low, high) = frame.subject_centre, frame.subject_box
    lights = two_lights(scene_lights(frame, facets=64), centre)
    for (*place, w), color in lights:
        if w == 1 and color.any() and np.linalg.norm(place - centre) < AT_CENTRE * np.linalg.norm(high - low):
            raise InputError(
                f"Found a light at the subject's centre {tuple(map(float, centre))}, where the talk's lights get their "
                "colour; none is allowed that close. Move the light, or leave the technique out."
            )
    return lights


@contextmanager
def cube_bound(frame: Frame, unit: int) -> Iterator[dict[str, int]]:
    """Bind the cube if there is one, with each of its faces filtered by itself; yields defines for its readers."""
    if "cube" not in frame.resources:
        yield {}
        return
    frame.resources["cube"].use(unit)
    with faces_apart(frame.context, unit):
        yield {"CAPTURED": 1}


def _empty_cube(frame: Frame, side: int) -> moderngl.TextureCube:
    cube = frame.context.texture_cube((side, side), 4, dtype="f1")
    cube.filter = (frame.context.LINEAR, frame.context.LINEAR)
    return cube


def _clear(frame: Frame) -> None:
    side = int(frame.settings["side"])
    cube = _empty_cube(frame, side)
    target = frame.context.texture(cube.size, 4, dtype="f1")
    frame.submit(frame.context.framebuffer([target]).clear, alpha=1.0)
    for face in range(6):
        _copy_to_face(frame, target, cube, face)
    frame.resources["cube"] = cube


def _copy_to_face(frame: Frame, texture: moderngl.Texture, cube: moderngl.TextureCube, face: int) -> None:
    """Faces of a cube map cannot be drawn into: they get what was drawn into a texture, by way of a buffer."""
    pixels = frame.once(("face", cube.size), lambda: frame.context.buffer(reserve=4 * cube.size[0] * cube.size[1]))
    frame.submit(texture.read_into, pixels)
    frame.submit(cube.write, face, pixels)


def _copy_from_face(frame: Frame, cube: moderngl.TextureCube, face: int, texture: moderngl.Texture) -> None:
    pixels = frame.once(("face", cube.size), lambda: frame.context.buffer(reserve=4 * cube.size[0] * cube.size[1]))
    frame.submit(cube.read_into, pixels, face)
    frame.submit(texture.write, pixels)


def _draw_surroundings(frame: Frame) -> None:
    lights, centre = lights_at_subject(frame), frame.subject_centre
    scale = float(np.sum([color for _, color in lights], axis=0).max()) or 1.0
    farthest = frame.once("farthest", lambda: _farthest(frame))
    shader = frame.program("raster/mesh.vert", "indirect_talk/capture.frag")
    set_uniforms(
        shader,
        light_places=[place for place, _ in lights],
        light_colors=[tuple(color / scale) for _, color in lights],
        farthest=farthest,
        far_brightness=float(frame.settings[FAR_BRIGHTNESS.name]),
    )
    frame.context.enable_only(frame.context.DEPTH_TEST)
    _draw_faces(frame, shader, centre, (1e-3 * farthest, 1.01 * farthest), is_environment, (True, True, True, False))
    frame.resources[SURROUNDINGS] = scale


def _farthest(frame: Frame) -> float:
    """Distance of the farthest vertex of the surroundings from the subject's centre."""
    points = np.concatenate([m.surface.positions for m in frame.meshes if is_environment(m)])
    return float(np.linalg.norm(points - frame.subject_centre, axis=1).max())


def _draw_character(frame: Frame) -> None:
    """Without a depth test: the shadow is painted on all that lies in a direction, before and behind the character."""
    _, light = the_omni_light(frame.scene)
    low, high = frame.subject_box
    farthest = float(np.linalg.norm(np.maximum(abs(low - light), abs(high - light))))
    shader = frame.program("raster/mesh.vert", "indirect_talk/character.frag")
    frame.context.enable_only(frame.context.NOTHING)
    _draw_faces(
        frame,
        shader,
        light,
        (1e-3 * farthest, 1.01 * farthest),
        lambda mesh: mesh.is_subject,
        (False, False, False, True),
    )


def _draw_faces(
    frame: Frame,
    shader: Any,
    eye: Float64,
    clip_planes: tuple[float, float],
    which: Callable[[Mesh], bool],
    channels: tuple[bool, bool, bool, bool],
) -> None:
    """Draw some meshes into some channels of the cube."""
    context, cube = frame.context, frame.resources["cube"]
    target = context.texture(cube.size, 4, dtype="f1")
    framebuffer = context.framebuffer([target], context.depth_texture(cube.size))
    framebuffer.color_mask = channels
    for face, camera in enumerate(cube_cameras(eye, *clip_planes)):
        _copy_from_face(frame, cube, face, target)
        framebuffer.use()
        frame.submit(framebuffer.clear, alpha=1.0)
        frame.draw(shader, camera, which)
        _copy_to_face(frame, target, cube, face)


def _blur(axis: tuple[float, float, float]) -> Callable[[Frame], None]:
    def run(frame: Frame) -> None:
        context = frame.context
        source = frame.resources["cube"]
        side = source.size[0]
        target = context.texture((side, side), 4, dtype="f1")
        framebuffer = context.framebuffer([target])
        blurred = _empty_cube(frame, side)
        shader = frame.program("raster/screen.vert", "indirect_talk/blur.frag")
        jitter = np.random.default_rng(13).uniform(-JITTER, JITTER, (13, 3))
        set_uniforms(
            shader,
            axis=axis,
            step_angle=float(frame.settings["step_rad"]),
            seam_bias=SEAM_BIAS,
            jitter=[tuple(j) for j in jitter],
            source=0,
        )
        context.enable_only(context.NOTHING)
        with cube_bound(frame, 0):
            for face in range(6):
                framebuffer.use()
                shader["face"] = face
                frame.screen(shader)
                _copy_to_face(frame, target, blurred, face)
        frame.resources["cube"] = blurred

    return run
