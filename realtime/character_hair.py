"""Hair among other things: lit by lamps and by all that is around it, drawn over what the sensor sees.

By the settings of the main technique: `shadows` tells what hides lamps from hair, `indirect` whether light comes from
around. What comes from around has already got past all else, so that the skin alone hides it. Hair shades hair whatever
the settings are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from realtime.character_around import light_around
from realtime.character_frames import with_settings
from realtime.character_light import whole_of
from realtime.character_parts import ACCURATE, OFF, TALK
from realtime.character_view import put_over
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.hair import hair_points_passes, samples_pass
from realtime.hair_guides import hairs_between_passes
from realtime.hair_light import FRAME_LIGHT, hair_light_passes, hair_talk_light_passes
from realtime.hair_ribbons import draw_pass, order_pass
from realtime.lights import Light
from realtime.shadows import is_outside, scene_lights, shadow_pass
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.materials import Diffuse, Translucent
from scenes.mesh import Mesh
from scenes.model import ConstantLight, Emitter, EnvironmentLight, Scene

SETTINGS: Mapping[str, SettingValue] = {parameter.name: parameter.default for parameter in FRAME_LIGHT} | {
    "segments": 8,
    "shadow_side": 256,
}
"""Of the passes that grow, light and draw hair."""

LAMPS = ("lights", "shadow_atlas")
"""Of these hair has its own: lamps, and parallel lights for all that comes from around."""

AROUND = "around"
"""The emitter that parallel lights from around name."""

CORNERS = np.array([(x, y, z, 3**0.5 / 8) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 3**0.5
"""Directions from which light comes that is not a lamp's: those of a cube's corners."""


def hair_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    """Write what `put_hair` draws: `hair_radiance` and what it needs beside that."""
    off = "" if features.has_hair else "the scene has no hair"
    off = off or ("hair is switched off" if settings["hair"] == OFF else "")
    if settings["hair"] == TALK:
        own = [*hairs_between_passes(), samples_pass(), *hair_talk_light_passes(scene, features, SETTINGS)]
    else:
        own = [*hair_points_passes(), samples_pass(), *hair_light_passes(scene, features, SETTINGS), order_pass()]
    unlit = "" if settings["hair"] == ACCURATE else "the talk's hair is lit by lamps alone"
    passes = [
        Pass(
            "lamps of hair",
            _list_lamps,
            reads=("lights",),
            uses=("radiosity",),
            writes=("hair_lamps",),
            skip=unlit,
        ),
        *(_with_own_lamps(step) for step in own if not set(LAMPS) & set(step.writes)),
    ]
    return [replace(step, skip=off or step.skip) for step in passes]


def _list_lamps(frame: Frame) -> None:
    shadows = frame.settings["shadows"]
    lamps = list(scene_lights(frame, 1 if shadows == TALK else int(SETTINGS["facets"])))
    grown = {hair.on for hair in frame.scene.hair}
    if "radiosity" in frame.resources:
        lamps += _from_around(frame, [mesh for mesh in frame.meshes if mesh.shape in grown])
    own = with_settings(frame, SETTINGS)
    own.resources = {"lights": lamps}

    def casts(light: Light, mesh: Mesh) -> bool:
        if light.emitter == AROUND:
            return mesh.shape in grown
        return shadows != OFF and is_outside(light, mesh)

    if lamps:
        shadow_pass(int(SETTINGS["shadow_side"]), casts=casts).run(own)
    frame.resources["hair_lamps"] = own.resources


def _from_around(frame: Frame, skins: list[Mesh]) -> list[Light]:
    """What arrives from around, the mean over all skins."""
    return [
        replace(light, strength=light.strength / len(skins), emitter=AROUND)
        for skin in skins
        for light in light_around(frame, skin, CORNERS)
    ]


def _with_own_lamps(step: Pass) -> Pass:
    def run(frame: Frame) -> None:
        own = with_settings(frame, SETTINGS)
        lamps = frame.resources.get("hair_lamps")
        if lamps is not None:
            own.resources = {name: value for name, value in frame.resources.items() if name not in LAMPS} | lamps
        own.scene = frame.scene.model_copy(update={"emitters": _lamps(frame.scene)})
        own.meshes = tuple(_opaque(frame, mesh) for mesh in frame.meshes)
        step.run(own)
        frame.resources |= {name: own.resources[name] for name in step.writes if name in own.resources}

    return replace(step, run=run, uses=(*step.uses, "hair_lamps"))


def _opaque(frame: Frame, mesh: Mesh) -> Mesh:
    """A body as hair sees what it grows on: Lambertian, with what it reflects on the whole."""
    if not isinstance(mesh.material, Translucent):
        return mesh
    return replace(mesh, material=Diffuse(type="diffuse", reflectance=whole_of(frame, mesh)))


def _lamps(scene: Scene) -> tuple[Emitter, ...]:
    """All emitters but the sky, which is among the light from around if there is any."""
    return tuple(light for light in scene.emitters if not isinstance(light, ConstantLight | EnvironmentLight))


def put_hair(view: Frame) -> None:
    """Draw hair over `shaded`, as the camera of `view` sees it."""
    draw_pass(shaded=True, lines=view.settings["hair"] == TALK).run(view)
    put_over(view, view.resources["hair"])
