"""Named channels: which of them a scene asks for, and their extrema by crank cycle.

Extrema are found between rows of values at ascending times: a coordinate turns where its velocity changes
sign, there the motion is the cubic polynomial of both; an instant between two cycles belongs to both.
"""

import numpy as np
from numpy.typing import NDArray

from reference_model.energy import ENERGIES
from reference_model.linkage import Array
from reference_model.parameters import CORNERS, Parameters
from reference_model.reactions import REACTIONS
from reference_model.workpiece import exists

MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
CORNER_CHANNELS = tuple(
    f"corner_{corner}_{what}" for corner in CORNERS for what in ("gap", "normal", "friction")
)
JOURNAL_CHANNELS = ("journal_x", "journal_y")


def requested(p: Parameters) -> list[str]:
    """Return the channels that the scene asks for; an ideal slider has no corners to speak of."""
    names = [*MOTION]
    if "accelerations" in p.groups:
        names += ACCELERATIONS
    if "corners" in p.groups:
        names += () if p.ideal_slider else CORNER_CHANNELS
        names += () if p.ideal_pin else JOURNAL_CHANNELS
    if "joints" in p.groups:
        names += REACTIONS if p.ideal_slider else REACTIONS[:-2]
    if "energy" in p.groups:
        names += [name for name in ENERGIES if name != "energy_load" or exists(p.load)]
    return names


class Extrema:
    """Minimum, its time, maximum, its time of each channel in each crank cycle.

    Parameters
    ----------
    channels
        Their number.
    cycles
        Begun cycles; what is later counts as part of the last.
    period
        s.
    """

    def __init__(self, channels: int, cycles: int, period: float) -> None:
        self.values = np.tile([np.inf, 0.0, -np.inf, 0.0], (cycles, channels, 1))
        """(cycles, channels, 4)."""
        self._period = period

    def widen(self, times: Array, values: Array) -> None:
        """Take account of values (channels, n) at any times (n,), s."""
        if not times.size:
            return
        slack, at = 1e-9 * self._period, np.arange(len(values))
        first, last = self._cycle_of(times.min() - slack), self._cycle_of(times.max() + slack)
        for cycle in range(first, last + 1):
            rows, when = values, times
            if first < last:
                begin = cycle * self._period - slack if cycle else -np.inf
                end = (cycle + 1) * self._period + slack if cycle < len(self.values) - 1 else np.inf
                mine = (times >= begin) & (times < end)
                rows, when = values[:, mine], times[mine]
            if when.size:
                extrema, lowest, highest = self.values[cycle], rows.argmin(1), rows.argmax(1)
                least, most = rows[at, lowest], rows[at, highest]
                lower, higher = least < extrema[:, 0], most > extrema[:, 2]
                extrema[lower, 0], extrema[lower, 1] = least[lower], when[lowest[lower]]
                extrema[higher, 2], extrema[higher, 3] = most[higher], when[highest[higher]]

    def widen_channel(self, channel: int, times: Array, values: Array) -> None:
        """Take account of values of one channel at any times, both of shape (n,)."""
        if not times.size:
            return
        cycles = np.clip((times / self._period).astype(np.int64), 0, len(self.values) - 1)
        for cycle in range(cycles.min(), cycles.max() + 1):
            mine, row = np.flatnonzero(cycles == cycle), self.values[cycle, channel]
            if mine.size:
                lowest, highest = mine[values[mine].argmin()], mine[values[mine].argmax()]
                if values[lowest] < row[0]:
                    row[:2] = values[lowest], times[lowest]
                if values[highest] > row[2]:
                    row[2:] = values[highest], times[highest]

    def turn(self, times: Array, motion: Array) -> None:
        """Take account of where the slider's coordinates turn; `motion`, shape (6, n), at ascending times."""
        length = np.diff(times)
        for i in range(3):
            rate, x = motion[3 + i], motion[i]
            j = np.flatnonzero((rate[:-1] * rate[1:] < 0.0) & (length > 0.0))
            h, r0, r1 = length[j], rate[j], rate[j + 1]
            rise = (x[j + 1] - x[j]) / h
            curved, cubic = 3.0 * rise - 2.0 * r0 - r1, r0 + r1 - 2.0 * rise
            # The rate r0 + 2 curved s + 3 cubic s^2 is zero once; in this form also where cubic is 0.
            root = np.sqrt(np.maximum(0.0, curved**2 - 3.0 * cubic * r0))
            below = curved + np.where(r1 > r0, root, -root)
            s = np.divide(
                -r0, below, out=np.zeros_like(r0), where=below != 0.0
            )  # of rates that round to nothing
            self.widen_channel(i, times[j] + s * h, x[j] + h * s * (r0 + s * (curved + s * cubic)))

    def of_all(self) -> Array:
        """Return the extrema over all cycles, shape (channels, 4)."""
        values, at = self.values, np.arange(self.values.shape[1])
        lowest, highest = values[:, :, 0].argmin(0), values[:, :, 2].argmax(0)
        return np.column_stack([values[lowest, at, :2], values[highest, at, 2:]])

    def begun(self) -> NDArray[np.bool_]:
        """Return which cycles have any value, shape (cycles,)."""
        return np.asarray(np.isfinite(self.values[:, 0, 0]))

    def _cycle_of(self, time: float) -> int:
        return int(max(0.0, min(time // self._period, len(self.values) - 1.0)))
