"""Constants as published and as fitted, and whether what was gained on training scenes is gained on others."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from comparisons.answers.diff import aligned, parse_variant
from comparisons.difference import RELATIVE_MARGIN, error_named
from comparisons.fit.fitting import Task, fit
from comparisons.fit.gain import Gain
from comparisons.fit.result import CARRIES_OVER, NO_GAIN, NOT_TESTED, UNDECIDED, WORSE, Fit, Fitted, Score
from comparisons.fit.search import EVALUATIONS, MANY
from comparisons.fit.space import DECADE, parts_of
from comparisons.metrics import Estimate
from comparisons.report.numbers import format_interval, format_metric, format_number, format_seconds
from comparisons.results import environment
from comparisons.scene_files import find
from realtime.looks import Look, look_of, look_text
from realtime.own import LOOK_SUFFIX, NAME
from realtime.technique import Technique
from realtime.techniques import technique
from reference.store import Store, write_text
from reference.studio import Progress
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.load import load_scene
from scenes.model import Scene

DECIDED, OPEN = 0, 2

SHARE = "nrmse"
"""Gains are written as this metric is: in percent."""


@dataclass(frozen=True)
class Asked:
    """What the command line asks for."""

    subject: str
    on: tuple[str, ...]
    test: tuple[str, ...]
    parameters: tuple[str, ...]
    with_exposure: bool
    metric: str
    spp: int
    evaluations: int | None
    file: Path
    look: Path | None = None


def fit_lines(asked: Asked, store: Store, step: Progress) -> tuple[list[str], int]:
    """Fit, write the result, and say it; the exit status is 0, or 2 where it stays open whether others gain.

    Raises
    ------
    InputError
        A technique, parameter, metric or scene is unknown or cannot be used, or nothing is to be fitted.
    """
    task = task_of(asked)
    if asked.look is not None:
        require_look(task.technique, asked.look)
    train, test = (_scenes(names) for names in (asked.on, asked.test))
    started = datetime.now(UTC).isoformat(timespec="seconds")
    found = fit(task, train, test, store, step)
    machine = environment(()) | {"gl_renderer": found.gl_renderer}
    content = found.to_json() | {"started": started, "environment": machine}
    write_text(asked.file, json.dumps(content, indent=1, allow_nan=False))
    lines = [*lines_of(found), f"wrote {asked.file}"]
    if asked.look is not None:
        write_text(asked.look, look_text(_look(task, found, asked.look)))
        lines.append(f"wrote {asked.look}: --technique {asked.look} makes it known as {_look_name(asked.look)}")
    return lines, OPEN if found.verdict == UNDECIDED else DECIDED


def require_look(subject: Technique, file: Path) -> None:
    """See that what is fitted can be written as a look.

    Raises
    ------
    InputError
        The technique has no sliders, or the file's name makes no name for the look.
    """
    if not subject.sliders:
        raise InputError(f"'{subject.name}' has no sliders, so that it has no look either. Leave out --look.")
    if file.suffix != LOOK_SUFFIX or not NAME.fullmatch(_look_name(file)):
        raise InputError(
            f"'{file}' cannot hold a look, which is named after it. Give it the suffix {LOOK_SUFFIX}, and a name of "
            "letters, digits, '_' and '-', such as suit.toml."
        )


def _look_name(file: Path) -> str:
    return f"mine.{file.stem}"


def _look(task: Task, found: Fit, file: Path) -> Look:
    settings = task.technique.settings({**task.pinned, **found.settings})
    names = ", ".join(score.scene for score in found.train)
    return look_of(task.technique, _look_name(file), f"fitted by {_error(found)} to {names}", settings)


def _scenes(names: tuple[str, ...]) -> list[Scene]:
    """The scenes that are named; `find` would take no name for all of them."""
    return [load_scene(file.path) for file in find(names).scenes] if names else []


def task_of(asked: Asked) -> Task:
    """What is to be fitted.

    Raises
    ------
    InputError
        Something is unknown, out of range, or nothing is left to be fitted.
    """
    variant = parse_variant(asked.subject)
    subject = variant.technique
    if variant.fit_exposure:
        raise InputError(
            "An exposure `fitted` to each image says nothing about other scenes. Leave it out of the brackets; "
            "--exposure fits one for all scenes."
        )
    error_named(asked.metric)
    if asked.spp < 1 or (asked.evaluations is not None and asked.evaluations < 1):
        raise InputError("--spp and --evaluations count samples and drawings; at least 1 is allowed.")
    parts = parts_of(subject, asked.parameters, variant.settings)
    if not parts and not asked.with_exposure:
        names = ", ".join(p.name for p in subject.settable if p.name not in variant.settings)
        raise InputError(
            f"'{subject.name}' declares no constant as tuned by eye. Name what to fit with --parameters "
            f"(it has: {names or 'none'}), or fit the --exposure."
        )
    return Task(
        technique=subject,
        pinned=variant.settings,
        parts=parts,
        metric=asked.metric,
        with_exposure=asked.with_exposure,
        spp=asked.spp,
        evaluations=asked.evaluations or EVALUATIONS * max(1, len(parts)),
    )


def lines_of(fit: Fit) -> Iterator[str]:
    """What was found, in words."""
    names = ", ".join(score.scene for score in fit.train)
    yield f"{fit.technique}, {fit.quantity}: fitted by {_error(fit)} on {names}"
    yield from aligned([("", "published", "fitted", "range"), *_parameter_rows(fit)])
    heading = ("", "", "truth", f"{fit.metric} published", "", "fitted", "", _error(fit))
    yield from aligned([heading, *_score_rows("train", fit.train, fit), *_score_rows("test", fit.held_out, fit)])
    yield from _verdict(fit)
    yield from _remarks(fit)
    if len(fit.parameters) <= MANY:
        yield f"for a check: {toml_of(fit)}"
    else:
        yield f"for a check, {len(fit.parameters)} settings are too many: --look FILE keeps them as a look"
    yield f"{fit.drawings} images drawn in {format_seconds(fit.seconds)}"


def _parameter_rows(fit: Fit) -> Iterator[tuple[str, ...]]:
    for p in fit.parameters:
        yield f"  {p.name}", _value(p.published), _value(p.fitted) if p.has_effect else "no effect", _span(p)
    if fit.exposure is not None:
        yield "  exposure", "1", format_number(fit.exposure), "one for all scenes"


def _span(p: Fitted) -> str:
    if p.low is None or p.high is None:
        return "all values"
    by_factors = p.low > 0 and p.high / p.low > DECADE
    return f"{p.low:g} to {p.high:g}{' by factors' if by_factors else ''}"


def _value(value: SettingValue) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _score_rows(role: str, scores: tuple[Score, ...], fit: Fit) -> Iterator[tuple[str, ...]]:
    for score in scores:
        yield (
            f"  {role}",
            score.scene,
            f"{score.spp} spp" if score.spp else "exact",
            *_interval(fit.metric, score.published),
            *_interval(fit.metric, score.fitted),
            _change(score.gain),
        )


def _interval(metric: str, estimate: Estimate) -> tuple[str, str]:
    return format_metric(metric, estimate.value), format_interval(metric, estimate.low, estimate.high)


def _change(gain: Gain | None) -> str:
    if gain is None:
        return "not told: as published, it may be 0"
    if gain.value < 0:
        return f"{_percent(-gain.value, -gain.high, -gain.low)} higher"
    return f"{_percent(gain.value, gain.low, gain.high)} lower"


def _percent(value: float, low: float, high: float) -> str:
    interval = "" if low == high else f" {format_interval(SHARE, low, high)}"
    return f"{format_metric(SHARE, value)}{interval}"


def _error(fit: Fit) -> str:
    """What is fitted is a mean square, of which nrmse is the root."""
    return "squared nrmse" if fit.metric == "nrmse" else fit.metric


def _verdict(fit: Fit) -> Iterator[str]:
    error, change = _error(fit), _change(fit.held_out_gain)
    held_out = "scenes held out in their turn" if fit.in_turn else "held-out scenes"
    trained = ", ".join(score.scene for score in fit.train)
    yield f"Training scenes: {error} {_change(fit.train_gain)}."
    yield {
        CARRIES_OVER: f"The gain carries over to {held_out}: {error} {change}.",
        NO_GAIN: f"No gain on {held_out} that matters: {error} {change}. What was found fits {trained} only.",
        WORSE: f"Over-fitted to {trained}: on {held_out}, {error} {change}.",
        UNDECIDED: f"Undecided on {held_out}: {error} {change}. A larger --spp narrows the interval.",
        NOT_TESTED: "Whether it carries over to other scenes was not tested: name some with --test, or train on more.",
    }[fit.verdict]
    yield from _disagreement(fit.held_out)
    if fit.exposure_gain is not None:
        yield f"The exposure alone, with the published constants: {_change(fit.exposure_gain)}."
    if fit.held_out:
        yield "Intervals (95 %) hold the noise of the truth on these scenes; what others gain, only others tell."


def _disagreement(scores: tuple[Score, ...]) -> Iterator[str]:
    """Which scenes gain and which lose, if not all do the same by more than a margin that does not matter."""
    gains = {score.scene: score.gain for score in scores if score.gain is not None}
    better = [name for name, gain in gains.items() if gain.low > RELATIVE_MARGIN]
    worse = [name for name, gain in gains.items() if gain.high < -RELATIVE_MARGIN]
    if better and worse:
        yield f"The error falls on {', '.join(better)} and rises on {', '.join(worse)}."


def _remarks(fit: Fit) -> Iterator[str]:
    allowed = {parameter.name: parameter.bounds for parameter in technique(fit.technique).settable}
    for p in fit.parameters:
        if not p.has_effect:
            yield f"{p.name} has no effect on the training scenes and was left at {_value(p.published)}."
        elif p.edge:
            yield _at_the_edge(p, allowed[p.name])
    for score in (*fit.train, *fit.held_out):
        if score.note:
            yield f"{score.scene}: {score.note}."
    count, why = fit.failed
    if count:
        yield f"{count} settings could not be drawn and were passed over; the last: {why}"


def _at_the_edge(p: Fitted, allowed: tuple[float, float]) -> str:
    end = p.low if p.edge == "low" else p.high
    ended = f"{p.name} ended at the {p.edge} end of its range, {end:g}"
    if end in allowed:
        return f"{ended}, which is as far as is allowed."
    return f"{ended}: a better value may lie beyond. --parameters {p.name}=LOW..HIGH gives it another range."


def toml_of(fit: Fit) -> str:
    """The settings as they stand in a check of a scene, and the factor if one was fitted."""
    settings = ", ".join(f"{name} = {json.dumps(value)}" for name, value in fit.settings.items())
    factor = "" if fit.exposure is None else f"  # image times {fit.exposure:.4g}"
    return f"settings = {{ {settings} }}{factor}"
