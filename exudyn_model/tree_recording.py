"""Judge each step of rod 4 and slider, and keep what is asked of the accepted ones.

An accepted step goes from one state to the next without a touch or a leaving between: its angles are
interpolated by quintic Hermite polynomials, at the samples' times and at ``_POINTS`` equal parts of the step
for extrema, impulses and peaks. Whatever is kept follows from such a state by balance of forces.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.accelerations import rod4_acceleration
from exudyn_model.compiled import kernel
from exudyn_model.contact import corner_load, corner_motion
from exudyn_model.contact_memory import EVENT, write_event
from exudyn_model.mechanism import Model
from exudyn_model.point_contact import friction_force
from exudyn_model.side_law import side_normals
from exudyn_model.tables import CHANNELS, event_table, extrema_table, new_extrema, widen
from exudyn_model.touch_location import (
    GAP_TOLERANCE,
    MOTION,
    complete,
    freeze,
    interpolate,
    locate,
)
from exudyn_model.tree import slider_motion

# Parts of a step, an even number: Simpson's rule takes them in pairs
_POINTS = 4


@kernel
def _observe(
    time: float,
    theta4: float,
    w4: float,
    theta5: float,
    w5: float,
    linkage: Any,
    law: Any,
    corners: NDArray[np.void],
    values: NDArray[np.float64],
) -> None:
    """Fill ``values`` with all channels; only corners in contact carry a force."""
    x, y, vx, vy, tip_ax, tip_ay = slider_motion(time, theta4, w4, linkage)
    fx, fy, moment = 0.0, 0.0, 0.0
    for side in range(2):
        gap0, rate0, _, _, _ = corner_motion(side, x, theta5, vx, vy, w5, law)
        gap1, rate1, _, _, _ = corner_motion(side + 2, x, theta5, vx, vy, w5, law)
        normals = side_normals(
            -gap0,
            -rate0,
            corners[side].impact_speed,
            -gap1,
            -rate1,
            corners[side + 2].impact_speed,
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
    values[0], values[1], values[2] = linkage.guide_x + x, y, theta5
    values[3], values[4], values[5] = vx, vy, w5
    a4 = rod4_acceleration(theta4, tip_ax, tip_ay, fx, fy, linkage)
    along_x, along_y = linkage.rod4_length * np.cos(theta4), linkage.rod4_length * np.sin(theta4)
    values[6] = tip_ax - a4 * along_y - w4 * w4 * along_x
    values[7] = tip_ay + a4 * along_x - w4 * w4 * along_y
    values[8] = moment / linkage.slider_inertia


@kernel
def _renew_corners(
    end: Any,
    linkage: Any,
    law: Any,
    corners: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """End the contacts of corners that have left, begin those of corners that touch; the event count."""
    x, _, vx, vy, _, _ = slider_motion(end.time, end.theta4, end.w4, linkage)
    for number in range(4):
        corner = corners[number]
        gap, rate, _, _, _ = corner_motion(number, x, end.theta5, vx, vy, end.w5, law)
        # A corner that has just touched may still be open by round-off, but it approaches
        if corner.impact_speed > 0.0 and (gap > GAP_TOLERANCE or (gap >= -GAP_TOLERANCE and rate > 0.0)):
            write_event(events[event_count], number, corner, end.time)
            event_count += 1
            corner.impact_speed = 0.0
        corner.gap, corner.rate = gap, rate
        if corner.impact_speed == 0.0 and gap <= GAP_TOLERANCE and rate < 0.0:
            freeze(corner, end.time, law)
    return event_count


@kernel
def _accept(
    start: Any,
    end: Any,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    corners: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
    values: NDArray[np.float64],
    extrema: NDArray[np.void],
    samples: NDArray[np.float64],
    next_sample: int,
    sample_interval: float,
    known_until: float,
) -> tuple[int, int]:
    """Take the step from ``start`` to ``end``; the event count, and the number of samples so far."""
    step = end.time - start.time
    while next_sample < len(samples) and next_sample * sample_interval <= known_until:
        share = (next_sample * sample_interval - start.time) / step
        state = interpolate(start, end, share)
        _observe(*state, linkage[0], law[0], corners, samples[next_sample])
        widen(extrema, samples[next_sample], state[0])
        next_sample += 1
    for number in range(4):
        corners[number].impulse += step / (3 * _POINTS) * corners[number].normal
    for point in range(1, _POINTS + 1):
        state = interpolate(start, end, point / _POINTS)
        _observe(*state, linkage[0], law[0], corners, values)
        widen(extrema, values, state[0])
        weight = step / (3 * _POINTS) * (1 if point == _POINTS else 4 if point % 2 == 1 else 2)
        for number in range(4):
            corner = corners[number]
            corner.normal = values[10 + 3 * number]
            corner.impulse += weight * corner.normal
            corner.peak = max(corner.peak, corner.normal)
            corner.depth = max(corner.depth, -values[9 + 3 * number])
    event_count = _renew_corners(end, linkage[0], law[0], corners, events, event_count)
    return event_count, next_sample


def _fill(motion: NDArray[np.void], time: float, q: NDArray[np.float64], v: NDArray[np.float64]) -> None:
    """Angles and angular velocities of ``motion`` from the tree's coordinates."""
    motion["time"] = time
    motion["theta4"], motion["w4"] = q[0], v[0]
    motion["theta5"], motion["w5"] = q[0] + q[1], v[0] + v[1]


