"""The machine that a benchmark runs on, and what might make its times doubtful."""

import os
import platform
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from comparisons.results import environment
from reference.start import variant

BUSY = 0.3
"""Load average for each core, at the start, from which on other programs are likely to be in the way."""


def machine() -> dict[str, Any]:
    """What decides how long things take, with the load average of the last minute."""
    return environment([]) | {
        "cpu": cpu_model(),
        "load_average": os.getloadavg()[0],
        "variant": variant(),
    }


def cpu_model() -> str:
    """The processor in the words of its maker."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, "") or platform.processor() or platform.machine()


def doubts(environment: dict[str, Any], is_software: bool) -> Iterator[str]:
    """Why times may not be what they seem.

    is_software : whether the real-time side is drawn by the processor
    """
    load, cores = environment["load_average"], environment["cpu_count"] or 1
    if load > BUSY * cores:
        yield (
            f"The machine was busy when this began (load average {load:.1f} on {cores} cores): times are too long and "
            "too scattered. Measure again when nothing else runs."
        )
    on_processor = str(environment["variant"]).startswith("llvm")
    if on_processor != is_software:
        gpu, cpu = ("the path tracer", "the techniques") if is_software else ("the techniques", "the path tracer")
        yield (
            f"A GPU ran {gpu}, the processor {cpu}: ratios of their times compare two machines. "
            "LIGHTGAUGE_VARIANT=cuda_ad_rgb has an NVIDIA GPU trace paths."
        )
    if not is_software:
        yield (
            "Frames are timed by the GPU's queries, path tracing by the wall clock: what the processor does counts for "
            "the path tracer alone, which flatters techniques that keep it busy. bench.json has frames by the wall "
            "clock too (wall_seconds)."
        )
