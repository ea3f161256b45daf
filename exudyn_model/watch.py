"""Observed extremes of a run's contacts, which ``invariants`` judges.

Every accepted state is examined. Gaps, rates and slips are computed here once more from the bodies' motion,
so that a fault in the formulas that the run was computed with does not conceal itself. The worst of each
contact is kept in its row.
"""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import BEARING_RADIUS, CLEARANCE, HALF_LENGTH, HALF_WIDTH, IMPACT_SPEED, START
from exudyn_model.corners import ACROSS, ALONG, CORNER_COUNT, UPPER
from exudyn_model.kernels import kernel
from exudyn_model.memory import is_shared
from exudyn_model.tables import CONTACT, PER_CONTACT

# What was seen last; scales; then worst value and its time (s) of each of WATCHED
(LAST_START, LAST_GAP, LAST_RATE, FASTEST, FASTEST_SLIP, STRONGEST) = range(6)
WATCHED = ("open-depth", "pull", "driving-friction", "leaving-start", "start-gap")
OPEN_DEPTH, PULL, DRIVING, LEAVING, START_GAP = range(6, 16, 2)
WATCH_COLUMNS = 16


def new_watch(rows: int) -> NDArray[np.float64]:
    """Return the rows of so many contacts, before the first state."""
    return np.zeros((rows, WATCH_COLUMNS))


@kernel
def _keep(worst: NDArray[np.float64], column: int, value: float, time: float) -> None:
    if value > worst[column]:
        worst[column], worst[column + 1] = value, time


@kernel
def watch_contact(
    time: float,
    gap: float,
    rate: float,
    slip: float,
    normal: float,
    power: float,
    contact: NDArray[np.float64],
    closed: bool,
    worst: NDArray[np.float64],
) -> None:
    """Keep the worst violation of each invariant so far.

    Parameters
    ----------
    time : float
        s.
    gap, rate, slip : float
        Gap (m), its rate and the slip (m/s).
    normal, power : float
        Normal force (N) and power of the friction (W) that go with this state.
    contact : ndarray
        Its memory.
    closed : bool
        Whether a contact is in progress that covers this point.
    worst : ndarray, shape (16,)
        Changed in place.
    """
    if contact[IMPACT_SPEED] > 0.0:
        if contact[START] != worst[LAST_START]:
            # Those that begin at t = 0 may separate: a corner may start inside its wall
            worst[LAST_START] = contact[START]
            _keep(worst, LEAVING, min(worst[LAST_RATE], rate), time)
            _keep(worst, START_GAP, min(abs(worst[LAST_GAP]), abs(gap)), time)
    elif not closed:
        _keep(worst, OPEN_DEPTH, -gap, time)
    _keep(worst, PULL, -normal, time)
    _keep(worst, DRIVING, power, time)
    worst[LAST_GAP], worst[LAST_RATE] = gap, rate
    worst[FASTEST] = max(worst[FASTEST], abs(rate))
    worst[FASTEST_SLIP] = max(worst[FASTEST_SLIP], abs(slip))
    worst[STRONGEST] = max(worst[STRONGEST], normal)


@kernel
def watch_corners(
    time: float,
    x: float,
    angle: float,
    vx: float,
    vy: float,
    omega: float,
    first: int,
    values: NDArray[np.float64],
    law: NDArray[np.float64],
    contacts: NDArray[np.float64],
    worst: NDArray[np.float64],
) -> None:
    """Watch the corners of a slider.

    Parameters
    ----------
    time : float
        s.
    x, angle, vx, vy, omega : float
        Of the slider in the guide's frame: m, rad, s.
    first : int
        Row of the slider's first corner.
    values : ndarray
        Of this state: see ``tables``; normal forces and friction are read.
    law : ndarray
    contacts, worst : ndarray, shape (rows, columns)
        Of all contacts; ``worst`` is changed in place.
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    wall, shared = law[HALF_WIDTH] + law[CLEARANCE], is_shared(law)
    for number in range(CORNER_COUNT):
        row, side, end = first + number, ACROSS[number], ALONG[number]
        arm_x = side * law[HALF_WIDTH] * cosine - end * law[HALF_LENGTH] * sine
        arm_y = side * law[HALF_WIDTH] * sine + end * law[HALF_LENGTH] * cosine
        slip = vy + omega * arm_x
        column = CONTACT + PER_CONTACT * row
        power, closed = values[column + 2] * slip, contacts[row, IMPACT_SPEED] > 0.0
        if shared:
            # One friction, at the resultant of the side: the part of one corner may well drive
            other = CONTACT + PER_CONTACT * (first + (number + UPPER) % CORNER_COUNT)
            other_x = side * law[HALF_WIDTH] * cosine + end * law[HALF_LENGTH] * sine
            power += values[other + 2] * (vy + omega * other_x)
            closed = contacts[first + number % UPPER, IMPACT_SPEED] > 0.0
        gap, rate = wall - side * (x + arm_x), -side * (vx - omega * arm_y)
        watch_contact(time, gap, rate, slip, values[column + 1], power, contacts[row], closed, worst[row])


@kernel
def watch_journal(
    time: float,
    ex: float,
    ey: float,
    vx: float,
    vy: float,
    w1: float,
    w2: float,
    row: int,
    values: NDArray[np.float64],
    law: NDArray[np.float64],
    contacts: NDArray[np.float64],
    worst: NDArray[np.float64],
) -> None:
    """Watch a journal, from e (m), its rate (m/s) and the angular speeds of journal and bearing (rad/s)."""
    distance = np.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / distance, ey / distance) if distance > 0.0 else (1.0, 0.0)
    # Of both materials in the point of the bearing's surface, along n rotated by +90 degrees
    of_journal = nx * vy - ny * vx + w1 * (law[BEARING_RADIUS] - distance)
    slip = of_journal - w2 * law[BEARING_RADIUS]
    column = CONTACT + PER_CONTACT * row
    power, closed = values[column + 2] * slip, contacts[row, IMPACT_SPEED] > 0.0
    gap, rate = law[CLEARANCE] - distance, -(nx * vx + ny * vy)
    watch_contact(time, gap, rate, slip, values[column + 1], power, contacts[row], closed, worst[row])
