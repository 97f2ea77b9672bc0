"""Coverage of the intervals, wrong verdicts, false alarms: each by repetition on simulated truths."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from comparisons.calibration.pool import QUANTITY, Pool
from comparisons.gate import Verdict
from comparisons.metrics import Samples
from comparisons.metrics.energy_bias import energy_bias
from comparisons.metrics.nrmse import relative_mse
from comparisons.metrics.rel_mse import EPSILON, denominator_floor, rel_mse, weighted_errors
from comparisons.sequential import decide
from comparisons.significance import significance
from comparisons.statistics import firefly_note
from scenes.checks import Check, Criterion
from scenes.image import Bool, Float32, Float64

CONFIDENCE = 0.95
ALPHA = (1 - CONFIDENCE) / 2
COVERAGE_SPP = (16, 64, 256, 1024)
LIMIT = 4096

LEAST_VALID = 20
"""Repetitions of which a share means something."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Coverage:
    """How often an interval held the true value, and how far the estimates were off on average.

    coverage : of the intervals that were valid, NaN if they were fewer than LEAST_VALID
    bias     : mean error of estimation, in its standard errors over all repetitions
    valid    : share of the repetitions in which no fireflies were found
    """

    metric: str
    case: str
    spp: int
    coverage: float
    bias: float
    valid: float


