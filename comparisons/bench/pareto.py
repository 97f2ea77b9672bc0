"""Which points are worth having: nothing else is both quicker and closer to the truth."""

from collections import defaultdict
from collections.abc import Sequence

from comparisons.bench.result import Point


def group_of(point: Point) -> tuple[str, str, str, int, int]:
    """What points must share to be compared: scene, quantity, metric and resolution."""
    return point.scene, point.quantity, point.metric, point.width, point.height


def on_front(points: Sequence[Point]) -> tuple[bool, ...]:
    """For each point whether it is on the Pareto front of its group: no other one dominates it.

    One point dominates another if its frame is quicker and its error less, both by value and neither of them worse.
    Intervals are not asked: where two of them overlap, the order may be chance, and the front is that of this run.
    Points that were multiplied by a fitted factor compete too: that factor is a choice of brightness.
    """
    groups: dict[tuple[str, str, str, int, int], list[Point]] = defaultdict(list)
    for point in points:
        groups[group_of(point)].append(point)
    return tuple(not any(_dominates(other, point) for other in groups[group_of(point)]) for point in points)


def _dominates(one: Point, other: Point) -> bool:
    ours, theirs = ((p.cost.seconds.value, p.error.value) for p in (one, other))
    return ours != theirs and ours[0] <= theirs[0] and ours[1] <= theirs[1]
