"""Dealing scenes to machines."""

import random

import pytest

from comparisons.shards import Shard, deal, parse_shard
from scenes.errors import InputError


def test_a_shard_is_written_as_part_of_a_number() -> None:
    assert parse_shard("2/5") == Shard(2, 5)
    assert str(Shard(2, 5)) == "2/5"


@pytest.mark.parametrize("text", ["", "2", "0/5", "6/5", "1/0", "-1/5", "a/b", "1/5/2", " 1/5"])
def test_what_is_no_shard_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="allowed: I/N with I from 1 to N"):
        parse_shard(text)


@pytest.mark.parametrize("count", [1, 2, 3, 7, 20])
def test_scenes_are_dealt_evenly_and_alike_whatever_their_order(count: int) -> None:
    weights = {f"scene-{index}": 1 + index * index % 17 for index in range(20)}
    dealt = deal(weights, count)
    shuffled = list(weights.items())
    random.Random(1).shuffle(shuffled)
    assert deal(dict(shuffled), count) == dealt
    loads = [sum(weights[name] for name in weights if dealt[name] == index) for index in range(1, count + 1)]
    assert min(loads) > 0
    assert max(loads) - min(loads) <= max(weights.values())
