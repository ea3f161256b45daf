"""A state of a tree: contact forces in it, accelerations by balance of forces, and all channels.

What drives a tree is a function of time: joint C where the crank pin is ideal, else the journal. Rod 2 and
rocker are not free where the crank pin is ideal, nor is the slider's angle where the slider is.

Arguments of the kernels have the same names throughout, times and steps are in s:

- ``linkage``, ``guide``, ``journal``: constants of linkage and contacts. A joint that is ideal has ``None``
  for its law: numba compiles what is needed for the other one alone.
- ``workpiece``: that of a load (``workpiece.workpiece_array``), or ``None``.
- ``contacts``, shape (5, columns): memory of the corners, then of the journal, whether there or not.
- ``values``, shape (``WIDTH``,): of a state, filled; see below.
- ``distances``, shape (6, 3): from touching, filled. Of each corner its gap (m), of the journal
  (c^2 - e^2) / (2 c), equal to its gap near 0 and smooth at e = 0; last the slider's y (m); with first and
  second derivative.

Steps end where a contact begins or ends: inside of one, what is in contact keeps its frozen impact speed, and
what was open stays without force, even where a trial state lies behind the wall. The motion of a trial step
is smooth up to the touch that it is to locate.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import CLEARANCE, IMPACT_SPEED
from exudyn_model.corners import ACROSS, CORNER_COUNT, UPPER, corner_motion, side_load
from exudyn_model.journal import bearing_load, journal_forces, journal_motion
from exudyn_model.kernels import kernel
from exudyn_model.laws import side_forces
from exudyn_model.linkage import (
    CARRIED_INERTIA,
    CARRIED_MOMENT,
    CRANK_ANGLE,
    CRANK_LENGTH,
    CRANK_SPEED,
    GRAVITY,
    GUIDE_X,
    PIVOT_X,
    PIVOT_Y,
    ROCKER_INERTIA,
    ROCKER_LENGTH,
    ROCKER_MASS,
    ROCKER_TO_B,
    ROD2_CENTROID,
    ROD2_INERTIA,
    ROD2_LENGTH,
    ROD2_MASS,
    ROD4_LENGTH,
    ROD4_MASS,
    SLIDER_INERTIA,
    SLIDER_MASS,
    TipMotion,
    carried_tip,
    driven_tip,
)
from exudyn_model.tables import CONTACT, PER_CONTACT
from exudyn_model.workpiece import workpiece_force

Array = NDArray[np.float64]

# An end of a step: its time; from these columns on the four angles, their rates and second derivatives
TIME, THETA, RATE, SECOND = 0, 1, 5, 9
END_COLUMNS = 13
ROD2, ROCKER, ROD4, SLIDER = range(4)
# Rows of the contacts' memory, whether there or not
PIN_ROW = CORNER_COUNT
ROWS = CORNER_COUNT + 1
# After the contacts' distances the slider's height, by which a workpiece pushes
HEIGHT_ROW = ROWS
# Values of a state: those of `tables`, then angles and rates of rod 2 and rocker
JOURNAL_E = CONTACT + PER_CONTACT * ROWS
ANGLES = JOURNAL_E + 2
WIDTH = ANGLES + 4
# Of each contact
DISTANCE, SPEED, ACCELERATION = range(3)


class State(NamedTuple):
    """Angles (rad) of rod 2, rocker, rod 4 and slider, and their rates (rad/s); what is not free keeps 0."""

    theta2: float
    theta3: float
    theta4: float
    theta5: float
    w2: float
    w3: float
    w4: float
    w5: float


class Loads(NamedTuple):
    """Forces (N) and moments about the centres (N m) of contacts and load on the slider and on rod 2.

    ``along_x``, ``along_y`` (m): from joint C to the slider.
    """

    along_x: float
    along_y: float
    fx: float
    fy: float
    moment: float
    pin_x: float
    pin_y: float
    pin_moment: float


@kernel
def note_contact(row: int, gap: float, normal: float, friction: float, values: Array) -> None:
    """Fill in gap (m), normal force and friction (N) of a contact."""
    column = CONTACT + PER_CONTACT * row
    values[column], values[column + 1], values[column + 2] = gap, normal, friction


@kernel
def journal_arms(
    time: float, state: State, linkage: Array
) -> tuple[float, float, float, float, float, float]:
    """Return the arms (m) from O to A, from H to B and from A' to B."""
    angle1, to_b, length2 = (
        linkage[CRANK_ANGLE] + linkage[CRANK_SPEED] * time,
        linkage[ROCKER_TO_B],
        linkage[ROD2_LENGTH],
    )
    return (
        linkage[CRANK_LENGTH] * np.cos(angle1),
        linkage[CRANK_LENGTH] * np.sin(angle1),
        to_b * np.cos(state.theta3),
        to_b * np.sin(state.theta3),
        length2 * np.cos(state.theta2),
        length2 * np.sin(state.theta2),
    )


