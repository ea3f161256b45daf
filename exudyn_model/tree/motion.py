"""A state of a tree: contact forces in it, accelerations by balance of forces, and all channels.

A tree is driven by a function of time: joint C where the crank pin is ideal, else the journal. Rod 2 and
rocker are not free where the crank pin is ideal, nor is the slider's angle where the slider is.

Arguments of the kernels have the same names throughout, times and steps are in s:

- ``press``: a :class:`Press`.
- ``workpiece``: see ``workpiece.workpiece_array``.
- ``contacts``, shape (5,): memory of the corners, then of the journal, also where they have no clearance.
- ``values``, of ``VALUES``: the kernel fills them.
- ``distances``, shape (6,), of ``DISTANCE``: the kernel fills the gap of each corner (m), for the journal
  (c^2 - e^2) / (2 c), equal to its gap near 0 and smooth at e = 0, and last the slider's y (m).

Steps end where a contact begins or ends: inside of one, a contact in progress keeps its frozen impact speed,
and an open one stays without force, even where a trial state lies behind the wall. The motion of a trial step
is smooth up to the touch that it is to locate.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import (
    ACROSS,
    CORNER_COUNT,
    UPPER,
    bearing_load,
    corner_motion,
    journal_forces,
    journal_motion,
    side_load,
)
from exudyn_model.kernels import kernel
from exudyn_model.laws import Law, side_forces
from exudyn_model.linkage import TipMotion, carried_tip, driven_tip
from exudyn_model.parameters import Mechanism
from exudyn_model.workpiece import workpiece_force

Array = NDArray[np.float64]

# Rows of the contacts; the distances end with the slider's height, on which a workpiece's force depends
PIN_ROW = CORNER_COUNT
CONTACTS = CORNER_COUNT + 1
HEIGHT_ROW = CONTACTS
# Numbers of the angles
ROD2, ROCKER, ROD4, SLIDER = range(4)
END = np.dtype([("time", float), *((name, float, 4) for name in ("angle", "rate", "second"))])
"""An end of a step: its time (s), four angles (rad), their rates and second derivatives."""
DISTANCE = np.dtype([(name, float) for name in ("value", "rate", "second")])
"""A distance (m) with its first and second derivative."""
VALUES = np.dtype(
    [
        *((name, float) for name in ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")),
        ("contact", float, (CONTACTS, 3)),  # gap, normal force, friction
        *((name, float) for name in ("ex", "ey", "theta2", "theta3", "w2", "w3")),
    ]
)
"""Values of a state: the channels, and the motion of rod 2 and rocker, which `Watch.take_journal` needs."""
WIDTH = VALUES.itemsize // 8


class Press(NamedTuple):
    """Constants of a tree for its kernels; an ideal joint has a law of zeros."""

    mechanism: Mechanism
    # First and second moment of mass about C of rod 4 with the slider as a point, kg m and kg m^2
    carried_moment: float
    carried_inertia: float
    has_guide: bool
    has_journal: bool
    guide: Law
    journal: Law


class State(NamedTuple):
    """Angles (rad) of rod 2, rocker, rod 4 and slider, and their rates (rad/s); 0 where they are not free."""

    theta2: float
    theta3: float
    theta4: float
    theta5: float
    w2: float
    w3: float
    w4: float
    w5: float


class Loads(NamedTuple):
    """Forces (N) of contacts and load on slider and rod 2, and their moments about the centres (N m).

    ``along_x``, ``along_y`` (m) lead from joint C to the slider; ``pin_*`` act on rod 2.
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
def note_contact(row: int, gap: float, normal: float, friction: float, values: Any) -> None:
    """Fill in gap (m), normal force and friction (N) of a contact."""
    contact = values.contact[row]
    contact[0], contact[1], contact[2] = gap, normal, friction


