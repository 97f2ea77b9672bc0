"""A scene of a few pixels, and the command line run on it in a folder of the test's own."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import pytest

from comparisons.cli import main

if TYPE_CHECKING:
    import moderngl

TINY = """\
title = "A ball in a small room"
subject = ["ball"]
truth = { max_spp = 512 }

[sensor]
type = "perspective"
origin = [0.2, 0.3, 1.2]
target = [0.1, 0.05, 0.0]
fov_deg = 30.0
width = 16
height = 12

[materials]
white = { type = "diffuse", reflectance = [0.7, 0.7, 0.7] }
red = { type = "diffuse", reflectance = [0.6, 0.15, 0.1] }

[[shapes]]
name = "room"
type = "room"
size = [3.0, 2.5, 3.0]
material = "white"
walls = { left = "red" }

[[shapes]]
name = "ball"
type = "sphere"
radius = 0.3
detail = 3
position = [0.1, 0.0, 0.0]
material = "white"

[[emitters]]
type = "point"
position = [0.7, 0.9, 0.8]
intensity = [6.0, 5.0, 4.0]

[[checks]]
quantity = "indirect_radiance"
technique = "indirect.irradiance"
settings = { side = 24 }
criteria = [{ metric = "nrmse", max = 0.5, reason = "far above what is reached" }]
"""


@dataclass(frozen=True)
class Outcome:
    """What a command left on the terminal."""

    status: int
    out: str
    err: str


def write_tiny(folder: Path, *changes: tuple[str, str], name: str = "tiny") -> Path:
    """Write TINY with some of its text replaced."""
    text = TINY
    for old, new in changes:
        assert old in text, f"the scene has no {old!r}"
        text = text.replace(old, new)
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory, gl: "moderngl.Context", mi: ModuleType) -> Path:
    """A folder in which `lightgauge run tiny.toml` has been run. Only to be read."""
    folder = tmp_path_factory.mktemp("finished")
    scene, store, report = write_tiny(folder), folder / ".lightgauge", folder / "report"
    assert main(["run", str(scene), "--store", str(store), "-o", str(report)]) == 0
    return folder


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The test's own folder, as the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def after_a_run(here: Path, finished: Path) -> Path:
    """The current folder, in which `lightgauge run tiny.toml` has been run."""
    shutil.copytree(finished, here, dirs_exist_ok=True)
    return here


@pytest.fixture
def with_truth(after_a_run: Path) -> Path:
    """The current folder, in which the truth of TINY is known, but no check has been judged."""
    for verdict in (after_a_run / ".lightgauge").rglob("check.json"):
        verdict.unlink()
    shutil.rmtree(after_a_run / "report")
    return after_a_run


@pytest.fixture
def write_scene(here: Path) -> Callable[..., Path]:
    """Writes TINY into the current folder: write_scene((old, new), ..., name="tiny")."""
    return lambda *changes, name="tiny": write_tiny(here, *changes, name=name)


@pytest.fixture
def lightgauge(capsys: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """Runs the command line in this process, in the current folder."""

    def run(*arguments: str) -> Outcome:
        capsys.readouterr()
        try:
            status = main(arguments)
        except SystemExit as ended:  # argparse: help, or a wrong option
            status = int(str(ended.code))
        written = capsys.readouterr()
        return Outcome(status, written.out, written.err)

    return run
