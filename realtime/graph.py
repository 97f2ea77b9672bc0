"""The passes of a technique, and the plan: which of them run, which are skipped, and why."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Pass:
    """One step of a frame.

    `reads` must be written by an earlier pass that runs; `uses` may be absent. A pass with a reason in `skip` does not
    run. What one that `is_baked` writes stays as it is while only camera and lights move: an engine makes it once.
    """

    name: str
    run: Callable[[Any], None]
    writes: tuple[str, ...]
    reads: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    skip: str = ""
    is_baked: bool = False


@dataclass(frozen=True)
class Skip:
    what: str
    why: str


@dataclass(frozen=True)
class Plan:
    """Passes in the order in which they run, and the others with the reason for leaving them out."""

    passes: tuple[Pass, ...]
    skipped: tuple[Skip, ...]


def plan(passes: Sequence[Pass], wanted: str, without: Collection[str] = ()) -> Plan:
    """Keep what `wanted` needs, less the passes whose names are in `without`.

    Raises
    ------
    ValueError
        A pass that runs reads something that no earlier running pass writes.
    """
    needed = {wanted}
    kept: list[Pass] = []
    skipped: list[Skip] = []
    for step in reversed(passes):
        if step.name in without:
            skipped.append(Skip(step.name, "switched off"))
        elif step.skip:
            skipped.append(Skip(step.name, step.skip))
        elif needed.isdisjoint(step.writes):
            skipped.append(Skip(step.name, f"nothing reads {' or '.join(step.writes)}"))
        else:
            kept.append(step)
            needed.update(step.reads, step.uses)
    ordered = tuple(reversed(kept))
    _check(ordered, wanted)
    return Plan(ordered, tuple(reversed(skipped)))


def _check(passes: Sequence[Pass], wanted: str) -> None:
    written: set[str] = set()
    for step in passes:
        for name in step.reads:
            if name not in written:
                raise ValueError(f"pass '{step.name}' reads '{name}', which no earlier pass of this plan writes")
        written.update(step.writes)
    if wanted not in written:
        raise ValueError(f"no pass of this plan writes '{wanted}'")
