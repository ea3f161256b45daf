"""Keys of a scene that set acceptance criteria; no run depends on them."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from comparison.scene.fields import M_S, M, Positive, Real, Section, Unit, rule


class Compare(Section):
    """Tolerance for two tables without uncertainties: a share of each channel's scale."""

    tolerance: Positive | None = None


class Limits(Section):
    """Limits of the permitted error, for `comparison.reliability`: Delta_nu and Delta_mu of Eq. 38."""

    lower: Real = 0.0
    upper: Positive

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.lower >= self.upper:
            notes = type(self).model_fields["upper"].metadata
            unit = next((note.symbol for note in notes if isinstance(note, Unit)), "")
            raise rule("lower", self.lower, f"must be < upper = {self.upper:g} {unit}".rstrip(), unit)
        return self


class DisplacementLimits(Limits):
    """Of the slider's displacement: ISO 2768-1 f for a length of 0.12 m to 0.4 m; the stroke is 0.224 m."""

    lower: Annotated[Real, M] = 0.0
    upper: Annotated[Positive, M] = 2e-4


class VelocityLimits(Limits):
    """Of the slider's velocity: one hundredth of the largest that the ideal slider has at 150 rpm."""

    lower: Annotated[Real, M_S] = 0.0
    upper: Annotated[Positive, M_S] = 0.02


class AccelerationLimits(Limits):
    """Of the slider's acceleration: the published reliabilities imply 110 to 210 m/s^2, case by case."""

    lower: Annotated[Real, Unit("m/s^2")] = 0.0
    upper: Annotated[Positive, Unit("m/s^2")] = 150.0


class Reliability(Section):
    """Criteria for the slider's errors, see `comparison.reliability`.

    bins: intervals of the crank cycle. errors: whether mean and deviation are those of e or of |e|.
    """

    bins: Annotated[int, Field(ge=1, le=10_000)] = 10
    errors: Literal["signed", "absolute"] = "absolute"
    displacement: DisplacementLimits = DisplacementLimits()
    velocity: VelocityLimits = VelocityLimits()
    acceleration: AccelerationLimits = AccelerationLimits()


class RandomInput(Section):
    """Random variable about the scene's value of a key, for the study random-inputs.

    ``deviation`` is the standard deviation in the unit of the key; for a lognormal variable it must be small
    against the value, which is the median. ``element`` counts from 0 where the key holds a list.
    """

    key: Annotated[str, Field(min_length=1)]
    distribution: Literal["normal", "lognormal", "uniform"]
    deviation: Positive
    element: Annotated[int, Field(ge=0)] | None = None
