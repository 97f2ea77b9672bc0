"""A against B: two techniques, two settings of one, or what two runs drew; which is better, and what it costs."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from comparisons.difference import Candidate, Comparison, Preference, compare, error_named
from comparisons.linear import read_linear
from comparisons.metrics import Estimate
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.report.numbers import format_count, format_interval, format_metric, format_number, format_seconds
from comparisons.result import check_id
from comparisons.results import read_run
from comparisons.suite import require_parity
from realtime.render import Renderer
from realtime.technique import Technique
from realtime.techniques import technique
from reference.estimator import Reference
from reference.store import Store
from reference.studio import Progress
from scenes.checks import SettingValue
from scenes.errors import ImageError, InputError, SceneError
from scenes.load import find_scene, load_scene
from scenes.model import Scene

FITTED = "fitted"
VARIANT = re.compile(r"([^\[\]]+)(?:\[([^\[\]]+)\])?")
LABELS = {
    Preference.A: "A better",
    Preference.B: "B better",
    Preference.NEITHER: "same",
    Preference.UNDECIDED: "undecided",
}
NOT_COMPARED = "not compared"
DECIDED, OPEN = 0, 2

Outcome = tuple[list[str], int]
"""Lines of text, and the exit status: 0 decided, 2 undecided."""

Row = tuple[str, ...]


@dataclass(frozen=True)
class Variant:
    """A technique with the settings that differ from its defaults."""

    technique: Technique
    settings: dict[str, SettingValue]
    fit_exposure: bool

    @property
    def id(self) -> str:
        return check_id(self.technique.name, self.settings, self.fit_exposure)


@dataclass(frozen=True)
class Drawn:
    """What is compared: its name, an image, and the seconds that a frame of it takes."""

    name: str
    candidate: Candidate
    seconds: float | None


@dataclass(frozen=True)
class Run:
    """A finished run: its folder, the commit it was made with, and its radiance checks by their id."""

    folder: Path
    commit: str
    checks: dict[str, dict[str, Any]]


def diff_lines(a: str, b: str, scene: str | None, metric: str, store: Store, progress: Progress) -> Outcome:
    """Compare A with B, both named as on the command line.

    Parameters
    ----------
    a, b : techniques with settings, as in the ids of checks, or folders of finished runs.
    scene : a name or a path. Techniques need one; of runs, all scenes are compared without it.
    metric : a name in `comparisons.difference.ERRORS`.
    store : where truth is kept.
    progress : called with what is being done and the fraction of it that is done.

    Raises
    ------
    InputError
        One of the arguments names nothing, or A and B cannot be compared.
    """
    error_named(metric)
    if is_run(a) != is_run(b):
        run, other = (a, b) if is_run(a) else (b, a)
        if any(mark in other for mark in "/\\") or other.endswith(".json"):
            read_run(Path(other))  # says what is wrong with it
        raise InputError(
            f"'{run}' is a finished run and '{other}' is not. Compare two runs, each named by its folder, or two "
            "techniques with their settings."
        )
    if is_run(a):
        return _diff_runs(read_checks(Path(a)), read_checks(Path(b)), scene, metric, store, progress)
    first, second = parse_variant(a), parse_variant(b)
    if first.technique.approximates != second.technique.approximates:
        raise InputError(
            f"'{first.technique.name}' approximates {first.technique.approximates}, '{second.technique.name}' "
            f"approximates {second.technique.approximates}: nothing can be said about which is closer to the truth. "
            "Choose two techniques for the same quantity; `lightgauge list` names them."
        )
    if scene is None:
        raise InputError("Two techniques are compared on a scene. Name one with --scene; `lightgauge list` has them.")
    return _diff_variants(first, second, load_scene(find_scene(scene)), metric, store, progress)


def is_run(text: str) -> bool:
    """Whether an argument is the folder of a finished run, or its results.json."""
    path = Path(text)
    return path.is_file() if path.suffix == ".json" else (path / "results.json").is_file()


def parse_variant(text: str) -> Variant:
    """A technique with settings, written as in the ids of checks: `indirect.talk[c_height=7.0,fitted]`.

    Raises
    ------
    InputError
        It is written otherwise, or there is no such technique, setting or value.
    """
    found = VARIANT.fullmatch(text.strip())
    if found is None:
        raise InputError(
            f"'{text}' is neither the folder of a finished run nor a technique with settings. Write the latter as "
            "NAME or NAME[SETTING=VALUE,...], with `fitted` in the brackets to fit the exposure, as in "
            "'indirect.talk[c_height=7.0,fitted]'."
        )
    named = technique(found[1])
    details = [detail.strip() for detail in found[2].split(",")] if found[2] else []
    pairs = [detail.partition("=") for detail in details if detail != FITTED]
    settings = {name.strip(): _value(value.strip()) for name, _, value in pairs}
    if not all(equals for _, equals, _ in pairs) or len(settings) < len(pairs) or details.count(FITTED) > 1:
        raise InputError(
            f"The settings in '{text}' are not clear. Allowed are SETTING=VALUE and `{FITTED}`, separated by commas, "
            "each at most once."
        )
    named.settings(settings)
    return Variant(named, settings, FITTED in details)


def _value(text: str) -> SettingValue:
    """A truth value, a whole number, a number or a word; what is not finite stays a word, which no setting allows."""
    if text in ("True", "False"):
        return text == "True"
    for kind in (int, float):
        try:
            number = kind(text)
        except ValueError:
            continue
        if math.isfinite(number):
            return number
    return text


def _diff_variants(a: Variant, b: Variant, scene: Scene, metric: str, store: Store, progress: Progress) -> Outcome:
    require_parity(scene, scene.name, store, progress)
    renderer = Renderer(scene)

    def drawn(variant: Variant) -> Drawn:
        progress(f"{scene.name}: {variant.id}", 0.0)
        rendering = renderer.render(variant.technique, variant.settings)
        return Drawn(variant.id, Candidate(rendering.image.pixels, variant.fit_exposure), rendering.seconds)

    sides = drawn(a), drawn(b)
    quantity = a.technique.approximates
    truth_at = partial(Reference(scene, store, progress).truth, quantity)
    found = compare(metric, sides[0].candidate, sides[1].candidate, truth_at, scene.truth.max_spp)
    is_open = found.difference.preference is Preference.UNDECIDED
    lines = comparison_lines(f"{scene.name}, {quantity}", sides, metric, found, scene)
    return list(lines), OPEN if is_open else DECIDED


def comparison_lines(
    title: str, sides: tuple[Drawn, Drawn], metric: str, found: Comparison, scene: Scene
) -> Iterator[str]:
    """Two images side by side, which is better, and how sure that is."""
    difference, error = found.difference, _error_name(metric)
    yield f"{title}, {_spent(found)}"
    rows = [
        (f"  {label}", side.name, metric, *_value_and_interval(metric, estimate), format_seconds(side.seconds))
        for label, side, estimate in zip("AB", sides, (difference.a, difference.b), strict=True)
    ]
    yield from aligned(rows)
    yield f"{_verdict(error, found, scene)} {_cost(*sides)}".rstrip()
    low, high = format_number(difference.low), format_number(difference.high)
    saved = difference.variance_reduction
    alone = f" Independent truths would have left {format_number(saved)} times the variance."
    yield (
        f"A's {error} minus B's: {format_number(difference.value)} [{low}, {high}]; up to "
        f"{format_number(difference.margin)} does not matter.{alone if math.isfinite(saved) else ''}"
    )


def _verdict(error: str, found: Comparison, scene: Scene) -> str:
    difference = found.difference
    preference = difference.preference
    if preference is Preference.UNDECIDED:
        return _advice(found, scene)
    if preference is Preference.NEITHER:
        return f"{preference.capitalize()}."
    other = "B" if preference is Preference.A else "A"
    if difference.saving is None:
        return f"{preference}: its {error} is below {other}'s."
    return f"{preference}: its {error} is {_percent(difference.saving)} below {other}'s."


def _advice(found: Comparison, scene: Scene) -> str:
    """What an undecided comparison needs."""
    spp, limit = found.truth.spp, scene.truth.max_spp
    after = f"Undecided after {spp} spp (the scene allows {limit})"
    if found.difference.note:
        return f"{after}: {found.difference.note}."
    needed = found.difference.spp_needed(spp)
    if needed is None:
        return f"{after}: the difference is too small for any affordable number of them."
    enough = 1 << (needed - 1).bit_length()
    return f"{after}: about {needed} spp would decide it. Set max_spp = {enough} or more under [truth] in the scene."


def _cost(a: Drawn, b: Drawn) -> str:
    """How the times of the two compare."""
    if not a.seconds or not b.seconds:
        return ""
    slower, faster = ("B", "A") if b.seconds > a.seconds else ("A", "B")
    ratio = max(a.seconds, b.seconds) / min(a.seconds, b.seconds)
    return f"{slower} took {format_number(ratio)} times as long as {faster}."


def read_checks(path: Path) -> Run:
    """The radiance checks of a finished run; those of parity draw what both sides know exactly.

    Raises
    ------
    InputError
        They cannot be read.
    """
    folder, results = read_run(path)
    checks = {
        f"{check['id']}": check
        for check in results["checks"]
        if {"id", "scene", "quantity"} <= set(check) and check["quantity"] not in PARITY_QUANTITIES
    }
    commit = (results.get("environment") or {}).get("commit") or "no commit"
    return Run(folder, commit, checks)


def _diff_runs(a: Run, b: Run, scene: str | None, metric: str, store: Store, progress: Progress) -> Outcome:
    given = None if scene is None else load_scene(find_scene(scene))
    ids_a, ids_b = (
        [name for name, check in run.checks.items() if given is None or check["scene"] == given.name] for run in (a, b)
    )
    common = [name for name in ids_a if name in ids_b]
    if not common:
        where = f" of scene '{given.name}'" if given else ""
        raise InputError(f"'{a.folder}' and '{b.folder}' have no radiance check{where} in common. Run the same checks.")
    scene_names = {a.checks[name]["scene"] for name in common}
    references = {name: Reference(given or _scene_of_run(name), store, progress) for name in scene_names}
    rows, reasons = [], []
    for done, name in enumerate(common):
        progress(name, done / len(common))
        row, reason = _diff_check(name, a, b, references[a.checks[name]["scene"]], metric)
        rows.append(row)
        reasons += [f"{name}: {reason}"] if reason else []
    alone = (("A", ids_a), ("B", ids_b))
    only = [f"only in {label}: {name}" for label, ids in alone for name in ids if name not in common]
    heading = [f"A: {a.folder} ({a.commit})", f"B: {b.folder} ({b.commit})"]
    labels = [row[0] for row in rows]
    counts = ", ".join(f"{labels.count(label)} {label}" for label in dict.fromkeys(sorted(labels)))
    return [
        *heading,
        *aligned(rows),
        *reasons,
        *only,
        f"{len(common)} in common: {counts}",
    ], OPEN if reasons else DECIDED


def _diff_check(name: str, a: Run, b: Run, reference: Reference, metric: str) -> tuple[Row, str]:
    """A row about a check, and why nothing was decided on it, if so."""
    scene = reference.scene
    try:
        sides = _drawn_in(a, name, scene), _drawn_in(b, name, scene)
        truth_at = partial(reference.truth, a.checks[name]["quantity"])
        found = compare(metric, sides[0].candidate, sides[1].candidate, truth_at, scene.truth.max_spp)
    except ImageError as error:
        return (NOT_COMPARED, name, "", "", "", ""), str(error)
    is_open = found.difference.preference is Preference.UNDECIDED
    return _row(name, sides, metric, found), _advice(found, scene) if is_open else ""


def _scene_of_run(name: str) -> Scene:
    try:
        return load_scene(find_scene(name))
    except SceneError as error:
        raise InputError(
            f"The runs have checks of the scene '{name}', which is not in the library. Name its file with --scene."
        ) from error


def _drawn_in(run: Run, name: str, scene: Scene) -> Drawn:
    """What a run drew for a check.

    Raises
    ------
    ImageError
        It kept no linear image, or one of another scene.
    """
    check = run.checks[name]
    kept = (check.get("images") or {}).get("linear")
    if kept is None:
        raise ImageError(f"the run in '{run.folder}' kept no linear image of it. Run it again.")
    seconds = (check.get("seconds") or {}).get("realtime")
    return Drawn(name, Candidate(read_linear(run.folder / kept, scene), bool(check.get("fit_exposure"))), seconds)


def _row(name: str, sides: tuple[Drawn, Drawn], metric: str, found: Comparison) -> Row:
    difference = found.difference
    errors = " -> ".join(format_metric(metric, estimate.value) for estimate in (difference.a, difference.b))
    is_clear = difference.preference in (Preference.A, Preference.B)
    saving = f"{_error_name(metric)} {_percent(difference.saving)} lower" if is_clear and difference.saving else ""
    times = " -> ".join(format_seconds(side.seconds) for side in sides)
    return LABELS[difference.preference], name, f"{metric} {errors}", saving, times, _spent(found)


def _spent(found: Comparison) -> str:
    return "exact" if found.truth.is_exact else f"{format_count(found.truth.spp)} spp"


def _value_and_interval(metric: str, estimate: Estimate) -> tuple[str, str]:
    return format_metric(metric, estimate.value), format_interval(metric, estimate.low, estimate.high)


def _percent(share: Estimate) -> str:
    return f"{format_metric('nrmse', share.value)} {format_interval('nrmse', share.low, share.high)}"


def _error_name(metric: str) -> str:
    """What E is called: verdicts are about squares, of which nrmse is the root."""
    return "squared nrmse" if metric == "nrmse" else metric


def aligned(rows: Sequence[Row]) -> Iterator[str]:
    """Columns as wide as their widest entry."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  ".join(f"{entry:{width}}" for entry, width in zip(row, widths, strict=True)).rstrip()
