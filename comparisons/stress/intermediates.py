"""The shaders of techniques under stress: numbers that are not finite inside them, and numbers with fewer bits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from comparisons.parity import checks_of
from comparisons.stress.half import FLOAT16, Rounded, Rounding
from comparisons.stress.laws import Case, Subject, Tolerance
from comparisons.stress.result import Outcome
from comparisons.stress.stresses import STRESSES as OF_SCENES
from comparisons.stress.stresses import Stress
from comparisons.stress.techniques import Step, library, outcomes_of, small, subjects
from comparisons.stress.watch import Bad, Watch
from realtime.render import Renderer
from scenes.errors import InputError, LightgaugeError, RenderError
from scenes.image import Float64

__all__ = ["STRESSES", "magnitudes", "outcomes", "subjects"]

BY_STRESSES = 4
SHOWN = 3
"""Places that a fault names, of all that are bad."""

NONE_ALLOWED = Tolerance(0.0, "expressions that are not finite", "what hides them may be moved, or optimised away")


def magnitudes(stress: str) -> Sequence[float]:
    """Those of a stress, from mild to harsh."""
    return STRESSES[stress].magnitudes


def outcomes(
    subjects: Sequence[str], step: Step, stresses: Iterable[str] | None = None, at: float | None = None
) -> Iterator[Outcome]:
    """Each technique under each of these stresses, as in `comparisons.stress.techniques.outcomes`."""
    return outcomes_of(STRESSES, subjects, step, STRESSES if stresses is None else stresses, at)


@dataclass(frozen=True)
class Watched(Subject):
    """A subject that is watched while it is drawn: `found` is what was not finite in all its images."""

    found: list[Bad] = field(default_factory=list)

    def draw(self, case: Case) -> Float64:
        watch = Watch()
        try:
            return Subject(self.technique, self.case, self.unit, watch).draw(case)
        finally:
            self.found.extend(watch.found)


def _all_finite(subject: Subject, circle: float) -> float:
    found = _found_under_stress(subject) if circle >= BY_STRESSES else _found_in(subject, _cases(subject, int(circle)))
    worst: dict[tuple[str, int, str], Bad] = {}
    for bad in sorted(found, key=lambda bad: -bad.count):
        worst.setdefault((bad.file, bad.line, bad.text), bad)
    if worst:
        more = f"; and {len(worst) - SHOWN} more" if len(worst) > SHOWN else ""
        raise RenderError("; ".join(map(str, list(worst.values())[:SHOWN])) + more)
    return 0.0


def _found_in(subject: Subject, cases: Iterable[Case]) -> list[Bad]:
    watched = Watched(subject.technique, subject.case, subject.unit)
    for case in cases:
        try:
            watched.draw(case)
        except InputError:
            continue  # a case that the technique refuses in words is none that it gets wrong
        except RenderError:
            if not watched.found:
                raise
    return watched.found


def _found_under_stress(subject: Subject) -> list[Bad]:
    """What is not finite although the law of a stress holds; where it does not, the stress itself tells."""
    found: list[Bad] = []
    for stress in OF_SCENES.values():
        watched = Watched(subject.technique, subject.case, subject.unit)
        tolerance = stress.tolerance or subject.tolerance
        for magnitude in () if stress.unfit(subject) else stress.magnitudes:
            watched.found.clear()
            try:
                holds = stress.law(watched, magnitude) <= tolerance.value
            except LightgaugeError:
                break
            if not holds:
                break
            found += watched.found
    return found


def _cases(subject: Subject, circle: int) -> Iterator[Case]:
    """What a circle adds to those within: the subject's case; its settings' sweeps; all scenes and their choices."""
    if circle <= 1:
        yield subject.case
    elif circle == 2:
        yield from _swept(subject, subject.case, only_choices=False)
    else:
        for scene in library():
            given = [check.settings for check in checks_of(scene) if check.technique == subject.technique.name]
            if not given and any(check.quantity == subject.quantity for check in checks_of(scene)):
                given = [{}]
            for settings in given:
                case = Case(small(scene), settings)
                yield case
                yield from _swept(subject, case, only_choices=True)


def _swept(subject: Subject, case: Case, *, only_choices: bool) -> Iterator[Case]:
    """A case with one setting changed; choices are settings that are no numbers: most of them choose shaders."""
    for parameter in subject.technique.parameters:
        if only_choices and not isinstance(parameter.default, bool | str):
            continue
        for value in parameter.sweep:
            if value != case.settings.get(parameter.name, parameter.default):
                yield replace(case, settings=dict(case.settings) | {parameter.name: value})


def _significand(subject: Subject, bits: float) -> float:
    return subject.difference(_rounded(subject, Rounding(int(bits))), subject.base)


def _half(subject: Subject, share: float) -> float:
    """The error that this share of the pixels on which anything is drawn stays below, over their channels."""
    base, drawn = subject.base, _rounded(subject, FLOAT16)
    squares = np.mean((drawn - base) ** 2, axis=2)[np.any((base != 0) | (drawn != 0), axis=2)]
    return float(np.sqrt(np.quantile(squares, share))) / subject.scale(base)


def _rounded(subject: Subject, rounding: Rounding) -> Float64:
    case = subject.case
    try:
        drawn = Renderer(case.scene, Rounded(rounding)).render(subject.technique, dict(case.settings), timed=False)
    except InputError as error:  # what the technique refuses now it takes in float32: that is a fault
        raise RenderError(str(error)) from error
    return drawn.image.pixels.astype(np.float64)


STRESSES: Mapping[str, Stress] = {
    "intermediates": Stress(
        "every expression of the shaders is asked for NaNs and infinities, which max, min and mix hide from the image",
        "1: its scene, 2: with each value of each setting, 3: all scenes of its quantity, 4: under all other stresses",
        (1, 2, 3, BY_STRESSES),
        _all_finite,
        tolerance=NONE_ALLOWED,
    ),
    "significand": Stress(
        "fragment and compute shaders round every number to fewer bits",
        "bits of significand, the leading one left out; float32 has 23",
        (20, 16, 13, 10, 7),
        _significand,
    ),
    "fp16": Stress(
        "fragment and compute shaders compute in float16: 10 bits of significand, and 65504 at most",
        "part of the pixels whose error stays below",
        (0.5, 0.99),
        _half,
    ),
}
