"""Observed extremes of a run's contacts, which ``seen`` collects and ``invariants`` judges.

Every accepted state is examined. Gaps, rates and slips are computed here once more from the bodies' motion,
so that a fault in the formulas that the run was computed with does not conceal itself. The worst of each
contact is kept in its own record.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.channels import FRICTION, NORMAL, PER_CONTACT
from exudyn_model.compiled import kernel
from exudyn_model.contact.foundation import other_end
from exudyn_model.contact.laws import FOUNDATION
from exudyn_model.contact.states import ACROSS, ALONG, CORNERS, PIN

_CORNERS = len(CORNERS)


@kernel
def watch_contact(
    time: float, gap: float, rate: float, slip: float, normal: float, power: float, closed: bool, state: Any
) -> None:
    """Keep the worst violation of each invariant so far in the record of one contact.

    Parameters
    ----------
    time : float
        s.
    gap, rate, slip : float
        Gap (m), its rate and the slip (m/s).
    normal : float
        Normal force that goes with this state, N.
    power : float
        Of the friction that goes with it, W.
    closed : bool
        Whether a contact is in progress that covers this point.
    state : record
        Of ``contact.states.contact_states``.
    """
    if state.impact_speed > 0.0:
        if state.start != state.known_start:
            # Those that begin at t = 0 may separate: a corner may start inside its wall
            state.known_start = state.start
            leaving = min(state.known_rate, rate)
            if leaving > state.leaving:
                state.leaving, state.leaving_time = leaving, time
            away = min(abs(state.known_gap), abs(gap))
            if away > state.start_gap:
                state.start_gap, state.start_gap_time = away, time
    elif not closed and -gap > state.open_depth:
        state.open_depth, state.open_depth_time = -gap, time
    if -normal > state.pull:
        state.pull, state.pull_time = -normal, time
    if power > state.driving:
        state.driving, state.driving_time = power, time
    state.known_gap, state.known_rate = gap, rate
    state.fastest = max(state.fastest, abs(rate))
    state.fastest_slip = max(state.fastest_slip, abs(slip))
    state.strongest = max(state.strongest, normal)


@kernel
def watch_corners(
    time: float,
    x: float,
    angle: float,
    vx: float,
    vy: float,
    omega: float,
    values: NDArray[np.float64],
    law: Any,
    contacts: NDArray[np.void],
) -> None:
    """Watch the slider's corners.

    Parameters
    ----------
    time : float
        s.
    x, angle, vx, vy, omega : float
        Slider's x from the guide's centre line (m), angle (rad) and velocities.
    values : ndarray
        Of this state, in the order of ``channels.CHANNELS``; normal forces and friction are read.
    law : record
        From ``contact.gaps.contact_law``.
    contacts : ndarray, shape (5,)
        From ``contact.states``; changed in place.
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    wall, shared = law.half_width + law.clearance, law.kind == FOUNDATION
    for number in range(_CORNERS):
        side = ACROSS[number]
        along_x, along_y = _arm(number, cosine, sine, law)
        slip = vy + omega * along_x
        power = values[FRICTION + PER_CONTACT * number] * slip
        closed = contacts[number].impact_speed > 0.0
        if shared:
            # One friction, at the resultant of the side: the part of one corner may well drive
            other = other_end(number)
            other_slip = vy + omega * _arm(other, cosine, sine, law)[0]
            power += values[FRICTION + PER_CONTACT * other] * other_slip
            closed = closed or contacts[other].impact_speed > 0.0
        watch_contact(
            time,
            wall - side * (x + along_x),
            -side * (vx - omega * along_y),
            slip,
            values[NORMAL + PER_CONTACT * number],
            power,
            closed,
            contacts[number],
        )


@kernel
def _arm(number: int, cosine: float, sine: float, law: Any) -> tuple[float, float]:
    """Return the vector from the slider's centre to a corner, m."""
    side, end = ACROSS[number], ALONG[number]
    return (
        side * law.half_width * cosine - end * law.half_length * sine,
        side * law.half_width * sine + end * law.half_length * cosine,
    )


class Eccentricity(NamedTuple):
    """Vector from the bearing's centre to the journal's (m), and its rate (m/s)."""

    x: float
    y: float
    vx: float
    vy: float


@kernel
def watch_pin(
    time: float,
    eccentricity: Eccentricity,
    w1: float,
    w2: float,
    normal: float,
    friction: float,
    law: Any,
    contacts: NDArray[np.void],
) -> None:
    """Watch the crank pin.

    Parameters
    ----------
    time : float
        s.
    eccentricity : Eccentricity
    w1, w2 : float
        Angular velocities of crank and rod 2, rad/s.
    normal, friction : float
        On rod 2, along the bearing's outward normal and along that rotated by +90 degrees, N.
    law : record
        From ``contact.journal.journal_law``.
    contacts : ndarray, shape (5,)
        From ``contact.states``; changed in place.
    """
    ex, ey, vx, vy = eccentricity
    distance = np.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / distance, ey / distance) if distance > 0.0 else (1.0, 0.0)
    # Of the bearing's material against the journal's, in the point of the bearing's surface
    bearing = w2 * law.bearing_radius
    journal = nx * vy - ny * vx + w1 * (law.bearing_radius - distance)
    slip = bearing - journal
    closed = contacts[PIN].impact_speed > 0.0
    gap, rate = law.clearance - distance, -(nx * vx + ny * vy)
    watch_contact(time, gap, rate, slip, normal, friction * slip, closed, contacts[PIN])
