"""How long checks took, remembered beside the truth: what a run will take is estimated from that.

`times.json` holds seconds by the name of the check: of the last time its truth had to be rendered, and of the last time
its truth was at hand.
"""

import json
from collections.abc import Iterable
from enum import StrEnum
from functools import cache
from pathlib import Path

from comparisons.cache import CheckCache
from comparisons.gate import Verdict
from comparisons.request import Request, id_of
from comparisons.result import CheckResult
from reference.estimator import truth_parts
from reference.store import Store, write_text
from scenes.checks import Check
from scenes.digest import digest_of, scene_parts
from scenes.errors import LightgaugeError
from scenes.model import Scene

FILE_NAME = "times.json"


class Work(StrEnum):
    """What there is to do for a check. Nothing, if it is finished in the store."""

    NOTHING = "nothing"
    JUDGE = "judge"
    RENDER_AND_JUDGE = "render and judge"


Times = dict[str, dict[str, float]]
"""Seconds by the name of the check and the work."""


def work_of(requests: Iterable[Request], checks: CheckCache) -> dict[str, Work]:
    """The work of each check by its name. What the store holds is looked for, not read."""
    return {
        f"{request.scene.name}/{name}": work
        for request in requests
        for name, work in _work_of_scene(request, checks).items()
    }


def _work_of_scene(request: Request, checks: CheckCache) -> dict[str, Work]:
    @cache
    def has_truth(quantity: str) -> bool:
        return any(checks.store.folder(truth_parts(request.scene, quantity)).glob("*.exr"))

    def work(check: Check) -> Work:
        if checks.seems_finished(request.scene, check):
            return Work.NOTHING
        return Work.JUDGE if has_truth(check.quantity) else Work.RENDER_AND_JUDGE

    try:
        return {id_of(check): work(check) for check in request.checks}
    except LightgaugeError:  # a file of the scene cannot be read, as its checks will say
        return {id_of(check): Work.RENDER_AND_JUDGE for check in request.checks}


def truth_of(scene: Scene) -> str:
    """What tells scenes apart that have no truth in common.

    Raises
    ------
    LightgaugeError
        A file of the scene cannot be read.
    """
    return digest_of(scene_parts(scene))


def read_times(store: Store) -> Times:
    """What is remembered; nothing if the file is not there or damaged, for it only serves estimates."""
    try:
        found = json.loads((store.root / FILE_NAME).read_text(encoding="utf-8"))
        return {str(name): {str(work): float(s) for work, s in times.items()} for name, times in found.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def remember(store: Store, times: Times) -> None:
    """Add to what is remembered, in place of older times of the same checks."""
    if times:
        known = read_times(store)
        merged = known | {name: known.get(name, {}) | new for name, new in times.items()}
        write_text(Path(store.root, FILE_NAME), json.dumps(merged, indent=0, sort_keys=True))


def is_typical(result: CheckResult) -> bool:
    """Whether the time of a check says what it will take again: not if it broke off."""
    return not result.cached and result.verdict is not Verdict.ERROR
