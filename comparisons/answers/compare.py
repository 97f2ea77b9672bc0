"""An image of another engine against the truth of a scene: what is measured, what a budget says, and why."""

import json
import shlex
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from comparisons.budgets import parse_budgets
from comparisons.external import (
    Measurement,
    alignment,
    hints,
    measure,
    metrics_for,
    require_judgeable,
    require_size,
    shipped,
)
from comparisons.gate import Verdict
from comparisons.image_files import ColorSpace, ImageFile, read_image
from comparisons.judgement import advice, evidence
from comparisons.report.names import stem_of
from comparisons.report.numbers import format_bound, format_count, format_interval, format_metric, format_number
from comparisons.result import CheckResult
from comparisons.results import prepare_folder, results_json, write_run
from comparisons.sequential import Decision, decide, fixed_spp
from comparisons.suite import exit_status
from comparisons.summary import closing_lines
from reference.estimator import Reference, Truth
from reference.quantities import quantity
from reference.quantity import Quantity
from reference.store import Store, write_text
from reference.studio import Progress
from scenes.checks import Check, Criterion
from scenes.errors import InputError
from scenes.image import Image
from scenes.load import find_scene, load_scene
from scenes.model import Scene

RENDERER = "image file"
NOT_ALIGNED = (
    "parity was not checked: without --depth nobody knows whether the engine sees the same scene. An image that is "
    "turned, moved by a part of a pixel or of other geometry reads as an error of its shading"
)

Outcome = tuple[list[str], int]
"""Lines of text, and the exit status: 0 measured or within the budgets, 1 beyond, 2 undecided."""


@dataclass(frozen=True)
class Asked:
    """The arguments of `lightgauge compare`, as they were given."""

    image: Path
    scene: str
    quantity: str
    budgets: tuple[str, ...] = ()
    layer: str | None = None
    color_space: ColorSpace | None = None
    depth: Path | None = None
    depth_layer: str | None = None
    fit_exposure: bool = False
    folder: Path = Path("comparison")

    @property
    def command(self) -> str:
        """What asks the same again."""
        options = (
            ("--layer", self.layer),
            ("--color-space", self.color_space),
            ("--depth", self.depth),
            ("--depth-layer", self.depth_layer),
            *(("--budget", budget) for budget in self.budgets),
            ("-o", self.folder),
        )
        given = [(option, str(value)) for option, value in options if value is not None]
        words = ["lightgauge", "compare", str(self.image), "--scene", self.scene, "--quantity", self.quantity]
        fitted = ["--fit-exposure"] if self.fit_exposure else []
        return shlex.join([*words, *(word for pair in given for word in pair), *fitted])


@dataclass(frozen=True)
class Given:
    """What the arguments stand for, read and found to be judgeable."""

    asked: Asked
    scene: Scene
    quantity: Quantity
    file: ImageFile
    reference: Reference
    is_exact: bool


def compare(asked: Asked, store: Store, step: Progress) -> Outcome:
    """Hold an image against the truth: measure it, or if there are budgets, judge it.

    Raises
    ------
    InputError
        An argument names nothing, the image cannot be judged, or its depth shows another scene.
    """
    criteria = parse_budgets(asked.budgets)
    given = _given(asked, store, step)
    prepare_folder(asked.folder)
    summary = f"{asked.image}: {given.file.summary}; {given.file.pixels.shape[1]} x {given.file.pixels.shape[0]} pixels"
    lines = [summary, _parity(given, store)]
    more, status = _judged(given, criteria, store) if criteria else _measured(given)
    return [*lines, *more], status


def _given(asked: Asked, store: Store, step: Progress) -> Given:
    scene = load_scene(find_scene(asked.scene))
    found = quantity(asked.quantity)
    if asked.depth is None and asked.depth_layer is not None:
        raise InputError("--depth-layer names a layer of the depth's file. Name that file, too, with --depth.")
    if asked.fit_exposure and found.display != "radiance":
        raise InputError(f"{found.name} is no radiance, so that no exposure can be off. Leave out --fit-exposure.")
    file = read_image(
        asked.image,
        found.channels,
        store.root / "kernels",
        is_depth=found.name == "depth",
        layer=asked.layer,
        color_space=asked.color_space,
    )
    if found.channels != 3 and file.encoding == "srgb" and asked.color_space is None:
        raise InputError(
            f"{asked.image}: found a PNG, whose values are taken for sRGB colours; {found.name} is no colour. Say "
            "--color-space linear if its code values are the quantity from 0 to 1, or save it as EXR."
        )
    if found.display in ("normal", "depth") and file.most <= 1:
        raise InputError(
            f"{asked.image}: found integers, which are read as 0 to 1; {found.name} goes beyond. Save it as EXR."
        )
    require_size(file, scene.sensor)
    reference = Reference(scene, store, step)
    reference.require_defined(found.name)
    is_exact = found.integrator(reference.features).exact is not None
    require_judgeable(file, scene, reference.truth(found.name, 1).mask)
    return Given(asked, scene, found, file, reference, is_exact)


def _parity(given: Given, store: Store) -> str:
    asked = given.asked
    if asked.depth is None:
        return NOT_ALIGNED
    depth = read_image(asked.depth, 1, store.root / "kernels", is_depth=True, layer=asked.depth_layer)
    return f"parity of the subject holds: {alignment(depth, given.reference)}"


