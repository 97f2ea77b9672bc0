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
    "displacement": {
        "relief-gravel-60deg": "fine stones that hide and shade one another: the talk's kind of field",
        "relief-bumps-60deg": "smooth hills, the kind of field that parallax mapping is meant for",
    },
    "layered suit": {
        "suit-plastic-held2": "metal flakes over a rough film over pigment, each a layer of its own",
        "suit-clearcoat-held2": "a principled material with a clear coat, in one evaluation",
    },
    "hair": {
        "hair-limb-90": "where hair stands on a skin that bulges and bends, and which way",
        "hair-width-025": "what hair covers that is a quarter of a pixel wide",
        "hair-light-dark-side": "the light of dark hair, most of which was scattered by one hair alone",
        "hair-light-blond-side": "the light of light hair, most of which went from hair to hair",
    },
    "character": {
        "character": "all effects at once: what each of them is worth in one picture",
        "character-bust": "skin, eyes, suit and bricks alone, through a pinhole",
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
