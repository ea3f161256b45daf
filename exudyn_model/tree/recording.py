"""Recorder of a run of a tree: accepted steps are collected, and observed many at a time.

No contact begins or ends inside an accepted step: quintic Hermite polynomials interpolate its angles, at the
samples' times and at ``_POINTS`` for extrema, impulses and peaks. All channels follow from such a state by
balance of forces.
"""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import CORNER_COUNT, CORNERS, ROUNDED, ROUNDED_SPEED, UPPER, start_side
from exudyn_model.kernels import machine_code
from exudyn_model.laws import CornerMotion
from exudyn_model.parameters import Parameters
from exudyn_model.run import BATCH, TABLE_FIELDS, Recorder
from exudyn_model.tables import ACCELERATIONS, CONTACT, JOURNAL, PER_CONTACT, PIN, STATE, corner_channels
from exudyn_model.tree.building import Tree
from exudyn_model.tree.motion import CONTACTS, DISTANCE, END, HEIGHT_ROW, PIN_ROW, VALUES, WIDTH
from exudyn_model.tree.steps import STEP, Workspace, judge_step, observe

Array = NDArray[np.float64]

NAMES = (*CORNERS, PIN)
CHANNELS = (*STATE, *ACCELERATIONS, *corner_channels(NAMES), *JOURNAL)
# Fractions of a step: Simpson's rule and the extrema's parabolas take the intervals in pairs
_POINTS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
_SIMPSON = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 12.0
# Channels without kinks: motion and accelerations of the slider, and e of the journal
_SMOOTH = np.array([*range(CONTACT), len(CHANNELS) - 2, len(CHANNELS) - 1])
# Up to this many steps, the pulse of a contact needs forces inside of them: loose tolerances take 6 steps
_SHORT_CONTACT = 20


def _largest(values: Array) -> Array:
    """Return the largest value within each step, by parabolas through three of its points, shape (n,)."""
    largest: Array = values.max(axis=1)
    for middle in (1, 2, 3):
        before, centre, after = values[:, middle - 1], values[:, middle], values[:, middle + 1]
        rise, curvature = 0.5 * (after - before), before - 2.0 * centre + after
        tops = np.abs(rise) < -curvature
        largest[tops] = np.maximum(largest[tops], centre[tops] - 0.5 * rise[tops] ** 2 / curvature[tops])
    return largest


