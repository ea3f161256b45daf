"""What is kept of a run of five bodies: samples, contacts and extrema, collected from accepted states."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import COORDINATES, SLIDER_X
from exudyn_model.channels import CHANNELS, ENERGIES
from exudyn_model.compiled import direct
from exudyn_model.contact.memory import EVENT
from exudyn_model.contact.states import CONTACTS
from exudyn_model.energy import new_audit
from exudyn_model.five_bodies.constraints import CONSTRAINTS, Constraints
from exudyn_model.five_bodies.native_contact import RADIUS, deepest
from exudyn_model.five_bodies.observation import Kept, Vectors, observe
from exudyn_model.five_bodies.samples_between import interpolate
from exudyn_model.five_bodies.step_choice import StepChoice
from exudyn_model.model import Model
from exudyn_model.pulses import new_pulses, pulse_table
from exudyn_model.tables import cycle_extrema, event_table, new_extrema

_NOT_NATIVE = np.zeros((0, 4))
# Rows of the events' table at first; states whose constraints are judged at once
_ROOM = 256


class Recorder:
    """Recorder of one run of five bodies.

    :meth:`accept` must be called once for each accepted state, the initial one included, before the step that
    starts from it: it also updates the contacts' memory, which the contact force of that step reads.

    Parameters
    ----------
    model : Model
        From ``mechanism``.
    choice : StepChoice
        Tells the time of the state to accept.
    samples : int
        Besides the initial state.
    period : float
        Of the crank, s.
    masses : ndarray, shape (15,) or (0,)
        From ``energy``; empty where the energy is not audited.
    constraints : Constraints

    Attributes
    ----------
    accepted : int
        States so far.
    """

    def __init__(
        self,
        model: Model,
        choice: StepChoice,
        samples: int,
        period: float,
        masses: NDArray[np.float64],
        constraints: Constraints,
    ) -> None:
        self.accepted = 0
        self._drift = dict.fromkeys(CONSTRAINTS, (0.0, 0.0))
        self._constraints = constraints
        self._constants, self._contacts = model.constants, model.contacts
        self._choice = choice
        self._read_corners = model.read_corners
        self._drive = model.multipliers.index("crank_torque")
        self._channels = CHANNELS + model.multipliers
        if "reaction_A_x" not in self._channels:
            self._channels += ("reaction_A_x", "reaction_A_y")  # of the contact
        if len(masses):
            self._channels += ENERGIES
        count = len(self._channels)
        cycles = samples * choice.per_sample * choice.size / period
        extrema = new_extrema(count, period, cycles)
        self._kept = Kept(np.zeros(count), extrema, new_audit(), masses, new_pulses())
        self._samples = np.zeros((samples + 1, count))
        self._before = np.zeros(count)
        self._events = np.zeros(0, EVENT)
        self._event_count, self._sample_count = 0, 0
        self._time = 0.0
        self._required = np.zeros(_ROOM), *np.zeros((2, _ROOM, COORDINATES))
        self._required_count = 0
        self._followed: tuple[int, ...] = ()
        self._fill: Callable[..., None] | None = None

    def follow(
        self, q: NDArray[np.float64], v: NDArray[np.float64], multipliers: NDArray[np.float64]
    ) -> None:
        """Take the states to come from Exudyn's own vectors, which it fills anew in every step.

        To ask for them takes longer than to read them: at the states that there have to be is often enough to
        notice if they moved.

        Parameters
        ----------
        q, v : ndarray, shape (15,)
            Coordinates and their rates, the slider's x from the guide's centre line.
        multipliers : ndarray
            Those of Exudyn's constraints, in the order of ``Model.multipliers``.

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
        self._followed, self._q, self._v = places, q, v
        fixed = Vectors(q, v, multipliers, self._drive), self._kept, self._constants, self._contacts
        self._observe = partial(direct(observe, *fixed, 0.0, _NOT_NATIVE, self._events, 0), *fixed)

    def accept(self) -> bool:
        """Take the next state.

        Returns
        -------
        bool
            Whether it is a sample.
        """
        choice = self._choice
        is_sample, time = choice.at_sample, choice.time
        # Each contact ends at most once a step
        if self._event_count + len(CONTACTS) > len(self._events):
            self._events = np.concatenate([self._events, np.zeros(len(self._events) + _ROOM, EVENT)])
        native = self._read_corners() if self._read_corners else _NOT_NATIVE
        inside = choice.samples_inside()
        if inside:
            self._before[:] = self._kept.values
        self._event_count = self._observe(time, native, self._events, self._event_count)
        if inside:
            rows = self._samples[self._sample_count : self._sample_count + len(inside)]
            times = np.array(inside) * choice.size
            self._interpolate(self._time, time - self._time, times, rows)
            self._sample_count += len(inside)
        if is_sample:
            self._samples[self._sample_count] = self._kept.values
            self._sample_count += 1
        if choice.at_required_state:
            if self._required_count == _ROOM:
                self._judge_required()
            for kept, value in zip(self._required, (time, self._q, self._v), strict=True):
                kept[self._required_count] = value
            self._required_count += 1
        self._time = time
        self.accepted += 1
        return is_sample

    def _judge_required(self) -> None:
        """Take the violations of the constraints in the states that wait for it."""
        times, q, v = (kept[: self._required_count] for kept in self._required)
        self._required_count = 0
        if not times.size:
            return
        for name, amounts in zip(CONSTRAINTS, self._constraints.violation(times, q, v), strict=True):
            most = np.argmax(amounts)  # the first that is not a number, if one is not
            if not amounts[most] <= self._drift[name][0]:
                self._drift[name] = float(amounts[most]), float(times[most])

    def drift(self) -> dict[str, tuple[float, float]]:
        """Return of each of ``constraints.CONSTRAINTS`` the largest violation so far, and its time in s.

        In m and rad, and in m/s and rad/s, of the states that there have to be
        (``settings.steps_between_states``).
        """
        self._judge_required()
        return dict(self._drift)

    @property
    def is_behind_a_wall(self) -> bool:
        """Whether a corner is deeper in a wall than Exudyn's own contact object can hold it."""
        return self._read_corners is not None and deepest(self._q[SLIDER_X:], self._constants.law) > RADIUS

    def _interpolate(
        self, start: float, step: float, times: NDArray[np.float64], samples: NDArray[np.float64]
    ) -> None:
        fixed = self._constants.linkage[0], self._constants.law[0], samples
        arguments = self._before, self._kept.values, start, step, times, *fixed
        if self._fill is None:
            self._fill = direct(interpolate, *arguments)
        self._fill(*arguments)

    def is_finite(self) -> bool:
        """Whether the last accepted state holds no infinity and no NaN."""
        return bool(np.all(np.isfinite(self._kept.values)))

    def columns(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return sampled channels by name, as far as the run came."""
        return {
            name: self._samples[: self._sample_count, self._channels.index(name)].copy() for name in names
        }

    def cycle_extrema(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return least and greatest value of each channel in each cycle, with their times in s."""
        return cycle_extrema(self._kept.extrema, self._channels, names)

    def events(self) -> dict[str, NDArray[Any]]:
        """Return the contacts sorted by start; one that lasts at the last accepted state ends there."""
        return event_table(self._events[: self._event_count], self._contacts, self._time)

    def pulses(self, events: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Return the normal forces of the corners' contacts in time; ``events`` is from :meth:`events`."""
        return pulse_table(self._kept.pulses, self._contacts, events)
