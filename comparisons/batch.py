"""Run what was chosen: side by side, with progress and the time left, and remember what each check took."""

from collections.abc import Iterator
from dataclasses import replace

from comparisons import jobs
from comparisons.cache import CheckCache, keep_known
from comparisons.countdown import Countdown
from comparisons.interrupt import Interrupt
from comparisons.options import Say, say_all
from comparisons.progress import Display
from comparisons.result import CheckResult
from comparisons.selection import Selection
from comparisons.setup import Setup, sides
from comparisons.summary import broken_lines, line_of
from comparisons.times import Work, read_times, remember, work_of
from reference.store import Store


def run_selection(
    chosen: Selection, store: Store, setup: Setup, processes: int, interrupt: Interrupt, say: Say
) -> list[CheckResult]:
    """All results, in order. What was finished before an interruption is kept, and how long it took.

    Raises
    ------
    NoGraphics, NoCompiler, NoCluster, OSError
        As `comparisons.suite.run`.
    """
    work = work_of(chosen.requests, CheckCache(store, sides(setup).graphics))
    countdown = Countdown(work, read_times(store), processes)
    say_all(say, _found(list(work.values()), store))
    try:
        with Display(chosen.checks, line_of, say, countdown) as display:
            bar = display.progress
            progress = replace(bar, step=interrupt.after(bar.step), finished=interrupt.after(bar.finished))
            store.waiting = progress.step
            return jobs.run(chosen.requests, store, progress, setup, processes, countdown.scenes())
    finally:
        remember(store, countdown.measured)
        keep_known(store)


def _found(work: list[Work], store: Store) -> Iterator[str]:
    """What need not be done again."""
    found = work.count(Work.NOTHING)
    if found:
        yield f"{found} of {len(work)} check{'s' if len(work) > 1 else ''} found finished in {store.root}"


def opening_lines(chosen: Selection) -> Iterator[str]:
    """What a reader should know before anything is rendered: scenes that are broken, files that are none."""
    if chosen.passed_over:
        yield f"passed over, since they hold no scene: {', '.join(map(str, chosen.passed_over))}"
    yield from broken_lines(chosen.broken)
