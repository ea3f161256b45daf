"""Run of any formulation: call of Exudyn's solver, and results before the invariants judge them."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from exudyn_model.invariants import Watch
from exudyn_model.kernels import seal
from exudyn_model.tables import Contacts, Extrema

Array = NDArray[np.float64]
Report = Callable[[float], None]

# Fields of a memory that the table of contacts reads
TABLE_FIELDS = ("impact_speed", "start", "name")
# Number of states or steps that are observed at once: as many as the processor's cache holds
BATCH = 2048
# Time between two reports of progress, s
PROGRESS_INTERVAL = 0.1


@dataclass(frozen=True)
class Outcome:
    """End of a run: status, remedy ("" after success) and counters."""

    status: str
    remedy: str
    counters: dict[str, int]


class Recorder:
    """Results of a run, filled by the recorder of its formulation.

    Parameters
    ----------
    channels, contacts : tuple of str
        Names of all channels, and of the contacts' rows.
    shared : bool
        True if a side of the slider has one contact: see ``laws.Law``.
    samples : int
        Number of samples besides the initial state.
    period, duration : float
        Crank cycle and length of the run, s.

    Attributes
    ----------
    extrema, contacts, watch
        See ``tables`` and ``invariants``.
    time : float
        Time of the last accepted state, s.
    ending : tuple of str
        Status and remedy of a run that its states end, else empty.
    """

    def __init__(
        self, channels: tuple[str, ...], contacts: tuple[str, ...], shared: bool, samples: int, period: float,
        duration: float,
    ) -> None:  # fmt: skip
        self.channels, self.time, self.watch = channels, 0.0, Watch()
        self.ending: tuple[str, str] | tuple[()] = ()
        self.extrema = Extrema(len(channels), period, duration)
        self.contacts = Contacts(contacts, shared)
        self._samples, self._sample_count = np.full((len(channels), samples + 1), np.nan), 0

    def explain_failure(self) -> None:
        """Set ``ending`` where the states tell why the solver has failed."""

    def take_samples(self, values: Array) -> None:
        """Take the next n samples; the first rows of ``values``, shape (>= channels, n), are the channels."""
        end = self._sample_count + values.shape[1]
        self._samples[:, self._sample_count : end] = values[: len(self.channels)]
        self._sample_count = end

    def columns(self, names: tuple[str, ...]) -> dict[str, Array]:
        """Return the samples of the named channels up to the end of the run."""
        return {name: self._samples[self.channels.index(name), : self._sample_count].copy() for name in names}

    def event_table(self) -> dict[str, NDArray[Any]]:
        """Return the contacts sorted by start; one that lasts at the last accepted state ends there."""
        return self.contacts.table(self.time)


@dataclass(frozen=True)
class Run:
    """A run of any formulation."""

    formulation: str  # As the provenance names it
    settings: dict[str, Any]  # Settings in addition to those of the scene
    recorder: Recorder
    outcome: Outcome
    # Largest violation of "position" (m, rad) and "velocity" (m/s, rad/s), and its time (s); a tree has none
    constraints: dict[str, tuple[float, float]] = field(default_factory=dict)


class Progress:
    """Report the finished fraction of a run of ``duration`` s, at most once in ``PROGRESS_INTERVAL``."""

    def __init__(self, report: Report | None, duration: float) -> None:
        self._report, self._duration, self._last = report, duration, time.monotonic()

    def __call__(self, run_time: float) -> None:
        """Report that the run has reached a time in s."""
        if self._report is not None and time.monotonic() - self._last > PROGRESS_INTERVAL:
            self._last = time.monotonic()
            seal()  # other processes wait for the code that this one compiles
            self._report(min(1.0, run_time / self._duration))

    def finish(self) -> None:
        """Report that the run has reached its end."""
        if self._report is not None:
            self._report(1.0)


class StopError(Exception):
    """Stop a run from inside a user function; the argument is the run's status."""


def state_vectors(mbs: Any) -> list[Array]:
    """Return views of Exudyn's coordinates, rates and multipliers, if any; each request takes 1 us."""
    data = mbs.systemData
    vectors = data.GetODE2Coordinates, data.GetODE2Coordinates_t, data.GetAECoordinates
    return [view for view in (vector(copy=False) for vector in vectors) if view.size]


def quiet_settings(duration: float) -> Any:
    """Make ``exudyn.SimulationSettings`` of a run of ``duration`` (s) that prints and writes nothing."""
    values = exu.SimulationSettings()
    # No folder `solution/`, no file, no sensor: `recording` reads Exudyn's memory
    values.solution.file.write = False
    values.solution.sensors.active = False
    values.timeIntegration.verboseMode = 0
    values.timeIntegration.endTime = duration
    return values


def solve(
    mbs: Any,
    settings: Any,
    before_step: Callable[..., bool],
    after_newton: Callable[..., Any] | None,
    **options: Any,
) -> str:
    """Let Exudyn solve, with its pre-step and its post-Newton function.

    Return "success", "solver-error", or the status of a ``StopError``. Any other exception of a user
    function, also Ctrl-C, is raised unchanged.
    """
    console = exu.config.printToConsole
    exu.config.printToConsole = False
    mbs.SetPreStepUserFunction(before_step)
    if after_newton is not None:
        mbs.SetPostNewtonUserFunction(after_newton)
    try:
        mbs.SolveDynamic(settings, **options)
    except exu.SolverError:
        return "solver-error"
    except exu.ModelError as error:
        if isinstance(error.__cause__, StopError):
            return str(error.__cause__)
        raise (error.__cause__ or error) from None
    finally:
        exu.config.printToConsole = console
        mbs.SetPreStepUserFunction(0)
        mbs.SetPostNewtonUserFunction(0)
    return "success"
