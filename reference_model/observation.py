"""From recorded rows to channels: the whole press from a state, samples, extrema, pulses, worst values.

Rows (`reference_model.recording`) are taken as often as their buffer is full, and many at a time.
"""

import numpy as np
from numpy.typing import NDArray

from reference_model.chain import Chain, journal_centre, journal_reaction
from reference_model.channels import ACCELERATIONS, CORNER_CHANNELS, JOURNAL_CHANNELS, MOTION, Extrema
from reference_model.contact import CONTACTS, FRICTION, GAP, JOURNAL, NORMAL, STORED, TAIL, WORKS
from reference_model.energy import ENERGIES, balance, kinetic_energy
from reference_model.equations import Model
from reference_model.events import Run
from reference_model.laws import acts_on_sides
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
from reference_model.parameters import Parameters
from reference_model.reactions import REACTIONS, reactions
from reference_model.recording import (
    CLOSED,
    CONTACTS_FROM,
    CYCLE,
    DRIVING,
    EXTREMUM,
    FORCE,
    OPEN_DEPTH,
    PARTS,
    PULL,
    PURPOSE,
    SAMPLE,
    SLIDER_FROM,
    STATE_FROM,
    TIME,
)
from reference_model.results import begun_cycles
from reference_model.workpiece import load_force

_NOTES = 200_000
"""Forces that are noted of each contact, about; later ones have no pulse: a run of many cycles must fit."""


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


def needs_bodies(names: list[str]) -> bool:
    """Return whether the channels follow from the motion of all bodies."""
    return not set(names).isdisjoint((JOURNAL_CHANNELS[0], REACTIONS[0], ENERGIES[0]))


