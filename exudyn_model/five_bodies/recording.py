"""Recorder of a run of five bodies: accepted states are collected, and observed many at a time."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import CORNER_COUNT, FIELDS, UPPER
from exudyn_model.five_bodies.balance import Constraints, accelerations, constraints
from exudyn_model.five_bodies.contact import ANGLE, FRAME, PER_BODY, Y
from exudyn_model.five_bodies.journal_contact import JournalElement
from exudyn_model.five_bodies.settings import Settings, StepChoice
from exudyn_model.five_bodies.slider_contact import SliderElement
from exudyn_model.five_bodies.system import Model
from exudyn_model.run import BATCH, TABLE_FIELDS, Recorder
from exudyn_model.tables import (
    ACCELERATION,
    ACCELERATIONS,
    CONTACT,
    JOURNAL,
    MOTION,
    PER_CONTACT,
    STATE,
    TO_RATE,
    corner_channels,
    energy_channels,
    turning_points,
)
from exudyn_model.workpiece import workpiece_forces

Array = NDArray[np.float64]

# Field of a `clearances.Memory` to its values, shape (contacts, states)
Memory = dict[str, Array]

CONSTRAINTS = ("position", "velocity")


class BodiesRecorder(Recorder):
    """Recorder of one run of five bodies.

    :meth:`accept` must be called once for each accepted state, the initial one included, before the step that
    starts from it: it also updates the contacts' memory, which the contact force of that step reads.

    Parameters
    ----------
    model : Model
    choice : StepChoice
        Contains the time of the state to accept.
    settings : Settings

    Attributes
    ----------
    state_count : int
        Number of accepted states so far.
    drift : dict
        Largest violation so far of each of ``CONSTRAINTS`` (m, rad; m/s, rad/s), and its time (s).
    """

    def __init__(
        self, model: Model, choice: StepChoice, settings: Settings, channels: tuple[str, ...] = ()
    ) -> None:
        system, names = model.system, model.system.contact_names
        journals = [f"{name}{n or ''}" for n in range(len(system.journals)) for name in JOURNAL]
        loads = [f"reaction_{journal.name}_{axis}" for journal in system.journals for axis in "xy"]
        channels = channels or (
            *STATE, *ACCELERATIONS, *corner_channels(names), *journals, *system.multipliers, *loads,
            *(energy_channels(system.load is not None) if settings.energy else ()),
        )  # fmt: skip
        shared = any(element.law.shared for element in model.elements)
        super().__init__(channels, names, shared, settings.samples, settings.period, settings.duration)
        self.state_count, self.drift = 0, dict.fromkeys(CONSTRAINTS, (0.0, 0.0))
        # Rows of coordinates and velocities with extrema in long steps; TO_RATE further are their rates
        self._moving = np.arange(MOTION.start, MOTION.stop)
        self._model, self._choice, self._settings = model, choice, settings
        # Columns of a state: time and tick, coordinates, rates, multipliers, memory, loads of the contacts
        bodies = PER_BODY * len(system.bodies)
        sizes = [2, bodies, bodies, len(system.multipliers), model.contacts.view(float).size]
        sizes += [len(element.load) for element in model.elements]
        ends = np.cumsum([0, *sizes])
        self._log = np.zeros((BATCH, ends[-1]))
        self._columns = [slice(*pair) for pair in pairwise(ends)]
        self._count = 0
        self._stamp = np.zeros(2)
        self._vectors: tuple[Array, ...] = ()
        # Works of drive, damping and friction up to the last state; energies of height and stored at t = 0
        self._works, self._initial = np.zeros(3), (0.0, 0.0)

    def begin(self, q: Array, v: Array, multipliers: Array) -> None:
        """Read all further states from Exudyn's own vectors, which it fills anew in every step.

        To ask Exudyn for its vectors takes longer than to read them.

        Parameters
        ----------
        q, v : ndarray, shape (3 n,)
            Coordinates and their rates.
        multipliers : ndarray
            Those of Exudyn's constraints, in the order of ``System.multipliers``.
        """
        elements = self._model.elements
        loads = [element.load for element in elements]
        self._vectors = self._stamp, q, v, multipliers, self._model.contacts.view(float), *loads
        for element in elements:
            element.attach(q, v)
            element.start()

    def accept(self) -> float:
        """Take the next state; return the most ticks of the next step."""
        choice = self._choice
        time, longest = choice.time, choice.limit
        for element in self._model.elements:
            longest = element.follow(time, longest)
        self._log_state()
        return longest

    def _log_state(self) -> None:
        """Log the next state."""
        stamp = self._stamp
        stamp[0], stamp[1] = self._choice.time, self._choice.end_tick
        np.concatenate(self._vectors, out=self._log[self._count])
        self._count += 1
        self.state_count += 1
        if self._count == BATCH:
            self.observe()

    def observe(self) -> None:
        """Observe the logged states; the last one remains, as the first of the next batch.

        The numbers of a run that diverges overflow.
        """
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            self._observe()

    def _observe(self) -> None:
        new = min(self._count - 1, 1) if self.state_count > self._count else 0
        if self._count <= new:
            return
        log = [self._log[: self._count, columns].T.copy() for columns in self._columns]
        (times, ticks), q, v, multipliers, numbers = log[:5]
        numbers = numbers.reshape(-1, len(FIELDS), len(times))
        memory = {name: numbers[:, k] for k, name in enumerate(FIELDS)}
        instants = np.flatnonzero(ticks % self._settings.per_state == 0)
        values = self._values(times, q, v, multipliers, memory, log[5:], instants)
        self.extrema.take(times[new:], values[:, new:])
        self._take_turning_points(times, ticks, values)
        self._take_contacts(times, memory, new)
        for element in self._model.elements:
            forces, touches = (
                np.stack([memory[name][element.rows] for name in names], axis=1)
                for names in (("normal", "friction"), TABLE_FIELDS)
            )
            element.watch(self.watch, times, q, v, forces, touches)
        self._take_samples(times, ticks, values)
        self._log[0] = self._log[self._count - 1]
        self._count, self.time = 1, float(times[-1])

    def _values(
        self,
        times: Array,
        q: Array,
        v: Array,
        multipliers: Array,
        memory: Memory,
        loads: list[Array],
        instants: NDArray[Any],
    ) -> Array:
        """Return all channels, shape (channels, n)."""
        system, elements = self._model.system, self._model.elements
        force = np.zeros_like(q)
        force[Y::PER_BODY] = -system.gravity * system.masses[Y::PER_BODY, None]
        load_energy = self._add_loads(force, q, loads)
        joints = constraints(system, times, q, v)
        self._take_drift(times, instants, joints)
        acceleration, _ = accelerations(system, joints, force)
        values = np.empty((len(self.channels), len(times)))
        part = slice(PER_BODY * system.observed, PER_BODY * (system.observed + 1))
        values[MOTION][:PER_BODY], values[MOTION][PER_BODY:] = q[part] + system.reference[part, None], v[part]
        values[ACCELERATION] = acceleration[part]
        end = CONTACT + PER_CONTACT * len(memory["gap"])
        for k, name in enumerate(("gap", "normal", "friction")):
            values[CONTACT + k : end : PER_CONTACT] = memory[name]
        journals = [
            (e, load) for e, load in zip(elements, loads, strict=True) if isinstance(e, JournalElement)
        ]
        rest = [journal.eccentricity(q) for journal, _ in journals]
        rest += [-multipliers, *(load[PER_BODY : PER_BODY + ANGLE] for _, load in journals)]
        if self._settings.energy:
            rest.append(self._energies(times, q, v, multipliers, memory, load_energy))
        values[end:] = np.concatenate(rest)
        return values

    def _add_loads(self, force: Array, q: Array, loads: list[Array]) -> list[Array]:
        """Add contacts and workpiece to the forces; return the workpiece's energy (J), if there is one."""
        system = self._model.system
        for element, load in zip(self._model.elements, loads, strict=True):
            for body, body_load in zip(element.bodies, (load[:PER_BODY], load[PER_BODY:]), strict=True):
                if body != FRAME:
                    force[PER_BODY * body : PER_BODY * (body + 1)] += body_load
        if system.load is None:
            return []
        y = PER_BODY * system.observed + Y
        push, energy = workpiece_forces(q[y] + system.reference[y], self._model.workpiece)
        force[y] += push
        return [energy]

    def _take_drift(self, times: Array, instants: NDArray[Any], joints: Constraints) -> None:
        """Update the largest violation of the constraints, in the required states."""
        for name, violations in zip(CONSTRAINTS, (joints.gaps, joints.rates), strict=True):
            amounts = np.abs(violations).max(axis=0, initial=0.0)
            if len(instants):
                most = instants[np.argmax(amounts[instants])]  # the first that is not a number, if one is not
                if not amounts[most] <= self.drift[name][0]:
                    self.drift[name] = float(amounts[most]), float(times[most])

    def _energies(
        self, times: Array, q: Array, v: Array, multipliers: Array, memory: Memory, load_energy: list[Array]
    ) -> Array:
        """Audit the energy: works of motor and contacts by the trapezoidal rule, as good as the integration.

        Return the energies (J), shape (7 or 8, n), as ``tables.energy_channels`` orders them. Drive, gravity,
        damping and friction count from t = 0; the stored energies are those of the state. ``load_energy``
        is that of a workpiece, if there is one. The residual is the work of motor and gravity less the
        increase of the stored energies, less the dissipated ones.
        """
        system = self._model.system
        drive = -multipliers[2 * len(system.pins)] * v[system.prescribed[0][0]]
        powers = np.array([drive, *(memory[f"{name}_power"].sum(axis=0) for name in ("damping", "friction"))])
        energies = [memory["stored"].sum(axis=0), *load_energy]
        works, gravity, kinetic, residual = self._audit(times, q, v, powers, sum(energies))
        return np.array([works[0], gravity, kinetic, *energies, works[1], works[2], residual])

    def _audit(
        self, times: Array, q: Array, v: Array, powers: Array, potential: Any
    ) -> tuple[Array, Array, Array, Array]:
        """Return works of powers (the first drives) and gravity, kinetic energy, residual.

        All in J, like the ``potential`` energy.
        """
        system = self._model.system
        works = np.zeros_like(powers)
        works[:, 1:] = np.cumsum(0.5 * (powers[:, 1:] + powers[:, :-1]) * np.diff(times), axis=1)
        works += self._works[: len(works), None]
        self._works = works[:, -1].copy()
        kinetic = 0.5 * system.masses @ (v * v)
        heights = q[Y::PER_BODY] + system.reference[Y::PER_BODY, None]
        height = system.gravity * system.masses[Y::PER_BODY] @ heights
        if times[0] == 0.0:
            self._initial = float(height[0]), float(kinetic[0] + potential[0])
        gravity = self._initial[0] - height
        residual = works[0] + gravity - (kinetic + potential - self._initial[1])
        for loss in works[1:]:
            residual = residual - loss
        return works, gravity, kinetic, residual

    def _take_turning_points(self, times: Array, ticks: Array, values: Array) -> None:
        """Take the extrema of the observed motion inside steps longer than a tick."""
        long_steps = np.flatnonzero(np.diff(ticks) > 1.0)
        if len(long_steps):
            motion, rates = values[self._moving], values[self._moving + TO_RATE]
            step, after = times[long_steps + 1] - times[long_steps], long_steps + 1
            ends = motion[:, long_steps], rates[:, long_steps], motion[:, after], rates[:, after]
            fraction, extremes = turning_points(*ends, step)
            self.extrema.take_inside(self._moving, times[long_steps] + fraction * step, extremes)

    def _take_contacts(self, times: Array, memory: Memory, new: int) -> None:
        """Take pulses, peaks and depths of the contacts, and impulses by the trapezoidal rule."""
        after = np.arange(new, len(times))
        before = np.maximum(after - 1, 0)  # a step of no length leads to the state at t = 0
        for element in self._model.elements:
            end = element.rows.start + UPPER if element.law.shared else element.rows.stop
            for row in range(element.rows.start, end):
                contact = np.array([memory[name][row] for name in TABLE_FIELDS])
                normal, depth = memory["normal"][row], -memory["gap"][row]
                if element.law.shared:  # the record of the lower corner is that of the side's contact
                    normal = normal + memory["normal"][row + UPPER]
                    depth = np.maximum(depth, -memory["gap"][row + UPPER])
                closed = contact[0] > 0.0
                self.contacts.take_pulse(row, times[after][closed[after]], normal[after][closed[after]])
                openings = closed[before] & ~closed[after]
                contact = np.where(openings, contact[:, before], contact[:, after])
                ends = np.where(openings, memory["end"][row][after], np.inf)
                start = np.maximum(contact[1], times[before])
                first = np.where(contact[1] <= times[before], normal[before], 0.0)
                impulse = 0.5 * (first + normal[after]) * (np.minimum(ends, times[after]) - start)
                active = contact[0] > 0.0
                increments = ends, impulse, normal[after], depth[after]
                self.contacts.take(row, contact[:, active], *(one[active] for one in increments))

    def _take_samples(self, times: Array, ticks: Array, values: Array) -> None:
        """Take the samples up to the last state; those between two states are interpolated.

        Coordinates and velocities follow cubic Hermite polynomials, whose error is of fourth order in the
        step. Gaps follow from these coordinates, and the angular acceleration of a body in a guide from the
        corners' forces. All else is linear, with an error of second order, as that of the method.
        """
        last = int(ticks[-1] // self._settings.per_sample)
        instants = np.arange(self._sample_count, last + 1) * self._settings.per_sample
        at = np.searchsorted(ticks, instants)
        samples = values[:, at]
        between = np.flatnonzero(ticks[at] != instants)
        if len(between):
            samples[:, between] = self._interpolate(times, values, at[between], instants[between])
        self.take_samples(samples)

    def _interpolate(self, times: Array, values: Array, at: NDArray[Any], instants: NDArray[Any]) -> Array:
        before, after, step = values[:, at - 1], values[:, at], times[at] - times[at - 1]
        s = (instants * self._choice.tick_length - times[at - 1]) / step
        r = 1.0 - s
        samples: Array = r * before + s * after
        rates = slice(MOTION.start + TO_RATE, MOTION.stop + TO_RATE)
        change = after[MOTION] - before[MOTION]
        slope0, slope1 = step * before[rates] - change, change - step * after[rates]
        samples[MOTION] += s * r * (r * slope0 + s * slope1)
        system = self._model.system
        for element in self._model.elements:
            if isinstance(element, SliderElement) and element.bodies[0] == system.observed:
                first = PER_BODY * system.observed
                q = np.zeros((PER_BODY * len(system.bodies), samples.shape[1]))
                part = slice(first, first + PER_BODY)
                q[part] = samples[MOTION][:PER_BODY] - system.reference[part, None]
                start, stop = element.rows.start, element.rows.stop
                rows = slice(CONTACT + PER_CONTACT * start, CONTACT + PER_CONTACT * stop)
                forces = samples[rows].reshape(CORNER_COUNT, PER_CONTACT, -1)
                forces[:, 0], moment = element.gaps_and_moment(q, forces[:, 1], forces[:, 2])
                samples[ACCELERATION][ANGLE] = moment / system.masses[first + ANGLE]
        return samples

    def is_finite(self) -> bool:
        """Return whether the last accepted state holds neither infinity nor NaN."""
        return bool(np.all(np.isfinite(self._log[max(self._count - 1, 0)])))
