"""Shader functions by themselves: a ladder of precisions, inputs at their extremes, and random ones from far out."""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from comparisons.glsl.values import Array
from comparisons.stress.domains import DOMAINS
from comparisons.stress.examination import Examination, Real, Subject, examined, subject
from comparisons.stress.inputs import Inputs, drawn, lane
from comparisons.stress.reproduction import to_json, used
from comparisons.stress.result import Outcome, Trial
from comparisons.stress.search import simplest

Step = Callable[[str, float], None]

COUNT = 2048
"""Inputs of a trial."""
QUANTILES = (0.5, 0.99)
EXTREMES = (1, 2, 3)
REACHES = (1.0, 10.0, 100.0, 1000.0)
PRECISIONS: dict[str, Real] = {"fp16": np.float16, "fp32": np.float32}
STRESSES: dict[str, str] = {
    "fp16": "half precision, on inputs in use: the error that a part of them stays below",
    "fp32": "single precision, on inputs in use: the error that a part of them stays below",
    "extremes": "single precision, with so many inputs at the ends of what is allowed",
    "random": "single precision, on random inputs from so many times further out than in use",
}
"""What is done to functions; what the magnitude is stands at the end."""
MAGNITUDES: dict[str, Sequence[float]] = {
    **dict.fromkeys(PRECISIONS, QUANTILES),
    "extremes": EXTREMES,
    "random": REACHES,
}


def magnitudes(stress: str) -> Sequence[float]:
    """Those of a stress, from mild to harsh."""
    return MAGNITUDES[stress]


def subjects() -> list[str]:
    """All shader functions that can be run by themselves, as FILE:FUNCTION."""
    return list(DOMAINS)


def outcomes(
    subjects: Sequence[str], step: Step, stresses: Iterable[str] = STRESSES, at: float | None = None
) -> Iterator[Outcome]:
    """Each function under each stress, at all magnitudes or `at` one alone.

    In use, the error is all that a precision costs, rounding the inputs included. Further out it is what moving inputs
    by their last digits does not explain, or how far the result is from what it must be.

    Raises
    ------
    InputError
        An unknown function.
    """
    for number, name in enumerate(subjects):
        step(name, number / len(subjects))
        of = subject(name)
        for stress in stresses:
            yield outcome(of, stress, at)


def outcome(of: Subject, stress: str, at: float | None = None) -> Outcome:
    """A function under one stress."""
    make = _in_use if stress in PRECISIONS else _further_out
    return make(of, stress, magnitudes(stress) if at is None else (at,))


def _in_use(of: Subject, stress: str, quantiles: Sequence[float]) -> Outcome:
    inputs = drawn(of.kinds, np.random.default_rng(1), COUNT)
    found = examined(of, inputs, PRECISIONS[stress])
    usual = found.error[found.counts] if found.counts.any() else np.zeros(1)
    trials = []
    for quantile in quantiles:
        error = float(np.quantile(usual, quantile, method="higher"))
        wrong = (found.first >= 0) | found.decides
        trials.append((quantile, error, _fault(found) if np.mean(wrong) > 1.0 - quantile else ""))
    return _outcome(of, stress, trials, inputs, found)


def _further_out(of: Subject, stress: str, magnitudes: Sequence[float]) -> Outcome:
    trials: list[tuple[float, float, str]] = []
    first: tuple[Inputs, Examination] | None = None
    for magnitude in magnitudes:
        rng = np.random.default_rng(2)
        if stress == "extremes":
            inputs = drawn(of.kinds, rng, COUNT, extremes=int(magnitude))
        else:
            inputs = drawn(of.kinds, rng, COUNT, reach=magnitude)
        found = examined(of, inputs, np.float32)
        trials.append((magnitude, max(float(found.own.max()), float(found.lawless.max())), _fault(found)))
        if first is None or not first[1].fails(of.domain.measure.tolerance).any():
            first = inputs, found
    assert first is not None
    return _outcome(of, stress, trials, *first)


def _outcome(
    of: Subject,
    stress: str,
    trials: list[tuple[float, float, str]],
    inputs: Inputs,
    found: Examination,
) -> Outcome:
    tolerance = of.domain.measure.tolerance
    failing = [magnitude for magnitude, error, fault in trials if fault or error > tolerance]
    reproduce = ""
    if failing:
        example = _example(of, inputs, found, PRECISIONS.get(stress, np.float32), stress in PRECISIONS)
        only = f" --stress {stress}" if stress in PRECISIONS else ""
        reproduce = f"lightgauge stress {of.name}{only} --input '{json.dumps(to_json(used(of, example)))}'"
    return Outcome(
        of.name,
        stress,
        of.domain.measure.unit,
        tolerance,
        tuple(Trial(m, error if np.isfinite(error) else None, fault) for m, error, fault in trials),
        failing[0] if failing else None,
        reproduce,
    )


def _example(of: Subject, inputs: Inputs, found: Examination, real: Real, is_in_use: bool) -> Inputs:
    """The simplest input that fails in the same way as the first one found."""
    tolerance = of.domain.measure.tolerance
    causes = (cause_of(found, tolerance, at, is_in_use) for at in range(len(found.error)))
    at, cause = next((k, cause) for k, cause in enumerate(causes) if cause is not None)
    chosen = {name: lane(value, at) for name, value in inputs.items()}
    return simplest(of.kinds, chosen, lambda made: cause_of(examined(of, made, real), tolerance, 0, is_in_use) == cause)


def cause_of(found: Examination, tolerance: float, at: int, is_in_use: bool) -> str | None:
    """What is wrong with the result of an input, or None. In use, what rounding inputs costs counts as well."""
    if found.first[at] >= 0:
        return str(found.faults[found.first[at]])
    if (found.error if is_in_use else found.own)[at] > tolerance:
        return "error"
    if found.decides[at]:
        return "decision"
    return "law" if found.lawless[at] > tolerance else None


def _fault(found: Examination) -> str:
    if (found.first >= 0).any():
        site = found.faults[int(found.first[np.argmax(found.first >= 0)])]
        return _share(f"are no longer finite, first at {site}", found.first >= 0)
    return _share("decide otherwise", found.decides) if found.decides.any() else ""


def _share(what: str, mask: Array) -> str:
    return f"{100 * float(np.mean(mask)):.2g} % of inputs {what}"
