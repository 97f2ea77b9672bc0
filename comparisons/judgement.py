"""What a drawn image is worth: the verdict on it, with the numbers and the pictures that show why."""

from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from comparisons.clamping import clamp_note
from comparisons.gate import CriterionResult, Verdict, spp_needed
from comparisons.linear import write_linear
from comparisons.metrics.flip import flip_image
from comparisons.metrics.sample import Samples
from comparisons.report.pictures import write_pictures
from comparisons.report.pixels import write_pixels
from comparisons.sequential import Decision, decide, fixed_spp
from comparisons.significance import LEAST_SPP, significance
from comparisons.tonemap import exposure_for
from comparisons.variants import costs_of_variants
from comparisons.worst_pixel import worst_pixel
from realtime.render import Rendering
from reference.estimator import Reference
from reference.quantities import quantity
from reference.quantity import Display
from scenes.checks import Check
from scenes.image import Image

SMOOTHING_PX = 1.5
"""Error pictures of a sampled truth are averaged that far: it cuts the noise of a single pixel to a fifth."""

ERROR_RANGE = 2.0
"""Error pictures reach this many times the budget: what has the outermost colour is clearly beyond it."""


def judgement(check: Check, rendering: Rendering, reference: Reference, folder: Path) -> dict[str, Any]:
    """Judge what a technique has drawn, by as much truth as that takes; the keys are those of a `CheckResult`.

    Pictures are written under `folder`; `images` has their paths within it.
    """
    limit = reference.scene.truth.max_spp
    gl_renderer = rendering.image.provenance["renderer"]
    truth_at = partial(reference.truth, check.quantity)
    decision = decide(check, rendering.image.pixels, truth_at, limit, gl_renderer)
    truth = decision.truth
    return evidence(reference, check.quantity, decision, rendering.image, folder, "picture") | {
        "verdict": decision.verdict,
        "message": advice(decision, limit),
        "criteria": decision.criteria,
        "exposure": decision.exposure,
        "spp": truth.spp,
        "spp_fixed": fixed_spp(decision.criteria, truth.spp, limit),
        "seconds": {"realtime": rendering.seconds, "reference": truth.seconds},
        "pass_seconds": rendering.pass_seconds,
        "baked_seconds": rendering.baked_seconds,
        "skipped": tuple(asdict(s) for s in rendering.skipped),
        "integrator": {"name": truth.integrator.name, "why": truth.integrator.why},
        "truth_key": truth.key,
        "clamp": clamp_note(truth, reference.scene.truth.clamp),
        "variants": costs_of_variants(truth, reference.truth),
        "gl_renderer": gl_renderer,
    }


def evidence(
    reference: Reference, name: str, decision: Decision, drawn: Image, folder: Path, stem: str
) -> dict[str, Any]:
    """What shows a verdict on a quantity, made from all samples at hand: it is often clear long before an image is.

    Writes the pictures `images/STEM-...` and their values `pixels/STEM.js` under `folder`; `images` has their paths
    within it. The other keys are those of a `CheckResult`.
    """
    truth = reference.at_hand(name, decision.truth.spp)
    samples = Samples(truth.accumulators, truth.mask)
    display = quantity(name).display
    tested = significance(decision.image, samples) if truth.spp >= LEAST_SPP else None
    scale = error_scale(decision.criteria, samples)
    exposure = _exposure(display, samples)
    smoothing = 0.0 if truth.is_exact else SMOOTHING_PX
    flip = flip_image(decision.image, samples) if display == "radiance" else None
    worst = worst_pixel(decision.image, samples)
    mean = samples.mean.astype(np.float32)
    pictures = write_pictures(
        folder, stem, decision.image, mean, truth.mask, exposure, scale, display, smoothing, tested, flip
    )
    pictures["pixels"] = write_pixels(
        folder,
        stem,
        decision.image,
        samples,
        quantity=name,
        unit=quantity(name).unit_in(reference.scene),
        display=display,
        exposure=exposure,
        error_scale=scale,
        smoothing=smoothing,
        significance=tested,
        flip=flip,
        worst=(worst["x"], worst["y"]),
    )
    if not truth.is_exact:
        pictures["linear"] = write_linear(folder, stem, drawn, reference.scene)
    return {
        "significance": tested.summary if tested is not None else None,
        "worst": worst,
        "images": pictures,
        "spp_shown": truth.spp,
        "error_scale": scale,
        "error_smoothing_px": smoothing,
        "exposure_display": exposure,
    }


def _exposure(display: Display, samples: Samples) -> float:
    """What values are multiplied with to be shown; coordinates that go beyond 1 are brought down to it."""
    if display == "uv":
        return 1 / max(1.0, float(samples.masked.max()))
    return exposure_for(samples.mean, samples.mask) if display in ("radiance", "depth") else 1.0


def advice(decision: Decision, limit: int) -> str:
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

    ERROR_RANGE times the budget of the first criterion that has one in the quantity's unit or relative to the truth
    (that of `off_by_1` is 1), else a tenth of the truth's root mean square.
    """
    mean = float(np.mean(np.abs(samples.masked)))
    rms = float(np.sqrt(np.mean(samples.masked.mean(axis=0) ** 2)))
    absolute = dict.fromkeys(("rms", "rmse", "penumbra_rmse", "max_abs", "p99_abs"), 1.0)
    unit = {"nrmse": mean, "rel_rms": rms, **absolute}
    for criterion in criteria:
        if criterion.metric == "off_by_1":
            return ERROR_RANGE
        if criterion.metric in unit and criterion.max:
            return ERROR_RANGE * criterion.max * unit[criterion.metric]
    return 0.1 * rms if rms > 0 else 1.0
