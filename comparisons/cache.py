"""Finished checks, kept beside the truth: found again as long as nothing that they depend on has changed.

A check depends on what the scene says, on the truth, on the versions of libraries, and on code: that which draws its
technique, shaders included, and that which judges by its metrics. Nothing else of this project counts, so that a
changed shader runs the checks of the techniques that use it and no others.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from comparisons.code import judging_code, library_versions
from comparisons.result import CheckResult
from realtime.code import drawing_code
from realtime.context import environment_choice
from realtime.own import source_digest
from reference.estimator import truth_parts
from reference.store import Shelf, Store, write_text
from scenes import known
from scenes.checks import Check
from scenes.digest import digest_of, file_digest
from scenes.errors import SceneError
from scenes.model import Scene

KNOWN = "known.json"
"""What is known about files, within a store: see `scenes.known`."""


class CheckCache:
    """A finished check is found again only if every file of truth that it was judged against is unchanged.

    graphics : tells what chooses the OpenGL driver
    """

    def __init__(self, store: Store, graphics: Callable[[], dict[str, str]] = environment_choice) -> None:
        self.store = store
        self.graphics = graphics
        self._truths: dict[tuple[int, str], tuple[Scene, str]] = {}
        known.recall(store.root / KNOWN)

    def read(self, scene: Scene, check: Check) -> CheckResult | None:
        shelf = self._shelf(scene, check)
        try:
            record = json.loads((shelf.folder / "check.json").read_bytes())
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
        self.store.has_grown()

    def folder(self, scene: Scene, check: Check) -> Path:
        """Where everything about a check is kept."""
        return self._shelf(scene, check).folder

    def seems_finished(self, scene: Scene, check: Check) -> bool:
        """Whether something is kept about the check; whether it still holds, `read` tells."""
        return (self.store.folder(self._parts(scene, check)) / "check.json").exists()

    def _shelf(self, scene: Scene, check: Check) -> Shelf:
        return self.store.shelf(self._parts(scene, check))

    def _parts(self, scene: Scene, check: Check) -> dict[str, Any]:
        return check_parts(check, scene.truth.max_spp, self._truth_key(scene, check.quantity)) | {
            "graphics": self.graphics()
        }

    def _truth_key(self, scene: Scene, quantity: str) -> str:
        """The key of a truth, worked out once: a scene whose files change amid a run is refused anyway."""
        asked = id(scene), quantity
        if asked not in self._truths:
            self._truths[asked] = scene, digest_of(truth_parts(scene, quantity))
        return self._truths[asked][1]


def check_parts(check: Check, max_spp: int, truth_key: str) -> dict[str, Any]:
    """Everything that the result of a check depends on, but for the machine.

    truth_key : digest of what the truth depends on, the scene among it
    """
    return {
        "check": check.model_dump(mode="json"),
        "own_technique": source_digest(check.technique),
        "drawing": drawing_code(check.technique),
        "judging": judging_code(tuple(sorted({criterion.metric for criterion in check.criteria}))),
        "libraries": library_versions(),
        "max_spp": max_spp,
        "truth": truth_key,
    }


def keep_known(store: Store) -> None:
    """Let later runs know what this one has found out about files."""
    with suppress(OSError):  # it only spares time
        known.keep(store.root / KNOWN)


def _digest(path: Path) -> str:
    try:
        return file_digest(path)
    except SceneError:  # it is gone
        return ""
