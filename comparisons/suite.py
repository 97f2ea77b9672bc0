"""Run checks: draw, ask for as much truth as the verdict needs, judge."""

import math
import traceback
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from comparisons.baseline import apply, read_accepted
from comparisons.cache import CheckCache
from comparisons.clamping import clamp_note
from comparisons.difference import write_linear
from comparisons.gate import CriterionResult, Verdict, spp_needed, worst
from comparisons.metrics import Samples
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.parity import checks_of
from comparisons.report.pictures import write_flagged, write_pictures
from comparisons.result import CheckResult, check_id, empty_result
from comparisons.sequential import Decision, decide, fixed_spp
from comparisons.significance import LEAST_SPP, significance
from comparisons.tonemap import exposure_for
from comparisons.variants import costs_of_variants
from realtime.render import Renderer
from realtime.techniques import technique
from reference.estimator import Reference
from reference.quantities import quantity
from reference.store import Store
from scenes.errors import FlaggedPixels, LightgaugeError, MachineError, NoCompiler, NoGraphics, RenderError
from scenes.image import Image
from scenes.model import Check, Scene

SMOOTHING_PX = 1.5
"""Error pictures of a sampled truth are averaged that far: it cuts the noise of a single pixel to a fifth."""

ERROR_RANGE = 2.0
"""Error pictures reach this many times the budget: what has the outermost colour is clearly beyond it."""


@dataclass(frozen=True)
class Progress:
    """`step` says what is being done and which fraction of it is done; `finished` hands over a result."""

    step: Callable[[str, float], None]
    finished: Callable[[CheckResult], None]


@dataclass(frozen=True)
class Request:
    """A scene to run: `argument` is what names it on a command line, `keep` chooses among its checks."""

    scene: Scene
    argument: str
    keep: Callable[[str], bool] = lambda check_id: True

    @cached_property
    def checks(self) -> tuple[Check, ...]:
        """The chosen checks. Parity comes along with any of them."""
        every = checks_of(self.scene)
        chosen = [c for c in every if self.keep(f"{self.scene.name}/{id_of(c)}")]
        if not chosen:
            return ()
        return tuple(c for c in every if c in chosen or c.quantity in PARITY_QUANTITIES)


def id_of(check: Check) -> str:
    """The name of a check within its scene."""
    return check_id(check.technique, dict(check.settings), check.fit_exposure)


def run(requests: Iterable[Request], store: Store, progress: Progress) -> list[CheckResult]:
    """All checks of all scenes, in order. An error in one check becomes its verdict and stops no other.

    Raises
    ------
    NoGraphics, NoCompiler
        Nothing can be rendered on this machine.
    """
    return [result for request in requests for result in _run_scene(request, store, progress)]


def _run_scene(request: Request, store: Store, progress: Progress) -> list[CheckResult]:
    runner = _Runner(request, store, progress)
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
    request = Request(scene, argument, lambda check_id: "/raster." in check_id)
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


