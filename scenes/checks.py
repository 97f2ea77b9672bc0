"""What a scene must hold: techniques, held against the truth of a quantity by budgets that give their reasons."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from scenes.strict import Strict

Sentence = Annotated[str, Field(min_length=8)]


class Bounds(Strict):
    """The least and the most that a metric may be, and why that is right."""

    max: float | None = None
    min: float | None = None
    reason: Sentence

    @model_validator(mode="after")
    def _has_a_bound(self) -> Self:
        if self.max is None and self.min is None:
            raise ValueError("give max, min or both")
        if self.max is not None and self.min is not None and self.min > self.max:
            raise ValueError(f"min ({self.min:g}) must not exceed max ({self.max:g})")
        return self


class RendererBounds(Bounds):
    """Other bounds where the name of the OpenGL renderer contains `renderer`, whatever the case of its letters."""

    renderer: Annotated[str, Field(min_length=2)]

    def apply_to(self, renderer: str) -> bool:
        return self.renderer.casefold() in renderer.casefold()


class Criterion(Bounds):
    """`min <= metric <= max`; of `by_renderer`, the first that applies replaces these bounds and their reason."""

    metric: str
    by_renderer: tuple[RendererBounds, ...] = ()

    @model_validator(mode="after")
    def _names_each_renderer_once(self) -> Self:
        names = [bounds.renderer.casefold() for bounds in self.by_renderer]
        if len(set(names)) < len(names):
            raise ValueError("by_renderer must not name a renderer twice")
        return self

    def bounds_on(self, renderer: str) -> Bounds:
        """The bounds that hold where images are drawn by an OpenGL renderer of that name."""
        return next((bounds for bounds in self.by_renderer if bounds.apply_to(renderer)), self)


SettingValue = bool | int | float | str


class Check(Strict):
    """A technique held against the truth of a quantity.

    With `fit_exposure` the technique's image is first multiplied by the one factor that fits the truth best, which is
    reported: what remains is the error of shape and colour.
    """

    quantity: str
    technique: str
    settings: dict[str, SettingValue] = Field(default_factory=dict)
    fit_exposure: bool = False
    criteria: Annotated[tuple[Criterion, ...], Field(min_length=1)]
