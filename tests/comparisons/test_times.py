"""How long checks took, remembered beside the truth."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.cache import CheckCache
from comparisons.request import request_of
from comparisons.times import FILE_NAME, Work, read_times, remember, truth_of, work_of
from reference.store import Store
from reference.upkeep import evict
from scenes.load import load_scene

Run = Callable[..., Any]
Write = Callable[..., Path]

JUDGED = "tiny/indirect.irradiance[side=24]"


def work(store: Path) -> set[Work]:
    request = request_of(load_scene(Path("tiny.toml")), "tiny.toml")
    return set(work_of([request], CheckCache(Store(store))).values())


def test_work_is_what_the_store_does_not_hold(after_a_run: Path) -> None:
    assert work(Path(".lightgauge")) == {Work.NOTHING}
    for verdict in after_a_run.rglob("check.json"):
        verdict.unlink()
    assert work(Path(".lightgauge")) == {Work.JUDGE}
    assert work(Path("empty")) == {Work.RENDER_AND_JUDGE}
    assert not Path("empty").exists(), "to look for something makes nothing"


def test_a_run_remembers_what_it_took_and_forgets_nothing(after_a_run: Path, lightgauge: Run) -> None:
    store = Store(after_a_run / ".lightgauge")
    first = read_times(store)
    assert set(first[JUDGED]) == {Work.RENDER_AND_JUDGE}
    assert first[JUDGED][Work.RENDER_AND_JUDGE] > 0
    assert len(first) == 5
    lightgauge("run", "tiny.toml")
    assert read_times(store) == first, "what is found in the store takes no time worth knowing"
    for verdict in after_a_run.rglob("check.json"):
        verdict.unlink()
    lightgauge("run", "tiny.toml", "-k", "depth")
    later = read_times(store)
    assert later["tiny/raster.depth"].keys() == {Work.RENDER_AND_JUDGE, Work.JUDGE}
    assert later[JUDGED] == first[JUDGED]


def test_times_outlive_the_truth(after_a_run: Path) -> None:
    store = Store(after_a_run / ".lightgauge")
    before = read_times(store)
    evict(store, 0)
    assert not list(store.root.rglob("*.exr"))
    assert read_times(store) == before


@pytest.mark.parametrize("text", ["", "[]", "{", '{"a": 3}', '{"a": {"judge": "x"}}', '{"a": {"judge": null}}'])
def test_a_damaged_file_is_as_none_and_is_written_anew(here: Path, text: str) -> None:
    store = Store(here)
    (here / FILE_NAME).write_text(text, encoding="utf-8")
    assert read_times(store) == {}
    remember(store, {"a/talk": {Work.JUDGE: 2.0}})
    assert read_times(store) == {"a/talk": {Work.JUDGE: 2.0}}


def test_newer_times_take_the_place_of_older_ones_of_the_same_work(here: Path) -> None:
    store = Store(here)
    assert read_times(store) == {}
    remember(store, {"a/talk": {Work.JUDGE: 2.0, Work.RENDER_AND_JUDGE: 9.0}, "b/talk": {Work.JUDGE: 1.0}})
    remember(store, {"a/talk": {Work.JUDGE: 3.0}})
    assert read_times(store) == {"a/talk": {Work.JUDGE: 3.0, Work.RENDER_AND_JUDGE: 9.0}, "b/talk": {Work.JUDGE: 1.0}}
    assert [path.name for path in here.iterdir()] == [FILE_NAME]


def test_scenes_share_their_truth_if_only_checks_and_budgets_differ(write_scene: Write) -> None:
    tiny = truth_of(load_scene(write_scene()))
    assert truth_of(load_scene(write_scene(("max = 0.5", "max = 0.4"), name="other"))) == tiny
    assert truth_of(load_scene(write_scene(("radius = 0.3", "radius = 0.2"), name="smaller"))) != tiny
