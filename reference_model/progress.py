"""What the integration carries from step to step, and how a corner's mode changes at an event."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import kernel
from reference_model.events import GAP, PULL, next_regime, touching
from reference_model.friction import friction_regime
from reference_model.minimal import CLIPPED, FREE, MEMORY, REGIME, STATES, Array, Modes, right_hand_side
from reference_model.observation import CHANNELS
from reference_model.parameters import Constants

STEPS, REJECTED, EVALUATIONS, SWITCHES, CONTACTS, BUFFERED, SAMPLES = range(7)
"""What `Progress.counters` counts."""

EVENT_BUFFER = 4096
"""Rows; the kernel returns to have it emptied."""


class Progress(NamedTuple):
    """Everything the integration carries from one chunk to the next, arrays only."""

    clock: Array
    """(3,): time, next step, last step in free flight, s."""
    y: Array
    """(STATES,)."""
    modes: Modes
    """(3, 4)."""
    open_contacts: Array
    """(4, 5), of each touching corner: start, impact speed, impulse before, peak force, largest depth."""
    events: Array
    """(EVENT_BUFFER, 7): corner, start, end, impact speed, impulse, peak force, largest depth."""
    counters: NDArray[np.int64]
    """(7,)."""
    extrema: Array
    """(CHANNELS, 4): minimum, its time, maximum, its time."""


def begin(c: Constants, y0: Array, first_step: float) -> Progress:
    """Return the progress at t = 0; corners that start inside a wall are in contact (shape of y0: (4,))."""
    y = np.zeros(STATES)
    y[:FREE] = y0
    modes, corners = np.zeros((3, 4)), np.zeros((3, 4))
    right_hand_side(c, 0.0, y, modes, np.empty(STATES), corners)
    progress = Progress(
        clock=np.array([0.0, first_step, first_step]),
        y=y,
        modes=modes,
        open_contacts=np.zeros((4, 5)),
        events=np.empty((EVENT_BUFFER, 7)),
        counters=np.zeros(7, dtype=np.int64),
        extrema=np.tile([np.inf, 0.0, -np.inf, 0.0], (CHANNELS, 1)),
    )
    for k in range(4):
        if corners[0, k] < 0.0:
            start_contact(c, k, 0.0, corners, progress)
    return progress


@kernel
def start_contact(c: Constants, k: int, t: float, corners: Array, p: Progress) -> None:
    """Freeze the impact speed of corner `k` and open its row of the event table."""
    speed = max(-corners[1, k], c.speed_floor)
    p.modes[MEMORY, k] = speed
    p.modes[REGIME, k] = friction_regime(c, corners[2, k])
    p.modes[CLIPPED, k] = 1.0 if speed - c.C * corners[1, k] < 0.0 else 0.0
    row = p.open_contacts[k]
    row[0], row[1], row[2], row[3], row[4] = t, speed, p.y[FREE + k], 0.0, 0.0


@kernel
def end_contact(k: int, t: float, p: Progress) -> None:
    """Write the event row of corner `k` and free it."""
    contact, row = p.open_contacts[k], p.events[p.counters[BUFFERED]]
    row[0], row[1], row[2], row[3] = k, contact[0], t, contact[1]
    row[4], row[5], row[6] = p.y[FREE + k] - contact[2], contact[3], contact[4]
    p.counters[BUFFERED] += 1
    p.counters[CONTACTS] += 1
    p.modes[:, k] = 0.0


@kernel
def switch(c: Constants, t: float, kind: int, corner: int, corners: Array, p: Progress) -> None:
    """Change the mode that ended at `t`; corners that touch at the same instant follow."""
    p.counters[SWITCHES] += 1
    if kind == GAP and p.modes[MEMORY, corner] > 0.0:
        end_contact(corner, t, p)
    elif kind == GAP:
        start_contact(c, corner, t, corners, p)
        for k in range(4):
            if p.modes[MEMORY, k] == 0.0 and touching(corners[0, k], corners[1, k], corners[0, corner]):
                start_contact(c, k, t, corners, p)
    elif kind == PULL:
        p.modes[CLIPPED, corner] = 1.0 - p.modes[CLIPPED, corner]
    else:
        p.modes[REGIME, corner] = next_regime(c, int(p.modes[REGIME, corner]), corners[2, corner])


@kernel
def free(modes: Modes) -> bool:
    """Return whether no corner touches."""
    return bool(np.max(modes[MEMORY]) == 0.0)
