"""Parts of a run, for several machines."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from scenes.errors import InputError


@dataclass(frozen=True)
class Shard:
    """Part `index` of `count`, counted from 1."""

    index: int
    count: int

    def __str__(self) -> str:
        return f"{self.index}/{self.count}"


def parse_shard(text: str) -> Shard:
    """The shard that a text like 2/5 means.

    Raises
    ------
    InputError
        It means none.
    """
    found = re.fullmatch(r"(\d+)/(\d+)", text)
    if found:
        shard = Shard(int(found[1]), int(found[2]))
        if 1 <= shard.index <= shard.count:
            return shard
    raise InputError(f"--shard: found '{text}'; allowed: I/N with I from 1 to N, such as 2/5 for the second of five.")


def deal(weights: Mapping[str, int], count: int) -> dict[str, int]:
    """The shard, from 1 to `count`, of each scene, given how many checks it has.

    The largest scene first, by name among equals, each goes to the shard with the fewest checks so far: a greedy
    schedule, at most 4/3 of the best one (Graham 1969). It depends on nothing else, so every machine deals alike.

    >>> deal({"knot": 9, "ball": 5, "slab": 5, "ear": 2}, 2)
    {'knot': 1, 'ball': 2, 'slab': 2, 'ear': 1}
    """
    loads = dict.fromkeys(range(1, count + 1), 0)
    dealt = {}
    for name in sorted(weights, key=lambda name: (-weights[name], name)):
        lightest = min(loads, key=lambda index: loads[index])
        loads[lightest] += weights[name]
        dealt[name] = lightest
    return dealt
