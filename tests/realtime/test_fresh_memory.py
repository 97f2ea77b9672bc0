"""What a technique has not written it must not read: drivers hand out memory as the last user left it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime.device import CUBE_FACES, Device
from realtime.render import Renderer
from realtime.techniques import MODULES, technique
from scenes.image import Float32
from scenes.model import Scene
from tests.realtime.samples import SCENES, SETTINGS, small

FAST = ("layered.ggx", "shadow.vcm", "indirect.probe")
CASES = [pytest.param(name, marks=() if name in FAST else pytest.mark.slow) for name in MODULES]
BYTES = {"f1": 1, "u1": 1, "f2": 2, "u2": 2, "f4": 4, "u4": 4, "i4": 4}


def spoilt(make: Callable[..., Any]) -> Callable[..., Any]:
    """The same, but what is not given contents is full of ones: NaN in half and single precision."""

    def made(self: Device, *given: Any, **named: Any) -> Any:
        new = make(self, *given, **named)
        if any(isinstance(value, bytes | bytearray | memoryview | np.ndarray) for value in (*given, *named.values())):
            return new
        if not hasattr(new, "components"):
            new.write(b"\xff" * new.size)
            return new
        ones = b"\xff" * (int(np.prod(new.size)) * new.components * BYTES[new.dtype])
        if make.__name__ == "texture_cube":
            for face in range(CUBE_FACES):
                new.write(face, ones)
        else:
            new.write(ones)
        return new

    return made


@pytest.fixture
def spoil(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    def begin() -> None:
        for name in ("buffer", "texture", "texture3d", "texture_array", "texture_cube"):
            monkeypatch.setattr(Device, name, spoilt(getattr(Device, name)))

    return begin


def drawn(scene: Scene, name: str) -> Float32:
    return Renderer(scene).render(technique(name), SETTINGS.get(name, {}), timed=False).image.pixels


@pytest.mark.parametrize("name", CASES)
def test_an_image_does_not_depend_on_what_memory_held(name: str, spoil: Callable[[], None]) -> None:
    scene = small(SCENES[name.partition(".")[0]])
    expected = drawn(scene, name)
    spoil()
    np.testing.assert_array_equal(drawn(scene, name), expected)


def test_memory_is_really_spoilt(spoil: Callable[[], None], gl: Any) -> None:
    """Else the others would pass for nothing."""
    spoil()
    device = Device(gl)
    assert np.isnan(np.frombuffer(device.texture((4, 4), 4, dtype="f4").read(), dtype=np.float32)).all()
    assert np.isnan(np.frombuffer(device.buffer(reserve=64).read(), dtype=np.float32)).all()
    assert not np.any(np.frombuffer(device.buffer(bytes(64)).read(), dtype=np.float32))
