import errno
import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference.store import Shelf, Store, write_text
from reference.upkeep import Record, evict, inventory, merge, tidy
from scenes.errors import ImageError, InputError
from scenes.exr import read_exr, write_exr
from scenes.image import Image

ROOT = Path(__file__).parents[2]

IMAGE = Image(np.arange(24, dtype=np.float32).reshape(2, 4, 3), {"seconds": 1.5, "key": "k"})
OTHER = Image(np.ones((2, 4, 3), dtype=np.float32), {"seconds": 9.0})


def refuse() -> Image:
    raise AssertionError("an image was rendered")


def interrupt() -> Image:
    raise KeyboardInterrupt


def image_of(spp: int, scene: str = "room") -> Image:
    return Image(np.full((2, 3, 3), spp, dtype=np.float32), {"scene": scene, "spp": spp})


@contextmanager
def locked(shelf: Shelf) -> Iterator[None]:
    """As if another process were rendering into the shelf: its lock belongs to what was opened, not to who opened."""
    handle = os.open(shelf.folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


@contextmanager
def process(code: str, *arguments: object) -> Iterator["subprocess.Popen[str]"]:
    """A process that runs `code`, says that it is done, and goes on living until it is killed."""
    program = f"import sys\n{code}\nprint(flush=True)\nsys.stdin.read()"
    command = [sys.executable, "-c", program, *map(str, arguments)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, env=environment, stdin=-1, stdout=-1, text=True) as started:
        assert started.stdout is not None
        assert started.stdout.readline() == "\n"
        yield started
        kill(started)


def kill(started: "subprocess.Popen[str]") -> None:
    started.send_signal(signal.SIGKILL)
    started.wait()


def unused_for(shelf: Shelf, seconds: float) -> None:
    """As if the shelf had last been used that long ago."""
    then = time.time() - seconds
    os.utime(shelf.folder / "key.json", (then, then))


def filled(store: Store, name: str, days: float) -> Shelf:
    """A shelf with one image, last used so many days ago."""
    shelf = store.shelf({"quantity": name})
    shelf.image("exact", lambda: IMAGE)
    unused_for(shelf, days * 86400)
    return shelf


def finish_check(shelf: Shelf, judged: Shelf, name: str = "room/technique") -> None:
    """Put a finished check on a shelf, judged against the only image of another."""
    (shelf.folder / "images").mkdir()
    (shelf.folder / "images" / "picture-error.png").write_bytes(b"a picture")
    inputs = {f"{judged.key[:2]}/{judged.key}/exact.exr": "digest"}
    write_text(shelf.folder / "check.json", json.dumps({"inputs": inputs, "result": {"id": name, "spp": 256}}))


def by_name(records: list[Record]) -> dict[str, Record]:
    return {record.what: record for record in records}


def hidden(root: Path) -> list[Path]:
    return [path for path in root.rglob("*") if path.name.startswith(".")]


def test_an_image_is_rendered_once_and_read_ever_after(tmp_path: Path) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})
    made = shelf.image("exact", lambda: IMAGE)
    read = Store(tmp_path).shelf({"a": 1}).image("exact", refuse)
    np.testing.assert_array_equal(read.pixels, made.pixels)
    assert read.provenance == IMAGE.provenance


def test_each_key_has_a_place_of_its_own(tmp_path: Path) -> None:
    store = Store(tmp_path)
    assert store.shelf({"a": 1, "b": 2}).folder == store.shelf({"b": 2, "a": 1}).folder
    assert store.shelf({"a": 1}).folder != store.shelf({"a": 2}).folder


def test_a_place_says_what_it_depends_on(tmp_path: Path) -> None:
    shelf = Store(tmp_path).shelf({"quantity": "depth"})
    assert '"quantity": "depth"' in (shelf.folder / "key.json").read_text(encoding="utf-8")
    assert shelf.folder == tmp_path / shelf.key[:2] / shelf.key


def test_what_was_used_is_remembered(tmp_path: Path) -> None:
    store = Store(tmp_path)
    shelf = store.shelf({"a": 1})
    shelf.image("one", lambda: IMAGE)
    shelf.image("one", refuse)
    shelf.image("two", lambda: OTHER)
    assert {p.name for p in store.touched} == {"one.exr", "two.exr"}