@kernel
def journal_arms(
    time: float, state: State, mechanism: Mechanism
) -> tuple[float, float, float, float, float, float]:
    """Return the arms (m) from O to A, from H to B and from A' to B."""
    angle1 = mechanism.crank_angle + mechanism.omega * time
    to_b, length2 = mechanism.rocker.centroid, mechanism.rod2.length
    return (
        mechanism.crank.length * np.cos(angle1),
        mechanism.crank.length * np.sin(angle1),
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
    press: Press,
    workpiece: NDArray[Any],
    contacts: Any,
    values: Any,
) -> Loads:
    """Return the loads of a workpiece and of the contacts in progress: those with a frozen impact speed.

    The acceleration of ``tip``, joint C, is not read. ``values``, unless None, receive the slider's motion,
    the contacts and e.
    """
    mechanism, guide, journal = press.mechanism, press.guide, press.journal
    fx, fy, moment, pin_x, pin_y, pin_moment = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    angle, omega = state.theta5, state.w5
    length4 = mechanism.rod4.length
    along_x, along_y = length4 * np.cos(state.theta4), length4 * np.sin(state.theta4)
    vx, vy = tip.vx - state.w4 * along_y, tip.vy + state.w4 * along_x
    if values is not None:
        values.x, values.y, values.angle = tip.x + along_x, tip.y + along_y, angle
        values.vx, values.vy, values.omega = vx, vy, omega
    if press.has_guide:
        x = tip.x + along_x - mechanism.guide_x
        for side in range(2):
            lower_speed, upper_speed = contacts[side].impact_speed, contacts[side + UPPER].impact_speed
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
    fy += workpiece_force(tip.y + along_y, workpiece)[0]
    if press.has_journal:
        w1, w2, w3 = mechanism.omega, state.w2, state.w3
        ax, ay, bx, by, rod_x, rod_y = journal_arms(time, state, mechanism)
        # The bearing is connected to H by rod 2 and rocker
        ex, ey = ax - (mechanism.pivot_x + bx - rod_x), ay - (mechanism.pivot_y + by - rod_y)
        pin = journal_motion(
            ex, ey, -w1 * ay + w3 * by - w2 * rod_y, w1 * ax - w3 * bx + w2 * rod_x, w1, w2, journal
        )
        normal, _, friction = journal_forces(pin, contacts[PIN_ROW].impact_speed, journal)
        share = mechanism.rod2.centroid / mechanism.rod2.length
        pin_x, pin_y, pin_moment = bearing_load(
            normal, friction, pin, -share * rod_x, -share * rod_y, journal
        )
        if values is not None:
            note_contact(PIN_ROW, pin.gap, normal, friction, values)
            values.ex, values.ey = ex, ey
    return Loads(along_x, along_y, fx, fy, moment, pin_x, pin_y, pin_moment)


@kernel
def rod4_moment(angle: float, tip: TipMotion, loads: Loads, press: Press) -> float:
    """Return the moment (N m) about C of contacts, weights and inertial forces on rod 4 with the slider.

    The crank pin is ideal: the drive prescribes the motion of C. ``angle`` is rod 4's, rad.
    """
    # Across rod 4: the centripetal parts point along it and have no moment about C
    across = -np.sin(angle) * tip.ax + np.cos(angle) * (tip.ay + press.mechanism.gravity)
    moment: float = loads.along_x * loads.fy - loads.along_y * loads.fx - press.carried_moment * across
    return moment


@kernel
def chain_accelerations(state: State, loads: Loads, press: Press) -> tuple[float, float, float, float]:
    """Return the angular accelerations of rod 2, rocker and rod 4 behind a crank pin with clearance.

    The crank acts on rod 2, which the rocker's centroid B carries, through the contact force at the pin
    alone. With the unit vector u of an angle and its derivative n: B = H + b
    u3, rod 2's centre B - r u2, C = H + L3 u3, rod 4's centre C + s u4, the slider C + L4 u4. D'Alembert's
    principle for each angle gives a linear system for their second derivatives.

    Returns
    -------
    alpha2, alpha3, alpha4 : float
        rad/s^2.
    guide : float
        Force of the guide on an ideal slider along x, N; 0 on one with clearance.
    """
    rod2, rocker, rod4 = press.mechanism.rod2, press.mechanism.rocker, press.mechanism.rod4
    to_b, length3, length4 = rocker.centroid, rocker.length, rod4.length
    centre2 = rod2.length - rod2.centroid
    m2, m3, m4, m5 = rod2.mass, rocker.mass, rod4.mass, press.mechanism.slider.mass
    c2, s2 = np.cos(state.theta2), np.sin(state.theta2)
    c3, s3 = np.cos(state.theta3), np.sin(state.theta3)
    c4, s4 = np.cos(state.theta4), np.sin(state.theta4)
    square2, square3, square4 = state.w2**2, state.w3**2, state.w4**2
    cos23, sin23 = c2 * c3 + s2 * s3, s3 * c2 - c3 * s2
    cos34, sin34 = c3 * c4 + s3 * s4, s4 * c3 - c4 * s3
    first4, g = press.carried_moment, press.mechanism.gravity

    # Equations of rocker, rod 2 and rod 4: inertias of each and between them
    inertia3 = rocker.inertia + (m3 + m2) * to_b**2 + (m4 + m5) * length3 * length3
    inertia2 = rod2.inertia + m2 * centre2**2
    inertia4 = press.carried_inertia
    between23, between34 = -m2 * to_b * centre2 * cos23, length3 * first4 * cos34
    # Moments of centripetal accelerations (by n . u of the other angle), of weights and of forces
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
    if not press.has_guide:
        # The slider's x is not accelerated; the guide's force has the arms d x / d theta
        arm3, arm4 = -length3 * s3, -length4 * s4
        offset = (length3 * c3 * square3 + length4 * c4 * square4) / arm4
        slope = -arm3 / arm4
        # The principle for a rotation of the rocker with rod 4
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
    end: Any, press: Press, workpiece: NDArray[Any], contacts: Any, values: Any, distances: Any
) -> None:
    """Fill angular accelerations of an end of a step, by balance of forces, its values and distances."""
    time, angle, rate, mechanism = end.time, end.angle, end.rate, press.mechanism
    state = State(angle[0], angle[1], angle[2], angle[3], rate[0], rate[1], rate[2], rate[3])
    alpha2, alpha3, alpha4, alpha5 = 0.0, 0.0, 0.0, 0.0
    if press.has_journal:
        tip = carried_tip(state.theta3, state.w3, 0.0, mechanism)
        loads = contact_loads(time, state, tip, press, workpiece, contacts, values)
        alpha2, alpha3, alpha4, _ = chain_accelerations(state, loads, press)
    else:
        tip = driven_tip(time, mechanism)
        loads = contact_loads(time, state, tip, press, workpiece, contacts, values)
        alpha4 = rod4_moment(state.theta4, tip, loads, press) / press.carried_inertia
    # The rocker's alpha3 adds to the acceleration of C; it is 0 here behind an ideal pin
    arm_x, arm_y = tip.x - mechanism.pivot_x, tip.y - mechanism.pivot_y
    along_x, along_y, w4 = loads.along_x, loads.along_y, state.w4
    ax = tip.ax - alpha3 * arm_y - alpha4 * along_y - w4 * w4 * along_x
    ay = tip.ay + alpha3 * arm_x + alpha4 * along_x - w4 * w4 * along_y
    if press.has_guide:
        alpha5, theta, omega = loads.moment / mechanism.slider.inertia, state.theta5, state.w5
        x = values.x - mechanism.guide_x
        for number in range(CORNER_COUNT):
            motion = corner_motion(number, x, theta, values.vx, values.vy, omega, press.guide)
            distance, out = distances[number], ACROSS[number]
            distance.value, distance.rate = motion.gap, motion.rate
            distance.second = -out * (ax - alpha5 * motion.arm_y - omega * omega * motion.arm_x)
    else:
        ax = 0.0
    if press.has_journal:
        journal_distance(time, state, (alpha2, alpha3), press, values, distances[PIN_ROW])
    values.ax, values.ay, values.alpha = ax, ay, alpha5
    values.theta2, values.theta3, values.w2, values.w3 = state.theta2, state.theta3, state.w2, state.w3
    height = distances[HEIGHT_ROW]
    height.value, height.rate, height.second = values.y, values.vy, ay
    second = end.second
    second[0], second[1], second[2], second[3] = alpha2, alpha3, alpha4, alpha5


