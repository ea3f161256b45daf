"""A run of the compiled reference, one accepted step at a time, and the depths of its open contacts.

Nothing here is shared with the location of contacts: a step is computed again from the equations of motion
and scipy's coefficients, and of the integrator only the dense output is used (`reference_model.dop853`).
Corners, walls and journal follow from the scene's own numbers by formulas of this module.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from comparison.scene import Scene
from reference_model import formulations, running
from reference_model.compiled import kernel
from reference_model.dop853 import (
    END,
    FIRST_DENSE,
    LAST_DENSE,
    POINT,
    STAGES,
    dense,
    evaluate_nodes,
    free_states,
    prepare_dense,
)
from reference_model.dop853 import SHARES as NODES
from reference_model.formulations import Model, tabulate
from reference_model.integrate import (
    CHATTER,
    NOT_FINITE,
    REACHED,
    STEP_LIMIT,
    SWITCHES_AT_ONCE,
    Settings,
    advance,
)
from reference_model.parameters import read_parameters
from reference_model.state import Run

COUPLING, SHARES = np.vstack([DOP853.A, DOP853.B]), np.append(DOP853.C, 1.0)
"""The weights of the method are the last row: the last stage is the derivative at the step's end."""
POINTS = 64
"""Of every accepted step, its end the last of them."""
NOT_REPRODUCED = -1
"""The step computed again is not the one that was accepted: the checker is at fault, not the model."""
ERROR_BOUND, ERROR_SHARE = 1e-12, 0.1
"""m and rad, and a share of the tolerance. The step's length follows from the times at its ends, which are
rounded; in a step at the edge of stability the stages magnify this a million times. A gap may be off by
as much as the step computed again."""

STATE_BOUND = 1e6
"""m, rad, m/s, rad/s; outside it a run is meaningless, which the reference detects a few steps later."""

OUTSIDE, TOUCHING, CLOSED = 0, 1, 2
"""Rows of the depths: the depth of open contacts in the wall; the same in the step that ends at their touch,
where it is the error of the touch's location; the distance of closed contacts from the wall."""
VIOLATIONS, WORST, TIME, CONTACT = 0, 1, 2, 3
"""Columns: steps outside the bound, the largest (m), its time (s) and its contact."""


Geometry = namedtuple(
    "Geometry",
    "formulation omega theta0 crank rod2 to_pin rocker pivot_x pivot_y branch rod4 half_width half_length "
    "left right pin_clearance",
)
"""The scene's lengths (m), angles (rad), speed (rad/s); formulation: slider, pin, both or multiplier."""


