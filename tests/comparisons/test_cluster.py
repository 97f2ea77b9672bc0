import json
import os
import pickle
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons import cluster_tasks
from comparisons.cluster import Cluster, ClusterRenderer, ClusterStudio, connect
from realtime.techniques import technique
from reference import estimator
from reference.estimator import Reference
from reference.store import Store
from scenes.errors import FlaggedPixels, InputError, LightgaugeError, MachineError, NoCluster
from scenes.load import load_scene
from scenes.model import Scene

INDIRECT = "indirect_radiance"
MANY = 1024
"""Paths a launch, so that a truth of TINY takes many launches."""


@dataclass(frozen=True)
class Running:
    """A cluster of two workers. `address` is that of its scheduler."""

    local: Any
    address: str

    def pids(self) -> list[int]:
        return sorted(nanny.pid for nanny in self.local.workers.values())


@pytest.fixture(scope="module")
def running(pytestconfig: pytest.Config) -> Iterator[Running]:
    from distributed import LocalCluster

    assert pytestconfig.cache is not None
    root = str(Path(__file__).parents[2])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DRJIT_CACHE_DIR", str(pytestconfig.cache.mkdir("kernels")))
        patch.setenv("PYTHONPATH", root)
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as local:
            yield Running(local, local.scheduler_address)
            connect(local.scheduler_address).close()