def cases_of(pool: Pool) -> dict[str, Float64]:
    """Images (P, C) with known errors."""
    truth = pool.truth
    pattern = np.sin(0.7 * np.arange(len(truth)))[:, None] * [1.0, 0.8, 1.2]
    local = (np.arange(len(truth)) < len(truth) // 20)[:, None]
    noise = (pool.samples.std(axis=1) / truth).mean(axis=1)
    noisiest = (noise >= np.quantile(noise, 0.9))[:, None]
    return {
        "none": truth,
        "small, 2 %": truth * (1 + 0.02 * pattern),
        "large, 40 %": truth * (1 + 0.4 * pattern),
        "local, 50 % on a 20th": truth * (1 + 0.5 * local),
        "50 % on the noisiest tenth": truth * (1 + 0.5 * noisiest),
    }


def coverage(pool: Pool, repetitions: int, progress: Progress) -> list[Coverage]:
    """95 % intervals of the estimators that have an unbiased form, before anything is clipped for display."""
    rows = []
    images = cases_of(pool)
    for level, spp in enumerate(COVERAGE_SPP):
        estimates: dict[tuple[str, str], list[tuple[float, bool]]] = {}
        valid = []
        for i, samples in enumerate(pool.repetitions(repetitions, spp, ALPHA, seed=level)):
            progress(f"coverage in the {pool.name} world, {spp} spp", i / repetitions)
            valid.append(not firefly_note(samples.masked - samples.masked.mean(axis=0)))
            for case, image in images.items():
                for metric, estimate in _estimates(pool.truth, image, samples).items():
                    estimates.setdefault((metric, case), []).append(estimate)
        for (metric, case), found in estimates.items():
            rows.append(_row(metric, case, spp, np.array(found), np.array(valid)))
    return rows


def _estimates(truth: Float64, image: Float64, samples: Samples) -> dict[str, tuple[float, bool]]:
    """Each metric's error of estimation, and whether its interval holds the true value; truth and image are (P, C)."""
    mean = float(truth.mean())
    squared, terms = relative_mse(image, samples.masked)
    off = squared - float(np.mean((image - truth) ** 2)) / mean**2
    true_relative = float(np.mean((image - truth) ** 2 / (truth**2 + (EPSILON * mean) ** 2)))
    weighted = float(weighted_errors(image, samples, denominator_floor(samples)).values.mean())
    true_energy = float(image.mean()) / mean - 1
    shown = np.zeros(samples.accumulators.shape[1:])
    shown[samples.mask] = image
    relative, energy = rel_mse(shown, samples), energy_bias(shown, samples)
    return {
        "nrmse, squared": (off, abs(off) <= terms.half_width(ALPHA)),
        "rel_mse_eps1e-2": (weighted - true_relative, relative.low <= true_relative <= relative.high),
        "energy_bias": (energy.value - true_energy, energy.low <= true_energy <= energy.high),
    }


def _row(metric: str, case: str, spp: int, estimates: Float64, valid: Bool) -> Coverage:
    """From errors of estimation and whether the interval held, (N, 2)."""
    errors, held = estimates.T
    return Coverage(
        metric=metric,
        case=case,
        spp=spp,
        coverage=float(held[valid].mean()) if valid.sum() >= LEAST_VALID else np.nan,
        bias=float(errors.mean() / errors.std(ddof=1)) * len(errors) ** 0.5,
        valid=float(valid.mean()),
    )


@dataclass(frozen=True)
class Verdicts:
    """What the sequential verdict said of an image whose error is `ratio` times its budget; shares and mean spp."""

    world: str
    budget: float
    ratio: float
    passed: float
    failed: float
    open: float
    spp: float


def verdicts(
    pool: Pool, budget: float, ratios: tuple[float, ...], repetitions: int, progress: Progress
) -> list[Verdicts]:
    """Decide on images with a known nrmse, as a run does."""
    truth = pool.truth
    pattern = cases_of(pool)["large, 40 %"] - truth
    pattern *= budget * truth.mean() / np.sqrt(np.mean(pattern**2))
    images = {ratio: pool.image(truth + ratio * pattern) for ratio in ratios}
    criterion = Criterion(metric="nrmse", max=budget, reason="a budget for a simulation")
    check = Check(quantity=QUANTITY, technique="simulated", criteria=(criterion,))
    found: dict[float, list[tuple[Verdict, int]]] = {ratio: [] for ratio in ratios}
    for repetition in range(repetitions):
        progress(f"verdicts in the {pool.name} world, budget {budget:.0%}", repetition / repetitions)
        truth_at = _Shared(pool.truths(np.random.default_rng([99, repetition])))
        for ratio, image in images.items():
            decision = decide(check, image, truth_at, LIMIT)
            found[ratio].append((decision.verdict, decision.truth.spp))
    return [_shares(pool.name, budget, ratio, outcomes) for ratio, outcomes in found.items()]


class _Shared:
    """Remembers the truths of all looks, so that several images are judged by the same."""

    def __init__(self, truth_at: Callable[[int], Any]) -> None:
        self.truth_at = truth_at
        self.known: dict[int, Any] = {}

    def __call__(self, spp: int) -> Any:
        if spp not in self.known:
            self.known[spp] = self.truth_at(spp)
        return self.known[spp]


def _shares(world: str, budget: float, ratio: float, outcomes: list[tuple[Verdict, int]]) -> Verdicts:
    said = [verdict for verdict, _ in outcomes]
    passed, failed, left_open = (said.count(v) / len(said) for v in (Verdict.PASS, Verdict.FAIL, Verdict.INCONCLUSIVE))
    spp = float(np.mean([spp for _, spp in outcomes]))
    return Verdicts(world, budget, ratio, passed, failed, left_open, spp)


@dataclass(frozen=True)
class Alarms:
    """How often the significance map marks anything, and which share of the judged pixels then."""

    world: str
    case: str
    spp: int
    images: float
    pixels: float


def alarms(pool: Pool, spps: tuple[int, ...], repetitions: int, progress: Progress) -> list[Alarms]:
    """The map on an image without error, and on one with a patch of 12 x 12 pixels that is 10 % too bright."""
    truth = pool.image(pool.truth)
    middle = pool.mask.shape[0] // 2
    patched: Float32 = truth.copy()
    patched[middle - 6 : middle + 6, middle - 6 : middle + 6] *= 1.1
    rows = []
    for spp in spps:
        shares: dict[str, list[float]] = {"no error": [], "10 % on 12 x 12 px": []}
        for i, samples in enumerate(pool.repetitions(repetitions, spp, ALPHA, seed=spp)):
            progress(f"false alarms in the {pool.name} world, {spp} spp", i / repetitions)
            for case, image in zip(shares, (truth, patched), strict=True):
                tested = significance(image, samples)
                assert tested is not None
                shares[case].append(tested.share)
        for case, found in shares.items():
            rows.append(Alarms(pool.name, case, spp, float(np.mean(np.array(found) > 0)), float(np.mean(found))))
    return rows
