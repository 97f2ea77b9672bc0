"""A fact about a file is found again as long as the file is the same, and never longer."""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from scenes import known

Ask = Callable[[], str]


@pytest.fixture(autouse=True)
def _nothing_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test begins like a process that has read no file yet."""
    for name, value in (("_facts", {}), ("_recalled", set()), ("_changed", set())):
        monkeypatch.setattr(known, name, value)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "file.txt"
    path.write_text("first", encoding="utf-8")
    return path


@pytest.fixture
def read(file: Path) -> list[str]:
    """What was read from the file, one text a reading; asked by `ask`."""
    return []


@pytest.fixture
def ask(file: Path, read: list[str]) -> Ask:
    def answer(path: Path) -> str:
        read.append(path.read_text(encoding="utf-8"))
        return read[-1]

    return lambda: str(known.about(file, "text", answer))


@pytest.fixture
def _settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files count as settled at once: a test does not wait until the clock of the file system has ticked."""
    monkeypatch.setattr(known, "SETTLED_SECONDS", -60.0)


@pytest.mark.usefixtures("_settled")
def test_a_file_is_read_once(ask: Ask, read: list[str]) -> None:
    assert [ask(), ask()] == ["first", "first"]
    assert read == ["first"]


def rewritten(file: Path) -> None:
    file.write_text("other", encoding="utf-8")  # as long as before


def touched_back(file: Path) -> None:
    """Rewritten, with the time of the last change set back: the time of the last change of anything tells."""
    times = file.stat()
    file.write_text("other", encoding="utf-8")
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))


def replaced(file: Path) -> None:
    """Another file of the same length and time in its place: the inode number tells."""
    times = file.stat()
    beside = file.with_name("beside")
    beside.write_text("other", encoding="utf-8")
    os.utime(beside, ns=(times.st_atime_ns, times.st_mtime_ns))
    beside.replace(file)


@pytest.mark.usefixtures("_settled")
@pytest.mark.parametrize("change", [rewritten, touched_back, replaced])
def test_a_changed_file_is_read_again(ask: Ask, file: Path, change: Callable[[Path], None]) -> None:
    assert ask() == "first"
    time.sleep(0.02)  # a few ticks of the kernel's clock
    change(file)
    assert [ask(), ask()] == ["other", "other"]


def test_what_was_just_written_is_not_remembered(ask: Ask, read: list[str]) -> None:
    """A second writing within the same tick of the clock would leave the same size and time."""
    assert [ask(), ask()] == ["first", "first"]
    assert len(read) == 2


@pytest.mark.usefixtures("_settled")
def test_what_changes_while_it_is_read_is_not_remembered(file: Path, ask: Ask) -> None:
    def slow(path: Path) -> str:
        found = path.read_text(encoding="utf-8")
        time.sleep(0.02)
        rewritten(path)
        return found

    assert known.about(file, "text", slow) == "first"
    assert ask() == "other"


@pytest.mark.usefixtures("_settled")
def test_questions_are_told_apart(file: Path) -> None:
    assert known.about(file, "length", lambda path: path.stat().st_size) == 5
    assert known.about(file, "text", lambda path: path.read_text(encoding="utf-8")) == "first"
    assert known.about(file, "length", lambda path: 0) == 5


@pytest.mark.usefixtures("_settled")
def test_what_other_code_has_found_is_found_anew(
    ask: Ask, read: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a new version of this program would go by what the old one saw in files that are still the same."""
    ask()
    known.keep(tmp_path / "known.json")
    forget()
    monkeypatch.setattr(known, "_code_of", lambda module: "another version")
    known.recall(tmp_path / "known.json")
    assert [ask(), ask()] == ["first", "first"]
    assert len(read) == 2, "once by the code of before, once by that of now"


@pytest.mark.usefixtures("_settled")
@pytest.mark.parametrize("answer", ["first", ["first"], {"text": "first"}, None, 1])
def test_an_answer_that_nobody_vouches_for_is_not_believed(
    ask: Ask, read: list[str], file: Path, tmp_path: Path, answer: object
) -> None:
    fact = {"stamp": known._stamp(file), "text": answer}
    (tmp_path / "known.json").write_text(json.dumps({str(file): fact}), encoding="utf-8")
    known.recall(tmp_path / "known.json")
    assert (ask(), len(read)) == ("first", 1)


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        known.about(tmp_path / "none", "text", lambda path: "")


def forget() -> None:
    known._facts.clear()
    known._recalled.clear()


@pytest.mark.usefixtures("_settled")
def test_another_process_recalls_what_was_kept(ask: Ask, read: list[str], file: Path, tmp_path: Path) -> None:
    ask()
    known.keep(tmp_path / "known.json")
    forget()
    known.recall(tmp_path / "known.json")
    assert (ask(), len(read)) == ("first", 1)
    time.sleep(0.02)
    rewritten(file)
    assert ask() == "other"


@pytest.mark.usefixtures("_settled")
def test_nothing_is_written_where_nothing_was_learnt_and_what_is_gone_is_forgotten(
    ask: Ask, file: Path, tmp_path: Path
) -> None:
    kept = tmp_path / "known.json"
    known.keep(kept)
    assert not kept.exists()
    ask()
    file.unlink()
    known.keep(kept)
    assert json.loads(kept.read_text(encoding="utf-8")) == {}


@pytest.mark.parametrize("content", ["", "[", "[]", "null", '{"a": null}', '{"a": {}}', '{"a": []}', "\xff"])
def test_a_damaged_memory_is_none(ask: Ask, tmp_path: Path, content: str) -> None:
    kept = tmp_path / "known.json"
    kept.write_text(content, encoding="latin-1")
    known.recall(kept)
    assert known._facts == {}
    assert ask() == "first"
