"""What a millisecond buys: a benchmark as tables, sentences and bench.json."""

import json
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from comparisons.bench.ask import Asked, parts_of
from comparisons.bench.claims import claims
from comparisons.bench.interleave import FEWEST_FOR_INTERVAL
from comparisons.bench.machine import doubts, machine
from comparisons.bench.measure import Measured
from comparisons.bench.pareto import group_of, on_front
from comparisons.bench.plan import Ablated, Result, Scaled, Step
from comparisons.bench.result import FILE_NAME, SCHEMA, Ablation, Bench, Interval, Point, Scaling
from comparisons.bench.sweep import SENSOR
from comparisons.options import Say
from comparisons.partial import Partial
from comparisons.report.bench_page import write_bench_page
from comparisons.report.numbers import format_interval, format_metric, format_number, format_seconds
from comparisons.result import check_id
from realtime.clock import is_software
from realtime.context import make_context, renderer_name
from reference.store import Store, write_text
from scenes.errors import InputError, LightgaugeError, MachineError, NoCompiler, NoGraphics

PARTIAL = "bench.partial.json"


def run_bench(asked: Asked, folder: Path, store: Store, step: Step, say: Say) -> Bench:
    """Measure, and write bench.json and its page; finished parts are kept, so that the same command goes on.

    Raises
    ------
    InputError
        Nothing is meant, or the pace is none.
    MachineError
        Nothing could be measured.
    """
    parts = parts_of(asked)
    started = datetime.now(UTC).isoformat(timespec="seconds")
    environment = machine() | {"frames": asked.pace.frames, "seconds_per_point": asked.pace.seconds}
    kept = Partial(folder / PARTIAL)
    done: list[Result] = []
    skipped: list[dict[str, str]] = []
    before = 0
    for number, part in enumerate(parts):
        result = kept.found(part.key, part.kind)
        if result is None:
            try:
                result = part.run(store, partial(_step_of_all, step, number, len(parts)))
            except (NoGraphics, NoCompiler):
                raise
            except LightgaugeError as error:
                skipped.append({"what": part.name, "why": str(error)})
                say(f"[{number + 1}/{len(parts)}] left out: {part.name}. {error}")
                continue
            kept.keep(part.key, result)
            say(f"[{number + 1}/{len(parts)}] {part.name}: {_counted(result)}")
        else:
            before += 1
            say(f"[{number + 1}/{len(parts)}] {part.name}: {_counted(result)}, measured before")
        done.append(result)
    if not done:
        raise MachineError(f"Nothing could be measured. {skipped[0]['what']}: {skipped[0]['why']}")
    bench = _bench(environment, started, done, skipped, before)
    content = bench.to_json()
    write_text(folder / FILE_NAME, json.dumps(content, indent=1, allow_nan=False))
    write_bench_page(folder, content)
    kept.remove()
    return bench


def _step_of_all(step: Step, number: int, count: int, what: str, fraction: float) -> None:
    step(what, (number + fraction) / count)


def _bench(
    environment: dict[str, Any], started: str, done: Sequence[Result], skipped: Sequence[dict[str, str]], before: int
) -> Bench:
    """Everything that was measured, and what it says in words; `before` parts come from a run that was broken off."""
    measured = [one for one in done if isinstance(one, Measured)]
    scaled = [one for one in done if isinstance(one, Scaled)]
    points = tuple(point for one in measured for point in one.points)
    traced = tuple(image for one in measured for image in one.traced)
    slopes = tuple(slope for one in measured for slope in one.slopes)
    renderer = renderer_name(make_context())
    found = environment | {"gl_renderer": renderer}
    doubtful = list(doubts(found, is_software(renderer)))
    if before:
        doubtful.append(
            f"{before} of {len(done)} parts were measured by a run that was broken off: start and load average are "
            "those of the run that went on."
        )
    return Bench(
        environment=found | {"doubts": doubtful},
        started=started,
        points=points,
        traced=traced,
        slopes=slopes,
        scaling=tuple(law for one in scaled for law in one.laws),
        ablations=tuple(ablation for one in done if isinstance(one, Ablated) for ablation in one.ablations),
        claims=claims(points, traced, slopes),
        skipped=(*skipped, *(left for one in done for left in one.skipped)),
    )


def _counted(result: Result) -> str:
    """How much came out."""
    match result:
        case Measured(points=points, traced=traced):
            beside = f", path tracing at {_many(len(traced), 'sample count')}" if traced else ""
            return f"{_many(len(points), 'point')}{beside}"
        case Scaled(laws=laws):
            return _many(len(laws), "power law")
        case Ablated(ablations=ablations):
            return f"{_many(len(ablations), 'part')} switched off"


