"""Rendering in a process of its own, which may die without taking this one with it.

Mitsuba's curves crashed about one launch in twenty until the cause was found and cured (`reference.curves`). Should
there be another, it costs one launch: that depends on nothing but the scene and its own arguments, and is begun again
by another process.
"""

import atexit
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.errors import RenderError
from scenes.image import Float64
from scenes.model import Scene

ATTEMPTS = 4
"""Times that a launch is begun before it is given up."""

SECONDS_TO_END = 5.0
"""What a process gets that has closed its end of a pipe, or said what is no answer, before it is killed."""

PATHS_AT_ONCE = 1 << 19
"""Paths of one launch among hair: what is lost with a crash is begun again."""

SERVE = "from reference.worker import serve; serve()"

Means = Callable[[Scene, NDArray[np.int64], int, int, float | None], Float64]
"""A function of a module: (scene, pixels (P,), 32-bit seed, spp, clamp) -> (P, C), as `reference.quantity.BlockRender`
but for the stage, which it has to build where it runs.
"""


class Worker:
    """A process that calls functions, one after the other; it is started when it is needed, and anew when it died."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def process(self) -> "subprocess.Popen[bytes]":
        """A process that runs, as far as is known."""
        if self._process is None or self._process.poll() is not None:
            self.close()
            self._process = subprocess.Popen(
                [sys.executable, "-c", SERVE],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            )
        return self._process

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a function of a module returns there.

        Raises
        ------
        RenderError
            The process was killed every time, or cannot run at all.
        Exception
            Whatever the function raised.
        """
        deaths: list[int] = []
        while len(deaths) < ATTEMPTS:
            process = self.process
            assert process.stdin is not None
            assert process.stdout is not None
            try:
                pickle.dump((function, arguments), process.stdin)
                process.stdin.flush()
                answer = pickle.load(process.stdout)
            except (EOFError, OSError, pickle.UnpicklingError):
                deaths.append(_ended(process))
                if deaths[-1] > 0:
                    raise RenderError(
                        f"The process that renders hair ended with exit status {deaths[-1]} before it answered; it "
                        "should serve until it is asked no more. What it said stands above."
                    ) from None
                continue
            except BaseException:  # an answer that comes too late must not be taken for that to the next call
                self.close()
                raise
            if isinstance(answer, Exception):
                raise answer
            return answer
        raise RenderError(
            f"Mitsuba crashed {ATTEMPTS} times in a row (exit status {', '.join(map(str, deaths))}) on the same launch "
            "of samples, each time in a new process; any other outcome was wanted. Run it again, and if that does not "
            "help, make the image smaller or the hairs fewer."
        )

    def close(self) -> None:
        """End the process."""
        if self._process is None:
            return
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except BrokenPipeError:
                    continue
        self._process = None


def _ended(process: "subprocess.Popen[bytes]") -> int:
    """The exit status of a process that ends by itself, or else is killed."""
    try:
        return process.wait(SECONDS_TO_END)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def serve() -> None:
    """Answer calls from the standard input until it ends. What libraries print goes where errors go."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    while True:
        try:
            function, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer = function(*arguments)
        except Exception as error:  # noqa: BLE001 - whoever called the function is told, in the other process
            answer = error
        pickle.dump(answer, answers)
        answers.flush()


@cache
def worker() -> Worker:
    """The one that renders hair for this process."""
    made = Worker()
    atexit.register(made.close)
    return made


def means_elsewhere(
    means: Means, scene: Scene, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None
) -> Float64:
    """What `means` returns, rendered by the worker in launches small enough to be lost without pity."""
    parts = np.array_split(pixels, -(-len(pixels) * spp // PATHS_AT_ONCE))
    seeds = np.random.SeedSequence(seed).generate_state(len(parts))
    rows = [worker().call(means, scene, part, int(own), spp, clamp) for part, own in zip(parts, seeds, strict=True)]
    return np.concatenate(rows)
