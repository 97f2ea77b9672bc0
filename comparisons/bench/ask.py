"""What the command line asks a benchmark for, as parts of work."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from comparisons.bench.measure import Pace
from comparisons.bench.plan import Part, ablation_part, points_part, scaling_part
from comparisons.bench.scenes import SCENES, effects_named, spelt
from comparisons.bench.sweep import approximating, at_size, batches
from comparisons.expression import Keep, keep_of
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.request import Request
from comparisons.selection import names_of, select
from reference.quantities import effect_of
from scenes.errors import InputError

LARGEST = 16384
"""Pixels along a side; no GPU has larger textures."""

EVERY = "/"
"""A `-k` expression that keeps every check: this is in the name of each."""


@dataclass(frozen=True)
class Asked:
    """`effects` and `scenes` in place of those that stand for them, as they were written; `size` is WxH or empty."""

    effects: tuple[str, ...]
    scenes: tuple[str, ...]
    keep: str
    size: str
    pace: Pace
    only: tuple[str, ...]


def parts_of(asked: Asked) -> list[Part]:
    """What there is to do, effect by effect.

    Raises
    ------
    InputError
        An effect, a scene or the size is none, or no technique is left.
    """
    if asked.pace.frames < 1 or not 0 < asked.pace.seconds < math.inf:
        raise InputError(
            f"--frames is {asked.pace.frames} and --seconds-per-point is {asked.pace.seconds:g}; allowed are at least "
            "1 frame and more than 0 seconds, but not infinitely many."
        )
    size = _size(asked.size)
    keep = keep_of(asked.keep)
    effects = effects_named(asked.effects)
    parts = [
        part
        for effect in effects
        for request in select(asked.scenes or tuple(SCENES[effect]), EVERY)
        for part in _parts(asked, effect, request, size, keep)
    ]
    if not parts:
        meant = f"matches '{asked.keep}'" if asked.keep else "is judged there"
        raise InputError(
            f"There is nothing to measure: no technique of {', '.join(map(spelt, effects))} on "
            f"{', '.join(asked.scenes) or 'the scenes that stand for that'} {meant}. `lightgauge list` "
            "names the techniques, `lightgauge explain SCENE` says which quantities a scene judges."
        )
    return parts


def _parts(asked: Asked, effect: str, request: Request, size: tuple[int, int] | None, keep: Keep) -> Iterator[Part]:
    """What there is to do for an effect on one scene."""
    scene = at_size(request.scene, *size) if size else request.scene
    judged = [check for check in request.checks if check.quantity not in PARITY_QUANTITIES]
    checks = [check for check in judged if effect_of(check.quantity) == effect]
    used = [
        one.name
        for name in dict.fromkeys(check.quantity for check in checks)
        for one in approximating(name, checks)
        if keep(names_of(f"{scene.name}/{one.name}", name))
    ]
    if "points" in asked.only:
        for batch in batches(scene, checks, effect, keep, with_sizes=not size):
            yield points_part(batch, request.argument, asked.pace)
    if "scaling" in asked.only:
        yield from (scaling_part(scene, name) for name in used)
    if "ablation" in asked.only:
        first = {check.technique: check for check in reversed(checks) if not check.fit_exposure}
        yield from (ablation_part(scene, first[name]) for name in used if name in first)


def _size(text: str) -> tuple[int, int] | None:
    if not text:
        return None
    found = re.fullmatch(r"(\d+)x(\d+)", text.strip())
    size = (int(found[1]), int(found[2])) if found else (0, 0)
    if not all(1 <= side <= LARGEST for side in size):
        raise InputError(
            f"--size is '{text}'; allowed is a width and a height in pixels, such as 1280x1024, "
            f"each from 1 to {LARGEST}."
        )
    return size
