"""Which checks of which scenes are run, and what becomes of scenes that cannot be."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.expression import keep_of
from comparisons.selection import Selection, choose, names_of, select
from comparisons.shards import Shard
from scenes.errors import InputError

Run = Callable[..., Any]
Write = Callable[..., Path]

WRONG_SHAPE = ("radius = 0.3", "radius = -0.3")
WRONG_TECHNIQUE = ('"indirect.irradiance"', '"indirect.irradiation"')
LIBRARY = 46
SHARDS = 5


def names(chosen: Selection) -> list[str]:
    return [request.scene.name for request in chosen.requests]


def checks(chosen: Selection) -> list[str]:
    return [check.technique for request in chosen.requests for check in request.checks]


def test_a_word_may_be_found_in_the_effect_and_in_the_quantity_of_a_check() -> None:
    called = names_of("small-room-knot/indirect.probe", "indirect_radiance")
    assert all(keep_of(word)(called) for word in ("knot/ind", "indirect_radiance", "indirect and light"))
    assert not keep_of("depth")(called)


def test_an_expression_chooses_checks_and_parity_comes_along(write_scene: Write) -> None:
    write_scene()
    assert checks(choose(["tiny.toml"], "irradiance")) == checks(choose(["tiny.toml"]))
    assert checks(choose(["tiny.toml"], "not irradiance"))[-1] == "raster.albedo"
    assert choose(["tiny.toml"], "IRRADIANCE or nothing").keep == "IRRADIANCE or nothing"


@pytest.mark.parametrize("keep", ["glossy", "tiny and not tiny"])
def test_a_choice_of_no_check_is_refused(write_scene: Write, keep: str) -> None:
    write_scene()
    with pytest.raises(InputError, match=rf"No check of tiny\.toml matches '{keep}'"):
        choose(["tiny.toml"], keep)


@pytest.mark.parametrize(
    ("change", "said"),
    [(WRONG_SHAPE, "tiny2.toml:27: shapes[1].radius: found -0.3"), (WRONG_TECHNIQUE, "Unknown technique")],
)
def test_a_scene_that_cannot_be_run_stops_no_other(write_scene: Write, change: tuple[str, str], said: str) -> None:
    write_scene(name="tiny")
    write_scene(change, name="tiny2")
    write_scene(name="tiny3")
    chosen = choose(["tiny3.toml", "gone.toml", "tiny2.toml", "tiny.toml"])
    assert names(chosen) == ["tiny3", "tiny"]
    assert [broken.argument for broken in chosen.broken] == ["gone.toml", "tiny2.toml"]
    assert "gone.toml: the scene cannot be read" in chosen.broken[0].message
    assert said in chosen.broken[1].message
    assert chosen.scenes == ("tiny3", "gone", "tiny2", "tiny")
    with pytest.raises(InputError, match=r"gone\.toml"):
        select(["tiny.toml", "gone.toml"], "")


def test_if_every_scene_is_broken_all_is_said_and_nothing_is_run(write_scene: Write) -> None:
    write_scene(WRONG_SHAPE)
    with pytest.raises(InputError, match=r"(?s)tiny\.toml:27.*gone\.toml: the scene cannot be read"):
        choose(["tiny.toml", "gone.toml"])


def test_checks_that_are_not_chosen_break_nothing(write_scene: Write) -> None:
    write_scene(WRONG_TECHNIQUE)
    assert names(choose(["tiny.toml"], "depth")) == ["tiny"]


def test_the_second_scene_of_a_name_is_broken(here: Path, write_scene: Write) -> None:
    path = write_scene()
    (here / "deep").mkdir()
    (here / "deep" / "tiny.toml").write_text(path.read_text(), encoding="utf-8")
    chosen = choose(["deep/tiny.toml", "tiny.toml"])
    assert [request.argument for request in chosen.requests] == ["deep/tiny.toml"]
    (broken,) = chosen.broken
    assert broken.argument == "tiny.toml"
    assert "deep/tiny.toml has the same name" in broken.message
    assert chosen.scenes == ("tiny",)


def test_accepted_errors_that_cannot_be_read_break_the_scenes_beside_them_alone(here: Path, write_scene: Write) -> None:
    path = write_scene()
    (here / "deep").mkdir()
    (here / "deep" / "other.toml").write_text(path.read_text(), encoding="utf-8")
    (here / "deep" / "accepted.json").write_text("[]", encoding="utf-8")
    chosen = choose(["."])
    assert names(chosen) == ["tiny"]
    assert [broken.argument for broken in chosen.broken] == ["deep/other.toml"]
    assert "accepted.json" in chosen.broken[0].message


def test_a_run_says_at_once_and_at_the_end_what_is_broken(
    after_a_run: Path, lightgauge: Run, write_scene: Write
) -> None:
    write_scene(WRONG_SHAPE, name="wrong")
    (after_a_run / "settings.toml").write_text("[tool]", encoding="utf-8")
    outcome = lightgauge("run", ".")
    assert outcome.status == 3
    lines = outcome.out.splitlines()
    assert lines[0] == "passed over, since they hold no scene: settings.toml"
    assert lines[1] == "BROKEN wrong.toml"
    assert lines.count("BROKEN wrong.toml") == 2
    assert "5 PASS, 1 broken scene in" in lines[-1]


def test_every_scene_is_in_one_shard_and_in_its_order() -> None:
    whole = choose([])
    shards = [choose([], shard=Shard(index, SHARDS)) for index in range(1, SHARDS + 1)]
    assert len(whole.requests) >= LIBRARY
    assert sorted(name for shard in shards for name in names(shard)) == sorted(names(whole))
    assert all(names(shard) == [name for name in names(whole) if name in names(shard)] for shard in shards)
    assert all(shard.scenes == whole.scenes for shard in shards)
    largest = max(len(request.checks) for request in whole.requests)
    counts = [shard.checks for shard in shards]
    assert max(counts) - min(counts) <= largest


def test_broken_scenes_are_shared_out_too(write_scene: Write) -> None:
    write_scene()
    write_scene(WRONG_SHAPE, name="wrong")
    shards = [choose(["tiny.toml", "wrong.toml"], shard=Shard(index, 2)) for index in (1, 2)]
    assert sorted(len(shard.requests) for shard in shards) == [0, 1]
    assert sorted(len(shard.broken) for shard in shards) == [0, 1]
    assert {len(shard.requests) + len(shard.broken) for shard in shards} == {1}


def test_more_shards_than_scenes_are_refused(write_scene: Write) -> None:
    write_scene()
    with pytest.raises(InputError, match="found 1 scene to share out"):
        choose(["tiny.toml"], shard=Shard(1, 2))
