"""Checks for techniques of a user: which scenes they are judged on, and against which budgets.

A scene that judges the quantity of such a technique, and has no check of it, gets one. Its budgets are those given on
the command line; without any they are borrowed from the best technique that ships.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from comparisons.budgets import GIVEN, parse_budgets
from comparisons.metrics import metric_named
from comparisons.request import id_of
from comparisons.scene_files import find
from realtime.own import file_of, load_own
from realtime.techniques import MODULES, technique
from reference.quantities import quantity
from scenes.checks import Bounds, Check, Criterion
from scenes.errors import InputError
from scenes.load import LIBRARY, library_scenes, load_scene
from scenes.model import Scene
from scenes.paths import shown_path

BORROWED = "borrowed from "

FEW = 5
"""So many scenes are named in a sentence."""


@dataclass(frozen=True)
class Own:
    """Names of techniques that were loaded from the user's files, and the budgets given for them."""

    names: tuple[str, ...] = ()
    budgets: tuple[Criterion, ...] = ()

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """What they approximate, each once."""
        return tuple(dict.fromkeys(technique(name).approximates for name in self.names))

    @property
    def keep(self) -> str:
        """The `-k` expression that means their checks."""
        return " or ".join(f"/{name}$ or /{name}[" for name in self.names)

    def added_to(self, scene: Scene) -> Scene:
        """The scene with a check more for each technique whose quantity it judges, and of which it has none.

        A scene that does not ship and has no check at all judges what there are budgets for.

        Raises
        ------
        InputError
            There is no budget for one of them.
        """
        missing = [name for name in self.names if all(check.technique != name for check in scene.checks)]
        added = [self._check(scene, name) for name in missing if self._is_judged(scene, technique(name).approximates)]
        return scene.model_copy(update={"checks": (*scene.checks, *added)}) if added else scene

    def _is_judged(self, scene: Scene, name: str) -> bool:
        if self.budgets and not scene.checks and scene.folder != LIBRARY:
            return True
        return _judges(scene, name)

    def _check(self, scene: Scene, name: str) -> Check:
        asked = technique(name).approximates
        best = lender(scene, asked)
        criteria = self.budgets or (_lent(best) if best else ())
        if not criteria:
            raise InputError(
                f"Scene '{scene.name}' has no budget for {asked} that '{name}' could borrow from a shipped technique. "
                "Give it one with --budget METRIC=MAX, such as --budget nrmse=0.1, or write a check into the scene."
            )
        return Check(quantity=asked, technique=name, criteria=criteria)

    def nothing_chosen(self, arguments: Sequence[str]) -> InputError:
        """The error for scenes none of which judges the quantities."""
        judging = {
            name: [scene for scene, path in library_scenes().items() if _judges(load_scene(path), name)]
            for name in self.quantities
        }
        there = "; ".join(f"{name}: {', '.join(scenes) or 'none that ships'}" for name, scenes in judging.items())
        return InputError(
            f"{' and '.join(self.names)} approximate{'s' if len(self.names) == 1 else ''} "
            f"{' and '.join(self.quantities)}. No check of {', '.join(arguments) or 'the shipped scenes'} asks for "
            f"that. Scenes that have one for {there}. A scene of your own needs a check of the "
            "quantity, or none at all and --budget METRIC=MAX."
        )

    def notes(self, arguments: Sequence[str], chosen: Collection[str], scenes: Sequence[Scene]) -> Iterator[str]:
        """What is said about scenes without a check of these techniques, and techniques without a scene.

        Parameters
        ----------
        arguments : name the scenes on a command line
        chosen : names of those that have a check
        scenes : those that are run
        """
        if not self.names:
            return
        found = [file.name for file in find(arguments).scenes]
        if passed := [name for name in found if name not in chosen]:
            which = ", ".join(passed) if len(passed) <= FEW else f"{len(passed)} of {len(found)} scenes"
            yield f"not judged, since no check there asks for {' or '.join(self.quantities)}: {which}"
        judged = {check.technique for scene in scenes for check in scene.checks}
        for name in self.names:
            if scenes and name not in judged:
                yield f"not judged, since no scene of this run asks for {technique(name).approximates}: {name}"


