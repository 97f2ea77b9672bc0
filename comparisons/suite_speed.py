"""How long a run takes: cold, warm, and after one change to a shader, a budget or a scene.

Every run is a process of its own on a copy of this program and of a store, in a temporary folder: nothing of the user's
is changed. The images of a store are copied by hard links where that is possible: they are only ever replaced.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.selection import Selection, choose
from realtime.code import shaders_of
from realtime.shader import GLSL
from reference.store import LONGEST_RUN_SECONDS
from scenes.checks import Check
from scenes.digest import PACKAGES_FOLDER
from scenes.errors import InputError, MachineError
from scenes.lines import key_lines
from scenes.load import LIBRARY

PACKAGES = ("scenes", "realtime", "reference", "comparisons")
RUN = "import sys; from comparisons.cli import main; sys.exit(main())"
HELP = "--help"

LINKED = (".exr", ".png", ".js")

REPEATS = 3
"""Of the runs that take seconds: the least of them is the time without what else the machine does."""

JUDGED_STATUSES = (0, 1, 2)
"""Exit statuses of a run that has judged all checks, whatever the verdicts."""

NUDGE = 1.001
"""What a budget and a field of view are multiplied by: another number, and hardly another picture."""

Step = Callable[[str, float], None]


@dataclass(frozen=True)
class Measured:
    """A run: what had changed before it, how long it took, and what was done anew.

    judged : checks that were judged anew, of `checks`
    truths : shelves of truth to which anything was rendered
    """

    what: str
    seconds: float
    checks: int
    judged: int
    truths: int


@dataclass(frozen=True)
class Bench:
    """A copy of the program, a store of its own, and the arguments that choose the checks."""

    folder: Path
    arguments: tuple[str, ...]

    @property
    def tree(self) -> Path:
        return self.folder / "program"

    @property
    def store(self) -> Path:
        return self.folder / "store"

    @property
    def library(self) -> Path:
        return self.tree / LIBRARY.relative_to(PACKAGES_FOLDER)

    def run(self, what: str) -> Measured:
        """Run the checks.

        Raises
        ------
        MachineError
            The run ended without having judged them.
        """
        before = _images_in(self.store)
        seconds = self.python(RUN, "run", *self.arguments, "--store", self.store, "-o", self.folder / "report")
        results = json.loads((self.folder / "report" / "results.json").read_bytes())
        judged = sum(not check["cached"] for check in results["checks"])
        truths = {path.parent for path in _images_in(self.store) - before}
        return Measured(what, seconds, len(results["checks"]), judged, len(truths))

    def python(self, program: str, *arguments: str | Path) -> float:
        """Seconds that a process of the copied program takes."""
        environment = os.environ | {"PYTHONPATH": str(self.tree)}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        clock = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-P", "-c", program, *map(str, arguments)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=LONGEST_RUN_SECONDS,
            check=False,
        )
        seconds = time.perf_counter() - clock
        if done.returncode not in JUDGED_STATUSES:
            raise MachineError(
                f"A run to be measured ended with status {done.returncode}: {(done.stderr or done.stdout)[-2000:]} "
                "Run the same checks with `lightgauge run` and mend what it says."
            )
        return seconds


def speeds(
    scenes: Sequence[str], keep: str, store: Path, folder: Path, is_cold: bool, step: Step
) -> Iterator[Measured]:
    """Measure the runs of some checks, one after the other.

    Parameters
    ----------
    scenes, keep : choose shipped scenes and their checks, as on the command line.
    store : is copied, so that what it holds need not be rendered; not used for a cold run.
    folder : an empty one, for everything that is written.

    Raises
    ------
    InputError
        No check is chosen, or one of a scene that does not ship.
    MachineError
        A run broke off.
    """
    chosen = choose(scenes, keep)
    if any(request.scene.folder != LIBRARY for request in chosen.requests):
        raise InputError("Only shipped scenes are measured, since one of them is changed on a copy. Name those.")
    bench = Bench(folder, (*scenes, *(("-k", keep) if keep else ())))
    for package in PACKAGES:
        shutil.copytree(PACKAGES_FOLDER / package, bench.tree / package, ignore=shutil.ignore_patterns("__pycache__"))
    yield _start_of(bench, step)
    if is_cold:
        step("cold: an empty store", 0.0)
        yield bench.run("cold: an empty store")
    else:
        copy_store(store, bench.store)
        step("what the store lacks", 0.0)
        bench.run("what the store lacks")
    bench.run("once more: what was just written is not yet trusted")
    yield _least(bench, "warm: nothing has changed", step)
    for what, change in (_one_shader(chosen), _one_budget(chosen), _one_scene(chosen)):
        step(what, 0.0)
        file, text = change
        copy = bench.tree / file.relative_to(PACKAGES_FOLDER)
        copy.write_text(text, encoding="utf-8")
        yield bench.run(what)
        shutil.copy2(file, copy)


def copy_store(source: Path, target: Path) -> None:
    """Copy a store: its images by hard links, everything else, which a run may write to or date anew, as files."""

    def copied(one: str, other: str) -> str:
        if Path(one).suffix in LINKED:
            with suppress(OSError):
                os.link(one, other)
                return other
        return str(shutil.copy2(one, other))

    if source.is_dir():
        skipped = shutil.ignore_patterns("runs", ".*.tmp")
        shutil.copytree(source, target, copy_function=copied, ignore=skipped)


def _images_in(store: Path) -> set[Path]:
    return set(store.glob("??/*/*.exr"))


def _start_of(bench: Bench, step: Step) -> Measured:
    """Import the command line and declare all commands, Python's own start included."""
    what = "`lightgauge --help`, which imports the command line"
    step(what, 0.0)
    bench.python(RUN, HELP)  # which compiles it
    return Measured(what, min(bench.python(RUN, HELP) for _ in range(REPEATS)), 0, 0, 0)


