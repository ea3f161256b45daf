"""What is kept of a run: samples, contacts and extrema, gathered step by step from accepted states."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.accelerations import linkage_record, slider_acceleration
from exudyn_model.compiled import kernel
from exudyn_model.contact import CORNERS
from exudyn_model.contact_memory import EVENT, renew_corners, write_event
from exudyn_model.parameters import Mechanism

STATE = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
CORNER_CHANNELS = tuple(
    f"corner_{corner}_{part}" for corner in CORNERS for part in ("gap", "normal", "friction")
)
_CHANNELS = STATE + ACCELERATIONS + CORNER_CHANNELS

_EXTREMA = np.dtype([(name, np.float64) for name in ("min", "time_of_min", "max", "time_of_max")])


@kernel
def _observe(
    index: int,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    corners: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
    values: NDArray[np.float64],
    extrema: NDArray[np.void],
) -> int:
    """Renew the corners' memory, fill ``values`` with all channels and widen ``extrema``; the event count."""
    constants = linkage[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    if not constants.ideal_slider:
        event_count, fx, fy, moment = renew_corners(index, q[12:], v[12:], law, corners, events, event_count)
    values[0], values[1], values[2] = constants.guide_x + q[12], q[13], q[14]
    values[3], values[4], values[5] = v[12], v[13], v[14]
    values[6], values[7], values[8] = slider_acceleration(q, v, fx, fy, moment, constants)
    for number in range(4):
        values[9 + 3 * number] = corners[number].gap
        values[10 + 3 * number] = corners[number].normal
        values[11 + 3 * number] = corners[number].friction
    time = index * law[0].step
    for channel in range(len(values)):
        if values[channel] < extrema[channel].min:
            extrema[channel].min = values[channel]
            extrema[channel].time_of_min = time
        if values[channel] > extrema[channel].max:
            extrema[channel].max = values[channel]
            extrema[channel].time_of_max = time
    return event_count


class Recorder:
    """Gathers the results of one run.

    :meth:`accept` must see each accepted state once, the initial one included, before the step that starts
    from it: it also renews the corners' memory, which the contact force of that step reads.

    Parameters
    ----------
    mechanism : Mechanism
    law, corners : ndarray
        From ``contact``.
    steps_per_sample, samples : int
        Every ``steps_per_sample``-th state is a sample; ``samples`` of them besides the initial state.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        law: NDArray[np.void],
        corners: NDArray[np.void],
        steps_per_sample: int,
        samples: int,
    ) -> None:
        self.accepted = 0
        self._linkage = linkage_record(mechanism)
        self._law, self._corners = law, corners
        self._steps_per_sample = steps_per_sample
        self._values = np.zeros(len(_CHANNELS))
        self._samples = np.zeros((samples + 1, len(_CHANNELS)))
        self._extrema = np.zeros(len(_CHANNELS), _EXTREMA)
        self._extrema["min"], self._extrema["max"] = np.inf, -np.inf
        self._events = np.zeros(0, EVENT)
        self._event_count = 0

    def accept(self, q: NDArray[np.float64], v: NDArray[np.float64]) -> bool:
        """Take the next state: ``q``, ``v`` of shape (15,), the slider's x from the guide's centre line.

        Returns
        -------
        bool
            Whether this state is a sample.
        """
        is_sample = self.accepted % self._steps_per_sample == 0
        if is_sample:
            # Each corner ends at most one contact a step: this lasts until the next sample
            needed = self._event_count + 4 * self._steps_per_sample
            if needed > len(self._events):
                self._events = np.concatenate([self._events, np.zeros(needed, EVENT)])
        self._event_count = _observe(
            self.accepted,
            q,
            v,
            self._linkage,
            self._law,
            self._corners,
            self._events,
            self._event_count,
            self._values,
            self._extrema,
        )
        if is_sample:
            self._samples[self.accepted // self._steps_per_sample] = self._values
        self.accepted += 1
        return is_sample

    def is_finite(self) -> bool:
        """Whether the last accepted state holds no infinity and no NaN."""
        return bool(np.all(np.isfinite(self._values)))

    def columns(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return sampled channels by name, as far as the run came."""
        count = (self.accepted - 1) // self._steps_per_sample + 1
        return {name: self._samples[:count, _CHANNELS.index(name)].copy() for name in names}

    def extrema(self, names: tuple[str, ...]) -> dict[str, dict[str, float]]:
        """Least and greatest value of each channel over all accepted states, with their times in s."""
        return {
            name: {part: float(self._extrema[_CHANNELS.index(name)][part]) for part in _EXTREMA.names or ()}
            for name in names
        }

    def events(self) -> dict[str, NDArray[Any]]:
        """Contacts sorted by start; one that lasts at the last accepted state ends there."""
        table = self._events[: self._event_count + 4].copy()
        count = self._event_count
        now = (self.accepted - 1) * float(self._law[0]["step"])
        for number in range(4):
            if self._corners[number]["impact_speed"] > 0:
                write_event(table[count], number, self._corners[number], now)
                count += 1
        table = table[:count]
        table = table[np.lexsort((table["corner"], table["start"]))]
        columns: dict[str, NDArray[Any]] = {"corner": np.array(CORNERS)[table["corner"]]}
        return columns | {name: table[name].copy() for name in EVENT.names or () if name != "corner"}
