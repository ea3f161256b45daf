"""Judge a step of a tree, and record an accepted one.

An accepted step goes from one state to the next without a touch or a separation between: its angles are
interpolated by quintic Hermite polynomials, at the samples' times and at ``POINTS`` equal parts of the step
for extrema, impulses and peaks. Whatever is kept follows from such a state by balance of forces.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.channels import GAP, NORMAL, PER_CONTACT
from exudyn_model.compiled import kernel
from exudyn_model.constants import Constants
from exudyn_model.contact.foundation import other_end, shares_contact
from exudyn_model.contact.laws import FOUNDATION
from exudyn_model.contact.memory import write_event
from exudyn_model.contact.states import CONTACTS, PIN
from exudyn_model.pulses import note
from exudyn_model.tables import Extrema, update_extrema, update_vertices
from exudyn_model.tree.forces import complete
from exudyn_model.tree.isolation import GAP_TOLERANCE
from exudyn_model.tree.motion import contact_motion, has_clearance, interpolate, state_at
from exudyn_model.tree.observation import observe, watch
from exudyn_model.tree.switching import close, locate

# Parts of a step, an even number: Simpson's rule and the extrema's parabolas take them in pairs
POINTS = 4
# A contact of no more steps needs its force at these points too: loose tolerances get through with 6 steps
_FEW = 20
_COUNT = len(CONTACTS)


class Kept(NamedTuple):
    """Arrays that the steps of a run fill.

    Attributes
    ----------
    values : ndarray, shape (``POINTS`` + 1, ``observation.WIDTH``)
        Of the step observed last, at equal intervals from its start to its end.
    extrema : Extrema
        From ``tables.new_extrema``.
    samples : ndarray, shape (samples, ``observation.WIDTH``)
    pulses : ndarray, shape (4, samples, 2)
        From ``pulses.new_pulses``.
    """

    values: NDArray[np.float64]
    extrema: Extrema
    samples: NDArray[np.float64]
    pulses: NDArray[np.float64]


@kernel
def record_start(
    start: NDArray[np.void], constants: Constants, contacts: NDArray[np.void], kept: Kept
) -> None:
    """Record the state at t = 0, shape (1,), as the first sample, and fill in its accelerations."""
    linkage, law, pin_law = constants.linkage[0], constants.law[0], constants.pin_law[0]
    complete(start[0], constants.linkage, constants.law, constants.pin_law, contacts)
    state, sample = state_at(start[0], linkage), kept.samples[0]
    observe(state, linkage, law, pin_law, contacts, sample)
    kept.values[POINTS] = sample
    update_extrema(kept.extrema, sample, state.time)
    watch(state, sample, linkage, law, pin_law, contacts)


@kernel
def update_contacts(
    start: Any,
    end: Any,
    linkage: Any,
    law: Any,
    pin_law: Any,
    contacts: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """End the contacts that have opened, begin those that touch; return the count of events."""
    state = state_at(end, linkage)
    for number in range(_COUNT):
        if not has_clearance(number, linkage):
            continue
        contact = contacts[number]
        gap, rate = contact_motion(number, state, linkage, law, pin_law)
        # What has just touched may still be open by round-off, but it approaches
        if contact.closed > 0.0 and (gap > GAP_TOLERANCE or (gap >= -GAP_TOLERANCE and rate > 0.0)):
            # In an accepted step a contact separates at one of the ends alone: see `locate`
            left = end.time if gap < -contact.gap else start.time
            event_count = separate(number, contacts, left, law, events, event_count)
        contact.gap, contact.rate = gap, rate
        if contact.closed == 0.0 and gap <= GAP_TOLERANCE and rate < 0.0:
            close(number, contacts, end.time, law)
    return event_count


@kernel
def separate(
    number: int,
    contacts: NDArray[np.void],
    time: float,
    law: Any,
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """Open one of ``CONTACTS`` at ``time`` (s) and end its contact, unless that goes on in the other corner.

    ``law`` is that of the guide; returns the count of events.
    """
    contact, name = contacts[number], number
    contact.closed, contact.left = 0.0, time
    if shares_contact(number, law):
        other = contacts[other_end(number)]
        if other.closed > 0.0:
            return event_count
        time = max(time, other.left)
        if other.impact_speed > 0.0:
            name = other_end(number)
    write_event(events[event_count], name, contacts[name], time)
    contacts[name].impact_speed = 0.0
    return event_count + 1


@kernel
def accept_step(
    start: Any,
    end: Any,
    constants: Constants,
    contacts: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
    kept: Kept,
    next_sample: int,
    sample_interval: float,
    known_until: float,
) -> tuple[int, int]:
    """Record an accepted step.

    Parameters
    ----------
    start, end : record
        ``motion.MOTION``.
    constants : Constants
    contacts : ndarray, shape (5,)
        Changed in place.
    events : ndarray, shape (n,)
        With room for a row of each contact from ``event_count`` on.
    event_count : int
    kept : Kept
    next_sample : int
        Number of the first sample that is not yet taken.
    sample_interval : float
        s.
    known_until : float
        Time up to which samples are taken, s: the step's end; at the end of the run, infinity.

    Returns
    -------
    event_count, next_sample : int
    """
    step = end.time - start.time
    linkage, law, pin_law = constants.linkage[0], constants.law[0], constants.pin_law[0]
    extrema, samples = kept.extrema, kept.samples
    shared = law.kind == FOUNDATION
    while next_sample < len(samples) and next_sample * sample_interval <= known_until:
        fraction = (next_sample * sample_interval - start.time) / step
        state = interpolate(start, end, fraction, linkage)
        observe(state, linkage, law, pin_law, contacts, samples[next_sample])
        next_sample += 1
    for number in range(_COUNT):
        contact = contacts[number]
        contact.impulse += step / (3 * POINTS) * contact.normal
        if number != PIN and contact.impact_speed > 0.0 and contact.start == start.time:
            note(start.time, contact.normal, contact, kept.pulses[number])
    kept.values[0] = kept.values[POINTS]
    for point in range(1, POINTS + 1):
        state, values = interpolate(start, end, point / POINTS, linkage), kept.values[point]
        observe(state, linkage, law, pin_law, contacts, values)
        update_extrema(extrema, values, state.time)
        weight = step / (3 * POINTS) * (1 if point == POINTS else 4 if point % 2 == 1 else 2)
        for number in range(_COUNT):
            contact = contacts[number]
            normal, gap = values[NORMAL + PER_CONTACT * number], values[GAP + PER_CONTACT * number]
            if shared and number != PIN:
                other = PER_CONTACT * other_end(number)
                normal, gap = normal + values[NORMAL + other], min(gap, values[GAP + other])
            contact.normal = normal
            contact.impulse += weight * normal
            contact.peak = max(contact.peak, normal)
            contact.depth = max(contact.depth, -gap)
            is_noted = point == POINTS or start.time - contact.start < _FEW * step
            if is_noted and number != PIN and contact.impact_speed > 0.0:
                note(state.time, normal, contact, kept.pulses[number])
        watch(state, values, linkage, law, pin_law, contacts)
        if point % 2 == 0:
            interval = step / POINTS
            update_vertices(extrema, kept.values[point - 2 : point + 1], interval, state.time - interval)
    event_count = update_contacts(start, end, linkage, law, pin_law, contacts, events, event_count)
    return event_count, next_sample


@kernel
def fill(motion: Any, time: float, q: NDArray[np.float64], v: NDArray[np.float64], linkage: Any) -> None:
    """Fill in the angles and angular velocities of ``motion`` from the tree's coordinates and their rates."""
    motion.time = time
    rod4 = 0
    carried, carried_w = 0.0, 0.0
    if not linkage.ideal_pin:
        rocker, rod2, rod4 = 0, 1, 2
        motion.theta3, motion.w3 = carried, carried_w = q[rocker], v[rocker]
        motion.theta2, motion.w2 = q[rocker] + q[rod2], v[rocker] + v[rod2]
    motion.theta4, motion.w4 = carried + q[rod4], carried_w + v[rod4]
    if not linkage.ideal_slider:
        slider = rod4 + 1
        motion.theta5, motion.w5 = motion.theta4 + q[slider], motion.w4 + v[slider]


