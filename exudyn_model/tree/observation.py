"""All channels in one state of a tree."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact import corner_load, corner_motion
from exudyn_model.journal import pin_load, pin_motion
from exudyn_model.point_contact import PIN, damped, friction_force
from exudyn_model.side_law import side_normals
from exudyn_model.tables import CHANNELS
from exudyn_model.tree_forces import Forces, angular_accelerations, slider_acceleration
from exudyn_model.tree_motion import TreeState, driven_and_hung, slider_motion
from exudyn_model.watch import watch_corners, watch_pin

# The channels, then the pin's gap, normal force and friction, after those of the corners
WIDTH = len(CHANNELS) + 3


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
        gap0, rate0, _, _, _ = corner_motion(side, x, theta5, vx, vy, w5, law)
        gap1, rate1, _, _, _ = corner_motion(side + 2, x, theta5, vx, vy, w5, law)
        normals = side_normals(
            -gap0,
            -rate0,
            contacts[side].impact_speed,
            -gap1,
            -rate1,
            contacts[side + 2].impact_speed,
            law,
        )
        for end in range(2):
            number, normal = side + 2 * end, normals[end]
            gap, _, slip, rx, ry = corner_motion(number, x, theta5, vx, vy, w5, law)
            load = corner_load(number, normal, slip, rx, ry, law)
            fx, fy, moment = fx + load[0], fy + load[1], moment + load[2]
            values[9 + 3 * number] = gap
            values[10 + 3 * number] = normal
            values[11 + 3 * number] = friction_force(normal, slip, law)
    if not linkage.ideal_pin:
        bodies = driven_and_hung(state, linkage, pin_law)
        gap, rate, slip, nx, ny = pin_motion(bodies, pin_law)
        normal = 0.0
        if gap < 0.0 and contacts[PIN].impact_speed > 0.0:
            elastic = pin_law.stiffness * (-gap) ** pin_law.exponent
            normal = damped(elastic, -rate, contacts[PIN].impact_speed, pin_law)
        friction = friction_force(normal, slip, pin_law)
        pin_x, pin_y, _, pin_moment = pin_load(normal, friction, nx, ny, gap, bodies, pin_law)
        values[21], values[22], values[23] = gap, normal, friction
    forces = Forces(fx, fy, moment, pin_x, pin_y, pin_moment)
    _, alpha3, alpha4, alpha5 = angular_accelerations(state, forces, linkage)
    values[0], values[1], values[2] = linkage.guide_x + x, y, theta5
    values[3], values[4], values[5] = vx, vy, w5
    values[6], values[7] = slider_acceleration(state, alpha3, alpha4, linkage)
    values[8] = alpha5


@kernel
def watch(
    state: TreeState,
    values: NDArray[np.float64],
    linkage: Any,
    law: Any,
    pin_law: Any,
    contacts: NDArray[np.void],
) -> None:
    """Watch all contacts in a state whose ``values`` are from :func:`observe`: see ``watch``."""
    if not linkage.ideal_slider:
        x = values[0] - linkage.guide_x
        watch_corners(state.time, x, values[2], values[3], values[4], values[5], values, law, contacts)
    if not linkage.ideal_pin:
        # From the crank's tip back over rod 2 and rocker to H
        angle1 = linkage.crank_angle + linkage.omega * state.time
        x1, y1 = linkage.crank_length * np.cos(angle1), linkage.crank_length * np.sin(angle1)
        x2, y2 = linkage.rod2_length * np.cos(state.theta2), linkage.rod2_length * np.sin(state.theta2)
        x3, y3 = linkage.rocker_to_b * np.cos(state.theta3), linkage.rocker_to_b * np.sin(state.theta3)
        w1, w2, w3 = linkage.omega, state.w2, state.w3
        watch_pin(
            state.time,
            x1 + x2 - x3 - linkage.pivot_x,
            y1 + y2 - y3 - linkage.pivot_y,
            w3 * y3 - w2 * y2 - w1 * y1,
            w1 * x1 + w2 * x2 - w3 * x3,
            w1,
            w2,
            values[22],
            values[23],
            pin_law,
            contacts,
        )
