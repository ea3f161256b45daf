"""Results of a run: names of the channels, their extrema by crank cycle, contacts, and their pulses.

All come from accepted states, many at a time, as arrays whose last axis is the state.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import CORNERS, UPPER

Array = NDArray[np.float64]

STATE = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
REACTIONS = tuple(f"reaction_{joint}_{axis}" for joint in "OABHCF" for axis in "xy")
LOAD = "energy_load"
_ENERGIES = ("drive", "gravity", "kinetic", "contact", "damping", "friction", "residual")
JOURNAL = ("journal_x", "journal_y")
PIN = "pin"

# Rows of an array of states: x, y, angle of the observed body, their rates and accelerations; gap, normal
# force and friction of each contact; e of each journal
MOTION, ACCELERATION, CONTACT = slice(0, 6), slice(6, 9), 9
PER_CONTACT = 3
# Offset from the row of a coordinate or velocity to that of its rate
TO_RATE = 3

# Last axis of the extrema
_EXTREMUM_FIELDS = ("min", "time_of_min", "max", "time_of_max")
MIN, MAX = 0, 2  # Each is followed by its time

# Number of forces of a row of contacts that are kept; later contacts have no pulse
_PULSE_LIMIT = 200_000


def corner_channels(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the channels of the contacts of these names."""
    return tuple(f"corner_{name}_{part}" for name in names for part in ("gap", "normal", "friction"))


def energy_channels(load: bool) -> tuple[str, ...]:
    """Return the channels of the audit of the energy; ``load``: with that of a workpiece."""
    names = tuple(f"energy_{name}" for name in _ENERGIES)
    return (*names[:4], LOAD, *names[4:]) if load else names


class Extrema:
    """Least and greatest values of channels in each cycle of the crank, with their times.

    Parameters
    ----------
    channels : int
        Number of channels.
    period, duration : float
        Crank cycle and length of the run, s.

    Attributes
    ----------
    values : ndarray, shape (cycles, channels, 4)
    """

    def __init__(self, channels: int, period: float, duration: float) -> None:
        self.period = period
        self.values = np.zeros((max(1, math.ceil(duration / period - 1e-9)), channels, len(_EXTREMUM_FIELDS)))
        self.values[:, :, MIN], self.values[:, :, MAX] = np.inf, -np.inf

    def take(self, times: Array, values: Array) -> None:
        """Take states, shape (channels, n), at ascending times (s).

        A state where two cycles meet counts in both; the last cycle takes all later states.
        """
        slack, last = 1e-9 * self.period, len(self.values) - 1
        first = min(max(int((times[0] - slack) / self.period), 0), last)
        for cycle in range(first, min(int((times[-1] + slack) / self.period), last) + 1):
            end = np.inf if cycle == last else (cycle + 1) * self.period + slack
            low, high = np.searchsorted(times, [cycle * self.period - slack, end])
            if low < high:
                self._update(cycle, np.arange(len(values)), times[low:high], values[:, low:high])

    def take_inside(self, channels: NDArray[np.int64], times: Array, values: Array) -> None:
        """Take values of k channels between states, shape (k, n), each at its own time (s).

        A value whose time is not finite is ignored: there is none, or the run fails.
        """
        times = np.where(np.isnan(times), np.inf, times)
        cycles = np.clip(times / self.period, 0, len(self.values) - 1)
        for cycle in range(int(np.min(cycles, initial=0.0)), int(np.max(cycles, initial=-1.0)) + 1):
            outside = (cycles.astype(int) != cycle) | np.isinf(times)
            self._update(cycle, channels, times, values, outside)

    def by_cycle(self, channels: tuple[str, ...], names: tuple[str, ...]) -> dict[str, Array]:
        """Return the extrema of ``names`` among ``channels`` in each cycle that has begun; times in s."""
        cycles = self.values[np.isfinite(self.values[:, 0, MIN])]
        return {
            f"{name}_{part}": cycles[:, channels.index(name), column].copy()
            for name in names
            for column, part in enumerate(_EXTREMUM_FIELDS)
        }

    def _update(
        self,
        cycle: int,
        channels: NDArray[np.int64],
        times: Array,
        values: Array,
        outside: Array | None = None,
    ) -> None:
        rows, times = np.arange(len(values)), np.broadcast_to(times, values.shape)
        for part, find, better, worst in (
            (MIN, np.argmin, np.less, np.inf),
            (MAX, np.argmax, np.greater, -np.inf),
        ):
            candidates = values if outside is None else np.where(outside, worst, values)
            at = find(candidates, axis=1)
            extremes = candidates[rows, at]
            improved = better(extremes, self.values[cycle, channels, part])
            targets = channels[improved]
            self.values[cycle, targets, part] = extremes[improved]
            self.values[cycle, targets, part + 1] = times[rows, at][improved]


