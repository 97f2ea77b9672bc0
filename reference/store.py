"""Content-addressed storage of truth: one folder for each thing that a truth depends on, one EXR for each block in it.

    KEY[:2]/KEY/    a shelf: key.json says what it depends on, and its time when it was last used
        *.exr                       a truth: one exact image, or blocks
        check.json, images/*.png    or a finished check
    kernels/        what Dr.Jit has compiled
    runs/           a file for each process that uses the store now
    tidied.json     there as long as nothing has been written since the store was last looked through

A block is written once, atomically, and never changed; samples merge by adding blocks. A run that is cut off therefore
loses the block in flight and nothing else, and a block whose pixels no longer match their checksum is dropped and
rendered anew.

Any number of processes may share a store. Whoever renders into a shelf holds a lock on its folder, so that no block is
rendered twice, and every run locks a file of its own, so that nothing is removed that has been used since the oldest
of them began. Both are advisory locks, flock(2): the kernel releases them when a process ends, however it ends. On a
file system without them a block may be rendered twice, but never counted twice, and whatever was removed too early is
rendered anew.
"""

import fcntl
import json
import os
import time
import uuid
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from scenes.digest import digest_of
from scenes.errors import ImageError, InputError
from scenes.exr import read_exr, write_exr
from scenes.image import Image

POLL_SECONDS = 0.05
"""How often a run that waits for another one looks again."""

LONGEST_RUN_SECONDS = 86400.0
"""Where the file system knows no locks, a run that began longer ago is taken to have ended."""

TEMPORARY = ".*.tmp"
TIDIED = "tidied.json"


@dataclass
class Store:
    """A folder of truth.

    notes   : what was repaired, in words for the user
    touched : the files that were read or written
    waiting : called again and again, with words and 0, while another process renders what is needed here
    """

    root: Path
    notes: list[str] = field(default_factory=list)
    touched: set[Path] = field(default_factory=set)
    waiting: Callable[[str, float], None] = lambda what, fraction: None

    def shelf(self, parts: dict[str, Any]) -> "Shelf":
        """The place for everything that depends on `parts` and nothing else; it counts as used now.

        Raises
        ------
        InputError
            The store cannot be written to.
        """
        folder = self.folder(parts)
        shelf = Shelf(self, folder.name, folder, parts)
        try:
            _ = self.in_use_since
            shelf.make()
        except OSError as error:
            raise InputError(
                f"The store '{self.root}' cannot be written to ({error.strerror or error}). It needs a folder that "
                "this user may write to: free it, or name another with --store FOLDER."
            ) from error
        with suppress(OSError):  # it may be another user's, who alone can set its time
            os.utime(shelf.folder / "key.json")
        return shelf

    def folder(self, parts: dict[str, Any]) -> Path:
        """The folder of the shelf for these parts, whether or not it is there."""
        key = digest_of(parts)
        return self.root / key[:2] / key

    def has_grown(self) -> None:
        """Say that something was written, so that the store is looked through at the end of a run."""
        (self.root / TIDIED).unlink(missing_ok=True)

    @cached_property
    def in_use_since(self) -> float:
        """When the oldest of the present runs began, in seconds since the epoch. None of them uses what is older.

        From the first call on, until the store is let go or the process ends, this run is one of them.
        """
        with runs_of(self.root) as runs:
            mark = runs / f"{uuid.uuid4().hex}.run"
            handle = os.open(mark, os.O_RDWR | os.O_CREAT, 0o666)
            weakref.finalize(self, _end_run, handle, mark)
            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return oldest_run(runs)


