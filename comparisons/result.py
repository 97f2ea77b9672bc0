"""The result of a check, as it stands in results.json."""

import math
import shlex
from dataclasses import asdict, dataclass, field
from typing import Any

from comparisons.budgets import budget_options
from comparisons.expression import quoted
from comparisons.gate import CriterionResult, Verdict
from realtime.own import file_of
from realtime.technique import Technique
from reference.quantities import effect_of
from reference.quantity import Quantity
from scenes.bibliography import BIBLIOGRAPHY
from scenes.checks import Check
from scenes.model import Scene
from scenes.paths import shown_path

SCHEMA = 1
MEASURED = ("value", "low", "high")


@dataclass(frozen=True)
class CheckResult:
    """One check, judged. Numbers that could not be had are None.

    truth_key : what the truth is kept under; with the number of a block and of its part it gives that one's seed
    worst : the judged pixel whose error stands out most from the noise of the truth: `x`, `y`, and one value a channel
        of `realtime`, `truth` and `sigma`, the standard error of the truth
    """

    scene: str
    scene_title: str
    quantity: str
    technique: str
    settings: dict[str, Any]
    fit_exposure: bool
    verdict: Verdict
    message: str
    criteria: tuple[CriterionResult, ...]
    unit: str
    display: str
    card: dict[str, str]
    rerun: str
    exposure: float = 1.0
    spp: int = 0
    spp_fixed: int = 0
    spp_shown: int = 0
    clamp: str = ""
    variants: tuple[dict[str, Any], ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    pass_seconds: dict[str, float] = field(default_factory=dict)
    baked_seconds: dict[str, float] = field(default_factory=dict)
    skipped: tuple[dict[str, str], ...] = ()
    integrator: dict[str, str] = field(default_factory=dict)
    truth_key: str = ""
    images: dict[str, str] = field(default_factory=dict)
    error_scale: float | None = None
    error_smoothing_px: float = 0.0
    exposure_display: float | None = None
    gl_renderer: str = ""
    exit_status: int = 0
    cached: bool = False
    significance: dict[str, Any] | None = None
    worst: dict[str, Any] | None = None
    accepted: dict[str, Any] | None = None
    slack: str = ""

    @property
    def id(self) -> str:
        return f"{self.scene}/{check_id(self.technique, self.settings, self.fit_exposure)}"

    @property
    def effect(self) -> str:
        return effect_of(self.quantity)

    def to_json(self) -> dict[str, Any]:
        """Whatever the result says, JSON-able; nested values are those of the result itself."""
        plain = vars(self) | {"id": self.id, "effect": self.effect, "verdict": str(self.verdict)}
        plain["criteria"] = [_criterion_json(c) for c in self.criteria]
        return plain

    @classmethod
    def from_json(cls, plain: dict[str, Any]) -> "CheckResult":
        known = {k: v for k, v in plain.items() if k not in ("id", "effect")}
        known["verdict"] = Verdict(known["verdict"])
        known["skipped"] = tuple(known["skipped"])
        known["variants"] = tuple(known.get("variants", ()))
        known["criteria"] = tuple(_criterion_from_json(c) for c in known["criteria"])
        return cls(**known)


def check_id(technique: str, settings: dict[str, Any], fit_exposure: bool) -> str:
    """A short name of a check within its scene, e.g. `indirect.talk[c_height=7.0,fitted]`."""
    details = [f"{k}={v}" for k, v in sorted(settings.items())] + (["fitted"] if fit_exposure else [])
    return f"{technique}[{','.join(details)}]" if details else technique


def rerun_command(scene_argument: str, check: str, *options: str) -> str:
    """What runs a check again, and no other but parity; `check` is its name within the scene."""
    return shlex.join(["lightgauge", "run", scene_argument, "-k", quoted(f"/{check}$"), *options])


def card_of(technique: Technique) -> dict[str, str]:
    """What a report says about a technique, its source spelt out."""
    card = {key: getattr(technique, key) for key in ("name", "summary", "limits")}
    return card | {"source": BIBLIOGRAPHY.get(technique.source, technique.source)}


def empty_result(
    scene: Scene, scene_argument: str, check: Check, technique: Technique, quantity: Quantity
) -> CheckResult:
    """What is known of a check before anything was rendered; its verdict is ERROR until something is."""
    name = check_id(check.technique, dict(check.settings), check.fit_exposure)
    return CheckResult(
        scene=scene.name,
        scene_title=scene.title,
        quantity=check.quantity,
        technique=check.technique,
        settings=dict(check.settings),
        fit_exposure=check.fit_exposure,
        verdict=Verdict.ERROR,
        message="",
        criteria=(),
        unit=quantity.unit_in(scene),
        display=quantity.display,
        card=card_of(technique),
        rerun=rerun_command(scene_argument, name, *_own_options(check)),
    )


def _own_options(check: Check) -> tuple[str, ...]:
    """The options that make a user's technique known, and its budgets; none for a shipped one."""
    path = file_of(check.technique)
    return ("--technique", shown_path(path), *budget_options(check.criteria)) if path else ()


def _criterion_json(result: CriterionResult) -> dict[str, Any]:
    """JSON has no NaN and no infinity: such a measurement is null."""
    bound = result.max if result.max is not None else result.min
    plain = asdict(result) | {"verdict": str(result.verdict), "bound": bound}
    return plain | {key: plain[key] if math.isfinite(plain[key]) else None for key in MEASURED}


def _criterion_from_json(plain: dict[str, Any]) -> CriterionResult:
    known = {k: v for k, v in plain.items() if k != "bound"}
    measured = {key: math.nan if known[key] is None else known[key] for key in MEASURED}
    return CriterionResult(**(known | measured | {"verdict": Verdict(known["verdict"])}))
