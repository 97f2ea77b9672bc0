"""Run checks: parity first, then all others of a scene, one scene after the other."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from comparisons.baseline import apply, read_accepted
from comparisons.gate import Verdict, worst
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.request import Request, request_of
from comparisons.result import CheckResult
from comparisons.runner import Runner, Sides
from reference.store import Store
from scenes.errors import RenderError
from scenes.model import Check, Scene

HERE = Sides()
"""Both sides are rendered by this process."""


@dataclass(frozen=True)
class Progress:
    """`step` says what is being done and which fraction of it is done; `finished` hands over a result."""

    step: Callable[[str, float], None]
    finished: Callable[[CheckResult], None]


def run(requests: Iterable[Request], store: Store, progress: Progress, sides: Sides = HERE) -> list[CheckResult]:
    """All checks of all scenes, in order. An error in one check becomes its verdict and stops no other.

    Raises
    ------
    NoGraphics, NoCompiler
        Nothing can be rendered on this machine.
    """
    return [result for request in requests for result in _run_scene(request, store, progress, sides)]


def _run_scene(request: Request, store: Store, progress: Progress, sides: Sides) -> list[CheckResult]:
    runner = Runner(request, store, progress.step, sides)
    results: dict[int, CheckResult] = {}
    broken = ""
    accepted = read_accepted(request.scene.folder)
    for index in sorted(range(len(request.checks)), key=lambda i: _by_tightness(request.checks[i])):
        check = request.checks[index]
        is_parity = check.quantity in PARITY_QUANTITIES
        result = runner.refused(check, broken) if broken and not is_parity else runner.result(check)
        if is_parity and result.verdict is not Verdict.PASS:
            broken = broken or _parity_message(result)
        results[index] = apply(result, accepted.get(result.id))
        progress.finished(results[index])
    return [results[index] for index in sorted(results)]


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


def exit_status(results: Iterable[CheckResult]) -> int:
    """Status of the process: 0 all pass, 1 a budget exceeded or an error risen, 2 inconclusive, 3 and 4 errors."""
    found = list(results)
    verdict = worst(r.verdict for r in found)
    if verdict is Verdict.ERROR:
        return max((r.exit_status for r in found), default=0) or 4
    return {Verdict.PASS: 0, Verdict.FAIL: 1, Verdict.REGRESSED: 1, Verdict.INCONCLUSIVE: 2}[verdict]