@kernel
def contact_loads(
    time: float,
    state: State,
    tip: TipMotion,
    linkage: Array,
    guide: Array | None,
    journal: Array | None,
    workpiece: Array | None,
    contacts: Array,
    values: Array | None,
) -> Loads:
    """Return the loads of a workpiece and of the contacts in progress: those with a frozen impact speed.

    Of joint C, ``tip``, the acceleration is not read. If there are ``values``, the slider's motion, the
    contacts and e are filled in.
    """
    fx, fy, moment, pin_x, pin_y, pin_moment = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    angle, omega = state.theta5, state.w5
    along_x, along_y = (
        linkage[ROD4_LENGTH] * np.cos(state.theta4),
        linkage[ROD4_LENGTH] * np.sin(state.theta4),
    )
    vx, vy = tip.vx - state.w4 * along_y, tip.vy + state.w4 * along_x
    if values is not None:
        values[0], values[1], values[2] = tip.x + along_x, tip.y + along_y, angle
        values[3], values[4], values[5] = vx, vy, omega
    if guide is not None:
        x = tip.x + along_x - linkage[GUIDE_X]
        for side in range(2):
            lower_speed, upper_speed = contacts[side, IMPACT_SPEED], contacts[side + UPPER, IMPACT_SPEED]
            if values is None and lower_speed == 0.0 and upper_speed == 0.0:
                continue
            lower = corner_motion(side, x, angle, vx, vy, omega, guide)
            upper = corner_motion(side + UPPER, x, angle, vx, vy, omega, guide)
            forces = side_forces(lower, upper, lower_speed, upper_speed, guide)
            load = side_load(side, forces, lower, upper)
            fx, fy, moment = fx + load[0], fy + load[1], moment + load[2]
            if values is not None:
                note_contact(side, lower.gap, forces.lower, forces.lower_friction, values)
                note_contact(side + UPPER, upper.gap, forces.upper, forces.upper_friction, values)
    if workpiece is not None:
        fy += workpiece_force(tip.y + along_y, workpiece)[0]
    if journal is not None:
        w1, w2, w3 = linkage[CRANK_SPEED], state.w2, state.w3
        ax, ay, bx, by, rod_x, rod_y = journal_arms(time, state, linkage)
        # The bearing is connected to H by rod 2 and rocker
        ex, ey = ax - (linkage[PIVOT_X] + bx - rod_x), ay - (linkage[PIVOT_Y] + by - rod_y)
        pin = journal_motion(
            ex, ey, -w1 * ay + w3 * by - w2 * rod_y, w1 * ax - w3 * bx + w2 * rod_x, w1, w2, journal
        )
        normal, _, friction = journal_forces(pin, contacts[PIN_ROW, IMPACT_SPEED], journal)
        share = linkage[ROD2_CENTROID] / linkage[ROD2_LENGTH]
        pin_x, pin_y, pin_moment = bearing_load(
            normal, friction, pin, -share * rod_x, -share * rod_y, journal
        )
        if values is not None:
            note_contact(PIN_ROW, pin.gap, normal, friction, values)
            values[JOURNAL_E], values[JOURNAL_E + 1] = ex, ey
    return Loads(along_x, along_y, fx, fy, moment, pin_x, pin_y, pin_moment)


@kernel
def rod4_moment(angle: float, tip: TipMotion, loads: Loads, linkage: Array) -> float:
    """Return the moment (N m) about C of contacts, weights and inertial forces on rod 4 with the slider.

    Behind an ideal crank pin C moves as the drive makes it. ``angle`` is rod 4's, rad.
    """
    # Across rod 4: the centripetal parts point along it and have no moment about C
    across = -np.sin(angle) * tip.ax + np.cos(angle) * (tip.ay + linkage[GRAVITY])
    moment: float = loads.along_x * loads.fy - loads.along_y * loads.fx - linkage[CARRIED_MOMENT] * across
    return moment


