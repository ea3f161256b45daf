"""What the runs of step stability vary."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Config:
    """Values of settings.

    Attributes
    ----------
    gains
        Baumgarte's alpha and beta, 1/s, ascending from 0; the default of a scene among them.
    tolerances
        Of a step under them, rad and m, descending; the first one is that of all pairs and of the long runs.
    cycles
        Lengths of the long runs, ascending from 1.
    moduli
        Young's, of contacts under fixed steps, Pa, ascending.
    impact_steps, phases
        Steps (s) of single impacts, and how much of one the touch comes after a state in flight.
    map_steps
        Steps (s) of a quarter of a cycle, ascending.
    """

    gains: tuple[float, ...]
    tolerances: tuple[float, ...]
    cycles: tuple[float, ...]
    moduli: tuple[float, ...]
    impact_steps: tuple[float, ...]
    phases: tuple[float, ...]
    map_steps: tuple[float, ...]
