"""Scenes side by side in several processes: the same results, whatever becomes of one of them."""

import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.jobs import cores, require_jobs, run
from comparisons.request import Request, request_of
from comparisons.result import CheckResult
from comparisons.setup import Setup
from comparisons.suite import Progress
from reference.store import Store
from scenes.errors import InputError
from scenes.load import load_scene

Run = Callable[..., Any]
Write = Callable[..., Path]

CHECKS = 15
SCENES = ("large", "middle", "small")
NUMBERS = itertools.count()
COMMAND = ("run", "scenes", "--technique", "fatal.py", "--jobs", "2", "-k")
ORIGINAL = '"indirect.irradiance"\nsettings = { side = 24 }'
SAID = "lightgauge: interrupted. What was rendered is kept; the same command goes on from there.\n"

FATAL = """
import os, signal
from realtime.graph import Pass
from realtime.technique import Technique

def die(frame):
    {how}

TECHNIQUES = {{
    "mine.{name}": Technique(
        name="mine.{name}",
        approximates="indirect_radiance",
        summary="ends the process that draws it",
        source="nobody",
        limits="all",
        passes=lambda scene, features, settings: [Pass("die", die, writes=("image",))],
        grid=1,
    )
}}
"""


def results_of(folder: Path) -> dict[str, Any]:
    """What a run found, without how many processes it took, when, how long, and whether it was in the store."""
    plain: dict[str, Any] = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert [check["scene"] for check in plain["checks"]] == sorted(check["scene"] for check in plain["checks"])
    for check in plain["checks"]:
        check.update(cached=None, seconds=None, pass_seconds=None, baked_seconds=None)
    return plain | {"started": None, "seconds": None, "jobs": None}


def pictures_of(folder: Path) -> dict[str, bytes]:
    paths = [path for part in ("images", "pixels") for path in (folder / part).iterdir()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


@pytest.fixture
def scenes(here: Path, trio: Path) -> Path:
    """The current folder, which holds the scenes of the trio."""
    shutil.copytree(trio / "scenes", here / "scenes")
    return here


@pytest.fixture
def write_fatal(here: Path) -> Callable[[str], str]:
    """Writes fatal.py with a technique that does something to its process; its name is that of no other test's."""
    name = f"fatal{next(NUMBERS)}"

    def write(how: str) -> str:
        (here / "fatal.py").write_text(FATAL.format(how=how, name=name), encoding="utf-8")
        return f"mine.{name}"

    return write


@pytest.fixture
def judged(scenes: Path, trio: Path) -> Path:
    """The current folder, which holds the scenes of the trio and a store in which they are finished."""
    shutil.copytree(trio / ".lightgauge", scenes / ".lightgauge")
    return scenes


def test_two_processes_come_to_the_results_of_one_to_the_bit(scenes: Path, trio: Path, lightgauge: Run) -> None:
    outcome = lightgauge("run", "scenes", "--jobs", "2")
    assert outcome.status == 0, outcome.err
    assert json.loads((scenes / "report" / "results.json").read_text(encoding="utf-8"))["jobs"] == 2
    assert results_of(scenes / "report") == results_of(trio / "report")
    assert pictures_of(scenes / "report") == pictures_of(trio / "report")
    lines = outcome.out.splitlines()
    assert sum(line.startswith("[") and "PASS" in line for line in lines) == CHECKS
    assert "2 processes shared this machine" in lines[-2]


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("os.kill(os.getpid(), signal.SIGKILL)", "was killed by SIGKILL; the other scenes went on. Most often the sys"),
        pytest.param("os._exit(7)", "ended with status 7; the other scenes went on. What", marks=pytest.mark.slow),
    ],
)
def test_a_process_that_dies_takes_one_check_with_it_and_is_replaced(
    judged: Path, lightgauge: Run, write_fatal: Callable[[str], str], how: str, said: str
) -> None:
    """Of four scenes two share their truth, and so a process; it dies in the first of these."""
    name = write_fatal(how)
    text = (judged / "scenes" / "large.toml").read_text(encoding="utf-8")
    (judged / "scenes" / "first.toml").write_text(text.replace(ORIGINAL, f'"{name}"'), encoding="utf-8")
    outcome = lightgauge(*COMMAND, f"first/ or not {name}")
    assert outcome.status == 4
    checks = json.loads((judged / "report" / "results.json").read_text(encoding="utf-8"))["checks"]
    assert list(dict.fromkeys(check["scene"] for check in checks)) == ["first", *SCENES]
    assert len(checks) == CHECKS + 5
    (broken,) = (check for check in checks if check["verdict"] != "PASS")
    assert (broken["id"], broken["verdict"]) == (f"first/{name}", "ERROR"), "what was finished before counts"
    assert said in broken["message"]
    assert broken["message"].endswith("lightgauge run scenes/first.toml")


@pytest.mark.slow
@pytest.mark.usefixtures("scenes")
def test_a_machine_that_cannot_render_stops_all_processes(lightgauge_apart: Run) -> None:
    nowhere = {"DRJIT_LIBLLVM_PATH": "gone/libLLVM.so"}
    outcome = lightgauge_apart("run", "scenes", "--jobs", "2", environment=nowhere)
    assert outcome.status == 4
    assert outcome.err.startswith("lightgauge: No usable LLVM")
    assert outcome.err.count("\n") == 1, "no traceback of any process"


