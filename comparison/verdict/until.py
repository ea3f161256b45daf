"""Times that a longer run does not change: the end of what is predictable, the start of a difference.

At a time t they use the samples up to t, those of the window of u(t) after it, and the first `FIRST`, which
show the size of a motion and its pace. So the samples whose window exceeds the run are withheld, unless its
end is stated, as that of a scene is, or none would be left.
"""

from collections.abc import Iterable

import numpy as np

from comparison.accuracy.levels import Thresholds
from comparison.accuracy.uncertainty import FIRST, windows
from comparison.tables.channels import Array, BoolArray, Channel
from comparison.tables.units import parse_unit, same_dimension

_TURN = 0.01  # of the range, by which a curve returns where it turns: less is noise
_DERIVED = ("N", "N m", "m/s^2", "rad/s^2", "J")


def is_state(channel: Channel) -> bool:
    """Return whether a channel is a state: a position, an angle, a velocity, or of another domain."""
    if channel.group == "contacts":
        return channel.unit == "m"
    if channel.group != "own":
        return channel.group in ("motion", "crank")
    unit = parse_unit(channel.unit)
    return unit is None or not any(same_dimension(unit, parse_unit(other)) for other in _DERIVED)


def pace(time: Array, curves: Iterable[Array]) -> float:
    """Return the median time between turning points of the first samples of all curves, s.

    Where these do not turn twice it is their span.
    """
    from scipy.signal import find_peaks  # a third of the time to import all this

    time, intervals = time[:FIRST], [np.empty(0)]
    for values in (curve[:FIRST] for curve in curves):
        prominence = _TURN * float(np.ptp(values))
        if prominence > 0.0:
            turns = [find_peaks(sign * values, prominence=prominence)[0] for sign in (1.0, -1.0)]
            intervals.append(np.diff(time[np.sort(np.concatenate(turns))]))
    durations = np.concatenate(intervals)
    return float(np.median(durations) if durations.size else time[-1] - time[0])


def settled_count(time: Array, window: float) -> int:
    """Return the number of first samples whose window (s) does not exceed the run; that of all if none."""
    return int((windows(time, window)[1] < time.size).sum()) or time.size


def until(time: Array, predictable: BoolArray, window: float) -> tuple[float, int]:
    """Return the time up to which a channel is predictable, s, and the number of shorter gaps before.

    ``predictable`` has the first samples, `settled_count` of them. A gap ends the time if it is longer than
    the window, without what the window adds at its ends, as to a single sample. Without such a gap the time
    is the end of the run; it is the start if nothing is predictable.
    """
    if not predictable.any():
        return float(time[0]), 0
    edges = np.diff(np.append(predictable, True).astype(np.int8), prepend=1)
    starts, stops = np.flatnonzero(edges < 0), np.flatnonzero(edges > 0) - 1
    later = starts > predictable.argmax()
    starts, stops = starts[later], stops[later]
    first, last = windows(time, window)
    long = time[first[stops]] - time[np.minimum(last[starts], time.size - 1)] > window
    count = int(long.argmax()) if long.any() else long.size
    return float(time[starts[count]] if long.any() else time[-1]), count


def has_coverage(predictable: BoolArray, limits: Thresholds) -> BoolArray:
    """Return where the share of predictable samples up to each is the required coverage, shape (n,)."""
    return np.asarray(np.cumsum(predictable) / np.arange(1, predictable.size + 1) >= limits.coverage)


def enough(predictable: BoolArray, nonzero: BoolArray, limits: Thresholds) -> BoolArray:
    """Return where the samples up to each are enough to judge a channel by its own thresholds, shape (n,)."""
    return has_coverage(predictable, limits) & (np.cumsum(predictable & nonzero) >= limits.least_judged)


def differs(predictable: BoolArray, nonzero: BoolArray, beyond: BoolArray, limits: Thresholds) -> BoolArray:
    """Return where a channel differs by the samples up to each, shape (n,).

    More than a share of the judged ones are outside, and `least_outside` at least. Where too few samples are
    predictable, it must be more than that share even with all others explained.
    """
    counts, outside = np.cumsum(predictable & nonzero), np.cumsum(beyond)
    totals = np.maximum(np.where(has_coverage(predictable, limits), counts, np.cumsum(nonzero)), 1)
    return np.asarray((outside >= limits.least_outside) & ((totals - outside) / totals < limits.share))
