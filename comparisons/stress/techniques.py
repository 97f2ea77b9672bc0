"""Techniques under stress: each on one small scene, held against laws that its images must keep."""

import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache

from comparisons.parity import checks_of
from comparisons.stress.laws import Case, Subject
from comparisons.stress.result import Outcome, Trial
from comparisons.stress.stresses import STRESSES, Stress
from realtime.own import file_of
from realtime.techniques import MODULES, OWN, technique
from reference.quantities import quantity
from scenes.errors import InputError, MachineError
from scenes.load import library_scenes, load_scene
from scenes.model import Scene
from scenes.shapes import DisplacedIcosphere, Ear, Ellipsoid, Head, Shape

SIDE = 48
"""Pixels along the longer side of an image: what breaks, breaks in a few pixels too."""

FINEST = {Ellipsoid: {"detail": 3}, DisplacedIcosphere: {"detail": 3}}
"""What shapes may have at most: they are made anew for each image."""

Step = Callable[[str, float], None]


def subjects() -> list[str]:
    """Names of all techniques."""
    return [*MODULES, *OWN]


def magnitudes(stress: str) -> Sequence[float]:
    """Those of a stress, from mild to harsh."""
    return STRESSES[stress].magnitudes


def outcomes(
    subjects: Sequence[str], step: Step, stresses: Iterable[str] = STRESSES, at: float | None = None
) -> Iterator[Outcome]:
    """Each technique under each stress, from the mildest magnitude to the first that it fails at, or `at` one alone.

    Raises
    ------
    InputError
        An unknown technique, or one that no scene has a check for.
    """
    return outcomes_of(STRESSES, subjects, step, stresses, at)


def outcomes_of(
    table: Mapping[str, Stress], subjects: Sequence[str], step: Step, stresses: Iterable[str], at: float | None
) -> Iterator[Outcome]:
    """The same for stresses of any table."""
    names = list(stresses)
    for number, name in enumerate(subjects):
        subject = subject_of(name)
        step(name, number / len(subjects))
        subject.require_image()
        for place, stress in enumerate(names):
            step(f"{name}: {stress}", (number + place / len(names)) / len(subjects))
            yield outcome(subject, stress, table[stress], at)


def subject_of(name: str) -> Subject:
    """A technique on the first scene of the library that has a check for it and is quick to make, made small.

    Raises
    ------
    InputError
        There is no such technique, or no such scene.
    """
    found = technique(name)
    scenes = sorted(library(), key=_is_slow)
    for scene in scenes:
        for check in checks_of(scene):
            if check.technique == name:
                return Subject(found, Case(small(scene), check.settings), quantity(found.approximates).unit)
    for scene in scenes:
        if any(check.quantity == found.approximates for check in checks_of(scene)):
            return Subject(found, Case(small(scene), {}), quantity(found.approximates).unit)
    raise InputError(f"No scene of the library has a check for '{name}' or its quantity, {found.approximates}.")


def small(scene: Scene) -> Scene:
    """The scene with few pixels, and with shapes that are quick to make."""
    sensor = scene.sensor
    factor = min(1.0, SIDE / max(sensor.width, sensor.height))
    size = {name: max(1, round(factor * getattr(sensor, name))) for name in ("width", "height")}
    return scene.model_copy(
        update={"sensor": sensor.model_copy(update=size), "shapes": tuple(map(_coarse, scene.shapes))}
    )


def _is_slow(scene: Scene) -> bool:
    """Whether it takes a second to make the scene's shapes, as for an ear."""
    return any(isinstance(shape, Ear | Head) for shape in scene.shapes)


def _coarse(shape: Shape) -> Shape:
    finest = FINEST.get(type(shape), {})
    return shape.model_copy(update={name: min(most, getattr(shape, name)) for name, most in finest.items()})


@cache
def library() -> tuple[Scene, ...]:
    """The scenes of the library."""
    return tuple(load_scene(path) for path in library_scenes().values())


def outcome(subject: Subject, name: str, stress: Stress, at: float | None = None) -> Outcome:
    """A subject under a stress. A magnitude that it refuses, with an explanation, ends the trials: that is no break."""
    tolerance = stress.tolerance or subject.tolerance
    magnitudes = stress.magnitudes if at is None else (at,)
    unfit = stress.unfit(subject)
    trials: list[Trial] = []
    failing: float | None = None
    for magnitude in () if unfit else magnitudes:
        try:
            trial = _trial(subject, stress, magnitude)
        except InputError as error:
            unfit = f"refused at {magnitude:g}: {error}"
            break
        trials.append(trial)
        if trial.error is None or trial.error > tolerance.value:
            failing = magnitude
            break
    return Outcome(
        subject=subject.technique.name,
        stress=name,
        unit=tolerance.unit,
        tolerance=tolerance.value,
        trials=tuple(trials),
        first_failing=failing,
        reproduce="" if failing is None else command(subject.technique.name, name, failing),
        is_rising=stress.is_rising,
        unfit=unfit,
    )


def command(subject: str, stress: str, magnitude: float) -> str:
    """What shows a failure again; a technique of the user's own comes with its file."""
    path = file_of(subject)
    own = f" --technique {shlex.quote(str(path))}" if path else ""
    return f"lightgauge stress {subject} --stress {stress} --at {magnitude:g}{own}"


def _trial(subject: Subject, stress: Stress, magnitude: float) -> Trial:
    """Raises InputError where the technique refuses the scene or a setting for what it is."""
    try:
        return Trial(magnitude, stress.law(subject, magnitude))
    except MachineError as error:
        return Trial(magnitude, None, str(error))
