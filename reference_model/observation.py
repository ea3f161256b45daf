"""From recorded rows to channels: the whole press from a state, samples, extrema, pulses, worst values.

Rows (`reference_model.recording`) are taken as often as their buffer is full, and many at a time.
"""

import numpy as np
from numpy.typing import NDArray

from reference_model.chain import Chain, journal_centre, journal_reaction
from reference_model.channels import ACCELERATIONS, CORNER_CHANNELS, JOURNAL_CHANNELS, MOTION, Extrema
from reference_model.contact import CONTACTS, FRICTION, GAP, JOURNAL, NORMAL, RATE, SLIP, STORED, TAIL, WORKS
from reference_model.energy import ENERGIES, balance, kinetic_energy
from reference_model.equations import Model
from reference_model.linkage import (
    Array,
    Mechanism,
    bodies_from_rods,
    four_bar_rods,
    rod4_of_ideal_slider,
    turning,
)
from reference_model.minimal import Minimal
from reference_model.multiplier import Linkage, drift
from reference_model.parameters import FOUNDATION, Law
from reference_model.reactions import REACTIONS, reactions
from reference_model.recording import (
    CONTACTS_FROM,
    CYCLE,
    EXTREMUM,
    INSIDE_FROM,
    MEMORY_FROM,
    PARTS,
    PURPOSE,
    SAMPLE,
    SLIDER_FROM,
    STATE_FROM,
    STEP,
    TIME,
)


