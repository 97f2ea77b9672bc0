"""Translucency as NVIDIA's talk on the GeForce 7800 GTX demos ("Luna", 2005) publishes it.

Positions of the back faces go into an fp16 buffer; front faces fetch them, and the distance, normalised into [0, 1],
is the coordinate of a lookup of the colour that light has behind so much skin. pow(dot(V, L), n) tells how far the
light is behind the subject, and mixes the normal colour with the translucent one. The talk's lookup is painted by hand
and not published; its lights have colours without a radiometric scale or falloff. Here the lookup is Beer-Lambert's
law or that of a slab, and a light's colour is its irradiance at the subject's centre.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from realtime.backlight import backlights, beam, single_scattering_albedo, subject_medium
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.lights import PARALLEL, Light
from realtime.shader import set_uniforms
from realtime.slab import normal_albedo, slab_table
from realtime.technique import Parameter, Technique
from realtime.thickness import draw_faces, subject_diagonal, talk_passes
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.image import Float32, Float64
from scenes.mesh import Mesh
from scenes.model import PIXEL_GRID, LineLight, Scene

TEXELS = 256
"""Of the lookup: as many as thickness has levels in the eight bits of 2005."""

DARK = 1e-3
"""The lookup ends where the most transparent channel lets through less than this part of what enters."""

PIECES = 64
"""Small lights that stand for each emitting surface when its colour at the subject's centre is summed."""

HALF_FLOAT = Parameter(
    "half_float", True, (True, False), "whether back positions are kept in half floats, as published", off=False
)
MAX_THICKNESS = Parameter(
    "max_thickness",
    1.0,
    (0.25, 0.5, 1.0),
    "thickness that is normalised to 1, in parts of the longest that is reasonable for the subject and its medium",
    (1e-3, 100),
    tuned=(0.05, 1),
)


def _thickness_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        *talk_passes(bool(settings[HALF_FLOAT.name])),
        Pass("front faces", _draw_thickness, reads=("back_position",), writes=("thickness",)),
        resolve_pass("thickness"),
    ]


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        *talk_passes(bool(settings[HALF_FLOAT.name])),
        Pass("lookup", _bake_colors, writes=("ramp", "normal_albedo"), is_baked=True),
        Pass(
            "shade front faces",
            _shade,
            reads=("back_position", "ramp", "normal_albedo"),
            writes=("shaded",),
        ),
        resolve_pass("shaded"),
    ]


def _draw_thickness(frame: Frame) -> None:
    shader = frame.program("raster/mesh.vert", "translucency/talk_thickness.frag")
    set_uniforms(shader, longest=float(frame.settings[MAX_THICKNESS.name]) * subject_diagonal(frame))
    frame.resources["back_position"].use(0)
    frame.resources["thickness"] = draw_faces(frame, shader, frame.texture(frame.size, 1), culled="back")


def sigma_eff(sigma_a: Float64, sigma_s: Float64) -> Float64:
    """Effective attenuation of diffuse light, sqrt(3 sigma_a sigma_t). Ishimaru 1978, "Wave Propagation", eq. 9-32."""
    attenuation: Float64 = np.sqrt(3 * sigma_a * (sigma_a + sigma_s))
    return attenuation


def longest_useful(diagonal: float, sigma_a: Float64, sigma_s: Float64) -> float:
    """The subject's diagonal, or the thickness behind which less than DARK is left in every channel."""
    least = float(sigma_eff(sigma_a, sigma_s).min())
    return min(diagonal, -np.log(DARK) / least) if least > 0 else diagonal


def lookup(name: str, sigma_a: Float64, sigma_s: Float64, longest: float) -> Float32:
    """(TEXELS, 3), radiance per unit of irradiance [1/sr] behind the thicknesses from 0 to `longest`."""
    d = (np.arange(TEXELS)[:, None] + 0.5) / TEXELS * longest
    if name == "beer_lambert":
        return (np.exp(-sigma_eff(sigma_a, sigma_s) * d) / np.pi).astype(np.float32)
    return slab_table(sigma_a, sigma_s, longest).transmission(d[:, 0], np.ones(TEXELS)).astype(np.float32)


def talk_lights(scene: Scene, meshes: tuple[Mesh, ...], centre: Float64) -> list[tuple[tuple[float, ...], Float64]]:
    """For each emitter its place (w = 1; for parallel light minus its direction, w = 0) and its colour.

    The colour is the irradiance at `centre` on the plane that receives most of it. A line light shines from the point
    where its line meets the horizontal plane through the camera ("horizontal view plane and plasma light line
    intersection"); a line that never meets it, from its middle.
    """
    sources: dict[int, list[Light]] = {}
    for light in backlights(scene, meshes, PIECES):
        sources.setdefault(light.source, []).append(light)
    return [
        (_place(scene, source, lights), np.linalg.norm(_vector_irradiance(lights, centre), axis=0))
        for source, lights in sources.items()
    ]


