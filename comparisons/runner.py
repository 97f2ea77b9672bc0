"""The checks of one scene: draw, ask for as much truth as the verdict needs, judge, show."""

import traceback
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from comparisons.cache import CheckCache
from comparisons.clamping import clamp_note
from comparisons.difference import write_linear
from comparisons.gate import CriterionResult, Verdict, spp_needed
from comparisons.metrics import Samples
from comparisons.metrics.flip import flip_image
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.places import places_of
from comparisons.report.pictures import write_flagged, write_pictures
from comparisons.report.pixels import write_pixels
from comparisons.request import Request
from comparisons.result import CheckResult, empty_result
from comparisons.sequential import Decision, decide, fixed_spp
from comparisons.significance import LEAST_SPP, significance
from comparisons.tonemap import exposure_for
from comparisons.variants import costs_of_variants
from comparisons.worst_pixel import worst_pixel
from realtime.context import environment_choice
from realtime.render import Renderer, Rendering
from realtime.technique import Technique
from realtime.techniques import technique
from reference.estimator import Reference
from reference.quantities import quantity
from reference.store import Store
from scenes.checks import Check, SettingValue
from scenes.errors import FlaggedPixels, LightgaugeError, MachineError, NoCluster, NoCompiler, NoGraphics
from scenes.image import Image
from scenes.model import Scene

SMOOTHING_PX = 1.5
"""Error pictures of a sampled truth are averaged that far: it cuts the noise of a single pixel to a fifth."""

ERROR_RANGE = 2.0
"""Error pictures reach this many times the budget: what has the outermost colour is clearly beyond it."""


class Draws(Protocol):
    """What gives the image of a technique; `realtime.render.Renderer` draws it."""

    def render(self, technique: Technique, given: dict[str, SettingValue], timed: bool = True) -> Rendering: ...


Step = Callable[[str, float], None]
"""Called with what is being done and the fraction of it that is done."""


def _draws_here(scene: Scene, step: Step) -> Draws:
    return Renderer(scene)


@dataclass(frozen=True)
class Sides:
    """Where the two sides of a comparison come from: what draws a scene, and what renders its truth.

    What chooses the OpenGL driver is `graphics`: finished checks are found again only where it is the same.
    """

    renderer: Callable[[Scene, Step], Draws] = _draws_here
    reference: Callable[[Scene, Store, Step], Reference] = Reference
    graphics: Callable[[], dict[str, str]] = environment_choice


class Runner:
    """The checks of one scene, sharing what they render."""

    def __init__(self, request: Request, store: Store, step: Step, sides: Sides) -> None:
        self.request = request
        self.store = store
        self.step = step
        self.reference = sides.reference(request.scene, store, step)
        self.renderer = sides.renderer(request.scene, step)
        self.cache = CheckCache(store, sides.graphics)

    def refused(self, check: Check, why: str) -> CheckResult:
        return replace(self._empty(check), message=why)

    def result(self, check: Check) -> CheckResult:
        """The check's result, from the cache when nothing that it depends on has changed."""
        scene = self.request.scene
        self.store.touched.clear()
        try:
            cached = self.cache.read(scene, check)
            if cached is not None:
                named = replace(cached, scene=scene.name, scene_title=scene.title, cached=True)
                return self._placed(check, replace(named, rerun=self._empty(check).rerun))
            result = self._judged(check)
            self.reference.require_unchanged()
        except (NoGraphics, NoCompiler, NoCluster):
            raise
        except LightgaugeError as error:
            images = self._flagged(check, error) if isinstance(error, FlaggedPixels) else {}
            return replace(self._empty(check), message=str(error), exit_status=error.exit_status, images=images)
        except Exception as error:  # noqa: BLE001  # techniques and drivers may raise anything; the other checks go on
            return replace(self._empty(check), message=fault_of(error), exit_status=MachineError.exit_status)
        self.cache.write(scene, check, result)
        return self._placed(check, result)

    def _placed(self, check: Check, result: CheckResult) -> CheckResult:
        """The result with the place of each budget, which may move without any change to the check."""
        pairs = zip(result.criteria, places_of(self.request.scene, check), strict=True)
        return replace(result, criteria=tuple(replace(criterion, place=place) for criterion, place in pairs))

    def _flagged(self, check: Check, error: FlaggedPixels) -> dict[str, str]:
        folder = self.cache.folder(self.request.scene, check)
        return self._kept(folder, write_flagged(folder, "picture", error.flagged))

    def _kept(self, folder: Path, pictures: dict[str, str]) -> dict[str, str]:
        """Paths of pictures within the store, from those within a folder of it."""
        return {name: str((folder / path).relative_to(self.store.root)) for name, path in pictures.items()}

    def _empty(self, check: Check) -> CheckResult:
        return empty_result(
            self.request.scene, self.request.argument, check, technique(check.technique), quantity(check.quantity)
        )

    def _judged(self, check: Check) -> CheckResult:
        scene = self.request.scene
        self.reference.require_defined(check.quantity)
        self.step(f"{scene.name}: {check.technique}", 0.0)
        rendering = self.renderer.render(
            technique(check.technique), dict(check.settings), timed=check.quantity not in PARITY_QUANTITIES
        )
        _ = self.reference.subject_mask  # raises if the camera does not see the subject
        gl_renderer = rendering.image.provenance["renderer"]
        truth_at = partial(self.reference.truth, check.quantity)
        decision = decide(check, rendering.image.pixels, truth_at, scene.truth.max_spp, gl_renderer)
        truth = decision.truth
        return replace(
            self._empty(check),
            **self._shown(check, decision, rendering.image),
            verdict=decision.verdict,
            message=advice(decision, scene.truth.max_spp),
            criteria=decision.criteria,
            exposure=decision.exposure,
            spp=truth.spp,
            spp_fixed=fixed_spp(decision.criteria, truth.spp, scene.truth.max_spp),
            seconds={"realtime": rendering.seconds, "reference": truth.seconds},
            pass_seconds=rendering.pass_seconds,
            skipped=tuple(asdict(s) for s in rendering.skipped),
            integrator={"name": truth.integrator.name, "why": truth.integrator.why},
            truth_key=truth.key,
            clamp=clamp_note(truth, scene.truth.clamp),
            variants=costs_of_variants(truth, self.reference.truth),
            gl_renderer=gl_renderer,
        )

    def _shown(self, check: Check, decision: Decision, drawn: Image) -> dict[str, Any]:
        folder = self.cache.folder(self.request.scene, check)
        found = evidence(self.reference, check.quantity, decision, drawn, folder, "picture")
        return found | {"images": self._kept(folder, found["images"])}


