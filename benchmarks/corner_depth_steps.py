"""A run of the compiled reference, one accepted step at a time, and how deep it lets an open contact sink.

Nothing here is shared with what locates contacts: a step is computed again from the equations of motion and
scipy's coefficients, and of the integrator only the dense output is used (`reference_model.dop853`). Where
corners, walls and journal are follows from the scene's own numbers by formulas of this module.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853

from comparison.scene import Scene
from reference_model.compiled import kernel
from reference_model.constants import Formulation
from reference_model.dop853 import NODES, ROWS, STAGES, dense, prepare_dense
from reference_model.forces import CONTACTS, INSIDE, no_contacts
from reference_model.formulations import DRIVEN, free, right_hand_side, state_size, tabulate_driven
from reference_model.integrate import CHATTER, NOT_FINITE, REACHED, STEP_LIMIT, SWITCHES_AT_ONCE, advance
from reference_model.progress import (
    BUFFERED,
    REJECTED,
    STEPS,
    SWITCHES,
    Progress,
    begin,
    begin_cycle,
    cycle_start,
)
from reference_model.reading import read_parameters
from reference_model.recording import Samples, samples_of
from reference_model.simulation import LARGEST_STEP_PER_CYCLE
from reference_model.start import formulation, start

COUPLING, SHARES = np.vstack([DOP853.A, DOP853.B]), np.append(DOP853.C, 1.0)
"""The weights of the method are the last row: the last stage is the derivative at the step's end."""
POINTS = 64
"""Of every accepted step, its end the last of them."""
NOT_REPRODUCED = -1
"""The step computed again is not the one that was accepted: the checker is at fault, not the model."""
REPRODUCED, REPRODUCED_SHARE = 1e-12, 0.1
"""m and rad, and a share of the tolerance. The step's length follows from the times at its ends, which are
rounded; in a step at the edge of stability the stages magnify this a million times. By what the step computed
again is off a gap may be too."""

ASTRAY = 1e6
"""m, rad, m/s, rad/s; outside it a run is meaningless, which the reference detects a few steps later."""

OUTSIDE, TOUCHING, CLOSED = 0, 1, 2
"""Rows of what is found: of open contacts the depth in the wall, in the step that their touch ends by itself
(there it says how well the touch is located); of closed contacts the distance from the wall."""
VIOLATIONS, WORST, TIME, CONTACT = 0, 1, 2, 3
"""Columns: steps outside the bound, the largest (m), when (s), and which contact."""


class Geometry(NamedTuple):
    """The scene's lengths (m), angles (rad), speed (rad/s) and branches."""

    formulation: int
    omega: float
    theta0: float
    crank: float
    rod2: float
    to_pin: float
    rocker: float
    pivot_x: float
    pivot_y: float
    branch: float
    rod4: float
    half_width: float
    half_length: float
    left: float
    right: float
    pin_clearance: float


KINDS = {
    Formulation.SLIDER: 0,
    Formulation.PIN: 1,
    Formulation.BOTH: 2,
    Formulation.MULTIPLIER: 3,
}


def geometry(scene: Scene) -> Geometry:
    """Return the numbers of a scene that its gaps follow from."""
    data = scene.data
    m, slider, clearance = data["mechanism"], data["mechanism"]["slider"], data["clearance"]
    room = slider["width"] / 2 + clearance["slider"]
    return Geometry(
        formulation=KINDS[formulation(read_parameters(data))],
        omega=data["drive"]["speed_rpm"] * 2 * math.pi / 60,
        theta0=math.radians(m["crank_angle_deg"]),
        crank=m["crank"]["length"],
        rod2=m["rod2"]["length"],
        to_pin=m["rocker"]["centroid"],
        rocker=m["rocker"]["length"],
        pivot_x=m["rocker_pivot"][0],
        pivot_y=m["rocker_pivot"][1],
        branch=m["rocker_branch"],
        rod4=m["rod4"]["length"],
        half_width=slider["width"] / 2,
        half_length=slider["length"] / 2,
        left=m["guide_x"] - room,
        right=m["guide_x"] + room,
        pin_clearance=clearance["crank_pin"],
    )


@kernel
def gaps(g: Geometry, t: float, y: np.ndarray, out: np.ndarray) -> None:
    """Write the gaps (m) of ll, lr, ul, ur and journal in a state; infinite where there is no such contact.

    `t` counts from any instant at which the crank is at its start.
    """
    out[:] = np.inf
    crank = g.theta0 + g.omega * t
    pin_x, pin_y = g.crank * math.cos(crank), g.crank * math.sin(crank)
    if g.formulation in (1, 2):
        # From the rocker's pivot to B and back along rod 2 to the centre of its bearing.
        bearing_x = g.pivot_x + g.to_pin * math.cos(y[1]) - g.rod2 * math.cos(y[0])
        bearing_y = g.pivot_y + g.to_pin * math.sin(y[1]) - g.rod2 * math.sin(y[0])
        out[4] = g.pin_clearance - math.hypot(pin_x - bearing_x, pin_y - bearing_y)
    if g.formulation == 1:
        return
    if g.formulation == 0:
        # The rocker's angle by the law of cosines in the triangle of crank pin, B and pivot.
        to_x, to_y = pin_x - g.pivot_x, pin_y - g.pivot_y
        distance = math.hypot(to_x, to_y)
        opening = math.acos((distance**2 + g.to_pin**2 - g.rod2**2) / (2.0 * distance * g.to_pin))
        rocker = math.atan2(to_y, to_x) - g.branch * opening
        x, angle = g.pivot_x + g.rocker * math.cos(rocker) + g.rod4 * math.cos(y[0]), y[1]
    elif g.formulation == 2:
        x, angle = g.pivot_x + g.rocker * math.cos(y[1]) + g.rod4 * math.cos(y[2]), y[3]
    else:
        x, angle = y[12], y[14]
    across, along = g.half_width * math.cos(angle), g.half_length * math.sin(angle)
    out[0] = x - across + along - g.left
    out[1] = g.right - (x + across + along)
    out[2] = x - across - along - g.left
    out[3] = g.right - (x + across - along)


