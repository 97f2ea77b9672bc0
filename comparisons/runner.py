"""The checks of one scene: draw, ask for as much truth as the verdict needs, judge, show."""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from comparisons.cache import CheckCache
from comparisons.judgement import judgement
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.places import places_of
from comparisons.report.pictures import write_flagged
from comparisons.request import Request
from comparisons.result import CheckResult, empty_result
from realtime.context import environment_choice
from realtime.render import Renderer, Rendering
from realtime.technique import Technique
from realtime.techniques import technique
from reference.estimator import Reference
from reference.quantities import quantity
from reference.store import Store
from scenes.checks import Check, SettingValue
from scenes.errors import FlaggedPixels, LightgaugeError, MachineError, NoCluster, NoCompiler, NoGraphics
from scenes.model import Scene

TOLD = ("scene", "scene_title", "unit", "display", "card", "rerun")
"""What a result says in words that nothing was measured by, and that may change without being measured anew."""


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
                now = self._empty(check)
                told = {name: getattr(now, name) for name in TOLD}
                return self._placed(check, replace(cached, cached=True, **told))
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
        folder = self.cache.folder(scene, check)
        found = judgement(check, rendering, self.reference, folder)
        return replace(self._empty(check), **found | {"images": self._kept(folder, found["images"])})


def fault_of(error: Exception) -> str:
    """An exception that nobody foresaw, and where it came from."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return (
        f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}. Either a setting of the check "
        "is out of range, or the code there is at fault."
    )
