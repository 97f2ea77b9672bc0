"""How honest the error bars are, as a document."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path

import numpy as np

from comparisons.calibration.pool import DISTANCES_M, SAMPLES, Pool, pool_of
from comparisons.calibration.studies import COVERAGE_SPP, LIMIT, Alarms, Coverage, Verdicts, alarms, coverage, verdicts
from comparisons.results import environment
from comparisons.sequential import ALPHA_PER_SIDE
from comparisons.statistics import LEAST_EVENTS

RATIOS = (0.5, 0.9, 1.0, 1.1, 2.0)
BUDGETS = {"easy": (0.1, 0.3), "hard": (0.3,), "fireflies": (0.3,)}
ALARM_SPP = (64, 256, 1024)

Progress = Callable[[str, float], None]


def calibration_lines(kernels: Path, repetitions: int, progress: Progress) -> Iterator[str]:
    """The whole document in Markdown.

    Parameters
    ----------
    repetitions : of each simulated experiment.
    """
    yield from _opening(repetitions)
    pools = [pool_of(name, kernels, progress) for name in DISTANCES_M]
    easy = pools[0]
    yield from _coverage_lines([(pool.name, coverage(pool, repetitions, progress)) for pool in pools[:2]])
    judged = (verdicts(p, budget, RATIOS, repetitions, progress) for p in pools for budget in BUDGETS[p.name])
    yield from _verdict_lines([row for rows in judged for row in rows], repetitions)
    yield from _alarm_lines(alarms(easy, ALARM_SPP, repetitions, progress), easy)


def _opening(repetitions: int) -> Iterator[str]:
    versions = environment([])
    yield "# Calibration of the error bars"
    yield ""
    yield (
        f"Made by `lightgauge calibrate --repetitions {repetitions}` with lightgauge {versions['lightgauge']}, Mitsuba "
        f"{versions['mitsuba']}, NumPy {versions['numpy']}. Everything here is measured on simulated truths: "
        f"{SAMPLES} real samples of each pixel of `small-room-ellipsoid` form a pool, truths are drawn from it with "
        "replacement, and its mean is the exact answer. In the *hard* world the light is 3 cm from a wall, and few "
        "paths find the bright spot there; in the *fireflies* world it is 5 mm from it."
    )


def _coverage_lines(studies: Sequence[tuple[str, Sequence[Coverage]]]) -> Iterator[str]:
    yield from _section(
        "Coverage",
        "How often a nominal 95 % interval holds the exact error, among the intervals that claim to be valid; and the "
        "mean error of estimation at 16 samples a pixel, in its own standard errors over the repetitions. An estimate "
        f"whose noise rests on fewer than {LEAST_EVENTS} bright samples claims nothing: *fireflies*.",
    )
    yield _row("world", "metric", "error of the image", *(f"{spp} spp" for spp in COVERAGE_SPP), "bias at 16 spp")
    yield _rule(3, len(COVERAGE_SPP) + 1)
    for name, rows in studies:
        for (metric, case), found in groupby(sorted(rows, key=_order), lambda r: (r.metric, r.case)):
            cells = list(found)
            if metric == "energy_bias" and case != "none":
                continue  # its interval is that of the truth's mean, the same for every image
            yield _row(name, f"`{metric}`", case, *(_covered(c) for c in cells), f"{cells[0].bias:+.1f}")


def _order(row: Coverage) -> tuple[str, str, int]:
    return row.metric, row.case, row.spp


def _covered(row: Coverage) -> str:
    if np.isnan(row.coverage):
        return "fireflies"
    share = "" if row.valid == 1 else f" ({row.valid:.0%} valid)"
    return f"{row.coverage:.1%}{share}"


def _verdict_lines(rows: Iterable[Verdicts], repetitions: int) -> Iterator[str]:
    yield from _section(
        "Verdicts",
        f"An image whose nrmse is so many times its budget, judged as a run judges it, by at most {LIMIT} samples a "
        f"pixel, {repetitions} times. PASS above the budget and FAIL below it are wrong, at the budget both are; each "
        f"may happen in {ALPHA_PER_SIDE:.0%}. Wrong ones are in bold.",
    )
    yield _row("world", "budget", "error / budget", "PASS", "FAIL", "INCONCLUSIVE", "mean spp")
    yield _rule(2, 5)
    for r in rows:
        passed = f"**{r.passed:.1%}**" if r.ratio >= 1 else f"{r.passed:.1%}"
        failed = f"**{r.failed:.1%}**" if r.ratio <= 1 else f"{r.failed:.1%}"
        yield _row(r.world, f"{r.budget:.0%}", f"{r.ratio:g}", passed, failed, f"{r.open:.1%}", f"{r.spp:.0f}")


def _alarm_lines(rows: Iterable[Alarms], pool: Pool) -> Iterator[str]:
    yield from _section(
        "Significance map",
        f"How often the map marks anything on {pool.mask.shape[1]} x {pool.mask.shape[0]} pixels, and the mean share "
        "of the judged pixels that it marks. Without any error, every mark is a false alarm; the false discovery rate "
        "is set to 5 %.",
    )
    yield _row("image", "spp", "images with a mark", "pixels marked")
    yield _rule(1, 3)
    for r in sorted(rows, key=lambda r: (r.case != "no error", r.spp)):
        yield _row(r.case, str(r.spp), f"{r.images:.1%}", f"{r.pixels:.2%}")


def _section(title: str, text: str) -> Iterator[str]:
    yield ""
    yield f"## {title}"
    yield ""
    yield text
    yield ""


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def _rule(words: int, numbers: int) -> str:
    return f"|{'---|' * words}{'---:|' * numbers}"
