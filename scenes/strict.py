"""What all parts of a scene have in common: they are frozen, and nothing in them is unknown, guessed or infinite."""

from pydantic import BaseModel, ConfigDict


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
