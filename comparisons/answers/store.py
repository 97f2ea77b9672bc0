"""The store in words: what it holds, what was removed from it, what was taken over."""

import re
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from reference.store import Store
from reference.upkeep import Eviction, Record, evict, inventory, merge
from scenes.errors import InputError

UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
SIZE = re.compile(r"(\d+(?:\.\d+)?) ?([KMGT]?)B?", re.IGNORECASE)
HEADINGS = ("scene/quantity or check", "kind", "spp", "size", "last used")
KINDS = {"truth": "truths", "check": "checks", "kernel": "compiled kernels"}
AGES = (("day", 86400), ("hour", 3600), ("minute", 60))

Row = tuple[str, str, str, str, str]


def parse_size(text: str) -> int:
    """Bytes of a size such as 500M or 1.5 GB, with decimal prefixes.

    Raises
    ------
    InputError
        It is not a size.
    """
    found = SIZE.fullmatch(text.strip())
    if found is None:
        raise InputError(
            f"'{text}' is not a size. Allowed is a number of bytes, or a number with K, M, G or T for a thousand, a "
            "million, and so on: 500M, 1.5G. Give one of these."
        )
    number, unit = found.groups()
    return round(float(number) * UNITS[unit.upper()])


def size_text(size: int) -> str:
    """A number of bytes as people read it: 999 B, 1.0 kB, 21.4 MB."""
    for unit, factor in (("TB", 10**12), ("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if size >= 0.9995 * factor:  # else 999,960 bytes would be 1000.0 kB
            return f"{size / factor:.1f} {unit}"
    return f"{size} B"


def age_text(seconds: float) -> str:
    """How long ago something was: 3 days ago."""
    for unit, length in AGES:
        count = int(seconds // length)
        if count > 0:
            return f"{count} {unit}{'s' if count > 1 else ''} ago"
    return "just now"


def inventory_lines(store: Store) -> Iterator[str]:
    """A table of what the store holds, what a limit would remove first at the top, then totals.

    Raises
    ------
    InputError
        There is no such folder.
    """
    _require_folder(store.root)
    records, now = sorted(inventory(store), key=lambda r: r.used), time.time()
    shelves, kernels = [r for r in records if r.kind != "kernel"], [r for r in records if r.kind == "kernel"]
    rows = [_row(r.what, r.kind, r.spp, [r], now) for r in shelves]
    if kernels:
        rows.append(_row(_count(kernels), "kernel", None, kernels, now))
    if rows:
        yield from _aligned([HEADINGS, *rows])
        yield ""
    yield f"'{store.root}' holds {size_text(_size(records))}{': ' if rows else ''}{_totals(records)}."


def prune(store: Store, limit_bytes: int) -> Iterator[str]:
    """Remove what was used least recently until the limit holds, and say what that was.

    Raises
    ------
    InputError
        There is no such folder.
    """
    _require_folder(store.root)
    done, now = evict(store, limit_bytes), time.time()
    for record in done.removed:
        if record.kind != "kernel":
            yield f"removed {record.what} ({record.kind}, {size_text(record.size)}, used {age_text(now - record.used)})"
    what = f": {_totals(done.removed)}" if done.removed else ""
    yield f"Removed {size_text(_size(done.removed))}{what}. '{store.root}' holds {size_text(done.left)} now."
    if done.left > limit_bytes:
        yield f"That is more than {size_text(limit_bytes)}, but present runs have used all of it."


def evicted_note(done: Eviction, limit_bytes: int) -> Iterator[str]:
    """What a run says when the store had grown too large; nothing if it had not."""
    if done.removed:
        yield (
            f"The store was larger than {size_text(limit_bytes)}: removed {size_text(_size(done.removed))} that had "
            "not been used for longest."
        )


def merge_lines(store: Store, other: Path) -> Iterator[str]:
    """Take over what another store holds and this one does not, and say how much that was and what was damaged.

    Raises
    ------
    InputError
        There is no such folder, or it is no store.
    """
    _require_folder(other)
    if not inventory(Store(other)):
        raise InputError(
            f"'{other}' holds no truth and no checks. Name a folder that was given to `lightgauge run --store`."
        )
    count = merge(store, other)
    yield from store.notes
    yield f"Images and finished checks taken over from '{other}' into '{store.root}': {count}."


def _require_folder(root: Path) -> None:
    if not root.is_dir():
        raise InputError(
            f"There is no store '{root}'. A run makes one; name the one that is meant with --store FOLDER."
        )


def _row(what: str, kind: str, spp: int | None, records: Sequence[Record], now: float) -> Row:
    said = "" if spp is None else f"{spp:,}" if spp else "exact"
    return what, kind, said, size_text(_size(records)), age_text(now - max(r.used for r in records))


def _aligned(rows: Sequence[Row]) -> Iterator[str]:
    """Columns as wide as their widest entry; numbers stand to the right."""
    what, kind, spp, size, _ = (max(map(len, column)) for column in zip(*rows, strict=True))
    for row in rows:
        yield f"{row[0]:{what}}  {row[1]:{kind}}  {row[2]:>{spp}}  {row[3]:>{size}}  {row[4]}"


def _totals(records: Iterable[Record]) -> str:
    """How many of each kind there are, and their size: 3 truths (21.4 MB), 9 checks (180.0 kB)."""
    kept = list(records)
    each = ([r for r in kept if r.kind == kind] for kind in KINDS)
    return ", ".join(f"{_count(some)} ({size_text(_size(some))})" for some in each if some)


def _count(records: Sequence[Record]) -> str:
    """How many there are of the kind that all of them have."""
    many = KINDS[records[0].kind]
    return f"{len(records)} {many if len(records) > 1 else many.removesuffix('s')}"


def _size(records: Iterable[Record]) -> int:
    return sum(r.size for r in records)
