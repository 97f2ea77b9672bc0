"""One shader function on one input, step by step, in three precisions."""

from collections.abc import Iterator, Sequence

import numpy as np

from comparisons.stress.examination import examined, subject
from comparisons.stress.functions import PRECISIONS, cause_of
from comparisons.stress.reproduction import Numbers, from_json, results, traced
from scenes.errors import InputError

NAMES = ("fp16", "fp32", "fp64")
WORDS = {"fp16": "Half", "fp32": "Single"}


def run_function(subjects: Sequence[str], stresses: Sequence[str], text: str) -> tuple[list[str], int]:
    """Every intermediate and the result as lines of text; status 1 if the function fails on the input.

    It is held against what single precision may do further out than in use, or under 'fp16' or 'fp32' against what that
    precision may do in use, where what rounding the input costs counts as well.

    Raises
    ------
    InputError
        Not one function is asked for, not at most one precision, or `text` is no input of it.
    """
    if len(subjects) != 1 or ":" not in subjects[0]:
        raise InputError(
            f"--input is for one shader function, but {', '.join(subjects) or 'none'} was asked for. "
            "Name it as FILE:FUNCTION, such as lib/refract.glsl:refract_through."
        )
    if stresses and (len(stresses) > 1 or stresses[0] not in PRECISIONS):
        raise InputError(f"--input goes with --stress fp16 or fp32, or with none, not with {', '.join(stresses)}.")
    precision = stresses[0] if stresses else "fp32"
    of = subject(subjects[0])
    inputs = from_json(of, text)
    found = examined(of, inputs, PRECISIONS[precision])
    measure = of.domain.measure
    cause = cause_of(found, measure.tolerance, 0, is_in_use=bool(stresses))
    lines = [line for step in traced(of, inputs) for line in _step(step.place, step.text, step.values, step.is_wrong)]
    lines += [line for name, values in results(of, inputs).items() for line in _step("result", name, values, False)]
    if np.isfinite(found.error[0]):
        lines.append(
            f"{WORDS[precision]} precision is {float(found.error[0]):.2g} {measure.unit} from double, of which "
            f"rounding the input explains all but {float(found.own[0]):.2g}; {measure.tolerance:g} is allowed."
        )
    if cause is not None:
        lines.append(f"It fails: {CAUSES.get(cause, f'a number is no longer finite at {cause}')}.")
    return lines, int(cause is not None)


CAUSES = {
    "error": "the error is too large",
    "decision": "a decision falls otherwise than in double precision",
    "law": "the result is not what it must be",
}


def _step(place: str, text: str, values: Sequence[Numbers | None], is_wrong: bool) -> Iterator[str]:
    """Two lines: where and what, and its values. An exclamation mark is put before what goes wrong."""
    yield f"{'!' if is_wrong else ' '} {place}  {text}"
    yield "      " + "   ".join(f"{name} {_numbers(value)}" for name, value in zip(NAMES, values, strict=True))


def _numbers(value: Numbers | None) -> str:
    if value is None:
        return "(went another way)"
    shown = " ".join(f"{x:.7g}" for x in value)
    return shown if len(value) == 1 else f"({shown})"
