"""What a stress found, as it stands in stress.json."""

from dataclasses import asdict, dataclass
from typing import Any

SCHEMA = 1
FILE_NAME = "stress.json"


@dataclass(frozen=True)
class Trial:
    """One magnitude of a stress: the error that it made in `Outcome.unit`, or what went wrong in words."""

    magnitude: float
    error: float | None
    fault: str = ""


@dataclass(frozen=True)
class Outcome:
    """A subject under a stress, from the mildest magnitude to the harshest.

    subject : a technique, or a shader function as FILE:FUNCTION
    stress : what was done to it; `unit` is that of `tolerance` and of the errors of trials
    first_failing : the first magnitude whose error exceeds the tolerance, or at which something went wrong; else None
    reproduce : the command that shows the first failure again
    limit : the magnitude from which it is known to break, and `why`, where that is documented; else None
    is_rising : whether larger magnitudes are harsher
    unfit : why the stress cannot be put on the subject, or not beyond the last trial; else empty
    """

    subject: str
    stress: str
    unit: str
    tolerance: float
    trials: tuple[Trial, ...]
    first_failing: float | None
    reproduce: str
    limit: float | None = None
    why: str = ""
    is_rising: bool = True
    unfit: str = ""

    def to_json(self) -> dict[str, Any]:
        return asdict(self)