@kernel
def journal_distance(
    time: float, state: State, alphas: tuple[float, float], press: Press, values: Any, distance: Any
) -> None:
    """Fill the distance of the journal (see the module) from its gap and e in ``values``.

    ``alphas`` are the angular accelerations of rod 2 and rocker, rad/s^2.
    """
    ex, ey, clearance, (alpha2, alpha3) = values.ex, values.ey, press.journal.clearance, alphas
    w1, w2, w3 = press.mechanism.omega, state.w2, state.w3
    # Arms of A, of B about H and of B about A': e = A - H - HB + A'B
    ax, ay, bx, by, cx, cy = journal_arms(time, state, press.mechanism)
    vx, vy = -w1 * ay + w3 * by - w2 * cy, w1 * ax - w3 * bx + w2 * cx
    rate_x = -w1 * w1 * ax + alpha3 * by + w3 * w3 * bx - alpha2 * cy - w2 * w2 * cx
    rate_y = -w1 * w1 * ay - alpha3 * bx + w3 * w3 * by + alpha2 * cx - w2 * w2 * cy
    gap = values.contact[PIN_ROW, 0]
    # The gap itself keeps its digits: c^2 - e^2 = gap (2 c - gap)
    distance.value = gap - 0.5 * gap * gap / clearance
    distance.rate = -(ex * vx + ey * vy) / clearance
    distance.second = -(vx * vx + vy * vy + ex * rate_x + ey * rate_y) / clearance


@kernel
def interpolate(start: Any, end: Any, fraction: float, state: Any) -> None:
    """Fill time, angles and rates of ``state`` at a fraction of a step, by quintic Hermite polynomials.

    ``start``, ``end`` and ``state`` are of ``END``.
    """
    step, square, rest = end.time - start.time, fraction * fraction, 1.0 - fraction
    state.time = start.time + fraction * step
    blend = square * fraction * (10.0 + fraction * (6.0 * fraction - 15.0))
    for k in range(len(start.angle)):
        v0, v1 = start.rate[k], end.rate[k]
        # Cubic polynomial of the rate, by rates and second derivatives; the rise beyond its integral
        slope0, slope1 = step * start.second[k], step * end.second[k]
        c2, c3 = 3.0 * (v1 - v0) - 2.0 * slope0 - slope1, 2.0 * (v0 - v1) + slope0 + slope1
        remainder = end.angle[k] - start.angle[k] - step * (0.5 * (v0 + v1) + (slope0 - slope1) / 12.0)
        integral = fraction * (v0 + fraction * (0.5 * slope0 + fraction * (c2 / 3.0 + 0.25 * fraction * c3)))
        state.angle[k] = start.angle[k] + step * integral + remainder * blend
        state.rate[k] = v0 + fraction * (slope0 + fraction * (c2 + fraction * c3))
        # Round-off of the angles is no rate: in a step of 1e-7 s it would be one of 1e-8 rad/s
        if abs(remainder) > 4e-15:
            state.rate[k] += 30.0 * square * rest * rest * remainder / step