def _least(bench: Bench, what: str, step: Step) -> Measured:
    step(what, 0.0)
    return min((bench.run(what) for _ in range(REPEATS)), key=lambda measured: measured.seconds)


Change = tuple[str, tuple[Path, str]]
"""A change in words, and the file with its new text."""


def _one_shader(chosen: Selection) -> Change:
    """Change what is most the own shader of the technique with the most checks: it compiles to what it did."""
    judging = _judging(chosen)
    ((technique, _),) = Counter(check.technique for check in judging).most_common(1)
    using = Counter(shader for check in judging for shader in shaders_of(check.technique))
    name = min(shaders_of(technique), key=lambda shader: (using[shader], shader))
    text = (GLSL / name).read_text(encoding="utf-8")
    return f"one shader changed: {name}", (GLSL / name, f"{text}\nconst float profile_unused = 1.0;\n")


def _judging(chosen: Selection) -> list[Check]:
    """The chosen checks that are not of parity, or those of parity if there are no others."""
    light = [check for check in chosen.every_check if check.quantity not in PARITY_QUANTITIES]
    return light or list(chosen.every_check)


def _one_budget(chosen: Selection) -> Change:
    """Change the first bound of the first check that a chosen scene spells out."""
    for request in chosen.requests:
        scene = request.scene
        path = scene.folder / f"{scene.name}.toml"
        lines = key_lines(path.read_text(encoding="utf-8"))
        for index, check in enumerate(scene.checks):
            line = lines.get(("checks", index, "criteria", 0, "max"))
            if check in request.checks and line is not None:
                name = f"{scene.name}/{check.technique}"
                return f"one budget changed: {name}", (path, _nudged(path, line, r"\bmax\s*=\s*"))
    raise InputError("None of the chosen scenes has a budget with a max of its own. Choose another.")


def _one_scene(chosen: Selection) -> Change:
    """Change the field of view of the scene with the fewest checks, of those that judge light if any is chosen."""
    light = [request for request in chosen.requests if any(c.quantity not in PARITY_QUANTITIES for c in request.checks)]
    for request in sorted(light or chosen.requests, key=lambda request: len(request.checks)):
        path = request.scene.folder / f"{request.scene.name}.toml"
        line = key_lines(path.read_text(encoding="utf-8")).get(("sensor", "fov_deg"))
        if line is not None:
            return f"one scene changed: {request.scene.name}", (path, _nudged(path, line, r"\bfov_deg\s*=\s*"))
    raise InputError("None of the chosen scenes has a field of view of its own. Choose another.")


def _nudged(path: Path, line: int, key: str) -> str:
    """The text of a file with the first number behind a key, on a line or below, multiplied by `NUDGE`."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    rest = "".join(lines[line - 1 :])
    nudged = re.sub(rf"({key})([0-9.eE+-]+)", lambda m: f"{m[1]}{float(m[2]) * NUDGE!r}", rest, count=1)
    return "".join(lines[: line - 1]) + nudged
