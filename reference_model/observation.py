"""Compute from recorded rows the motion of all bodies, samples, extrema, pulses and worst values.

`Observation` takes many rows (`reference_model.recording`) at a time, whenever their buffer is full.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from reference_model.balance import ENERGIES, REACTIONS, energies, kinetic_energy, reactions
from reference_model.chain import Chain, journal_centre, journal_reaction
from reference_model.formulations import Model, all_bodies
from reference_model.linkage import Array
from reference_model.minimal import Minimal
from reference_model.multiplier import Linkage, drift
from reference_model.parameters import Contact, Parameters
from reference_model.recording import CLOSED, EXTREMUM, PART, PARTS, SAMPLE
from reference_model.results import (
    ACCELERATIONS,
    CORNER_CHANNELS,
    JOURNAL_CHANNELS,
    MOTION,
    Extrema,
    count_cycles,
)
from reference_model.state import WORKS, WORST, Records, Rows, Run
from reference_model.workpiece import load_force

_NOTES = 200_000
"""Approximate number of forces kept per contact, which bounds the memory; later contacts have no pulse."""


def motions(slider: Records) -> Array:
    """Return the slider's motion as an array, shape (9, n)."""
    return np.ascontiguousarray(slider.view(np.float64).reshape(-1, len(MOTION + ACCELERATIONS)).T)


class Pulses:
    """Normal forces of the contacts of a run at the ends of steps and at peaks."""

    def __init__(self, contacts: Sequence[Contact]) -> None:
        self._contacts = contacts
        self._forces: list[list[Array]] = [[] for _ in contacts]
        self._counts = [0] * len(contacts)

    def note(self, times: Array, purpose: NDArray[np.int64], touches: Records) -> None:
        """Add the rows for extrema in which a contact is closed, at times since t = 0 (s)."""
        mask = (purpose & EXTREMUM) > 0
        for k, contact in enumerate(self._contacts):
            closed = mask & ((purpose & (CLOSED << k)) > 0)
            if self._counts[k] < _NOTES and closed.any():
                force = touches["normal"][closed, k]
                if contact.one_side:
                    force = force + touches["normal"][closed, contact.other]
                self._forces[k].append(np.stack([times[closed], force]))
                self._counts[k] += force.size

    def table(self, events: dict[str, Array], numbers: Array) -> dict[str, Array]:
        """Return the normal forces of the contacts by row of the event table.

        `numbers` holds the number of the contact in each row.
        """
        row, time, force = [], [], []
        for k in range(len(self._contacts)):
            contact_rows = np.flatnonzero(numbers == k)
            if self._forces[k] and contact_rows.size:
                t, f = np.concatenate(self._forces[k], axis=1)
                at = np.maximum(np.searchsorted(events["start"][contact_rows], t, side="left") - 1, 0)
                # The last contact has only a part of its forces if the limit was reached in it.
                whole = at < at[-1] if self._counts[k] >= _NOTES else np.ones(at.shape, np.bool_)
                row.append(contact_rows[at[whole]])
                time.append(t[whole])
                force.append(f[whole])
        if not row:
            return {"row": np.empty(0, dtype=np.int64), "time": np.empty(0), "force": np.empty(0)}
        rows, times, forces = (np.concatenate(part) for part in (row, time, force))
        order = np.lexsort((times, rows))
        distinct = (np.diff(rows[order], prepend=-1) > 0) | (np.diff(times[order], prepend=-1.0) > 0.0)
        order = order[distinct]
        return {"row": rows[order], "time": times[order], "force": np.maximum(forces[order], 0.0)}


