"""Indirect light as NVIDIA's talk on the GeForce 7800 GTX demos ("Luna", "Mad Mod Mike", 2005) publishes it.

A 96² cube map of the surroundings without the character, drawn at its belly with a simplified shader; blurred in three
passes; looked up with `N + C * rel_pos`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.talk_cube import CUBE, FAR_BRIGHTNESS, SURROUNDINGS, cube_bound, cube_passes
from realtime.technique import Parameter, Technique
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.model import Scene

C_HEIGHT = Parameter(
    "c_height",
    2.5,
    (0.0, 2.5, 7.0),
    "C times the character's height: 0 far away, 2.5 large room, 7 small room",
    (0, 1000),
    tuned=(0, 10),
    off=0.0,
)
PARAMETERS = (C_HEIGHT, *CUBE, FAR_BRIGHTNESS)


def lookup_uniforms(frame: Frame) -> dict[str, Any]:
    """Of shaders that look up the cube with N + c * (position - centre).

    Raises
    ------
    InputError
        The subject has no height.
    """
    low, high = frame.subject_box
    height, c_height = float(high[1] - low[1]), float(frame.settings[C_HEIGHT.name])
    if c_height > 0 and height == 0:
        raise InputError(
            f"Found c_height = {c_height:g} and a subject without height along y, by which it is divided. Set c_height "
            "to 0, or tilt the subject."
        )
    return {
        "centre": tuple(frame.subject_centre),
        "c": c_height / height if c_height > 0 else 0.0,
        "scale": frame.resources.get(SURROUNDINGS, 0.0),
    }


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        gbuffer_pass(),
        *cube_passes(features, SURROUNDINGS),
        Pass(
            "look up",
            _look_up,
            reads=("position", "normal", "albedo"),
            uses=("cube", SURROUNDINGS),
            writes=("shaded",),
        ),
        resolve_pass("shaded"),
    ]


def _look_up(frame: Frame) -> None:
    shaded = frame.texture(frame.size, 4)
    for unit, name in enumerate(("position", "normal", "albedo")):
        frame.resources[name].use(unit)
    shaded.bind_to_image(0, read=False, write=True)
    with cube_bound(frame, 3) as captured:
        frame.dispatch(frame.program("indirect_talk/lookup.comp", **captured), *frame.size, **lookup_uniforms(frame))
    frame.resources["shaded"] = shaded


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