@kernel
def step(
    c: Any, t: float, h: float, y0: np.ndarray, modes: np.ndarray, k: np.ndarray, y1: np.ndarray,
    contacts: np.ndarray,
) -> None:  # fmt: skip
    """Write the derivatives at the stages into rows 0 to STAGES of `k`, and the state at t + h into `y1`."""
    for i in range(STAGES + 1):
        for m in range(y0.size):
            s = 0.0
            for j in range(i):
                s += COUPLING[i, j] * k[j, m]
            y1[m] = y0[m] + h * s
        right_hand_side(c, t + SHARES[i] * h, y1, modes, k[i], contacts)


@kernel
def follow(
    c: Any, g: Geometry, p: Progress, t_end: float, tolerance: float, max_step: float, limit: int,
    bound: float, samples: Samples, found: np.ndarray,
) -> int:  # fmt: skip
    """Integrate to `t_end` one attempt at a time, and look at POINTS points of every step that is accepted.

    Returns why it stopped, as `advance` does. `found`, shape (3, 4), is written.
    """
    size = state_size(c)
    y0, y1, state, scratch = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    k, f = np.zeros((ROWS, size)), np.empty((7, size))
    table = np.empty((DRIVEN, NODES.size))
    contacts, modes, gap = no_contacts(), p.modes.copy(), np.empty(CONTACTS)
    broken = np.zeros(3)
    switched = p.counters[SWITCHES]
    found[:] = 0.0
    while True:
        begin_cycle(c, p)
        cycle, t = cycle_start(c, p), p.clock[0]
        if t_end - cycle - t <= 1e-12 * t_end:
            return REACHED
        attempts = p.counters[STEPS] + p.counters[REJECTED] + p.counters[SWITCHES]
        if attempts >= limit:
            return STEP_LIMIT
        if p.counters[SWITCHES] - switched > SWITCHES_AT_ONCE:
            return CHATTER
        steps = p.counters[STEPS]
        y0[:] = p.y
        modes[:] = p.modes
        # One attempt and no more, also where a mode ends at once and the next step has other modes.
        status = advance(c, p, t_end, t_end, tolerance, max_step, attempts + 1, samples)
        p.counters[BUFFERED] = 0
        if p.counters[STEPS] > steps:
            switched = p.counters[SWITCHES]
            for i in range(free(c)):
                if not abs(p.y[i]) < ASTRAY:
                    return NOT_FINITE
            h = p.clock[0] - t
            step(c, t, h, y0, modes, k, y1, contacts)
            tabulate_driven(c, t, h, NODES, table)
            prepare_dense(c, t, h, y0, y1, modes, k, table, free(c), scratch, contacts, f)
            slack = 0.0
            for i in range(free(c) // 2):
                slack = max(slack, abs(y1[i] - p.y[i]))
                # A rounding of the time times the speed, which in a run that gains energy has no bound.
                moved = 4.0 * np.spacing(p.clock[0]) * abs(p.y[free(c) // 2 + i])
                allowed = REPRODUCED + REPRODUCED_SHARE * tolerance + moved
                if not abs(y1[i] - p.y[i]) <= allowed or p.counters[STEPS] > steps + 1:
                    return NOT_REPRODUCED
            broken[:] = 0.0
            for i in range(1, POINTS + 1):
                share = i / POINTS
                dense(y0, f, share, free(c), state)
                gaps(g, t + share * h, state, gap)
                for j in range(CONTACTS):
                    row, wrong = OUTSIDE, -gap[j]
                    # Under the law foundation a side's second corner is located like its first.
                    if modes[INSIDE, j] > 0.0:
                        row, wrong = CLOSED, gap[j]
                    elif p.modes[INSIDE, j] > 0.0:
                        row = TOUCHING
                    if wrong > bound + slack:
                        broken[row] = 1.0
                    if wrong > found[row, WORST]:
                        found[row, WORST], found[row, TIME], found[row, CONTACT] = (
                            wrong,
                            cycle + t + share * h,
                            j,
                        )
            found[:, VIOLATIONS] += broken
        if status not in (REACHED, STEP_LIMIT):
            return status


class Followed(NamedTuple):
    """Result of a run: reason of its end, accepted steps, findings (3, 4), final state."""

    status: int
    steps: int
    found: np.ndarray
    progress: Progress


def check(scene: Scene, bound: float, limit: int, judged: Scene | None = None) -> Followed:
    """Follow a scene's run by the compiled integrator.

    Parameters
    ----------
    scene
        What is run.
    bound
        m; steps with an open contact deeper in its wall, or a closed one farther from it, are counted.
    limit
        Attempted steps and switches after which the run is stopped.
    judged
        Whose geometry the gaps are of; that of `scene` by default.
    """
    p = read_parameters(scene.data)
    c, y0 = start(p, formulation(p))
    largest = p.period * LARGEST_STEP_PER_CYCLE
    progress = begin(c, y0, 1e-3 * largest)
    found = np.zeros((3, 4))
    status = follow(
        c, geometry(judged or scene), progress, p.period * p.cycles, p.tolerance, largest, limit, bound,
        samples_of((), np.empty(0)), found,
    )  # fmt: skip
    return Followed(status, int(progress.counters[STEPS]), found, progress)
