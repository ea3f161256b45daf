"""Recorder of a run of five bodies: accepted states are collected, and observed many at a time."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.corners import CORNER_COUNT, UPPER
from exudyn_model.five_bodies.balance import Constraints, accelerations, constraints
from exudyn_model.five_bodies.contact import ANGLE, PER_BODY, Y
from exudyn_model.five_bodies.journal_contact import JournalPart
from exudyn_model.five_bodies.settings import Settings
from exudyn_model.five_bodies.slider_contact import SliderPart
from exudyn_model.five_bodies.step_choice import StepChoice
from exudyn_model.five_bodies.system import Model
from exudyn_model.memory import NAMES
from exudyn_model.run import Recorder
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
    energies,
    turning_points,
)
from exudyn_model.workpiece import workpiece_forces

Array = NDArray[np.float64]

# By name (`memory`), shape (contacts, states)
Memory = dict[str, Array]

CONSTRAINTS = ("position", "velocity")
# Fields of a memory by which the table knows a contact
_KNOWN_BY = ("impact_speed", "start", "name")
# States that are observed at once: as many as the processor's cache holds
_ROOM = 2048


class BodiesRecorder(Recorder):
    """Recorder of one run of five bodies.

    :meth:`accept` must be called once for each accepted state, the initial one included, before the step that
    starts from it: it also updates the contacts' memory, which the contact force of that step reads.

    Parameters
    ----------
    model : Model
    choice : StepChoice
        Tells the time of the state to accept.
    settings : Settings

    Attributes
    ----------
    accepted : int
        States so far.
    drift : dict
        Of each of ``CONSTRAINTS`` the largest violation so far (m, rad; m/s, rad/s), and when (s).
    """

    def __init__(self, model: Model, choice: StepChoice, settings: Settings) -> None:
        system, names = model.system, model.system.contact_names
        journals = [f"{name}{n or ''}" for n in range(len(system.journals)) for name in JOURNAL]
        loads = [f"reaction_{journal.name}_{axis}" for journal in system.journals for axis in "xy"]
        channels = (
            *STATE, *ACCELERATIONS, *corner_channels(names), *journals, *system.multipliers, *loads,
            *(energies(system.load is not None) if settings.energy else ()),
        )  # fmt: skip
        shared = any(part.law.shared for part in model.parts)
        super().__init__(channels, names, shared, settings.samples, settings.period, settings.duration)
        self.accepted, self.drift = 0, dict.fromkeys(CONSTRAINTS, (0.0, 0.0))
        self._model, self._choice, self._settings = model, choice, settings
        # Of each state: time and tick, coordinates, rates, multipliers, memory, loads of the contacts
        bodies = PER_BODY * len(system.bodies)
        sizes = [2, bodies, bodies, len(system.multipliers), model.contacts.view(float).size]
        sizes += [len(part.load) for part in model.parts]
        ends = np.cumsum([0, *sizes])
        self._log = np.zeros((_ROOM, ends[-1]))
        self._columns = [slice(*pair) for pair in pairwise(ends)]
        self._count = 0
        self._stamp = np.zeros(2)
        self._vectors: tuple[Array, ...] = ()
        # Works of drive, damping and friction up to the last state; of height and stored at t = 0
        self._works, self._initial = np.zeros(3), (0.0, 0.0)

    def begin(self, q: Array, v: Array, multipliers: Array) -> None:
        """Take the states to come from Exudyn's own vectors, which it fills anew in every step.

        To ask for them takes longer than to read them.

        Parameters
        ----------
        q, v : ndarray, shape (3 n,)
            Coordinates and their rates.
        multipliers : ndarray
            Those of Exudyn's constraints, in the order of ``System.multipliers``.
        """
        parts = self._model.parts
        loads = [part.load for part in parts]
        self._vectors = self._stamp, q, v, multipliers, self._model.contacts.view(float), *loads
        for part in parts:
            part.attach(q, v)
            part.start()

    def accept(self) -> float:
        """Take the next state; return how many ticks the next step may take."""
        choice = self._choice
        time, longest = choice.time, choice.allowed
        for part in self._model.parts:
            longest = part.follow(time, longest)
        stamp = self._stamp
        stamp[0], stamp[1] = time, choice.tick
        np.concatenate(self._vectors, out=self._log[self._count])
        self._count += 1
        self.accepted += 1
        if self._count == _ROOM:
            self.observe()
        return longest

    def observe(self) -> None:
        """Observe the states that wait for it; the last one remains, as the first of those to come.

        The numbers of a run that diverges overflow.
        """
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            self._observe()

    def _observe(self) -> None:
        new = min(self._count - 1, 1) if self.accepted > self._count else 0
        if self._count <= new:
            return
        parts = [self._log[: self._count, columns].T.copy() for columns in self._columns]
        (times, ticks), q, v, multipliers, numbers = parts[:5]
        numbers = numbers.reshape(-1, len(NAMES), len(times))
        memory = {name: numbers[:, k] for k, name in enumerate(NAMES)}
        required = np.flatnonzero(ticks % self._settings.per_state == 0)
        values = self._values(times, q, v, multipliers, memory, parts[5:], required)
        self.extrema.take(times[new:], values[:, new:])
        self._take_turning_points(times, ticks, values)
        self._take_contacts(times, memory, new)
        for part in self._model.parts:
            forces, known_by = (
                np.stack([memory[name][part.rows] for name in names], axis=1)
                for names in (("normal", "friction"), _KNOWN_BY)
            )
            part.watch(self.watch, times, q, v, forces, known_by)
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
        required: NDArray[Any],
    ) -> Array:
        """Return all channels, shape (channels, n)."""
        system, parts = self._model.system, self._model.parts
        force = np.zeros_like(q)
        force[Y::PER_BODY] = -system.gravity * system.masses[Y::PER_BODY, None]
        for part, load in zip(parts, loads, strict=True):
            for number, body in enumerate(part.bodies):
                own = slice(PER_BODY * body, PER_BODY * (body + 1))
                force[own] += load[PER_BODY * number : PER_BODY * (number + 1)]
        pressed: list[Array] = []
        if system.load is not None:
            y = PER_BODY * system.observed + Y
            push, energy = workpiece_forces(q[y] + system.reference[y], self._model.workpiece)
            force[y] += push
            pressed.append(energy)
        joints = constraints(system, times, q, v)
        self._take_drift(times, required, joints)
        acceleration, _ = accelerations(system, joints, force)
        values = np.empty((len(self.channels), len(times)))
        own = slice(PER_BODY * system.observed, PER_BODY * (system.observed + 1))
        values[MOTION][:PER_BODY], values[MOTION][PER_BODY:] = q[own] + system.reference[own, None], v[own]
        values[ACCELERATION] = acceleration[own]
        end = CONTACT + PER_CONTACT * len(memory["gap"])
        for k, name in enumerate(("gap", "normal", "friction")):
            values[CONTACT + k : end : PER_CONTACT] = memory[name]
        journals = [part for part in parts if isinstance(part, JournalPart)]
        rest = [part.eccentricity(q) for part in journals]
        of_journals = [load for part, load in zip(parts, loads, strict=True) if isinstance(part, JournalPart)]
        rest += [-multipliers, *(load[PER_BODY : PER_BODY + ANGLE] for load in of_journals)]
        if self._settings.energy:
            rest.append(self._energies(times, q, v, multipliers, memory, pressed))
        values[end:] = np.concatenate(rest)
        return values

    def _take_drift(self, times: Array, required: NDArray[Any], joints: Constraints) -> None:
        """Take the violation of the constraints, in the required states."""
        for name, amounts in zip(CONSTRAINTS, (joints.position, joints.velocity), strict=True):
            if len(required):
                most = required[np.argmax(amounts[required])]  # the first that is not a number, if one is not
                if not amounts[most] <= self.drift[name][0]:
                    self.drift[name] = float(amounts[most]), float(times[most])

    def _energies(
        self, times: Array, q: Array, v: Array, multipliers: Array, memory: Memory, pressed: list[Array]
    ) -> Array:
        """Audit the energy: works of motor and contacts by the trapezoidal rule, as good as the integration.

        Return the energies (J), shape (7 or 8, n), in the order of ``tables.energies``: drive, gravity,
        damping and friction count from t = 0, kinetic and contact energy are those stored now, and so is that
        of a workpiece, which ``pressed`` holds where there is one. The residual is the work of motor and
        gravity less the increase of the stored energies, less the dissipated ones.
        """
        system = self._model.system
        drive = -multipliers[2 * len(system.pins)] * v[system.prescribed[0][0]]
        powers = np.array([drive, *(memory[f"{name}_power"].sum(axis=0) for name in ("damping", "friction"))])
        works = np.zeros_like(powers)
        works[:, 1:] = np.cumsum(0.5 * (powers[:, 1:] + powers[:, :-1]) * np.diff(times), axis=1)
        works += self._works[:, None]
        self._works = works[:, -1].copy()
        kinetic = 0.5 * system.masses @ (v * v)
        heights = q[Y::PER_BODY] + system.reference[Y::PER_BODY, None]
        height = system.gravity * system.masses[Y::PER_BODY] @ heights
        parts = [memory["stored"].sum(axis=0), *pressed]
        stored = sum(parts)
        if times[0] == 0.0:
            self._initial = float(height[0]), float(kinetic[0] + stored[0])
        gravity = self._initial[0] - height
        residual = works[0] + gravity - (kinetic + stored - self._initial[1]) - works[1] - works[2]
        return np.array([works[0], gravity, kinetic, *parts, works[1], works[2], residual])

    def _take_turning_points(self, times: Array, ticks: Array, values: Array) -> None:
        """Take the extrema of the observed motion inside steps longer than a tick."""
        long = np.flatnonzero(np.diff(ticks) > 1.0)
        if len(long):
            motion, rates = values[MOTION], values[MOTION.start + TO_RATE : MOTION.stop + TO_RATE]
            step, after = times[long + 1] - times[long], long + 1
            ends = motion[:, long], rates[:, long], motion[:, after], rates[:, after]
            fraction, turning = turning_points(*ends, step)
            channels = np.arange(MOTION.start, MOTION.stop)
            self.extrema.take_inside(channels, times[long] + fraction * step, turning)

    def _take_contacts(self, times: Array, memory: Memory, new: int) -> None:
        """Take the contacts by the steps to each new state: pulses, and by the trapezoidal rule impulses."""
        after = np.arange(new, len(times))
        before = np.maximum(after - 1, 0)  # to the state at t = 0 leads a step of no length
        for part in self._model.parts:
            end = part.rows.start + UPPER if part.law.shared else part.rows.stop
            for row in range(part.rows.start, end):
                contact = np.array([memory[name][row] for name in _KNOWN_BY])
                normal, depth = memory["normal"][row], -memory["gap"][row]
                if part.law.shared:  # the contact of a side, which its lower corner remembers
                    normal = normal + memory["normal"][row + UPPER]
                    depth = np.maximum(depth, -memory["gap"][row + UPPER])
                closed = contact[0] > 0.0
                self.contacts.note(row, times[after][closed[after]], normal[after][closed[after]])
                over = closed[before] & ~closed[after]
                contact = np.where(over, contact[:, before], contact[:, after])
                ends = np.where(over, memory["end"][row][after], np.inf)
                start = np.maximum(contact[1], times[before])
                first = np.where(contact[1] <= times[before], normal[before], 0.0)
                impulse = 0.5 * (first + normal[after]) * (np.minimum(ends, times[after]) - start)
                taken = contact[0] > 0.0
                part_of_it = ends, impulse, normal[after], depth[after]
                self.contacts.take(row, contact[:, taken], *(one[taken] for one in part_of_it))

    def _take_samples(self, times: Array, ticks: Array, values: Array) -> None:
        """Take the samples up to the last state; those between two states are interpolated.

        Coordinates and velocities by cubic Hermite polynomials of the states and their rates, whose error is
        of fourth order in the step; gaps from these coordinates; all others linearly, with an error of second
        order, as that of the method, but the angular acceleration of a body in a guide: that follows from the
        corners' forces.
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
        s = (instants * self._choice.size - times[at - 1]) / step
        r = 1.0 - s
        samples: Array = r * before + s * after
        rates = slice(MOTION.start + TO_RATE, MOTION.stop + TO_RATE)
        change = after[MOTION] - before[MOTION]
        leaves, arrives = step * before[rates] - change, change - step * after[rates]
        samples[MOTION] += s * r * (r * leaves + s * arrives)
        system = self._model.system
        for part in self._model.parts:
            if isinstance(part, SliderPart) and part.bodies[0] == system.observed:
                first = PER_BODY * system.observed
                q = samples[MOTION][:PER_BODY] - system.reference[first : first + PER_BODY, None]
                rows = slice(CONTACT + PER_CONTACT * part.rows.start, CONTACT + PER_CONTACT * part.rows.stop)
                forces = samples[rows].reshape(CORNER_COUNT, PER_CONTACT, -1)
                forces[:, 0], moment = part.gaps_and_moment(q, forces[:, 1], forces[:, 2])
                samples[ACCELERATION][ANGLE] = moment / system.masses[first + ANGLE]
        return samples

    def is_finite(self) -> bool:
        """Whether the last accepted state holds no infinity and no NaN."""
        return bool(np.all(np.isfinite(self._log[max(self._count - 1, 0)])))
