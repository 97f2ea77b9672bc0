"""Can a check fail? Known faults are planted in a technique's image, and the check must notice those it claims to see.

A check claims what the metrics of its criteria see (`Metric.sees`), with two exceptions. An exposure that is fitted
takes a gain out. And errors add in quadrature: where an image is wrong by e, a fault of size d that has nothing to do
with it makes the error sqrt(e² + d²). Below MASKED_SHARE of e that is at most 3 % more, and a metric that averages the
size of errors may read the same: such a fault is masked. A loose bound masks nothing, only what is wrong already does.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import lru_cache, partial
from typing import Any

import numpy as np

from comparisons.gate import CriterionResult, Verdict, fit_exposure, judge, worst
from comparisons.metrics import METRICS, Estimate, Samples, check_image, evaluate, metric_named
from comparisons.mutants import MUTANTS, Mutant, is_equivalent
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.report.numbers import format_bound, format_metric
from comparisons.request import Request, id_of
from comparisons.sequential import ALPHA_PER_SIDE, decide, looks
from comparisons.statistics import squared_errors
from realtime.render import Renderer
from realtime.techniques import technique
from reference.estimator import Reference, Truth
from reference.quantities import quantity
from reference.store import Store
from scenes.checks import Check, Criterion
from scenes.errors import ImageError, LightgaugeError, NoCompiler, NoGraphics, RenderError
from scenes.image import Float32, Float64

MASKED_SHARE = 0.25
"""A fault smaller than this share of the image's own error adds at most sqrt(1 + 1/16) - 1 = 3 % to it."""

ERROR_AVERAGES = frozenset(
    {
        "nrmse",
        "limb_nrmse",
        "rel_mse_eps1e-2",
        "rel_mse_clipped",
        "rms",
        "rel_rms",
        "rmse",
        "penumbra_rmse",
        "flip",
        "dssim_tonemapped",
        "delta_e_itp",
    }
)
"""Metrics that average the size of errors, of which a large one hides a small one."""


class Outcome(StrEnum):
    KILLED = "killed"
    SURVIVED = "survived"
    EQUIVALENT = "equivalent"
    MASKED = "masked"
    UNCLAIMED = "not claimed"
    UNTESTED = "untested"


@dataclass(frozen=True)
class Trial:
    """What one check made of one mutant.

    by      : the metric that killed it; empty where the image was refused before anything was measured
    verdict : on the mutated image, None where it was not judged
    note    : how the check could be made to see a survivor, or why it was not tested
    """

    check: str
    mutant: str
    outcome: Outcome
    by: str = ""
    verdict: Verdict | None = None
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class _Case:
    """A check that passes, with its image and the truth it is held against."""

    name: str
    check: Check
    unit: str
    image: Float32
    truth_at: Callable[[int], Truth]
    spps: tuple[int, ...]
    alpha: float

    def samples(self, spp: int) -> Samples:
        truth = self.truth_at(spp)
        return Samples(truth.accumulators, truth.mask, self.alpha)

    def exposed(self, image: Float32, samples: Samples) -> Float32:
        factor = fit_exposure(image, samples) if self.check.fit_exposure else 1.0
        return (image * factor).astype(np.float32)


def selftest(requests: Iterable[Request], store: Store, step: Callable[[str, float], None]) -> list[Trial]:
    """Every mutant of every check of the scenes, in order. `step` is told what is being done, and its fraction.

    Raises
    ------
    NoGraphics, NoCompiler
        Nothing can be rendered on this machine.
    """
    return [trial for request in requests for trial in _of_scene(request, store, step)]


def _of_scene(request: Request, store: Store, step: Callable[[str, float], None]) -> list[Trial]:
    scene = request.scene
    reference, renderer = Reference(scene, store, step), Renderer(scene)
    trials: list[Trial] = []
    broken = ""
    for index, check in enumerate(request.checks):
        name = f"{scene.name}/{id_of(check)}"
        step(f"mutants of {name}", index / len(request.checks))
        if broken and check.quantity not in PARITY_QUANTITIES:
            trials += _untested(name, broken)
            continue
        try:
            image = renderer.render(technique(check.technique), dict(check.settings), timed=False).image.pixels
            truth_at = partial(reference.truth, check.quantity)
            unit = quantity(check.quantity).unit_in(scene)
            trials += trials_of(name, check, unit, image, truth_at, scene.truth.max_spp)
        except (NoGraphics, NoCompiler):
            raise
        except LightgaugeError as error:
            trials += _untested(name, str(error))
        except Exception as error:  # noqa: BLE001  # techniques and drivers may raise anything; the other checks go on
            trials += _untested(name, f"{type(error).__name__}: {error}")
        if check.quantity in PARITY_QUANTITIES and trials[-1].outcome is Outcome.UNTESTED:
            broken = f"parity of this scene does not hold: {check.quantity}."
    return trials


def trials_of(
    name: str, check: Check, unit: str, image: Float32, truth_at: Callable[[int], Truth], limit: int
) -> tuple[Trial, ...]:
    """What a check makes of every mutant of an image (H, W, C).

    Parameters
    ----------
    unit : of the quantity's values in the scene.
    truth_at : gives the truth with at least that many samples a pixel.
    limit : the most samples a pixel.

    Returns
    -------
    One trial a mutant. All are untested if the check does not pass the image itself: then nothing shows that it is the
    fault it notices.

    Raises
    ------
    LightgaugeError
        The image itself cannot be judged.
    """
    truth_at = lru_cache(truth_at)
    decision = decide(check, image, truth_at, limit)
    if decision.verdict is not Verdict.PASS:
        return _untested(name, f"the check is {decision.verdict} without any fault. Mend that first.")
    planned = looks(limit)
    spps = tuple(spp for spp in planned if spp >= decision.truth.spp)  # fewer could not even pass the image itself
    case = _Case(name, check, unit, image, truth_at, spps, ALPHA_PER_SIDE / len(planned))
    return tuple(_trial(case, mutant) for mutant in MUTANTS.values())


