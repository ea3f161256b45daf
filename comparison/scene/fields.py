"""Field types of a scene: numbers with units and bounds, sections, errors of violated rules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError


@dataclass(frozen=True)
class Unit:
    """Unit of a key, for messages."""

    symbol: str


def _integer(value: object) -> object:
    """Reject what is equal to an integer and is none: true, 1.0."""
    if type(value) is not int:
        raise PydanticCustomError("literal_error", "", {"expected": "-1 or 1"})
    return value


Real = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Sign = Annotated[Literal[-1, 1], BeforeValidator(_integer)]
M, KG, KGM2, S, M_S = Unit("m"), Unit("kg"), Unit("kg m^2"), Unit("s"), Unit("m/s")


class Section(BaseModel):
    """Section of the scene file; unknown keys are rejected."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


def gone(name: str, instead: str) -> BeforeValidator:
    """Reject a choice that is no longer there, and say what to take."""

    def check(value: object) -> object:
        if value == name:
            raise PydanticCustomError("gone", "is gone: {instead}", {"instead": instead})
        return value

    return BeforeValidator(check)


def rule(key: str, value: object, text: str, unit: str = "") -> PydanticCustomError:
    """Build an error about ``key`` (relative to the section that raises it) for `error_messages`."""
    return PydanticCustomError("rule", "{text}", {"key": key, "value": value, "text": text, "unit": unit})
