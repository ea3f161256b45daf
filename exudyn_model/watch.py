"""Observed extremes of a run's contacts, which ``invariants`` judges.

Every accepted state is examined. Gaps, rates and slips are computed here once more from the bodies' motion,
so that a fault in the formulas that the run was computed with does not conceal itself.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import BEARING_RADIUS, CLEARANCE, HALF_LENGTH, HALF_WIDTH, SHARED
from exudyn_model.corners import ACROSS, ALONG, CORNER_COUNT, UPPER

Array = NDArray[np.float64]

WATCHED = ("open-depth", "pull", "driving-friction", "leaving-start", "start-gap")
# Columns of the memory that are looked at
MEMORY = ("impact speed", "start", "name")
SPEED, START, NAME = range(3)


class Watch:
    """The worst of a run's contacts.

    States come many at a time, the first of them the last one of the call before.

    Parameters
    ----------
    names : tuple of str
        Of the contacts.

    Attributes
    ----------
    worst : dict
        Of each of ``WATCHED``: value, time (s), and row of the contact.
    fastest, fastest_slip, strongest : float
        Rate of a gap and slip (m/s), normal force (N).
    """

    def __init__(self) -> None:
        self.worst: dict[str, tuple[float, float, int]] = dict.fromkeys(WATCHED, (0.0, 0.0, 0))
        self.fastest, self.fastest_slip, self.strongest = 0.0, 0.0, 0.0

    def _keep(self, name: str, row: int, times: Array, values: Array) -> None:
        if values.size:
            at = int(np.argmax(values))
            if values[at] > self.worst[name][0]:
                self.worst[name] = float(values[at]), float(times[at]), row

    def _take(
        self,
        row: int,
        times: Array,
        gap: Array,
        rate: Array,
        slip: Array,
        force: Array,
        power: Array,
        closed: Array,
    ) -> None:
        """Take the states of one contact: what holds in each of them."""
        self._keep("open-depth", row, times, np.where(closed, 0.0, -gap))
        self._keep("pull", row, times, -force)
        self._keep("driving-friction", row, times, power)
        self.fastest = max(self.fastest, float(np.max(np.abs(rate))))
        self.fastest_slip = max(self.fastest_slip, float(np.max(np.abs(slip))))
        self.strongest = max(self.strongest, float(np.max(force)))

    def _take_starts(
        self, row: int, times: Array, gaps: Array, rates: Array, corner: Any, at: NDArray[np.int64]
    ) -> None:
        """Take how contacts begin by the states ``at``: the rows ``corner`` of gaps and rates.

        Not those of t = 0, which may separate: a corner may start inside its wall.
        """
        leaving = np.minimum(rates[corner, at - 1], rates[corner, at])
        self._keep("leaving-start", row, times[at], leaving)
        away = np.minimum(np.abs(gaps[corner, at - 1]), np.abs(gaps[corner, at]))
        self._keep("start-gap", row, times[at], away)

    def take_slider(
        self, first: int, times: Array, motion: Array, forces: Array, memory: Array, law: Array
    ) -> None:
        """Take states of a slider.

        Parameters
        ----------
        first : int
            Row of its first corner.
        times : ndarray, shape (n,)
            s.
        motion : ndarray, shape (5, n)
            Across the guide from its centre line, angle, both rates along and across, angular velocity, in
            the guide's frame: x, angle, vx, vy, omega (m, rad, s).
        forces : ndarray, shape (4, 2, n)
            Normal force and friction of each corner, N.
        memory : ndarray, shape (4, 3, n)
            ``MEMORY`` of each corner.
        law : ndarray
        """
        x, angle, vx, vy, omega = motion
        cosine, sine = np.cos(angle), np.sin(angle)
        wall, shared = law[HALF_WIDTH] + law[CLEARANCE], bool(law[SHARED])
        gaps, rates, slips = np.empty((3, CORNER_COUNT, len(times)))
        for number in range(CORNER_COUNT):
            side, end = ACROSS[number], ALONG[number]
            arm_x = side * law[HALF_WIDTH] * cosine - end * law[HALF_LENGTH] * sine
            arm_y = side * law[HALF_WIDTH] * sine + end * law[HALF_LENGTH] * cosine
            gaps[number] = wall - side * (x + arm_x)
            rates[number], slips[number] = -side * (vx - omega * arm_y), vy + omega * arm_x
        powers, closed = forces[:, 1] * slips, memory[:, SPEED] > 0.0
        if shared:
            # One friction, at the resultant of the side: the part of one corner may well drive
            powers = powers + np.roll(powers, UPPER, axis=0)
            closed = closed | np.roll(closed, UPPER, axis=0)
        for number in range(CORNER_COUNT):
            this = first + number, times, gaps[number], rates[number], slips[number]
            self._take(*this, forces[number, 0], powers[number], closed[number])
            speed, start, name = memory[number]
            at = np.flatnonzero((speed[1:] > 0.0) & (start[1:] != start[:-1])) + 1
            # The contact of a side is judged by the corner that it is named after
            corner = name[at].astype(int) - first
            self._take_starts(first + number, times, gaps, rates, corner, at)

    def take_journal(
        self, row: int, times: Array, motion: Array, forces: Array, memory: Array, law: Array
    ) -> None:
        """Take states of a journal.

        Parameters
        ----------
        row : int
        times : ndarray, shape (n,)
            s.
        motion : ndarray, shape (6, n)
            e from the bearing's centre to the journal's (m), its rate (m/s), both angular speeds (rad/s).
        forces : ndarray, shape (2, n)
            Normal force on the bearing's body along e and friction on the journal across it, N.
        memory : ndarray, shape (3, n)
            ``MEMORY``.
        law : ndarray
        """
        ex, ey, vx, vy, w1, w2 = motion
        distance = np.sqrt(ex * ex + ey * ey)
        with np.errstate(invalid="ignore"):
            nx, ny = np.where(distance > 0.0, [ex / distance, ey / distance], [[1.0], [0.0]])
        # Of both materials in the point of the bearing's surface, along n rotated by +90 degrees
        of_journal = nx * vy - ny * vx + w1 * (law[BEARING_RADIUS] - distance)
        slip = of_journal - w2 * law[BEARING_RADIUS]
        gap, rate = law[CLEARANCE] - distance, -(nx * vx + ny * vy)
        closed = memory[SPEED] > 0.0
        self._take(row, times, gap, rate, slip, forces[0], forces[1] * slip, closed)
        at = np.flatnonzero((memory[SPEED, 1:] > 0.0) & (memory[START, 1:] != memory[START, :-1])) + 1
        self._take_starts(row, times, gap[None], rate[None], 0, at)