@pytest.mark.parametrize("content", [b"", b"no EXR at all", b"\x76\x2f\x31\x01"], ids=["empty", "text", "cut off"])
def test_a_file_that_is_no_image_is_replaced_and_that_is_said(tmp_path: Path, content: bytes) -> None:
    store = Store(tmp_path)
    shelf = store.shelf({"a": 1})
    (shelf.folder / "exact.exr").write_bytes(content)
    np.testing.assert_array_equal(shelf.image("exact", lambda: IMAGE).pixels, IMAGE.pixels)
    assert len(store.notes) == 1
    assert "exact.exr" in store.notes[0]
    shelf.image("exact", refuse)


def test_an_image_without_provenance_is_replaced(tmp_path: Path) -> None:
    """As of a file from elsewhere, which nothing vouches for."""
    store = Store(tmp_path)
    shelf = store.shelf({"a": 1})
    write_exr(shelf.folder / "exact.exr", Image(OTHER.pixels))
    np.testing.assert_array_equal(shelf.image("exact", lambda: IMAGE).pixels, IMAGE.pixels)
    assert len(store.notes) == 1


def test_no_single_byte_can_be_changed_unnoticed(tmp_path: Path) -> None:
    """Whatever is hit, the header too, the pixels and their provenance come out as they were written."""
    path = tmp_path / "store"
    shelf = Store(path).shelf({"a": 1})
    shelf.image("exact", lambda: IMAGE)
    file = shelf.folder / "exact.exr"
    content = file.read_bytes()
    for position in range(len(content)):
        file.write_bytes(content[:position] + bytes([content[position] ^ 0x11]) + content[position + 1 :])
        found = shelf.image("exact", lambda: IMAGE)
        np.testing.assert_array_equal(found.pixels, IMAGE.pixels, err_msg=f"byte {position}")
        assert found.provenance == IMAGE.provenance, position


def test_an_interrupted_rendering_leaves_nothing_behind(tmp_path: Path) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})
    with pytest.raises(KeyboardInterrupt):
        shelf.image("exact", interrupt)
    assert [p.name for p in shelf.folder.iterdir()] == ["key.json"]


def test_an_interrupted_write_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})

    def stop(path: Path, target: Path) -> Path:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", stop)
        with pytest.raises(KeyboardInterrupt):
            shelf.image("exact", lambda: IMAGE)
    assert [p.name for p in shelf.folder.iterdir()] == ["key.json"]
    shelf.image("exact", lambda: IMAGE)


def test_a_store_that_cannot_be_written_names_the_option(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(InputError, match=r"The store '.*file/store' cannot be written to .*--store FOLDER") as caught:
        Store(tmp_path / "file" / "store").shelf({"a": 1})
    assert caught.value.exit_status == 3


def test_a_text_replaces_the_whole_file(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "a long text")
    write_text(tmp_path / "a.txt", "short")
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text(encoding="utf-8") == "short"


def test_who_waits_for_another_run_says_so_and_takes_what_it_wrote(tmp_path: Path) -> None:
    said: list[tuple[str, float]] = []

    def waiting(what: str, fraction: float) -> None:
        said.append((what, fraction))
        if len(said) == 3:
            write_exr(shelf.folder / "exact.exr", IMAGE)

    shelf = Store(tmp_path, waiting=waiting).shelf({"a": 1})
    with locked(shelf):
        np.testing.assert_array_equal(shelf.image("exact", refuse).pixels, IMAGE.pixels)
    assert said == [("waiting for another run, which renders the same truth", 0.0)] * 3


def test_what_is_there_is_read_while_another_run_renders_the_rest(tmp_path: Path) -> None:
    shelf = Store(tmp_path, waiting=lambda what, fraction: pytest.fail("it waits")).shelf({"a": 1})
    shelf.image("block-000", lambda: IMAGE)
    with locked(shelf):
        np.testing.assert_array_equal(shelf.image("block-000", refuse).pixels, IMAGE.pixels)


def test_a_run_that_waits_can_be_interrupted(tmp_path: Path) -> None:
    def waiting(what: str, fraction: float) -> None:
        raise KeyboardInterrupt

    shelf = Store(tmp_path, waiting=waiting).shelf({"a": 1})
    with locked(shelf), pytest.raises(KeyboardInterrupt):
        shelf.image("exact", refuse)
    shelf.image("exact", lambda: IMAGE)


def test_other_shelves_do_not_wait(tmp_path: Path) -> None:
    store = Store(tmp_path, waiting=lambda what, fraction: pytest.fail("it waits"))
    with locked(store.shelf({"a": 1})):
        made = store.shelf({"a": 2}).image("exact", lambda: IMAGE)
    np.testing.assert_array_equal(made.pixels, IMAGE.pixels)


def test_the_lock_of_a_killed_run_is_free(tmp_path: Path) -> None:
    code = "import fcntl, os; fcntl.flock(os.open(sys.argv[1], os.O_RDONLY), fcntl.LOCK_EX)"
    store = Store(tmp_path)
    shelf = store.shelf({"a": 1})
    waits: list[str] = []

    def waiting(what: str, fraction: float) -> None:
        waits.append(what)
        if len(waits) == 2:
            kill(other)

    store.waiting = waiting
    with process(code, shelf.folder) as other:
        shelf.image("exact", lambda: IMAGE)
    assert len(waits) == 2


def test_a_rendering_that_fails_lets_others_render(tmp_path: Path) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})
    with pytest.raises(KeyboardInterrupt):
        shelf.image("exact", interrupt)
    other = Store(tmp_path, waiting=lambda what, fraction: pytest.fail("it waits"))
    other.shelf({"a": 1}).image("exact", lambda: IMAGE)