class TreeRecorder:
    """Judges the steps of one run and gathers its results.

    Parameters
    ----------
    model : Model
        From ``tree``.
    sample_interval : float
        s.
    samples : int
        Besides the initial state.
    least : float
        Shortest step that ends at a touch or a leaving, s.
    """

    def __init__(self, model: Model, sample_interval: float, samples: int, least: float) -> None:
        self.steps = 0
        self._linkage, self._law, self._corners = model.linkage, model.law, model.contacts
        self._sample_interval, self._least = sample_interval, least
        self._start, self._end = np.zeros(1, MOTION), np.zeros(1, MOTION)
        self._values = np.zeros(len(CHANNELS))
        self._samples = np.zeros((samples + 1, len(CHANNELS)))
        self._extrema = new_extrema(len(CHANNELS))
        self._events = np.zeros(64, EVENT)
        self._event_count, self._sample_count = 0, 0

    @property
    def time(self) -> float:
        """Time of the last accepted state, s."""
        return float(self._start[0]["time"])

    def begin(self, q: NDArray[np.float64], v: NDArray[np.float64]) -> None:
        """Take the initial state (see :meth:`judge`): its penetrating corners are in contact from t = 0."""
        _fill(self._start, 0.0, q, v)
        start, linkage, law = self._start[0], self._linkage, self._law
        _renew_corners(start, linkage[0], law[0], self._corners, self._events, 0)
        for corner in self._corners:
            if corner["gap"] < 0 and corner["impact_speed"] == 0:  # penetrates, but does not approach
                freeze(corner, 0.0, law[0])
        complete(start, linkage, law, self._corners)
        _observe(
            0.0,
            start["theta4"],
            start["w4"],
            start["theta5"],
            start["w5"],
            linkage[0],
            law[0],
            self._corners,
            self._samples[0],
        )
        widen(self._extrema, self._samples[0], 0.0)
        for number in range(4):
            self._corners[number]["normal"] = self._samples[0, 10 + 3 * number]
            self._corners[number]["peak"] = self._corners[number]["normal"]
            self._corners[number]["depth"] = max(-self._corners[number]["gap"], 0.0)
        self._sample_count = 1

    def judge(self, time: float, q: NDArray[np.float64], v: NDArray[np.float64], last: bool) -> float:
        """Accept the step to this state, or tell where in it a corner first touches or leaves.

        Parameters
        ----------
        time : float
            s.
        q, v : ndarray, shape (2,)
            Angle of rod 4, angle of the slider from rod 4, and their rates.
        last : bool
            Whether the run ends here: samples up to 1e-10 s later are extrapolated.

        Returns
        -------
        share : float
            1 if the step is accepted, else the share of it after which a corner touches or leaves.
        """
        _fill(self._end, time, q, v)
        start, end = self._start[0], self._end[0]
        complete(end, self._linkage, self._law, self._corners)
        share = locate(start, end, self._linkage, self._law, self._corners, self._least)
        if share < 1.0:
            return share
        if self._event_count + 4 > len(self._events):
            self._events = np.concatenate([self._events, np.zeros_like(self._events)])
        self._event_count, self._sample_count = _accept(
            start,
            end,
            self._linkage,
            self._law,
            self._corners,
            self._events,
            self._event_count,
            self._values,
            self._extrema,
            self._samples,
            self._sample_count,
            self._sample_interval,
            np.inf if last else time,
        )
        self._start, self._end = self._end, self._start
        self.steps += 1
        return 1.0

    def columns(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return sampled channels by name, as far as the run came."""
        return {name: self._samples[: self._sample_count, CHANNELS.index(name)].copy() for name in names}

    def extrema(self, names: tuple[str, ...]) -> dict[str, dict[str, float]]:
        """Least and greatest value of each channel over the steps, with their times in s."""
        return extrema_table(self._extrema, CHANNELS, names)

    def events(self) -> dict[str, NDArray[Any]]:
        """Contacts sorted by start; one that lasts at the last accepted state ends there."""
        return event_table(self._events[: self._event_count], self._corners, self.time)
