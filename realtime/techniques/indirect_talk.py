"""Indirect light as NVIDIA's talk on the GeForce 7800 GTX demos ("Luna", "Mad Mod Mike", 2005) publishes it.

A 96² cube map of the surroundings without the character, drawn at its belly with a simplified shader; blurred in three
passes; looked up with `N + C * rel_pos`. The talk's lights have colours without a radiometric scale and without
falloff: the colour of a light is set here so that the direct light at the character's centre, albedo * N.L * colour,
is physically right.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import cube_cameras
from realtime.frame import Frame, is_environment
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.lights import FACET, PARALLEL, Light, lights_of
from realtime.shader import set_uniforms
from realtime.technique import Parameter, Technique
from scenes.features import Features
from scenes.image import Float64
from scenes.model import Scene, SettingValue

if TYPE_CHECKING:
    import moderngl

SEAMLESS_CUBE_MAPS = 0x884F
"""GL_TEXTURE_CUBE_MAP_SEAMLESS: the hardware of 2005 filtered each face by itself."""

SEAM_BIAS = -0.0175
"""The talk's value for faces of 96²."""

JITTER = 0.01
"""The talk jitters every tap by "a little" constant amount that it does not state; this is a third of a texel."""

PARAMETERS = (
    Parameter(
        "c_height",
        2.5,
        (0.0, 2.5, 7.0),
        "C times the character's height: 0 far away, 2.5 large room, 7 small room",
        (0, 1000),
    ),
    Parameter("side", 96, (32, 64, 96, 128), "texels along an edge of the cube's faces", (1, 4096)),
    Parameter("step_rad", 0.2, (0.1, 0.2, 0.34), "angle between neighbouring vectors of a blur pass", (0, 1)),
    Parameter("far_brightness", 0.2, (0.2, 1.0), "what is left of the brightness of the farthest surface", (0, 1)),
)


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    sky_only = "" if features.has_local_or_directional_lights else "no point light: the cube would be black"
    return [
        gbuffer_pass(),
        Pass("draw cube", _draw_cube, writes=("cube", "cube_scale")),
        *(Pass(f"blur {name}", _blur(axis), reads=("cube",), writes=("cube",), skip=sky_only) for name, axis in _AXES),
        Pass("look up", _look_up, reads=("position", "normal", "albedo", "cube", "cube_scale"), writes=("shaded",)),
        resolve_pass("shaded"),
    ]


_AXES = (("X", (1.0, 0.0, 0.0)), ("Y", (0.0, 1.0, 0.0)), ("Z", (0.0, 0.0, 1.0)))


def two_lights(lights: list[Light], centre: Float64) -> list[tuple[tuple[float, ...], Float64]]:
    """The talk's two point lights: place (with w = 0 for a direction) and colour, the two brightest at `centre`.

    All facets of one emitting surface count as one light at their mean.
    """
    found: list[tuple[tuple[float, ...], Float64]] = []
    surfaces: dict[int, list[Light]] = {}
    for light in lights:
        if light.kind == FACET:
            surfaces.setdefault(light.source, []).append(light)
        elif light.kind == PARALLEL:
            found.append(((*-light.axis, 0.0), light.strength / np.pi))
        else:
            found.append(((*light.place, 1.0), light.strength / (np.pi * np.sum((light.place - centre) ** 2))))
    for facets in surfaces.values():
        color = np.zeros(3)
        for facet in facets:
            v = centre - facet.place
            color += facet.strength * max(0.0, float(v @ facet.axis)) / (np.pi * np.linalg.norm(v) ** 3)
        found.append(((*np.mean([f.place for f in facets], axis=0), 1.0), color))
    found.sort(key=lambda light: -float(light[1].sum()))
    return [*found, *[((0.0, 1.0, 0.0, 0.0), np.zeros(3))] * 2][:2]


def _cube(frame: Frame, side: int) -> moderngl.TextureCube:
    cube = frame.context.texture_cube((side, side), 4, dtype="f1")
    cube.filter = (frame.context.LINEAR, frame.context.LINEAR)
    return cube


def _draw_cube(frame: Frame) -> None:
    context, settings = frame.context, frame.settings
    side = int(settings["side"])
    centre = frame.subject_centre
    lights = two_lights(lights_of(frame.scene, frame.meshes, facets=64), centre)
    scale = float(np.sum([color for _, color in lights], axis=0).max()) or 1.0
    points = np.concatenate([m.surface.positions for m in frame.meshes if is_environment(m)])
    farthest = float(np.linalg.norm(points - centre, axis=1).max())
    shader = frame.program("raster/mesh.vert", "indirect_talk/capture.frag")
    set_uniforms(
        shader,
        light_places=[place for place, _ in lights],
        light_colors=[tuple(color / scale) for _, color in lights],
        farthest=farthest,
        far_brightness=float(settings["far_brightness"]),
    )
    target = context.texture((side, side), 4, dtype="f1")
    framebuffer = context.framebuffer([target], context.depth_texture((side, side)))
    cube = _cube(frame, side)
    context.enable_only(context.DEPTH_TEST)
    for face, camera in enumerate(cube_cameras(centre, 1e-3 * farthest, 1.01 * farthest)):
        framebuffer.use()
        framebuffer.clear()
        frame.draw(shader, camera, is_environment)
        cube.write(face, target.read())
    frame.resources |= {"cube": cube, "cube_scale": scale}


def _blur(axis: tuple[float, float, float]) -> Any:
    def run(frame: Frame) -> None:
        context = frame.context
        source = frame.resources["cube"]
        side = source.size[0]
        target = context.texture((side, side), 4, dtype="f1")
        framebuffer = context.framebuffer([target])
        blurred = _cube(frame, side)
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
        context.disable_direct(SEAMLESS_CUBE_MAPS)
        triangle = context.vertex_array(shader, [])
        source.use(0)
        for face in range(6):
            framebuffer.use()
            shader["face"] = face
            triangle.render(vertices=3)
            blurred.write(face, target.read())
        context.enable_direct(SEAMLESS_CUBE_MAPS)
        frame.resources["cube"] = blurred

    return run


def _look_up(frame: Frame) -> None:
    resources = frame.resources
    low, high = frame.subject_box
    shaded = frame.texture(frame.size, 4)
    for unit, name in enumerate(("position", "normal", "albedo", "cube")):
        resources[name].use(unit)
    shaded.bind_to_image(0, read=False, write=True)
    frame.context.disable_direct(SEAMLESS_CUBE_MAPS)
    frame.dispatch(
        frame.program("indirect_talk/lookup.comp"),
        *frame.size,
        centre=tuple(frame.subject_centre),
        c=float(frame.settings["c_height"]) / float(high[1] - low[1]),
        scale=resources["cube_scale"],
    )
    frame.context.enable_direct(SEAMLESS_CUBE_MAPS)
    resources["shaded"] = shaded


TECHNIQUES = {
    "indirect.talk": Technique(
        name="indirect.talk",
        approximates="indirect_radiance",
        summary="the talk's blurred 96² cube of the surroundings, looked up with N + C * rel_pos",
        source="nvidia-2005",
        limits=(
            "As published: two lights without falloff or shadows, one bounce, 8 bits a channel, distance "
            "darkening to 20 %, a "
            "kernel narrower than the cosine. A look, not a measurement: the talk tunes C and the brightness by eye."
        ),
        passes=_passes,
        parameters=PARAMETERS,
    )
}
