"""What the store's command says and does."""

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons.answers.store import age_text, inventory_lines, merge_lines, parse_size, prune, size_text
from reference.store import Store
from scenes.errors import InputError
from scenes.image import Image


def fill(root: Path, quantity: str, days: float, spp: int | None = None) -> Path:
    """Keep a truth that was last used so many days ago; returns its folder."""
    origin = {"scene": "room"} | ({} if spp is None else {"spp": spp})
    shelf = Store(root).shelf({"quantity": quantity, "accumulators": 16})
    shelf.image("exact" if spp is None else "block-000", lambda: Image(np.ones((4, 4, 3), dtype=np.float32), origin))
    then = time.time() - days * 86400
    os.utime(shelf.folder / "key.json", (then, then))
    return shelf.folder


def size_of(*folders: Path) -> int:
    return sum(path.stat().st_size for folder in folders for path in folder.iterdir())


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "store"


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("0", 0),
        ("12", 12),
        ("12B", 12),
        ("500M", 500_000_000),
        ("500 MB", 500_000_000),
        (" 1.5g ", 1_500_000_000),
        ("2T", 2_000_000_000_000),
        ("0.1K", 100),
    ],
)
def test_a_size_has_a_decimal_prefix(text: str, size: int) -> None:
    assert parse_size(text) == size


@pytest.mark.parametrize("text", ["", "M", "-1", "1,5G", "5X", "1e9", "5 MiB", "5M 3K", "nan"])
def test_what_is_no_size_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"is not a size\. Allowed is .* 500M, 1\.5G") as caught:
        parse_size(text)
    assert f"'{text}'" in str(caught.value)


@pytest.mark.parametrize(
    ("size", "text"),
    [
        (0, "0 B"),
        (999, "999 B"),
        (1000, "1.0 kB"),
        (21_400_000, "21.4 MB"),
        (999_960, "1.0 MB"),
        (4 * 10**9, "4.0 GB"),
        (12 * 10**12, "12.0 TB"),
    ],
)
def test_a_size_is_said_in_the_largest_unit_that_it_fills(size: int, text: str) -> None:
    assert size_text(size) == text


@given(st.integers(min_value=0, max_value=999 * 10**12))
def test_a_size_that_was_said_reads_as_about_the_same(size: int) -> None:
    said = size_text(size)
    assert parse_size(said) == pytest.approx(size, rel=0.05)
    assert float(said.split()[0]) < 1000


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (-5.0, "just now"),
        (59.0, "just now"),
        (60.0, "1 minute ago"),
        (3599.0, "59 minutes ago"),
        (7200.0, "2 hours ago"),
        (86400.0, "1 day ago"),
        (3.9 * 86400, "3 days ago"),
    ],
)
def test_an_age_is_said_in_the_largest_unit_that_it_fills(seconds: float, text: str) -> None:
    assert age_text(seconds) == text


def test_the_table_lists_everything_with_what_goes_first_at_the_top(root: Path) -> None:
    new, old = fill(root, "radiance", days=2.5, spp=4), fill(root, "depth", days=9.5)
    Store(root).shelf({"check": {"technique": "technique"}})
    (root / "kernels").mkdir()
    for name in ("a", "b"):
        (root / "kernels" / f"{name}.llvm.bin").write_bytes(bytes(600))
    heading, *rows, empty, total = inventory_lines(Store(root))
    cells = [[cell.strip() for cell in row.split("  ") if cell] for row in rows]
    assert cells[0] == ["room/depth", "truth", "exact", size_text(size_of(old)), "9 days ago"]
    assert cells[1] == ["room/radiance", "truth", "64", size_text(size_of(new)), "2 days ago"]
    assert (cells[2][:2], cells[2][-1]) == (["technique", "check"], "just now")
    assert cells[3] == ["2 compiled kernels", "kernel", "1.2 kB", "just now"]
    column = heading.index("kind")
    assert [row[column:].split()[0] for row in rows] == ["truth", "truth", "check", "kernel"]
    assert heading.split("  ")[0] == "scene/quantity or check"
    assert empty == ""
    assert "2 truths (" in total
    assert ", 1 check (" in total
    assert ", 2 compiled kernels (1.2 kB)" in total


def test_an_empty_store_holds_nothing(root: Path) -> None:
    root.mkdir()
    assert list(inventory_lines(Store(root))) == [f"'{root}' holds 0 B."]


@pytest.mark.parametrize("lines", [inventory_lines, lambda store: prune(store, 0)], ids=["table", "prune"])
def test_a_store_that_does_not_exist_is_not_made(lines: Callable[[Store], Iterator[str]], root: Path) -> None:
    with pytest.raises(InputError, match=r"There is no store '.*store'\. .*--store"):
        list(lines(Store(root)))
    assert not root.exists()


def test_pruning_says_what_it_removed_and_what_is_left(root: Path) -> None:
    old, new = fill(root, "depth", days=3), fill(root, "normal", days=2)
    (root / "kernels").mkdir()
    kernel = root / "kernels" / "a.bin"
    kernel.write_bytes(bytes(1000))
    os.utime(kernel, (0, 0))
    gone, left = size_of(old), size_of(new)
    assert list(prune(Store(root), left)) == [
        f"removed room/depth (truth, {size_text(gone)}, used 3 days ago)",
        f"Removed {size_text(gone + 1000)}: 1 truth ({size_text(gone)}), 1 compiled kernel (1.0 kB). "
        f"'{root}' holds {size_text(left)} now.",
    ]
    assert [folder.exists() for folder in (old, new)] == [False, True]


def test_pruning_within_the_limit_removes_nothing(root: Path) -> None:
    folder = fill(root, "depth", days=3)
    assert list(prune(Store(root), 10**9)) == [f"Removed 0 B. '{root}' holds {size_text(size_of(folder))} now."]


def test_pruning_says_when_present_runs_need_more_than_the_limit(root: Path) -> None:
    run = Store(root)
    run.shelf({"quantity": "depth"})
    *_, last = prune(Store(root), 1)
    assert last == "That is more than 1 B, but present runs have used all of it."


def test_merging_says_how_much_and_what_was_damaged(root: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    fill(other, "depth", days=1)
    (fill(other, "normal", days=1) / "exact.exr").write_bytes(b"no image")
    fault, count = merge_lines(Store(root), other)
    assert fault.startswith("Not merged: ")
    assert count == f"Images and finished checks taken over from '{other}' into '{root}': 1."
    assert any("room/depth" in line for line in inventory_lines(Store(root)))


def test_only_a_store_can_be_merged(root: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="There is no store"):
        list(merge_lines(Store(root), tmp_path / "nowhere"))
    (tmp_path / "photos").mkdir()
    with pytest.raises(InputError, match=r"'.*photos' holds no truth and no checks\. Name "):
        list(merge_lines(Store(root), tmp_path / "photos"))
    assert not root.exists()