def geometry(scene: Scene) -> Geometry:
    """Return the numbers of a scene that its gaps follow from."""
    data, p = scene.data, read_parameters(scene.data)
    m, slider, clearance = data["mechanism"], data["mechanism"]["slider"], data["clearance"]
    room = slider["width"] / 2 + clearance["slider"]
    return Geometry(
        formulation=3 if p.multipliers else 0 if p.ideal_pin else 1 if p.ideal_slider else 2,
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
def follow(
    model: Model, g: Geometry, run: Run, again: Run, settings: Settings, times: tuple[float, float],
    bound: float, depths: np.ndarray,
) -> int:  # fmt: skip
    """Integrate to `t_end` one attempt at a time, and look at POINTS points of every step that is accepted.

    Returns the reason of its end, as `advance` does. In `again` steps are computed again; `times` are
    period and end. `depths` is written, shape (3, 4).
    """
    f, (period, t_end) = again.f, times
    clock, counters = run.clock[0], run.counters[0]
    here, there = run.nodes.y, again.nodes.y
    size, free, contacts = here.shape[1], free_states(run.nodes), run.modes.size
    advance(model, run, settings, 0.0, t_end)  # closes contacts that start inside
    gap, violations = np.empty(5), np.zeros(3)
    modes = run.modes.copy()
    last_switches = counters.switches
    depths[:] = 0.0
    while True:
        # In the multiplier form the crank's angle is a coordinate, and time is that of the run.
        elapsed = 0.0 if g.formulation == 3 else math.floor(clock.time / period) * period
        clock.time -= elapsed
        clock.cycle += elapsed
        cycle, t = clock.cycle, clock.time
        if t_end - cycle - t <= 1e-12 * t_end:
            return REACHED
        attempts = counters.steps + counters.rejected + counters.switches
        if attempts >= settings.limit:
            return STEP_LIMIT
        if counters.switches - last_switches > SWITCHES_AT_ONCE:
            return CHATTER
        steps, remaining = counters.steps, t_end - cycle
        there[0] = here[0]
        for k in range(contacts):
            modes[k] = run.modes[k]
        # One attempt and no more, also where a mode ends at once and the next step has other modes.
        attempt = Settings(settings.tolerance, settings.largest, settings.room, attempts + 1)
        status = advance(model, run, attempt, remaining, remaining)
        counters.events = counters.recorded = 0
        if counters.steps > steps:
            last_switches = counters.switches
            for i in range(free):
                if not abs(here[0, i]) < STATE_BOUND:
                    return NOT_FINITE
            h = clock.time - t
            for i in range(STAGES + 1):
                for m in range(size):
                    s = 0.0
                    for j in range(i):
                        s += COUPLING[i, j] * again.nodes.dy[j, m]
                    there[POINT, m] = there[0, m] + h * s
                evaluate_nodes(model, t + SHARES[i] * h, 0.0, POINT, POINT, modes, again.nodes)
                again.nodes.dy[i] = again.nodes.dy[POINT]
            there[END] = there[POINT]
            tabulate(model, t, h, NODES)
            evaluate_nodes(model, t, h, FIRST_DENSE, LAST_DENSE, modes, again.nodes)
            prepare_dense(h, there, again.nodes.dy, f)
            slack = 0.0
            for i in range(free // 2):
                slack = max(slack, abs(there[END, i] - here[0, i]))
                # A rounding of the time times the speed, which in a run that gains energy has no bound.
                drift = 4.0 * np.spacing(clock.time) * abs(here[0, free // 2 + i])
                limit = ERROR_BOUND + ERROR_SHARE * settings.tolerance + drift
                if not abs(there[END, i] - here[0, i]) <= limit or counters.steps > steps + 1:
                    return NOT_REPRODUCED
            violations[:] = 0.0
            for i in range(1, POINTS + 1):
                share = i / POINTS
                dense(share, free, there, f)
                gaps(g, t + share * h, there[POINT], gap)
                for k in range(contacts):
                    j = 4 if g.formulation == 1 else k  # of the journal alone
                    row, excess = OUTSIDE, -gap[j]
                    # Where a side is one contact its second corner is located like its first.
                    if modes[k].inside:
                        row, excess = CLOSED, gap[j]
                    elif run.modes[k].inside:
                        row = TOUCHING
                    if excess > bound + slack:
                        violations[row] = 1.0
                    if excess > depths[row, WORST]:
                        depths[row, WORST], depths[row, CONTACT] = excess, j
                        depths[row, TIME] = cycle + t + share * h
            depths[:, VIOLATIONS] += violations
        if status not in (REACHED, STEP_LIMIT):
            return status


class Outcome(NamedTuple):
    """Reason of a run's end, its accepted steps, its depths (3, 4), and its final state."""

    status: int
    steps: int
    depths: np.ndarray
    run: Run


def check(scene: Scene, bound: float, limit: int, gap_scene: Scene | None = None) -> Outcome:
    """Follow a scene's run for so many attempted steps and switches, and count depths outside the bound (m).

    The gaps are those of the geometry of `gap_scene`, by default of the scene itself.
    """
    p = read_parameters(scene.data)
    model, _ = formulations.formulation(p)
    y0, largest = formulations.start(p, model), p.period * running.LARGEST_STEP_PER_CYCLE
    never = np.array([[np.inf], [0.0]])
    run, again = (running.new_run(y0, len(p.contacts), 1e-3 * largest, never, 200) for _ in range(2))
    depths, settings = np.zeros((3, 4)), Settings(p.tolerance, largest, 100, limit)
    times = p.period, p.period * p.cycles
    status = follow(model, geometry(gap_scene or scene), run, again, settings, times, bound, depths)
    return Outcome(status, int(run.counters["steps"][0]), depths, run)