class Contacts:
    """Table and pulses of the contacts of a run.

    Parameters
    ----------
    names : tuple of str
        Names of the rows of the memory.
    shared : bool
        True if a side of the slider has one contact: see ``laws.Law``.

    Attributes
    ----------
    silent : tuple of str
        Names of the contacts without pulses: the press's crank pin.
    """

    def __init__(self, names: tuple[str, ...], shared: bool) -> None:
        self.names, self.shared = names, shared
        self.silent: tuple[str, ...] = (PIN,)
        # Row and start of a contact to its name's row, impact speed, end, impulse, peak and depth so far
        self._contacts: dict[tuple[int, float], list[float]] = {}
        self._pulses: list[list[Array]] = [[] for _ in names]
        self._counts = [0 for _ in names]

    def take(
        self, row: int, memory: Array, ends: Array, impulses: Array, peaks: Array, depths: Array
    ) -> None:
        """Take n states or steps in contact of one row, in order of time.

        Parameters
        ----------
        row : int
        memory : ndarray, shape (3, n)
            Impact speed (m/s), start (s), which identifies the contact, and name.
        ends : ndarray
            End of the contact, s; infinite where it goes on.
        impulses, peaks, depths : ndarray
            N s, N, m.
        """
        if not len(ends):
            return
        speeds, starts, names = memory
        first = np.flatnonzero(np.append(True, starts[1:] != starts[:-1]))
        parts = (
            np.minimum.reduceat(ends, first),
            np.add.reduceat(impulses, first),
            np.maximum.reduceat(peaks, first),
            np.maximum.reduceat(depths, first),
        )
        for at, end, impulse, peak, depth in zip(first, *parts, strict=True):
            entry = [names[at], speeds[at], np.inf, 0.0, 0.0, 0.0]
            contact = self._contacts.setdefault((row, starts[at]), entry)
            contact[2:] = (
                min(contact[2], end),
                contact[3] + impulse,
                max(contact[4], peak),
                max(contact[5], depth),
            )

    def take_pulse(self, row: int, times: Array, forces: Array) -> None:
        """Take the normal forces (N) of the contacts of a row, at times in s."""
        room = _PULSE_LIMIT - self._counts[row]
        if room > 0 and len(times):
            self._pulses[row].append(np.stack([times[:room], forces[:room]]))
            self._counts[row] += min(len(times), room)

    def table(self, now: float) -> dict[str, NDArray[Any]]:
        """Return the contacts sorted by start; one that lasts until ``now`` (s) ends there."""
        rows = sorted((start, *contact) for (_, start), contact in self._contacts.items())
        start, name, speed, end, impulse, peak, depth = np.array(rows).reshape(-1, 7).T
        return {
            "corner": np.array(self.names, dtype=str)[name.astype(int)],
            "start": start,
            "end": np.where(np.isinf(end), now, end),
            "normal_speed": speed,
            "impulse": impulse,
            "peak_force": peak,
            "largest_depth": depth,
        }

    def pulses(self, table: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Return normal forces of corners: row (in the ``table``), time (s), force (N), by row and time.

        A contact during which ``_PULSE_LIMIT`` was reached has no pulse.
        """
        pulses: list[Array] = [np.zeros((3, 0))]
        for number, points in enumerate(self._pulses):
            rows = np.flatnonzero(np.isin(table["corner"], self.names_of_row(number)))
            if not points or not len(rows) or self.names[number] in self.silent:
                continue
            pulse = np.concatenate(points, axis=1)
            # Points in a step of a tree may be closer than the rounding of times
            time, force = pulse[:, np.append(True, np.diff(pulse[0]) > 0.0)]
            row = rows[np.searchsorted(table["start"][rows], time, side="right") - 1]
            # A contact of a tree may have ended at the start of a step; a run may end with nan
            valid = (time <= table["end"][row]) & np.isfinite(force)
            if self._counts[number] == _PULSE_LIMIT:
                valid &= row != row[-1]
            pulses.append(np.stack([row[valid], time[valid], force[valid]]))
        row, time, force = np.concatenate(pulses, axis=1)
        order = np.argsort(row, kind="stable")
        return {"row": row[order].astype(int), "time": time[order], "force": force[order]}

    def names_of_row(self, number: int) -> list[str]:
        """Return the names that the table gives to contacts of a row: both of its side, if shared."""
        if self.shared and self.names[number] != PIN:
            upper = number % len(CORNERS) >= UPPER
            return [self.names[number], self.names[number - UPPER if upper else number + UPPER]]
        return [self.names[number]]


def turning_points(
    before: Array, rate0: Array, after: Array, rate1: Array, step: Array
) -> tuple[Array, Array]:
    """Return the fractions of steps where cubic Hermite interpolants have an extremum, and its values.

    A fraction is infinite where the rates at both ends do not differ in sign.
    """
    slope0, slope1, rise = step * rate0, step * rate1, after - before
    # The slope is slope0 + 2 b f + a f^2
    a, b = 3.0 * (slope0 + slope1 - 2.0 * rise), 3.0 * rise - 2.0 * slope0 - slope1
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - a * slope0)
        fraction = -slope0 / (b + np.where(slope0 < 0.0, root, -root))
        fraction = np.where(rate0 * rate1 < 0.0, fraction, np.inf)
        return fraction, before + fraction * (slope0 + fraction * (b + fraction * a / 3.0))


def run_extrema(by_cycle: Mapping[str, Array], names: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Return the extrema of named channels over the whole run, from those of its cycles."""
    extrema = {}
    for name in names:
        at = {"min": int(np.argmin(by_cycle[f"{name}_min"])), "max": int(np.argmax(by_cycle[f"{name}_max"]))}
        extrema[name] = {part: float(by_cycle[f"{name}_{part}"][at[part[-3:]]]) for part in _EXTREMUM_FIELDS}
    return extrema