def wait_for(process: "subprocess.Popen[str]", store: Path, count: int) -> None:
    """Wait until so many checks are finished in the store."""
    deadline = time.monotonic() + 60
    while len(list(store.glob("*/*/check.json"))) < count:
        assert process.poll() is None, "it ended before it could be interrupted"
        assert time.monotonic() < deadline
        time.sleep(0.005)


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_a_run_that_is_cut_off_goes_on_where_it_stopped(
    scenes: Path, trio: Path, start: Run, lightgauge_apart: Run, number: signal.Signals
) -> None:
    command = ("run", "scenes/large.toml", "scenes/small.toml", "--jobs", "2")
    process = start(*command, start_new_session=True)
    wait_for(process, scenes / ".lightgauge", 2)
    os.killpg(process.pid, number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == (130 if number is signal.SIGINT else -signal.SIGKILL)
    assert err == (SAID if number is signal.SIGINT else "")
    finished = len(list((scenes / ".lightgauge").glob("*/*/check.json")))
    assert 2 <= finished < 10
    outcome = lightgauge_apart(*command)
    assert outcome.status == 0
    assert f"{finished} of 10 checks found finished in .lightgauge" in outcome.out
    assert outcome.out.count("(stored)") == finished
    checks = [check for check in results_of(trio / "report")["checks"] if check["scene"] != "middle"]
    assert results_of(scenes / "report")["checks"] == checks


@pytest.mark.slow
@pytest.mark.usefixtures("scenes")
def test_processes_whose_parent_was_killed_end_too(here: Path, start: Run) -> None:
    process = start("run", "scenes", "--jobs", "2", start_new_session=True)
    wait_for(process, here / ".lightgauge", 1)
    process.kill()
    process.wait()
    deadline = time.monotonic() + 60
    while _is_alive(process.pid):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.communicate()


def _is_alive(group: int) -> bool:
    """Whether a process of this group is left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize("jobs", ["0", "-3"])
def test_a_number_of_processes_below_one_is_refused(scenes: Path, lightgauge: Run, jobs: str) -> None:
    outcome = lightgauge("run", "scenes", "--jobs", jobs)
    assert outcome.status == 3
    assert f"--jobs: found {jobs}; allowed: 1 or more" in outcome.err
    assert not (scenes / "report").exists()


def test_more_processes_than_cores_are_allowed() -> None:
    require_jobs(cores() + 1)
    with pytest.raises(InputError):
        require_jobs(0)


def requests(folder: Path) -> list[Request]:
    return [request_of(load_scene(path), str(path)) for path in sorted((folder / "scenes").glob("*.toml"))]


def test_the_longest_scenes_begin_first_and_results_stay_in_order(judged: Path) -> None:
    finished: list[CheckResult] = []
    progress = Progress(lambda what, fraction: None, finished.append)
    asked = requests(judged)
    seconds = {"large": 1.0, "middle": 2.0, "small": 3.0}
    results = run(asked, Store(Path(".lightgauge")), progress, Setup(), 2, seconds)
    assert list(dict.fromkeys(result.scene for result in results)) == list(SCENES)
    order = [result.scene for result in finished]
    before = order[: order.index("large")]
    assert 5 in (before.count("middle"), before.count("small")), "a process was free for it"


def test_one_scene_takes_no_other_process(judged: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("comparisons.jobs._Crew")
    progress = Progress(lambda what, fraction: None, lambda result: None)
    assert len(run(requests(judged)[:1], Store(Path(".lightgauge")), progress, Setup(), 8)) == 5


@pytest.mark.slow
def test_processes_share_the_cores(judged: Path, lightgauge: Run, write_fatal: Callable[[str], str]) -> None:
    """A technique that looks at its process: as many threads as there are cores for it."""
    look = "open(f'threads-{os.getpid()}', 'w').write(os.environ['LIGHTGAUGE_THREADS'] + os.environ['LP_NUM_THREADS'])"
    name = write_fatal(f"{look}; os._exit(0)")
    for scene in SCENES:
        path = judged / "scenes" / f"{scene}.toml"
        path.write_text(path.read_text(encoding="utf-8").replace(ORIGINAL, f'"{name}"'), encoding="utf-8")
    assert lightgauge(*COMMAND, name).status == 4
    found = [path.read_text(encoding="utf-8") for path in judged.glob("threads-*")]
    assert found == [2 * str(max(1, cores() // 2))] * len(SCENES)


def test_drjit_takes_no_more_threads_than_it_is_told(here: Path) -> None:
    code = "import sys; from reference.start import mitsuba; mitsuba(); import drjit; print(drjit.thread_count())"
    environment = os.environ | {"LIGHTGAUGE_THREADS": "3"}
    root = str(Path(__file__).parents[2])
    found = subprocess.run(
        [sys.executable, "-c", code], env=environment | {"PYTHONPATH": root}, capture_output=True, text=True, check=True
    )
    assert found.stdout == "3\n"