def all_bodies(model: Model, m: Mechanism, times: Array, y: Array, dy: Array) -> Array:
    """Return the motion of all bodies, shape (5, 9, n), from states and their derivatives, shape (size, n).

    `times` count from the start of a cycle, s.
    """
    n = (len(y) - TAIL) // 2
    q, v, a = y[:n], y[n : 2 * n], dy[n : 2 * n]
    if isinstance(model, Linkage):
        return np.concatenate([part.reshape(n // 3, 3, -1) for part in (q, v, a)], axis=1)
    turns = list(zip(q, v, a, strict=True))
    if isinstance(model, Minimal):
        rods = (*four_bar_rods(m, times), turning(*turns[0]))
        return bodies_from_rods(m, times, rods, turns[1])
    rod2, rocker = turning(*turns[0]), turning(*turns[1])
    if model.ideal_slider:
        return bodies_from_rods(m, times, (rod2, rocker, rod4_of_ideal_slider(m, rocker)), (0.0, 0.0, 0.0))
    return bodies_from_rods(m, times, (rod2, rocker, turning(*turns[2])), turns[3])


class Observation:
    """What is made of a run's rows.

    Parameters
    ----------
    model, m, law
        Formulation, mechanism, contacts.
    names
        Channels to sample.
    times
        Of the samples, s.
    cycles, period
        Begun crank cycles, and how long each takes, s.
    """

    def __init__(
        self, model: Model, m: Mechanism, law: Law, names: list[str], times: Array, cycles: int, period: float
    ) -> None:
        self._model, self._m, self._law, self._names = model, m, law, names
        self.samples = np.zeros((len(names), times.size))
        """(names, n)."""
        self.sampled = 0
        self.extrema = Extrema(len(names), cycles, period)
        self.drift: dict[str, float] | None = None
        """Largest violation of the constraints and when, m and m/s; None where there are none."""
        if isinstance(model, Linkage):
            self.drift = dict.fromkeys(("position", "position_time_s", "velocity", "velocity_time_s"), 0.0)
        self._forces: list[list[Array]] = [[] for _ in range(CONTACTS)]
        self.worst: dict[str, tuple[float, float, int]] = {}
        """Of what no correct run can show: the largest value, when (s), of which contact (-1: none)."""
        self._start, self._last = np.empty((0, 0)), np.empty((7, 0))
        self._flow = 0.0

    def take(self, rows: Array, accelerations: Array) -> None:
        """Take account of rows, shape (n, row), and of accelerations at parts of steps, shape (m, 4)."""
        if not len(rows):
            return
        rows = np.ascontiguousarray(rows.T)  # from here on an entry of all rows, not a row, lies together
        if not self._start.size:
            self._start = rows[:, :1].copy()
            self._flow = float(kinetic_energy(self._m, self._bodies(self._start)).sum())
        self._widen_parts(accelerations)
        purpose, times = rows[PURPOSE].astype(np.int64), rows[TIME] + rows[CYCLE]
        values = self._channels(rows)
        kept = values[:, (purpose & SAMPLE) > 0]
        self.samples[:, self.sampled : self.sampled + kept.shape[1]] = kept
        self.sampled += kept.shape[1]
        self._widen(purpose, times, values)
        self._note_worst(rows, purpose, times)
        for k in range(CONTACTS):
            closed = ((purpose & STEP) > 0) & (rows[MEMORY_FROM + k] > 0.0)
            force = rows[CONTACTS_FROM + NORMAL + k, closed]
            if self._law.law == FOUNDATION and k != JOURNAL:
                force = force + rows[CONTACTS_FROM + NORMAL + (k + 2) % 4, closed]
            self._forces[k].append(np.stack([times[closed], force]))
        if isinstance(self._model, Linkage) and self.drift is not None:
            self._note_drift(self._model, self.drift, rows, times)

    def pulses(self, events: dict[str, Array], numbers: Array) -> dict[str, Array]:
        """Return the normal forces of the contacts at the ends of steps, by row of the event table.

        Parameters
        ----------
        events
            The event table.
        numbers
            Of the contact in each of its rows.
        """
        row, time, force = [], [], []
        for k in range(CONTACTS):
            mine = np.flatnonzero(numbers == k)
            if self._forces[k] and mine.size:
                t, f = np.concatenate(self._forces[k], axis=1)
                at = np.searchsorted(events["start"][mine], t, side="left") - 1
                row.append(mine[np.maximum(at, 0)])
                time.append(t)
                force.append(f)
        if not row:
            return {"row": np.empty(0, dtype=np.int64), "time": np.empty(0), "force": np.empty(0)}
        rows, times, forces = (np.concatenate(part) for part in (row, time, force))
        order = np.lexsort((times, rows))
        return {"row": rows[order], "time": times[order], "force": np.maximum(forces[order], 0.0)}

    def _bodies(self, rows: Array) -> Array:
        y, dy = np.split(rows[STATE_FROM:], 2)
        return all_bodies(self._model, self._m, rows[TIME], y, dy)

    def _energies(self, rows: Array, bodies: Array) -> Array:
        works = np.split(rows[STATE_FROM:], 2)[0][-WORKS:]
        stored, at_start = (
            each[CONTACTS_FROM + STORED : CONTACTS_FROM + STORED + CONTACTS].sum(0)
            for each in (rows, self._start)
        )
        driven = 3 if isinstance(self._model, Minimal) else 0
        return balance(self._m, bodies, self._bodies(self._start), stored, float(at_start[0]), works, driven)

    def _channels(self, rows: Array) -> Array:
        """Return the wanted channels, shape (names, n)."""
        names, found = (
            set(self._names),
            dict(zip(MOTION + ACCELERATIONS, rows[SLIDER_FROM:CONTACTS_FROM], strict=True)),
        )
        contacts = rows[CONTACTS_FROM:INSIDE_FROM]
        if CORNER_CHANNELS[0] in names:
            for k in range(JOURNAL):
                what = contacts[GAP + k], np.maximum(contacts[NORMAL + k], 0.0), contacts[FRICTION + k]
                found |= zip(CORNER_CHANNELS[3 * k : 3 * k + 3], what, strict=True)
        if names & {JOURNAL_CHANNELS[0], REACTIONS[0], ENERGIES[0]}:
            bodies = self._bodies(rows)
            if JOURNAL_CHANNELS[0] in names:
                found |= zip(JOURNAL_CHANNELS, journal_centre(self._m, bodies), strict=True)
            if REACTIONS[0] in names:
                found |= zip(REACTIONS, self._reactions(bodies, contacts), strict=True)
            if ENERGIES[0] in names:
                found |= zip(ENERGIES, self._energies(rows, bodies), strict=True)
        return np.stack([found[name] for name in self._names])

    def _reactions(self, bodies: Array, contacts: Array) -> Array:
        model, journal, ideal = self._model, None, False
        if isinstance(model, Chain):
            ideal = model.ideal_slider
            journal = journal_reaction(
                self._m, self._law, bodies, contacts[NORMAL + JOURNAL], contacts[FRICTION + JOURNAL]
            )
        elif isinstance(model, Linkage):
            ideal = not model.clearance
        Fx = contacts[NORMAL] + contacts[NORMAL + 2] - contacts[NORMAL + 1] - contacts[NORMAL + 3]
        Fy = contacts[FRICTION : FRICTION + JOURNAL].sum(0)
        return reactions(self._m, bodies, Fx, Fy, ideal_slider=ideal, journal=journal)

    def _widen(self, purpose: NDArray[np.int64], times: Array, values: Array) -> None:
        """Widen the extrema by all rows that are for them, and by what lies between them."""
        chosen = (purpose & EXTREMUM) > 0
        if not chosen.all():
            times, values = times[chosen], values[:, chosen]
        self.extrema.widen(times, values)
        order = np.argsort(times, kind="stable")
        motion = np.concatenate([self._last, np.vstack([values[:6, order], times[order]])], axis=1)
        self.extrema.turn(motion[6], motion[:6])
        self._last = motion[:, -1:]

    def _widen_parts(self, accelerations: Array) -> None:
        """Widen the extrema of accelerations by parabolas through three of the `PARTS` of a step."""
        times, *parted = (column.reshape(-1, PARTS) for column in accelerations.T)
        steps, h = np.arange(len(times)), (times[:, -1] - times[:, 0]) / (PARTS - 1)
        for i, name in enumerate(ACCELERATIONS if len(times) and ACCELERATIONS[0] in self._names else ()):
            for sign in (1.0, -1.0):
                parts = sign * parted[i]
                middle = np.clip(parts.argmax(1), 1, PARTS - 2)
                before, top, after = (parts[steps, middle + by] for by in (-1, 0, 1))
                rise, bend = 0.5 * (after - before), before - 2.0 * top + after
                inside = np.abs(rise) < -bend
                by = -rise[inside] / bend[inside]
                peak = sign * (top[inside] + 0.5 * rise[inside] * by)
                when = times[steps, middle][inside] + by * h[inside]
                self.extrema.widen_channel(self._names.index(name), when, peak)

    def _note(self, name: str, value: Array, times: Array) -> None:
        """Note the largest of values (contacts, n); nan counts."""
        if value.size:
            contact, at = np.unravel_index(np.argmax(np.where(np.isnan(value), np.inf, value)), value.shape)
            worst, known = float(value[contact, at]), self.worst.get(name, (0.0, 0.0, -1))
            if not worst <= known[0]:
                self.worst[name] = worst, float(times[at]), int(contact)

    def _note_worst(self, rows: Array, purpose: NDArray[np.int64], times: Array) -> None:
        """Note what no correct run can show (`reference_model.invariants`)."""
        seen = (purpose & (STEP | SAMPLE)) > 0
        inside = rows[INSIDE_FROM : INSIDE_FROM + CONTACTS] > 0.0
        gap, _, slip, normal, friction = (
            rows[CONTACTS_FROM + part : CONTACTS_FROM + part + CONTACTS]
            for part in (GAP, RATE, SLIP, NORMAL, FRICTION)
        )
        self._note("open-depth", np.where(inside, 0.0, -gap)[:, seen], times[seen])
        steps = (purpose & STEP) > 0
        self._note("force", normal[:, steps], times[steps])
        self._note("pull", -normal[:, steps], times[steps])
        # Where the wall pulls its friction drives, too: that is the same violation.
        power = np.where(normal < 0.0, 0.0, friction * np.where(friction == 0.0, 0.0, slip))
        if self._law.law == FOUNDATION:  # of a side
            power[:2], power[2:4] = power[:2] + power[2:4], 0.0
        self._note("driving-friction", power[:, steps], times[steps])
        some = np.flatnonzero(steps)[-1:]
        if some.size:
            energies = self._energies(rows[:, some], self._bodies(rows[:, some]))[:, 0]
            # Where nothing is lost the balance is no more accurate than what flows through it.
            self._flow = max(self._flow, energies[4] + energies[5], energies[2], abs(energies[1]))
            self._note("energy", np.array([[abs(energies[6]) / self._flow]]), times[some])

    def _note_drift(self, model: Linkage, drifted: dict[str, float], rows: Array, times: Array) -> None:
        found = np.empty((2, times.size))
        states = np.split(rows[STATE_FROM:], 2)[0][:-TAIL]
        drift(model, times, states, found)
        for row, name in zip(found, ("position", "velocity"), strict=True):
            if row.max() > drifted[name]:
                drifted[name], drifted[f"{name}_time_s"] = float(row.max()), float(times[row.argmax()])
