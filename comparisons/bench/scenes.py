"""Which scenes stand for an effect: two that are drawn differently, with truths that are cheap to have."""

from collections.abc import Mapping, Sequence

from scenes.errors import InputError

SCENES: Mapping[str, Mapping[str, str]] = {
    "indirect light": {
        "small-room-ellipsoid": "a convex subject: its light changes along it, and it neither hides nor lights itself",
        "small-room-knot": "a subject that hides a good part of its surroundings from itself, and is lit by itself",
    },
    "eye": {
        "eye-human-view30-light40": "an eye with the measures of a human one, which refracts twice",
        "eye-talk-view30-light40": "the eye that the talk's shader was written for",
    },
    "translucency": {
        "skin-ear": "a thin membrane, where thickness is nearly all that matters",
        "skin-sphere": "a thick body, which light leaves on all sides",
    },
    "defocus": {
        "defocus-crisp-foreground": "two distances: what two layers are made for",
        "defocus-row": "things at all distances, which no few layers can hold apart",
    },
    "shadows": {
        "shadow-room": "a point light: hard shadows",
        "shadow-room-5cm": "a lamp of some size: soft shadows",
    },
    "whole frame": {
        "shadow-room": "everything that the talk draws of a character and its surroundings, put together",
    },
}
"""For each effect its scenes, by name, and the reason for each."""


def spelt(effect: str) -> str:
    """An effect as it is written on a command line.

    >>> spelt("indirect light")
    'indirect-light'
    """
    return effect.replace(" ", "-")


def effects_named(arguments: Sequence[str]) -> tuple[str, ...]:
    """The effects that are meant, each once; all if there are no arguments. The beginning of a name suffices.

    Raises
    ------
    InputError
        An argument is the beginning of no effect, or of several.

    >>> effects_named(["ind", "eye"])
    ('indirect light', 'eye')
    """
    return tuple(dict.fromkeys(_effect(argument) for argument in arguments)) or tuple(SCENES)


def _effect(argument: str) -> str:
    wanted = argument.casefold().replace(" ", "-")
    meant = [effect for effect in SCENES if wanted and spelt(effect).startswith(wanted)]
    if len(meant) != 1:
        raise InputError(
            f"'{argument}' names {'several effects' if meant else 'no effect'}; allowed are "
            f"{', '.join(map(spelt, SCENES))}, or the beginning of one of them. A scene is named with --scene."
        )
    return meant[0]
