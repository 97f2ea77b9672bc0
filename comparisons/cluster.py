"""Both sides rendered by the workers of a Dask cluster, while verdicts and the store stay in this process.

A launch, an exact truth or a drawing is a task. Tasks are pure and named for what they render, so that the scheduler
may run one again when a worker is lost, and renders only once what two clients ask for. What comes back is counted in
the order of its blocks, whatever order it was finished in: results are those of a local run, to the bit.
"""

import asyncio
import atexit
import logging
import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import asdict
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

from comparisons.runner import Sides, Step
from realtime.own import packed as packed_own
from realtime.own import source_digest
from realtime.render import Rendering
from realtime.technique import Technique
from reference.estimator import Reference
from reference.store import Store
from reference.studio import Launch, Rendered, Studio
from scenes.checks import SettingValue
from scenes.digest import digest_of
from scenes.errors import InputError, MachineError, NoCluster
from scenes.image import Bool
from scenes.model import Scene
from scenes.parcel import packed

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_SECONDS = 10.0
"""How long a scheduler may take to answer."""

POLL_SECONDS = 0.2
"""How often a process that waits for a task says so."""

COUNT_SECONDS = 1.0
"""How often the workers are counted meanwhile."""

LARGEST_SCENE = "1GiB"
"""Dask warns of tasks beyond that size; meshes and textures make those of a scene large, and are sent only once."""