@pytest.fixture
def no_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system without flock(2)."""

    def flock(handle: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", flock)


@pytest.mark.usefixtures("no_locks")
def test_without_locks_everything_is_kept_all_the_same(tmp_path: Path) -> None:
    shelf, other = Store(tmp_path).shelf({"a": 1}), Store(tmp_path).shelf({"a": 1})

    def render_while_another_does() -> Image:
        other.image("exact", lambda: IMAGE)
        return IMAGE

    shelf.image("exact", render_while_another_does)
    np.testing.assert_array_equal(other.image("exact", refuse).pixels, IMAGE.pixels)


@pytest.mark.usefixtures("no_locks")
def test_without_locks_what_was_used_within_a_day_is_taken_to_be_in_use(tmp_path: Path) -> None:
    store = Store(tmp_path)
    filled(store, "old", days=1.1)
    filled(store, "new", days=0.9)
    assert [record.what for record in evict(store, 0).removed] == ["old"]


def test_what_is_removed_while_it_is_rendered_is_made_again(tmp_path: Path) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})

    def render() -> Image:
        shutil.rmtree(shelf.folder)
        return IMAGE

    shelf.image("exact", render)
    assert sorted(p.name for p in shelf.folder.iterdir()) == ["exact.exr", "key.json"]
    shelf.image("exact", refuse)


def test_what_was_removed_is_made_again_though_the_old_folder_is_still_locked(tmp_path: Path) -> None:
    shelf = Store(tmp_path, waiting=lambda what, fraction: pytest.fail("it waits")).shelf({"a": 1})
    with locked(shelf):
        shutil.rmtree(shelf.folder)
        shelf.image("exact", lambda: IMAGE)
    np.testing.assert_array_equal(shelf.image("exact", refuse).pixels, IMAGE.pixels)


def test_a_lock_on_a_folder_that_has_been_replaced_is_not_enough(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else two runs would render at once, each with the lock on a folder of its own."""
    waits: list[str] = []
    shelf = Store(tmp_path, waiting=lambda what, fraction: waits.append(what)).shelf({"a": 1})
    opened = os.open

    def open_and_replace(path: Path, flags: int, mode: int = 0o777) -> int:
        handle = opened(path, flags, mode)
        if path == shelf.folder and not waits:
            shutil.move(shelf.folder, tmp_path / "elsewhere")
            shelf.make()
        return handle

    monkeypatch.setattr(os, "open", open_and_replace)
    shelf.image("exact", lambda: IMAGE)
    assert len(waits) == 1
    assert (shelf.folder / "exact.exr").is_file()


def test_an_image_that_is_removed_while_it_is_read_is_rendered_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path)
    shelf = store.shelf({"a": 1})
    (shelf.folder / "exact.exr").write_bytes(b"damaged, so that it is looked at again under the lock")
    looks: list[Path] = []

    def removed_before_the_second_look(path: Path) -> Image:
        looks.append(path)
        if len(looks) == 2:
            path.unlink()
        return read_exr(path)

    monkeypatch.setattr("reference.store.read_exr", removed_before_the_second_look)
    np.testing.assert_array_equal(shelf.image("exact", lambda: IMAGE).pixels, IMAGE.pixels)
    assert len(looks) == 2
    assert not store.notes


