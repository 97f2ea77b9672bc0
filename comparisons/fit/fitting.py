"""Fit constants on training scenes, and see what they do to scenes that they were not fitted on."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from comparisons.difference import difference, error_named
from comparisons.fit.example import Example, best_factor
from comparisons.fit.gain import Gain, Pair, gain
from comparisons.fit.result import Fit, Fitted, Score
from comparisons.fit.rough import rough_scene, rough_technique
from comparisons.fit.search import Errors, Settings, best_settings, takes_many, without_effect
from comparisons.fit.space import Axis, Part
from comparisons.metrics import Samples
from comparisons.suite import require_parity
from realtime.render import Renderer
from realtime.technique import Technique
from reference.estimator import Reference
from reference.store import Store
from reference.studio import Progress
from scenes.checks import SettingValue
from scenes.digest import digest_of, scene_parts
from scenes.errors import InputError, RenderError
from scenes.image import Float64
from scenes.model import Scene

FAR_OFF = 1.0
"""What each pixel counts as where a scene cannot be drawn: as much as if each were all of the error there is."""

MOST_SAID = 4
"""Settings that are spelt out while they are tried; more are counted."""

ALPHA = 0.025
"""How probably an interval misses on either side."""


@dataclass(frozen=True)
class Task:
    """What is to be fitted. `parts` may be empty if the exposure is fitted; `spp` is the least number of samples."""

    technique: Technique
    pinned: Settings
    parts: tuple[Part, ...]
    metric: str
    with_exposure: bool
    spp: int
    evaluations: int

    @property
    def published(self) -> dict[str, SettingValue]:
        return {part.name: part.published for part in self.parts}


@dataclass(frozen=True)
class Tuned:
    """Settings of all parts, and the factor on all images."""

    settings: Settings
    exposure: float


class Judge:
    """The error of a task's settings, the mean over some scenes; remembers which settings could not be drawn."""

    def __init__(self, task: Task, step: Progress) -> None:
        self.task = task
        self.failed: dict[tuple[object, ...], str] = {}
        self._step = step

    def errors(self, examples: Sequence[Example]) -> Errors:
        return Errors(partial(self.error, examples), partial(self.pixel_errors, examples))

    def error(self, examples: Sequence[Example], settings: Settings) -> float:
        """Infinite where a scene cannot be drawn so."""
        try:
            return self.tuned(examples, settings)[1]
        except (InputError, RenderError) as error:
            self.failed[tuple(sorted(settings.items()))] = str(error)
            return math.inf

    def pixel_errors(self, examples: Sequence[Example], settings: Settings) -> Float64:
        """What each pixel of all scenes is off with the exposure that suits them best; far off where one fails."""
        self._say(examples, settings)
        try:
            pairs = [example.weighted({**self.task.pinned, **settings}) for example in examples]
        except (InputError, RenderError) as error:
            self.failed[tuple(sorted(settings.items()))] = str(error)
            return np.full(sum(example.samples.masked[0].size for example in examples), FAR_OFF)
        images, truths = np.concatenate([image for image, _ in pairs]), np.concatenate([truth for _, truth in pairs])
        factor = float(images @ truths) / float(images @ images) if self.task.with_exposure else 1.0
        return np.asarray((factor * images - truths) / math.sqrt(len(examples)))

    def tuned(self, examples: Sequence[Example], settings: Settings) -> tuple[Tuned, float]:
        """The settings with the exposure that suits them best on all scenes together, and their error."""
        self._say(examples, settings)
        parabolas = [example.parabola({**self.task.pinned, **settings}) for example in examples]
        factor = best_factor(parabolas) if self.task.with_exposure else 1.0
        return Tuned(settings, factor), sum(p.at(factor) for p in parabolas) / len(parabolas)

    def _say(self, examples: Sequence[Example], settings: Settings) -> None:
        done = max(example.drawings for example in examples)
        self._step(f"{self.task.technique.name}: {_words(settings)}", min(1.0, done / max(1, self.task.evaluations)))


def fit(task: Task, train: Sequence[Scene], test: Sequence[Scene], store: Store, step: Progress) -> Fit:
    """Fit on some scenes, test on others; without others, each training scene is held out in its turn.

    Parameters
    ----------
    step : called with what is being done and the fraction of it that is done.

    Raises
    ------
    InputError
        Scenes are named twice, the quantity has no meaning for one, or nothing that is fitted has any effect.
    RenderError
        The two sides do not see the same scene, or one cannot be drawn as published.
    """
    error_named(task.metric)
    require_apart(train, test)
    clock = time.perf_counter()
    drawn: dict[str, str] = {}
    training, held_out = ([example_of(task, scene, store, step, drawn) for scene in scenes] for scenes in (train, test))
    return replace(
        fit_examples(task, training, held_out, step),
        seconds=time.perf_counter() - clock,
        gl_renderer="; ".join(sorted(set(drawn.values()))),
    )


def require_apart(train: Sequence[Scene], test: Sequence[Scene]) -> None:
    """See that no scene is there twice, under whatever name.

    Raises
    ------
    InputError
        One is.
    """
    seen: dict[str, str] = {}
    for scene, role in [*((s, "--on") for s in train), *((s, "--test") for s in test)]:
        key = digest_of(scene_parts(scene))
        if key in seen:
            raise InputError(
                f"'{scene.name}' of {role} is the same scene as {seen[key]}. A scene that was fitted on tells nothing "
                "about others, and one that counts twice counts too much: name each scene once."
            )
        seen[key] = f"'{scene.name}' of {role}"


