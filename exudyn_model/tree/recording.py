"""Judge each step of a tree, and keep what is asked of the accepted ones.

An accepted step goes from one state to the next without a touch or a leaving between: its angles are
interpolated by quintic Hermite polynomials, at the samples' times and at ``_POINTS`` equal parts of the step
for extrema, impulses and peaks. Whatever is kept follows from such a state by balance of forces.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import direct, kernel
from exudyn_model.contact_memory import EVENT, write_event
from exudyn_model.gap_search import GAP_TOLERANCE
from exudyn_model.mechanism import Model
from exudyn_model.point_contact import CONTACTS
from exudyn_model.tables import CHANNELS, event_table, extrema_table, new_extrema, widen
from exudyn_model.touch_location import freeze, locate
from exudyn_model.tree_forces import complete
from exudyn_model.tree_motion import MOTION, can_touch, contact_motion, interpolate, state_at
from exudyn_model.tree_observation import WIDTH, observe, watch

# Parts of a step, an even number: Simpson's rule takes them in pairs
_POINTS = 4
_COUNT = len(CONTACTS)


@kernel
def _renew_contacts(
    start: Any,
    end: Any,
    linkage: Any,
    law: Any,
    pin_law: Any,
    contacts: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """End the contacts that have opened, begin those that touch; the event count."""
    state = state_at(end)
    for number in range(_COUNT):
        if not can_touch(number, linkage):
            continue
        contact = contacts[number]
        gap, rate = contact_motion(number, state, linkage, law, pin_law)
        # What has just touched may still be open by round-off, but it approaches
        if contact.impact_speed > 0.0 and (gap > GAP_TOLERANCE or (gap >= -GAP_TOLERANCE and rate > 0.0)):
            # An accepted step has a contact that leaves at one of its ends: see `locate`
            write_event(events[event_count], number, contact, end.time if gap < -contact.gap else start.time)
            event_count += 1
            contact.impact_speed = 0.0
        contact.gap, contact.rate = gap, rate
        if contact.impact_speed == 0.0 and gap <= GAP_TOLERANCE and rate < 0.0:
            freeze(contact, end.time, law)
    return event_count


@kernel
def _accept(
    start_of_step: NDArray[np.void],
    end_of_step: NDArray[np.void],
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
    values: NDArray[np.float64],
    extrema: NDArray[np.void],
    samples: NDArray[np.float64],
    next_sample: int,
    sample_interval: float,
    known_until: float,
) -> tuple[int, int]:
    """Take the step from ``start`` to ``end``; the event count, and the number of samples so far."""
    start, end = start_of_step[0], end_of_step[0]
    step = end.time - start.time
    laws = linkage[0], law[0], pin_law[0]
    while next_sample < len(samples) and next_sample * sample_interval <= known_until:
        share = (next_sample * sample_interval - start.time) / step
        state = interpolate(start, end, share)
        observe(state, *laws, contacts, samples[next_sample])
        widen(extrema, samples[next_sample], state.time)
        next_sample += 1
    for number in range(_COUNT):
        contacts[number].impulse += step / (3 * _POINTS) * contacts[number].normal
    for point in range(1, _POINTS + 1):
        state = interpolate(start, end, point / _POINTS)
        observe(state, *laws, contacts, values)
        widen(extrema, values, state.time)
        weight = step / (3 * _POINTS) * (1 if point == _POINTS else 4 if point % 2 == 1 else 2)
        for number in range(_COUNT):
            contact = contacts[number]
            contact.normal = values[10 + 3 * number]
            contact.impulse += weight * contact.normal
            contact.peak = max(contact.peak, contact.normal)
            contact.depth = max(contact.depth, -values[9 + 3 * number])
        watch(state, values, *laws, contacts)
    event_count = _renew_contacts(start, end, *laws, contacts, events, event_count)
    return event_count, next_sample


@kernel
def _fill(motion: Any, time: float, q: NDArray[np.float64], v: NDArray[np.float64], linkage: Any) -> None:
    """Angles and angular velocities of ``motion`` from the tree's coordinates."""
    motion.time = time
    first = 0
    carried, carried_w = 0.0, 0.0
    if not linkage.ideal_pin:
        motion.theta3, motion.w3 = carried, carried_w = q[0], v[0]
        motion.theta2, motion.w2 = q[0] + q[1], v[0] + v[1]
        first = 2
    motion.theta4, motion.w4 = carried + q[first], carried_w + v[first]
    if not linkage.ideal_slider:
        motion.theta5, motion.w5 = motion.theta4 + q[first + 1], motion.w4 + v[first + 1]


