import io
import re
import sys
from collections.abc import Callable

import pytest

from comparisons.countdown import Countdown
from comparisons.gate import Verdict
from comparisons.parity import PARITY
from comparisons.progress import PLAIN_EVERY_SECONDS, TIME_LEFT_EVERY_SECONDS, Display
from comparisons.result import CheckResult, empty_result
from comparisons.times import Work
from realtime.techniques import technique
from reference.quantities import quantity
from scenes.load import find_scene, load_scene


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def result() -> CheckResult:
    scene = load_scene(find_scene("parity-wide"))
    return empty_result(scene, "parity-wide", PARITY[0], technique("raster.normal"), quantity("normal"))


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Sets the time that a display sees."""
    now = [0.0]
    monkeypatch.setattr("comparisons.progress.time.monotonic", lambda: now[0])
    return lambda seconds: now.__setitem__(0, seconds)


def test_finished_checks_are_numbered_lines(result: CheckResult) -> None:
    lines: list[str] = []
    with Display(3, lambda r: str(r.verdict), lines.append) as display:
        for _ in range(3):
            display.progress.finished(result)
    assert lines == [f"[{i}/3] {Verdict.ERROR}" for i in (1, 2, 3)]


def test_a_long_step_is_heard_of_from_time_to_time(result: CheckResult, clock: Callable[[float], None]) -> None:
    lines: list[str] = []
    with Display(2, lambda r: "done", lines.append) as display:
        for second in range(26):
            clock(second)
            display.progress.step("tracing", second / 100)
        display.progress.finished(result)
        clock(25 + PLAIN_EVERY_SECONDS / 2)
        display.progress.step("drawing", 0.0)
    assert lines == ["[0/2] tracing, 10%", "[0/2] tracing, 20%", "[1/2] done"]


def test_work_without_checks_counts_none(clock: Callable[[float], None]) -> None:
    lines: list[str] = []
    with Display(0, lambda r: "done", lines.append) as display:
        clock(PLAIN_EVERY_SECONDS)
        display.progress.step("planting faults", 0.5)
    assert lines == ["planting faults, 50%"]


@pytest.fixture
def countdown(result: CheckResult) -> Countdown:
    """Of two checks, of which the first is `result`, that took ten minutes each."""
    known = {name: {Work.JUDGE.value: 600.0} for name in (result.id, "other/talk")}
    return Countdown(dict.fromkeys(known, Work.JUDGE), known)


def test_long_steps_say_the_time_left(
    result: CheckResult, countdown: Countdown, clock: Callable[[float], None]
) -> None:
    lines: list[str] = []
    with Display(2, lambda r: "done", lines.append, countdown) as display:
        clock(PLAIN_EVERY_SECONDS)
        display.progress.step("tracing", 0.5)
        display.progress.took(result.id, 600.0)
        display.progress.finished(result)
        clock(2 * PLAIN_EVERY_SECONDS)
        display.progress.step("drawing", 0.0)
    assert lines == [
        "[0/2] tracing, 50%, about 20 min left",
        "[1/2] done",
        "[1/2] drawing, 0%, about 10 min left",
    ]


def test_between_quick_checks_the_time_left_is_said_from_time_to_time(
    result: CheckResult, countdown: Countdown, clock: Callable[[float], None]
) -> None:
    lines: list[str] = []
    with Display(2, lambda r: "done", lines.append, countdown) as display:
        clock(TIME_LEFT_EVERY_SECONDS)
        display.progress.finished(result)
        clock(TIME_LEFT_EVERY_SECONDS + 1)
        display.progress.finished(result)
    assert lines == ["[1/2] done", "[1/2] about 10 min left", "[2/2] done"]


def test_on_a_terminal_the_time_left_stands_beside_the_bar(
    result: CheckResult, countdown: Countdown, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    with Display(2, lambda r: "done", print, countdown) as display:
        display.progress.step("tracing", 0.5)
    assert "about 20 min left" in terminal.getvalue()


def test_on_a_terminal_finished_lines_stay_above_the_bar(result: CheckResult, monkeypatch: pytest.MonkeyPatch) -> None:
    terminal, lines = Terminal(), list[str]()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with Display(2, lambda r: "PASS  [bold]x[/bold]", lines.append) as display:
        display.progress.step("scene [1]: tracing", 0.5)
        display.progress.finished(result)
        display.progress.finished(result)
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", terminal.getvalue())
    assert lines == []
    assert "[1/2] PASS  [bold]x[/bold]" in shown
    assert "[2/2] PASS  [bold]x[/bold]" in shown


def test_the_bar_is_taken_away_when_a_run_breaks_off(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with pytest.raises(KeyboardInterrupt), Display(2, lambda r: "", print):
        raise KeyboardInterrupt
    assert terminal.getvalue().rpartition("\x1b[?25")[2].startswith("h"), "the cursor is shown again"
