"""Accept the errors of a finished run: later runs are held against them."""

import shlex
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

from comparisons.baseline import FILE_NAME, Accepted, accepted_of, measured_text, read_accepted, text_of
from comparisons.expression import keep_of
from comparisons.gate import Verdict
from comparisons.parity import checks_of
from comparisons.request import id_of
from comparisons.result import SCHEMA, CheckResult
from comparisons.results import read_run
from comparisons.selection import names_of
from reference.store import write_text
from scenes.errors import InputError
from scenes.load import find_scene, load_scene
from scenes.model import Scene

ACCEPTABLE = (Verdict.PASS, Verdict.REGRESSED)

SHORTEST_REASON = 8
"""Characters, as for the reason of a budget."""


def accept_lines(run: Path, reason: str, keep: str) -> Iterator[str]:
    """Accept what a run measured, in the file beside each scene, and say what has changed there.

    Parameters
    ----------
    run : the folder of a finished run, or its results.json. Scenes are looked for as they were named for it.
    reason : why these errors are as they should be.
    keep : only checks that this expression keeps, as `comparisons.expression.keep_of` has it.

    Raises
    ------
    InputError
        There is no such run, none of its checks can be accepted, the expression is none, the reason is too short, or a
        scene or a file of accepted errors cannot be read. Nothing is written then.
    """
    why = " ".join(reason.split())
    if len(why) < SHORTEST_REASON:
        raise InputError(
            f"The reason '{why}' is too short. Give a sentence of at least {SHORTEST_REASON} characters that tells why "
            'these errors are accepted: --reason "...".'
        )
    kept = keep_of(keep)
    chosen = [(name, result) for name, result in _results(run) if kept(names_of(result.id, result.quantity))]
    taken = [(name, result) for name, result in chosen if result.verdict in ACCEPTABLE]
    _require_some(taken, [result for _, result in chosen], run, keep)
    scenes = {name: load_scene(find_scene(name)) for name, _ in taken}
    entries = {scene.folder.resolve(): read_accepted(scene.folder) for scene in scenes.values()}
    for _, result in chosen:
        if result.verdict not in ACCEPTABLE:
            yield f"left out {result.id}: it is {result.verdict}, and only an error within its budget can be accepted"
    today = datetime.now(UTC).date()
    for argument, scene in scenes.items():
        results = [result for name, result in taken if name == argument]
        folder = scene.folder.resolve()
        before = entries[folder]
        entries[folder] = updated(scene, before, {r.id: accepted_of(r, why, today) for r in results})
        yield from _changes(before, entries[folder], results)
    for folder, accepted in entries.items():
        write_text(folder / FILE_NAME, text_of(accepted))
        yield f"{folder / FILE_NAME} holds {len(accepted)} accepted error{'' if len(accepted) == 1 else 's'} now."


def updated(scene: Scene, before: Mapping[str, Accepted], new: Mapping[str, Accepted]) -> dict[str, Accepted]:
    """The entries of a folder after some checks of one of its scenes were accepted.

    Those of other scenes stay, those of checks that the scene no longer has go. An entry whose numbers are the same
    keeps its date and reason.
    """
    own = {f"{scene.name}/{id_of(check)}" for check in checks_of(scene)}
    stay = {name: entry for name, entry in before.items() if name in own or not name.startswith(f"{scene.name}/")}
    return stay | {name: _kept_if_same(before.get(name), entry) for name, entry in new.items() if name in own}


def _kept_if_same(before: Accepted | None, new: Accepted) -> Accepted:
    if before is not None and (before.criteria, before.spp, before.renderer) == (new.criteria, new.spp, new.renderer):
        return before
    return new


def _changes(
    before: Mapping[str, Accepted], after: Mapping[str, Accepted], results: Iterable[CheckResult]
) -> Iterator[str]:
    for result in results:
        if result.id not in after:
            yield f"left out {result.id}: the scene no longer has this check"
        elif before.get(result.id) == after[result.id]:
            yield f"unchanged {result.id}: accepted on {after[result.id].date}"
        else:
            yield f"accepted {result.id}: {_change(before.get(result.id), after[result.id], result.unit)}"
    yield from (f"dropped {name}: the scene no longer has this check" for name in before if name not in after)


def _change(before: Accepted | None, after: Accepted, unit: str) -> str:
    old = {} if before is None else before.criteria
    return "; ".join(
        f"{metric} {measured_text(metric, old[metric], unit) if metric in old else 'none'} -> "
        f"{measured_text(metric, measured, unit)}"
        for metric, measured in after.criteria.items()
    )


def _require_some(
    taken: Iterable[tuple[str, CheckResult]], chosen: Iterable[CheckResult], run: Path, keep: str
) -> None:
    if any(taken):
        return
    verdicts = ", ".join(f"{result.id} is {result.verdict}" for result in chosen)
    if not verdicts:
        raise InputError(f"No check in '{run}' matches '{keep}'. Give a part of a name that its results.json holds.")
    raise InputError(
        f"Nothing in '{run}' can be accepted: {verdicts}. Only an error within its budget can be; mend the technique, "
        "or change the budget and run the checks again."
    )


def _results(run: Path) -> list[tuple[str, CheckResult]]:
    """The checks of a run, each with what named its scene on the command line."""
    _, results = read_run(run)
    try:
        if results["schema"] != SCHEMA:
            raise ValueError(f"schema {results['schema']!r}, this version reads {SCHEMA}")
        return [(_scene_argument(str(check["rerun"])), CheckResult.from_json(check)) for check in results["checks"]]
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise InputError(
            f"The results in '{run}' are those of another version, or damaged ({type(error).__name__}: {error}). Run "
            "the checks again."
        ) from error


def _scene_argument(rerun: str) -> str:
    """The scene in the command that runs a check again: lightgauge run SCENE -k TEXT."""
    return shlex.split(rerun)[2]
