"""What a clamped truth leaves out, in numbers."""

from comparisons.statistics import firefly_note, student_quantile
from reference.estimator import Truth

ALPHA = 0.025
"""On either side: an interval for readers, on which nothing is decided."""


def removed_energy(truth: Truth) -> tuple[float, float, float]:
    """The share of the energy that clamping removed, and its 95 % interval.

    R / (Y + R) from the means of the kept part Y and the removed part R of each accumulator; its error by the delta
    method, with Student's t.
    """
    assert truth.removed is not None
    kept, removed = (
        part[:, truth.mask].astype(float).mean(axis=(1, 2)) for part in (truth.accumulators, truth.removed)
    )
    total = float((kept + removed).mean())
    if total == 0:
        return 0.0, 0.0, 0.0
    share = float(removed.mean()) / total
    deviations = (removed - share * (kept + removed)) / total
    k = len(deviations)
    half_width = student_quantile(ALPHA, k - 1) * float(deviations.std(ddof=1)) / k**0.5
    return share, max(0.0, share - half_width), share + half_width


def clamp_note(truth: Truth, clamp: float | None) -> str:
    """The definition of a clamped truth and what it costs; empty for one that is not clamped."""
    if clamp is None or truth.removed is None:
        return ""
    share, low, high = removed_energy(truth)
    removed = truth.removed[:, truth.mask].astype(float)
    doubt = firefly_note(removed - removed.mean(axis=0))
    warning = "; this share itself rests on few bright paths and may be larger" if doubt else ""
    return (
        f"The truth is clamped: no sample counts for more than {clamp:g}. That removes {share:.2%} "
        f"[{low:.2%}, {high:.2%}] of its energy{warning}."
    )
