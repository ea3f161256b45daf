"""What is kept of a run: names of the channels, their extrema by crank cycle, contacts, and their pulses."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import IMPACT_SPEED, NOTED
from exudyn_model.corners import CORNER_COUNT, CORNERS
from exudyn_model.kernels import kernel
from exudyn_model.memory import EVENT, write_event

STATE = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
REACTIONS = tuple(f"reaction_{joint}_{axis}" for joint in "OABHCF" for axis in "xy")
ENERGIES = tuple(
    f"energy_{name}" for name in ("drive", "gravity", "kinetic", "contact", "damping", "friction", "residual")
)
JOURNAL = ("journal_x", "journal_y")
PIN = "pin"

# Columns of the values of a state: of the body observed x, y, angle, their rates and accelerations; then gap,
# normal force and friction of each contact; then e of each journal
X, Y, ANGLE, VX, VY, OMEGA, AX, AY, ALPHA = range(9)
CONTACT = 9
PER_CONTACT = 3
# From a coordinate or velocity to its rate; of how many
TO_RATE, MOTION = 3, 6

# Columns of extrema
MIN, TIME_OF_MIN, MAX, TIME_OF_MAX = range(4)
_PARTS = ("min", "time_of_min", "max", "time_of_max")

# Samples of a contact's force: 3.2 MB. Later contacts have no pulse
_NOTES = 200_000


def contact_names(guide: bool, journal: bool) -> tuple[str, ...]:
    """Return the names of the contacts in the order of their rows."""
    return (CORNERS if guide else ()) + ((PIN,) if journal else ())


def corner_channels(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the channels of the contacts."""
    return tuple(f"corner_{name}_{part}" for name in names for part in ("gap", "normal", "friction"))


def channels_of_state(guide: bool, journal: bool) -> tuple[str, ...]:
    """Return the names of the columns of a state's values."""
    own = corner_channels(contact_names(guide, journal))
    return (*STATE, *ACCELERATIONS, *own, *(JOURNAL if journal else ()))


def new_extrema(channels: int, period: float, duration: float) -> NDArray[np.float64]:
    """Make extrema, shape (cycles, channels, 4), before the first value; of a crank's period in s."""
    extrema = np.zeros((max(1, math.ceil(duration / period - 1e-9)), channels, len(_PARTS)))
    extrema[:, :, MIN], extrema[:, :, MAX] = np.inf, -np.inf
    return extrema


@kernel
def cycle_at(extrema: NDArray[np.float64], period: float, time: float) -> int:
    """Return the number of the cycle of a time in s; the last one takes in what is beyond it."""
    return min(max(int(time / period), 0), extrema.shape[0] - 1)


@kernel
def update_extremum(extreme: NDArray[np.float64], value: float, time: float) -> None:
    """Take a ``value`` at ``time`` (s) into the extrema of one channel in one cycle."""
    if value < extreme[MIN]:
        extreme[MIN], extreme[TIME_OF_MIN] = value, time
    if value > extreme[MAX]:
        extreme[MAX], extreme[TIME_OF_MAX] = value, time


@kernel
def update_extrema(
    extrema: NDArray[np.float64], period: float, values: NDArray[np.float64], time: float
) -> None:
    """Take the channels' ``values`` at ``time`` (s) into their extrema; where cycles meet, into both."""
    slack = 1e-9 * period
    for cycle in range(cycle_at(extrema, period, time - slack), cycle_at(extrema, period, time + slack) + 1):
        for channel in range(len(values)):
            update_extremum(extrema[cycle, channel], values[channel], time)


@kernel
def turning_point(
    value0: float, rate0: float, value1: float, rate1: float, step: float
) -> tuple[float, float]:
    """Return the fraction of a step where a cubic Hermite interpolant has its extremum, and that extremum.

    rate0 and rate1 must differ in sign.
    """
    slope0, slope1, rise = step * rate0, step * rate1, value1 - value0
    # The slope is slope0 + 2 b f + a f^2
    a, b = 3.0 * (slope0 + slope1 - 2.0 * rise), 3.0 * rise - 2.0 * slope0 - slope1
    root = np.sqrt(b * b - a * slope0)
    fraction = -slope0 / (b + root if slope0 < 0.0 else b - root)
    return fraction, value0 + fraction * (slope0 + fraction * (b + fraction * a / 3.0))


@kernel
def update_turning_points(
    extrema: NDArray[np.float64],
    period: float,
    before: NDArray[np.float64],
    values: NDArray[np.float64],
    step: float,
    time: float,
) -> None:
    """Take the extrema of the observed motion inside a step (s) that ends at ``time`` (s) into ``extrema``."""
    for channel in range(MOTION):
        rate0, rate1 = before[channel + TO_RATE], values[channel + TO_RATE]
        if rate0 * rate1 < 0.0:
            fraction, value = turning_point(before[channel], rate0, values[channel], rate1, step)
            now = time - (1.0 - fraction) * step
            update_extremum(extrema[cycle_at(extrema, period, now), channel], value, now)


