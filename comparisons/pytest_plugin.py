"""The pytest plugin: scenes as test files, and `lightgauge.check` in tests.

Every pytest of the environment loads this module. It imports nothing slow, and does nothing until a scene is collected
or a test asks for the fixture; the rest is in `comparisons.pytest_asked`, `pytest_judge` and `pytest_text`.
"""

from __future__ import annotations

import os
import shlex
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, chdir
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from comparisons.pytest_asked import Case
    from comparisons.pytest_judge import Judge
    from comparisons.result import CheckResult
    from scenes.checks import SettingValue

BEGAN = pytest.StashKey[float]()
SCENES = pytest.StashKey[frozenset[Path]]()
JUDGE = pytest.StashKey["Judge"]()
FROM_WORKERS = pytest.StashKey[list[str]]()
SUMMARY = pytest.StashKey[list[str]]()

SENT = "lightgauge"
"""Under which name a worker of pytest-xdist sends what it judged."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the options."""
    group = parser.getgroup("lightgauge", "lightgauge: real-time techniques against path-traced truth")
    group.addoption(
        "--lightgauge",
        action="store_true",
        help="run the checks of all scenes (TOML files) in the given folders, not only of those that are named",
    )
    group.addoption(
        "--lightgauge-store",
        metavar="FOLDER",
        help="where truth is kept between runs; default: .lightgauge in the root folder",
    )
    group.addoption(
        "--lightgauge-report",
        metavar="FOLDER",
        help="where the report goes; default: .lightgauge/pytest-report in the root folder",
    )
    parser.addini("lightgauge_scenes", "scenes that are run with the tests: scenes/*.toml", type="args", default=[])
    parser.addini("lightgauge_techniques", "files of own techniques: techniques/*.py", type="args", default=[])


def pytest_configure(config: pytest.Config) -> None:
    """Find the scenes that are run with the tests: a plain `pytest` collects them wherever they lie."""
    config.stash[BEGAN] = time.time()
    config.stash[FROM_WORKERS] = []
    config.stash[SUMMARY] = []
    scenes = frozenset(path for path in _files_of(config, "lightgauge_scenes") if _is_scene(path))
    config.stash[SCENES] = scenes
    if config.args_source is pytest.Config.ArgsSource.TESTPATHS:
        config.args += map(str, sorted(scenes))


def _files_of(config: pytest.Config, option: str) -> list[Path]:
    """The files that the patterns of an option of pytest's configuration mean, relative to the root folder.

    Raises
    ------
    UsageError
        A pattern means none: what is listed there would never be run.
    """
    found: list[Path] = []
    for pattern in config.getini(option):
        matching = [] if Path(pattern).is_absolute() else sorted(config.rootpath.glob(pattern))
        if not matching:
            raise pytest.UsageError(
                f"{option}: found '{pattern}', which matches nothing in {config.rootpath}; allowed are paths and "
                "patterns, relative to that folder, of files that exist. Mend it or remove it."
            )
        found += matching
    return found


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> SceneFile | None:
    """Collect a scene that is named, listed in the configuration, or wanted with all others."""
    is_listed = file_path in parent.config.stash[SCENES]
    is_named = file_path.suffix == ".toml" and (
        parent.config.getoption("lightgauge") or parent.session.isinitpath(file_path)
    )
    return SceneFile.from_parent(parent, path=file_path) if is_listed or (is_named and _is_scene(file_path)) else None


def _is_scene(path: Path) -> bool:
    """Whether a file is meant to be a scene, with whatever mistakes; other TOML files are nobody's tests."""
    import re
    import tomllib

    from comparisons.scene_files import SIGNS_OF_A_SCENE

    try:
        text = path.read_text(encoding="utf-8", errors="replace")
        keys = set(tomllib.loads(text))
    except OSError:
        return True
    except tomllib.TOMLDecodeError:
        keys = set(re.findall(r"^\[{0,2}(\w+)", text, re.MULTILINE))
    return not keys.isdisjoint(SIGNS_OF_A_SCENE)


