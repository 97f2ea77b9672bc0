"""Run checks: parity first, then all others of a scene, one scene after the other."""

import math
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from comparisons.baseline import apply, read_accepted
from comparisons.gate import Verdict, worst
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.request import Request, request_of
from comparisons.result import CheckResult, empty_result
from comparisons.runner import Runner, Sides, fault_of
from comparisons.times import is_typical
from realtime.techniques import technique
from reference.quantities import quantity
from reference.store import Store
from scenes.checks import Check
from scenes.errors import InputError, LightgaugeError, MachineError, NoCluster, NoCompiler, NoGraphics, RenderError
from scenes.model import Scene

HERE = Sides()
"""Both sides are rendered by this process."""

STOP_ALL = (NoGraphics, NoCompiler, NoCluster, OSError)
"""Nothing can be rendered here, or nothing be kept: another scene would fare no better."""


def _unheard(name: str, seconds: float) -> None:
    pass


@dataclass(frozen=True)
class Progress:
    """`step` says what is being done and which fraction of it is done; `finished` hands over a result.

    `took` tells before that how many seconds a check took, by its name, unless it was found in the store or broke off.
    """

    step: Callable[[str, float], None]
    finished: Callable[[CheckResult], None]
    took: Callable[[str, float], None] = _unheard


def run(requests: Iterable[Request], store: Store, progress: Progress, sides: Sides = HERE) -> list[CheckResult]:
    """All checks of all scenes, in order. An error in one check becomes its verdict and stops no other.

    Raises
    ------
    NoGraphics, NoCompiler, NoCluster
        Nothing can be rendered on this machine.
    OSError
        Nothing can be kept.
    """
    return [result for request in requests for result in run_scene(request, store, progress, sides)]


def run_scene(request: Request, store: Store, progress: Progress, sides: Sides = HERE) -> list[CheckResult]:
    """All checks of one scene, in order; an error outside any of them is that of all that were not finished.

    Raises
    ------
    NoGraphics, NoCompiler, NoCluster, OSError
        As `run`.
    """
    heard: dict[str, CheckResult] = {}

    def finished(result: CheckResult) -> None:
        heard[result.id] = result
        progress.finished(result)

    try:
        scene = SceneRun(request, store, replace(progress, finished=finished), sides)
        order = sorted(range(len(request.checks)), key=lambda i: _by_tightness(request.checks[i]))
        results = {index: scene.result(request.checks[index]) for index in order}
    except STOP_ALL:
        raise
    except LightgaugeError as error:
        return with_failures(request, heard, str(error), error.exit_status, progress.finished)
    except Exception as error:  # noqa: BLE001  # whatever goes wrong in one scene, the others go on
        return with_failures(request, heard, fault_of(error), MachineError.exit_status, progress.finished)
    return [results[index] for index in sorted(results)]


def with_failures(
    request: Request,
    heard: Mapping[str, CheckResult],
    message: str,
    status: int,
    finished: Callable[[CheckResult], None],
) -> list[CheckResult]:
    """The results of a scene that broke off, in order: those that were heard of, and an ERROR for each other check."""

    def failed(check: Check) -> CheckResult:
        scene = request.scene
        empty = empty_result(scene, request.argument, check, technique(check.technique), quantity(check.quantity))
        if empty.id in heard:
            return heard[empty.id]
        error = replace(empty, message=message, exit_status=status)
        finished(error)
        return error

    return [failed(check) for check in request.checks]


class SceneRun:
    """The checks of one scene, one at a time: the parity of the request is judged once, before any other."""

    def __init__(self, request: Request, store: Store, progress: Progress, sides: Sides = HERE) -> None:
        self.request = request
        self._progress = progress
        self._runner = Runner(request, store, progress.step, sides)
        self._accepted = read_accepted(request.scene.folder)

    def result(self, check: Check) -> CheckResult:
        """A check of the request, or another one of its scene, judged; without parity it is an ERROR that says so."""
        parity = self._parity_checks
        if check in parity:
            return self._parity[parity.index(check)]
        without = [r for r in self._parity if r.verdict not in (Verdict.PASS, Verdict.REGRESSED)]
        if without:
            return self._finished(self._runner.refused(check, _parity_message(without[0])))
        return self._judged(check)

    @property
    def _parity_checks(self) -> list[Check]:
        return [check for check in self.request.checks if check.quantity in PARITY_QUANTITIES]

    @cached_property
    def _parity(self) -> list[CheckResult]:
        return [self._judged(check) for check in self._parity_checks]

    def _judged(self, check: Check) -> CheckResult:
        clock = time.perf_counter()
        result = self._runner.result(check)
        if is_typical(result):
            self._progress.took(result.id, time.perf_counter() - clock)
        return self._finished(result)

    def _finished(self, result: CheckResult) -> CheckResult:
        beside = apply(result, self._accepted.get(result.id))
        self._progress.finished(beside)
        return beside


def _by_tightness(check: Check) -> float:
    """Parity first; then what needs the most samples, so that the pictures of all others can show them too."""
    return -1.0 if check.quantity in PARITY_QUANTITIES else check.criteria[0].max or math.inf


def require_parity(scene: Scene, argument: str, store: Store, step: Callable[[str, float], None]) -> None:
    """See that both sides see the same scene, before any of its radiance is compared.

    Raises
    ------
    RenderError
        They do not, or it could not be judged.
    """
    request = request_of(scene, argument, lambda check_id: "/raster." in check_id)
    for result in run([request], store, Progress(step, lambda finished: None)):
        if result.verdict not in (Verdict.PASS, Verdict.REGRESSED):
            raise RenderError(_parity_message(result))


def _parity_message(result: CheckResult) -> str:
    failed = [f"{c.metric} is {c.value:.3g}" for c in result.criteria if c.verdict is not Verdict.PASS]
    if not failed:
        return f"Parity of this scene could not be judged: {result.quantity}. {result.message}"
    return (
        f"Parity of this scene does not hold: {result.quantity} ({'; '.join(failed)}). The two sides do not see the "
        "same scene, so their radiance is not compared until they do."
    )


def exit_status(results: Iterable[CheckResult], is_broken: bool = False) -> int:
    """Status of the process: 0 all pass, 1 a budget exceeded or an error risen, 2 inconclusive, 3 and 4 errors.

    Where a scene is broken, which is bad input, it is 3 at least.
    """
    found = list(results)
    if is_broken:
        return max(InputError.exit_status, exit_status(found) if found else 0)
    verdict = worst(r.verdict for r in found)
    if verdict is Verdict.ERROR:
        return max((r.exit_status for r in found), default=0) or 4
    return {Verdict.PASS: 0, Verdict.FAIL: 1, Verdict.REGRESSED: 1, Verdict.INCONCLUSIVE: 2}[verdict]
