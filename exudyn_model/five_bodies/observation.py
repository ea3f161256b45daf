"""All of an accepted state of five bodies: memory of the contacts, channels, extrema, energies, watch."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import (
    ACROSS_X,
    ACROSS_Y,
    CLOSED,
    DEPTH,
    DIRECTION,
    EXPONENT,
    FRICTION,
    GAP,
    IMPACT_SPEED,
    IMPULSE,
    NAME,
    NORMAL,
    PEAK,
    RATE,
    REGIME,
    SLIP,
    SPEED_FLOOR,
)
from exudyn_model.corners import CORNER_COUNT, UPPER, corner_load, corner_motion
from exudyn_model.five_bodies.balance import accelerations, constraints
from exudyn_model.five_bodies.contact_forces import (
    LENGTH,
    STAYS_OPEN,
    crossing,
    first_touch,
    journal_in_bearing,
    journal_loads,
    touch,
    triple,
)
from exudyn_model.five_bodies.step_choice import foreseen_ticks
from exudyn_model.five_bodies.system import ANGLE, PER_BODY, Constants, X, Y
from exudyn_model.friction import slip_regime
from exudyn_model.journal import journal_forces
from exudyn_model.kernels import entry, kernel
from exudyn_model.laws import CornerMotion, SideForces, side_forces
from exudyn_model.memory import begin_contact, end_contact, is_shared, start_side
from exudyn_model.tables import CONTACT, PER_CONTACT, note_force, update_extrema, update_turning_points
from exudyn_model.watch import watch_corners, watch_journal

Array = NDArray[np.float64]

# Sums of the audit: powers (W) in the last state and their integrals (J); energies of the initial state (J)
(_DRIVE_POWER, _DAMPING_POWER, _FRICTION_POWER, _DRIVE, _DAMPING, _FRICTION, _HEIGHT0, _STORED0) = range(8)
AUDIT_COLUMNS = 8


class Kept(NamedTuple):
    """Arrays that an observation fills.

    Attributes
    ----------
    values : ndarray, shape (channels,)
        ``tables``; the multipliers; G of each journal (N), and where they are asked for, the energies (J).
    extrema : ndarray, shape (cycles, channels, 4)
    notes : ndarray, shape (contacts, n, 2)
    watch : ndarray, shape (contacts, columns)
    drift : ndarray, shape (2, 2)
        Largest violation of the constraints and of their rates, and when (s).
    audit : ndarray, shape (8,)
    force, found : ndarray, shape (3 n,)
    jacobian : ndarray, shape (rows, 3 n)
    wanted : ndarray, shape (rows,)
    matrix : ndarray, shape (rows, rows)
        Of ``balance.accelerations``.
    """

    values: Array
    extrema: Array
    notes: Array
    watch: Array
    drift: Array
    audit: Array
    force: Array
    found: Array
    jacobian: Array
    wanted: Array
    matrix: Array


@kernel
def accumulate(
    time: float,
    step: float,
    contact: Array,
    before: float,
    normal: float,
    depth: float,
    touched_at: float,
    left_at: float,
    events: Array,
    count: int,
) -> int:
    """Accumulate a contact in progress up to the accepted state at ``time``; if it has ended, write it down.

    Parameters
    ----------
    time, step : float
        s.
    contact : ndarray
        Its memory, changed in place.
    before, normal : float
        Its normal force in the last state and in this one, N.
    depth : float
        In this state, m.
    touched_at, left_at : float
        Fractions of the step from which and up to which the force acts; more than 1: the contact lasts.
    events : ndarray
    count : int

    Returns
    -------
    count : int
    """
    if contact[IMPACT_SPEED] == 0.0:
        return count
    if time > 0.0:
        contact[IMPULSE] += 0.5 * (before + normal) * (min(left_at, 1.0) - touched_at) * step
    contact[PEAK], contact[DEPTH] = max(contact[PEAK], normal), max(contact[DEPTH], depth)
    if left_at <= 1.0:
        return end_contact(contact, time - (1.0 - left_at) * step, events, count)
    return count


@kernel
def left_within(contact: Array, gap: float, rate: float, step: float) -> float:
    """Return the fraction of a step at which a closed contact opens; 2 if it does not, 0 of one that was open."""
    if gap < 0.0:
        return 2.0
    return crossing(contact[GAP], contact[RATE], gap, rate, step) if contact[CLOSED] > 0.0 else 0.0


@kernel
def begin_alone(
    time: float, step: float, row: int, gap: float, rate: float, contact: Array, law: Array
) -> float:
    """Begin a contact that was open in the last accepted state and is closed in that at ``time`` > 0.

    Returns the fraction of the step from which its force acts.
    """
    if contact[IMPACT_SPEED] > 0.0 or gap >= 0.0:
        return 0.0
    touched_at, speed = touch(contact, gap, rate, step, law)
    begin_contact(contact, row, time - (1.0 - touched_at) * step, speed)
    return touched_at


@kernel
def remember(contact: Array, gap: float, rate: float, slip: float, normal: float, friction: float) -> None:
    """Keep the state of a contact for the next step."""
    contact[GAP], contact[RATE], contact[SLIP] = gap, rate, slip
    contact[NORMAL], contact[FRICTION] = normal, friction
    contact[CLOSED] = 1.0 if gap < 0.0 else 0.0


@kernel
def update_side(
    time: float,
    step: float,
    first: int,
    side: int,
    lower: CornerMotion,
    upper: CornerMotion,
    law: Array,
    contacts: Array,
    events: Array,
    count: int,
) -> tuple[SideForces, int]:
    """Update the memory of a side with the accepted state at ``time``; return its forces and count of events.

    ``first`` is the row of the slider's first corner, ``side`` that of the lower corner among its four.
    """
    own = contacts[first : first + CORNER_COUNT]
    low, up = own[side], own[side + UPPER]
    shared, lower_from, upper_from = is_shared(law), 0.0, 0.0
    if time == 0.0:
        start_side(side, lower, upper, own, law)
        low[NAME], up[NAME] = low[NAME] + first, up[NAME] + first
    elif not shared:
        lower_from = begin_alone(time, step, first + side, lower.gap, lower.rate, low, law)
        upper_from = begin_alone(time, step, first + side + UPPER, upper.gap, upper.rate, up, law)
    elif low[IMPACT_SPEED] == 0.0 and (lower.gap < 0.0 or upper.gap < 0.0):
        end, lower_from, speed = first_touch(low, up, lower, upper, step, law)
        begin_contact(low, first + side + UPPER * end, time - (1.0 - lower_from) * step, speed)
    # A corner that has left has no force, though its speed is still kept for the table
    lower_speed = low[IMPACT_SPEED] if lower.gap < 0.0 or shared else 0.0
    upper_speed = up[IMPACT_SPEED] if upper.gap < 0.0 else 0.0
    forces = side_forces(lower, upper, lower_speed, upper_speed, law)
    lower_left, upper_left = left_within(low, lower.gap, lower.rate, step), left_within(
        up, upper.gap, upper.rate, step
    )
    if shared:
        normal, depth = forces.lower + forces.upper, -min(lower.gap, upper.gap)
        left = max(lower_left, upper_left)
        before = low[NORMAL] + up[NORMAL]
        count = accumulate(time, step, low, before, normal, depth, lower_from, left, events, count)
    else:
        count = accumulate(
            time, step, low, low[NORMAL], forces.lower, -lower.gap, lower_from, lower_left, events, count
        )
        count = accumulate(
            time, step, up, up[NORMAL], forces.upper, -upper.gap, upper_from, upper_left, events, count
        )
    # The slip where friction acts
    whole = not np.isnan(forces.slip)
    lower_slip, upper_slip = (forces.slip, forces.slip) if whole else (lower.slip, upper.slip)
    remember(low, lower.gap, lower.rate, lower_slip, forces.lower, forces.lower_friction)
    remember(up, upper.gap, upper.rate, upper_slip, forces.upper, forces.upper_friction)
    return forces, count


@entry
def observe(
    time: float,
    q: Array,
    v: Array,
    multipliers: Array,
    system: Constants,
    observed: int,
    step: Array,
    contacts: Array,
    kept: Kept,
    period: float,
    tick: float,
    longest: float,
    before: Array,
    events: Array,
    count: int,
) -> tuple[int, int]:
    """Take an accepted state: update the contacts' memory, fill all values, update what follows from them.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray, shape (3 n,)
        Coordinates and their rates.
    multipliers : ndarray, shape (rows,)
    system : Constants
    observed : int
        Body whose motion is recorded.
    step : ndarray, shape (2,)
        The one that has ended.
    contacts : ndarray, shape (contacts, columns)
        Changed in place.
    kept : Kept
    period : float
        Of the crank, s.
    tick, longest : float
        Shortest step (s), and how many of them the next one may be at most.
    before : ndarray, shape (contacts, 7)
        See ``step_choice``; changed in place.
    events : ndarray, shape (n, 7)
        With room for a row of each contact from ``count`` on.
    count : int

    Returns
    -------
    count : int
    ticks : int
        That the next step may take: see ``step_choice.foreseen_ticks``.
    """
    values, length, corners = kept.values, step[LENGTH], CORNER_COUNT * len(system.sliders)
    last = values[: CONTACT].copy()
    stored, damping, friction = 0.0, 0.0, 0.0
    force = kept.force
    force[:] = system.weights
    for number in range(len(system.sliders)):
        law, first, body = system.sliders[number], CORNER_COUNT * number, PER_BODY * int(system.slider_bodies[number])
        cx, cy = law[ACROSS_X], law[ACROSS_Y]
        x, y, vx, vy = q[body + X], q[body + Y], v[body + X], v[body + Y]
        turned, omega = q[body + ANGLE] - law[DIRECTION], v[body + ANGLE]
        across, v_across, v_along = cx * x + cy * y, cx * vx + cy * vy, cx * vy - cy * vx
        for side in range(2):
            lower = corner_motion(side, across, turned, v_across, v_along, omega, law)
            upper = corner_motion(side + UPPER, across, turned, v_across, v_along, omega, law)
            forces, count = update_side(
                time, length, first, side, lower, upper, law, contacts, events, count
            )
            low = corner_load(side, forces.lower, forces.lower_friction, lower)
            up = corner_load(side + UPPER, forces.upper, forces.upper_friction, upper)
            fx, fy = low[0] + up[0], low[1] + up[1]
            force[body + X] += cx * fx - cy * fy
            force[body + Y] += cy * fx + cx * fy
            force[body + ANGLE] += low[2] + up[2]
            stored, damping = stored + forces.stored, damping + forces.damping
            friction += forces.friction
            _fill_contact(values, first + side, lower.gap, forces.lower, forces.lower_friction)
            _fill_contact(values, first + side + UPPER, upper.gap, forces.upper, forces.upper_friction)
            # A contact of its own, or that of the side, which its lower corner remembers
            shared = is_shared(law)
            if contacts[first + side, IMPACT_SPEED] > 0.0:
                whole = forces.lower + (forces.upper if shared else 0.0)
                note_force(kept.notes[first + side], contacts[first + side], time, whole)
            if contacts[first + side + UPPER, IMPACT_SPEED] > 0.0:
                note_force(kept.notes[first + side + UPPER], contacts[first + side + UPPER], time, forces.upper)
        watch_corners(
            time, across, turned, v_across, v_along, omega, first, values, law, contacts, kept.watch
        )
    added = CONTACT + PER_CONTACT * len(contacts)
    for number in range(len(system.journals)):
        law, ends, row = system.journals[number], system.journal_ends[number], corners + number
        contact = contacts[row]
        q1, v1, q2, v2 = triple(q, ends[0]), triple(v, ends[0]), triple(q, ends[3]), triple(v, ends[3])
        motion = journal_in_bearing(q1, v1, q2, v2, ends, law)
        touched_at = 0.0
        if time > 0.0:
            touched_at = begin_alone(time, length, row, motion.gap, motion.rate, contact, law)
        elif motion.gap < 0.0:
            begin_contact(contact, row, 0.0, max(-motion.rate, law[SPEED_FLOOR]))
        if time == 0.0:
            contact[REGIME] = slip_regime(motion.slip, law)
        normal, elastic, drag = journal_forces(motion, contact[IMPACT_SPEED], law)
        left = left_within(contact, motion.gap, motion.rate, length)
        count = accumulate(
            time, length, contact, contact[NORMAL], normal, -motion.gap, touched_at, left, events, count
        )
        remember(contact, motion.gap, motion.rate, motion.slip, normal, drag)
        gx, gy, moment1, moment2 = journal_loads(normal, drag, motion, q1, q2, ends, law)
        body1, body2 = PER_BODY * int(ends[0]), PER_BODY * int(ends[3])
        force[body1 + X] -= gx
        force[body1 + Y] -= gy
        force[body1 + ANGLE] += moment1
        force[body2 + X] += gx
        force[body2 + Y] += gy
        force[body2 + ANGLE] += moment2
        stored += elastic * max(-motion.gap, 0.0) / (law[EXPONENT] + 1.0)
        damping, friction = damping - (normal - elastic) * motion.rate, friction - drag * motion.slip
        _fill_contact(values, row, motion.gap, normal, drag)
        ex, ey = motion.distance * motion.nx, motion.distance * motion.ny
        values[added + 2 * number], values[added + 2 * number + 1] = ex, ey
        own = added + 2 * len(system.journals) + len(multipliers) + 2 * number
        values[own], values[own + 1] = gx, gy
        _watch_journal(time, q1, v1, q2, v2, ends, row, values, law, contacts, kept.watch)
    for rank, amount in enumerate(constraints(time, q, v, system, kept.jacobian, kept.wanted)):
        if amount > kept.drift[rank, 0]:
            kept.drift[rank, 0], kept.drift[rank, 1] = amount, time
    accelerations(force, system, kept.jacobian, kept.wanted, kept.matrix, kept.found)
    first = PER_BODY * observed
    for axis in range(PER_BODY):
        values[axis] = q[first + axis] + system.reference[first + axis]
        values[PER_BODY + axis], values[2 * PER_BODY + axis] = v[first + axis], kept.found[first + axis]
    added += 2 * len(system.journals)
    for row in range(len(multipliers)):
        values[added + row] = -multipliers[row]
    if len(kept.audit) > 0:
        drive = 2 * len(system.pins)
        power = -multipliers[drive] * v[int(system.fixed[0, 0])]
        energies = values[added + len(multipliers) + 2 * len(system.journals) :]
        audit_energy(time, length, q, v, power, stored, damping, friction, system, kept.audit, energies)
    update_extrema(kept.extrema, period, values, time)
    if step[STAYS_OPEN] > 0.0:  # longer than a tick
        update_turning_points(kept.extrema, period, last, values, length, time)
    if longest <= 1.0:
        return count, 1
    return count, foreseen_ticks(time, length, tick, longest, system, contacts, before)


@kernel
def _fill_contact(values: Array, row: int, gap: float, normal: float, friction: float) -> None:
    column = CONTACT + PER_CONTACT * row
    values[column], values[column + 1], values[column + 2] = gap, normal, friction


@kernel
def audit_energy(
    time: float,
    step: float,
    q: Array,
    v: Array,
    drive_power: float,
    stored: float,
    damping_power: float,
    friction_power: float,
    system: Constants,
    audit: Array,
    energies: Array,
) -> None:
    """Fill ``energies`` (J, in the order of ``tables.ENERGIES``) for the accepted state at ``time``.

    Drive, gravity, damping and friction count from t = 0, kinetic and contact energy are those stored now.
    The residual is work of motor and gravity less the increase of what is stored, less what is dissipated.
    Works are summed up by the trapezoidal rule, of the same order as the integration.

    Parameters
    ----------
    time, step : float
        s.
    q, v : ndarray, shape (3 n,)
    drive_power, damping_power, friction_power : float
        Of the motor, and dissipated, W.
    stored : float
        In contacts, J.
    system : Constants
    audit : ndarray, shape (8,)
        Changed in place.
    energies : ndarray, shape (7,)
    """
    kinetic, height = 0.0, 0.0
    for k in range(len(q)):
        kinetic += 0.5 * system.masses[k] * v[k] * v[k]
        height -= system.weights[k] * (q[k] + system.reference[k])
    if time == 0.0:
        audit[_HEIGHT0], audit[_STORED0] = height, kinetic + stored
    else:
        audit[_DRIVE] += 0.5 * step * (audit[_DRIVE_POWER] + drive_power)
        audit[_DAMPING] += 0.5 * step * (audit[_DAMPING_POWER] + damping_power)
        audit[_FRICTION] += 0.5 * step * (audit[_FRICTION_POWER] + friction_power)
    audit[_DRIVE_POWER], audit[_DAMPING_POWER], audit[_FRICTION_POWER] = drive_power, damping_power, friction_power
    gravity = audit[_HEIGHT0] - height
    energies[0], energies[1], energies[2], energies[3] = audit[_DRIVE], gravity, kinetic, stored
    energies[4], energies[5] = audit[_DAMPING], audit[_FRICTION]
    energies[6] = (
        audit[_DRIVE] + gravity - (kinetic + stored - audit[_STORED0]) - audit[_DAMPING] - audit[_FRICTION]
    )


@kernel
def _watch_journal(
    time: float,
    q1: tuple[float, float, float],
    v1: tuple[float, float, float],
    q2: tuple[float, float, float],
    v2: tuple[float, float, float],
    ends: Array,
    row: int,
    values: Array,
    law: Array,
    contacts: Array,
    worst: Array,
) -> None:
    """Watch a journal, with its bodies' motion taken apart in another way than by ``contact_forces``."""
    # Both points as complex numbers
    arm1 = complex(ends[1], ends[2]) * np.exp(1j * q1[ANGLE])
    arm2 = complex(ends[4], ends[5]) * np.exp(1j * q2[ANGLE])
    apart = complex(q1[X] - q2[X] + ends[6], q1[Y] - q2[Y] + ends[7]) + arm1 - arm2
    rate = complex(v1[X] - v2[X], v1[Y] - v2[Y]) + 1j * (v1[ANGLE] * arm1 - v2[ANGLE] * arm2)
    w1, w2 = v1[ANGLE], v2[ANGLE]
    watch_journal(
        time, apart.real, apart.imag, rate.real, rate.imag, w1, w2, row, values, law, contacts, worst
    )