def test_an_image_that_another_run_has_written_just_before_the_lock_is_not_rendered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})
    lock = fcntl.flock

    def written_before(handle: int, operation: int) -> None:
        write_exr(shelf.folder / "exact.exr", OTHER)
        lock(handle, operation)

    monkeypatch.setattr(fcntl, "flock", written_before)
    np.testing.assert_array_equal(shelf.image("exact", refuse).pixels, OTHER.pixels)


def test_a_folder_that_is_removed_while_an_image_is_written_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})
    writes: list[Path] = []

    def removed_before_the_first(path: Path, image: Image) -> None:
        writes.append(path)
        if len(writes) == 1:
            shutil.rmtree(shelf.folder)
        write_exr(path, image)

    monkeypatch.setattr("reference.store.write_exr", removed_before_the_first)
    shelf.image("exact", lambda: IMAGE)
    assert len(writes) == 2
    assert sorted(p.name for p in shelf.folder.iterdir()) == ["exact.exr", "key.json"]


def test_an_image_that_cannot_be_written_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})

    def full(path: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(ImageError, match=r"exact\.exr: cannot be written \(No space left on device\)"):
        shelf.image("exact", lambda: IMAGE)


def test_a_new_rendering_sweeps_what_killed_runs_left_behind(tmp_path: Path) -> None:
    store = Store(tmp_path)
    shelf = store.shelf({"a": 1})
    (shelf.folder / "images").mkdir()
    old = (".block-000.exr.0a.tmp", ".key.json.0b.tmp", "images/.picture-error.png.0d.tmp")
    for age, name in (*((3600, name) for name in old), (-1, ".check.json.0c.tmp")):
        (shelf.folder / name).write_bytes(b"half a")
        os.utime(shelf.folder / name, (time.time() - age,) * 2)
    shelf.image("block-000", lambda: IMAGE)
    assert [path.name for path in hidden(store.root)] == [".check.json.0c.tmp"]


def test_a_use_is_remembered_by_the_time_of_the_description(tmp_path: Path) -> None:
    shelf = Store(tmp_path).shelf({"a": 1})
    unused_for(shelf, 1000)
    (before,) = inventory(Store(tmp_path))
    Store(tmp_path).shelf({"a": 1})
    (after,) = inventory(Store(tmp_path))
    assert time.time() - before.used == pytest.approx(1000, abs=10)
    assert time.time() - after.used == pytest.approx(0, abs=10)


def test_the_inventory_tells_what_there_is(tmp_path: Path) -> None:
    store = Store(tmp_path)
    depth = filled(store, "depth", days=3)
    sampled = store.shelf({"quantity": "radiance", "accumulators": 16})
    for index, spp in enumerate((4, 4, 8)):
        sampled.image(f"block-{index:03d}", lambda spp=spp: image_of(spp))  # type: ignore[misc]
    begun = store.shelf({"quantity": "albedo"})
    check = store.shelf({"check": {"technique": "technique"}})
    finish_check(check, depth)
    unfinished = store.shelf({"check": {"technique": "unfinished"}})
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "0f.llvm.v6.bin").write_bytes(b"code")

    found = by_name(inventory(store))
    assert {name: (r.kind, r.key, r.spp) for name, r in found.items()} == {
        "depth": ("truth", depth.key, 0),
        "room/radiance": ("truth", sampled.key, 16 * 16),
        "albedo": ("truth", begun.key, None),
        "room/technique": ("check", check.key, 256),
        "unfinished": ("check", unfinished.key, None),
        "compiled kernel": ("kernel", "0f.llvm.v6.bin", None),
    }
    every = [path for record in found.values() for path in record.files]
    assert sum(r.size for r in found.values()) == sum(path.stat().st_size for path in every)
    assert sorted(every) == sorted(p for p in tmp_path.rglob("*") if p.is_file() and p.parent.name != "runs")