def evidence(
    reference: Reference, name: str, decision: Decision, drawn: Image, folder: Path, stem: str
) -> dict[str, Any]:
    """What shows a verdict on a quantity, made from all samples at hand: it is often clear long before an image is.

    Writes the pictures `images/STEM-...` and their values `pixels/STEM.js` under `folder`; `images` has their paths
    within it. The other keys are those of a `CheckResult`.
    """
    truth = reference.at_hand(name, decision.truth.spp)
    samples = Samples(truth.accumulators, truth.mask)
    display = quantity(name).display
    tested = significance(decision.image, samples) if truth.spp >= LEAST_SPP else None
    scale = error_scale(decision.criteria, samples)
    exposure = exposure_for(samples.mean, truth.mask) if display in ("radiance", "depth") else 1.0
    smoothing = 0.0 if truth.is_exact else SMOOTHING_PX
    flip = flip_image(decision.image, samples) if display == "radiance" else None
    worst = worst_pixel(decision.image, samples)
    mean = samples.mean.astype(np.float32)
    pictures = write_pictures(
        folder, stem, decision.image, mean, truth.mask, exposure, scale, display, smoothing, tested, flip
    )
    pictures["pixels"] = write_pixels(
        folder,
        stem,
        decision.image,
        samples,
        quantity=name,
        unit=quantity(name).unit_in(reference.scene),
        display=display,
        exposure=exposure,
        error_scale=scale,
        smoothing=smoothing,
        significance=tested,
        flip=flip,
        worst=(worst["x"], worst["y"]),
    )
    if not truth.is_exact:
        pictures["linear"] = write_linear(folder, stem, drawn, reference.scene)
    return {
        "significance": tested.summary if tested is not None else None,
        "worst": worst,
        "images": pictures,
        "spp_shown": truth.spp,
        "error_scale": scale,
        "error_smoothing_px": smoothing,
        "exposure_display": exposure,
    }


def fault_of(error: Exception) -> str:
    """An exception that nobody foresaw, and where it came from."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return (
        f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}. Either a setting of the check "
        "is out of range, or the code there is at fault."
    )


def advice(decision: Decision, limit: int) -> str:
    """What an INCONCLUSIVE check needs."""
    if decision.verdict is not Verdict.INCONCLUSIVE:
        return ""
    spp = decision.truth.spp
    after = f"Undecided after {spp} spp (the scene allows {limit})"
    undecided = [c for c in decision.criteria if c.verdict is Verdict.INCONCLUSIVE]
    if not all(c.valid for c in undecided):
        return f"{after}: the truth is too noisy to know how noisy it is."
    needed = [spp_needed(c, spp) for c in undecided]
    known = [n for n in needed if n is not None]
    if len(known) < len(needed):
        return f"{after}: a value is too close to its bound for any affordable number of them."
    enough = 1 << (max(known) - 1).bit_length()
    return (
        f"{after}: about {max(known)} spp would decide it. Set max_spp = {enough} or more under [truth] in the scene."
    )


def error_scale(criteria: Iterable[CriterionResult], samples: Samples) -> float:
    """The error that gets the outermost colour.

    ERROR_RANGE times the budget of the first criterion that has one in the quantity's unit or relative to the truth,
    else a tenth of the truth's root mean square.
    """
    mean = float(np.mean(np.abs(samples.masked)))
    rms = float(np.sqrt(np.mean(samples.masked.mean(axis=0) ** 2)))
    absolute = dict.fromkeys(("rms", "rmse", "penumbra_rmse", "max_abs", "p99_abs"), 1.0)
    unit = {"nrmse": mean, "rel_rms": rms, **absolute}
    for criterion in criteria:
        if criterion.metric in unit and criterion.max:
            return ERROR_RANGE * criterion.max * unit[criterion.metric]
    return 0.1 * rms if rms > 0 else 1.0
