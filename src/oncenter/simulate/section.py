"""What the tables of a scenario file are made of: numbers with their limits, and no key that nobody knows."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def in_order(interval: tuple[float, float]) -> tuple[float, float]:
    """[low, high], or a ValueError that says so."""
    if interval[0] > interval[1]:
        raise ValueError(f"must be [low, high], got [{interval[0]:g}, {interval[1]:g}]")
    return interval


PositiveRange = Annotated[tuple[Positive, Positive], AfterValidator(in_order)]


class Section(BaseModel):
    """A table of a scenario file."""

    model_config = ConfigDict(extra="forbid", frozen=True)