@dataclass(frozen=True)
class Shelf:
    store: Store
    key: str
    folder: Path
    parts: dict[str, Any]

    def make(self) -> None:
        """Make the folder and its description unless they are there."""
        description = self.folder / "key.json"
        while not description.exists():
            self.folder.mkdir(parents=True, exist_ok=True)
            with suppress(FileNotFoundError):  # removed by another process in between
                write_text(description, json.dumps(self.parts, indent=1, sort_keys=True))
                self.store.has_grown()

    def has(self, name: str) -> bool:
        """Whether there is an image of that name, whole or not."""
        return self._path(name).exists()

    def touch(self, name: str) -> Path:
        """Note that the image of that name is used, and give its path."""
        path = self._path(name)
        self.store.touched.add(path)
        return path

    def image(self, name: str, render: Callable[[], Image]) -> Image:
        """The image of that name, read if it is there and whole, else rendered and kept.

        While another process renders into this shelf, this one waits for it and calls the store's `waiting`.
        """
        path = self.touch(name)
        while True:
            found, _ = whole_image(path)
            if found is not None:
                return found
            with self._lock() as is_ours:
                if is_ours:
                    return self._rendered(path, render)
            self.store.waiting("waiting for another run, which renders the same truth", 0.0)
            time.sleep(POLL_SECONDS)

    def _rendered(self, path: Path, render: Callable[[], Image]) -> Image:
        """The image, by the only process that may write it: another one may have done so just before."""
        found, fault = whole_image(path)
        if found is not None:
            return found
        if fault:
            path.unlink(missing_ok=True)
            self.store.notes.append(f"Dropped from the store and rendered anew: {fault}")
        sweep(self.folder, self.store.in_use_since)
        image = render()
        self._keep(path, image)
        return image

    def _keep(self, path: Path, image: Image) -> None:
        while True:
            self.make()
            try:
                write_exr(path, image)
                return self.store.has_grown()
            except ImageError as error:
                if not isinstance(error.__cause__, FileNotFoundError):  # then another process has removed the folder
                    raise

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.exr"

    @contextmanager
    def _lock(self) -> Iterator[bool]:
        """Whether no other process renders into this shelf, nor will within the block."""
        self.make()
        try:
            handle = os.open(self.folder, os.O_RDONLY)
        except FileNotFoundError:  # removed by another process in between
            yield False
            return
        try:
            yield _is_locked(handle) and _is_open(handle, self.folder)
        finally:
            os.close(handle)


def write_text(path: Path, text: str) -> None:
    """Write a whole file or none of it."""
    with beside_of(path) as beside:
        beside.write_text(text, encoding="utf-8")


@contextmanager
def beside_of(path: Path) -> Iterator[Path]:
    """A temporary file, which takes the place of `path` at the end of the block."""
    beside = path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")
    try:
        yield beside
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def whole_image(path: Path) -> tuple[Image | None, str]:
    """The image of that file, or else what is wrong with it; neither if there is no such file."""
    if not path.exists():
        return None, ""
    try:
        found = read_exr(path)
    except ImageError as error:
        return None, str(error) if path.exists() else ""
    return (found, "") if found.provenance else (None, f"{path}: the note about its origin is missing.")


def _is_locked(handle: int) -> bool:
    """Try to lock an open file or folder; where the file system knows no locks, it counts as locked."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def _is_open(handle: int, path: Path) -> bool:
    """Whether `path` is what was opened as `handle`: it may have been removed and made again since."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except FileNotFoundError:
        return False


@contextmanager
def runs_of(root: Path) -> Iterator[Path]:
    """The folder of the present runs; none begins within the block."""
    runs = root / "runs"
    runs.mkdir(parents=True, exist_ok=True)
    handle = os.open(runs, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield runs
    finally:
        os.close(handle)


def oldest_run(runs: Path) -> float:
    """When the oldest of the present runs began. The files of those that were killed are removed."""
    oldest = time.time()
    for mark in runs.glob("*.run"):
        try:
            handle = os.open(mark, os.O_RDONLY)
        except FileNotFoundError:  # this run has just ended
            continue
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            mark.unlink(missing_ok=True)
        except BlockingIOError:
            oldest = min(oldest, os.fstat(handle).st_mtime)
        except OSError:
            return time.time() - LONGEST_RUN_SECONDS
        finally:
            os.close(handle)
    return oldest


def _end_run(handle: int, mark: Path) -> None:
    mark.unlink(missing_ok=True)
    os.close(handle)


def sweep(folder: Path, in_use_since: float) -> None:
    """Remove what processes that were killed had not written to its end."""
    with suppress(FileNotFoundError):  # the folder may be removed meanwhile
        for path in (*folder.glob(TEMPORARY), *folder.glob(f"images/{TEMPORARY}")):
            if path.stat().st_mtime < in_use_since:
                path.unlink()


def time_of(path: Path) -> float:
    """When a file was last written or marked as used; 0 if it is gone."""
    try:
        return path.stat().st_mtime
    except FileNotFoundError:
        return 0.0
