"""Results of a run, of any formulation, before they are judged."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

# s between two calls of `progress`
PROGRESS_INTERVAL = 0.1


@dataclass(frozen=True)
class Outcome:
    """How a run ended: status, remedy ("" after success) and counters."""

    status: str
    remedy: str
    counters: dict[str, int]


class Recorded(Protocol):
    """Results that the recorder of any formulation holds."""

    def columns(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return sampled channels by name."""

    def cycle_extrema(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return extrema of channels in each cycle."""

    def events(self) -> dict[str, NDArray[Any]]:
        """Return the table of contacts."""

    def pulses(self, events: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Return the forces of the contacts at the corners in time, by row of that table."""


@dataclass(frozen=True)
class Run:
    """A run of any formulation.

    Attributes
    ----------
    formulation : str
        As the provenance names it.
    settings : dict
        Beside those of the scene.
    recorder : Recorded
    contacts : ndarray, shape (5,)
        With what ``watch`` has seen of them.
    outcome : Outcome
    constraints : dict
        Largest violation of each kind (m, rad; m/s, rad/s) at a sample, and when (s); a tree has none.
    """

    formulation: str
    settings: dict[str, Any]
    recorder: Recorded
    contacts: NDArray[np.void]
    outcome: Outcome
    constraints: dict[str, tuple[float, float]] = field(default_factory=dict)