NO_OWN = Own()


def load_techniques(paths: Iterable[Path], budgets: Iterable[str] = ()) -> Own:
    """The techniques in files of a user, and budgets as on the command line.

    Raises
    ------
    InputError
        A file or a budget is faulty, or there are budgets for no technique.
    """
    given = parse_budgets(budgets)
    names = tuple(dict.fromkeys(name for path in paths for name in load_own(path)))
    if given and not names:
        raise InputError("--budget holds for techniques of your own only. Name their file with --technique.")
    for name in names:
        _require_quantity(name)
    return Own(names, given)


def _require_quantity(name: str) -> None:
    used = technique(name)
    path = shown_path(file_of(name) or Path())
    try:
        wanted = quantity(used.approximates).channels
    except InputError as error:
        raise InputError(f"{path}: '{name}' approximates '{used.approximates}'. {error}") from error
    if len(used.channels) != wanted:
        raise InputError(
            f"{path}: '{name}' gives {len(used.channels)} of the channels of its image; {used.approximates} has "
            f"{wanted}. Set channels to {wanted} in the card of a shader, to {tuple(range(wanted))} in a Technique."
        )


def lender(scene: Scene, name: str) -> Check | None:
    """The check whose budgets for a quantity are borrowed: of those of shipped techniques, the tightest first one."""
    shipped = [check for check in scene.checks if check.quantity == name and check.technique in MODULES]
    lending = {index: lent for index, check in enumerate(shipped) if not check.fit_exposure and (lent := _lent(check))}
    best = min(lending, key=lambda index: lending[index][0].max or 0.0, default=None)
    return None if best is None else shipped[best]


def _lent(check: Check) -> tuple[Criterion, ...]:
    """The criteria of a check for a technique that is to be as good, and may be better."""
    reason = f"{BORROWED}{id_of(check)}: as good as the best that ships"
    return tuple(c for c in (_as_good(criterion, reason) for criterion in check.criteria) if c)


def _as_good(criterion: Criterion, reason: str) -> Criterion | None:
    bounds = _best_side(criterion, criterion.metric)
    if bounds is None:
        return None
    elsewhere = ((other, _best_side(other, criterion.metric)) for other in criterion.by_renderer)
    by_renderer = tuple(
        other.model_copy(update={"min": side[0], "max": side[1], "reason": reason}) for other, side in elsewhere if side
    )
    return Criterion(metric=criterion.metric, min=bounds[0], max=bounds[1], reason=reason, by_renderer=by_renderer)


def _best_side(bounds: Bounds, metric: str) -> tuple[float | None, float] | None:
    """The bounds without what says that a metric may not be better; None if nothing is left."""
    if metric_named(metric).is_signed:
        size = max(abs(bound) for bound in (bounds.min, bounds.max) if bound is not None)
        return -size, size
    return None if bounds.max is None else (None, bounds.max)


def _judges(scene: Scene, name: str) -> bool:
    return any(check.quantity == name for check in scene.checks)


def origins_of(scene: Scene, check: Check) -> tuple[tuple[Check, int] | None, ...]:
    """For each criterion the check that it is written in and its number there; None if it is on the command line."""
    lending = lender(scene, check.quantity)
    return tuple(_origin(check, number, criterion, lending) for number, criterion in enumerate(check.criteria))


def _origin(check: Check, number: int, criterion: Criterion, lending: Check | None) -> tuple[Check, int] | None:
    if criterion.reason == GIVEN:
        return None
    if lending is not None and criterion.reason.startswith(BORROWED):
        return lending, [other.metric for other in lending.criteria].index(criterion.metric)
    return check, number