def _vector_irradiance(lights: list[Light], point: Float64) -> Float64:
    """Sum of the beams' directions times their irradiances: (3 axes, 3 channels)."""
    total: Float64 = np.sum([np.outer(*beam(light, point)) for light in lights], axis=0)
    return total


def _place(scene: Scene, source: int, lights: list[Light]) -> tuple[float, ...]:
    if lights[0].kind == PARALLEL:
        return (*-lights[0].axis, 0.0)
    emitter = scene.emitters[source] if source < len(scene.emitters) else None
    if isinstance(emitter, LineLight):
        return (*view_plane_point(np.array(emitter.start), np.array(emitter.end), scene.sensor.origin[1]), 1.0)
    return (*np.mean([light.place for light in lights], axis=0), 1.0)


def view_plane_point(start: Float64, end: Float64, height: float) -> Float64:
    """Where the line through two points (3,) is at a height; its middle if it never is."""
    rise = float(end[1] - start[1])
    t = (height - float(start[1])) / rise if rise else 0.5
    point: Float64 = start + t * (end - start)
    return point


def _longest(frame: Frame) -> float:
    """The thickness that is normalised to 1."""
    useful = longest_useful(subject_diagonal(frame), *subject_medium(frame.scene))
    return float(frame.settings[MAX_THICKNESS.name]) * useful


def _bake_colors(frame: Frame) -> None:
    sigma_a, sigma_s = subject_medium(frame.scene)
    colors = lookup(str(frame.settings["lookup"]), sigma_a, sigma_s, _longest(frame))
    ramp = frame.context.texture((TEXELS, 1), 3, colors.astype(np.float16).tobytes(), dtype="f2")
    ramp.repeat_x = ramp.repeat_y = False
    albedo = normal_albedo(single_scattering_albedo(sigma_a, sigma_s))
    frame.resources |= {"ramp": ramp, "normal_albedo": tuple(albedo)}


def _light_rows(frame: Frame) -> Float32:
    """Place and colour (N, 2, 4) of each of the talk's lights."""
    lights = talk_lights(frame.scene, frame.meshes, frame.subject_centre)
    rows = np.zeros((len(lights), 2, 4), dtype=np.float32)
    for row, (place, color) in zip(rows, lights, strict=True):
        row[0], row[1, :3] = place, color
    return rows


def _shade(frame: Frame) -> None:
    resources = frame.resources
    rows = frame.once("talk lights", lambda: _light_rows(frame))
    buffer = frame.context.buffer(rows.tobytes() or bytes(32))
    shader = frame.program("raster/mesh.vert", "translucency/talk.frag")
    set_uniforms(
        shader,
        light_count=len(rows),
        albedo=resources["normal_albedo"],
        longest=_longest(frame),
        power=float(frame.settings["power"]),
    )
    resources["back_position"].use(0)
    resources["ramp"].use(1)
    buffer.bind_to_storage_buffer(0)
    resources["shaded"] = draw_faces(frame, shader, frame.texture(frame.size, 4), culled="back")


_LIMITS = (
    "As published: the nearest back face less the nearest front face, which is wrong wherever a ray enters the subject "
    "more than once; nothing hides it; "
)

TECHNIQUES = {
    "translucency.talk_thickness": Technique(
        name="translucency.talk_thickness",
        approximates="thickness",
        summary="the talk's fp16 positions of the back faces, and the front faces' distance to them",
        source="nvidia-2005",
        limits=_LIMITS + "half floats lose .03 % of the distance to the world's origin.",
        passes=_thickness_passes,
        parameters=(HALF_FLOAT, MAX_THICKNESS),
        channels=(0,),
        grid=PIXEL_GRID,
    ),
    "translucency.talk": Technique(
        name="translucency.talk",
        approximates="transmitted_radiance",
        summary="the talk's dependent lookup by thickness, mixed in by pow(dot(V, L), n)",
        source="nvidia-2005",
        limits=_LIMITS
        + (
            "no falloff, no shadows, no light from the sky, none that leaves sideways. A look, not a measurement: the "
            "talk paints the lookup and tunes n by eye."
        ),
        passes=_passes,
        parameters=(
            HALF_FLOAT,
            MAX_THICKNESS,
            Parameter(
                "lookup",
                "slab",
                ("beer_lambert", "slab"),
                "beer_lambert: exp(-sigma_eff d); slab: baked by adding-doubling",
            ),
            Parameter(
                "power",
                2.0,
                (0.5, 1.0, 2.0, 4.0, 8.0),
                "n of pow(dot(V, L), n), the area of influence",
                (0, 100),
                tuned=(0.05, 50),
            ),
        ),
    ),
}
