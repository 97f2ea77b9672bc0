"""The numbers and names that every part of a scene is made of."""

from typing import Annotated, Literal

from pydantic import Field

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Reflectance = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")]
Rgb = tuple[NonNegative, NonNegative, NonNegative]
Albedo = tuple[Reflectance, Reflectance, Reflectance]

LengthUnit = Literal["m", "mm"]
