"""What was found in files, remembered from run to run while their size, times and inode number stay the same.

That is how git tells which files have changed. A file that was written while it was read, or so shortly before that
its clock could not tell a second writing from the first, is not remembered. What another version of this program has
found is not believed either: each answer is kept with the digest of the module that gave it. What none of this sees is
a disk that alters bytes by itself: whoever reads the pixels of an image checks them against the checksum in it.
"""

import hashlib
import json
import sys
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

SETTLED_SECONDS = 2.0
"""The coarsest clock of a common file system, FAT, ticks that often."""

Stamp = list[int]

_facts: dict[str, dict[str, Any]] = {}
"""By the whole path of a file: its `stamp`, and by the name of each question whose code answered it, and the answer."""

_recalled: set[Path] = set()
_changed: set[str] = set()


def about(path: Path, question: str, answer: Callable[[Path], Any]) -> Any:
    """What `answer` finds in a file, JSON-able, found again as long as the file and the module of `answer` stay.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    name = str(path.absolute())
    stamp = _stamp(path)
    fact = _facts.get(name)
    version = _code_of(answer.__module__)
    if fact is not None and fact["stamp"] == stamp:
        match fact.get(question):
            case [by, found] if by == version:
                return found
    before = time.time_ns()
    found = answer(path)
    is_settled = max(stamp[1:3]) < before - SETTLED_SECONDS * 1e9 and _stamp(path) == stamp
    if is_settled:
        kept = fact if fact is not None and fact["stamp"] == stamp else {"stamp": stamp}
        _facts[name] = kept | {question: [version, found]}
        _changed.add(name)
    return found


def recall(file: Path) -> None:
    """Take up what another process has kept; nothing if the file is not there or damaged."""
    if file not in _recalled:
        _recalled.add(file)
        with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
            kept = json.loads(file.read_text(encoding="utf-8"))
            sound = {name: fact for name, fact in kept.items() if isinstance(fact["stamp"], list)}
            _facts.update({name: fact for name, fact in sound.items() if name not in _facts})


def keep(file: Path) -> None:
    """Write what is known of the files that are still there, unless nothing was learnt."""
    if _changed:
        _changed.clear()
        beside = file.with_name(f".{file.name}.{uuid.uuid4().hex}.tmp")
        there = {name: fact for name, fact in _facts.items() if Path(name).exists()}
        beside.write_text(json.dumps(there, separators=(",", ":")), encoding="utf-8")
        beside.replace(file)


@cache
def _code_of(module: str) -> str:
    """Digest of the file of a module that was imported."""
    return hashlib.sha256(Path(str(sys.modules[module].__file__)).read_bytes()).hexdigest()


def _stamp(path: Path) -> Stamp:
    """Size, time of the last change of the content and of anything about the file, both in ns, and inode number."""
    status = path.stat()
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]