@kernel
def note_force(notes: NDArray[np.float64], contact: NDArray[np.float64], time: float, force: float) -> None:
    """Note the force (N) of a contact at ``time`` (s), as long as there is room."""
    row = int(contact[NOTED])
    if row < len(notes):
        notes[row, 0], notes[row, 1] = time, force
        contact[NOTED] += 1.0


class Tables:
    """Extrema, contacts and pulses of a run, as arrays that the kernels fill.

    Parameters
    ----------
    names : tuple of str
        Of the contacts, in the order of the memory.
    contacts : ndarray, shape (n, columns)
        Their memory.
    channels : tuple of str
        Of a state's values.
    period, duration : float
        Of the crank's cycle and of the run, s.
    shared : bool
        Whether sides remember their touches: see ``laws``.

    Attributes
    ----------
    extrema : ndarray, shape (cycles, channels, 4)
    events : ndarray, shape (n, 7)
        With room for a row of each contact from ``count`` on, after :meth:`make_room`.
    notes : ndarray, shape (contacts, n, 2)
        Times (s) and forces (N).
    """

    def __init__(
        self,
        names: tuple[str, ...],
        contacts: NDArray[np.float64],
        channels: tuple[str, ...],
        period: float,
        duration: float,
        shared: bool,
    ) -> None:
        self._names, self._contacts, self._shared = names, contacts, shared
        self.channels, self.period = channels, period
        self.extrema = new_extrema(len(channels), period, duration)
        self.events, self.count = np.zeros((64, len(EVENT))), 0
        # Not filled: memory that no contact needs is never touched
        self.notes = np.empty((len(names), _NOTES, 2))

    def make_room(self) -> None:
        """Make room for another row of each contact."""
        if self.count + len(self._names) > len(self.events):
            self.events = np.concatenate([self.events, np.zeros_like(self.events)])

    def cycle_extrema(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return least and greatest value of each channel in each cycle that has begun, with times in s."""
        begun = self.extrema[np.isfinite(self.extrema[:, 0, MIN])]
        return {
            f"{name}_{part}": begun[:, self.channels.index(name), column].copy()
            for name in names
            for column, part in enumerate(_PARTS)
        }

    def event_table(self, now: float) -> dict[str, NDArray[Any]]:
        """Return the contacts sorted by start; one that lasts until ``now`` (s) ends there."""
        lasting = [contact for contact in self._contacts if contact[IMPACT_SPEED] > 0.0]
        rows = np.concatenate([self.events[: self.count], np.zeros((len(lasting), len(EVENT)))])
        for row, contact in zip(rows[self.count :], lasting, strict=True):
            write_event(row, contact, now)
        rows = rows[np.lexsort((rows[:, 0], rows[:, 1]))]
        names = np.array(self._names)[rows[:, 0].astype(int)]
        return {"corner": names} | {
            name: rows[:, column].copy() for column, name in enumerate(EVENT) if column > 0
        }

    def pulses(self, events: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Return normal forces in time: row (in ``events``), time (s), force (N), by row and time.

        A contact that was going on when the room of its notes was full has no pulse.
        """
        rows: list[NDArray[Any]] = []
        for number, contact in enumerate(self._contacts):
            noted = self.notes[number, : int(contact[NOTED])]
            time, force = noted.T
            of_this = np.flatnonzero(np.isin(events["corner"], self.names_of_one(number)))
            if not len(time) or not len(of_this):
                continue
            row = of_this[np.searchsorted(events["start"][of_this], time, side="right") - 1]
            # A tree may find in a step that a contact has ended at its start; a run may end with nan
            kept = (time <= events["end"][row]) & np.isfinite(force)
            if len(noted) == self.notes.shape[1]:
                kept &= row != row[-1]
            rows.append(np.stack([row[kept], time[kept], force[kept]]))
        row, time, force = np.concatenate([np.zeros((3, 0)), *rows], axis=1)
        order = np.argsort(row, kind="stable")
        return {"row": row[order].astype(int), "time": time[order], "force": force[order]}

    def names_of_one(self, number: int) -> list[str]:
        """Return the names in the table of what is one contact with that of a row: those of its side."""
        if self._shared and self._names[number] != PIN:
            first = number - number % CORNER_COUNT
            other = first + (number + CORNER_COUNT // 2) % CORNER_COUNT
            return [self._names[number], self._names[other]]
        return [self._names[number]]


def whole_extrema(
    by_cycle: Mapping[str, NDArray[np.float64]], names: tuple[str, ...]
) -> dict[str, dict[str, float]]:
    """Return the extrema of the named channels over the whole run, from those of its cycles."""
    found = {}
    for name in names:
        low, high = int(np.argmin(by_cycle[f"{name}_min"])), int(np.argmax(by_cycle[f"{name}_max"]))
        found[name] = {
            part: float(by_cycle[f"{name}_{part}"][high if part.endswith("max") else low]) for part in _PARTS
        }
    return found