class Observation:
    """Samples of the channels `names`, extrema, pulses and worst values, from the rows of a run.

    `run` is the run before its first step, `samples` the number of samples.
    """

    def __init__(self, model: Model, p: Parameters, names: list[str], run: Run, samples: int) -> None:
        self._model, self._p, self._m, self._load = model, p, p.mechanism, p.load
        self._names, self._run, self._contacts = names, run, p.contacts
        self.samples = np.zeros((len(names), samples))
        """Shape (names, samples); the first `n_samples` of them are filled."""
        self.n_samples = 0
        self.extrema = Extrema(len(names), count_cycles(p), p.period)
        self.drift: dict[str, float] | None = None
        """Largest violation of the constraints (m, m/s) and its time (s); None without constraints."""
        if isinstance(model, Linkage):
            self.drift = dict.fromkeys(("position", "position_time_s", "velocity", "velocity_time_s"), 0.0)
        self.pulses = Pulses(p.contacts)
        self._last = np.empty((7, 0))
        self._start = self._bodies(np.zeros(1), run.nodes.y[:1].T)
        self._contact0, self._flow = -1.0, float(kinetic_energy(self._m, self._start).sum())
        self._imbalance = (0.0, 0.0, -1)

    def take(self, rows: Rows) -> None:
        """Add rows to samples, extrema, pulses and worst values."""
        if not rows.times.size:
            return
        if self._contact0 < 0.0:
            self._contact0 = float(rows.touches["stored"][0].sum())
        parts = (rows.purposes & PART) > 0
        if parts.any():
            self._widen_parts((rows.times + rows.cycles)[parts], rows.slider[parts])
            rows = Rows._make(each[~parts] for each in rows)
        purpose, times = rows.purposes, rows.times + rows.cycles
        values = self._channels(rows)
        # The end of the run is recorded as a sample, even if rounding puts another one just before it.
        samples = values[:, (purpose & SAMPLE) > 0][:, : self.samples.shape[1] - self.n_samples]
        self.samples[:, self.n_samples : self.n_samples + samples.shape[1]] = samples
        self.n_samples += samples.shape[1]
        self._widen(purpose, times, values)
        self.pulses.note(times, purpose, rows.touches)
        self._note_energy()
        if isinstance(self._model, Linkage) and self.drift is not None:
            self._note_drift(self._model, self.drift, rows, times)

    def worst(self) -> dict[str, tuple[float, float, int]]:
        """Return by name the worst violations: the largest value, its time (s), its contact (-1: none)."""
        return dict(zip(WORST, self._run.worst.tolist(), strict=True)) | {"energy": self._imbalance}

    def _bodies(self, times: Array, y: Array, dy: Array | None = None) -> Array:
        return all_bodies(self._model, self._m, times, y, np.zeros_like(y) if dy is None else dy)

    def _energies(self, bodies: Array, touches: Records, works: Array) -> Array:
        n_driven, contact = 3 if isinstance(self._model, Minimal) else 0, touches["stored"].T.sum(0)
        return energies(self._m, self._load, bodies, self._start, (contact, self._contact0), works, n_driven)

    def _channels(self, rows: Rows) -> Array:
        """Return the channels, shape (names, n)."""
        names, touches = set(self._names), rows.touches
        channels = dict(zip(MOTION + ACCELERATIONS, motions(rows.slider), strict=True))
        if CORNER_CHANNELS[0] in names:
            corners = np.stack([touches["gap"], np.maximum(touches["normal"], 0.0), touches["friction"]], 2)
            columns = corners[:, :4].reshape(-1, len(CORNER_CHANNELS)).T
            channels |= zip(CORNER_CHANNELS, columns, strict=True)
        if not names.isdisjoint((JOURNAL_CHANNELS[0], REACTIONS[0], ENERGIES[0])):
            y = np.ascontiguousarray(rows.y.T)
            bodies = self._bodies(rows.times, y, np.ascontiguousarray(rows.dy.T))
            if JOURNAL_CHANNELS[0] in names:
                channels |= zip(JOURNAL_CHANNELS, journal_centre(self._m, bodies), strict=True)
            if REACTIONS[0] in names:
                channels |= zip(REACTIONS, self._reactions(bodies, touches), strict=True)
            if ENERGIES[0] in names:
                channels |= zip(ENERGIES, self._energies(bodies, touches, y[-WORKS:]), strict=True)
        return np.stack([channels[name] for name in self._names])

    def _reactions(self, bodies: Array, touches: Records) -> Array:
        normal, friction, journal = touches["normal"].T, touches["friction"].T, None
        if isinstance(self._model, Chain):
            radius = self._contacts[-1].radius
            journal = journal_reaction(self._m, radius, bodies, normal[-1], friction[-1])
        Fx = Fy = np.zeros(len(touches))
        if not self._p.ideal_slider:
            Fx = normal[0] + normal[2] - normal[1] - normal[3]
            Fy = friction[:4].sum(0)
        Fy = Fy + load_force(self._load, bodies[4, 1])
        return reactions(self._m, bodies, Fx, Fy, ideal_slider=self._p.ideal_slider, journal=journal)

    def _widen(self, purpose: NDArray[np.int64], times: Array, values: Array) -> None:
        """Widen the extrema by the rows for them, and by the turning points between these."""
        mask = (purpose & EXTREMUM) > 0
        if not mask.all():
            times, values = times[mask], values[:, mask]
        self.extrema.widen(times, values)
        order = np.argsort(times, kind="stable")
        motion = np.concatenate([self._last, np.vstack([values[:6, order], times[order]])], axis=1)
        self.extrema.turn(motion[6], motion[:6])
        self._last = motion[:, -1:]

    def _widen_parts(self, times: Array, slider: Records) -> None:
        """Widen the extrema of accelerations by parabolas through three of the `PARTS` of a step."""
        if ACCELERATIONS[0] not in self._names:
            return
        times = times.reshape(-1, PARTS)
        parts, first = motions(slider)[6:].reshape(3, -1, PARTS), self._names.index(ACCELERATIONS[0])
        for i, values in enumerate(parts):
            self.extrema.widen_between(first + i, times, values)

    def _note_energy(self) -> None:
        """Update the largest imbalance of energies from the present state."""
        nodes, clock = self._run.nodes, self._run.clock
        y = nodes.y[:1].T
        balance = self._energies(self._bodies(clock["time"], y), nodes.touches[:1], y[-WORKS:])[:, 0]
        # Without losses the accuracy of the balance is that of the energies that flow through it.
        _, gravity, kinetic, _, load, damping, friction, residual = balance.tolist()
        self._flow = max(self._flow, damping + friction, kinetic, abs(gravity), load)
        share = abs(residual) / self._flow
        if not share <= self._imbalance[0]:
            self._imbalance = share, float((clock["time"] + clock["cycle"])[0]), -1

    def _note_drift(self, model: Linkage, largest: dict[str, float], rows: Rows, times: Array) -> None:
        violations = np.empty((2, times.size))
        drift(model, rows.times, rows.y, violations)
        for row, name in zip(violations, ("position", "velocity"), strict=True):
            if row.max() > largest[name]:
                largest[name], largest[f"{name}_time_s"] = float(row.max()), float(times[row.argmax()])
