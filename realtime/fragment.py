"""A technique from one fragment shader of a user, whose first comment describes it: see docs/your-technique.md."""

import json
import math
import re
import tomllib
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from realtime.capture import bind_lights
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.shader import OwnShaders, load, set_uniforms
from realtime.shadows import lights_pass, shadow_pass
from realtime.sky import sky_texture
from realtime.technique import Parameter, Technique
from realtime.views import SHADING, SHADING_USES, background
from scenes.checks import SettingValue
from scenes.errors import InputError, RenderError
from scenes.features import Features
from scenes.lines import KeyPath, key_lines, line_of
from scenes.model import Scene
from scenes.strict import Strict

CARD = re.compile(r"\A\s*(?:#version[^\n]*\s*)?/\*(.*?)\*/", re.DOTALL)
VERSION = re.compile(r"^\s*#version\s", re.MULTILINE)
LIGHTS, SKY = "indirect/direct_light.glsl", "own/sky.glsl"
"""Files whose inclusion means that the shader gets what they read."""

SKY_UNIT = 4

BOXES = ("subject_low", "subject_high", "scene_low", "scene_high")

BY_LIGHTGAUGE = frozenset(
    {"world_to_clip", "eye", "forward", "is_subject", *BOXES}
    | {"emission", "reflectance_map", "emission_map", "shadow_atlas", "light_count", "scene_radius", "shadow_side"}
    | {"sky_map"}
)
"""The uniforms that are not parameters."""

GL_TYPES = {bool: 0x8B56, int: 0x1404, float: 0x1406}
"""What OpenGL calls a uniform of a parameter's type: GL_BOOL, GL_INT, GL_FLOAT."""

Words = Annotated[str, Field(min_length=1)]
Value = bool | int | float


class Uniform(Strict):
    """A parameter: a uniform of the same name, whose type is that of `default`."""

    default: Value
    summary: Words
    sweep: tuple[Value, ...] = ()
    bounds: tuple[float, float] = (-math.inf, math.inf)
    tuned: tuple[float, float] | None = None

    @property
    def kind(self) -> type[Value]:
        return type(self.default)

    @model_validator(mode="after")
    def _is_of_one_type(self) -> Self:
        allowed = (int, float) if self.kind is float else (self.kind,)
        if any(type(value) not in allowed for value in self.sweep):
            raise ValueError(f"every value of sweep must be a {self.kind.__name__}, as default is")
        least, most = self.bounds
        if not all(least <= value <= most for value in (self.default, *self.sweep)):
            raise ValueError("default and sweep must lie within bounds, which are the least and the most")
        if self.tuned and not (self.kind is not bool and least <= self.tuned[0] < self.tuned[1] <= most):
            raise ValueError("tuned is the least and the most value of a number to be fitted, within bounds")
        return self

    def parameter(self, name: str) -> Parameter:
        sweep = tuple(self.kind(value) for value in self.sweep or (self.default,))
        return Parameter(name, self.default, sweep, self.summary, self.bounds, tuned=self.tuned)


class Card(Strict):
    """What the comment says.

    draws    : the meshes that the shader is run on
    channels : how many of red, green and blue the quantity is
    grid     : samples along each side of a pixel
    """

    name: Words
    approximates: Words
    summary: Words
    source: Words
    limits: Words
    draws: Literal["subject", "everything"] = "subject"
    channels: Annotated[int, Field(ge=1, le=3)] = 3
    grid: Annotated[int, Field(ge=1, le=8)] = 2
    parameters: dict[Annotated[str, Field(pattern=r"^[A-Za-z]\w*$")], Uniform] = {}  # noqa: RUF012  # pydantic copies it


def fragment_technique(name: str, shaders: OwnShaders) -> tuple[Technique]:
    """The technique of a fragment shader, which is among `shaders` by its `name`.

    Raises
    ------
    InputError
        It has no #version line, or no valid card.
    """
    shown, text = shaders.shown(name), shaders.texts[name]
    if not VERSION.search(text):
        raise InputError(f"{shown}: found no #version line. Write #version 430 before or after the card.")
    card = _card(shown, text)
    try:
        used = frozenset(file for file, _ in load(name, own=shaders).lines)
    except RenderError as error:
        raise InputError(str(error)) from error
    lighting = SHADING if LIGHTS in used else ()
    for taken in {*BY_LIGHTGAUGE, *(p.name for p in lighting)} & set(card.parameters):
        raise InputError(
            f"{shown}: the parameter '{taken}' has a name that lightgauge uses itself. Choose another one."
        )

    def passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
        return [
            *(_light_passes(features, settings) if lighting else ()),
            Pass(
                "shade",
                lambda frame: _shade(frame, name, card, used),
                uses=SHADING_USES if lighting else (),
                writes=("shaded",),
            ),
            resolve_pass("shaded"),
        ]

    return (
        Technique(
            name=card.name,
            approximates=card.approximates,
            summary=card.summary,
            source=card.source,
            limits=card.limits,
            passes=passes,
            parameters=(*(uniform.parameter(key) for key, uniform in card.parameters.items()), *lighting),
            channels=tuple(range(card.channels)),
            grid=card.grid,
        ),
    )


