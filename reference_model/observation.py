"""From a state to the named channels, and the peaks between two steps."""

import math

from reference_model.compiled import kernel
from reference_model.contact import CORNERS
from reference_model.friction import friction_force
from reference_model.linkage import rocker_tip
from reference_model.minimal import CLIPPED, FREE, MEMORY, REGIME, Array, Modes
from reference_model.parameters import Constants

MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
CORNER_CHANNELS = tuple(
    f"corner_{corner}_{what}" for corner in CORNERS for what in ("gap", "normal", "friction")
)
NAMES = MOTION + ACCELERATIONS + CORNER_CHANNELS
CHANNELS = len(NAMES)

_FIRST_CORNER = len(MOTION) + len(ACCELERATIONS)


@kernel
def observe(c: Constants, t: float, y: Array, modes: Modes, dy: Array, corners: Array, out: Array) -> None:
    """Write all channels, in the order of `NAMES`, into `out`, shape (CHANNELS,).

    `dy`, shape (STATES,), and `corners`, shape (3, 4), are what `right_hand_side` gives in that state, so
    accelerations and forces come from the balance of forces, never from differences.
    """
    Cx, Cy, vCx, vCy, aCx, aCy = rocker_tip(c, t)
    c4, s4 = math.cos(y[0]), math.sin(y[0])
    w4, a4 = y[2], dy[2]
    out[0], out[1], out[2] = Cx + c.L4 * c4, Cy + c.L4 * s4, y[1]
    out[3], out[4], out[5] = vCx - c.L4 * w4 * s4, vCy + c.L4 * w4 * c4, y[3]
    out[6] = aCx - c.L4 * (a4 * s4 + w4 * w4 * c4)
    out[7] = aCy + c.L4 * (a4 * c4 - w4 * w4 * s4)
    out[8] = dy[3]
    for k in range(4):
        normal = max(0.0, dy[FREE + k])
        i = _FIRST_CORNER + 3 * k
        out[i], out[i + 1] = corners[0, k], normal
        out[i + 2] = friction_force(c, normal, corners[2, k], int(modes[REGIME, k])) if normal > 0.0 else 0.0


@kernel
def widen(extrema: Array, t: float, values: Array) -> None:
    """Update minimum, its time, maximum, its time of each channel, shape (CHANNELS, 4)."""
    for i in range(CHANNELS):
        value = values[i]
        if value < extrema[i, 0]:
            extrema[i, 0], extrema[i, 1] = value, t
        if value > extrema[i, 2]:
            extrema[i, 2], extrema[i, 3] = value, t


@kernel
def turns_inside(modes: Modes, before: Array, after: Array) -> bool:
    """Return whether some touching corner was deepest within a step: its gap's rate turned positive."""
    turns = False
    for k in range(4):
        turns = turns or (modes[MEMORY, k] > 0.0 and before[1, k] < 0.0 < after[1, k])
    return turns


@kernel
def force_lead(c: Constants, depth: float, impact_speed: float) -> float:
    """Return how long before the greatest depth the contact force peaks, s.

    Zero of d/dt [d^n (1 + C d' / v)] with d' = -d'' s at a time s before the greatest depth, to first order.
    """
    return c.C * depth / (c.n * impact_speed)


@kernel
def note_forces(modes: Modes, dy: Array, corners: Array, open_contacts: Array) -> None:
    """Update peak force and largest depth of the touching corners, columns 3 and 4 of `open_contacts`."""
    for k in range(4):
        if modes[MEMORY, k] > 0.0:
            if modes[CLIPPED, k] == 0.0:
                open_contacts[k, 3] = max(open_contacts[k, 3], dy[FREE + k])
            open_contacts[k, 4] = max(open_contacts[k, 4], -corners[0, k])
