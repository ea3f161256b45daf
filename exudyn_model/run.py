"""Results of a run, of any formulation, before they are judged."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from exudyn_model.tables import Contacts, Extrema
from exudyn_model.watch import Watch

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

    channels: tuple[str, ...]
    extrema: Extrema
    contacts: Contacts
    watch: Watch

    def columns(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return sampled channels by name."""

    def event_table(self) -> dict[str, NDArray[Any]]:
        """Return the table of contacts."""


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
    outcome : Outcome
    constraints : dict
        Largest violation of each kind (m, rad; m/s, rad/s), and when (s); a tree has none.
    """

    formulation: str
    settings: dict[str, Any]
    recorder: Recorded
    outcome: Outcome
    constraints: dict[str, tuple[float, float]] = field(default_factory=dict)