def test_a_truth_is_used_whenever_a_check_that_was_judged_against_it_is(tmp_path: Path) -> None:
    store = Store(tmp_path)
    truth, unrelated = filled(store, "depth", days=9), filled(store, "normal", days=9)
    check = store.shelf({"check": {}})
    finish_check(check, truth)
    unused_for(check, 4 * 86400)
    days = {record.key: (time.time() - record.used) / 86400 for record in inventory(store)}
    assert days == pytest.approx({truth.key: 4, check.key: 4, unrelated.key: 9}, abs=0.01)


def test_the_inventory_of_nothing_is_empty(tmp_path: Path) -> None:
    assert inventory(Store(tmp_path / "nowhere")) == []
    assert inventory(Store(tmp_path)) == []


STRANGE: dict[str, Callable[[Shelf], Any]] = {
    "an empty folder": lambda shelf: (shelf.folder / "key.json").unlink(),
    "no description": lambda shelf: (shelf.folder / "key.json").rename(shelf.folder / "exact.exr"),
    "a damaged description": lambda shelf: (shelf.folder / "key.json").write_bytes(b"\xff{"),
    "a list as description": lambda shelf: (shelf.folder / "key.json").write_text("[1]"),
    "no image": lambda shelf: (shelf.folder / "exact.exr").write_bytes(b"lightgauge\0string\0\xff\xff\xff\x7f{"),
    "an odd origin": lambda shelf: shelf.image("exact", lambda: Image(IMAGE.pixels, {"spp": "many", "scene": 7})),
    "a folder as image": lambda shelf: (shelf.folder / "exact.exr").mkdir(),
    "a damaged check": lambda shelf: (shelf.folder / "check.json").write_text("{"),
    "an odd check": lambda shelf: (shelf.folder / "check.json").write_text('{"inputs": 3, "result": {"spp": "many"}}'),
    "deep nesting": lambda shelf: (shelf.folder / "check.json").write_text("[" * 100_000),
    "a dangling link": lambda shelf: (shelf.folder / "exact.exr").symlink_to("nowhere"),
}


@pytest.mark.parametrize("strange", STRANGE.values(), ids=STRANGE)
def test_strange_files_disturb_nobody(tmp_path: Path, strange: Callable[[Shelf], Any]) -> None:
    store = Store(tmp_path)
    other = filled(store, "depth", days=1)
    shelf = store.shelf({"quantity": "albedo"})
    strange(shelf)
    records = {record.key: record for record in inventory(store)}
    assert records[other.key].what == "depth"
    assert records.keys() <= {other.key, shelf.key}
    del store, other, shelf
    evict(Store(tmp_path), 0)
    assert inventory(Store(tmp_path)) == []