def example_of(task: Task, scene: Scene, store: Store, step: Progress, drawn: dict[str, str]) -> Example:
    """A scene with the truth at hand, once both sides are seen to agree on it; `drawn` gets what draws it."""
    Reference(scene, store, step).require_defined(task.technique.approximates)
    require_parity(scene, scene.name, store, step)
    rough = None
    if takes_many(task.parts):
        rough = _example(replace(task, technique=rough_technique(task.technique)), rough_scene(scene), store, step, {})
    return _example(task, scene, store, step, drawn, rough)


def _example(
    task: Task, scene: Scene, store: Store, step: Progress, drawn: dict[str, str], rough: Example | None = None
) -> Example:
    truth = Reference(scene, store, step).at_hand(task.technique.approximates, task.spp)
    renderer = Renderer(scene)

    def draw(settings: Settings) -> Float64:
        image = renderer.render(task.technique, dict(settings), timed=False).image
        drawn[scene.name] = str(image.provenance["renderer"])
        return image.pixels.astype(np.float64)

    return Example(scene, task.metric, Samples(truth.accumulators, truth.mask, ALPHA), truth.spp, draw, rough)


def fit_examples(task: Task, train: Sequence[Example], test: Sequence[Example], step: Progress) -> Fit:
    """As `fit`, with the truths at hand."""
    judge = Judge(task, step)
    for example in (*train, *test):
        judge.tuned([example], task.published)  # raises what is wrong with a scene before long work
    error = partial(judge.error, [example.rough for example in train])
    still = without_effect(error, task.parts, task.published)
    moving = [part for part in task.parts if part not in still]
    if not moving and not task.with_exposure:
        raise InputError(
            f"Nothing that is to be fitted has an effect on the error of {task.technique.name} on "
            f"{', '.join(example.scene.name for example in train)}: {', '.join(part.name for part in still)}. Choose "
            "other parameters or scenes."
        )
    tuned = _fitted(judge, train, moving)
    in_turn = not test and len(train) > 1
    if in_turn:
        rest = [[other for other in train if other is not example] for example in train]
        folds = [_fitted(judge, others, moving) for others in rest]
        held_out, alone = list(train), [judge.tuned(others, task.published)[0] for others in rest]
    else:
        held_out, folds = list(test), [tuned] * len(test)
        alone = [judge.tuned(train, task.published)[0]] * len(test)
    published = Tuned(task.published, 1.0)
    train_scores, train_gain = _scored(task, train, published, [tuned] * len(train))
    test_scores, test_gain = _scored(task, held_out, published, folds)
    by_exposure = _scored(task, held_out, published, alone)[1] if task.with_exposure and task.parts else None
    return Fit(
        technique=task.technique.name,
        quantity=task.technique.approximates,
        metric=task.metric,
        pinned=dict(task.pinned),
        parameters=tuple(_described(part, tuned, part not in still) for part in task.parts),
        exposure=tuned.exposure if task.with_exposure else None,
        train=train_scores,
        held_out=test_scores,
        in_turn=in_turn,
        train_gain=train_gain,
        held_out_gain=test_gain,
        exposure_gain=by_exposure,
        drawings=sum(one.drawings for one in {*train, *test, *(example.rough for example in train)}),
        seconds=0.0,
        failed=(len(judge.failed), next(reversed(judge.failed.values()), "")),
        gl_renderer="",
    )


def _fitted(judge: Judge, examples: Sequence[Example], moving: Sequence[Part]) -> Tuned:
    settings = judge.task.published
    if moving:
        fine, rough = judge.errors(examples), judge.errors([example.rough for example in examples])
        settings = best_settings(fine, rough, moving, settings, judge.task.evaluations).settings
    return judge.tuned(examples, settings)[0]


def _scored(
    task: Task, examples: Sequence[Example], published: Tuned, fitted: Sequence[Tuned]
) -> tuple[tuple[Score, ...], Gain | None]:
    """Each scene's errors, and the gain over all of them."""
    if not examples:
        return (), None
    pairs = [
        Pair(_image(task, example, published), _image(task, example, tuned), example.samples)
        for example, tuned in zip(examples, fitted, strict=True)
    ]
    scores = [_score(task, example, tuned, pair) for example, tuned, pair in zip(examples, fitted, pairs, strict=True)]
    return tuple(scores), gain(task.metric, pairs)


def _image(task: Task, example: Example, tuned: Tuned) -> Float64:
    return tuned.exposure * example.draw({**task.pinned, **tuned.settings})


def _score(task: Task, example: Example, tuned: Tuned, pair: Pair) -> Score:
    found = difference(task.metric, pair.before, pair.after, pair.samples)
    return Score(
        scene=example.scene.name,
        spp=example.spp,
        settings={**task.pinned, **tuned.settings},
        exposure=tuned.exposure,
        published=found.a,
        fitted=found.b,
        gain=gain(task.metric, [pair]),
        note=found.note,
    )


def _described(part: Part, tuned: Tuned, has_effect: bool) -> Fitted:
    value = tuned.settings[part.name]
    if not isinstance(part, Axis):
        return Fitted(part.name, part.published, value, None, None, "", has_effect)
    edge = part.edge(float(value)) if has_effect else ""
    return Fitted(part.name, part.published, value, part.low, part.high, edge, has_effect)


def _words(settings: Settings) -> str:
    if len(settings) > MOST_SAID:
        return f"{len(settings)} settings"
    return ", ".join(f"{name} {value}" for name, value in settings.items())
