"""Refuse checks that cannot be run, before anything is rendered for any of them."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from comparisons.baseline import read_accepted
from comparisons.metrics import metric_named
from comparisons.places import file_of
from comparisons.request import Request
from realtime.techniques import technique
from reference.quantities import quantity
from scenes.checks import Check, Criterion
from scenes.errors import InputError
from scenes.lines import key_lines, line_of
from scenes.load import dotted
from scenes.paths import shown_path

Fault = tuple[tuple[str | int, ...], str]
"""Where in a check, and what is wrong there."""


def validate(requests: Iterable[Request]) -> None:
    """See that every quantity, technique, setting and metric exists and that they go together.

    Raises
    ------
    InputError
        All that is wrong, one a line, each with its file, line and key.
    """
    asked = list(requests)
    for folder in {request.scene.folder for request in asked}:
        read_accepted(folder)
    faults = [fault for request in asked for fault in _of_scene(request)]
    named: dict[str, str] = {}
    for request in asked:
        first = named.setdefault(request.scene.name, request.argument)
        if first != request.argument:
            faults.append(same_name(request.argument, first))
    if faults:
        raise InputError("\n".join(faults))


def require_sound(request: Request) -> None:
    """As `validate`, for the checks of one scene alone, without what is accepted for them.

    Raises
    ------
    InputError
        All that is wrong, one a line.
    """
    if faults := list(_of_scene(request)):
        raise InputError("\n".join(faults))


def same_name(argument: str, first: str) -> str:
    """What is wrong with the second of two scenes of one name."""
    return f"{argument}: {first} has the same name, and results go by it. Rename one, or run them apart."


def _of_scene(request: Request) -> Iterator[str]:
    scene = request.scene
    path = file_of(scene)
    faults = [
        (("checks", index, *where), what)
        for index, check in enumerate(scene.checks)
        if check in request.checks
        for where, what in faults_of(check)
    ]
    lines = key_lines(path.read_text(encoding="utf-8")) if faults else {}
    for key, what in faults:
        yield f"{shown_path(path)}:{line_of(lines, key)}: {dotted(key)}: {what}"


def faults_of(check: Check) -> Iterator[Fault]:
    """What is wrong with a check, whatever its scene."""
    attempts: list[tuple[tuple[str | int, ...], Callable[[], Any]]] = [
        (("quantity",), lambda: quantity(check.quantity)),
        (("technique",), lambda: technique(check.technique)),
        *((("criteria", i, "metric"), lambda c=c: _require_sound_budget(c)) for i, c in enumerate(check.criteria)),
    ]
    faults = [(where, said) for where, attempt in attempts if (said := _complaint(attempt))]
    yield from faults
    if {("quantity",), ("technique",)} & {where for where, _ in faults}:
        return
    used = technique(check.technique)
    if said := _complaint(lambda: used.settings(check.settings)):
        yield ("settings",), said
    if used.approximates != check.quantity:
        yield (
            ("technique",),
            f"found '{check.technique}', which approximates '{used.approximates}', but the check asks for "
            f"'{check.quantity}'. Use one quantity for both.",
        )


def _require_sound_budget(criterion: Criterion) -> None:
    """See that the metric exists, and that its budget says how wrong an image may be."""
    metric = metric_named(criterion.metric)
    is_open = any(bounds.max is None for bounds in (criterion, *criterion.by_renderer))
    if is_open and not metric.is_signed:
        raise InputError(
            f"found only min for '{criterion.metric}', which is best at its least: any worse image would pass. Give "
            "max, or both."
        )


def _complaint(attempt: Callable[[], Any]) -> str:
    try:
        attempt()
    except InputError as error:
        return str(error)
    return ""
