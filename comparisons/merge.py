"""Put the shards of a run together: the results are those of the run in one piece."""

import shutil
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from comparisons.report.names import stems_of
from comparisons.result import CheckResult
from comparisons.results import read_run, shown_at
from comparisons.selection import Broken
from comparisons.shards import Shard, parse_shard
from scenes.errors import InputError

NEEDED = ("scenes", "started", "seconds", "counts", "store_note", "jobs", "idle_overrides")
"""What the common results.json has from those of the shards, besides the checks and broken scenes."""

MUST_AGREE = {"lightgauge": "version of lightgauge", "commit": "commit"}
"""What all shards have in common, or they measured different things."""


@dataclass(frozen=True)
class Part:
    """The results of one shard, and the folder that its pictures are relative to."""

    folder: Path
    shard: Shard
    results: dict[str, Any]
    checks: tuple[CheckResult, ...]
    broken: tuple[Broken, ...]

    @property
    def scenes(self) -> set[str]:
        return {check.scene for check in self.checks} | {broken.scene for broken in self.broken}


@dataclass(frozen=True)
class Merged:
    """The content of the common results.json, and what it is made of."""

    content: dict[str, Any]
    checks: tuple[CheckResult, ...]
    broken: tuple[Broken, ...]
    notes: tuple[str, ...]


def read_part(run: Path) -> Part:
    """A shard, named by the folder of its run or its results.json.

    Raises
    ------
    InputError
        There are no results, or they are not those of a shard.
    """
    folder, results = read_run(run)
    shard = results.get("shard")
    if shard is None:
        raise InputError(f"'{run}' is a run, but none of its shards. Make them with `lightgauge run --shard I/N`.")
    try:
        if missing := [key for key in NEEDED if key not in results]:
            raise KeyError(", ".join(missing))
        checks = tuple(CheckResult.from_json(check) for check in results["checks"])
        broken = tuple(Broken(**one) for one in results["broken"])
        return Part(folder, parse_shard(str(shard)), results, checks, broken)
    except (KeyError, TypeError, ValueError, AttributeError, InputError) as error:
        raise InputError(
            f"The results in '{run}' are those of another version, or damaged ({type(error).__name__}: {error}). Run "
            "this shard again."
        ) from error


def merge(parts: Sequence[Part]) -> Merged:
    """The shards of one run, in any order, as one.

    Checks are in the order of the run in one piece. It begins when the first shard began, and takes the seconds of all.

    Raises
    ------
    InputError
        A shard is missing or there twice, or they are not of the same run.
    """
    parts = sorted(parts, key=lambda part: part.shard.index)
    _require_one_run(parts)
    _require_all(parts)
    _require_each_scene_once(parts)
    first = parts[0].results
    place = {name: index for index, name in enumerate(first["scenes"])}
    plain = sorted(chain.from_iterable(part.results["checks"] for part in parts), key=lambda one: place[one["scene"]])
    checks = _with_names_apart(
        sorted(chain.from_iterable(part.checks for part in parts), key=lambda one: place[one.scene])
    )
    broken = sorted(chain.from_iterable(part.broken for part in parts), key=lambda one: place[one.scene])
    noted = [part.results["store_note"] for part in parts if part.results["store_note"]]
    notes = (*noted, *_differences(parts))
    content = first | {
        "environment": _environment(parts),
        "started": min(part.results["started"] for part in parts),
        "seconds": sum(part.results["seconds"] for part in parts),
        "counts": {verdict: sum(part.results["counts"][verdict] for part in parts) for verdict in first["counts"]},
        "store_note": " ".join(notes) or None,
        "checks": [one | {"images": check.images} for one, check in zip(plain, checks, strict=True)],
        "shard": None,
        "broken": [vars(one) for one in broken],
        "jobs": max(part.results["jobs"] for part in parts),
        "idle_overrides": _idle(parts),
    }
    return Merged(content, checks, tuple(broken), notes)


def _with_names_apart(checks: Sequence[CheckResult]) -> tuple[CheckResult, ...]:
    """The checks with their pictures where the run in one piece has them."""
    stems = stems_of(check.id for check in checks)
    return tuple(replace(check, images=shown_at(stem, check.images)) for check, stem in zip(checks, stems, strict=True))


def _idle(parts: Sequence[Part]) -> dict[str, int]:
    """Budgets for a renderer that no shard drew with."""
    idle = sum((Counter(part.results["idle_overrides"]) for part in parts), Counter[str]())
    used = {criterion.renderer for part in parts for check in part.checks for criterion in check.criteria}
    return {renderer: count for renderer, count in sorted(idle.items()) if renderer not in used}


