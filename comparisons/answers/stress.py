"""Stresses in words: a table of who breaks where, what is new about it, and how to see it again."""

import importlib
import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from comparisons.code import library_versions, rendering_code
from comparisons.partial import Partial
from comparisons.report.stress_page import write_stress_page
from comparisons.results import environment
from comparisons.stress.limits import Standing, is_broken, standing, with_limit
from comparisons.stress.result import FILE_NAME, SCHEMA, Outcome
from comparisons.stress.tables import table_lines, tables
from realtime.context import environment_choice
from realtime.own import source_digest
from reference.store import write_text
from scenes.digest import PACKAGES_FOLDER, code_digest, digest_of
from scenes.errors import InputError, LightgaugeError, NoGraphics, unknown_name

MODULES = ("techniques", "intermediates", "functions")
"""Of comparisons.stress: what there is to be stressed."""

PARTIAL = "stress.partial.json"

Step = Callable[[str, float], None]


@dataclass(frozen=True)
class Subject:
    """All outcomes of one technique or function."""

    outcomes: tuple[Outcome, ...]


@dataclass(frozen=True)
class Part:
    """What of a module of `comparisons.stress` is to be done: `at` is the only magnitude, if there is one."""

    module: Any
    subjects: tuple[str, ...]
    stresses: tuple[str, ...]
    at: float | None

    def run(self, subject: str, step: Step) -> Subject:
        return Subject(tuple(self.module.outcomes([subject], step, self.stresses, self.at)))

    def key(self, subject: str) -> str:
        """What the outcomes of a subject depend on."""
        here = [PACKAGES_FOLDER / "comparisons" / name for name in ("stress", "glsl")]
        code = [rendering_code(), code_digest(*sorted(path for folder in here for path in folder.glob("*.py")))]
        asked = [self.module.__name__, subject, source_digest(subject), self.stresses, self.at]
        return digest_of(code, library_versions(), environment_choice(), asked)


def chosen(subjects: Sequence[str], stresses: Sequence[str], at: float | None) -> tuple[Part, ...]:
    """The parts that names and patterns mean; all where there are none.

    Raises
    ------
    InputError
        A name or a pattern means nothing, the subject of one cannot be put under the stress of the other, or `at` lies
        beyond a stress's range.
    """
    modules = [importlib.import_module(f"comparisons.stress.{name}") for name in MODULES]
    known = {module: (module.subjects(), list(module.STRESSES)) for module in modules}
    _require_known("technique or function", subjects, [name for names, _ in known.values() for name in names])
    _require_known("stress", stresses, [name for _, names in known.values() for name in names])
    made = [
        Part(module, tuple(_named(subjects, there)), tuple(_named(stresses, done)), at)
        for module, (there, done) in known.items()
    ]
    parts = tuple(part for part in made if part.subjects and part.stresses)
    _require_used(subjects, [name for part in parts for name in part.subjects], "is under none of these stresses")
    _require_used(stresses, [name for part in parts for name in part.stresses], "is for none of these subjects")
    if at is not None:
        for part in parts:
            _require_in_range(part, at)
    return parts


def _require_used(asked: Sequence[str], used: Sequence[str], what: str) -> None:
    for name in asked:
        if not _named([name], used):
            raise InputError(
                f"'{name}' {what}: shader functions, named FILE:FUNCTION, have stresses of their own "
                "(fp16, fp32, extremes, random); all others but fp16 are for techniques."
            )


def _require_in_range(part: Part, at: float) -> None:
    for stress in part.stresses:
        ladder = part.module.magnitudes(stress)
        if not min(ladder) <= at <= max(ladder):
            raise InputError(
                f"--at {at:g} is no magnitude of {stress}, which goes from {ladder[0]:g} to {ladder[-1]:g}. "
                "Give one in between, and name the stress that it is for with --stress."
            )


def _require_known(kind: str, asked: Sequence[str], known: Sequence[str]) -> None:
    for name in asked:
        if not _named([name], known):
            alike = [one for one in known if (":" in one) == (":" in name)]  # functions are many: FILE:FUNCTION
            raise unknown_name(kind, name, dict.fromkeys(alike))