def _card(shown: str, text: str) -> Card:
    found = CARD.match(text)
    if found is None:
        raise InputError(f"{shown}:1: found no card. Begin with a comment /* ... */ that holds TOML: {_keys(Card)}.")
    above = text[: found.start(1)].count("\n")
    try:
        document = tomllib.loads(found[1])
    except tomllib.TOMLDecodeError as error:
        said, _, line = str(error).partition(" (at line ")
        number = above + int(line.partition(",")[0]) if line else text[: found.end(1)].count("\n") + 1
        raise InputError(
            f"{shown}:{number}: the card is no valid TOML: {said[0].lower()}{said[1:]}. Mend it."
        ) from error
    try:
        return Card.model_validate_json(json.dumps(document, default=str))
    except ValidationError as error:
        lines = key_lines(found[1])
        complaints = (f"{shown}:{above + line_of(lines, path)}: {said}" for path, said in _complaints(error).items())
        raise InputError("\n".join(complaints)) from error


def _complaints(error: ValidationError) -> dict[KeyPath, str]:
    """What is wrong with a card, by the key."""
    complaints: dict[KeyPath, str] = {}
    for details in error.errors(include_url=False):
        kind = details["type"]
        path = tuple(part for part in details["loc"] if part not in ("[key]", "bool", "int", "float"))
        if kind in ("missing", "extra_forbidden"):
            said = "is missing." if kind == "missing" else "is an unknown key."
            said += f" A card has {_keys(Card)}; a parameter has {_keys(Uniform)}."
        elif kind == "value_error":
            said = f"{details['ctx']['error']}."
        elif path != details["loc"] and kind.endswith("_type"):
            said = f"found {details['input']!r:.60}; a number or a truth value is allowed."
        else:
            said = f"found {details['input']!r:.60}; {details['msg'].replace('Input should be', 'it must be')}."
        complaints.setdefault(path, f"{'.'.join(map(str, path))}: {said}")
    return complaints


def _keys(model: type[Strict]) -> str:
    """The keys of a table, those in brackets that may be left out."""
    return ", ".join(key if field.is_required() else f"[{key}]" for key, field in model.model_fields.items())


def _light_passes(features: Features, settings: Mapping[str, SettingValue]) -> tuple[Pass, Pass]:
    side, facets = (int(settings[parameter.name]) for parameter in SHADING)
    unlit = "" if features.has_local_or_directional_lights else "no emitter but the sky: nothing casts a shadow map"
    return lights_pass(facets), shadow_pass(side, skip=unlit)


def _shade(frame: Frame, name: str, card: Card, used: frozenset[str]) -> None:
    context = frame.context
    shader = frame.program("raster/mesh.vert", name)
    _require_matching(shader, frame.shaders.shown(name), card)
    shaded = frame.texture(frame.size, 4)
    framebuffer = context.framebuffer([shaded], context.depth_renderbuffer(frame.size))
    framebuffer.use()
    frame.submit(framebuffer.clear, *(background(frame) if card.draws == "everything" else ()))
    context.enable_only(context.DEPTH_TEST)
    set_uniforms(shader, **_boxes(frame))
    set_uniforms(shader, **{key: uniform.kind(frame.settings[key]) for key, uniform in card.parameters.items()})
    if LIGHTS in used:
        set_uniforms(shader, **bind_lights(frame))
    if SKY in used:
        _bind_sky(frame)
    frame.draw(shader, frame.camera, lambda mesh: mesh.is_subject or card.draws == "everything")
    frame.resources["shaded"] = shaded


def _boxes(frame: Frame) -> dict[str, tuple[float, ...]]:
    points = np.concatenate([mesh.surface.positions for mesh in frame.meshes]).astype(float)
    corners = (*frame.subject_box, points.min(axis=0), points.max(axis=0))
    return dict(zip(BOXES, map(tuple, corners), strict=True))


def _bind_sky(frame: Frame) -> None:
    sky_texture(frame).use(SKY_UNIT)


def _require_matching(shader: Any, shown: str, card: Card) -> None:
    """See that every uniform gets a value, and every parameter reaches one of its type.

    Raises
    ------
    InputError
        One does not.
    """
    import moderngl

    uniforms = {key: shader[key] for key in shader if isinstance(shader[key], moderngl.Uniform)}
    for key in uniforms:
        if key not in card.parameters and key not in BY_LIGHTGAUGE:
            raise InputError(
                f"{shown}: nothing gives the uniform '{key}' a value. Write it under [parameters.{key}] of the card, "
                "or use what own/interface.glsl declares."
            )
    for key, parameter in card.parameters.items():
        if key not in uniforms:
            raise InputError(
                f"{shown}: the parameter '{key}' changes nothing: the shader has no uniform of that name that it uses. "
                f"Declare `uniform {parameter.kind.__name__} {key};` and use it, or remove it from the card."
            )
        if uniforms[key].gl_type != GL_TYPES[parameter.kind] or uniforms[key].array_length != 1:
            raise InputError(
                f"{shown}: the uniform '{key}' is of another type than its default in the card, {parameter.default!r}. "
                f"Declare `uniform {parameter.kind.__name__} {key};`, or change the default."
            )
