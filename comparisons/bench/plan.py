"""What a benchmark has to do, part by part; each part stands on its own, and can be kept once it is done."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from comparisons.bench.machine import cpu_model
from comparisons.bench.measure import Measured, Pace, measured
from comparisons.bench.result import Ablation, Scaling
from comparisons.bench.sizes import AXES
from comparisons.bench.sweep import Batch, error_metric
from comparisons.code import judging_code, library_versions
from comparisons.suite import require_parity
from realtime.code import drawing_code
from realtime.context import environment_choice
from realtime.own import source_digest
from realtime.techniques import technique
from reference.estimator import truth_parts
from reference.store import Store
from scenes.checks import Check
from scenes.digest import code_digest, digest_of
from scenes.model import Scene

Step = Callable[[str, float], None]


@dataclass
class Scaled:
    """The power laws of one technique, and what was left out."""

    laws: list[Scaling] = field(default_factory=list)
    skipped: list[dict[str, str]] = field(default_factory=list)


@dataclass
class Ablated:
    """What the parts of one technique are worth, and what was left out."""

    ablations: list[Ablation] = field(default_factory=list)
    skipped: list[dict[str, str]] = field(default_factory=list)


Result = Measured | Scaled | Ablated


@dataclass(frozen=True)
class Part:
    """`key` stands for everything that the result depends on; `kind` is the type of what `run` returns."""

    name: str
    key: str
    kind: type[Result]
    run: Callable[[Store, Step], Result]


def points_part(batch: Batch, argument: str, pace: Pace) -> Part:
    """Errors and times of a batch; `argument` names the scene on a command line.

    Parity comes before what is measured beside the path tracer. It holds for other resolutions too: nothing but the
    sensor's pixels differs.
    """

    def run(store: Store, step: Step) -> Measured:
        if batch.is_traced:
            require_parity(batch.scene, argument, store, step)
        return measured(batch, store, pace, step)

    used = sorted({variant.technique for variant in batch.variants})
    return Part(batch.name, _key(batch.scene, batch.quantity, used, [batch.metric], batch, pace), Measured, run)


def scaling_part(scene: Scene, name: str) -> Part:
    """How the time of a technique, at its defaults, grows with pixels, triangles and lights."""

    def run(store: Store, step: Step) -> Scaled:
        from comparisons.bench.scaling import scalings

        found = Scaled()
        left_out = partial(_left_out, found.skipped, "scaling of")
        found.laws = scalings(
            scene, technique(name), {}, tuple(AXES), lambda what: step(f"scaling: {what}", 0.0), left_out
        )
        return found

    key = _key(scene, technique(name).approximates, [name], [], "scaling")
    return Part(f"{scene.name}, {name}: scaling", key, Scaled, run)


def ablation_part(scene: Scene, check: Check) -> Part:
    """What each part of a technique is worth, with the settings of a check."""

    def run(store: Store, step: Step) -> Ablated:
        from comparisons.bench.ablation import ablations

        found = Ablated()
        found.ablations = list(ablations(scene, check, store, step, partial(_left_out, found.skipped, "ablation of")))
        return found

    key = _key(scene, check.quantity, [check.technique], [error_metric([check])], "ablation", check)
    return Part(f"{scene.name}, {check.technique}: ablation", key, Ablated, run)


def _left_out(skipped: list[dict[str, str]], of: str, what: str, why: str) -> None:
    skipped.append({"what": f"{of} {what}", "why": why})


def _key(scene: Scene, quantity: str, used: list[str], metrics: list[str], *about: Any) -> str:
    """What a result depends on: scene and truth, all code that draws and judges, the machine, and what is asked."""
    here = Path(__file__).parent
    code = [code_digest(*sorted(here.glob("*.py"))), judging_code(tuple(metrics)), library_versions()]
    drawn = [(name, drawing_code(name), source_digest(name)) for name in used]
    place = [environment_choice(), cpu_model()]
    asked = [scene.name, *(repr(one) for one in about)]
    return digest_of(truth_parts(scene, quantity), scene.truth.max_spp, code, drawn, place, asked)