def _named(patterns: Sequence[str], names: Sequence[str]) -> list[str]:
    return [name for name in names if not patterns or any(fnmatchcase(name, pattern) for pattern in patterns)]


def run_stress(parts: Sequence[Part], folder: Path, step: Step) -> tuple[list[str], int]:
    """Do it, write stress.json and its page into the folder; the table as lines of text, and the exit status.

    What is finished is kept, so that the same command goes on. A subject that cannot be drawn stops no other.

    Raises
    ------
    NoGraphics
        Nothing can be drawn on this machine.
    """
    started, clock = datetime.now(UTC).isoformat(timespec="seconds"), time.perf_counter()
    kept = Partial(folder / PARTIAL)
    found: list[Outcome] = []
    failed: list[tuple[str, LightgaugeError]] = []
    asked = [(part, subject) for part in parts for subject in part.subjects]
    for number, (part, name) in enumerate(asked):
        key = part.key(name)
        subject = kept.found(key, Subject)
        if subject is None:
            try:
                subject = part.run(name, lambda what, done, n=number: step(what, (n + done) / len(asked)))  # type: ignore[misc]
            except NoGraphics:
                raise
            except LightgaugeError as error:
                failed.append((name, error))
                continue
            kept.keep(key, subject)
        found.extend(map(with_limit, subject.outcomes))
    seconds = time.perf_counter() - clock
    content = content_of(found, meanings(parts), started, seconds)
    write_text(folder / FILE_NAME, json.dumps(content, indent=1, allow_nan=False))
    page = write_stress_page(folder, found, content)
    kept.remove()
    status = max([int(is_broken(found)), *(error.exit_status for _, error in failed)])
    without = [f"left out: {name}. {error}" for name, error in failed]
    return [*stress_lines(found), *without, f"{seconds:.0f} s; {page}"], status


def meanings(parts: Iterable[Part]) -> dict[str, str]:
    """What is done in each stress, in words."""
    return {name: str(part.module.STRESSES[name]) for part in parts for name in part.stresses}


def content_of(
    outcomes: Iterable[Outcome], stresses: Mapping[str, str], started: str, seconds: float
) -> dict[str, Any]:
    """The content of stress.json."""
    return {
        "schema": SCHEMA,
        "environment": environment([]) | {"gl_renderer": _renderer()},
        "started": started,
        "seconds": seconds,
        "stresses": dict(stresses),
        "outcomes": [outcome.to_json() | {"standing": standing(outcome).name} for outcome in outcomes],
    }


def _renderer() -> str:
    from realtime.context import make_context, renderer_name

    return renderer_name(make_context())


def stress_lines(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """The table, a line for all that is new, and counts."""
    for table in tables(outcomes):
        yield from table_lines(table)
        yield ""
    yield "-: holds to the end of its range   a number: the first magnitude that fails   n/a: cannot be put under it"
    yield "(a number): holds to there, and is refused with an explanation further on"
    yield "*: not documented, or earlier than is documented   +: holds further than is documented"
    for outcome in outcomes:
        yield from _news(outcome)
    counts = {kind: sum(standing(outcome) is kind for outcome in outcomes) for kind in Standing}
    yield ", ".join(f"{count} {kind.value}" for kind, count in counts.items() if count)


def _news(outcome: Outcome) -> Iterator[str]:
    kind = standing(outcome)
    if kind is Standing.BROKEN:
        before = "" if outcome.limit is None else f", documented from {outcome.limit:g} on"
        where = f"{outcome.subject}, {outcome.stress} at {outcome.first_failing:g}{before}"
        yield f"BROKEN {where}: {found_at_last(outcome)}"
        yield f"  again: {outcome.reproduce}"
    if kind is Standing.STALE:
        yield (
            f"STALE {outcome.subject}, {outcome.stress}: documented to break from {outcome.limit:g} on, but it holds "
            "there. Correct limits.toml."
        )


def found_at_last(outcome: Outcome) -> str:
    """What the last trial found, in words."""
    last = next((t for t in outcome.trials if t.magnitude == outcome.first_failing), outcome.trials[-1])
    error = "infinitely many" if last.error is None else f"{last.error:.2g}"
    return last.fault or f"{error} {outcome.unit}; {outcome.tolerance:g} is allowed"
