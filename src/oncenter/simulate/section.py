"""Building blocks of the tables of a scenario file: numbers with limits; unknown keys are errors."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from oncenter.vehicle import Number as Number

Whole = Annotated[int, Field(strict=True)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]


def in_order(interval: tuple[float, float]) -> tuple[float, float]:
    """Checks [low, high].

    Raises:
        ValueError: low is above high.
    """
    if interval[0] > interval[1]:
        raise ValueError(f"must be [low, high], got [{interval[0]:g}, {interval[1]:g}]")
    return interval


Length = Annotated[Number, Field(ge=1)]  # m, of a stretch of road
Range = Annotated[tuple[Number, Number], AfterValidator(in_order)]
PositiveRange = Annotated[tuple[Positive, Positive], AfterValidator(in_order)]
LengthRange = Annotated[tuple[Length, Length], AfterValidator(in_order)]


class Section(BaseModel):
    """A table of a scenario file."""

    model_config = ConfigDict(extra="forbid", frozen=True)
