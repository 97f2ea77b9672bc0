"""A look: a file that sets all sliders of a technique together.

    technique = "layered.talk"
    name = "mine.suit"
    summary = "the captain's suit, fitted to our own material"

    [sliders]
    layer1_diffuse = 0.7
    layer2_alpha = [0.1, 0.0, 0.0, 0.9]

A slider is one number, or as many as it has components: the constant, and what each texture adds to it.
"""

import json
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError

from realtime.technique import LOOK, Parameter, Technique
from scenes.checks import Sentence
from scenes.errors import InputError, unknown_name
from scenes.lines import KeyPath, key_lines, line_of
from scenes.strict import Strict

TEXTURES = 3
"""How many textures a slider may be driven by."""

Components = Annotated[tuple[float, ...], Field(min_length=1 + TEXTURES, max_length=1 + TEXTURES)]


class Look(Strict):
    """What a file says; sliders that it does not name stay at their defaults."""

    technique: Annotated[str, Field(min_length=1)]
    name: Annotated[str, Field(min_length=1)]
    summary: Sentence
    sliders: dict[str, float | Components]

    @property
    def values(self) -> dict[str, float]:
        """The value of each component by its name."""
        given = {name: value if isinstance(value, tuple) else (value,) for name, value in self.sliders.items()}
        return {
            component: value
            for name, values in given.items()
            for component, value in zip(components(name), values, strict=False)
        }


def components(slider: str) -> tuple[str, ...]:
    """The names of a slider's components: the constant has its own.

    >>> components("level")
    ('level', 'level_texture1', 'level_texture2', 'level_texture3')
    """
    return (slider, *(f"{slider}_texture{k}" for k in range(1, 1 + TEXTURES)))


def with_components(slider: Parameter) -> tuple[Parameter, ...]:
    """A slider, and what each of the textures adds to it: nothing by default."""
    constant, *driven = components(slider.name)
    least, most = slider.bounds
    width = most - least
    return (
        replace(slider, name=constant),
        *(
            Parameter(name, 0.0, (), f"what the green of texture {k} adds to {slider.name}", (-width, width))
            for k, name in enumerate(driven, 1)
        ),
    )


def constants_of(technique: Technique) -> tuple[Parameter, ...]:
    """The sliders of a technique, less what textures add to them."""
    return technique.sliders[:: 1 + TEXTURES]


def read_look(text: str, shown: str) -> Look:
    """The look in a file's text.

    Raises
    ------
    InputError
        One line for each thing that is wrong: FILE:LINE: KEY: what was found and what is allowed.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{shown}: the look is no valid TOML: {error}. Mend it.") from error
    try:
        return Look.model_validate_json(json.dumps(document, default=str))
    except ValidationError as error:
        lines = key_lines(text)
        complaints = _complaints(error)
        raise InputError(
            "\n".join(f"{shown}:{line_of(lines, path)}: {said}" for path, said in complaints.items())
        ) from error


def _complaints(error: ValidationError) -> dict[KeyPath, str]:
    complaints: dict[KeyPath, str] = {}
    for details in error.errors(include_url=False):
        path = tuple(part for part in details["loc"][:2] if part != "[key]")
        key, kind = ".".join(map(str, path)), details["type"]
        if kind in ("missing", "extra_forbidden"):
            said = "is missing" if kind == "missing" else "is an unknown key"
            complaints[path] = f"{key}: {said}. A look has {', '.join(Look.model_fields)}."
        elif path[0] == "sliders" and len(path) == 2:
            found = details["input"]
            complaints.setdefault(
                path,
                f"{key}: found {found!r:.60}; allowed is a number, or {1 + TEXTURES}: a constant, and what each "
                "texture adds to it.",
            )
        else:
            complaints.setdefault(path, f"{key}: found {details['input']!r:.60}; {details['msg']}.")
    return complaints


def values_for(technique: Technique, look: Look, shown: str) -> dict[str, float]:
    """The values of a look, once they are seen to be sliders of the technique that are within their bounds.

    Raises
    ------
    InputError
        One is not.
    """
    if look.technique != technique.name:
        raise InputError(f"{shown}: the look is one of '{look.technique}', and not of '{technique.name}'.")
    if not technique.sliders:
        raise InputError(f"{shown}: '{technique.name}' has no sliders, which a look sets. Name another technique.")
    known = [slider.name for slider in constants_of(technique)]
    for name in look.sliders:
        if name not in known:
            raise InputError(f"{shown}: {unknown_name(f'slider of {technique.name}', name, known)}")
    try:
        technique.settings(look.values)
    except InputError as error:
        raise InputError(f"{shown}: {error}") from error
    return look.values


def technique_of(look: Look, base: Technique, shown: str) -> Technique:
    """The technique that a look makes of another one: the look's values are the defaults.

    Raises
    ------
    InputError
        The look does not suit it.
    """
    values = values_for(base, look, shown)
    return replace(
        base,
        name=look.name,
        summary=look.summary,
        parameters=tuple(p for p in base.parameters if p.name != LOOK),
        sliders=tuple(replace(slider, default=values.get(slider.name, slider.default)) for slider in base.sliders),
        looks={},
        look_of=base.name,
    )


def look_text(look: Look) -> str:
    """The file that `read_look` reads."""
    head = "".join(f"{key} = {json.dumps(getattr(look, key))}\n" for key in ("technique", "name", "summary"))
    return head + "\n[sliders]\n" + "".join(f"{name} = {json.dumps(value)}\n" for name, value in look.sliders.items())


def look_of(technique: Technique, name: str, summary: str, settings: Mapping[str, float]) -> Look:
    """The look that the sliders among some settings make; one that no texture drives is written as one number."""
    sliders: dict[str, float | tuple[float, ...]] = {}
    for slider in constants_of(technique):
        values = tuple(float(settings[component]) for component in components(slider.name))
        sliders[slider.name] = values if any(values[1:]) else values[0]
    return Look(technique=technique.look_of or technique.name, name=name, summary=summary, sliders=sliders)


def with_looks(technique: Technique, files: Iterable[Path]) -> Technique:
    """The technique with looks from files, whose names are theirs."""
    looks = {
        path.stem: values_for(technique, read_look(path.read_text(encoding="utf-8"), path.name), path.name)
        for path in files
    }
    return replace(technique, looks=looks)
