"""Light on hair, at points along it: what the passes of realtime/hair_ribbons.py draw.

Fibres scatter as `realtime.fibre` bakes them. What other hair takes from light on its way to a hair is marched through
the grid of `realtime.hair_voxels`; what goes from hair to hair is solved on it by `realtime.hair_ordinates`. As shading
is for points on hairs, and not for pixels, its cost does not depend on how finely hair is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from realtime.capture import bind_lights
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.hair import HairSamples, Strands
from realtime.hair_ordinates import ITERATIONS, ORDER, HairOrdinates, ordinates_passes
from realtime.hair_voxels import (
    CELLS,
    FIBRE_UNIT,
    HOT_SPOT,
    TRANSMITTANCE,
    Voxels,
    fibres_pass,
    march_defines,
    voxels_passes,
)
from realtime.lights import light_rows
from realtime.shadows import lights_pass, shadow_pass
from realtime.technique import Parameter
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene

FACETS = Parameter("facets", 4, (1, 4, 16), "small lights that stand for each emitting surface", (1, 4096))

FRAME_LIGHT = (
    Parameter(
        "fibre",
        "marschner",
        ("marschner", "kajiya"),
        "how a fibre sends light to the eye: by lobes that are reflected and let through, or as Kajiya and Kay's "
        "cylinder; from hair to hair light goes by lobes in both",
        off="kajiya",
    ),
    TRANSMITTANCE,
    HOT_SPOT,
    ITERATIONS,
    CELLS,
    ORDER,
    FACETS,
    Parameter("shadow_side", 1024, (256, 512, 1024), "texels along an edge of a shadow tile", (1, 4096)),
)
"""Settings of `hair_light_passes`."""

TALK_LIGHT = (FACETS,)
"""Settings of `hair_talk_light_passes`."""


def hair_light_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    """Write `hair_radiance` from `strands` and `hair_samples`."""
    dark = "no emitter: nothing is lit" if features.is_dark else ""
    unlit = "" if features.has_local_or_directional_lights else "no emitter but the sky: nothing casts a shadow map"
    once = f"{ITERATIONS.name} = 0: light is scattered once" if settings[ITERATIONS.name] == 0 else ""
    return [
        lights_pass(int(settings[FACETS.name])),
        shadow_pass(int(settings["shadow_side"]), skip=unlit),
        fibres_pass(),
        *voxels_passes(),
        *ordinates_passes(dark, once, features.has_sky),
        Pass(
            "light on hair",
            _shade,
            reads=("strands", "hair_samples", "lights", "fibres", "voxels"),
            uses=("shadow_atlas", "hair_ordinates"),
            writes=("hair_radiance",),
        ),
    ]


def hair_talk_light_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    """Write `hair_radiance` as demos of 2005 did: Kajiya and Kay's hair, with nothing between it and the lights."""
    return [
        lights_pass(int(settings[FACETS.name])),
        fibres_pass(),
        Pass(
            "light on hair",
            _shade_as_then,
            reads=("strands", "hair_samples", "lights", "fibres"),
            writes=("hair_radiance",),
        ),
    ]


def _shade(frame: Frame) -> None:
    voxels: Voxels = frame.resources["voxels"]
    voxels.bind()
    frame.resources["fibres"].use(FIBRE_UNIT)
    defines = {"CELLS": voxels.cells, **march_defines(frame)}
    if frame.settings["fibre"] == "kajiya":
        defines["KAJIYA"] = 1
    ordinates: HairOrdinates | None = frame.resources.get("hair_ordinates")
    if ordinates is not None:
        ordinates.bind()
        defines |= {"SCATTERED": 1, "ORDINATES": ordinates.count}
    _light_samples(frame, frame.program("hair_light/shade.comp", **defines), **bind_lights(frame))


def _shade_as_then(frame: Frame) -> None:
    lights = frame.resources["lights"]
    rows = frame.context.buffer(light_rows(lights).tobytes())
    rows.bind_to_storage_buffer(3)
    frame.resources["fibres"].use(FIBRE_UNIT)
    _light_samples(frame, frame.program("hair_light/talk.comp"), light_count=len(lights))


def _light_samples(frame: Frame, shader: Any, **uniforms: Any) -> None:
    strands: Strands = frame.resources["strands"]
    samples: HairSamples = frame.resources["hair_samples"]
    strands.bind()
    samples.bind()
    count = strands.count * samples.per_hair
    radiance = frame.context.buffer(reserve=16 * max(count, 1))
    radiance.bind_to_storage_buffer(0)
    eye = tuple(frame.camera.eye)
    frame.dispatch(shader, count, group=(64, 1), count=count, per_hair=samples.per_hair, eye=eye, **uniforms)
    frame.resources["hair_radiance"] = radiance
