"""Which scenes and which of their checks are meant by the arguments of a command."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from comparisons.baseline import read_accepted
from comparisons.expression import Keep, keep_of
from comparisons.own import NO_OWN, Own
from comparisons.parity import checks_of
from comparisons.request import Request, id_of, request_of
from comparisons.scene_files import SceneFile, find
from comparisons.shards import Shard, deal
from comparisons.validate import require_sound, same_name
from reference.quantities import effect_of
from scenes.checks import Check
from scenes.errors import InputError
from scenes.load import load_scene


@dataclass(frozen=True)
class Broken:
    """A scene of which nothing can be run, and why; `argument` names it on a command line."""

    scene: str
    argument: str
    message: str


@dataclass(frozen=True)
class Selection:
    """What to run.

    requests : the scenes with the chosen checks
    broken : those of which nothing can be run
    scenes : the names of all of them, in order, other shards' too
    passed_over : TOML files that hold no scene
    keep, shard : the expression and the part that were asked for
    """

    requests: tuple[Request, ...]
    broken: tuple[Broken, ...]
    scenes: tuple[str, ...]
    passed_over: tuple[Path, ...]
    keep: str
    shard: Shard | None = None

    @property
    def every_check(self) -> tuple[Check, ...]:
        return tuple(check for request in self.requests for check in request.checks)

    @property
    def checks(self) -> int:
        return len(self.every_check)

    def to_json(self) -> dict[str, Any]:
        """What results.json says about it: `merge` puts shards together by that."""
        return {
            "scenes": list(self.scenes),
            "keep": self.keep,
            "shard": str(self.shard) if self.shard else None,
            "broken": [vars(broken) for broken in self.broken],
        }


def names_of(check_id: str, quantity: str) -> tuple[str, ...]:
    """What `-k` may call a check: scene/technique[settings], where $ stands for the end, its effect, its quantity."""
    return f"{check_id}$", effect_of(quantity), quantity


def choose(arguments: Sequence[str], keep: str = "", shard: Shard | None = None, own: Own = NO_OWN) -> Selection:
    """The scenes that the arguments name, all shipped ones if there are none, with the checks that `keep` keeps.

    A scene that cannot be read, or whose checks cannot be run, is broken and stops no other. With techniques of a
    user's `own`, an empty `keep` keeps their checks alone.

    Raises
    ------
    InputError
        An argument names nothing, the expression is none, all scenes are broken, no check is left, or there are fewer
        scenes than shards.
    """
    kept = keep_of(keep or own.keep)
    found = find(arguments)
    accepted = cache(_fault_of_accepted)
    loaded = [_loaded(file, kept, accepted, own) for file in _named_once(found.scenes)]
    chosen = [one for one in loaded if isinstance(one, Broken) or one.checks]
    whole = Selection(
        tuple(one for one in chosen if isinstance(one, Request)),
        tuple(one for one in chosen if isinstance(one, Broken)),
        tuple(dict.fromkeys(map(_name, chosen))),
        found.passed_over,
        keep or own.keep,
    )
    if not whole.requests and whole.broken:
        raise InputError("\n".join(broken.message for broken in whole.broken))
    if not whole.requests and own.names and not keep:
        raise own.nothing_chosen(arguments)
    if not whole.requests:
        raise InputError(
            f"No check of {', '.join(arguments) or 'the shipped scenes'} matches '{keep}'. See `lightgauge list` and "
            "`lightgauge explain SCENE`."
        )
    return _part(whole, shard) if shard else whole


def select(arguments: Sequence[str], keep: str, own: Own = NO_OWN) -> list[Request]:
    """As `choose`, but no scene may be broken.

    Raises
    ------
    InputError
        As there, or a scene is broken.
    """
    chosen = choose(arguments, keep, own=own)
    if chosen.broken:
        raise InputError("\n".join(broken.message for broken in chosen.broken))
    return list(chosen.requests)


def _named_once(files: Iterable[SceneFile]) -> Iterable[SceneFile | Broken]:
    """Results go by the name of the scene: the second one of a name is broken."""
    first: dict[str, SceneFile] = {}
    for file in files:
        if file is first.setdefault(file.name, file):
            yield file
        else:
            yield Broken(file.name, file.argument, same_name(file.argument, first[file.name].argument))


def _loaded(
    file: SceneFile | Broken, keep: Keep, fault_of_accepted: Callable[[Path], str], own: Own
) -> Request | Broken:
    if isinstance(file, Broken):
        return file
    try:
        scene = own.added_to(load_scene(file.path))
        kept = {name for check in checks_of(scene) if keep(names_of(name := _id(scene.name, check), check.quantity))}
        request = request_of(scene, file.argument, kept.__contains__)
        require_sound(request)
    except InputError as error:
        return Broken(file.name, file.argument, str(error))
    fault = fault_of_accepted(scene.folder) if request.checks else ""
    return Broken(file.name, file.argument, fault) if fault else request


def _id(scene: str, check: Check) -> str:
    return f"{scene}/{id_of(check)}"


def _fault_of_accepted(folder: Path) -> str:
    try:
        read_accepted(folder)
    except InputError as error:
        return str(error)
    return ""


def _name(one: Request | Broken) -> str:
    return one.scene if isinstance(one, Broken) else one.scene.name


def _part(whole: Selection, shard: Shard) -> Selection:
    """The scenes of one shard."""
    if len(whole.scenes) < shard.count:
        raise InputError(
            f"--shard {shard}: found {len(whole.scenes)} scene{'s' if len(whole.scenes) > 1 else ''} to share out; "
            f"allowed: at most as many shards. Ask for fewer, or run them without --shard."
        )
    weights = {broken.scene: 1 for broken in whole.broken} | {r.scene.name: len(r.checks) for r in whole.requests}
    dealt = deal(weights, shard.count)
    return replace(
        whole,
        requests=tuple(r for r in whole.requests if dealt[r.scene.name] == shard.index),
        broken=tuple(b for b in whole.broken if dealt[b.scene] == shard.index),
        shard=shard,
    )