class SceneFile(pytest.File):
    """A scene; its tests are its checks, parity first."""

    def collect(self) -> Iterator[pytest.Item]:
        from comparisons.pytest_asked import cases_of
        from comparisons.request import id_of
        from scenes.errors import LightgaugeError

        try:
            load_techniques(self.config)
            cases = cases_of(self.path)
        except LightgaugeError as error:
            yield Mistake.from_parent(self, name="scene", message=str(error))
            return
        for case in cases:
            yield CheckItem.from_parent(self, name=id_of(case.check), case=case)


class SceneItem(pytest.Item):
    """A test that stands in no Python file; it fails with a text alone, under the heading `title`."""

    title = ""

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        return str(excinfo.value) if isinstance(excinfo.value, CheckFailed) else super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.path, None, self.title


class Mistake(SceneItem):
    """A scene that cannot be run: a test that fails with what is wrong there."""

    def __init__(self, *, message: str, **place: Any) -> None:
        super().__init__(**place)
        self.message = message
        self.title = self.path.name

    def runtest(self) -> None:
        raise CheckFailed(self.message)


class CheckItem(SceneItem):
    """A check of a scene. The set-up judges it, and ends in an error if that fails; the test is whether it passes."""

    def __init__(self, *, case: Case, **place: Any) -> None:
        super().__init__(**place)
        self.case = case
        self.title = f"{case.request.scene.name}/{self.name}"

    def setup(self) -> None:
        try:
            self.result, self.text = judged(self, self.case)
        except CheckError as error:
            raise pytest.fail.Exception(str(error), pytrace=False) from None

    def runtest(self) -> None:
        if self.result.verdict != "PASS":
            raise CheckFailed(self.text, self.result)


class CheckFailed(AssertionError):
    """A check exceeds its budget, has regressed or is undecided; `result` is its `CheckResult`."""

    __module__ = "builtins"  # pytest shows the name of the class, not where it is from

    def __init__(self, text: str, result: CheckResult | None = None) -> None:
        super().__init__(text)
        self.result = result


class CheckError(Exception):
    """Nothing could be judged: the verdict is ERROR, or lightgauge was given what it cannot use.

    It is no AssertionError: a test that expects one must not take it for a failure.
    """

    __module__ = "builtins"


class Lightgauge:
    """What a test gets as `lightgauge`."""

    def __init__(self, item: pytest.Item) -> None:
        self._item = item

    def check(
        self,
        scene: str | Path,
        technique: str,
        settings: Mapping[str, SettingValue] | None = None,
        *,
        fit_exposure: bool = False,
        max: Mapping[str, float] | None = None,
        min: Mapping[str, float] | None = None,
    ) -> CheckResult:
        """Hold a technique against the truth of a scene.

        Parameters
        ----------
        scene : the path of a TOML file, relative to the folder of the test's file, or the name of a shipped scene.
        technique : a name that `lightgauge list` shows, or of an own one.
        settings : of the technique; may be left out if the scene has only one check of it.
        fit_exposure : judge the image times the one factor that fits the truth best.
        max, min : bounds by metric, instead of those that the check has in the scene; a must if it has no such check.

        Raises
        ------
        CheckFailed
            A budget is exceeded, an error has risen beyond the accepted one, or the truth is too noisy to tell.
        CheckError
            Nothing could be judged: a mistake in the scene or the arguments, no parity, no image.
        """
        __tracebackhide__ = True
        from comparisons.pytest_asked import Asked, case_of
        from scenes.errors import LightgaugeError

        asked = Asked(technique, settings, fit_exposure, {} if max is None else max, {} if min is None else min)
        try:
            load_techniques(self._item.config)
            with _where_pytest_began(self._item.config):
                case = case_of(scene, self._item.path.parent, asked)
        except LightgaugeError as error:
            raise CheckError(str(error)) from None
        caller = sys._getframe(1)
        result, text = judged(self._item, case, Path(caller.f_code.co_filename), caller.f_lineno)
        if result.verdict != "PASS":
            raise CheckFailed(text, result)
        return result