class _Runner:
    """The checks of one scene, sharing what they render."""

    def __init__(self, request: Request, store: Store, progress: Progress) -> None:
        self.request = request
        self.store = store
        self.progress = progress
        self.reference = Reference(request.scene, store, progress.step)
        self.renderer = Renderer(request.scene)
        self.cache = CheckCache(store)

    def refused(self, check: Check, why: str) -> CheckResult:
        return replace(self._empty(check), message=why)

    def result(self, check: Check) -> CheckResult:
        """The check's result, from the cache when nothing that it depends on has changed."""
        scene = self.request.scene
        self.store.touched.clear()
        try:
            cached = self.cache.read(scene, check)
            if cached is not None:
                return replace(
                    cached, scene=scene.name, scene_title=scene.title, rerun=self._empty(check).rerun, cached=True
                )
            result = self._judged(check)
        except (NoGraphics, NoCompiler):
            raise
        except LightgaugeError as error:
            images = self._flagged(check, error) if isinstance(error, FlaggedPixels) else {}
            return replace(self._empty(check), message=str(error), exit_status=error.exit_status, images=images)
        except Exception as error:  # noqa: BLE001  # techniques and drivers may raise anything; the other checks go on
            return replace(self._empty(check), message=_fault(error), exit_status=MachineError.exit_status)
        self.cache.write(scene, check, result)
        return result

    def _flagged(self, check: Check, error: FlaggedPixels) -> dict[str, str]:
        folder = self.cache.folder(self.request.scene, check)
        return self._kept(folder, write_flagged(folder, "picture", error.flagged))

    def _kept(self, folder: Path, pictures: dict[str, str]) -> dict[str, str]:
        """Paths of pictures within the store, from those within a folder of it."""
        return {name: str((folder / path).relative_to(self.store.root)) for name, path in pictures.items()}

    def _empty(self, check: Check) -> CheckResult:
        return empty_result(
            self.request.scene, self.request.argument, check, technique(check.technique), quantity(check.quantity)
        )

    def _judged(self, check: Check) -> CheckResult:
        scene = self.request.scene
        self.reference.require_defined(check.quantity)
        self.progress.step(f"{scene.name}: {check.technique}", 0.0)
        rendering = self.renderer.render(
            technique(check.technique), dict(check.settings), timed=check.quantity not in PARITY_QUANTITIES
        )
        _ = self.reference.subject_mask  # raises if the camera does not see the subject
        decision = decide(
            check, rendering.image.pixels, partial(self.reference.truth, check.quantity), scene.truth.max_spp
        )
        truth = decision.truth
        return replace(
            self._empty(check),
            **self._shown(check, decision, rendering.image),
            verdict=decision.verdict,
            message=_advice(decision, scene.truth.max_spp),
            criteria=decision.criteria,
            exposure=decision.exposure,
            spp=truth.spp,
            spp_fixed=fixed_spp(decision.criteria, truth.spp, scene.truth.max_spp),
            seconds={"realtime": rendering.seconds, "reference": truth.seconds},
            pass_seconds=rendering.pass_seconds,
            skipped=tuple(asdict(s) for s in rendering.skipped),
            integrator={"name": truth.integrator.name, "why": truth.integrator.why},
            clamp=clamp_note(truth, scene.truth.clamp),
            variants=costs_of_variants(truth, self.reference.truth),
            gl_renderer=rendering.image.provenance["renderer"],
        )

    def _shown(self, check: Check, decision: Decision, drawn: Image) -> dict[str, Any]:
        """The pictures, made from all samples at hand: a verdict is often clear long before an image is."""
        scene = self.request.scene
        truth = self.reference.at_hand(check.quantity, decision.truth.spp)
        samples = Samples(truth.accumulators, truth.mask)
        display = quantity(check.quantity).display
        tested = significance(decision.image, samples) if truth.spp >= LEAST_SPP else None
        scale = error_scale(decision.criteria, samples)
        exposure = exposure_for(samples.mean, truth.mask) if display in ("radiance", "depth") else 1.0
        smoothing = 0.0 if truth.is_exact else SMOOTHING_PX
        mean = samples.mean.astype(np.float32)
        folder = self.cache.folder(scene, check)
        pictures = write_pictures(
            folder, "picture", decision.image, mean, truth.mask, exposure, scale, display, smoothing, tested
        )
        if not truth.is_exact:
            pictures["linear"] = write_linear(folder, "picture", drawn, scene)
        return {
            "significance": tested.summary if tested is not None else None,
            "images": self._kept(folder, pictures),
            "spp_shown": truth.spp,
            "error_scale": scale,
            "error_smoothing_px": smoothing,
            "exposure_display": exposure,
        }


def _fault(error: Exception) -> str:
    """An exception that nobody foresaw, and where it came from."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return (
        f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}. Either a setting of the check "
        "is out of range, or the code there is at fault."
    )


def _advice(decision: Decision, limit: int) -> str:
    """What an INCONCLUSIVE check needs."""
    if decision.verdict is not Verdict.INCONCLUSIVE:
        return ""
    spp = decision.truth.spp
    after = f"Undecided after {spp} spp (the scene allows {limit})"
    undecided = [c for c in decision.criteria if c.verdict is Verdict.INCONCLUSIVE]
    if not all(c.valid for c in undecided):
        return f"{after}: the truth is too noisy to know how noisy it is."
    needed = [spp_needed(c, spp) for c in undecided]
    known = [n for n in needed if n is not None]
    if len(known) < len(needed):
        return f"{after}: a value is too close to its bound for any affordable number of them."
    enough = 1 << (max(known) - 1).bit_length()
    return (
        f"{after}: about {max(known)} spp would decide it. Set max_spp = {enough} or more under [truth] in the scene."
    )


def error_scale(criteria: Iterable[CriterionResult], samples: Samples) -> float:
    """The error that gets the outermost colour.

    ERROR_RANGE times the budget of the first criterion that has one in the quantity's unit or relative to the truth,
    else a tenth of the truth's root mean square.
    """
    mean = float(np.mean(np.abs(samples.masked)))
    rms = float(np.sqrt(np.mean(samples.masked.mean(axis=0) ** 2)))
    absolute = dict.fromkeys(("rms", "rmse", "penumbra_rmse", "max_abs", "p99_abs"), 1.0)
    unit = {"nrmse": mean, "rel_rms": rms, **absolute}
    for criterion in criteria:
        if criterion.metric in unit and criterion.max:
            return ERROR_RANGE * criterion.max * unit[criterion.metric]
    return 0.1 * rms if rms > 0 else 1.0


def exit_status(results: Iterable[CheckResult]) -> int:
    """Status of the process: 0 all pass, 1 a budget exceeded or an error risen, 2 inconclusive, 3 and 4 errors."""
    found = list(results)
    verdict = worst(r.verdict for r in found)
    if verdict is Verdict.ERROR:
        return max((r.exit_status for r in found), default=0) or 4
    return {Verdict.PASS: 0, Verdict.FAIL: 1, Verdict.REGRESSED: 1, Verdict.INCONCLUSIVE: 2}[verdict]