class Cluster:
    """A connection to a scheduler.

    Raises
    ------
    InputError
        Dask is not installed, or the address is none.
    NoCluster
        Nothing answers there, or it is another version of Dask.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self.client = _connected(address)
        self._pending: WeakSet[Future[Any]] = WeakSet()
        self._counted = 0.0
        self._workers = 0

    def send(self, scene: Scene) -> "Future[Any]":
        """The scene and its files, on the cluster."""
        from comparisons import cluster_tasks

        parcel = packed(scene)
        return self._begin(cluster_tasks.same, parcel.key, parcel)

    def submit(self, function: Callable[..., Any], scene: "Future[Any]", *arguments: Any, name: Any) -> "Future[Any]":
        """Begin a task of `comparisons.cluster_tasks` on a scene that was sent.

        name : JSON-able, what together with the function and the versions determines the result
        """
        from comparisons.cluster_tasks import versions

        return self._begin(function, digest_of(versions(), name), scene, versions(), *arguments)

    def _begin(self, function: Callable[..., Any], name: str, *arguments: Any) -> "Future[Any]":
        """A task that the scheduler forgets, wherever it is, when nobody holds its future any more."""
        try:
            future: Future[Any] = self.client.submit(function, *arguments, key=f"{function.__name__}-{name}")
        except Exception as error:  # the client's own: it raises plain ones when the connection is gone
            raise self._lost() from error
        self._pending.add(future)
        return future

    def result(self, future: "Future[Any]", step: Step, what: str, fraction: float) -> Any:
        """What a task gives. While it is not finished, `step` hears again and again what is awaited.

        Raises
        ------
        NoCluster
            The connection is lost, or the cluster has not the same version of lightgauge.
        MachineError
            The workers died of this task.
        Exception
            Whatever the task has raised.
        """
        from distributed import CancelledError, wait

        while True:
            try:
                with self.client.as_current():
                    wait(future, timeout=POLL_SECONDS)
                break
            except TimeoutError:
                self._tell(step, what, fraction)
            except (CancelledError, OSError) as error:
                raise self._lost() from error
        if future.status == "error":
            raise self._in_our_words(future.exception())
        try:
            return future.result()
        except (CancelledError, OSError) as error:
            raise self._lost() from error

    def close(self) -> None:
        """Let the scheduler forget all tasks of this connection."""
        self.client.close()

    def _tell(self, step: Step, what: str, fraction: float) -> None:
        try:
            step(f"{what} [{self._load()}]", fraction)
        except KeyboardInterrupt:
            self.close()
            raise

    def _load(self) -> str:
        if time.monotonic() - self._counted > COUNT_SECONDS:
            self._workers = len(self.client.nthreads())
            self._counted = time.monotonic()
        left = sum(not future.done() for future in self._pending)
        return f"{left} task{'s' * (left != 1)} left on {self._workers} worker{'s' * (self._workers != 1)}"

    def _lost(self) -> NoCluster:
        return NoCluster(
            f"The connection to the Dask scheduler at {self.address} is lost. What was rendered is kept; see that the "
            "scheduler runs, and the same command goes on from there."
        )

    def _in_our_words(self, error: BaseException) -> BaseException:
        from distributed import KilledWorker

        if isinstance(error, KilledWorker):
            return MachineError(
                f"{error.allowed_failures + 1} workers died while they had this task, the last one at "
                f"{error.last_worker.address}. Their logs tell why; most often they have too little memory."
            )
        if isinstance(error, ModuleNotFoundError) or "deserialization" in str(error):
            return NoCluster(
                f"The cluster at {self.address} cannot unpack a task of lightgauge. Its scheduler and its workers need "
                "the same version of lightgauge as this process, with the extra `dask`: install it and start them anew."
            )
        return error


class ClusterStudio(Studio):
    """Has the truth of a scene rendered by a cluster."""

    def __init__(self, scene: Scene, cluster: Cluster, progress: Step) -> None:
        super().__init__(scene, None, progress)
        self._cluster = cluster
        self._begun: dict[Launch, Future[Any]] = {}

    @cached_property
    def _sent(self) -> "Future[Any]":
        return self._cluster.send(self.scene)

    def ahead(self, launches: Iterable[Launch], mask: Bool) -> None:
        from comparisons.cluster_tasks import PackedMask, launch

        bits = PackedMask.of(mask)
        for wanted in launches:
            if wanted not in self._begun:
                self._begun[wanted] = self._cluster.submit(launch, self._sent, wanted, bits, name=asdict(wanted))

    def launch(self, launch: Launch, mask: Bool) -> Rendered:
        self.ahead([launch], mask)
        future = self._begun.pop(launch)
        rendered: Rendered = self._cluster.result(future, self.progress, launch.what, launch.fraction)
        return rendered

    def exact(self, name: str, key: str) -> Rendered:
        from comparisons.cluster_tasks import exact

        future = self._cluster.submit(exact, self._sent, name, key, name=key)
        rendered: Rendered = self._cluster.result(future, self.progress, f"{self.scene.name}: {name}", 0.0)
        return rendered


class ClusterRenderer:
    """Has the techniques drawn by a cluster."""

    def __init__(self, cluster: Cluster, scene: Scene, step: Step) -> None:
        self.scene = scene
        self._cluster = cluster
        self._step = step

    @cached_property
    def _sent(self) -> "Future[Any]":
        return self._cluster.send(self.scene)

    def render(self, technique: Technique, given: dict[str, SettingValue], timed: bool = True) -> Rendering:
        """One image of the technique, and the time that a frame takes on the worker that draws it."""
        from comparisons.cluster_tasks import draw

        arguments, own = (technique.name, given, timed), packed_own(technique.name)
        name = (self._sent.key, *arguments, source_digest(technique.name))
        future = self._cluster.submit(draw, self._sent, *arguments, own, name=name)
        what = f"{self.scene.name}: {technique.name}"
        rendering: Rendering = self._cluster.result(future, self._step, what, 0.0)
        return rendering


@cache
def connect(address: str) -> Cluster:
    """The connection of this process to the scheduler at that address."""
    cluster = Cluster(address)
    atexit.register(cluster.close)
    return cluster


def cluster_sides(address: str) -> Sides:
    """Both sides, rendered by the workers of the Dask scheduler at that address.

    Raises
    ------
    InputError, NoCluster
        See `Cluster`.
    """
    cluster = connect(address)

    def reference(scene: Scene, store: Store, step: Step) -> Reference:
        return Reference(scene, store, step, ClusterStudio(scene, cluster, step))

    return Sides(partial(ClusterRenderer, cluster), reference, lambda: {"cluster": "dask"})


def _connected(address: str) -> "Client":
    try:
        import dask
        from distributed import Client
        from distributed.versions import VersionMismatchWarning
    except ModuleNotFoundError as error:
        raise InputError(
            "--dask needs the package distributed, which is not installed. Install it with "
            "`pip install 'lightgauge[dask]'`, here and on the cluster."
        ) from error
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what goes wrong is raised, in words of our own
    dask.config.set({"distributed.admin.large-graph-warning-threshold": LARGEST_SCENE})
    try:
        asyncio.run(asyncio.wait_for(_knock(address), CONNECT_SECONDS + 1))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VersionMismatchWarning)  # said below, of what matters
            client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except (ValueError, TypeError) as error:
        raise InputError(
            f"--dask {address}: this is no address of a scheduler ({error}). Give one such as tcp://10.0.0.1:8786."
        ) from error
    except OSError as error:
        raise NoCluster(
            f"No Dask scheduler answers at {address} within {CONNECT_SECONDS:g} s. Start one with "
            "`dask scheduler`, whose first lines tell its address, and see that this machine can reach it."
        ) from error
    _require_same_dask(client)
    return client


async def _knock(address: str) -> None:
    """See that something answers: a client that cannot connect takes long to end."""
    from distributed import Security
    from distributed.comm.core import connect

    comm = await connect(address, timeout=CONNECT_SECONDS, **Security().get_connection_args("client"))
    await comm.close()


def _require_same_dask(client: "Client") -> None:
    found: Any = client.get_versions()
    ends = {"the scheduler": found["scheduler"], **{f"the worker {name}": v for name, v in found["workers"].items()}}
    ours = _of_dask(found["client"])
    for end, versions in ends.items():
        if _of_dask(versions) != ours:
            client.close()
            raise NoCluster(
                f"{end} has {_of_dask(versions)}, this process {ours}. Results would not be the same bits, if there "
                "were any. Install the same versions on all of them."
            )


def _of_dask(versions: dict[str, Any]) -> str:
    """Versions that tasks must agree on to be understood at all."""
    packages = versions["packages"]
    python = ".".join(packages["python"].split(".")[:2])
    return f"Python {python}, dask {packages['dask']}, distributed {packages['distributed']}"
