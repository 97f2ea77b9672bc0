from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from realtime.context import GL_VERSION, _installed, environment_choice, make_context, renderer_name
from scenes.errors import NoGraphics

if TYPE_CHECKING:
    import moderngl


def test_without_egl_the_message_names_the_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**options: Any) -> None:
        raise Exception("libGL.so not loaded")  # as moderngl does, of that very class

    monkeypatch.setattr("moderngl.create_context", refuse)
    with pytest.raises(NoGraphics, match=r"libGL\.so not loaded") as caught:
        make_context.__wrapped__()
    for package in ("libegl1", "libgl1", "libgl1-mesa-dri"):
        assert package in str(caught.value)
    assert caught.value.exit_status == 4
    assert "\n" not in str(caught.value)


def test_the_context_is_off_screen_and_frees_what_python_frees(gl: "moderngl.Context") -> None:
    assert gl.version_code >= GL_VERSION
    assert gl.gc_mode == "auto"
    assert "OpenGL" in renderer_name(gl)


def test_a_process_has_one_context(gl: "moderngl.Context") -> None:
    """Two would delete each other's objects."""
    assert make_context() is gl


def test_the_choice_of_a_driver_is_part_of_what_an_image_depends_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GLCONTEXT_DEVICE_INDEX", "1")
    assert environment_choice()["GLCONTEXT_DEVICE_INDEX"] == "1"
    monkeypatch.delenv("GLCONTEXT_DEVICE_INDEX")
    assert "GLCONTEXT_DEVICE_INDEX" not in environment_choice()


def test_so_are_the_drivers_and_devices_that_are_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A store may be shared by machines, or outlive an update of the driver."""
    driver = tmp_path / "swrast_dri.so"
    driver.write_bytes(b"one")
    monkeypatch.setattr("realtime.context.DRIVERS", (f"{tmp_path}/*_dri.so",))
    monkeypatch.setattr("realtime.context.DEVICES", (f"{tmp_path}/card*",))

    def found() -> str:
        _installed.cache_clear()
        return environment_choice()["installed"]

    before = found()
    assert found() == before
    driver.write_bytes(b"three")
    updated = found()
    (tmp_path / "card0").touch()
    assert len({before, updated, found()}) == 3
    _installed.cache_clear()
