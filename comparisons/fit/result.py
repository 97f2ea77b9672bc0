"""What a fit found, as it stands in fit.json."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from comparisons.difference import RELATIVE_MARGIN
from comparisons.fit.gain import Gain
from comparisons.metrics import Estimate
from scenes.checks import SettingValue

SCHEMA = 1

CARRIES_OVER = "the gain carries over"
NO_GAIN = "no gain"
WORSE = "over-fitted"
UNDECIDED = "undecided"
NOT_TESTED = "not tested"


@dataclass(frozen=True)
class Fitted:
    """A setting before and after; `low` and `high` are the range that was looked in, None for a choice.

    edge : "low" or "high" where the best value is at that end of the range: a better one may lie beyond
    has_effect : whether it changes the error of any training scene; if not, it was left alone
    """

    name: str
    published: SettingValue
    fitted: SettingValue
    low: float | None
    high: float | None
    edge: str
    has_effect: bool


@dataclass(frozen=True)
class Score:
    """The error on one scene as published and as fitted, each with its 95 % interval, from the same samples of truth.

    spp : samples a pixel of the truth, 0 if that is exact
    settings, exposure : what it was drawn with; a scene that was held out in its turn has its own
    gain : the part of the squared error that is gone; None if the published one may have been 0
    note : why the intervals cannot be trusted, or empty
    """

    scene: str
    spp: int
    settings: Mapping[str, SettingValue]
    exposure: float
    published: Estimate
    fitted: Estimate
    gain: Gain | None
    note: str


@dataclass(frozen=True)
class Fit:
    """Everything that was found.

    pinned : settings that the user set
    exposure : the one factor on all images, None where it was not fitted
    train, held_out : the scenes
    in_turn : whether each training scene was held out in its turn, because no others were named
    train_gain, held_out_gain, exposure_gain : over all of these scenes; the last is that of the exposure alone, on the
        scenes held out
    drawings : images that were drawn
    failed : how many settings could not be drawn, and why the last one could not
    """

    technique: str
    quantity: str
    metric: str
    pinned: Mapping[str, SettingValue]
    parameters: tuple[Fitted, ...]
    exposure: float | None
    train: tuple[Score, ...]
    held_out: tuple[Score, ...]
    in_turn: bool
    train_gain: Gain | None
    held_out_gain: Gain | None
    exposure_gain: Gain | None
    drawings: int
    seconds: float
    failed: tuple[int, str]
    gl_renderer: str

    @property
    def settings(self) -> dict[str, SettingValue]:
        """Those to write into a check: pinned and fitted."""
        return {**self.pinned, **{p.name: p.fitted for p in self.parameters}}

    @property
    def verdict(self) -> str:
        """Whether the scenes held out gain too.

        Gains within `RELATIVE_MARGIN` do not matter. An interval with gains and losses leaves it open.
        """
        found = self.held_out_gain
        if not self.held_out:
            return NOT_TESTED
        if found is None or any(score.note for score in self.held_out):
            return UNDECIDED
        if max(-found.low, found.high) <= RELATIVE_MARGIN:
            return NO_GAIN
        if found.low > 0:
            return CARRIES_OVER
        return WORSE if found.high < 0 else UNDECIDED

    def to_json(self) -> dict[str, Any]:
        return {"schema": SCHEMA, **asdict(self), "settings": self.settings, "verdict": self.verdict}