@pytest.fixture
def lightgauge(request: pytest.FixtureRequest) -> Lightgauge:
    """Holds real-time techniques against path-traced truth: lightgauge.check("scene.toml", "technique")."""
    return Lightgauge(request.node)


def judged(item: pytest.Item, case: Case, file: Path | None = None, line: int = 0) -> tuple[CheckResult, str]:
    """The result of a check, and what to say if it has not passed; `file` and `line` are where a test asks for it.

    Raises
    ------
    CheckError
        Nothing could be judged.
    """
    __tracebackhide__ = True
    from comparisons.pytest_text import failure_text, lightgauge_command, properties_of
    from comparisons.runner import fault_of
    from scenes.errors import LightgaugeError
    from scenes.paths import shown_path

    again = _again(item)
    with _where_pytest_began(item.config):
        try:
            judge = _judge_of(item.config)
            result = judge.judge(case, f"{shown_path(file)}:{line}" if file else "", again)
        except (LightgaugeError, OSError) as error:
            raise CheckError(str(error)) from None
        except Exception as error:  # noqa: BLE001  # a mesh or a driver may raise anything
            raise CheckError(fault_of(error)) from None
        others = [] if case.given else [lightgauge_command(result, judge.store.root)]
        text = failure_text(result, judge.report, [again, *others])
    item.user_properties += properties_of(result)
    if result.verdict == "ERROR":
        raise CheckError(text)
    return result, text


def _where_pytest_began(config: pytest.Config) -> AbstractContextManager[None]:
    """A block in which the current folder is that from which all paths are shown, wherever a test has gone."""
    return chdir(config.invocation_params.dir)


def _again(item: pytest.Item) -> str:
    """The command that runs a test again, from the folder in which pytest was started."""
    path = os.path.relpath(item.path, item.config.invocation_params.dir)
    _, colons, name = str(item.nodeid).partition("::")
    return f"pytest {shlex.quote(path + colons + name)}"


def load_techniques(config: pytest.Config) -> None:
    """Make a user's own techniques known; a file that has not changed is loaded once."""
    from realtime.own import load_own

    for path in _files_of(config, "lightgauge_techniques"):
        load_own(path)


def _judge_of(config: pytest.Config) -> Judge:
    from comparisons.pytest_judge import Judge

    if JUDGE not in config.stash:
        store = _folder(config, "lightgauge_store", ".lightgauge")
        config.stash[JUDGE] = Judge(store, _report_folder(config), _worker(config))
    return config.stash[JUDGE]


def _report_folder(config: pytest.Config) -> Path:
    return _folder(config, "lightgauge_report", ".lightgauge/pytest-report")


def _folder(config: pytest.Config, option: str, usual: str) -> Path:
    """A folder that is given relative to the current one, or the usual one in the root folder."""
    given = config.getoption(option)
    return config.invocation_params.dir / given if given else config.rootpath / usual


def _worker(config: pytest.Config) -> str:
    """The name of this process if it is a worker of pytest-xdist, else nothing."""
    name: str = getattr(config, "workerinput", {}).get("workerid", "")
    return name


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """A worker of pytest-xdist has ended: keep what it judged, if it lived to tell."""
    sent = getattr(node, "workeroutput", {})
    if SENT in sent:
        node.config.stash[FROM_WORKERS].append(sent[SENT])


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the report, or as a worker of pytest-xdist send what it needs."""
    config = session.config
    judge = config.stash.get(JUDGE, None)
    if _worker(config):
        if judge is not None:
            config.workeroutput[SENT] = judge.to_json()  # type: ignore[attr-defined]  # given by pytest-xdist
    elif judge is not None or config.stash[FROM_WORKERS]:
        from comparisons.pytest_judge import report_lines

        judgements = [*([judge.to_json()] if judge else []), *config.stash[FROM_WORKERS]]
        with _where_pytest_began(config):
            config.stash[SUMMARY] += report_lines(_report_folder(config), judgements, config.stash[BEGAN])


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say how the checks went, and where their report is."""
    if config.stash[SUMMARY]:
        terminalreporter.section("lightgauge")
        for line in config.stash[SUMMARY]:
            terminalreporter.write_line(line)
