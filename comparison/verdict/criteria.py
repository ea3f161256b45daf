"""Criteria of a comparison of two tables: one set of options of the command line, Python and the fixture."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from comparison.scene.schema import Compare, NotNegative, Positive, Real
from comparison.tables.arguments import Options, by_name
from comparison.tables.table import TableError
from comparison.verdict.results import METRICS


def _names(value: object) -> object:
    if isinstance(value, tuple):
        return list(value)
    if not isinstance(value, list):
        raise PydanticCustomError("rule", "", {"text": "must be a list of names"})
    return value


class Criteria(Options, Compare):
    """Channels of two tables to compare, at which times, and by which limits.

    Tolerances, share, time tolerance and gate count only without an uncertainty.
    """

    tolerances: Annotated[dict[str, Positive], BeforeValidator(by_name)] = Field(default={})
    """Channel -> its own tolerance."""
    absolute: bool = False
    """Whether tolerances are in the channels' units instead of shares of their scales."""
    share: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1.0
    """Share of the samples that must be within the tolerance."""
    time_tolerance: NotNegative = 0.0
    """Time, s, by which either may be early or late, though neither may lack what the other has."""
    gate: Annotated[dict[str, Real], BeforeValidator(by_name)] = Field(default={})
    """Metric of `comparison.verdict.results.METRICS` -> its limit, for every channel."""
    channels: Annotated[
        list[Annotated[str, Field(min_length=1)]] | None, Field(min_length=1), BeforeValidator(_names)
    ] = None
    """Channels to compare; None: all."""
    at_events: Literal["left", "right", "both"] | None = None
    """Which rows of a time that a file repeats count."""
    common_time: bool = False
    """Whether tables of different spans are compared where both have samples, instead of refused."""
    period: Positive | None = None
    """Period of the motion, s, a hundredth of which is the window of an uncertainty; None: that of the scene,
    else the span of the tables."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        check_gate(self.gate)

    def tolerance_of(self, channel: str) -> float | None:
        """Return the tolerance of a channel; None if nothing limits it."""
        return self.tolerances.get(channel, self.tolerance)

    def over(self, *usual: Mapping[str, Any]) -> "Criteria":
        """Return these criteria completed by ``usual``, the last of which has precedence; gates join."""
        stated = self.model_dump(exclude_unset=True)
        gate = {metric: limit for each in (*usual, stated) for metric, limit in each.get("gate", {}).items()}
        return Criteria(
            **{name: value for each in (*usual, stated) for name, value in each.items()} | {"gate": gate}
        )


def check_gate(gate: Mapping[str, float]) -> None:
    """Raise `TableError` for an unknown metric, and for a limit that every value meets or none."""
    for metric, limit in gate.items():
        if metric not in METRICS:
            raise TableError(f"gate: {metric!r} is not a metric; there are {', '.join(METRICS)}")
        if METRICS[metric] > 0 and limit < 0:
            raise TableError(f"gate: {metric} = {limit:g} must be >= 0: it limits the size of an error")
        if METRICS[metric] < 0 and not -1 <= limit <= 1:
            raise TableError(f"gate: {metric} = {limit:g} must be -1 to 1: it is a rating")