class TreeRecorder(Recorder):
    """Recorder of one run of a tree, which also accepts or rejects its steps.

    Parameters
    ----------
    tree : Tree
    parameters : Parameters
    least : float
        Shortest step that ends where a contact begins or ends, s.

    Attributes
    ----------
    steps : int
        Number of accepted steps so far.
    """

    def __init__(self, tree: Tree, parameters: Parameters, least: float) -> None:
        period, duration = parameters.mechanism.period, parameters.duration
        super().__init__(CHANNELS, NAMES, bool(tree.press.guide.shared), parameters.samples, period, duration)
        self.steps = 0
        self._tree, self._interval, self._last_sample = tree, parameters.sample_interval, parameters.samples
        log, vector = np.zeros(BATCH, STEP), np.zeros(2)
        self._count, self._log = 0, log

        def workspace() -> Workspace:
            distances = np.zeros((2, HEIGHT_ROW + 1), DISTANCE)
            return Workspace(least, np.zeros(2, END), distances, np.zeros(1, VALUES), np.zeros((2, 6)), log)

        self._workspace = workspace()
        self._fixed = *tree.kernel_arrays, self._workspace
        self._judge_step = machine_code(judge_step, 0.0, vector, vector, 0, *self._fixed)
        self._inside = tree.press_record, tree.workpiece, tree.contacts.copy(), workspace()
        points = np.zeros(1, dtype=np.int64), vector
        self._observe = machine_code(observe, *points, *self._inside, np.zeros(1, VALUES))

    def begin(self, q: Array, v: Array) -> None:
        """Take the initial state: a corner inside its wall is in contact from t = 0."""
        for _ in range(2):  # distances first; then accelerations, with the contacts that follow
            self._judge_step(0.0, q, v, -1, *self._fixed)
            self._start_contacts()

    def _start_contacts(self) -> None:
        tree, distances = self._tree, self._workspace.distances[0, :CONTACTS]
        gaps, rates, contacts = distances["value"], distances["rate"], tree.contacts
        if contacts["closed"].any():
            return
        contacts["rate"] = rates
        closed = (gaps < -ROUNDED) | ((gaps <= ROUNDED) & (rates < -ROUNDED_SPEED))
        if tree.press.has_guide:
            corners = [CornerMotion(gaps[k], rates[k], 0.0, 0.0, 0.0) for k in range(CORNER_COUNT)]
            for side in range(UPPER):
                start_side(side, corners[side], corners[side + UPPER], contacts, tree.press.guide)
            contacts["closed"][:CORNER_COUNT] = closed[:CORNER_COUNT]

    def judge_step(self, time: float, q: Array, v: Array) -> float:
        """Accept the step to a state, or return a fraction below 1 or nan: see ``steps.judge_step``.

        ``time`` in s; ``q``, ``v``: coordinates of the tree (rad) and their rates (see ``building``).
        """
        if self._count == BATCH:  # before a step: the last one waits for the samples at its end
            self.observe()
        fraction = self._judge_step(time, q, v, self._count, *self._fixed)
        if fraction >= 1.0:
            self.time = time
            self.steps += 1
            self._count += 1
        return fraction

    def observe(self, last: bool = False) -> None:
        """Observe the logged steps; after the ``last`` one take also samples up to 1e-10 s later."""
        count, self._count = self._count, 0
        if last:  # also a contact that begins in the last state
            contacts = self._tree.contacts
            for row in np.flatnonzero(contacts["impact_speed"]):
                contact = np.array([contacts[name][row] for name in TABLE_FIELDS])
                self.contacts.take(int(row), contact[:, None], np.full(1, np.inf), *np.zeros((3, 1)))
        if not count:
            if self.steps == 0:
                self._observe_start()
            return
        steps = self._log[:count]
        starts, ends = steps["first"]["time"].copy(), steps["last"]["time"].copy()
        values = self._at_points(count)
        times = (starts[:, None] + _POINTS * (ends - starts)[:, None]).ravel()
        self.extrema.take(times, values[: len(CHANNELS)])
        self._take_vertices(starts, ends - starts, values)
        memory = np.array([steps[name].T for name in (*TABLE_FIELDS, "end")]).swapaxes(0, 1)
        self._take_contacts(starts, ends - starts, values, memory)
        self._watch(times, values, np.repeat(memory[:, :3], len(_POINTS), axis=2))
        until = ends[-1] + 1e-10 if last else np.nextafter(ends[-1], 0.0)
        number = min(int(until / self._interval * (1 + 1e-15)), self._last_sample)
        instants = np.arange(self._sample_count, number + 1) * self._interval
        instants = instants[instants <= until]
        at = np.clip(np.searchsorted(starts, instants, side="right") - 1, 0, count - 1)
        self.take_samples(self._values(at, (instants - starts[at]) / (ends - starts)[at]))

    def _observe_start(self) -> None:
        """Observe the initial state of a run that has no step."""
        step, start = self._log[:1], self._workspace.ends[0]
        step["first"], step["last"] = start, start
        step["last"]["time"] = 1.0  # any time other than the start: `interpolate` divides by the length
        step["impact_speed"] = self._tree.contacts["impact_speed"]
        values = self._values(np.zeros(1, dtype=np.int64), np.zeros(1))
        self.take_samples(values)
        self.extrema.take(np.zeros(1), values[: len(CHANNELS)])

    def _at_points(self, count: int) -> Array:
        """Return all values at ``_POINTS`` of each step, shape (``WIDTH``, steps times points)."""
        n_later, points = len(_POINTS) - 1, np.empty((WIDTH, count, len(_POINTS)))
        inner = self._values(np.repeat(np.arange(count), n_later), np.tile(_POINTS[1:], count))
        points[..., 1:] = inner.reshape(WIDTH, count, n_later)
        # A step starts in the state that ends the one before, unless a contact begins or ends in between
        points[:, 1:, 0] = points[:, :-1, -1]
        speeds = self._log["impact_speed"][:count]
        switches = np.append(0, np.flatnonzero((speeds[1:] != speeds[:-1]).any(axis=1)) + 1)
        points[:, switches, 0] = self._values(switches, np.zeros(len(switches)))
        return points.reshape(WIDTH, -1)

    def _values(self, number: NDArray[np.int64], fraction: Array) -> Array:
        """Return all values of states at fractions of the steps of these numbers, shape (``WIDTH``, n)."""
        values = np.zeros(len(number), VALUES)
        self._observe(number, fraction, *self._inside, values)
        return values.view(np.float64).reshape(-1, WIDTH).T.copy()

    def _take_vertices(self, starts: Array, steps: Array, values: Array) -> None:
        """Take the vertices of the parabolas of the ``_SMOOTH`` channels through three points of a step."""
        smooth = values[_SMOOTH]
        motion, interval = smooth.reshape(len(smooth), len(steps), len(_POINTS)), 0.25 * steps
        for middle in (1, 3):
            before, centre, after = motion[..., middle - 1], motion[..., middle], motion[..., middle + 1]
            rise, curvature = 0.5 * (after - before), after - 2.0 * centre + before
            with np.errstate(divide="ignore", invalid="ignore"):
                shift = np.where(np.abs(rise) < np.abs(curvature), rise / curvature, np.inf)
                vertices = centre - 0.5 * shift * rise
                self.extrema.take_inside(_SMOOTH, starts + (middle - shift) * interval, vertices)

    def _take_contacts(self, starts: Array, steps: Array, values: Array, memory: Array) -> None:
        """Take pulses, peaks and depths of the contacts, and impulses by Simpson's rule."""
        count, points, contacts = len(starts), len(_POINTS), _contacts(values)
        for row in range(CONTACTS):
            contact_starts = memory[row, 1]
            closed = memory[row, 0] > 0.0
            if not closed.any():
                continue
            normal, depth = contacts[row, 1], -contacts[row, 0]
            if self.contacts.shared and row < UPPER:  # the contact of a side
                other = contacts[row + UPPER]
                normal, depth = normal + other[1], np.maximum(depth, -other[0])
            normal, depth = normal.reshape(count, points), depth.reshape(count, points)
            impulse = steps * (normal @ _SIMPSON)
            increments = memory[row, 3], impulse, _largest(normal), _largest(depth)
            self.contacts.take(row, memory[row, :3, closed].T, *(one[closed] for one in increments))
            mask = np.zeros((count, points), dtype=bool)
            mask[:, -1] = closed
            mask[:, 1:-1] = (closed & (starts - contact_starts < _SHORT_CONTACT * steps))[:, None]
            mask[:, 0] = closed & (contact_starts == starts)
            times = starts[:, None] + _POINTS * steps[:, None]
            self.contacts.take_pulse(row, times[mask], normal[mask])

    def _watch(self, times: Array, values: Array, memory: Array) -> None:
        press, forces = self._tree.press, _contacts(values)[:, 1:]
        mechanism = press.mechanism
        if press.has_guide:
            motion = values[[0, 2, 3, 4, 5]]
            motion[0] -= mechanism.guide_x
            corners = slice(0, CORNER_COUNT)
            self.watch.take_slider(0, times, motion, forces[corners], memory[corners], press.guide)
        if press.has_journal:
            # From the crank's tip back over rod 2 and rocker to H, as complex numbers
            (theta2, theta3, w2, w3), w1 = values[len(CHANNELS) :], mechanism.omega
            arm1 = mechanism.crank.length * np.exp(1j * (mechanism.crank_angle + w1 * times))
            arm2 = mechanism.rod2.length * np.exp(1j * theta2)
            arm3 = mechanism.rocker.centroid * np.exp(1j * theta3)
            vector = arm1 + arm2 - arm3 - complex(mechanism.pivot_x, mechanism.pivot_y)
            rate = 1j * (w1 * arm1 + w2 * arm2 - w3 * arm3)
            motion = np.array([vector.real, vector.imag, rate.real, rate.imag, np.full(len(times), w1), w2])
            self.watch.take_journal(PIN_ROW, times, motion, forces[PIN_ROW], memory[PIN_ROW], press.journal)


def _contacts(values: Array) -> Array:
    """Return gap, normal force and friction of each contact, shape (contacts, 3, n)."""
    return values[CONTACT : CONTACT + PER_CONTACT * CONTACTS].reshape(CONTACTS, PER_CONTACT, -1)
