"""Known limits: from which magnitude of a stress a subject breaks, and why that is left as it is."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from pathlib import Path

from comparisons.stress.result import Outcome

FILE = Path(__file__).with_name("limits.toml")


@dataclass(frozen=True)
class Limit:
    """A subject breaks from that magnitude of a stress on, and `why`."""

    magnitude: float
    why: str


class Standing(StrEnum):
    """How an outcome stands to what is documented."""

    HOLDS = "holds"
    KNOWN = "breaks where it is documented to"
    BROKEN = "breaks"
    STALE = "holds further than is documented"
    UNFIT = "not applicable"


@cache
def documented() -> Mapping[tuple[str, str], Limit]:
    """The limits by subject and stress."""
    with FILE.open("rb") as file:
        rows = tomllib.load(file)["limits"]
    return {
        (subject, stress): Limit(float(row["from"]), row["why"])
        for row in rows
        for subject in row["subjects"]
        for stress in row["stresses"]
    }


def with_limit(outcome: Outcome, limits: Mapping[tuple[str, str], Limit] | None = None) -> Outcome:
    """The outcome with what is documented about it."""
    known = (documented() if limits is None else limits).get((outcome.subject, outcome.stress))
    return outcome if known is None else replace(outcome, limit=known.magnitude, why=known.why)


def standing(outcome: Outcome) -> Standing:
    """How an outcome stands to its documented limit."""
    if outcome.unfit and not outcome.trials:
        return Standing.UNFIT
    passed = [trial.magnitude for trial in outcome.trials if trial.magnitude != outcome.first_failing]
    if outcome.limit in passed:
        return Standing.STALE
    if outcome.first_failing is None:
        return Standing.HOLDS
    sign = 1 if outcome.is_rising else -1
    is_known = outcome.limit is not None and sign * outcome.first_failing >= sign * outcome.limit
    return Standing.KNOWN if is_known else Standing.BROKEN


def is_broken(outcomes: Iterable[Outcome]) -> bool:
    """Whether something breaks earlier than is documented."""
    return any(standing(outcome) is Standing.BROKEN for outcome in outcomes)
