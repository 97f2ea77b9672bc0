"""Processes that are killed at any moment, and processes that want the same images at once.

The tests run this file as a program, whose process has imported little and can be forked quickly and safely.
"""

import fcntl
import hashlib
import itertools
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from reference.store import Shelf, Store, write_text
from reference.upkeep import evict
from scenes.exr import read_exr
from scenes.image import Image

ROOT = Path(__file__).parents[2]
ROUNDS = 50
ROUNDS_A_SHELF = 10
LONGEST_LIFE_SECONDS = 0.05
PROCESSES = 4
BLOCKS = 24
TEXT = json.dumps(list(range(5_000)))


def block(shelf: int, index: int) -> Image:
    """The only right content of a block."""
    pixels = np.random.default_rng([shelf, index]).random((8, 40, 3), dtype=np.float32)
    return Image(pixels, {"shelf": shelf, "index": index})


def shelf_of(root: Path, number: int) -> Shelf:
    return Store(root).shelf({"shelf": number})


def blocks_of(shelf: Shelf, number: int) -> set[int]:
    """The blocks that are there, each of which must be whole and the one that its name says."""
    found = set()
    for path in shelf.folder.glob("*.exr"):
        image, index = read_exr(path), int(path.stem.removeprefix("block-"))
        assert image.provenance == {"shelf": number, "index": index}
        assert (image.pixels == block(number, index).pixels).all()
        found.add(index)
    return found


def want(shelf: Shelf, number: int, index: int, log: Path) -> Image:
    """A block, from the store or rendered; a rendering is logged when it begins, a block when it is there."""

    def render() -> Image:
        write(log, f"rendered {index}\n")
        return block(number, index)

    image = shelf.image(f"block-{index:03d}", render)
    write(log, f"got {index}\n")
    return image


def write(log: Path, line: str) -> None:
    """Append a line at once: of several processes none writes into another's line."""
    handle = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(handle, line.encode())
    os.close(handle)


def logged(log: Path, event: str) -> list[int]:
    lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
    return [int(line.split()[1]) for line in lines if line.startswith(event)]


def forked(work: Callable[[], None]) -> int:
    """The number of a child process that does `work` and ends."""
    child = os.fork()
    if child == 0:
        try:
            work()
            os._exit(0)
        except BaseException as error:  # noqa: BLE001  # nothing of the parent's may run here
            os.write(2, f"{type(error).__name__}: {error}\n".encode())
        finally:
            os._exit(1)
    return child


def require_unlocked(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.close(handle)


def kill_writers(folder: Path) -> dict[str, int]:
    """Kill a process that writes blocks as fast as it can, again and again, and look each time at what it left."""
    root, moments, left_behind, lost = folder / "store", random.Random(1), 0, 0
    for number, turn in itertools.product(range(ROUNDS // ROUNDS_A_SHELF), range(ROUNDS_A_SHELF)):
        shelf, log = shelf_of(root, number), folder / f"log-{number}-{turn}"
        before = blocks_of(shelf, number)

        def write_on(number: int = number, log: Path = log) -> None:
            mine = shelf_of(root, number)
            for index in itertools.count():
                want(mine, number, index, log)
                write_text(mine.folder / "check.json", TEXT)

        child = forked(write_on)
        time.sleep(moments.uniform(0.0, LONGEST_LIFE_SECONDS))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        assert os.WTERMSIG(status) == signal.SIGKILL
        after, rendered = blocks_of(shelf, number), logged(log, "rendered")
        assert after == set(range(len(after)))
        assert after >= before
        assert after >= set(logged(log, "got"))
        assert rendered == list(range(len(before), len(before) + len(rendered)))
        assert len(before) + len(rendered) - len(after) in (0, 1)
        texts = [path.read_text(encoding="utf-8") for path in shelf.folder.glob("check.json")]
        assert texts in ([], [TEXT])
        require_unlocked(shelf.folder)
        lost += len(before) + len(rendered) - len(after)
        left_behind += len(list(shelf.folder.glob(".*")))
    return {"blocks": len(list(root.rglob("*.exr"))), "left_behind": left_behind, "lost": lost}


def share_blocks(folder: Path) -> None:
    """Let several processes ask for the same blocks at once, each in an order of its own, while another one evicts."""
    root, (gate, opened) = folder / "store", os.pipe()

    def evict_forever() -> None:
        os.close(opened)
        while True:
            evict(Store(root), 0)
            time.sleep(0.002)

    def ask(seed: int) -> None:
        os.close(opened)
        order = random.Random(seed).sample(range(BLOCKS), BLOCKS)
        shelf, digests = shelf_of(root, 0), {}
        write(folder / "ready", f"ready {seed}\n")
        os.read(gate, 1)  # until the parent closes the other end
        for index in order:
            digests[index] = hashlib.sha256(want(shelf, 0, index, folder / "log").pixels.tobytes()).hexdigest()
        (folder / f"read-{seed}.json").write_text(json.dumps([digests[index] for index in range(BLOCKS)]))

    children = [forked(lambda seed=seed: ask(seed)) for seed in range(PROCESSES)]  # type: ignore[misc]
    evicting = forked(evict_forever)
    while len(logged(folder / "ready", "ready")) < PROCESSES:
        time.sleep(0.01)
    os.close(opened)
    statuses = [os.waitpid(child, 0)[1] for child in children]
    os.kill(evicting, signal.SIGKILL)
    assert statuses == [0] * PROCESSES


def run(what: str, folder: Path) -> Any:
    """What one of the functions above returns, called in a process of its own."""
    command = [sys.executable, __file__, what, str(folder)]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    outcome = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert outcome.returncode == 0, outcome.stderr
    return json.loads(outcome.stdout)


def test_a_writer_may_be_killed_at_any_moment(tmp_path: Path) -> None:
    found = run("kill_writers", tmp_path)
    assert found["blocks"] > 10, "the writers hardly ran"
    assert found["lost"] + found["left_behind"] > 0, "none was killed while it wrote"

    for number in range(ROUNDS // ROUNDS_A_SHELF):
        require_only_missing_rendered(tmp_path, number)
    evict(Store(tmp_path / "store"), 1 << 40)
    assert not list((tmp_path / "store").rglob(".*"))
    assert not list((tmp_path / "store" / "runs").iterdir())


def require_only_missing_rendered(folder: Path, number: int) -> None:
    """A later run renders the block that is missing, no other, and sweeps."""
    shelf, log = shelf_of(folder / "store", number), folder / f"last-{number}"
    count = len(blocks_of(shelf, number))
    for index in range(count + 1):
        want(shelf, number, index, log)
    assert logged(log, "rendered") == [count]
    assert not list(shelf.folder.glob(".*"))


def test_of_several_processes_that_want_the_same_blocks_each_block_is_rendered_by_one(tmp_path: Path) -> None:
    run("share_blocks", tmp_path)
    assert sorted(logged(tmp_path / "log", "rendered")) == list(range(BLOCKS))
    assert len(logged(tmp_path / "log", "got")) == PROCESSES * BLOCKS
    right = [hashlib.sha256(block(0, index).pixels.tobytes()).hexdigest() for index in range(BLOCKS)]
    for seed in range(PROCESSES):
        assert json.loads((tmp_path / f"read-{seed}.json").read_text()) == right


if __name__ == "__main__":
    import OpenEXR  # noqa: F401  # else every child would spend its short life on that

    json.dump({"kill_writers": kill_writers, "share_blocks": share_blocks}[sys.argv[1]](Path(sys.argv[2])), sys.stdout)
