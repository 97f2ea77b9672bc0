"""What each part of a technique is worth: it is left out, and the error that this adds is held against the time saved.

Both images are held against the same samples of the truth, whose noise nearly cancels in the difference of their errors
(see `comparisons.difference`). That difference is taken of the metric as it is stated, whatever that is; its variance
comes from the jackknife over groups of accumulators: Shao and Tu, 1995, "The Jackknife and Bootstrap", section 2.3.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import median
from typing import Any

import numpy as np

from comparisons.bench.interleave import Task, interleave
from comparisons.bench.points import ALPHA, Judge
from comparisons.bench.result import Ablation, Interval
from comparisons.bench.stills import strip
from comparisons.bench.sweep import error_metric
from comparisons.gate import fit_exposure
from comparisons.metrics import Estimate, Samples, evaluate
from comparisons.statistics import student_quantile
from realtime.graph import Pass, plan
from realtime.render import Renderer
from realtime.technique import Technique
from realtime.techniques import technique
from realtime.timing import FrameSample, Prepared
from reference.estimator import Reference, Truth
from reference.quantities import effect_of
from reference.store import Store
from scenes.checks import Check, SettingValue
from scenes.errors import LightgaugeError, NoCompiler, NoGraphics
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float32
from scenes.model import Scene

GROUP = 2
"""Accumulators that the jackknife leaves out at a time: a metric takes even numbers of them."""

SECONDS, FRAMES = 2.0, 25
"""What the frames of one side may take, and how many they are at most."""

Step = Callable[[str, float], None]
Skip = Callable[[str, str], None]
"""Gets a part that cannot be left out, and why."""


@dataclass(frozen=True)
class Part:
    """A part of a technique: `settings` without it, or the passes to draw `without`. `how` says which, in words."""

    name: str
    how: str
    settings: dict[str, SettingValue] = field(default_factory=dict)
    without: tuple[str, ...] = ()


def parts_of(used: Technique, scene: Scene, given: Mapping[str, SettingValue]) -> list[Part]:
    """What can be switched off: settings that have a value for that, and passes whose absence leaves a whole plan.

    A pass that goes with a setting is not named again.
    """
    settings = used.settings(given)
    switches = [
        Part(p.name, f"{p.name} = {_spelt(p.off)} in place of {_spelt(settings[p.name])}", {p.name: p.off})
        for p in used.parameters
        if p.off is not None and settings[p.name] != p.off
    ]
    features = features_of(scene, geometry_of(scene))
    passes = used.passes(scene, features, settings)
    drawn = {step.name for step in plan(passes, "image").passes}
    for switch in switches:
        drawn &= {step.name for step in plan(used.passes(scene, features, settings | switch.settings), "image").passes}
    steps = [
        Part(step.name, "the pass is left out", without=(step.name,))
        for step in passes
        if step.name in drawn and _can_do_without(passes, step.name)
    ]
    return switches + steps


def _can_do_without(passes: Sequence[Pass], name: str) -> bool:
    try:
        plan(passes, "image", [name])
    except ValueError:
        return False
    return True


def _spelt(value: SettingValue | None) -> str:
    return ("off", "on")[value] if isinstance(value, bool) else f"{value}"


def ablations(
    scene: Scene, check: Check, store: Store, step: Step, skip: Skip = lambda what, why: None
) -> Iterator[Ablation]:
    """The parts of a check's technique left out in turn, judged by the metric of its first criterion that is no bias.

    A part without which no image comes about, or none that can be judged, goes to `skip`.

    Raises
    ------
    NoGraphics, NoCompiler
        Nothing can be rendered on this machine.
    LightgaugeError
        The technique does not draw the scene as it is, or there is no truth to judge by.
    """
    used, metric = technique(check.technique), error_metric([check])
    judge = Judge(Reference(scene, store, step), check.quantity, metric)
    renderer = Renderer(scene)
    parts = parts_of(used, scene, check.settings)
    name = f"{scene.name}, {used.name}"
    step(f"{name}: whole", 0.0)
    whole = renderer.prepared(used, check.settings)
    judge.judged(whole.rendering.image.pixels, check.fit_exposure)
    for number, part in enumerate(parts):
        step(f"{name} without {part.name}", (number + 1) / (len(parts) + 1))
        try:
            less = renderer.prepared(used, {**check.settings, **part.settings}, part.without)
            errors = _Errors(judge.truth, metric, check.fit_exposure, whole, less)
        except (NoGraphics, NoCompiler):
            raise
        except LightgaugeError as error:
            skip(f"{name} without {part.name}", f"needed: {error}")
        except Exception as error:  # noqa: BLE001  # shaders and passes may fail in any way without what they expect
            skip(f"{name} without {part.name}", f"needed: {_fault(error)}")
        else:
            seconds_with, seconds_without = _seconds(whole, less)
            yield Ablation(
                scene=scene.name,
                effect=effect_of(check.quantity),
                technique=used.name,
                settings=dict(check.settings),
                part=part.name,
                how=part.how,
                metric=metric,
                error_with=_interval(errors.whole),
                error_without=_interval(errors.less),
                added=errors.added,
                seconds_with=seconds_with,
                seconds_without=seconds_without,
                picture=strip(whole.rendering.image.pixels, less.rendering.image.pixels, judge.truth),
            )


def _fault(error: Exception) -> str:
    """What went wrong without a part, for readers who do not know the code."""
    if isinstance(error, KeyError):
        return f"a later pass finds no {error} without it."
    return f"drawing fails without it ({type(error).__name__}: {error})."


class _Errors:
    """The errors of two images by the same samples, and what the second one has more."""

    def __init__(self, truth: Truth, metric: str, is_fitted: bool, whole: Prepared, less: Prepared) -> None:
        images = (whole.rendering.image.pixels, less.rendering.image.pixels)
        samples = Samples(truth.accumulators, truth.mask, ALPHA)
        error = partial(_estimate, metric, is_fitted)
        self.whole, self.less = (error(image, samples) for image in images)
        self.added = added_error(lambda some: error(images[1], some).value - error(images[0], some).value, samples)


def added_error(difference: Callable[[Samples], float], samples: Samples) -> Interval:
    """A difference of two errors by the same samples, with its 95 % interval by the grouped jackknife."""
    value = difference(samples)
    if samples.is_exact:
        return Interval(value, value, value)
    groups = len(samples.accumulators) // GROUP
    partials = []
    for group in range(groups):
        rest = np.delete(samples.accumulators, range(GROUP * group, GROUP * (group + 1)), axis=0)
        partials.append(difference(Samples(rest, samples.mask, samples.alpha)))
    standard_error = float(np.sqrt((groups - 1) * np.var(partials)))
    half_width = student_quantile(samples.alpha, groups - 1) * standard_error
    return Interval(value, value - half_width, value + half_width)


def _estimate(metric: str, is_fitted: bool, image: Float32, samples: Samples) -> Estimate:
    factor = fit_exposure(image, samples) if is_fitted else 1.0
    return evaluate(metric, image * factor, samples)


def _interval(estimate: Estimate) -> Interval:
    return Interval(estimate.value, estimate.low, estimate.high)


def _seconds(whole: Prepared, less: Prepared) -> tuple[float, float]:
    """Medians of the frames of both, drawn in turns."""
    tasks: list[Task[Any]] = [Task(name, p.frame, _frame_seconds, FRAMES) for name, p in (("", whole), (" ", less))]
    interleave(tasks, SECONDS, lambda what, done: None, np.random.default_rng(0))
    with_part, without = (median(task.seconds) for task in tasks)
    return with_part, without


def _frame_seconds(sample: FrameSample) -> float:
    return sample.seconds