@kernel
def take_step(
    constants: Constants,
    contacts: NDArray[np.void],
    kept: Kept,
    sample_interval: float,
    least: float,
    start_of_step: NDArray[np.void],
    end_of_step: NDArray[np.void],
    time: float,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    events: NDArray[np.void],
    event_count: int,
    next_sample: int,
    last: bool,
) -> tuple[float, int, int]:
    """Fill in the step's end from the tree's coordinates; judge the step, and record it if it is accepted.

    One call from Python a step: each takes as long to read its arguments as a state takes to observe.

    Parameters
    ----------
    constants : Constants
    contacts : ndarray, shape (5,)
        Changed in place.
    kept : Kept
    sample_interval : float
        s.
    least : float
        Shortest step that ends at a touch, s.
    start_of_step, end_of_step : ndarray, shape (1,)
        ``motion.MOTION``.
    time : float
        Of the end, s.
    q, v : ndarray, shape (n,)
        Coordinates of the tree at the end, and their rates.
    events : ndarray, shape (n,)
        With room for a row of each contact from ``event_count`` on.
    event_count : int
    next_sample : int
        Number of the first sample that is not yet taken.
    last : bool
        Whether the run ends here: the samples that are left are extrapolated.

    Returns
    -------
    fraction : float
        What :func:`locate` says, 1 for a step that is accepted; nan where the coordinates are not finite.
    event_count, next_sample : int
    """
    if not np.isfinite(np.sum(q) + np.sum(v)):
        return np.nan, event_count, next_sample
    start, end = start_of_step[0], end_of_step[0]
    linkage, law, pin_law = constants.linkage, constants.law, constants.pin_law
    fill(end, time, q, v, linkage[0])
    complete(end, linkage, law, pin_law, contacts)
    fraction = locate(start, end, linkage, law, pin_law, contacts, least)
    if fraction >= 1.0:
        known_until = np.inf if last else time
        event_count, next_sample = accept_step(
            start,
            end,
            constants,
            contacts,
            events,
            event_count,
            kept,
            next_sample,
            sample_interval,
            known_until,
        )
    return fraction, event_count, next_sample