class Observation:
    """What is made of a run's rows.

    Parameters
    ----------
    model, p
        Formulation and parameters.
    names
        Channels to sample.
    run
        The run, before its first step.
    samples
        Their number.
    """

    def __init__(self, model: Model, p: Parameters, names: list[str], run: Run, samples: int) -> None:
        self._model, self._m, self._law, self._load = model, p.mechanism, p.law, p.load
        self._names, self._run = names, run
        self.samples = np.zeros((len(names), samples))
        """(names, n)."""
        self.sampled = 0
        self.extrema = Extrema(len(names), begun_cycles(p), p.period)
        self.drift: dict[str, float] | None = None
        """Largest violation of the constraints and when, m and m/s; None where there are none."""
        if isinstance(model, Linkage):
            self.drift = dict.fromkeys(("position", "position_time_s", "velocity", "velocity_time_s"), 0.0)
        self._forces: list[list[Array]] = [[] for _ in range(CONTACTS)]
        self._noted = [0] * CONTACTS
        self._last = np.empty((7, 0))
        self._start = self._bodies(np.zeros(1), run.nodes.y[:1].T)
        self._stored, self._flow = -1.0, float(kinetic_energy(self._m, self._start).sum())
        self._imbalance = (0.0, 0.0, -1)

    def take(self, rows: Array, accelerations: Array) -> None:
        """Take account of rows, shape (n, row), and of accelerations at parts of steps, shape (m, 4)."""
        if not len(rows):
            return
        rows = np.ascontiguousarray(rows.T)  # from here on an entry of all rows, not a row, lies together
        if self._stored < 0.0:
            self._stored = float(rows[CONTACTS_FROM + STORED :, 0][:CONTACTS].sum())
        self._widen_parts(accelerations)
        purpose, times = rows[PURPOSE].astype(np.int64), rows[TIME] + rows[CYCLE]
        values = self._channels(rows)
        # The run's end is a sample of its own, also where rounding puts the last one just before it.
        kept = values[:, (purpose & SAMPLE) > 0][:, : self.samples.shape[1] - self.sampled]
        self.samples[:, self.sampled : self.sampled + kept.shape[1]] = kept
        self.sampled += kept.shape[1]
        self._widen(purpose, times, values)
        noted = (purpose & EXTREMUM) > 0
        for k in range(CONTACTS):
            closed = noted & ((purpose & (CLOSED << k)) > 0)
            if self._noted[k] < _NOTES and closed.any():
                force = rows[CONTACTS_FROM + NORMAL + k, closed]
                if acts_on_sides(self._law) and k != JOURNAL:
                    force = force + rows[CONTACTS_FROM + NORMAL + (k + 2) % 4, closed]
                self._forces[k].append(np.stack([times[closed], force]))
                self._noted[k] += force.size
        self._note_energy()
        if isinstance(self._model, Linkage) and self.drift is not None:
            self._note_drift(self._model, self.drift, rows, times)

    def pulses(self, events: dict[str, Array], numbers: Array) -> dict[str, Array]:
        """Return the normal forces of the contacts at ends of steps and at peaks, by row of the event table.

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
                at = np.maximum(np.searchsorted(events["start"][mine], t, side="left") - 1, 0)
                # The contact at which the room for notes ended has only a part of its forces.
                whole = at < at[-1] if self._noted[k] >= _NOTES else np.ones(at.shape, np.bool_)
                row.append(mine[at[whole]])
                time.append(t[whole])
                force.append(f[whole])
        if not row:
            return {"row": np.empty(0, dtype=np.int64), "time": np.empty(0), "force": np.empty(0)}
        rows, times, forces = (np.concatenate(part) for part in (row, time, force))
        order = np.lexsort((times, rows))
        new = (np.diff(rows[order], prepend=-1) > 0) | (np.diff(times[order], prepend=-1.0) > 0.0)
        order = order[new]
        return {"row": rows[order], "time": times[order], "force": np.maximum(forces[order], 0.0)}

    def worst(self) -> dict[str, tuple[float, float, int]]:
        """Return what no correct run can show: the largest value, when (s), of which contact (-1: none)."""
        names = {"open-depth": OPEN_DEPTH, "force": FORCE, "pull": PULL, "driving-friction": DRIVING}
        rows = self._run.worst.tolist()
        worst = {name: (rows[i][0], rows[i][1], int(rows[i][2])) for name, i in names.items()}
        return worst | {"energy": self._imbalance}

    def _bodies(self, times: Array, y: Array, dy: Array | None = None) -> Array:
        return all_bodies(self._model, self._m, times, y, np.zeros_like(y) if dy is None else dy)

    def _energies(self, bodies: Array, stored: Array, works: Array) -> Array:
        driven = 3 if isinstance(self._model, Minimal) else 0
        return balance(self._m, self._load, bodies, self._start, stored.sum(0), self._stored, works, driven)

    def _channels(self, rows: Array) -> Array:
        """Return the wanted channels, shape (names, n)."""
        names = set(self._names)
        channels = dict(zip(MOTION + ACCELERATIONS, rows[SLIDER_FROM : SLIDER_FROM + 9], strict=True))
        contacts = rows[CONTACTS_FROM:STATE_FROM]
        if CORNER_CHANNELS[0] in names:
            for k in range(JOURNAL):
                what = contacts[GAP + k], np.maximum(contacts[NORMAL + k], 0.0), contacts[FRICTION + k]
                channels |= zip(CORNER_CHANNELS[3 * k : 3 * k + 3], what, strict=True)
        if needs_bodies(self._names):
            y, dy = np.split(rows[STATE_FROM:], 2)
            bodies = self._bodies(rows[TIME], y, dy)
            if JOURNAL_CHANNELS[0] in names:
                channels |= zip(JOURNAL_CHANNELS, journal_centre(self._m, bodies), strict=True)
            if REACTIONS[0] in names:
                channels |= zip(REACTIONS, self._reactions(bodies, contacts), strict=True)
            if ENERGIES[0] in names:
                energies = self._energies(bodies, contacts[STORED : STORED + CONTACTS], y[-WORKS:])
                channels |= zip(ENERGIES, energies, strict=True)
        return np.stack([channels[name] for name in self._names])

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
        Fy = contacts[FRICTION : FRICTION + JOURNAL].sum(0) + load_force(self._load, bodies[4, 1])
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
        if not len(accelerations) or ACCELERATIONS[0] not in self._names:
            return
        parts = np.ascontiguousarray(accelerations.T).reshape(4, -1, PARTS)
        times, parts, first = parts[0], parts[1:], self._names.index(ACCELERATIONS[0])
        h = (times[:, -1] - times[:, 0]) / (PARTS - 1)
        for values in (parts, -parts):
            middle = np.clip(values.argmax(2), 1, PARTS - 2)[:, :, None]
            before, top, after = (np.take_along_axis(parts, middle + by, 2)[:, :, 0] for by in (-1, 0, 1))
            rise, bend = 0.5 * (after - before), before - 2.0 * top + after
            inside = np.abs(rise) < np.abs(bend)
            by = np.divide(-rise, bend, out=np.zeros_like(rise), where=inside)
            when = np.take_along_axis(times[None], middle, 2)[:, :, 0] + by * h
            peak = top + 0.5 * rise * by
            for i in range(3):
                self.extrema.widen_channel(first + i, when[i, inside[i]], peak[i, inside[i]])

    def _note_energy(self) -> None:
        """Note the balance of energies now."""
        nodes, t = self._run.nodes, self._run.clock[:1]
        y, stored = nodes.y[:1].T, nodes.contacts[:1, STORED : STORED + CONTACTS].T
        energies = self._energies(self._bodies(t, y), stored, y[-WORKS:])[:, 0]
        # Where nothing is lost the balance is no more accurate than what flows through it.
        _, gravity, kinetic, _, pressed, damping, friction, residual = energies.tolist()
        self._flow = max(self._flow, damping + friction, kinetic, abs(gravity), pressed)
        share = abs(residual) / self._flow
        if not share <= self._imbalance[0]:
            self._imbalance = share, float(t[0] + self._run.clock[3]), -1

    def _note_drift(self, model: Linkage, drifted: dict[str, float], rows: Array, times: Array) -> None:
        violations = np.empty((2, times.size))
        drift(model, rows[TIME], np.split(rows[STATE_FROM:], 2)[0][:-TAIL], violations)
        for row, name in zip(violations, ("position", "velocity"), strict=True):
            if row.max() > drifted[name]:
                drifted[name], drifted[f"{name}_time_s"] = float(row.max()), float(times[row.argmax()])