AN_HOUR = 3600.0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(min_value=0, max_value=400), max_size=6), st.integers(min_value=0, max_value=2500))
def test_the_least_recently_used_are_removed_and_no_more_than_needed(sizes: list[int], limit: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        for index, size in enumerate(sizes):
            shelf = store.shelf({"index": index})
            (shelf.folder / "exact.exr").write_bytes(bytes(size))
            unused_for(shelf, (1 + (5 * index) % 7) * AN_HOUR)
        before = sorted(inventory(store), key=lambda record: record.used)
        done = evict(store, limit)
        count = len(done.removed)
        assert list(done.removed) == before[:count]
        assert {r.key for r in inventory(store)} == {r.key for r in before[count:]}
        assert done.left == sum(r.size for r in before[count:]) <= limit
        assert count == 0 or done.left + done.removed[-1].size > limit


def test_kernels_count_and_the_oldest_go_too(tmp_path: Path) -> None:
    store = Store(tmp_path)
    filled(store, "depth", days=2)
    (tmp_path / "kernels").mkdir()
    for days in (1, 3):
        path = tmp_path / "kernels" / f"{days}.bin"
        path.write_bytes(bytes(1000))
        os.utime(path, (time.time() - days * 86400,) * 2)
    total = sum(record.size for record in inventory(store))
    done = evict(store, total - 1)
    assert [record.key for record in done.removed] == ["3.bin"]
    assert done.left == total - 1000
    assert [path.name for path in (tmp_path / "kernels").iterdir()] == ["1.bin"]


def test_a_check_goes_before_the_truth_that_it_keeps_in_use(tmp_path: Path) -> None:
    store = Store(tmp_path)
    truth = filled(store, "depth", days=9)
    check = store.shelf({"check": {}})
    finish_check(check, truth)
    unused_for(check, 86400)
    assert [record.key for record in evict(store, 0).removed] == [check.key, truth.key]


def test_what_this_run_has_used_stays(tmp_path: Path) -> None:
    filled(Store(tmp_path), "depth", days=1)
    store = Store(tmp_path)
    used = store.shelf({"quantity": "normal"})
    used.image("exact", lambda: IMAGE)
    done = evict(store, 0)
    assert [record.what for record in done.removed] == ["depth"]
    assert done.left == sum(path.stat().st_size for path in used.folder.iterdir())
    used.image("exact", refuse)


def test_what_another_run_has_used_stays_until_it_ends(tmp_path: Path) -> None:
    other = Store(tmp_path)
    filled(other, "depth", days=1)
    other.shelf({"quantity": "normal"})
    assert [record.what for record in evict(Store(tmp_path), 0).removed] == ["depth"]
    del other
    assert [record.what for record in evict(Store(tmp_path), 0).removed] == ["normal"]
    assert list((tmp_path / "runs").iterdir()) == []


def test_another_process_that_lives_is_a_run_and_one_that_was_killed_is_none(tmp_path: Path) -> None:
    code = "import pathlib, reference.store as s; store = s.Store(pathlib.Path(sys.argv[1])); store.shelf({'a': 1})"
    with process(code, tmp_path) as other:
        assert evict(Store(tmp_path), 0).removed == ()
        kill(other)
        assert len(list((tmp_path / "runs").iterdir())) == 1
        assert len(evict(Store(tmp_path), 0).removed) == 1
    assert list((tmp_path / "runs").iterdir()) == []


def test_what_is_used_again_at_the_last_moment_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a run that began before, and had not used it so far."""
    other, store = Store(tmp_path), Store(tmp_path)
    shelf = filled(other, "depth", days=1)

    def use_after_looking(store: Store) -> list[Record]:
        found = inventory(store)
        other.shelf(shelf.parts)
        return found

    monkeypatch.setattr("reference.upkeep.inventory", use_after_looking)
    assert evict(store, 0).removed == ()
    shelf.image("exact", refuse)


def test_unknown_files_are_never_removed(tmp_path: Path) -> None:
    store = Store(tmp_path)
    shelf = filled(store, "depth", days=1)
    unknown = [
        tmp_path / "notes.txt",
        tmp_path / "runs" / "notes.txt",
        tmp_path / "ab" / "notes" / "key.json",
        tmp_path / "kernels" / "notes.txt",
        shelf.folder / "notes.txt",
        shelf.folder / "images" / "notes.txt",
    ]
    for path in unknown:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("mine", encoding="utf-8")
        os.utime(path, (0, 0))
    assert evict(store, 0).left == 0
    assert all(path.is_file() for path in unknown)
    assert not (shelf.folder / "key.json").exists()
    assert inventory(store) == []


def test_removal_leaves_no_empty_shelf_and_sweeps_what_killed_runs_left_behind(tmp_path: Path) -> None:
    store = Store(tmp_path)
    truth, kept = filled(store, "depth", days=2), filled(store, "normal", days=1)
    check = store.shelf({"check": {}})
    finish_check(check, truth)
    unused_for(check, 3 * 86400)
    for shelf in (truth, kept, check):
        (shelf.folder / ".exact.exr.0a.tmp").write_bytes(b"half a")
        os.utime(shelf.folder / ".exact.exr.0a.tmp", (0, 0))
    evict(store, inventory(store)[0].size)
    assert [path for path in (truth, kept, check) if path.folder.exists()] == [kept]
    assert hidden(tmp_path) == []


def test_merging_copies_what_is_missing(tmp_path: Path) -> None:
    store, other = Store(tmp_path / "store"), Store(tmp_path / "other")
    parts = {"quantity": "radiance"}
    mine, theirs = store.shelf(parts), other.shelf(parts)
    mine.image("block-000", lambda: IMAGE)
    for name in ("block-000", "block-001"):
        theirs.image(name, lambda: OTHER)
    exact = filled(other, "depth", days=1)
    check = other.shelf({"check": {}})
    finish_check(check, exact)
    other.shelf({"check": {"technique": "unfinished"}})

    assert merge(store, other.root) == 3
    np.testing.assert_array_equal(mine.image("block-000", refuse).pixels, IMAGE.pixels)
    assert (mine.folder / "block-001.exr").read_bytes() == (theirs.folder / "block-001.exr").read_bytes()
    for shelf in (exact, check):
        copied = store.root / shelf.folder.relative_to(other.root)
        files = [path for path in shelf.folder.rglob("*") if path.is_file()]
        assert files
        assert all((copied / p.relative_to(shelf.folder)).read_bytes() == p.read_bytes() for p in files)
    assert len(inventory(store)) == 3
    assert store.notes == []
    assert merge(store, other.root) == 0


def test_merging_skips_what_is_damaged_and_says_so(tmp_path: Path) -> None:
    store, other = Store(tmp_path / "store"), Store(tmp_path / "other")
    shelves = {name: filled(other, name, days=1) for name in ("cut", "lost", "changed", "whole")}
    check = other.shelf({"check": {}})
    finish_check(check, shelves["whole"])
    (check.folder / "check.json").write_text("{")
    image = shelves["cut"].folder / "exact.exr"
    image.write_bytes(image.read_bytes()[:-1])
    (shelves["lost"].folder / "key.json").unlink()
    (shelves["changed"].folder / "key.json").write_text('{"quantity": NaN}')

    assert merge(store, other.root) == 1
    assert len(store.notes) == 4
    for name in (image, shelves["lost"].folder, shelves["changed"].folder, check.folder):
        assert sum(str(name) in note for note in store.notes) == 1
    assert [path.parent for path in store.root.rglob("*.exr")] == [
        store.root / shelves["whole"].folder.relative_to(other.root)
    ]
    assert not list(store.root.rglob("check.json"))
    assert hidden(store.root) == []


def test_merging_waits_for_a_run_that_renders_the_same(tmp_path: Path) -> None:
    waits: list[str] = []

    def waiting(what: str, fraction: float) -> None:
        waits.append(what)
        write_exr(mine.folder / "exact.exr", OTHER)

    store, other = Store(tmp_path / "store", waiting=waiting), Store(tmp_path / "other")
    theirs = filled(other, "depth", days=1)
    mine = store.shelf(theirs.parts)
    with locked(mine):
        merge(store, other.root)
    assert len(waits) == 1
    np.testing.assert_array_equal(mine.image("exact", refuse).pixels, OTHER.pixels)


def test_a_store_is_looked_through_when_something_was_written_or_the_limit_fell(tmp_path: Path) -> None:
    store = Store(tmp_path)
    filled(store, "depth", days=1)
    size = sum(record.size for record in inventory(store))
    assert tidy(store, 2 * size) is not None
    assert tidy(store, 2 * size) is None
    assert tidy(store, 3 * size) is None, "a higher limit leaves what a lower one left"
    assert tidy(store, size) is not None, "a lower one may not"
    filled(store, "normal", days=2)
    assert len(getattr(tidy(store, size), "removed", ())) == 1
    assert [record.what for record in inventory(store)] == ["depth"]


@pytest.mark.parametrize("write", ["image", "shelf", "merge"])
def test_whatever_is_written_lets_the_store_be_looked_through(tmp_path: Path, write: str) -> None:
    store, other = Store(tmp_path / "store"), Store(tmp_path / "other")
    shelf = store.shelf({"quantity": "depth"})
    filled(other, "normal", days=1)
    tidy(store, 1 << 30)
    assert tidy(store, 1 << 30) is None
    if write == "image":
        shelf.image("exact", lambda: IMAGE)
    elif write == "shelf":
        store.shelf({"quantity": "albedo"})
    else:
        merge(store, other.root)
    assert tidy(store, 1 << 30) is not None


def test_a_store_that_is_still_too_large_is_looked_through_again(tmp_path: Path) -> None:
    """What a run that goes on has used stays until that has ended."""
    store = Store(tmp_path)
    store.shelf({"quantity": "depth"}).image("exact", lambda: IMAGE)
    assert getattr(tidy(store, 1), "left", 0) > 1
    assert tidy(store, 1) is not None


def test_a_damaged_note_of_the_last_look_is_none(tmp_path: Path) -> None:
    store = Store(tmp_path)
    filled(store, "depth", days=1)
    for content in ("", "[]", '{"limit": "1G"}', "\xff"):
        (tmp_path / "tidied.json").write_text(content, encoding="latin-1")
        assert tidy(store, 1 << 30) is not None
