from pathlib import Path

import numpy as np
import pytest

from reference.store import Store, write_text
from scenes.errors import InputError
from scenes.exr import write_exr
from scenes.image import Image

IMAGE = Image(np.arange(24, dtype=np.float32).reshape(2, 4, 3), {"seconds": 1.5, "key": "k"})
OTHER = Image(np.ones((2, 4, 3), dtype=np.float32), {"seconds": 9.0})


def refuse() -> Image:
    raise AssertionError("an image was rendered")


def interrupt() -> Image:
    raise KeyboardInterrupt


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
