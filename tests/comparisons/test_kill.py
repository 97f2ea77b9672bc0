"""kill -9 at any moment of a run: the next one goes on, and comes to the same results."""

import json
import random
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from reference.store import Store
from reference.upkeep import evict
from scenes.exr import read_exr

Run = Callable[..., Any]
Write = Callable[..., Path]

KILLS = 50
TRUTH_OF_2048_SPP = "import comparisons.suite; comparisons.suite.FIRST_SPP = 1 << 11"


def results_of(folder: Path) -> list[dict[str, Any]]:
    """The checks of a run without saying whether, and how fast, they were rendered this time."""
    checks = json.loads((folder / "results.json").read_text(encoding="utf-8"))["checks"]
    timing = dict.fromkeys(("cached", "seconds", "pass_seconds", "baked_seconds"))
    return [check | timing for check in checks]


def images_of(store: Path) -> dict[Path, int]:
    """Every image of a store, which must be whole, and when it was written."""
    paths = sorted(store.rglob("*.exr"))
    assert all(read_exr(path).provenance for path in paths)
    return {path: path.stat().st_mtime_ns for path in paths}


@pytest.mark.slow
def test_a_run_that_is_killed_fifty_times_ends_like_one_that_was_not(
    here: Path, start: Run, lightgauge_apart: Run, write_scene: Write
) -> None:
    write_scene()
    undisturbed, killed = here / "undisturbed", here / "killed"

    def arguments(folder: Path) -> tuple[str, ...]:
        return ("run", "tiny.toml", "--store", f"{folder}/store", "-o", f"{folder}/report")

    clock = time.monotonic()
    assert lightgauge_apart(*arguments(undisturbed), before=TRUTH_OF_2048_SPP).status == 0
    duration = time.monotonic() - clock
    moments, kept, kills = random.Random(1), dict[Path, int](), 0
    streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    while kills < KILLS:
        clock = time.monotonic()
        process = start(*arguments(killed), before=TRUTH_OF_2048_SPP, **streams)
        try:
            process.wait(timeout=moments.uniform(0.0, duration))
            duration = time.monotonic() - clock  # the more is stored, the less there is to do
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            kills += 1
        before, kept = kept, images_of(killed / "store")
        assert kept.items() >= before.items(), "an image was lost or written twice"

    assert lightgauge_apart(*arguments(killed), before=TRUTH_OF_2048_SPP).status == 0
    assert images_of(killed / "store").items() >= kept.items()
    assert results_of(killed / "report") == results_of(undisturbed / "report")
    blocks, expected = (
        sorted(path.relative_to(folder) for path in (folder / "store").rglob("*.exr"))
        for folder in (killed, undisturbed)
    )
    assert blocks == expected
    evict(Store(killed / "store"), 1 << 40)
    assert not [path for path in (killed / "store").rglob("*") if path.name.startswith(".")]
    assert not list((killed / "store" / "runs").iterdir())
