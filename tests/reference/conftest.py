from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from reference.estimator import Reference
from reference.store import Store
from scenes.model import Scene


@pytest.fixture
def reference(mi: ModuleType, tmp_path: Path) -> Callable[..., Reference]:
    """Makes the reference of a scene with a store in the test's own folder, or in another one."""

    def make(scene: Scene, store: Store | None = None) -> Reference:
        return Reference(scene, store or Store(tmp_path / "store"), lambda what, part: None)

    return make


@pytest.fixture
def facing() -> dict[str, Any]:
    """A square image of 60 degrees, seen from (0, 0, 2) along -z."""
    return {
        "type": "perspective",
        "origin": [0.0, 0.0, 2.0],
        "target": [0.0, 0.0, 0.0],
        "fov_deg": 60.0,
        "width": 8,
        "height": 8,
    }
