"""What the tests of several packages share: small scenes, and each renderer started once."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from scenes.load import load_scene
from scenes.model import Scene
from scenes.procedural import icosphere

if TYPE_CHECKING:
    import moderngl

SMALL_ROOM: dict[str, Any] = {
    "title": "A ball in a small coloured room",
    "subject": ["ball"],
    "sensor": {
        "type": "perspective",
        "origin": [0.2, 0.3, 1.2],
        "target": [0.1, 0.05, 0.0],
        "fov_deg": 40.0,
        "width": 16,
        "height": 12,
    },
    "materials": {
        "red": {"type": "diffuse", "reflectance": [0.6, 0.15, 0.1]},
        "white": {"type": "diffuse", "reflectance": [0.7, 0.7, 0.7]},
        "skin": {"type": "diffuse", "reflectance": [0.6, 0.5, 0.4]},
    },
    "shapes": [
        {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white", "walls": {"left": "red"}},
        {"name": "ball", "type": "sphere", "radius": 0.3, "detail": 3, "position": [0.1, 0.0, 0.0], "material": "skin"},
    ],
    "emitters": [{"type": "point", "position": [0.7, 0.9, 0.8], "intensity": [6.0, 5.0, 4.0]}],
}


def toml_of(value: Any) -> str:
    """A value as it stands on the right-hand side of a TOML key."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml_of(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml_of, value)) + "]"
    return json.dumps(value)


@pytest.fixture
def make_scene(tmp_path: Path) -> Callable[..., Scene]:
    """Makes SMALL_ROOM with some of its top-level keys replaced, through a TOML file in the test's own folder."""

    def make(**overrides: Any) -> Scene:
        path = tmp_path / "scene.toml"
        lines = [f"{key} = {toml_of(value)}" for key, value in (SMALL_ROOM | overrides).items()]
        path.write_text("\n".join(lines), encoding="utf-8")
        return load_scene(path)

    return make


@pytest.fixture
def make_cavity(tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """Makes the shape of a sphere seen from inside, with the area of the true one: an integrating sphere."""

    def make(radius: float, material: str, detail: int = 4) -> dict[str, Any]:
        directions, faces = icosphere(detail)
        corners = directions[faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
        positions = radius * np.sqrt(4 * np.pi / area) * directions
        lines = [f"v {x} {y} {z}" for x, y, z in positions] + [f"f {c} {b} {a}" for a, b, c in faces + 1]
        (tmp_path / "cavity.obj").write_text("\n".join(lines), encoding="ascii")
        return {"name": "cavity", "type": "mesh", "path": "cavity.obj", "material": material}

    return make


@pytest.fixture
def techniques_forgotten() -> Iterator[None]:
    """What a test loads from files of a user is unknown to the next one."""
    from realtime import own, techniques

    yield
    own._files.clear()
    techniques.OWN.clear()


@pytest.fixture(scope="session")
def gl() -> "moderngl.Context":
    """The OpenGL context."""
    from realtime.context import make_context

    return make_context()


@pytest.fixture(scope="session")
def mi(pytestconfig: pytest.Config) -> ModuleType:
    """Mitsuba, with its compiled kernels kept from one session to the next."""
    from reference.start import mitsuba

    return mitsuba(pytestconfig.cache.mkdir("kernels"))
