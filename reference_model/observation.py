"""From a state to the named channels, and the peaks between two steps."""

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import bare, inlined, kernel
from reference_model.constants import Constants
from reference_model.contact import CORNERS
from reference_model.energy import ENERGIES, balance, starting_energies
from reference_model.forces import (
    CLIPPED,
    CONTACTS,
    FRICTION,
    GAP,
    MEMORY,
    NORMAL,
    Array,
    normal_force,
    of_side,
    other_corner,
)
from reference_model.formulations import Driven, bearing_motion, driven, free, slider_at
from reference_model.journal import JOURNAL
from reference_model.mechanism import (
    constraint_drift,
    driven_bodies,
    fill_bodies,
    ideal_pin,
    ideal_slider,
    slider_row,
)
from reference_model.reactions import REACTIONS, reactions

MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
CORNER_CHANNELS = tuple(
    f"corner_{corner}_{what}" for corner in CORNERS for what in ("gap", "normal", "friction")
)
NAMES = MOTION + ACCELERATIONS + CORNER_CHANNELS + REACTIONS + ENERGIES
DRIFT = len(NAMES)
"""Behind the named channels, of every formulation: largest |Phi| and |Phi'| of the state."""
CHANNELS = DRIFT + 2
CORNERS_FROM = len(MOTION) + len(ACCELERATIONS)
REACTIONS_FROM = CORNERS_FROM + len(CORNER_CHANNELS)
ENERGIES_FROM = REACTIONS_FROM + len(REACTIONS)

MOTION_ONLY, WITH_JOINTS, WITH_ENERGY, WITH_FORCES = 0, 1, 2, 4
"""What to observe beside the slider's motion, added up: nothing is computed that nobody asked for.

WITH_FORCES: the slider's accelerations and its corners.
"""


@bare
def observe(
    c: Constants, t: float, y: Array, modes: Array, dy: Array, contacts: Array, what: int, start: Array,
    out: Array,
) -> None:  # fmt: skip
    """Write the channels as `observe_driven` does, where nobody knows yet what is driven."""
    observe_driven(c, t, driven(c, t), y, modes, dy, contacts, what, start, out)


@inlined
def observe_driven(
    c: Constants,
    t: float,
    at: Driven,
    y: Array,
    modes: Array,
    dy: Array,
    contacts: Array,
    what: int,
    start: Array,
    out: Array,
) -> None:
    """Write the channels, in the order of `NAMES`, into `out`, shape (CHANNELS,).

    Parameters
    ----------
    c, t, at, y, modes
        Constants, time (s), what `driven` says of it, state, modes.
    dy, contacts
        What `right_hand_side` gives in that state: accelerations and forces come from the balance of forces,
        never from differences. Not read where only the motion is asked for.
    what
        Sum of WITH_JOINTS, WITH_ENERGY and WITH_FORCES, or MOTION_ONLY.
    start
        Energies at t = 0.
    out
        Written; channels that are not asked for keep what they had.
    """
    out[DRIFT], out[DRIFT + 1] = constraint_drift(c, t, y)
    if what & WITH_FORCES:
        slider_row(c, t, at, y, dy, out)
        for k in range(4):
            i = CORNERS_FROM + 3 * k
            normal = max(0.0, contacts[NORMAL, k])
            out[i], out[i + 1], out[i + 2] = contacts[GAP, k], normal, contacts[FRICTION, k]
    else:
        out[0], out[1], out[2], out[3], out[4], out[5] = slider_at(c, at, y)
    if what & (WITH_JOINTS | WITH_ENERGY):
        _observe_bodies(c, t, y, modes, dy, contacts, what, start, out)


@kernel
def _observe_bodies(
    c: Constants, t: float, y: Array, modes: Array, dy: Array, contacts: Array, what: int, start: Array,
    out: Array,
) -> None:  # fmt: skip
    """Write what needs the motion of all bodies: reactions and energies."""
    if what & WITH_JOINTS:
        bodies = np.empty((5, 9))
        fill_bodies(c, t, y, dy, bodies)
        Fx = Fy = 0.0
        for k in range(4):
            Fx += contacts[NORMAL, k] if k % 2 == 0 else -contacts[NORMAL, k]
            Fy += contacts[FRICTION, k]
        b = bearing_motion(c, t, y)
        normal, drag = contacts[NORMAL, JOURNAL], contacts[FRICTION, JOURNAL]
        G = (normal * b.nx - drag * b.ny, normal * b.ny + drag * b.nx, b.Px, b.Py)
        reactions(c, bodies, Fx, Fy, ideal_slider(c), ideal_pin(c), G, out[REACTIONS_FROM:ENERGIES_FROM])
    if what & WITH_ENERGY:
        audit(c, t, y, modes, dy, contacts, start, out[ENERGIES_FROM:DRIFT])


@kernel
def audit(
    c: Constants, t: float, y: Array, modes: Array, dy: Array, contacts: Array, start: Array, out: Array
) -> None:
    """Write the energies of a state in the order of `ENERGIES`, shape (7,); arguments as of `observe`."""
    bodies = np.empty((5, 9))
    fill_bodies(c, t, y, dy, bodies)
    balance(c, bodies, modes, contacts, y[free(c) + CONTACTS :], driven_bodies(c), start, out)


@kernel
def note_start(c: Constants, y: Array, modes: Array, dy: Array, contacts: Array, start: Array) -> None:
    """Write the energies at t = 0 that the audit compares with, shape (5,)."""
    bodies = np.empty((5, 9))
    fill_bodies(c, 0.0, y, dy, bodies)
    starting_energies(c, bodies, modes, contacts, driven_bodies(c), start)


@inlined
def widen(extrema: Array, wanted: NDArray[np.int64], t: float, values: Array) -> None:
    """Update minimum, its time, maximum, its time of the wanted channels, and of the drift behind them.

    `extrema`: shape (CHANNELS, 4).
    """
    for k in range(wanted.size + CHANNELS - DRIFT):
        i = wanted[k] if k < wanted.size else DRIFT + k - wanted.size
        widen_one(extrema, i, t, values[i])


@inlined
def widen_one(extrema: Array, i: int, t: float, value: float) -> None:
    """Update minimum, its time, maximum, its time of one channel."""
    if value < extrema[i, 0]:
        extrema[i, 0], extrema[i, 1] = value, t
    if value > extrema[i, 2]:
        extrema[i, 2], extrema[i, 3] = value, t


@inlined
def note_forces(c: Constants, modes: Array, contacts: Array, open_contacts: Array) -> None:
    """Update peak force and largest depth of the closed contacts, columns 3 and 4 of `open_contacts`."""
    for k in range(CONTACTS):
        if modes[MEMORY, k] > 0.0:
            if modes[CLIPPED, k] == 0.0:
                open_contacts[k, 3] = max(open_contacts[k, 3], normal_force(c, contacts, k))
            open_contacts[k, 4] = max(open_contacts[k, 4], -contacts[GAP, k])
            if of_side(c, k):
                open_contacts[k, 4] = max(open_contacts[k, 4], -contacts[GAP, other_corner(k)])