def require_other(parts: Sequence[Part], folder: Path) -> None:
    """See that the common report does not take the place of a shard.

    Raises
    ------
    InputError
        It would.
    """
    for part in parts:
        if part.folder.resolve() == folder.resolve():
            raise InputError(
                f"'{folder}' holds shard {part.shard}. Name another folder for all of them with -o FOLDER."
            )


def copy_pictures(parts: Sequence[Part], merged: Merged, folder: Path) -> None:
    """Copy all that the checks show into the folder of the common report.

    Raises
    ------
    InputError
        A file is missing.
    """
    targets = {check.id: check.images for check in merged.checks}
    for part in parts:
        for path, target in (
            (path, folder / targets[check.id][name]) for check in part.checks for name, path in check.images.items()
        ):
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                shutil.copyfile(part.folder / path, target)
            except FileNotFoundError as error:
                raise InputError(
                    f"Shard {part.shard} in '{part.folder}' lacks the file {path}. Keep the whole folder of its run, "
                    "with images/ and pixels/."
                ) from error


def _require_one_run(parts: Sequence[Part]) -> None:
    """See that the shards were made by the same command from the same files."""
    first = parts[0]
    for part in parts[1:]:
        pairs: list[tuple[str, Any, Any]] = [("number of shards", first.shard.count, part.shard.count)]
        pairs += [(f"choice of {key}", first.results.get(key), part.results.get(key)) for key in ("scenes", "keep")]
        pairs += [(what, _versions(first).get(key), _versions(part).get(key)) for key, what in MUST_AGREE.items()]
        for what, one, other in pairs:
            if one != other:
                raise InputError(
                    f"'{first.folder}' and '{part.folder}' are no shards of one run: they differ in the {what} "
                    f"({_short(one)}; {_short(other)}). Run all shards with the same command, from the same commit."
                )


def _short(value: Any) -> str:
    return f"{len(value)} scenes" if isinstance(value, list) else repr(value)


def _require_all(parts: Sequence[Part]) -> None:
    found = Counter(part.shard.index for part in parts)
    count = parts[0].shard.count
    twice = [f"{index}/{count}" for index in sorted(found) if found[index] > 1]
    missing = [f"{index}/{count}" for index in range(1, count + 1) if index not in found]
    if twice:
        folders = ", ".join(f"'{part.folder}'" for part in parts if f"{part.shard}" in twice)
        raise InputError(f"{_shards(twice)} there more than once: {folders}. Name each shard once.")
    if missing:
        raise InputError(
            f"{_shards(missing)} missing. Name the folders of all {count} runs; a run that was cut off goes on where "
            "it stopped when its command is given again."
        )


def _shards(names: Sequence[str]) -> str:
    return f"Shard {names[0]} is" if len(names) == 1 else f"Shards {', '.join(names)} are"


def _require_each_scene_once(parts: Sequence[Part]) -> None:
    found = Counter(chain.from_iterable(part.scenes for part in parts))
    whole = parts[0].results["scenes"]
    wrong = [name for name in whole if found[name] != 1] + [name for name in found if name not in whole]
    if wrong:
        raise InputError(
            f"These scenes are not in exactly one of the shards: {', '.join(wrong)}. The shards were made from "
            "different scene files; run all of them from the same commit."
        )


def _versions(part: Part) -> Mapping[str, Any]:
    return part.results.get("environment") or {}


def _environment(parts: Sequence[Part]) -> dict[str, Any]:
    """What holds for all shards; where they differ, all that was found."""
    return {key: _joined(_found(parts, key)) for key in _versions(parts[0])}


def _found(parts: Sequence[Part], key: str) -> dict[Any, list[str]]:
    """Each value with the shards that have it. Several OpenGL renderers of one shard are values of their own."""
    found: dict[Any, list[str]] = {}
    for part in parts:
        value = _versions(part).get(key)
        for one in value.split("; ") if key == "gl_renderer" and value else [value]:
            found.setdefault(one, []).append(str(part.shard))
    return found


def _joined(found: Mapping[Any, Any]) -> Any:
    known = [value for value in found if value is not None]
    return "; ".join(sorted(map(str, known))) if len(known) > 1 else next(iter(known), None)


def _differences(parts: Sequence[Part]) -> Iterator[str]:
    """One sentence for each thing in which the machines of the shards differed."""
    for key in _versions(parts[0]):
        found = {value: shards for value, shards in _found(parts, key).items() if value is not None}
        if len(found) > 1:
            each = "; ".join(f"{value} ({', '.join(shards)})" for value, shards in found.items())
            yield f"The shards differ in {key}: {each}."
