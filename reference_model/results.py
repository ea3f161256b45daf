"""What a simulation gives, and how it is named."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_model.channels import Extrema
from reference_model.linkage import Array
from reference_model.parameters import Parameters

EVENT_COLUMNS = ("start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")


@dataclass(frozen=True)
class Result:
    """What a simulation gives."""

    columns: dict[str, Array]
    """Channel -> values at the sample times, all of one length; "time" (s) first."""
    events: dict[str, NDArray[Any]]
    """One row a contact, ascending in start: "corner" and EVENT_COLUMNS (s, s, m/s, N s, N, m)."""
    pulses: dict[str, NDArray[Any]]
    """Normal forces of the contacts at the ends of steps, at marks and at peaks: "row" in the events, "time"
    (s), "force" (N)."""
    extrema: dict[str, dict[str, float]]
    """Channel -> min, time_of_min, max, time_of_max over all integration steps, whatever the samples."""
    cycle_extrema: dict[str, Array]
    """The same of each crank cycle, such as "slider_ay_time_of_min": arrays of one length. An instant between
    two cycles belongs to both."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """What produced it: integrator, settings, versions, counters, wall time."""
    status: str = "success"
    remedy: str = ""
    """What to try where the status is not "success"."""


def begun_cycles(p: Parameters) -> int:
    """Return how many crank cycles a run begins."""
    return max(1, math.ceil(p.cycles - 1e-9))


def name_results(
    names: list[str], times: Array, values: Array, events: dict[str, NDArray[Any]], extrema: Extrema
) -> Result:
    """Name what was recorded: samples (names, n) at the times (n,), contacts, extrema."""
    keys = ("min", "time_of_min", "max", "time_of_max")
    begun = extrema.values[extrema.begun()].reshape(-1, 4 * len(names))
    parts = [f"{name}_{key}" for name in names for key in keys]
    return Result(
        columns={"time": times} | dict(zip(names, values, strict=True)),
        events=events,
        pulses={"row": np.empty(0, dtype=np.int64), "time": np.empty(0), "force": np.empty(0)},
        extrema={
            name: dict(zip(keys, row, strict=True))
            for name, row in zip(names, extrema.of_all().tolist(), strict=True)
        },
        cycle_extrema=dict(zip(parts, begun.T.copy(), strict=True)),
    )
