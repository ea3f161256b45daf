"""Result table of a run: its channels, events, extrema and provenance."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from comparison.tables.channels import Channel, channels, is_uncertainty
from comparison.tables.columns import Columns, are_plain, framed
from comparison.tables.pulses import thinned
from comparison.tables.result import Result, check_result

# Pandas is imported only where it is used: with pyarrow it takes longer than a short run.
if TYPE_CHECKING:
    import pandas as pd


class TableError(ValueError):
    """Unusable table; the message is one line with file, channel and row."""


@dataclass(frozen=True)
class Table:
    """Results of a run.

    Attributes
    ----------
    frame
        ``time`` (s) first, then one column per channel.
    events
        One row per contact, or None where the source has no events.
    extrema
        Channel -> min, time_of_min, max, time_of_max over integration steps, whatever the samples.
    provenance
        Model, settings and versions that produced the results.
    own
        Definitions of the channels that are not the press's, or have a scale of their own.
    pulses
        Normal forces of the events in time (`comparison.tables.pulses`), or None where the source has none.
    cycle_extrema
        The extrema of each crank cycle, such as ``slider_ay_time_of_min``, shape (cycles,); or None.
    """

    frame: pd.DataFrame
    events: pd.DataFrame | None = field(default_factory=lambda: None)
    extrema: dict[str, dict[str, float]] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)
    own: dict[str, Channel] = field(default_factory=dict)
    pulses: Columns | None = None
    cycle_extrema: Columns | None = None

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """Convert the result of a model's ``simulate``, whatever its status.

        Raises
        ------
        TableError
            If it lacks attributes of a `Result`, or its columns differ in length.
        """
        table = cls.__new__(cls)
        try:
            check_result(result)
            vars(table).update(_held("frame", result.columns))
            vars(table).update(_held("events", result.events) if result.events else {"events": None})
        except (TypeError, ValueError) as error:
            raise TableError(f"the model's {error}") from error
        provenance = {**result.provenance, "status": result.status, "remedy": result.remedy}
        vars(table).update(extrema=result.extrema, provenance=provenance, own={})
        pulses = getattr(result, "pulses", None)
        vars(table)["pulses"] = thinned(pulses) if pulses and pulses["row"].size else None
        vars(table)["cycle_extrema"] = getattr(result, "cycle_extrema", None) or None
        return table

    if not TYPE_CHECKING:  # else any name would be an attribute

        def __getattr__(self, name: str) -> Any:
            """Make a frame of the model's columns where it is first asked for."""
            columns = vars(self).get(_HELD.get(name, ""))
            if columns is None:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            vars(self)[name] = framed(columns)
            return vars(self)[name]

    def with_provenance(self, provenance: dict[str, Any]) -> Self:
        """Return this table with another provenance; no frame is made for that."""
        changed = copy(self)
        vars(changed)["provenance"] = provenance
        return changed

    @property
    def known(self) -> dict[str, Channel]:
        """Definitions of all channels that the table may hold, by name."""
        return channels() | self.own

    @property
    def time(self) -> NDArray[np.float64]:
        """Time, s, shape (n,)."""
        return self.values("time")

    @property
    def channels(self) -> list[str]:
        """Column names without ``time`` and without the estimated errors of channels."""
        return [name for name in self.names if name != "time" and not is_uncertainty(name)]

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return [str(name) for name in self.columns]

    @property
    def columns(self) -> pd.DataFrame | Columns:
        """The frame if it is there, else the columns that it would be made of."""
        held: pd.DataFrame | Columns = vars(self)["frame" if "frame" in vars(self) else _HELD["frame"]]
        return held

    @property
    def contacts(self) -> dict[str, NDArray[Any]] | None:
        """Columns of the events, shape (m,) each, or None where the source has no events."""
        if "events" not in vars(self):
            held: dict[str, NDArray[Any]] = vars(self)[_HELD["events"]]
            return held
        return (
            None if self.events is None else {str(name): self.events[name].to_numpy() for name in self.events}
        )

    def only(self, names: Sequence[str]) -> Self:
        """Return the time and these channels alone; those that it lacks are left out, and so are events."""
        wanted = ("time", *dict.fromkeys(names))
        frame = self.frame[[name for name in wanted if name in self.frame]]
        return replace(self, frame=frame, events=None, pulses=None)

    def values(self, channel: str) -> NDArray[np.float64]:
        """Return one column, shape (n,)."""
        return np.asarray(self.columns[channel], dtype=np.float64)


_HELD = {"frame": "_frame_columns", "events": "_event_columns"}
"""Attributes that are made of columns when they are first asked for, and the names of these columns."""


def _held(name: str, columns: Columns) -> dict[str, Any]:
    return {_HELD[name]: dict(columns)} if are_plain(columns) else {name: framed(columns)}
