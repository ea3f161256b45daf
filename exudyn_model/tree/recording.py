"""What is kept of a run of a tree: samples, contacts and extrema of its accepted steps."""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.channels import CHANNELS, GAP, NORMAL, PER_CONTACT
from exudyn_model.compiled import direct
from exudyn_model.contact.foundation import other_end, shares_contact, speed_at_start
from exudyn_model.contact.memory import EVENT
from exudyn_model.contact.states import CONTACTS
from exudyn_model.model import Model
from exudyn_model.pulses import new_pulses, pulse_table
from exudyn_model.tables import cycle_extrema, event_table, new_extrema
from exudyn_model.tree.isolation import GAP_TOLERANCE
from exudyn_model.tree.motion import MOTION, contact_motion, has_clearance, state_at
from exudyn_model.tree.observation import WIDTH
from exudyn_model.tree.steps import POINTS, Kept, fill, record_start, take_step
from exudyn_model.tree.switching import close

_COUNT = len(CONTACTS)


class TreeRecorder:
    """Recorder of one run of a tree, which also judges its steps.

    Parameters
    ----------
    model : Model
        From ``slider_tree`` or ``rocker_tree``.
    sample_interval : float
        s.
    samples : int
        Besides the initial state.
    period : float
        Of the crank, s.
    least : float
        Shortest step that ends where a contact begins or ends, s.
    """

    def __init__(
        self, model: Model, sample_interval: float, samples: int, period: float, least: float
    ) -> None:
        self.steps = 0
        self.time = 0.0
        """Time of the last accepted state, s."""
        self._constants, self._contacts = model.constants, model.contacts
        self._start, self._end = np.zeros(1, MOTION), np.zeros(1, MOTION)
        extrema = new_extrema(WIDTH, period, samples * sample_interval / period)
        self._kept = Kept(
            np.zeros((POINTS + 1, WIDTH)), extrema, np.zeros((samples + 1, WIDTH)), new_pulses()
        )
        self._events = np.zeros(64, EVENT)
        self._event_count, self._sample_count = 0, 0
        fixed = self._constants, self._contacts, self._kept, sample_interval, least
        coordinates = np.zeros(2)
        step = self._start, self._end, 0.0, coordinates, coordinates
        self._take = partial(direct(take_step, *fixed, *step, self._events, 0, 0, False), *fixed)

    def begin(self, q: NDArray[np.float64], v: NDArray[np.float64]) -> None:
        """Take the initial state (see :meth:`judge`): what penetrates is in contact from t = 0."""
        linkage, law, pin_law = (record[0] for record in self._constants)
        start, first_sample = self._start[0], self._kept.samples[0]
        fill(start, 0.0, q, v, linkage)
        state = state_at(start, linkage)
        for number, contact in enumerate(self._contacts):
            if has_clearance(number, linkage):
                contact["gap"], contact["rate"] = contact_motion(number, state, linkage, law, pin_law)
        # The deeper corner of a side counts as the one that touched first
        for number in np.argsort(self._contacts["gap"], kind="stable"):
            gap, rate = (self._contacts[number][name] for name in ("gap", "rate"))
            if gap < -GAP_TOLERANCE or (gap <= GAP_TOLERANCE and rate < 0):
                close(int(number), self._contacts, 0.0, law)
                if shares_contact(int(number), law):
                    lower, upper = (self._contacts[k] for k in sorted((number, other_end(number))))
                    if self._contacts[number]["impact_speed"] > 0.0:
                        self._contacts[number]["impact_speed"] = speed_at_start(
                            lower["gap"], lower["rate"], upper["gap"], upper["rate"], law
                        )
        record_start(self._start, self._constants, self._contacts, self._kept)
        for number, contact in enumerate(self._contacts):
            row = PER_CONTACT * number
            normal, gap = first_sample[NORMAL + row], first_sample[GAP + row]
            if shares_contact(number, law):
                other = PER_CONTACT * other_end(number)
                normal, gap = normal + first_sample[NORMAL + other], min(gap, first_sample[GAP + other])
            contact["normal"] = contact["peak"] = normal
            contact["depth"] = max(-gap, 0.0)
        self._sample_count = 1

    def judge(self, time: float, q: NDArray[np.float64], v: NDArray[np.float64], last: bool) -> float:
        """Accept the step to this state, or return where in it a contact first begins or ends.

        Parameters
        ----------
        time : float
            s.
        q, v : ndarray
            Coordinates of the tree and their rates: see ``slider_tree`` and ``rocker_tree``.
        last : bool
            Whether the run ends here: samples up to 1e-10 s later are extrapolated.

        Returns
        -------
        fraction : float
            1 if the step is accepted, else the fraction of it after which a contact begins or ends; nan if
            the coordinates are not finite.
        """
        start, end, count = self._start, self._end, self._event_count
        if count + _COUNT > len(self._events):
            self._events = np.concatenate([self._events, np.zeros_like(self._events)])
        fraction, self._event_count, self._sample_count = self._take(
            start, end, time, q, v, self._events, count, self._sample_count, last
        )
        if fraction >= 1.0:
            self._start, self._end = end, start
            self.time = time
            self.steps += 1
        return fraction

    def columns(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return sampled channels by name, as far as the run came."""
        return {name: self._kept.samples[: self._sample_count, CHANNELS.index(name)].copy() for name in names}

    def cycle_extrema(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Return least and greatest value of each channel in each cycle, with their times in s."""
        return cycle_extrema(self._kept.extrema, CHANNELS, names)

    def events(self) -> dict[str, NDArray[Any]]:
        """Return the contacts sorted by start; one that lasts at the last accepted state ends there."""
        return event_table(self._events[: self._event_count], self._contacts, self.time)

    def pulses(self, events: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Return the normal forces of the corners' contacts in time; ``events`` is from :meth:`events`."""
        return pulse_table(self._kept.pulses, self._contacts, events)
