"""Scenes side by side, each in one of several processes that share the store.

A process keeps a scene from its first check to its last, so that the results are those of a single process. One that
dies takes its scene with it and is replaced; what it had finished is in the store.
"""

import multiprocessing
import os
import shlex
import signal
import warnings
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import TracebackType
from typing import Any

from comparisons import suite
from comparisons.request import Request
from comparisons.result import CheckResult
from comparisons.setup import Setup, sides
from comparisons.suite import STOP_ALL, Progress, run_scene, with_failures
from comparisons.times import truth_of
from reference.start import THREADS
from reference.store import Store
from scenes.errors import InputError, LightgaugeError, MachineError

GL_THREADS = "LP_NUM_THREADS"
"""The environment variable that says how many threads Mesa's software renderer may use."""


def require_jobs(jobs: int) -> None:
    """See that a number of processes is one.

    Raises
    ------
    InputError
        It is not.
    """
    if jobs < 1:
        raise InputError(f"--jobs: found {jobs}; allowed: 1 or more processes. This machine has {cores()} cores.")


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0))


def run(
    requests: Sequence[Request],
    store: Store,
    progress: Progress,
    setup: Setup,
    jobs: int = 1,
    seconds: Mapping[str, float] | None = None,
) -> list[CheckResult]:
    """As `comparisons.suite.run`, by up to `jobs` processes; by this one if there is nothing to share out.

    Parameters
    ----------
    seconds : what each scene, by its name, is thought to take; the longest ones begin first.

    Raises
    ------
    NoGraphics, NoCompiler, NoCluster, OSError
        As there.
    """
    expected = seconds or {}
    tasks = deque(
        sorted(_sharing_truth(requests), key=lambda task: -sum(expected.get(r.scene.name, 0.0) for r in task))
    )
    jobs = min(jobs, len(tasks))
    if jobs <= 1:
        return suite.run(requests, store, progress, sides(setup))
    _ = store.in_use_since  # what the processes use stays in the store until this one has written its report
    with _Crew(store, progress, setup, max(1, cores() // jobs)) as crew:
        while tasks or crew.busy:
            while tasks and len(crew.busy) < jobs:
                crew.begin(tasks.popleft())
            for worker in crew.heard():
                tasks.extendleft(crew.hear(worker))
    return [result for request in requests for result in crew.results[request.scene.name]]


def _sharing_truth(requests: Iterable[Request]) -> list[list[Request]]:
    """Scenes that have their truth in common are run one after the other: the later ones show all of its samples."""
    tasks: dict[str, list[Request]] = {}
    for request in requests:
        try:
            key = truth_of(request.scene)
        except LightgaugeError:  # its checks will say so
            key = request.scene.name
        tasks.setdefault(key, []).append(request)
    return list(tasks.values())


@dataclass
class _Worker:
    """A process, the scenes that it is to run, the first one now, and its results of that one so far."""

    process: BaseProcess
    connection: Connection
    task: deque[Request] = field(default_factory=deque)
    finished: dict[str, CheckResult] = field(default_factory=dict)

    def begin(self) -> None:
        self.finished.clear()
        if self.task:
            with suppress(OSError):  # it has died already, as reading from it will show
                self.connection.send(self.task[0])


class _Crew(AbstractContextManager["_Crew"]):
    """The processes of a run. At the end of the block all of them stop, between two steps of their work."""

    def __init__(self, store: Store, progress: Progress, setup: Setup, threads: int) -> None:
        self.results: dict[str, list[CheckResult]] = {}
        self._workers: list[_Worker] = []
        self._store = store
        self._progress = progress
        self._arguments = (store.root, setup, threads)

    @property
    def busy(self) -> list[_Worker]:
        return [worker for worker in self._workers if worker.task]

    def begin(self, task: Iterable[Request]) -> None:
        """Give scenes to a process that has none, or to a new one."""
        idle = [worker for worker in self._workers if not worker.task]
        worker = idle[0] if idle else self._started()
        worker.task.extend(task)
        worker.begin()

    def heard(self) -> list[_Worker]:
        """The processes that have something to tell, once there are any."""
        ready = wait([worker.connection for worker in self.busy])
        return [worker for worker in self.busy if worker.connection in ready]

    def hear(self, worker: _Worker) -> list[list[Request]]:
        """Take in what a process tells; what it leaves undone when it has died is for another one."""
        try:
            what, *told = worker.connection.recv()
        except (EOFError, OSError):
            return self._buried(worker)
        if what == "step":
            self._progress.step(*told)
        elif what == "took":
            self._progress.took(*told)
        elif what == "finished":
            (result,) = told
            worker.finished[result.id] = result
            self._progress.finished(result)
        elif what == "done":
            results, notes = told
            self.results[worker.task.popleft().scene.name] = results
            self._store.notes.extend(notes)
            worker.begin()
        else:
            (error,) = told
            raise error
        return []

    def _started(self) -> _Worker:
        processes = multiprocessing.get_context("spawn")
        ours, theirs = processes.Pipe()
        process = processes.Process(target=_work, args=(theirs, *self._arguments), daemon=True)
        with _deaf():
            process.start()
        theirs.close()
        self._workers.append(_Worker(process, ours))
        return self._workers[-1]

    def _buried(self, worker: _Worker) -> list[list[Request]]:
        """Make the checks that a dead process has not finished errors."""
        worker.process.join()
        worker.connection.close()
        self._workers.remove(worker)
        request, *rest = worker.task
        message = _death(worker.process.exitcode or 0, request.argument)
        self.results[request.scene.name] = with_failures(
            request, worker.finished, message, MachineError.exit_status, self._progress.finished
        )
        return [rest] if rest else []

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for worker in self._workers:
            worker.connection.close()
        try:
            for worker in self._workers:
                worker.process.join()
        finally:  # a second interruption waits for none of them
            for worker in self._workers:
                worker.process.kill()


def _death(status: int, argument: str) -> str:
    how = f"was killed by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
    why = " Most often the system had too little memory: try fewer --jobs." if status == -signal.SIGKILL else ""
    return (
        f"The process that ran this scene {how}; the other scenes went on.{why} What it had finished is kept. Run it "
        f"alone to see more: lightgauge run {shlex.quote(argument)}"
    )


@contextmanager
def _deaf() -> Iterator[None]:
    """Let a process that is started within the block be deaf to Ctrl-C from its first moment on, and this one later."""
    resource_tracker.ensure_running()  # else it is started, and the signal unblocked, within the block
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _work(connection: Connection, root: Path, setup: Setup, threads: int) -> None:
    """The life of a process: run one scene after the other until the other end of the connection is closed."""
    for variable in (THREADS, GL_THREADS):
        os.environ.setdefault(variable, str(threads))
    warnings.filterwarnings("ignore", module="colour")

    def tell(*message: Any) -> None:
        try:
            connection.send(message)
        except OSError as error:  # nobody listens any more
            raise KeyboardInterrupt from error

    def step(what: str, fraction: float) -> None:
        tell("step", what, fraction)

    progress = Progress(
        step, lambda result: tell("finished", result), lambda name, seconds: tell("took", name, seconds)
    )
    store = Store(root, waiting=step)
    with suppress(EOFError, KeyboardInterrupt):
        try:
            rendered_by = sides(setup)
            while True:
                results = run_scene(connection.recv(), store, progress, rendered_by)
                tell("done", results, list(store.notes))
                store.notes.clear()
        except (LightgaugeError, *STOP_ALL) as error:
            tell("stopped", error)
