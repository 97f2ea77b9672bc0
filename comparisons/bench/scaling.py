"""How the time of a frame grows with what is drawn: its pixels, its triangles, its lights."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

from comparisons.bench.powerlaw import LEAST_SIZES, fit_power_law
from comparisons.bench.result import Scaling
from comparisons.bench.sizes import AXES
from realtime.render import Renderer
from realtime.technique import Technique
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.model import Scene

FRAMES = 31
"""Of a size, unless they take longer than `PATIENCE`: the median of an odd number is one of them."""

PATIENCE = 2.0
"""Seconds for the frames of one size."""

LONGEST_FRAME = 5.0
LONGEST_START = 30.0
"""Seconds. A size that is expected to take longer, in proportion to the one before, is left out."""

Skip = Callable[[str, str], None]
"""Gets what was left out, and why."""


@dataclass(frozen=True)
class Measured:
    """Seconds of a frame, and of what comes before the first: to build, upload, compile, bake."""

    size: float
    seconds: float
    start_seconds: float

    def too_long(self, size: float) -> str:
        """Why a larger size is not worth waiting for; empty if it is."""
        growth = size / self.size
        frame, start = growth * self.seconds, growth * self.start_seconds
        if frame > LONGEST_FRAME:
            return f"{size:g}: a frame would take about {frame:.2g} s, more than {LONGEST_FRAME:g} s"
        if start > LONGEST_START:
            return f"{size:g}: preparing a frame would take about {start:.2g} s, more than {LONGEST_START:g} s"
        return ""


def scalings(
    scene: Scene,
    technique: Technique,
    settings: Mapping[str, SettingValue],
    axes: Sequence[str],
    say_step: Callable[[str], None],
    skip: Skip = lambda what, why: None,
) -> list[Scaling]:
    """The power law of a technique over each of the `axes` (keys of `comparisons.bench.sizes.AXES`).

    No truth is needed. What cannot be measured, and the reason, goes to `skip`: an axis that the scene or the technique
    does not allow, a size that would take too long, and an axis on which too few sizes are left to fit.

    Parameters
    ----------
    say_step : told of each size before it is measured
    """
    found = []
    for axis in axes:
        what = f"{scene.name}, {technique.name}: {axis}"
        measured, why = _measured(what, AXES[axis], scene, technique, settings, say_step)
        if (different := len({one.size for one in measured})) < LEAST_SIZES:
            why = f"{why} A power law takes {LEAST_SIZES} sizes; here it would be {different}.".lstrip()
        else:
            sizes, seconds = tuple(one.size for one in measured), tuple(one.seconds for one in measured)
            law = fit_power_law(sizes, seconds)
            found.append(
                Scaling(scene.name, technique.name, axis, sizes, seconds, law.exponent, law.coefficient, law.r2)
            )
        if why:
            skip(what, why)
    return found


def _measured(
    what: str,
    sizes_of: Callable[[Scene, Path], Iterator[tuple[float, Scene]]],
    scene: Scene,
    technique: Technique,
    settings: Mapping[str, SettingValue],
    say_step: Callable[[str], None],
) -> tuple[list[Measured], str]:
    """What was measured, and why it ended before the last size, if it did."""
    measured: list[Measured] = []
    try:
        with TemporaryDirectory() as folder:
            for size, variant in sizes_of(scene, Path(folder)):
                if measured and (why := measured[-1].too_long(size)):
                    return measured, f"{why}; it and larger sizes are left out."
                say_step(f"{what}, {size:g}")
                measured.append(_time_of(variant, size, technique, settings))
    except InputError as error:
        return measured, str(error)
    return measured, ""


def _time_of(scene: Scene, size: float, technique: Technique, settings: Mapping[str, SettingValue]) -> Measured:
    start = perf_counter()
    prepared = Renderer(scene).prepared(technique, dict(settings))
    ready = perf_counter()
    seconds: list[float] = []
    while len(seconds) < FRAMES and perf_counter() - ready < PATIENCE:
        seconds.append(prepared.frame().seconds)
    return Measured(size, median(seconds), ready - start)
