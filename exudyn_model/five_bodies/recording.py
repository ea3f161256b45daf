"""What is kept of a run of five bodies, collected from accepted states; dense samples lie between them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import ACROSS_X, ACROSS_Y, DIRECTION, LAW
from exudyn_model.corners import CORNER_COUNT, corner_load, corner_motion
from exudyn_model.five_bodies.observation import AUDIT_COLUMNS, Kept, observe
from exudyn_model.five_bodies.step_choice import StepChoice
from exudyn_model.five_bodies.system import ANGLE, PER_BODY, Constants, Model, X, Y
from exudyn_model.kernels import entry, machine_code
from exudyn_model.laws import SHARED
from exudyn_model.tables import (
    ACCELERATIONS,
    ALPHA,
    CONTACT,
    ENERGIES,
    JOURNAL,
    MOTION,
    PER_CONTACT,
    STATE,
    TO_RATE,
    Tables,
    corner_channels,
)
from exudyn_model.watch import new_watch

Array = NDArray[np.float64]

CONSTRAINTS = ("position", "velocity")


@entry
def interpolate(
    before: Array,
    after: Array,
    start: float,
    step: float,
    times: Array,
    system: Constants,
    observed: int,
    samples: Array,
) -> None:
    """Fill the channels at times inside a step.

    Coordinates and velocities by cubic Hermite polynomials of the states and their rates, whose error is of
    fourth order in the step; gaps from these coordinates; all others linearly, with an error of second order,
    as that of the method, but the angular acceleration of a body in a guide: that follows from the corners'
    forces.

    Parameters
    ----------
    before, after : ndarray, shape (channels,)
        All channels at both ends of the step.
    start, step : float
        Its beginning and length, s.
    times : ndarray, shape (n,)
        s.
    system : Constants
    observed : int
        Body whose motion is recorded.
    samples : ndarray, shape (n, channels)
        Filled.
    """
    for sample in range(len(times)):
        s, values = (times[sample] - start) / step, samples[sample]
        r = 1.0 - s
        for channel in range(len(values)):
            values[channel] = r * before[channel] + s * after[channel]
        for channel in range(MOTION):
            change = after[channel] - before[channel]
            leaves = step * before[channel + TO_RATE] - change
            arrives = change - step * after[channel + TO_RATE]
            values[channel] += s * r * (r * leaves + s * arrives)
        for number in range(len(system.sliders)):
            law, body = system.sliders[number], int(system.slider_bodies[number])
            if body != observed:
                continue
            x = values[X] - system.reference[PER_BODY * body + X]
            y = values[Y] - system.reference[PER_BODY * body + Y]
            across, moment = law[ACROSS_X] * x + law[ACROSS_Y] * y, 0.0
            for corner in range(CORNER_COUNT):
                column = CONTACT + PER_CONTACT * (CORNER_COUNT * number + corner)
                motion = corner_motion(corner, across, values[ANGLE] - law[DIRECTION], 0.0, 0.0, 0.0, law)
                values[column] = motion.gap
                moment += corner_load(corner, values[column + 1], values[column + 2], motion)[2]
            values[ALPHA] = moment / system.masses[PER_BODY * body + ANGLE]


class Recorder:
    """Recorder of one run of five bodies.

    :meth:`accept` must be called once for each accepted state, the initial one included, before the step that
    starts from it: it also updates the contacts' memory, which the contact force of that step reads.

    Parameters
    ----------
    model : Model
    choice : StepChoice
        Tells the time of the state to accept.
    samples : int
        Besides the initial state.
    period, duration : float
        Of the crank's cycle and of the run, s.
    energy : bool
        Whether the energies are recorded.

    Attributes
    ----------
    accepted : int
        States so far.
    tables : Tables
    watch : ndarray, shape (contacts, columns)
        See ``watch``.
    """

    def __init__(
        self, model: Model, choice: StepChoice, samples: int, period: float, duration: float, energy: bool
    ) -> None:
        system, contacts = model.system, model.contacts
        names = system.contact_names
        channels = (*STATE, *ACCELERATIONS, *corner_channels(names))
        channels += tuple(f"{name}{n or ''}" for n in range(len(system.journals)) for name in JOURNAL)
        channels += system.multipliers
        channels += tuple(f"reaction_{journal.name}_{axis}" for journal in system.journals for axis in "xy")
        channels += ENERGIES if energy else ()
        self.accepted, self.watch = 0, new_watch(len(contacts))
        shared = any(SHARED[int(law[LAW])] for law in model.constants.sliders)
        self.tables = Tables(names, contacts, channels, period, duration, shared)
        rows, coordinates = len(system.multipliers), PER_BODY * len(system.bodies)
        self._kept = Kept(
            np.zeros(len(channels)),
            self.tables.extrema,
            self.tables.notes,
            self.watch,
            np.zeros((len(CONSTRAINTS), 2)),
            np.zeros(AUDIT_COLUMNS if energy else 0),
            *np.zeros((2, coordinates)),
            np.zeros((rows, coordinates)),
            np.zeros(rows),
            np.zeros((rows, rows)),
        )
        self._model, self._choice = model, choice
        self._samples, self._sample_count = np.zeros((samples + 1, len(channels))), 0
        self._before, self._time = np.zeros(len(channels)), 0.0
        self._followed: tuple[int, ...] = ()
        self._fill: Any = None

    def follow(self, q: Array, v: Array, multipliers: Array) -> None:
        """Take the states to come from Exudyn's own vectors, which it fills anew in every step.

        To ask for them takes longer than to read them: at the states that there have to be is often enough to
        notice if they moved.

        Parameters
        ----------
        q, v : ndarray, shape (3 n,)
            Coordinates and their rates.
        multipliers : ndarray
            Those of Exudyn's constraints, in the order of ``System.multipliers``.

        Raises
        ------
        AssertionError
            If these are not the vectors of the last call.
        """
        places = tuple(vector.ctypes.data for vector in (q, v, multipliers))
        if self._followed:
            if places != self._followed:
                raise AssertionError("Exudyn has moved its state")
            return
        self._followed, model = places, self._model
        fixed = q, v, multipliers, model.constants, model.system.observed, model.step, model.contacts
        fixed += self._kept, self.tables.period, self._choice.size
        examples = 0.0, *fixed, 0.0, self._choice.before, self.tables.events, 0
        self._observe, self._fixed = machine_code(observe, *examples), fixed

    def accept(self) -> int:
        """Take the next state; return how many ticks the next step may take."""
        choice, tables = self._choice, self.tables
        time, inside = choice.time, choice.samples_inside()
        tables.make_room()
        if inside:
            self._before[:] = self._kept.values
        tables.count, ticks = self._observe(
            time, *self._fixed, float(choice.allowed), choice.before, tables.events, tables.count
        )
        if inside:
            self._fill_samples(time, np.array(inside) * choice.size)
        if choice.at_sample:
            self._samples[self._sample_count] = self._kept.values
            self._sample_count += 1
        self._time = time
        self.accepted += 1
        return ticks

    def _fill_samples(self, time: float, times: Array) -> None:
        """Fill the samples inside the step that ends at ``time`` (s)."""
        rows = self._samples[self._sample_count : self._sample_count + len(times)]
        ends = self._before, self._kept.values, self._time, time - self._time, times
        arguments = *ends, self._model.constants, self._model.system.observed, rows
        if self._fill is None:
            self._fill = machine_code(interpolate, *arguments)
        self._fill(*arguments)
        self._sample_count += len(times)

    def drift(self) -> dict[str, tuple[float, float]]:
        """Return of each of ``CONSTRAINTS`` the largest violation so far (m, rad; m/s, rad/s), and when (s)."""
        return {
            name: (float(value), float(time))
            for name, (value, time) in zip(CONSTRAINTS, self._kept.drift, strict=True)
        }

    def is_finite(self) -> bool:
        """Whether the last accepted state holds no infinity and no NaN."""
        return bool(np.all(np.isfinite(self._kept.values)))

    def columns(self, names: tuple[str, ...]) -> dict[str, Array]:
        """Return sampled channels by name, as far as the run came."""
        samples = self._samples[: self._sample_count]
        return {name: samples[:, self.tables.channels.index(name)].copy() for name in names}

    def event_table(self) -> dict[str, NDArray[Any]]:
        """Return the contacts sorted by start; one that lasts at the last accepted state ends there."""
        return self.tables.event_table(self._time)
