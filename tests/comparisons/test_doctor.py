from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from comparisons.doctor import require_writable, version_of
from scenes.errors import NoGraphics

if TYPE_CHECKING:
    import moderngl

Run = Callable[..., Any]


def statuses(out: str) -> dict[str, str]:
    """The finding of each subject: ok or WRONG."""
    return {line[6:22].strip(): line[:6].strip() for line in out.splitlines()}


def test_a_machine_that_can_render_is_fine(here: Path, lightgauge_apart: Run) -> None:
    outcome = lightgauge_apart("doctor")
    assert (outcome.status, outcome.err) == (0, "")
    subjects = ("platform", "packages", "OpenGL", "LLVM, Mitsuba", "store")
    assert statuses(outcome.out) == dict.fromkeys(subjects, "ok")
    assert "mitsuba 3." in outcome.out


def test_without_a_compiler_the_rest_is_still_looked_at(lightgauge_apart: Run) -> None:
    outcome = lightgauge_apart("doctor", environment={"DRJIT_LIBLLVM_PATH": "gone/libLLVM.so"})
    assert outcome.status == 4
    found = statuses(outcome.out)
    assert found["LLVM, Mitsuba"] == "WRONG"
    assert (found["OpenGL"], found["store"]) == ("ok", "ok")
    assert "make setup" in outcome.out


@pytest.mark.usefixtures("mi", "gl")
def test_without_graphics_the_packages_to_install_are_named(
    here: Path, lightgauge: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> "moderngl.Context":
        raise NoGraphics("install libegl1")

    monkeypatch.setattr("realtime.context.make_context", refuse)
    outcome = lightgauge("doctor")
    assert outcome.status == 4
    assert statuses(outcome.out)["OpenGL"] == "WRONG"
    assert "libegl1" in outcome.out


@pytest.mark.usefixtures("mi", "gl")
def test_a_store_that_cannot_be_written_to_is_wrong(here: Path, lightgauge: Run) -> None:
    (here / "file").touch()
    outcome = lightgauge("doctor", "--store", "file/store")
    assert outcome.status == 4
    assert statuses(outcome.out)["store"] == "WRONG"
    assert "--store FOLDER" in outcome.out


def test_a_folder_is_made_and_left_empty(tmp_path: Path) -> None:
    require_writable(tmp_path / "a" / "b", "store", "--store")
    assert list((tmp_path / "a" / "b").iterdir()) == []


def test_a_package_that_is_missing_is_said() -> None:
    assert version_of("no-such-package-anywhere") == "not installed"
