"""The store seen from outside: what it holds, what is removed when it grows too large, what another adds to it."""

import json
import os
import re
import shutil
import stat
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from reference.store import (
    TIDIED,
    Shelf,
    Store,
    beside_of,
    oldest_run,
    runs_of,
    sweep,
    time_of,
    whole_image,
    write_text,
)
from scenes.digest import digest_of
from scenes.exr import ATTRIBUTE

HEADER_BYTES = 1 << 16
"""Holds all that comes before the pixels of an image."""

KEY = re.compile(r"[0-9a-f]{64}")
CONTENT = ("check.json", "images/*.png", "images/*.exr", "*.exr", "key.json")
"""What the store writes on a shelf, in the order of removal: half of a check would be of no use to anyone."""

KERNELS = "kernels/*.bin"


@dataclass(frozen=True)
class Record:
    """What is kept, and removed, as a whole: a shelf, or a compiled kernel.

    key    : digest of what it depends on; for a kernel the name of its file
    kind   : what it is
    what   : SCENE/QUANTITY, SCENE/CHECK, or as much of it as is known
    files  : those that the store itself has written
    size   : of these, in bytes
    spp    : samples a pixel, of the truth that it is or that it was judged against; 0 if exact, None if it has none
    used   : when it was last used, in seconds since the epoch; a truth is used by what is judged against it
    truths : keys of the truths that a check was judged against
    """

    key: str
    kind: Literal["truth", "check", "kernel"]
    what: str
    files: tuple[Path, ...]
    size: int
    spp: int | None
    used: float
    truths: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Eviction:
    """What was removed, least recently used first, and the bytes that are left."""

    removed: tuple[Record, ...]
    left: int


def inventory(store: Store) -> list[Record]:
    """Everything that the store has written, in no order. What others put there is not looked at."""
    records = []
    for folder in _shelf_folders(store.root):
        with suppress(FileNotFoundError):  # removed by another process in between
            records += _shelf_record(folder)
    for path, status in _files(store.root, KERNELS).items():
        records.append(Record(path.name, "kernel", "compiled kernel", (path,), status.st_size, None, status.st_mtime))
    used: dict[str, float] = {}
    for record in records:
        used |= {key: max(used.get(key, 0.0), record.used) for key in record.truths}
    return [replace(record, used=max(record.used, used.get(record.key, 0.0))) for record in records]


def evict(store: Store, limit_bytes: int) -> Eviction:
    """Remove what was used least recently until at most `limit_bytes` are left, and what killed processes left behind.

    What has been used since the oldest of the present runs began stays, whatever the limit; runs that are about to
    begin wait.
    """
    with runs_of(store.root) as runs:
        in_use_since = oldest_run(runs)
        for folder in _shelf_folders(store.root):
            sweep(folder, in_use_since)
        records = inventory(store)
        left = sum(record.size for record in records)
        removed = []
        for record in sorted(records, key=lambda r: (r.used, r.kind)):  # a check goes before its truth
            if left > limit_bytes and max(record.used, time_of(record.files[-1])) < in_use_since:
                _remove(record)
                removed.append(record)
                left -= record.size
        return Eviction(tuple(removed), left)


def tidy(store: Store, limit_bytes: int) -> Eviction | None:
    """As `evict`, unless nothing has been written since that last left no more than `limit_bytes`: then None."""
    mark = store.root / TIDIED
    limit = _json_of(mark).get("limit")
    if isinstance(limit, int) and limit <= limit_bytes:
        return None
    write_text(mark, json.dumps({"limit": limit_bytes}))  # first: whatever is written meanwhile takes it away
    done = evict(store, limit_bytes)
    if done.left > limit_bytes:
        store.has_grown()
    return done


def merge(store: Store, other: Path) -> int:
    """Copy the images and finished checks that another store holds and this one does not; how many they were.

    An image is kept only if its pixels match their checksum; the store's `notes` name what is damaged and was skipped.
    """
    return sum(_merge_shelf(store, folder) for folder in _shelf_folders(other))


def _shelf_folders(root: Path) -> list[Path]:
    return sorted(p for p in root.glob("??/*") if KEY.fullmatch(p.name) and p.name[:2] == p.parent.name and p.is_dir())


def _files(folder: Path, *patterns: str) -> dict[Path, os.stat_result]:
    """The plain files that match, in the order of the patterns."""
    found = {}
    for path in (path for pattern in patterns for path in sorted(folder.glob(pattern))):
        with suppress(FileNotFoundError):
            status = path.lstat()
            if stat.S_ISREG(status.st_mode):
                found[path] = status
    return found


