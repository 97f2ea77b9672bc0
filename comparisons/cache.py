"""Finished checks, kept beside the truth: found again as long as nothing that they depend on has changed."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import realtime
import scenes
from comparisons.result import CheckResult
from realtime.context import environment_choice
from realtime.own import source_digest
from realtime.techniques import source_files
from reference.estimator import truth_parts
from reference.store import Shelf, Store, write_text
from scenes.checks import Check
from scenes.digest import digest_of, file_digest
from scenes.model import Scene


@cache
def judging_code() -> str:
    """Digest of everything that draws and judges: scenes, the real-time side, the statistics, the pictures."""
    here = Path(__file__).parent
    showing = [here / "report" / f"{name}.py" for name in ("pictures", "pixels")]
    judging = [*here.glob("*.py"), *here.glob("metrics/*.py"), *showing]
    drawing = [*source_files(Path(realtime.__file__).parent), *Path(scenes.__file__).parent.glob("*.py")]
    return digest_of([file_digest(path) for path in sorted([*judging, *drawing])])


class CheckCache:
    """A finished check is found again only if every file of truth that it was judged against is unchanged.

    graphics : tells what chooses the OpenGL driver
    """

    def __init__(self, store: Store, graphics: Callable[[], dict[str, str]] = environment_choice) -> None:
        self.store = store
        self.graphics = graphics

    def read(self, scene: Scene, check: Check) -> CheckResult | None:
        shelf = self._shelf(scene, check)
        try:
            record = json.loads((shelf.folder / "check.json").read_text(encoding="utf-8"))
            inputs: dict[str, str] = record["inputs"]
            if any(_digest(self.store.root / path) != digest for path, digest in inputs.items()):
                return None
            result = CheckResult.from_json(record["result"])
            if not all((self.store.root / path).exists() for path in result.images.values()):
                return None
            return result
        except (FileNotFoundError, ValueError, KeyError, TypeError, AttributeError):
            return None

    def write(self, scene: Scene, check: Check, result: CheckResult) -> None:
        inputs = {str(path.relative_to(self.store.root)): _digest(path) for path in sorted(self.store.touched)}
        record = json.dumps({"inputs": inputs, "result": result.to_json()}, indent=1)
        write_text(self._shelf(scene, check).folder / "check.json", record)

    def folder(self, scene: Scene, check: Check) -> Path:
        """Where everything about a check is kept."""
        return self._shelf(scene, check).folder

    def seems_finished(self, scene: Scene, check: Check) -> bool:
        """Whether something is kept about the check; whether it still holds, `read` tells."""
        return (self.store.folder(self._parts(scene, check)) / "check.json").exists()

    def _shelf(self, scene: Scene, check: Check) -> Shelf:
        return self.store.shelf(self._parts(scene, check))

    def _parts(self, scene: Scene, check: Check) -> dict[str, Any]:
        return check_parts(scene, check) | {"graphics": self.graphics()}


def check_parts(scene: Scene, check: Check) -> dict[str, Any]:
    """Everything that the result of a check depends on, but for the machine."""
    return {
        "check": check.model_dump(mode="json"),
        "own_technique": source_digest(check.technique),
        "max_spp": scene.truth.max_spp,
        "truth": truth_parts(scene, check.quantity),
        "code": judging_code(),
    }


def _digest(path: Path) -> str:
    return file_digest(path) if path.exists() else ""
