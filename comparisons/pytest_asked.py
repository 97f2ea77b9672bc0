"""What a test asks for: a check that its scene has, another one, or one with other budgets."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import ValidationError

from comparisons.parity import checks_of
from comparisons.request import Request, id_of, request_of
from comparisons.result import check_id
from comparisons.validate import faults_of, validate
from realtime.techniques import technique
from scenes.checks import Check, Criterion, SettingValue
from scenes.errors import InputError
from scenes.load import find_scene, load_scene
from scenes.model import Scene
from scenes.paths import shown_path

GIVEN = "given in test"
"""The reason of a budget that a test gives."""


@dataclass(frozen=True)
class Asked:
    """The arguments of `lightgauge.check`, other than the scene."""

    technique: str
    settings: Mapping[str, SettingValue] | None = None
    fit_exposure: bool = False
    max: Mapping[str, float] = field(default_factory=dict)
    min: Mapping[str, float] = field(default_factory=dict)

    @property
    def given(self) -> tuple[str, ...]:
        """The metrics whose budgets stand in the test."""
        return tuple(dict.fromkeys([*self.max, *self.min]))


@dataclass(frozen=True)
class Case:
    """A check as a test asks for it; `given` are the metrics whose budgets stand in the test."""

    request: Request
    check: Check
    given: tuple[str, ...] = ()


def cases_of(path: Path) -> list[Case]:
    """All checks of a scene file, parity first.

    Raises
    ------
    InputError
        The scene cannot be run; the message says where the mistakes are.
    """
    request = request_of(load_scene(path), shown_path(path))
    validate([request])
    return [Case(request, check) for check in request.checks]


def case_of(scene: str | Path, folder: Path, asked: Asked) -> Case:
    """The check that the arguments of `lightgauge.check` mean, in a test whose file lies in `folder`.

    Raises
    ------
    InputError
        There is no such scene or technique, or it is not clear which check or which budgets are meant.
    """
    _require_tables(asked)
    quantity = technique(asked.technique).approximates
    named = find_scene(str(scene))
    path = folder / named
    request = request_of(load_scene(path), str(scene) if named.is_absolute() else shown_path(path))
    meant = _meant(request.scene, asked)
    check = _with_budgets(asked, quantity, meant) if asked.given else meant
    if check is None:
        name = check_id(asked.technique, dict(asked.settings or {}), asked.fit_exposure)
        raise InputError(
            f"The scene {request.scene.name} has no check {name}; its checks are "
            f"{', '.join(map(id_of, checks_of(request.scene)))}. Name one of these, or give a budget, as in "
            "max={'nrmse': 0.05}."
        )
    faults = [what for _, what in faults_of(check)]
    if faults:
        raise InputError("\n".join(faults))
    return Case(request, check, asked.given)


def _require_tables(asked: Asked) -> None:
    examples = {"settings": "{'side': 24}", "max": "{'nrmse': 0.05}", "min": "{'energy_bias': -0.1}"}
    for name, example in examples.items():
        found = getattr(asked, name)
        if not isinstance(found, Mapping | None):
            raise InputError(f"{name}: found {found!r:.60}; allowed is a dict by name, as in {name}={example}.")


def _meant(scene: Scene, asked: Asked) -> Check | None:
    """The only check of the scene that fits; None if none does."""
    fitting = [
        check
        for check in checks_of(scene)
        if (check.technique, check.fit_exposure) == (asked.technique, asked.fit_exposure)
        and asked.settings in (None, check.settings)
    ]
    if len(fitting) > 1:
        raise InputError(
            f"The scene {scene.name} has several such checks: {', '.join(map(id_of, fitting))}. Say which one is "
            "meant with settings={...}."
        )
    return fitting[0] if fitting else None


def _with_budgets(asked: Asked, quantity: str, meant: Check | None) -> Check:
    """The check with the budgets of the test in place of its own for the same metrics, or one with these alone."""
    own = {criterion.metric: criterion for criterion in meant.criteria} if meant else {}
    try:
        return Check(
            quantity=quantity,
            technique=asked.technique,
            settings=dict(meant.settings if meant else asked.settings or {}),
            fit_exposure=asked.fit_exposure,
            criteria=(
                *(criterion for metric, criterion in own.items() if metric not in asked.given),
                *(_criterion(metric, asked, own.get(metric)) for metric in asked.given),
            ),
        )
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = "".join(f"{part}: " for part in first["loc"])
        raise InputError(
            f"{where}{first['msg'].removeprefix('Value error, ')}. Allowed are finite numbers as budgets, max no less "
            "than min, and true, false, numbers and texts as settings. Give such."
        ) from error


def _criterion(metric: str, asked: Asked, own: Criterion | None) -> Criterion:
    """A bound that the test does not give stays as the check has it."""
    return Criterion(
        metric=metric,
        max=asked.max.get(metric, own.max if own else None),
        min=asked.min.get(metric, own.min if own else None),
        reason=GIVEN,
    )
