"""A scene of a few pixels, and the command line run on it in a folder of the test's own."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import pytest

from comparisons.cli import main
from comparisons.gate import CriterionResult, Verdict
from comparisons.result import SCHEMA, CheckResult

if TYPE_CHECKING:
    import moderngl

ROOT = Path(__file__).parents[2]

TINY = """\
title = "A ball in a small room"
subject = ["ball"]
truth = { max_spp = 4096 }

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
position = [0.5, 0.2, 0.9]
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
def make_judged() -> Callable[..., dict[str, Any]]:
    """Makes a check of results.json with one criterion: make_judged(value=0.1, low=0.08, high=0.12, max=0.2)."""

    def make(
        value: float = 0.1,
        low: float | None = None,
        high: float | None = None,
        verdict: str = "PASS",
        *,
        metric: str = "nrmse",
        min: float | None = None,
        max: float | None = 0.2,
        place: str = "",
        reason: str = "more is seen",
        **others: Any,
    ) -> dict[str, Any]:
        criterion = CriterionResult(
            metric=metric,
            value=value,
            low=value if low is None else low,
            high=value if high is None else high,
            min=min,
            max=max,
            verdict=Verdict(verdict),
            reason=reason,
            note="",
            place=place,
        )
        known: dict[str, Any] = {
            "scene": "room",
            "scene_title": "A room",
            "quantity": "indirect_radiance",
            "technique": "indirect.probe",
            "settings": {},
            "fit_exposure": False,
            "message": "",
            "unit": "W/(m² sr)",
            "display": "radiance",
            "card": {},
            "rerun": "lightgauge run room.toml -k indirect.probe",
            "criteria": () if verdict == "ERROR" else (criterion,),
            "spp": 64,
            "seconds": {"realtime": 0.02, "reference": 3.0},
            "gl_renderer": "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5",
        }
        return CheckResult(verdict=Verdict(verdict), **(known | others)).to_json()

    return make


@pytest.fixture(scope="session")
def make_run() -> Callable[..., dict[str, Any]]:
    """Makes the content of results.json: make_run(check, ..., started="2026-01-31T12:00:00+00:00", commit="abc")."""

    def make(
        *checks: dict[str, Any], started: str = "2026-01-31T12:00:00+00:00", commit: str | None = "abc", **others: Any
    ) -> dict[str, Any]:
        environment = {"lightgauge": "0.1.0", "platform": "Linux", "commit": commit}
        counts = {str(v): sum(check["verdict"] == str(v) for check in checks) for v in Verdict}
        known = {"schema": SCHEMA, "environment": environment, "started": started, "seconds": 4.0, "counts": counts}
        return known | {"store_note": None, "checks": list(checks)} | others

    return make


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory, gl: "moderngl.Context", mi: ModuleType) -> Path:
    """A folder in which `lightgauge run tiny.toml` has been run. Only to be read."""
    folder = tmp_path_factory.mktemp("finished")
    write_tiny(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["run", "tiny.toml"]) == 0
    return folder


@pytest.fixture(scope="session")
def trio(tmp_path_factory: pytest.TempPathFactory, gl: "moderngl.Context", mi: ModuleType) -> Path:
    """A folder in which `lightgauge run scenes` has been run on three scenes that share no truth. Only to be read."""
    folder = tmp_path_factory.mktemp("trio")
    (folder / "scenes").mkdir()
    for name, radius in (("large", 0.32), ("middle", 0.3), ("small", 0.28)):
        write_tiny(folder / "scenes", ("radius = 0.3", f"radius = {radius}"), name=name)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["run", "scenes"]) == 0
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


@pytest.fixture
def start(here: Path, pytestconfig: pytest.Config) -> Callable[..., "subprocess.Popen[str]"]:
    """Starts the command line in a process of its own: start("run", "tiny.toml", before="Python to run first")."""
    assert pytestconfig.cache is not None
    kernels = {"DRJIT_CACHE_DIR": str(pytestconfig.cache.mkdir("kernels"))}

    def begin(*arguments: str, before: str = "", environment: dict[str, str] | None = None, **streams: Any) -> Any:
        code = f"import sys\n{before}\nfrom comparisons.cli import main\nsys.exit(main(sys.argv[1:]))"
        return subprocess.Popen(
            [sys.executable, "-c", code, *arguments],
            env=os.environ | kernels | {"PYTHONPATH": str(ROOT)} | (environment or {}),
            text=True,
            **({"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams),
        )

    return begin


@pytest.fixture
def lightgauge_apart(start: Callable[..., "subprocess.Popen[str]"]) -> Callable[..., Outcome]:
    """Runs the command line in a process of its own, to its end."""

    def run(*arguments: str, **options: Any) -> Outcome:
        process = start(*arguments, **options)
        out, err = process.communicate(timeout=120)
        return Outcome(process.returncode, out, err)

    return run