@pytest.fixture
def cluster(running: Running) -> Cluster:
    return connect(running.address)


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever waits for a task says so at once."""
    monkeypatch.setattr("comparisons.cluster.POLL_SECONDS", 1e-3)


@pytest.fixture
def tiny(write_scene: Callable[..., Path]) -> Scene:
    return load_scene(write_scene())


def results_of(folder: Path) -> Any:
    """What results.json says, but for what differs from run to run."""
    found = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    del found["started"], found["seconds"]
    for check in found["checks"]:
        del check["seconds"], check["pass_seconds"], check["baked_seconds"]
    return found


def test_results_are_those_of_a_local_run(
    running: Running, after_a_run: Path, lightgauge: Callable[..., Any], tmp_path: Path
) -> None:
    outcome = lightgauge("run", "tiny.toml", "--dask", running.address, "--store", "other", "-o", "far")
    assert (outcome.status, outcome.err) == (0, "")
    assert results_of(Path("far")) == results_of(Path("report"))
    blocks = sorted(path.relative_to(".lightgauge") for path in Path(".lightgauge").rglob("block-*.exr"))
    assert blocks
    assert blocks == sorted(path.relative_to("other") for path in Path("other").rglob("block-*.exr"))
    assert not list(Path("other").glob("kernels")), "this process has rendered something itself"


def truth_of(scene: Scene, folder: Path, studio: ClusterStudio | None, spp: int = 64) -> estimator.Truth:
    return Reference(scene, Store(folder), lambda what, part: None, studio).truth(INDIRECT, spp)


def test_many_launches_give_the_same_bits_whatever_order_they_finish_in(
    cluster: Cluster, tiny: Scene, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(estimator, "PATHS_A_LAUNCH", MANY)
    here = truth_of(tiny, tmp_path / "here", None)
    there = truth_of(tiny, tmp_path / "there", ClusterStudio(tiny, cluster, lambda what, part: None))
    np.testing.assert_array_equal(there.accumulators, here.accumulators)
    assert (there.key, there.spp) == (here.key, here.spp)
    assert there.seconds > 0


def test_a_run_says_how_many_tasks_and_workers_there_are(
    cluster: Cluster, tiny: Scene, impatient: None, tmp_path: Path
) -> None:
    said: list[str] = []
    studio = ClusterStudio(tiny, cluster, lambda what, part: said.append(what))
    Reference(tiny, Store(tmp_path / "store"), studio.progress, studio).truth(INDIRECT, 256)
    assert any(what.endswith(" on 2 workers]") for what in said), said


def test_an_error_of_a_task_is_the_same_error_here(cluster: Cluster, tiny: Scene) -> None:
    """You should see what the technique says, not what Dask makes of it."""
    renderer = ClusterRenderer(cluster, tiny, lambda what, part: None)
    with pytest.raises(InputError, match=r"Technique 'indirect\.irradiance' has no setting 'sides'"):
        renderer.render(technique("indirect.irradiance"), {"sides": 3})


def test_the_pixels_that_an_error_names_travel_with_it() -> None:
    flagged = np.array([[True, False]])
    again = pickle.loads(pickle.dumps(FlaggedPixels("two faces", flagged)))
    assert (type(again), str(again)) == (FlaggedPixels, "two faces")
    np.testing.assert_array_equal(again.flagged, flagged)


@pytest.mark.parametrize("error", [InputError("a"), MachineError("b"), NoCluster("c")])
def test_every_error_travels(error: LightgaugeError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again)) == (type(error), str(error))


def test_a_technique_that_fails_on_a_worker_fails_its_check(
    running: Running, write_scene: Callable[..., Path], lightgauge: Callable[..., Any]
) -> None:
    write_scene(("width = 16", "width = 4096"))
    outcome = lightgauge("run", "tiny.toml", "--dask", running.address, "-k", "irradiance")
    assert outcome.status == 3
    (check, *_) = json.loads(Path("report/results.json").read_text(encoding="utf-8"))["checks"]
    assert check["verdict"] == "ERROR"
    assert "needs a texture of 32768 x 96; this GPU allows" in check["message"]


def test_a_worker_of_another_version_refuses_and_names_both(
    cluster: Cluster, tiny: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    theirs = cluster_tasks.versions()
    monkeypatch.setattr(cluster_tasks, "versions", lambda: theirs | {"mitsuba": "9.9.9"})
    studio = ClusterStudio(tiny, cluster, lambda what, part: None)
    with pytest.raises(
        MachineError, match=rf"has mitsuba {theirs['mitsuba']}, but the run was .* with mitsuba 9\.9\.9"
    ):
        studio.exact("coverage", "0" * 64)


def test_a_worker_that_knows_another_truth_refuses(cluster: Cluster, tiny: Scene) -> None:
    studio = ClusterStudio(tiny, cluster, lambda what, part: None)
    with pytest.raises(
        MachineError, match=r"knows coverage of this scene as truth [0-9a-f]{12}, the run asks for 0000"
    ):
        studio.exact("coverage", "0" * 64)


def test_an_interrupted_run_leaves_nothing_on_the_cluster(
    running: Running, tiny: Scene, impatient: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(estimator, "PATHS_A_LAUNCH", MANY)

    def interrupted(what: str, fraction: float) -> None:
        if "tasks left" in what:
            raise KeyboardInterrupt

    own, before = Cluster(running.address), set(running.local.scheduler.tasks)
    with pytest.raises(KeyboardInterrupt):
        truth_of(tiny, tmp_path / "store", ClusterStudio(tiny, own, interrupted), 1024)
    deadline = time.monotonic() + 20
    while set(running.local.scheduler.tasks) - before and time.monotonic() < deadline:
        time.sleep(0.05)
    assert set(running.local.scheduler.tasks) <= before


@pytest.mark.slow
def test_a_worker_that_is_killed_changes_nothing(
    running: Running, tiny: Scene, impatient: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(estimator, "PATHS_A_LAUNCH", MANY)
    before = running.pids()
    killed: list[int] = []

    def kill_one(what: str, fraction: float) -> None:
        if "tasks left" in what and not killed:
            killed.append(before[0])
            os.kill(before[0], signal.SIGKILL)

    there = truth_of(tiny, tmp_path / "there", ClusterStudio(tiny, connect(running.address), kill_one), 512)
    assert killed
    here = truth_of(tiny, tmp_path / "here", None, 512)
    np.testing.assert_array_equal(there.accumulators, here.accumulators)
    assert killed[0] not in running.pids()


@pytest.mark.slow
def test_a_lost_scheduler_ends_the_run(
    tiny: Scene, impatient: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from distributed import LocalCluster

    monkeypatch.setattr(estimator, "PATHS_A_LAUNCH", MANY)
    lost: list[str] = []
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as local:
        own = Cluster(local.scheduler_address)

        def lose(what: str, fraction: float) -> None:
            if "tasks left" in what and not lost:
                lost.append(what)
                local.close()

        with pytest.raises(NoCluster, match=r"is lost\. What was rendered is kept"):
            truth_of(tiny, tmp_path / "store", ClusterStudio(tiny, own, lose), 1024)
        own.close()


def test_nobody_answers(lightgauge: Callable[..., Any], tiny: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("comparisons.cluster.CONNECT_SECONDS", 0.3)
    outcome = lightgauge("run", "tiny.toml", "--dask", "tcp://127.0.0.1:1")
    assert outcome.status == 4
    assert "No Dask scheduler answers at tcp://127.0.0.1:1 within 0.3 s. Start one with `dask scheduler`" in outcome.err


@pytest.mark.parametrize("address", ["scheduler", "foo://127.0.0.1:8786", "tls://127.0.0.1:8786"])
def test_what_is_no_address(lightgauge: Callable[..., Any], tiny: Scene, address: str) -> None:
    outcome = lightgauge("run", "tiny.toml", "--dask", address)
    assert outcome.status == 3
    assert f"--dask {address}: this is no address of a scheduler" in outcome.err


def test_dask_is_not_installed(lightgauge: Callable[..., Any], tiny: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    outcome = lightgauge("run", "tiny.toml", "--dask", "tcp://127.0.0.1:1")
    assert outcome.status == 3
    assert "pip install 'lightgauge[dask]'" in outcome.err


def test_dask_of_another_version(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    found: Any = connect(running.address).client.get_versions()
    found["scheduler"] = {"packages": found["scheduler"]["packages"] | {"distributed": "1.2.3"}}
    monkeypatch.setattr("distributed.Client.get_versions", lambda client: found)
    with pytest.raises(NoCluster, match=r"the scheduler has Python 3\.\d+, dask [\d.]+, distributed 1\.2\.3, this"):
        Cluster(running.address)


def test_without_it_nothing_of_dask_is_imported(after_a_run: Path, lightgauge_apart: Callable[..., Any]) -> None:
    shutil.rmtree("report")
    outcome = lightgauge_apart(
        "run",
        "tiny.toml",
        before="import atexit\natexit.register(lambda: print({'dask', 'distributed'} & {*sys.modules}))",
    )
    assert outcome.status == 0
    assert outcome.out.splitlines()[-1] == "set()"


@pytest.mark.parametrize(
    "error", [ModuleNotFoundError("comparisons"), RuntimeError("Error during deserialization of it")]
)
def test_a_cluster_without_lightgauge_ends_the_run(
    cluster: Cluster, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Failed:
        status = "error"

        def exception(self) -> Exception:
            return error

        def done(self) -> bool:
            return True

    monkeypatch.setattr("distributed.wait", lambda future, timeout: None)
    with pytest.raises(NoCluster, match="cannot unpack a task of lightgauge"):
        cluster.result(Failed(), lambda what, fraction: None, "", 0.0)  # type: ignore[arg-type]
