"""The checks of a pytest session: judged one by one with one store, and shown in one report."""

import json
import logging
import time
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from comparisons.baseline import notes_on
from comparisons.doctor import require_writable
from comparisons.gate import CriterionResult
from comparisons.interrupt import Interrupt
from comparisons.pytest_asked import Case
from comparisons.pytest_text import counts_of
from comparisons.result import CheckResult
from comparisons.results import prepare_folder, results_json, with_pictures, write_run
from comparisons.suite import Progress, SceneRun
from reference.store import Store
from scenes.paths import shown_path

LOG = logging.getLogger("lightgauge")

Key = tuple[str, str, tuple[CriterionResult, ...]]
"""What tells results apart: name, the command that runs it again, numbers and budgets."""


class Judge:
    """Judges the checks of a session, as a run of the command line would.

    What was rendered for a scene serves all of its checks that follow one another.
    """

    def __init__(self, store: Path, report: Path, worker: str = "") -> None:
        """`worker` names this process among those that share the report.

        Raises
        ------
        InputError
            A folder cannot be written to.
        """
        require_writable(store, "store", "--lightgauge-store")
        prepare_folder(report, "--lightgauge-report")
        self.report = report
        self.store = Store(store)
        self.store.waiting = self._step
        self._worker = worker
        self._interrupt = Interrupt()
        self._scene: SceneRun | None = None
        self._unseen: list[CheckResult] = []
        self._shown: dict[Key, CheckResult] = {}

    @property
    def results(self) -> list[CheckResult]:
        """All that was judged, with the parity that no test has asked for."""
        return list(self._shown.values())

    def to_json(self) -> str:
        """What was judged, with what was repaired on the way, for `report_lines`."""
        return json.dumps({"results": [result.to_json() for result in self.results], "notes": self.store.notes})

    def judge(self, case: Case, place: str, rerun: str) -> CheckResult:
        """A check, judged, after the parity of its scene; its pictures lie in the report's folder.

        Parameters
        ----------
        place : FILE:LINE of the budgets that the test gives.
        rerun : the command that runs the test again, which alone knows these.

        Raises
        ------
        NoGraphics, NoCompiler
            Nothing can be rendered on this machine.
        """
        with self._interrupt, warnings.catch_warnings():
            warnings.filterwarnings("ignore", module="colour")
            judged = self._scene_of(case).result(case.check)
        asked = _placed(judged, case.given, place, rerun) if case.given else judged
        while self._unseen:
            result = self._unseen.pop(0)
            self._keep(asked if result is judged else result)
        return self._keep(asked)

    def _scene_of(self, case: Case) -> SceneRun:
        if self._scene is None or self._scene.request != case.request:
            progress = Progress(self._interrupt.after(self._step), self._interrupt.after(self._unseen.append))
            self._scene = SceneRun(case.request, self.store, progress)
        return self._scene

    def _keep(self, result: CheckResult) -> CheckResult:
        """The result with its pictures in the report's folder, apart from those of its namesakes."""
        key = _key_of(result)
        if key not in self._shown:
            namesakes = sum(other.id == result.id for other in self._shown.values())
            marks = [result.scene, self._worker, str(namesakes + 1) if namesakes else ""]
            apart = replace(result, scene="-".join(filter(None, marks)))
            self._shown[key] = replace(result, images=with_pictures(self.report, self.store, [apart])[0].images)
        return self._shown[key]

    def _step(self, what: str, fraction: float) -> None:
        LOG.info("%s, %.0f %%", what, 100 * fraction)


def _placed(result: CheckResult, given: tuple[str, ...], place: str, rerun: str) -> CheckResult:
    """The result of a check whose budgets for the metrics `given` stand in a test."""
    criteria = tuple(replace(c, place=place) if c.metric in given else c for c in result.criteria)
    return replace(result, criteria=criteria, rerun=rerun)


def _key_of(result: CheckResult) -> Key:
    return result.id, result.rerun, result.criteria


def report_lines(folder: Path, judged: Iterable[str], began: float) -> Iterator[str]:
    """Write the report and results.json of a session, and say how it went.

    Parameters
    ----------
    judged : what each process of the session judged, as `Judge.to_json` gives it.
    began : when the session began, in seconds since the epoch.
    """
    parts = [json.loads(text) for text in judged]
    results = list(distinct(CheckResult.from_json(plain) for part in parts for plain in part["results"]))
    notes = [note for part in parts for note in part["notes"]]
    started = datetime.fromtimestamp(began, UTC).isoformat(timespec="seconds")
    yield from notes
    yield from notes_on(results)
    if not results:
        return
    try:
        page = write_run(folder, results_json(results, started, time.time() - began, notes))
        yield f"{counts_of(results)}. Report: {shown_path(page)}"
    except Exception as error:  # noqa: BLE001  # whatever is wrong with the page, pytest must show what failed
        yield f"{counts_of(results)}. The report could not be written: {type(error).__name__}: {error}"


def distinct(results: Iterable[CheckResult]) -> Iterator[CheckResult]:
    """Each result once. All but the first of one name, which have other budgets or another file, get a number."""
    count: Counter[str] = Counter()
    for result in {_key_of(result): result for result in results}.values():
        count[result.id] += 1
        number = count[result.id]
        yield replace(result, scene=f"{result.scene} ({number})") if number > 1 else result