@kernel
def chain_accelerations(
    state: State, loads: Loads, linkage: Array, guide: Array | None
) -> tuple[float, float, float, float]:
    """Return the angular accelerations of rod 2, rocker and rod 4 behind a crank pin with clearance.

    The crank rotates as it is driven; rod 2, carried by the rocker's centroid B, is affected by it only
    through the contact force at the pin. With the unit vector u of an angle and its derivative n: B = H + b
    u3, rod 2's centre B - r u2, C = H + L3 u3, rod 4's centre C + s u4, the slider C + L4 u4. D'Alembert's
    principle for each angle gives a linear system for their second derivatives.

    Returns
    -------
    alpha2, alpha3, alpha4 : float
        rad/s^2.
    guide : float
        Force of the guide on an ideal slider along x, N; 0 on one with clearance.
    """
    to_b, length3, length4 = linkage[ROCKER_TO_B], linkage[ROCKER_LENGTH], linkage[ROD4_LENGTH]
    centre2 = linkage[ROD2_LENGTH] - linkage[ROD2_CENTROID]
    m2, m3, m4, m5 = linkage[ROD2_MASS], linkage[ROCKER_MASS], linkage[ROD4_MASS], linkage[SLIDER_MASS]
    c2, s2 = np.cos(state.theta2), np.sin(state.theta2)
    c3, s3 = np.cos(state.theta3), np.sin(state.theta3)
    c4, s4 = np.cos(state.theta4), np.sin(state.theta4)
    square2, square3, square4 = state.w2**2, state.w3**2, state.w4**2
    cos23, sin23 = c2 * c3 + s2 * s3, s3 * c2 - c3 * s2
    cos34, sin34 = c3 * c4 + s3 * s4, s4 * c3 - c4 * s3
    first4, g = linkage[CARRIED_MOMENT], linkage[GRAVITY]

    # Equations of rocker, rod 2 and rod 4: inertias of each and between them
    inertia3 = linkage[ROCKER_INERTIA] + (m3 + m2) * to_b**2 + (m4 + m5) * length3 * length3
    inertia2 = linkage[ROD2_INERTIA] + m2 * centre2**2
    inertia4 = linkage[CARRIED_INERTIA]
    between23, between34 = -m2 * to_b * centre2 * cos23, length3 * first4 * cos34
    # What is accelerated towards the centres of rotation, by n . u of the other angle; weights; forces
    moment3 = (
        m2 * to_b * centre2 * sin23 * square2
        + length3 * first4 * sin34 * square4
        - g * c3 * ((m3 + m2) * to_b + (m4 + m5) * length3)
        + to_b * (c3 * loads.pin_y - s3 * loads.pin_x)
        + length3 * (c3 * loads.fy - s3 * loads.fx)
    )
    moment2 = (
        -m2 * to_b * centre2 * sin23 * square3
        + g * c2 * m2 * centre2
        + loads.pin_moment
        - centre2 * (c2 * loads.pin_y - s2 * loads.pin_x)
    )
    moment4 = (
        -length3 * first4 * sin34 * square3 - g * c4 * first4 + length4 * (c4 * loads.fy - s4 * loads.fx)
    )
    # Rod 2 eliminated, then rod 4: alpha4 = offset + slope alpha3
    inertia = inertia3 - between23**2 / inertia2
    moment = moment3 - between23 * moment2 / inertia2
    if guide is None:
        # The slider's x is not accelerated; the guide's force has the arms d x / d theta
        arm3, arm4 = -length3 * s3, -length4 * s4
        offset = (length3 * c3 * square3 + length4 * c4 * square4) / arm4
        slope = -arm3 / arm4
        # The principle for a rotation of the rocker that takes rod 4 along
        alpha3 = (moment + slope * moment4 - (between34 + slope * inertia4) * offset) / (
            inertia + slope * (2.0 * between34 + slope * inertia4)
        )
        alpha4 = offset + slope * alpha3
        force = (between34 * alpha3 + inertia4 * alpha4 - moment4) / arm4
    else:
        offset, slope, force = moment4 / inertia4, -between34 / inertia4, 0.0
        alpha3 = (moment - between34 * offset) / (inertia + between34 * slope)
        alpha4 = offset + slope * alpha3
    return (moment2 - between23 * alpha3) / inertia2, alpha3, alpha4, force