@kernel
def _judge(
    start_of_step: NDArray[np.void],
    end_of_step: NDArray[np.void],
    time: float,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
    least: float,
) -> float:
    """Fill the step's end from the tree's coordinates; what :func:`locate` says of the step, or nan."""
    if not np.isfinite(np.sum(q) + np.sum(v)):
        return np.nan
    start, end = start_of_step[0], end_of_step[0]
    _fill(end, time, q, v, linkage[0])
    complete(end, linkage, law, pin_law, contacts)
    return locate(start, end, linkage, law, pin_law, contacts, least)


class TreeRecorder:
    """Judges the steps of one run and gathers its results.

    Parameters
    ----------
    model : Model
        From ``tree`` or ``rocker_tree``.
    sample_interval : float
        s.
    samples : int
        Besides the initial state.
    least : float
        Shortest step that ends where a contact begins or ends, s.
    """

    def __init__(self, model: Model, sample_interval: float, samples: int, least: float) -> None:
        self.steps = 0
        self.time = 0.0
        """Time of the last accepted state, s."""
        self._laws, self._contacts = (model.linkage, model.law, model.pin_law), model.contacts
        self._sample_interval, self._least = sample_interval, least
        self._start, self._end = np.zeros(1, MOTION), np.zeros(1, MOTION)
        self._values = np.zeros(WIDTH)
        self._samples = np.zeros((samples + 1, WIDTH))
        self._extrema = new_extrema(WIDTH)
        self._events = np.zeros(64, EVENT)
        self._event_count, self._sample_count = 0, 0
        ends, kept = (self._start, self._end), (*self._laws, self._contacts)
        coordinates = np.zeros(2)
        self._judge = direct(_judge, *ends, 0.0, coordinates, coordinates, *kept, 0.0)
        self._accept = direct(
            _accept,
            *ends,
            *kept,
            self._events,
            0,
            self._values,
            self._extrema,
            self._samples,
            0,
            0.0,
            0.0,
        )

    def begin(self, q: NDArray[np.float64], v: NDArray[np.float64]) -> None:
        """Take the initial state (see :meth:`judge`): what penetrates is in contact from t = 0."""
        linkage, law, pin_law = self._laws
        start, constants = self._start[0], (linkage[0], law[0], pin_law[0])
        _fill(start, 0.0, q, v, linkage[0])
        _renew_contacts(start, start, *constants, self._contacts, self._events, 0)
        for contact in self._contacts:
            if contact["gap"] < 0 and contact["impact_speed"] == 0:  # penetrates, but does not approach
                freeze(contact, 0.0, law[0])
        complete(start, *self._laws, self._contacts)
        observe(state_at(start), *constants, self._contacts, self._samples[0])
        widen(self._extrema, self._samples[0], 0.0)
        watch(state_at(start), self._samples[0], *constants, self._contacts)
        for number, contact in enumerate(self._contacts):
            contact["normal"] = contact["peak"] = self._samples[0, 10 + 3 * number]
            contact["depth"] = max(-contact["gap"], 0.0)
        self._sample_count = 1

    def judge(self, time: float, q: NDArray[np.float64], v: NDArray[np.float64], last: bool) -> float:
        """Accept the step to this state, or tell where in it a contact first begins or ends.

        Parameters
        ----------
        time : float
            s.
        q, v : ndarray
            Coordinates of the tree and their rates: see ``tree`` and ``rocker_tree``.
        last : bool
            Whether the run ends here: samples up to 1e-10 s later are extrapolated.

        Returns
        -------
        share : float
            1 if the step is accepted, else the share of it after which a contact begins or ends; nan if the
            coordinates are not finite.
        """
        start, end = self._start, self._end
        share = self._judge(start, end, time, q, v, *self._laws, self._contacts, self._least)
        if not share >= 1.0:
            return share
        if self._event_count + _COUNT > len(self._events):
            self._events = np.concatenate([self._events, np.zeros_like(self._events)])
        self._event_count, self._sample_count = self._accept(
            start,
            end,
            *self._laws,
            self._contacts,
            self._events,
            self._event_count,
            self._values,
            self._extrema,
            self._samples,
            self._sample_count,
            self._sample_interval,
            np.inf if last else time,
        )
        self._start, self._end = end, start
        self.time = time
        self.steps += 1
        return 1.0

    def columns(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return sampled channels by name, as far as the run came."""
        return {name: self._samples[: self._sample_count, CHANNELS.index(name)].copy() for name in names}

    def extrema(self, names: tuple[str, ...]) -> dict[str, dict[str, float]]:
        """Least and greatest value of each channel over the steps, with their times in s."""
        return extrema_table(self._extrema, CHANNELS, names)

    def events(self) -> dict[str, NDArray[Any]]:
        """Contacts sorted by start; one that lasts at the last accepted state ends there."""
        return event_table(self._events[: self._event_count], self._contacts, self.time)
