"""A scene to run, and which of its checks."""

from collections.abc import Callable
from dataclasses import dataclass

from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.parity import checks_of
from comparisons.result import check_id
from scenes.checks import Check
from scenes.model import Scene


@dataclass(frozen=True)
class Request:
    """A scene to run with the chosen checks, parity first; `argument` is what names it on a command line."""

    scene: Scene
    argument: str
    checks: tuple[Check, ...]


def request_of(scene: Scene, argument: str, keep: Callable[[str], bool] = lambda check_id: True) -> Request:
    """The checks of a scene whose names `keep` accepts. Parity comes along with any of them."""
    every = checks_of(scene)
    chosen = [c for c in every if keep(f"{scene.name}/{id_of(c)}")]
    return Request(
        scene, argument, tuple(c for c in every if chosen and (c in chosen or c.quantity in PARITY_QUANTITIES))
    )


def id_of(check: Check) -> str:
    """The name of a check within its scene."""
    return check_id(check.technique, dict(check.settings), check.fit_exposure)