def _many(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def page_again(source: Path, folder: Path) -> Iterator[str]:
    """Write the page of a bench.json again.

    Raises
    ------
    InputError
        There is none, or it is of another version.
    """
    path = source / FILE_NAME if source.is_dir() else source
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(
            f"'{path}' cannot be read as a benchmark ({error}). Name a bench.json that `lightgauge bench` wrote."
        ) from error
    if not isinstance(content, dict) or content.get("schema") != SCHEMA or "points" not in content:
        raise InputError(f"'{path}' is no benchmark of schema {SCHEMA}. Measure again with `lightgauge bench`.")
    yield f"Page: {write_bench_page(folder, content)}"


def closing_lines(bench: Bench, folder: Path) -> Iterator[str]:
    """Tables, sentences, what was left out, and where the page is."""
    for effect, of_effect in groupby(bench.points, lambda point: point.effect):
        yield ""
        yield effect
        for _, group in groupby(of_effect, group_of):
            yield from _table(list(group), bench)
    if bench.claims:
        yield ""
        yield from bench.claims
    if bench.scaling:
        yield ""
        yield from map(_law, bench.scaling)
    if bench.ablations:
        yield ""
        yield from map(_ablation, bench.ablations)
    for left in bench.skipped:
        yield f"left out: {left['what']}. {left['why']}"
    found = bench.environment
    yield ""
    yield f"{found['cpu']}, {found['cpu_count']} cores; {found['gl_renderer']}; Mitsuba {found['variant']}"
    yield from (f"doubt: {doubt}" for doubt in found["doubts"])
    yield f"Page: {folder / 'index.html'}, numbers: {folder / FILE_NAME}"


def _table(points: Sequence[Point], bench: Bench) -> Iterator[str]:
    """The front and the defaults, from the quickest on, with the path tracer among them."""
    first = points[0]
    shown = [
        (point, is_best)
        for point, is_best in zip(points, on_front(points), strict=True)
        if is_best or point.swept in ("", SENSOR)
    ]
    rows = [
        (
            p.cost.seconds,
            p.error,
            "*" if best else " ",
            check_id(p.technique, dict(p.settings), p.is_fitted),
            _range_of(p.cost.frames),
        )
        for p, best in shown
    ]
    rows += [
        (
            t.seconds,
            t.error,
            " ",
            f"path tracer, {t.spp} spp" if t.spp else f"exact: {t.integrator}",
            _range_of(t.images),
        )
        for t in bench.traced
        if (t.scene, t.quantity, t.metric, t.width, t.height) == group_of(first)
    ]
    yield f"  {first.scene}, {first.quantity} at {first.width} x {first.height}: {first.metric}, time of a frame"
    width = max(len(row[3]) for row in rows)
    for seconds, error, mark, name, note in sorted(rows, key=lambda row: row[0].value):
        yield f"  {mark} {name:<{width}}  {_error(first.metric, error):<26}  {_seconds(seconds)}{note}"
    if hidden := len(points) - len(shown):
        yield f"    and {hidden} more, none of them on the front (*)"
    yield from (
        f"    path tracer: error falls as spp^{_number(s.exponent)}"
        for s in bench.slopes
        if (s.scene, s.quantity, s.metric, s.width, s.height) == group_of(first)
    )


def _range_of(count: int) -> str:
    """What stands beside times of too few frames for an interval."""
    return "" if count >= FEWEST_FOR_INTERVAL else f", the range of {_many(count, 'frame')}"


def _error(metric: str, error: Interval) -> str:
    return f"{format_metric(metric, error.value)} {format_interval(metric, error.low, error.high)}".rstrip()


def _seconds(seconds: Interval) -> str:
    low, high = (format_seconds(end) for end in (seconds.low, seconds.high))
    return f"{format_seconds(seconds.value)} [{low}, {high}]"


def _law(law: Scaling) -> str:
    return f"{law.scene}: {law.technique} takes time as {law.axis}^{_number(law.exponent)}"


def _number(found: Interval) -> str:
    return f"{format_number(found.value)} [{format_number(found.low)}, {format_number(found.high)}]"


def _ablation(one: Ablation) -> str:
    saved = one.seconds_with - one.seconds_without
    change = f"saves {format_seconds(saved)}" if saved >= 0 else f"costs {format_seconds(-saved)}"
    added = f"{format_metric(one.metric, one.added.value)} {format_interval(one.metric, one.added.low, one.added.high)}"
    return f"{one.scene}: {one.technique} without {one.part} ({one.how}): {one.metric} changes by {added}, {change}"