def _measured(given: Given) -> Outcome:
    names = metrics_for(given.quantity, is_exact=given.is_exact)
    truth_at, limit = partial(given.reference.truth, given.quantity.name), given.scene.truth.max_spp
    found = measure(given.file.pixels, names, truth_at, limit, fitted=given.asked.fit_exposure)
    decision, unit = found.decision, given.quantity.unit_in(given.scene)
    shown = _evidence(given, decision)
    write_text(given.asked.folder / "measured.json", json.dumps(_measured_json(given, found, shown), indent=1))
    spent = "an exact truth" if decision.truth.is_exact else f"{format_count(decision.truth.spp)} samples a pixel"
    return [
        *_exposure(given, decision),
        *(
            f"{name} {format_metric(name, e.value, unit)} {format_interval(name, e.low, e.high)}"
            + (f"; {e.note}" if e.note else "")
            for name, e in found.estimates.items()
        ),
        *_beside(given, decision, names),
        f"Measured against {spent}. No budget was given, so nothing is passed or failed. Pictures: "
        f"{given.asked.folder / 'images'}",
    ], 0


def _judged(given: Given, criteria: tuple[Criterion, ...], store: Store) -> Outcome:
    started, clock = datetime.now(UTC).isoformat(timespec="seconds"), time.perf_counter()
    asked, scene, name = given.asked, given.scene, given.quantity.name
    check = Check(quantity=name, technique=f"image:{asked.image}", criteria=criteria, fit_exposure=asked.fit_exposure)
    limit = scene.truth.max_spp
    decision = decide(check, given.file.pixels, partial(given.reference.truth, name), limit, RENDERER)
    result = _result(given, check, decision)
    clocked = time.perf_counter() - clock
    page = write_run(asked.folder, results_json([result], started, clocked, store.notes))
    return [
        *_exposure(given, decision),
        *_criteria_lines(result),
        *_beside(given, decision, [c.metric for c in criteria]),
        *closing_lines([result], store.notes, page, clocked),
    ], exit_status([result])


def _criteria_lines(result: CheckResult) -> Iterator[str]:
    """The criteria that hold; the others come with the closing lines."""
    for c in (c for c in result.criteria if c.verdict is Verdict.PASS):
        value = f"{format_metric(c.metric, c.value, result.unit)} {format_interval(c.metric, c.low, c.high)}"
        yield f"{c.verdict:12} {c.metric} {value}, budget {format_bound(c.metric, c.min, c.max, result.unit)}"


def _exposure(given: Given, decision: Decision) -> list[str]:
    return [f"times {format_number(decision.exposure)}, which suits it best"] if given.asked.fit_exposure else []


def _beside(given: Given, decision: Decision, metrics: Sequence[str]) -> Iterator[str]:
    """Hints, and what the shipped techniques reach."""
    truth = given.reference.at_hand(given.quantity.name, decision.truth.spp)
    for hint in hints(given.file, decision.image, truth, given.quantity):
        yield f"hint: {hint}"
    reached = list(shipped(given.scene, given.quantity.name, metrics))
    if reached:
        yield "the shipped techniques on this scene, as last accepted:"
        yield from (f"  {line}" for line in reached)


def _evidence(given: Given, decision: Decision) -> dict[str, Any]:
    provenance = {
        "scene": given.scene.name,
        "technique": f"image:{given.asked.image}",
        "settings": {},
        "renderer": RENDERER,
        "sha256": given.file.digest,
    }
    stem = stem_of(f"{given.scene.name}/image:{given.asked.image}")
    drawn = Image(given.file.pixels, provenance)
    return evidence(given.reference, given.quantity.name, decision, drawn, given.asked.folder, stem)


def _measured_json(given: Given, found: Measurement, shown: dict[str, Any]) -> dict[str, Any]:
    """What measured.json holds: every number that is printed, and the pictures."""
    return {
        "image": str(given.asked.image),
        "sha256": given.file.digest,
        "scene": given.scene.name,
        "quantity": given.quantity.name,
        "unit": given.quantity.unit_in(given.scene),
        "exposure": found.decision.exposure,
        "spp": found.decision.truth.spp,
        "metrics": {
            name: {"value": e.value, "low": e.low, "high": e.high, "valid": e.valid, "note": e.note}
            for name, e in found.estimates.items()
        },
        "worst": shown["worst"],
        "images": shown["images"],
    }


def _result(given: Given, check: Check, decision: Decision) -> CheckResult:
    truth: Truth = decision.truth
    scene, file = given.scene, given.file
    card = {
        "name": check.technique,
        "summary": f"an image that another program made: {file.summary}",
        "limits": "what it renders, and how, is not known here",
        "source": f"SHA-256 {file.digest}",
    }
    return CheckResult(
        scene=scene.name,
        scene_title=scene.title,
        quantity=check.quantity,
        technique=check.technique,
        settings={},
        fit_exposure=check.fit_exposure,
        verdict=decision.verdict,
        message=advice(decision, scene.truth.max_spp),
        criteria=decision.criteria,
        unit=given.quantity.unit_in(scene),
        display=given.quantity.display,
        card=card,
        rerun=given.asked.command,
        exposure=decision.exposure,
        spp=truth.spp,
        spp_fixed=fixed_spp(decision.criteria, truth.spp, scene.truth.max_spp),
        seconds={"reference": truth.seconds},
        integrator={"name": truth.integrator.name, "why": truth.integrator.why},
        truth_key=truth.key,
        gl_renderer=RENDERER,
        **_evidence(given, decision),
    )