def _shelf_record(folder: Path) -> list[Record]:
    """What stands on a shelf: one record, or none if the store has written nothing there."""
    files = _files(folder, *CONTENT)
    if not files:
        return []
    parts, check = _json_of(folder / "key.json"), _json_of(folder / "check.json")
    size = sum(status.st_size for status in files.values())
    used = time_of(folder / "key.json") or folder.stat().st_mtime
    if "check" in parts or check:
        what, spp = _said_of_check(parts, check)
        truths = frozenset(Path(path).parent.name for path in _dict_of(check.get("inputs")))
        return [Record(folder.name, "check", what, tuple(files), size, spp, used, truths)]
    what, spp = _said_of_truth(parts, [path for path in files if path.suffix == ".exr"])
    return [Record(folder.name, "truth", what, tuple(files), size, spp, used)]


def _said_of_check(parts: dict[str, Any], check: dict[str, Any]) -> tuple[str, int | None]:
    """Name and samples a pixel of a check, the latter None while it is not finished."""
    result = _dict_of(check.get("result"))
    name = result.get("id") or _dict_of(parts.get("check")).get("technique") or "unknown"
    return str(name), _count_of(result["spp"]) if "spp" in result else None


def _said_of_truth(parts: dict[str, Any], images: list[Path]) -> tuple[str, int | None]:
    """Name and samples a pixel of a truth, the latter None while nothing of it is rendered."""
    origins = [_origin(path) for path in images]
    scene = next((str(origin["scene"]) for origin in origins if "scene" in origin), "")
    name = "/".join(filter(None, (scene, str(parts.get("quantity") or "unknown"))))
    spp_each = sum(_count_of(origin.get("spp")) for origin in origins)
    return name, spp_each * _count_of(parts.get("accumulators", 1)) if images else None


def _origin(path: Path) -> dict[str, Any]:
    """What an image says about its origin, {} if nothing. Its pixels are not read, and may be damaged."""
    try:
        with path.open("rb") as file:
            _, _, rest = file.read(HEADER_BYTES).partition(f"{ATTRIBUTE}\0string\0".encode())
    except OSError:
        return {}
    length = int.from_bytes(rest[:4], "little")
    return _dict_of(_parsed(rest[4 : 4 + length]).get("provenance"))


def _json_of(path: Path) -> dict[str, Any]:
    """The JSON object in a file; {} if there is none."""
    try:
        return _parsed(path.read_bytes())
    except OSError:
        return {}


def _parsed(text: bytes) -> dict[str, Any]:
    try:
        return _dict_of(json.loads(text))
    except (ValueError, RecursionError):
        return {}


def _dict_of(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _count_of(value: Any) -> int:
    return value if isinstance(value, int) else 0


def _remove(record: Record) -> None:
    """Remove what the store has written, and the folders that this leaves empty."""
    for path in record.files:
        path.unlink(missing_ok=True)
    if record.kind != "kernel":
        folder = record.files[-1].parent
        for emptied in (folder / "images", folder):
            with suppress(OSError):
                emptied.rmdir()


def _merge_shelf(store: Store, folder: Path) -> int:
    files = _files(folder, "*.exr", "check.json")
    if not files:
        return 0
    parts = _json_of(folder / "key.json")
    if not _depends_on(folder.name, parts):
        store.notes.append(f"Not merged: {folder / 'key.json'} is missing or damaged, so nothing tells what is there.")
        return 0
    shelf = store.shelf(parts)
    missing = [path for path in files if not (shelf.folder / path.name).exists()]
    return sum(_merge_check(shelf, path) if path.suffix == ".json" else _merge_image(shelf, path) for path in missing)


def _depends_on(key: str, parts: dict[str, Any]) -> bool:
    try:
        return digest_of(parts) == key
    except ValueError:  # NaN, which no key holds
        return False


def _merge_image(shelf: Shelf, source: Path) -> bool:
    image, fault = whole_image(source)
    if image is None:
        shelf.store.notes.append(f"Not merged: {fault}")
        return False
    shelf.image(source.stem, lambda: image)
    return True


def _merge_check(shelf: Shelf, source: Path) -> bool:
    if not _json_of(source):
        shelf.store.notes.append(f"Not merged: {source} is damaged.")
        return False
    (shelf.folder / "images").mkdir(exist_ok=True)
    for path in (*_files(source.parent, "images/*.png", "images/*.exr"), source):
        with beside_of(shelf.folder / path.relative_to(source.parent)) as beside:
            shutil.copyfile(path, beside)
    shelf.store.has_grown()
    return True
