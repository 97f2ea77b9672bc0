"""A verdict from as few samples as it takes: look, and double them while anything is open.

Every look may decide, so every look may be wrong. A check whose truth is limited to N samples a pixel is looked at
L = log2(N / FIRST_SPP) + 1 times at most; each look's interval misses the true value with probability
ALPHA_PER_SIDE / L on either side (Bonferroni), all of them together with ALPHA_PER_SIDE. Group-sequential tests with
less cautious levels (O'Brien and Fleming, 1979, "A multiple testing procedure for clinical trials") assume a normal
statistic of known variance; this holds for any.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from comparisons.gate import CriterionResult, Verdict, fit_exposure, judge, worst
from comparisons.metrics import evaluate, metric_named
from comparisons.metrics.metric import check_image
from comparisons.metrics.sample import Samples
from comparisons.statistics import student_quantile
from reference.estimator import ACCUMULATORS, Truth
from scenes.checks import Check
from scenes.errors import RenderError, SceneError
from scenes.image import Float32

FIRST_SPP = ACCUMULATORS
"""Samples a pixel of the first look: one for each accumulator."""

ALPHA_PER_SIDE = 0.01
"""How probably a criterion may be passed or failed wrongly, over all looks."""


@dataclass(frozen=True)
class Decision:
    """What was decided, and on what: `image` is the judged one, exposed by `exposure`."""

    truth: Truth
    samples: Samples
    image: Float32
    exposure: float
    criteria: tuple[CriterionResult, ...]

    @property
    def verdict(self) -> Verdict:
        return worst(c.verdict for c in self.criteria)


def looks(limit: int) -> tuple[int, ...]:
    """Samples a pixel at which a verdict is looked at.

    >>> looks(100)
    (16, 32, 64)
    """
    return tuple(FIRST_SPP << i for i in range((limit // FIRST_SPP).bit_length()))


def decide(check: Check, image: Float32, truth_at: Callable[[int], Truth], limit: int, renderer: str = "") -> Decision:
    """Judge an image (H, W, C) until every criterion is decided by the same samples, or `limit` of them are spent.

    Parameters
    ----------
    truth_at : gives the truth with at least that many samples a pixel.
    renderer : the name of the OpenGL renderer that drew the image; budgets may depend on it.

    Raises
    ------
    ImageError
        The image cannot be judged: it has another shape than the truth, or values that are not finite.
    RenderError, SceneError
        It is black at every judged pixel; so is the truth.
    """
    planned = looks(limit)
    alpha = ALPHA_PER_SIDE / len(planned)
    most_open = 0
    for spp in planned:
        truth = truth_at(spp)
        samples = Samples(truth.accumulators, truth.mask, alpha)
        is_last = truth.is_exact or spp == planned[-1]
        _require_content(image, samples)
        exposure = fit_exposure(image, samples) if check.fit_exposure else 1.0
        exposed = (image * exposure).astype(np.float32)
        results: dict[int, CriterionResult] = {}
        for index in sorted(range(len(check.criteria)), key=lambda i: i != most_open):  # what was open comes first
            criterion = check.criteria[index]
            results[index] = judge(criterion, evaluate(criterion.metric, exposed, samples), renderer)
            if results[index].verdict is Verdict.INCONCLUSIVE and not is_last:
                most_open = index
                break
        else:
            break
    return Decision(truth, samples, exposed, exposure, tuple(results[i] for i in sorted(results)))


def fixed_spp(criteria: Iterable[CriterionResult], spp: int, limit: int) -> int:
    """Samples a pixel of a truth that is rendered once and taken as exact, for a verdict of the same certainty.

    A plain mean squared error counts the truth's noise as error. With N samples a pixel it reads too much by V / N,
    give or take its own half-width h at ALPHA_PER_SIDE; the verdict is certain if both together are less than the
    distance D between error and bound. As h falls no faster than 1 / N, that takes at least N0 (V / N0 + h0) / D, with
    V / N0 and h0 as they are at the N0 = `spp` samples that the sequential verdict took. The result is the largest over
    the criteria that noise adds to, and `spp` at least.
    """
    single_look = student_quantile(ALPHA_PER_SIDE, np.inf) / student_quantile(
        ALPHA_PER_SIDE / len(looks(limit)), np.inf
    )
    needed = [spp * _noise_over_distance(c, single_look) for c in criteria]
    return max([spp, *(int(np.ceil(n)) for n in needed if np.isfinite(n))])


def _noise_over_distance(result: CriterionResult, single_look: float) -> float:
    """How often what noise does to a plain reading fits between the error and its nearest bound."""
    power = metric_named(result.metric).noise_power
    if power is None or result.floor is None:
        return 0.0
    value, high = result.value**power, result.high**power
    bounds = [abs(bound) ** power for bound in (result.min, result.max) if bound is not None]
    distance = min(abs(bound - value) for bound in bounds)
    return (result.floor**power + single_look * (high - value)) / distance if distance > 0 else np.inf


def _require_content(image: Float32, samples: Samples) -> None:
    """Refuse a blank image: a generous budget would let it pass."""
    if np.any(check_image(image, samples)[samples.mask]):
        return
    if np.any(samples.masked):
        raise RenderError("The image is black at every judged pixel, but its truth is not. Mend the technique.")
    raise SceneError(
        "The image is black at every judged pixel, and so is its truth: there is nothing to compare. See that light "
        "reaches what the camera sees of the subject."
    )