def claims(check: Check) -> dict[str, tuple[Criterion, ...]]:
    """For each mutant the criteria of the check that claim to see it."""
    fitted_away = {"gain"} if check.fit_exposure else set()
    return {
        mutant: tuple(c for c in check.criteria if mutant in metric_named(c.metric).sees - fitted_away)
        for mutant in MUTANTS
    }


def _untested(name: str, why: str) -> tuple[Trial, ...]:
    return tuple(Trial(name, mutant, Outcome.UNTESTED, note=why) for mutant in MUTANTS)


def _trial(case: _Case, mutant: Mutant) -> Trial:
    claiming = claims(case.check)[mutant.name]
    if not claiming:
        return Trial(case.name, mutant.name, Outcome.UNCLAIMED)
    mask = case.truth_at(case.spps[0]).mask
    mutated = mutant.function(case.image, mask)
    if is_equivalent(case.image, mutated, mask):
        return Trial(case.name, mutant.name, Outcome.EQUIVALENT)
    try:
        if {c.metric for c in claiming} <= ERROR_AVERAGES and _is_masked(case, mutated):
            return Trial(case.name, mutant.name, Outcome.MASKED)
        spp, results = _judged(case, mutated)
    except (ImageError, RenderError):
        return Trial(case.name, mutant.name, Outcome.KILLED, verdict=Verdict.ERROR)
    verdict = worst(r.verdict for r in results)
    if verdict in (Verdict.FAIL, Verdict.ERROR):
        return Trial(case.name, mutant.name, Outcome.KILLED, results[-1].metric, verdict)
    advice = _advice(case, mutant, mutated, case.samples(spp))
    return Trial(case.name, mutant.name, Outcome.SURVIVED, verdict=verdict, note=advice)


def _judged(case: _Case, mutated: Float32) -> tuple[int, list[CriterionResult]]:
    """The samples a pixel that it took, and the criteria's results up to the first that is a FAIL or an ERROR."""
    results: list[CriterionResult] = []
    for spp in case.spps:
        samples = case.samples(spp)
        exposed = case.exposed(mutated, samples)
        results = []
        for criterion in case.check.criteria:
            results.append(judge(criterion, evaluate(criterion.metric, exposed, samples)))
            if results[-1].verdict in (Verdict.FAIL, Verdict.ERROR):
                return spp, results
        if samples.is_exact or worst(r.verdict for r in results) is Verdict.PASS:
            return spp, results
    return case.spps[-1], results


def _is_masked(case: _Case, mutated: Float32) -> bool:
    """Whether the fault is small against the error of the image as it is, both as root mean squares."""
    samples = case.samples(case.spps[0])
    test, other = (check_image(case.exposed(x, samples), samples)[samples.mask] for x in (case.image, mutated))
    change = math.sqrt(float(np.mean((other - test) ** 2)))
    return change < MASKED_SHARE * _error(test, samples)


def _error(test: Float64, samples: Samples) -> float:
    """Root mean square error of pixels (P, C), without the truth's noise."""
    differences = test - samples.masked
    squares = differences[0] ** 2 if samples.is_exact else squared_errors(differences).values / test.shape[1]
    return math.sqrt(max(0.0, float(np.mean(squares))))


def _advice(case: _Case, mutant: Mutant, mutated: Float32, samples: Samples) -> str:
    """Which bound, or else which other metric, would have told the mutant from the image itself."""
    images = case.exposed(case.image, samples), case.exposed(mutated, samples)
    for c in claims(case.check)[mutant.name]:
        plain, faulty = (evaluate(c.metric, image, samples) for image in images)
        if _apart(plain, faulty):
            side = "max" if faulty.value > plain.value else "min"
            act = f"Give {c.metric} a {side}" if getattr(c, side) is None else f"Tighten the {side} of {c.metric}"
            return f"{act}: {_reading(c.metric, plain, faulty, case.unit)}, its bound is {_bound(c, case.unit)}."
    used = {c.metric for c in case.check.criteria}
    for metric in METRICS.values():
        if mutant.name in metric.sees and metric.name not in used:
            try:
                plain, faulty = (evaluate(metric.name, image, samples) for image in images)
            except ImageError:  # it does not apply to this quantity, or to a noisy truth
                continue
            if _apart(plain, faulty):
                return f"Add {metric.name}: {_reading(metric.name, plain, faulty, case.unit)}."
    return "No metric tells it from the image itself with so few samples; tighter bounds take more of them, and may."


def _apart(one: Estimate, other: Estimate) -> bool:
    return one.valid and other.valid and (one.high < other.low or other.high < one.low)


def _reading(metric: str, plain: Estimate, faulty: Estimate, unit: str) -> str:
    with_it, without = (format_metric(metric, estimate.value, unit) for estimate in (faulty, plain))
    return f"it reads {with_it} with it and {without} without"


def _bound(criterion: Criterion, unit: str) -> str:
    return format_bound(criterion.metric, criterion.min, criterion.max, unit)
