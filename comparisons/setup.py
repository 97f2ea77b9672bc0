"""What a process needs to run checks, besides the request: the same for each process of a run."""

from dataclasses import dataclass
from pathlib import Path

from comparisons.runner import Sides
from realtime.own import load_own
from reference.start import variant


@dataclass(frozen=True)
class Setup:
    """How a run is set up; it can be sent to another process.

    techniques : files of the user's own techniques
    dask : address of the Dask scheduler that renders, or nothing for this machine
    """

    techniques: tuple[Path, ...] = ()
    dask: str = ""


def sides(setup: Setup) -> Sides:
    """Where drawings and truths come from in this process; own techniques are known from here on.

    Raises
    ------
    InputError
        A technique's file is faulty, or the environment asks for a variant of Mitsuba that is not allowed.
    """
    variant()
    for path in setup.techniques:
        load_own(path)
    if setup.dask:
        from comparisons.cluster import cluster_sides

        return cluster_sides(setup.dask)
    return Sides()
