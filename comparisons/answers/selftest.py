"""The self-test in words: which faults each check notices, which it does not, and what would help."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby

from comparisons.mutants import MUTANTS
from comparisons.request import Request
from comparisons.selftest import Outcome, Trial, selftest
from reference.store import Store

MARKS = {
    Outcome.KILLED: "killed",
    Outcome.SURVIVED: "SURVIVED",
    Outcome.EQUIVALENT: "same",
    Outcome.MASKED: "masked",
    Outcome.UNCLAIMED: "-",
    Outcome.UNTESTED: "?",
}
LEGEND = {
    Outcome.EQUIVALENT: "the fault changes nothing that is judged",
    Outcome.MASKED: "the image is wrong already by so much that the fault adds next to nothing; fit_exposure may help",
    Outcome.UNCLAIMED: "no metric of the check claims to see it",
    Outcome.UNTESTED: "the check does not pass without a fault",
}
COUNTED = {
    Outcome.KILLED: "mutants killed",
    Outcome.SURVIVED: "survived",
    Outcome.EQUIVALENT: "equivalent",
    Outcome.MASKED: "masked",
    Outcome.UNCLAIMED: "not claimed",
    Outcome.UNTESTED: "untested",
}
ALWAYS_SAID = (Outcome.KILLED, Outcome.SURVIVED, Outcome.EQUIVALENT)


def selftest_lines(
    requests: Iterable[Request], store: Store, step: Callable[[str, float], None]
) -> tuple[list[str], int]:
    """The self-test of all checks as lines of text, and the exit status.

    Parameters
    ----------
    step : is told what is being done, and which fraction of it is done.

    Raises
    ------
    NoGraphics, NoCompiler
        Nothing can be rendered on this machine.
    """
    trials = selftest(requests, store, step)
    return list(lines_of(trials)), status_of(trials)


def status_of(trials: Iterable[Trial]) -> int:
    """1 if a mutant survived or could not be tried, else 0."""
    return int(any(t.outcome in (Outcome.SURVIVED, Outcome.UNTESTED) for t in trials))


def lines_of(trials: Sequence[Trial]) -> Iterator[str]:
    """A row for each check and a column for each mutant, then survivors with advice, then counts."""
    rows = [list(group) for _, group in groupby(trials, lambda t: t.check)]
    width = max((len(t.check) for t in trials), default=0)
    columns = {name: max(len(name), *map(len, MARKS.values())) for name in MUTANTS}
    yield "  ".join([" " * width, *(f"{name:{columns[name]}}" for name in MUTANTS)]).rstrip()
    for row in rows:
        marks = {t.mutant: MARKS[t.outcome] for t in row}
        cells = (f"{marks[name]:{columns[name]}}" for name in MUTANTS)
        yield "  ".join([f"{row[0].check:{width}}", *cells]).rstrip()
    yield ""
    for outcome, meaning in LEGEND.items():
        if any(t.outcome is outcome for t in trials):
            yield f"{MARKS[outcome]}: {meaning}"
    for row in rows:
        yield from _complaints(row)
    counts = {outcome: sum(t.outcome is outcome for t in trials) for outcome in COUNTED}
    said = (f"{n} {COUNTED[outcome]}" for outcome, n in counts.items() if n or outcome in ALWAYS_SAID)
    yield ", ".join([f"{len(rows)} {'check' if len(rows) == 1 else 'checks'}", *said])


def _complaints(row: Sequence[Trial]) -> Iterator[str]:
    """What is wrong with one check."""
    if row[0].outcome is Outcome.UNTESTED:
        yield f"UNTESTED {row[0].check}: {row[0].note}"
    for trial in row:
        if trial.outcome is Outcome.SURVIVED:
            summary = MUTANTS[trial.mutant].summary
            yield f"SURVIVED {trial.check}: {trial.mutant} ({summary}) is {trial.verdict}. {trial.note}"
