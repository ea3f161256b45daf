"""What is kept of a run: samples, contacts and extrema, gathered step by step from accepted states."""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.accelerations import slider_acceleration
from exudyn_model.compiled import direct, kernel
from exudyn_model.contact_memory import EVENT, renew_corners
from exudyn_model.drift import CONSTRAINTS, Constraints
from exudyn_model.energy import ENERGIES, audit_energy, new_audit
from exudyn_model.journal import renew_pin
from exudyn_model.loose_pin import loose_pin_acceleration
from exudyn_model.mechanism import Model
from exudyn_model.native_contact import RADIUS, deepest, renew_native_corners
from exudyn_model.point_contact import CONTACTS, PIN
from exudyn_model.tables import CHANNELS, event_table, extrema_table, new_extrema, widen
from exudyn_model.watch import watch_corners, watch_pin

_NOT_NATIVE = np.zeros((0, 4))


@kernel
def _observe(
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    multipliers: NDArray[np.float64],
    drive: int,
    masses: NDArray[np.float64],
    audit: NDArray[np.void],
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
    values: NDArray[np.float64],
    extrema: NDArray[np.void],
    index: int,
    native: NDArray[np.float64],
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """Renew the contacts' memory, fill ``values`` with all channels, widen ``extrema``; the event count.

    ``drive`` is the place of the motor among the ``multipliers``; ``native`` is empty, or what
    ``native_contact`` tells of the corners.
    """
    constants = linkage[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    if len(native) > 0:
        event_count, fx, fy, moment = renew_native_corners(
            index, q[12:], v[12:], native, law, contacts, events, event_count
        )
    elif not constants.ideal_slider:
        event_count, fx, fy, moment = renew_corners(index, q[12:], v[12:], law, contacts, events, event_count)
    values[0], values[1], values[2] = constants.guide_x + q[12], q[13], q[14]
    values[3], values[4], values[5] = v[12], v[13], v[14]
    if constants.ideal_pin:
        values[6], values[7], values[8] = slider_acceleration(q, v, fx, fy, moment, constants)
    else:
        event_count, pin_x, pin_y, pin_moment = renew_pin(
            index, q[:6], v[:6], pin_law, contacts, events, event_count
        )
        values[6], values[7], values[8] = loose_pin_acceleration(
            q, v, pin_x, pin_y, pin_moment, fx, fy, moment, constants
        )
        values[21 + len(multipliers)], values[22 + len(multipliers)] = pin_x, pin_y
        _watch_pin(index * law[0].step, q, v, pin_law[0], contacts)
    for number in range(4):
        values[9 + 3 * number] = contacts[number].gap
        values[10 + 3 * number] = contacts[number].normal
        values[11 + 3 * number] = contacts[number].friction
    # Exudyn's own contact begins with the first step, whatever is closed before
    if not constants.ideal_slider and (index > 0 or len(native) == 0):
        watch_corners(index * law[0].step, q[12], q[14], v[12], v[13], v[14], values, law[0], contacts)
    for row in range(len(multipliers)):
        values[21 + row] = -multipliers[row]
    if len(masses) > 0:
        torque, energies = -multipliers[drive], values[len(values) - 7 :]
        audit_energy(index, q, v, torque, masses, constants, law[0], pin_law[0], contacts, audit[0], energies)
    widen(extrema, values, index * law[0].step)
    return event_count


@kernel
def _watch_pin(
    time: float, q: NDArray[np.float64], v: NDArray[np.float64], law: Any, contacts: NDArray[np.void]
) -> None:
    """Watch the crank pin from the coordinates of all bodies: see ``watch``."""
    x1, y1 = law.crank_to_tip * np.cos(q[2]), law.crank_to_tip * np.sin(q[2])
    x2, y2 = law.rod2_centroid * np.cos(q[5]), law.rod2_centroid * np.sin(q[5])
    watch_pin(
        time,
        q[0] + x1 - q[3] + x2,
        q[1] + y1 - q[4] + y2,
        v[0] - v[2] * y1 - v[3] - v[5] * y2,
        v[1] + v[2] * x1 - v[4] + v[5] * x2,
        v[2],
        v[5],
        contacts[PIN].normal,
        contacts[PIN].friction,
        law,
        contacts,
    )


class Recorder:
    """Gathers the results of one run.

    :meth:`accept` must be called once for each accepted state, the initial one included, before the step that
    starts from it: it also renews the contacts' memory, which the contact force of that step reads.

    Parameters
    ----------
    model : Model
        From ``mechanism``.
    steps_per_sample, samples : int
        Every ``steps_per_sample``-th state is a sample; ``samples`` of them besides the initial state.
    masses : ndarray, shape (15,) or (0,)
        From ``energy``; empty where the energy is not audited.
    constraints : Constraints

    Attributes
    ----------
    accepted : int
        States so far.
    drift : dict
        For each of ``drift.CONSTRAINTS`` the largest violation at a sample (m, rad; m/s, rad/s) and its time
        (s).
    """

    def __init__(
        self,
        model: Model,
        steps_per_sample: int,
        samples: int,
        masses: NDArray[np.float64],
        constraints: Constraints,
    ) -> None:
        self.accepted = 0
        self.drift = dict.fromkeys(CONSTRAINTS, (0.0, 0.0))
        self._constraints = constraints
        self._linkage, self._contacts = model.linkage, model.contacts
        self._law, self._pin_law = model.law, model.pin_law
        self._read_corners = model.read_corners
        self._drive = model.multipliers.index("crank_torque")
        self._steps_per_sample = steps_per_sample
        self._masses, self._audit = masses, new_audit()
        self._channels = CHANNELS + model.multipliers
        if "reaction_A_x" not in self._channels:
            self._channels += ("reaction_A_x", "reaction_A_y")  # of the contact
        if len(masses):
            self._channels += ENERGIES
        self._values = np.zeros(len(self._channels))
        self._samples = np.zeros((samples + 1, len(self._channels)))
        self._extrema = new_extrema(len(self._channels))
        self._events = np.zeros(0, EVENT)
        self._event_count = 0
        self._followed: tuple[int, ...] = ()

    @property
    def at_sample(self) -> bool:
        """Whether the next state is a sample."""
        return self.accepted % self._steps_per_sample == 0

    def follow(
        self, q: NDArray[np.float64], v: NDArray[np.float64], multipliers: NDArray[np.float64]
    ) -> None:
        """Take the states to come from Exudyn's own vectors, which it fills anew in every step.

        To ask for them takes longer than to read them: once a sample is enough to notice if they moved.

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
        fixed = (
            q,
            v,
            multipliers,
            self._drive,
            self._masses,
            self._audit,
            self._linkage,
            self._law,
            self._pin_law,
            self._contacts,
            self._values,
            self._extrema,
        )
        self._observe = partial(direct(_observe, *fixed, 0, _NOT_NATIVE, self._events, 0), *fixed)

    def accept(self) -> bool:
        """Take the next state.

        Returns
        -------
        bool
            Whether it is a sample.
        """
        is_sample = self.accepted % self._steps_per_sample == 0
        if is_sample:
            # Each contact ends at most once a step: this lasts until the next sample
            needed = self._event_count + len(CONTACTS) * self._steps_per_sample
            if needed > len(self._events):
                self._events = np.concatenate([self._events, np.zeros(needed, EVENT)])
        native = self._read_corners() if self._read_corners else _NOT_NATIVE
        self._event_count = self._observe(self.accepted, native, self._events, self._event_count)
        if is_sample:
            self._samples[self.accepted // self._steps_per_sample] = self._values
            time = self.accepted * float(self._law[0]["step"])
            for name, amount in zip(
                CONSTRAINTS, self._constraints.violation(time, self._q, self._v), strict=True
            ):
                if not amount <= self.drift[name][0]:  # also where it is not a number
                    self.drift[name] = amount, time
        self.accepted += 1
        return is_sample

    @property
    def is_behind_a_wall(self) -> bool:
        """Whether a corner is deeper in a wall than Exudyn's own contact object can hold it."""
        return self._read_corners is not None and deepest(self._q[12:], self._law) > RADIUS

    def is_finite(self) -> bool:
        """Whether the last accepted state holds no infinity and no NaN."""
        return bool(np.all(np.isfinite(self._values)))

    def columns(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return sampled channels by name, as far as the run came."""
        count = (self.accepted - 1) // self._steps_per_sample + 1
        return {name: self._samples[:count, self._channels.index(name)].copy() for name in names}

    def extrema(self, names: tuple[str, ...]) -> dict[str, dict[str, float]]:
        """Least and greatest value of each channel over all accepted states, with their times in s."""
        return extrema_table(self._extrema, self._channels, names)

    def events(self) -> dict[str, NDArray[Any]]:
        """Contacts sorted by start; one that lasts at the last accepted state ends there."""
        now = (self.accepted - 1) * float(self._law[0]["step"])
        return event_table(self._events[: self._event_count], self._contacts, now)
