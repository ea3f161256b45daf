"""All channels in one state of a tree, and what the invariants are judged by."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.accelerations import Forces
from exudyn_model.channels import (
    FRICTION,
    GAP,
    NORMAL,
    PER_CONTACT,
    SLIDER_ALPHA,
    SLIDER_ANGLE,
    SLIDER_AX,
    SLIDER_AY,
    SLIDER_OMEGA,
    SLIDER_VX,
    SLIDER_VY,
    SLIDER_X,
    SLIDER_Y,
)
from exudyn_model.compiled import kernel
from exudyn_model.contact.corners import corner_load, side_forces
from exudyn_model.contact.friction import friction_force
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.journal import pin_load, pin_motion
from exudyn_model.contact.point import damped, elastic_force
from exudyn_model.contact.states import CONTACTS, PIN, UPPER
from exudyn_model.tree.forces import angular_accelerations, slider_centre_acceleration
from exudyn_model.tree.motion import TreeState, crank_and_rod2_at, slider_motion
from exudyn_model.watch import Eccentricity, watch_corners, watch_pin

# The channels, then gap, normal force and friction of the pin, as the last contact
WIDTH = GAP + PER_CONTACT * len(CONTACTS)
_PIN = PER_CONTACT * PIN


@kernel
def observe(
    state: TreeState,
    linkage: Any,
    law: Any,
    pin_law: Any,
    contacts: NDArray[np.void],
    values: NDArray[np.float64],
) -> None:
    """Fill ``values``, shape (``WIDTH``,); only what is in contact carries a force."""
    x, y, vx, vy = slider_motion(state, linkage)
    theta5, w5 = state.theta5, state.w5
    fx, fy, moment, pin_x, pin_y, pin_moment = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for side in range(0 if linkage.ideal_slider else 2):
        lower = corner_motion(side, x, theta5, vx, vy, w5, law)
        upper = corner_motion(side + UPPER, x, theta5, vx, vy, w5, law)
        forces = side_forces(
            lower, upper, contacts[side].impact_speed, contacts[side + UPPER].impact_speed, law
        )
        motions, normals = (lower, upper), (forces.lower, forces.upper)
        frictions = forces.lower_friction, forces.upper_friction
        for end in range(2):
            number, normal, friction, motion = side + UPPER * end, normals[end], frictions[end], motions[end]
            load = corner_load(number, normal, friction, motion)
            fx, fy, moment = fx + load[0], fy + load[1], moment + load[2]
            values[GAP + PER_CONTACT * number] = motion.gap
            values[NORMAL + PER_CONTACT * number] = normal
            values[FRICTION + PER_CONTACT * number] = friction
    if not linkage.ideal_pin:
        bodies = crank_and_rod2_at(state, linkage, pin_law)
        journal = pin_motion(bodies, pin_law)
        pin_normal = 0.0
        if journal.gap < 0.0 and contacts[PIN].impact_speed > 0.0:
            elastic = elastic_force(journal.gap, pin_law)
            pin_normal = damped(elastic, -journal.rate, contacts[PIN].impact_speed, pin_law)
        pin_friction = friction_force(pin_normal, journal.slip, pin_law)
        pin_x, pin_y, _, pin_moment = pin_load(pin_normal, pin_friction, journal, bodies, pin_law)
        values[GAP + _PIN], values[NORMAL + _PIN] = journal.gap, pin_normal
        values[FRICTION + _PIN] = pin_friction
    on_slider = Forces(fx, fy, moment, pin_x, pin_y, pin_moment)
    _, alpha3, alpha4, alpha5 = angular_accelerations(state, on_slider, linkage)
    values[SLIDER_X], values[SLIDER_Y], values[SLIDER_ANGLE] = linkage.guide_x + x, y, theta5
    values[SLIDER_VX], values[SLIDER_VY], values[SLIDER_OMEGA] = vx, vy, w5
    values[SLIDER_AX], values[SLIDER_AY] = slider_centre_acceleration(state, alpha3, alpha4, linkage)
    values[SLIDER_ALPHA] = alpha5


@kernel
def watch(
    state: TreeState,
    values: NDArray[np.float64],
    linkage: Any,
    law: Any,
    pin_law: Any,
    contacts: NDArray[np.void],
) -> None:
    """Watch all contacts in a state whose ``values`` are from :func:`observe`: see ``exudyn_model.watch``."""
    if not linkage.ideal_slider:
        watch_corners(
            state.time,
            values[SLIDER_X] - linkage.guide_x,
            values[SLIDER_ANGLE],
            values[SLIDER_VX],
            values[SLIDER_VY],
            values[SLIDER_OMEGA],
            values,
            law,
            contacts,
        )
    if not linkage.ideal_pin:
        # From the crank's tip back over rod 2 and rocker to H
        angle1 = linkage.crank_angle + linkage.omega * state.time
        x1, y1 = linkage.crank_length * np.cos(angle1), linkage.crank_length * np.sin(angle1)
        x2, y2 = linkage.rod2_length * np.cos(state.theta2), linkage.rod2_length * np.sin(state.theta2)
        x3, y3 = linkage.rocker_to_b * np.cos(state.theta3), linkage.rocker_to_b * np.sin(state.theta3)
        w1, w2, w3 = linkage.omega, state.w2, state.w3
        eccentricity = Eccentricity(
            x1 + x2 - x3 - linkage.pivot_x,
            y1 + y2 - y3 - linkage.pivot_y,
            w3 * y3 - w2 * y2 - w1 * y1,
            w1 * x1 + w2 * x2 - w3 * x3,
        )
        watch_pin(
            state.time,
            eccentricity,
            w1,
            w2,
            values[NORMAL + _PIN],
            values[FRICTION + _PIN],
            pin_law,
            contacts,
        )