@kernel
def complete(
    end: Array,
    linkage: Array,
    guide: Array | None,
    journal: Array | None,
    workpiece: Array | None,
    contacts: Array,
    values: Array,
    distances: Array,
) -> None:
    """Fill in the angular accelerations of an end of a step by balance of forces, values and distances."""
    time = end[TIME]
    state = State(end[1], end[2], end[3], end[4], end[5], end[6], end[7], end[8])
    alpha2, alpha3, alpha4, alpha5 = 0.0, 0.0, 0.0, 0.0
    if journal is None:
        tip = driven_tip(time, linkage)
        loads = contact_loads(time, state, tip, linkage, guide, journal, workpiece, contacts, values)
        alpha4 = rod4_moment(state.theta4, tip, loads, linkage) / linkage[CARRIED_INERTIA]
    else:
        tip = carried_tip(state.theta3, state.w3, 0.0, linkage)
        loads = contact_loads(time, state, tip, linkage, guide, journal, workpiece, contacts, values)
        alpha2, alpha3, alpha4, _ = chain_accelerations(state, loads, linkage, guide)
    # Of C, what its rocker's angular acceleration adds; 0 behind an ideal pin
    arm_x, arm_y = tip.x - linkage[PIVOT_X], tip.y - linkage[PIVOT_Y]
    along_x, along_y, w4 = loads.along_x, loads.along_y, state.w4
    ax = tip.ax - alpha3 * arm_y - alpha4 * along_y - w4 * w4 * along_x
    ay = tip.ay + alpha3 * arm_x + alpha4 * along_x - w4 * w4 * along_y
    if guide is not None:
        alpha5, angle, omega = loads.moment / linkage[SLIDER_INERTIA], state.theta5, state.w5
        x = values[0] - linkage[GUIDE_X]
        for number in range(CORNER_COUNT):
            motion, out = corner_motion(number, x, angle, values[3], values[4], omega, guide), ACROSS[number]
            distances[number, DISTANCE], distances[number, SPEED] = motion.gap, motion.rate
            distances[number, ACCELERATION] = -out * (
                ax - alpha5 * motion.arm_y - omega * omega * motion.arm_x
            )
    else:
        ax = 0.0
    if journal is not None:
        _journal_distance(time, state, alpha2, alpha3, linkage, journal, values, distances)
    values[6], values[7], values[8] = ax, ay, alpha5
    height = distances[HEIGHT_ROW]
    height[DISTANCE], height[SPEED], height[ACCELERATION] = values[1], values[4], ay
    # What the watch of a journal reads
    values[ANGLES], values[ANGLES + 1] = state.theta2, state.theta3
    values[ANGLES + 2], values[ANGLES + 3] = state.w2, state.w3
    end[SECOND], end[SECOND + 1], end[SECOND + 2], end[SECOND + 3] = alpha2, alpha3, alpha4, alpha5


@kernel
def _journal_distance(
    time: float,
    state: State,
    alpha2: float,
    alpha3: float,
    linkage: Array,
    journal: Array,
    values: Array,
    distances: Array,
) -> None:
    """Fill the distance of the journal: see :func:`complete`; ``values`` holds its gap and e."""
    ex, ey, clearance = values[JOURNAL_E], values[JOURNAL_E + 1], journal[CLEARANCE]
    w1, w2, w3 = linkage[CRANK_SPEED], state.w2, state.w3
    # Of A, of B about H and of A' about B: e = A - H - HB + A'B
    ax, ay, bx, by, cx, cy = journal_arms(time, state, linkage)
    vx, vy = -w1 * ay + w3 * by - w2 * cy, w1 * ax - w3 * bx + w2 * cx
    rate_x = -w1 * w1 * ax + alpha3 * by + w3 * w3 * bx - alpha2 * cy - w2 * w2 * cx
    rate_y = -w1 * w1 * ay - alpha3 * bx + w3 * w3 * by + alpha2 * cx - w2 * w2 * cy
    gap = values[CONTACT + PER_CONTACT * PIN_ROW]
    # The gap itself keeps its digits: c^2 - e^2 = gap (2 c - gap)
    distances[PIN_ROW, DISTANCE] = gap - 0.5 * gap * gap / clearance
    distances[PIN_ROW, SPEED] = -(ex * vx + ey * vy) / clearance
    distances[PIN_ROW, ACCELERATION] = -(vx * vx + vy * vy + ex * rate_x + ey * rate_y) / clearance


@kernel
def interpolate(start: Array, end: Array, fraction: float, here: Array) -> None:
    """Fill time, angles and rates at a fraction of the step between two ends, all of shape (13,).

    Each angle by its quintic Hermite polynomial.
    """
    step, square, rest = end[TIME] - start[TIME], fraction * fraction, 1.0 - fraction
    here[TIME] = start[TIME] + fraction * step
    blend = square * fraction * (10.0 + fraction * (6.0 * fraction - 15.0))
    for angle in range(THETA, RATE):
        rate, second = angle + RATE - THETA, angle + SECOND - THETA
        v0, v1 = start[rate], end[rate]
        # Cubic polynomial of the rate, by rates and second derivatives; what its integral leaves of the rise
        slope0, slope1 = step * start[second], step * end[second]
        c2, c3 = 3.0 * (v1 - v0) - 2.0 * slope0 - slope1, 2.0 * (v0 - v1) + slope0 + slope1
        missing = end[angle] - start[angle] - step * (0.5 * (v0 + v1) + (slope0 - slope1) / 12.0)
        integral = fraction * (v0 + fraction * (0.5 * slope0 + fraction * (c2 / 3.0 + 0.25 * fraction * c3)))
        here[angle] = start[angle] + step * integral + missing * blend
        here[rate] = v0 + fraction * (slope0 + fraction * (c2 + fraction * c3))
        # Round-off of the angles is no rate: in a step of 1e-7 s it would be one of 1e-8 rad/s
        if abs(missing) > 4e-15:
            here[rate] += 30.0 * square * rest * rest * missing / step
