"""Run of a linkage that a scene states body by body: its channels, its energy, its singular positions.

A run ends where the least singular value of the constraints' Jacobian, with lengths in units of the linkage's
size, has a minimum below ``SINGULAR`` of its value at the start. Beyond it the linkage may go on in another
way, of which the step decides.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import ACROSS
from exudyn_model.five_bodies.balance import Constraints, accelerations, applied_forces, constraints
from exudyn_model.five_bodies.contact import ANGLE, PER_BODY
from exudyn_model.five_bodies.journal_contact import JournalElement
from exudyn_model.five_bodies.linkage_scene import Linkage, jacobian
from exudyn_model.five_bodies.recording import BodiesRecorder, Memory
from exudyn_model.five_bodies.settings import StepChoice
from exudyn_model.five_bodies.solver import Solution
from exudyn_model.five_bodies.system import Drive, JournalContact, Model, build
from exudyn_model.invariants import contact_bounds, contact_violations, judge, squared_share
from exudyn_model.run import Progress, Report, Run, StopError

Array = NDArray[np.float64]

BODIES_AND_JOINTS = "bodies and joints"
SINGULAR = 1e-3
# Steps ahead of a failure of Newton's method in which a singular position, if there is one, is its cause: as
# rates grow without bound, their round-off ends it some 40 steps before
_AHEAD = 100


_GROUPS = ("accelerations", "contacts", "joints", "energy")


def linkage_channels(linkage: Linkage, groups: Sequence[str]) -> tuple[str, ...]:
    """Return the channels of some groups, in the order of the results."""
    system = linkage.system
    motion = ["x", "y", "angle", "vx", "vy", "omega"]
    motion += ["ax", "ay", "alpha"] if "accelerations" in groups else []
    channels = [f"{name}.{part}" for name in linkage.names for part in motion]
    if "contacts" in groups:
        for contact in system.contacts:
            if isinstance(contact, JournalContact):
                channels += [f"{contact.name}.{part}" for part in ("x", "y", "normal", "friction")]
            else:
                parts = ("gap", "normal", "friction")
                channels += [f"{name}_{part}" for name in contact.rows for part in parts]
    if "joints" in groups:
        channels += [f"{pin}.reaction_{axis}" for pin in linkage.pins for axis in "xy"]
        channels += [f"{guide}.{part}" for guide in linkage.guides for part in ("force", "moment")]
        channels += ["drive.torque"] if isinstance(system.drive, Drive) else []
        channels += [f"{spring.name}.force" for spring in system.springs]
    if "energy" in groups:
        loose = bool(system.contacts)
        names = ["kinetic", "gravity", "drive", "spring", *["contact"] * loose, "damping"]
        names += [*["friction"] * loose, *["load"] * (system.load is not None), "residual"]
        channels += [f"energy_{name}" for name in names]
    return tuple(channels)


class LinkageRecorder(BodiesRecorder):
    """Recorder of a linkage, of the channels of all groups; its further parameters are `BodiesRecorder`'s."""

    def __init__(self, linkage: Linkage, model: Model, choice: StepChoice) -> None:
        super().__init__(model, choice, linkage.settings, linkage_channels(linkage, _GROUPS))
        self._linkage = linkage
        motion = 3 * PER_BODY * np.arange(len(linkage.names))[:, None] + np.arange(2 * PER_BODY)
        self._moving = motion.ravel()
        self.contacts.silent = ()
        # Least singular value at the start, and its least value since it fell below the limit, with its time
        self._start, self._least = math.nan, (math.inf, 0.0)
        # Largest residual of the energy with its time, J, s; largest energy, and sum of the steps' errors, J
        self._residual, self._energy, self._errors = (0.0, 0.0), 0.0, 0.0

    def accept(self) -> float:
        """Take the next state; return the most ticks of the next step: one without clearance."""
        if self.ending:
            raise StopError(self.ending[0])
        if self._model.elements:
            return super().accept()
        self._log_state()
        return 1.0

    def explain_failure(self) -> None:
        """Find the singular position in which Newton's method has failed, if it has failed in one."""
        self.observe()
        step, last_state = self._settings.tick, self._log[self._count - 1]
        q, v = (last_state[columns] for columns in self._columns[1:3])
        pair = np.stack([q - step * v, q], axis=1)
        before, last = self._singular_values(constraints(self._model.system, np.zeros(2), pair, pair), (0, 1))
        # It falls in proportion to the remaining time, or to its root where rates grow without bound
        remaining = last / (before - last) * step if last < before else math.inf
        if remaining <= _AHEAD * step and last < 0.3 * self._start:
            self._end(self.time + 0.5 * remaining)
        advice = "lower solver.exudyn.step, or raise solver.exudyn.tolerance"
        self.ending = self.ending or ("newton-failed", advice)

    def invariants(self) -> tuple[dict[str, dict[str, Any]], str]:
        """Return invariants and the worst violation, as ``invariants.judge_run`` does."""
        # A step multiplies mean forces by mean rates, the audit takes the means of the products
        linkage, (residual, time) = self._linkage, self._residual
        weight = linkage.system.gravity * math.fsum(body.mass for body in linkage.system.bodies)
        energy = (
            max(self._energy, 1e-6 * abs(weight) * linkage.size) or 1.0
        )  # more than round-off, at rest too
        value = residual / energy if math.isfinite(residual) else math.inf
        events, settings = self.event_table(), self._settings
        # As of a press, of second order in a step's share of a contact
        limit = 1e-4 + 10.0 * squared_share(events, settings.tick)
        bounds = {"energy": min(limit, 1e-7 + 3.0 * self._errors / energy)}
        bounds["constraint-position"] = 1e-5 * linkage.size
        # Index 2 leaves positions to the rule: they drift where the linkage hurries, and its angles do
        worst = {
            "energy": (value, time, ""),
            "constraint-position": (*self.drift["position"], "a constraint"),
        }
        if linkage.system.contacts:
            worst |= contact_violations(self.watch, self.contacts, events)
            rounding = 1e-13 * max(1.0, linkage.size)
            bounds |= contact_bounds(self.watch, settings.duration, settings.tick, rounding)
        invariants, violation = judge(worst, bounds)
        if violation and self._least[0] < 0.3 * self._start:
            violation += f", perhaps by a singular position near t = {self._least[1]:.6g} s"
        return invariants, violation

    def _observe(self) -> None:
        if self.ending:
            return
        states = self._log[: self._count].T
        times, q, v = states[0], *(states[columns] for columns in self._columns[1:3])
        end = self._singular_time(times, q, v)
        if end < math.inf:
            self._end(end)
            self._count = max(1, int(np.searchsorted(times, end, side="right")))
        super()._observe()

    def _values(
        self, times: Array, q: Array, v: Array, multipliers: Array, memory: Memory, loads: list[Array],
        instants: Any,
    ) -> Array:  # fmt: skip
        """Return all channels, shape (channels, n)."""
        system, index2 = self._model.system, self._settings.index2
        joints = constraints(system, times, q, v)
        self._take_drift(times, instants, joints)
        force, tensions, spring, damper, motor = applied_forces(system, q, v)
        workpiece = self._add_loads(force, q, loads)
        acceleration, solution = accelerations(system, joints, force)
        reactions, pins = -multipliers if index2 else -solution, 2 * len(system.pins)
        torque = reactions[pins : pins + isinstance(system.drive, Drive)]
        guides = reactions[pins + len(torque) :]
        guides[::2] *= -1.0
        for row in torque:
            motor = row * v[system.prescribed[0][0]]
        contact, loss, drag = (memory[f].sum(axis=0) for f in ("stored", "damping_power", "friction_power"))
        powers, potential = np.array([motor, damper + loss, drag]), spring + sum(workpiece) + contact
        works, gravity, kinetic, residual = self._audit(times, q, v, powers, potential)
        energy = kinetic + potential + works[1] + works[2]
        self._take_errors(times, v, acceleration, residual, energy)
        # The mean force over a step misses part of a potential, most of it where a spring is short
        work = gravity - works[1] - works[2] - potential
        work = work if isinstance(system.drive, Drive) else work + works[0]
        error = 0.5 * ((force[:, 1:] + force[:, :-1]) * np.diff(q)).sum(axis=0) - np.diff(work)
        self._errors += float(np.abs(error).sum())
        rows: list[Array] = []
        for body in range(0, len(q), PER_BODY):
            part = slice(body, body + PER_BODY)
            rows += [*(q[part] + system.reference[part, None]), *v[part], *acceleration[part]]
        joint_rows = {pin.name: reactions[2 * n : 2 * n + 2] for n, pin in enumerate(system.pins)}
        joint_rows |= {guide.name: guides[2 * n : 2 * n + 2] for n, guide in enumerate(system.turned_guides)}
        for element, load, joint in zip(self._model.elements, loads, system.contacts, strict=True):
            gaps, normals, frictions = (memory[name][element.rows] for name in ("gap", "normal", "friction"))
            if isinstance(joint, JournalContact) and isinstance(element, JournalElement):
                rows += [*element.eccentricity(q), *normals, *frictions]
                joint_rows[joint.name] = load[PER_BODY : PER_BODY + ANGLE]
            else:
                rows += [row for corner in zip(gaps, normals, frictions, strict=True) for row in corner]
                # A wall on the left, where the normal of the line points, pushes against that
                joint_rows[joint.rows[0].split(".")[0]] = np.array([np.array(ACROSS) @ normals, load[ANGLE]])
        for name in (*self._linkage.pins, *self._linkage.guides):
            rows += [*joint_rows[name]]
        losses = ([contact, works[1], works[2]]) if system.contacts else [works[1]]
        rows += [*torque, *tensions, kinetic, gravity, works[0], spring, *losses, *workpiece, residual]
        return np.array(rows)

    def _take_errors(
        self, times: Array, v: Array, acceleration: Array, residual: Array, energy: Array
    ) -> None:
        """Update the residual, the errors and the energy that the invariants compare."""
        at = int(np.argmax(np.abs(residual)))  # the first that is not a number, if one is not
        if not abs(residual[at]) <= self._residual[0]:
            self._residual = abs(float(residual[at])), float(times[at])
        errors = self._model.system.masses @ np.abs(np.diff(acceleration) * np.diff(v))
        self._errors += 0.25 * float(errors @ np.diff(times))
        self._energy = max(self._energy, float(energy.max()))

    def _end(self, time: float) -> None:
        if self.ending:
            return
        reason = f"singular position at t = {time:.6g} s: the linkage loses its rank"
        self.ending = "singular", f"{reason}; end before it, or start elsewhere"

    def _singular_values(self, joints: Constraints, states: Iterable[int]) -> list[float]:
        """Return the least singular value of the scaled Jacobian in some states."""
        count, size = PER_BODY * len(self._linkage.names), self._linkage.size
        matrices = np.array([jacobian(joints, state, count, size) for state in states])
        if not np.isfinite(matrices).all():  # the run fails
            return [math.inf for _ in matrices]
        values: list[float] = np.linalg.svd(matrices, compute_uv=False).min(axis=1, initial=math.inf).tolist()
        return values

    def _singular_time(self, times: Array, q: Array, v: Array) -> float:
        """Return the time of a singular position in the logged steps; infinite without one.

        A singular value moves no more than the Jacobian does, in the Frobenius norm: states before it can be
        below the limit are passed over, and only a step in which it can is searched for its least value.
        """
        joints, size = constraints(self._model.system, times, q, v), self._linkage.size
        moves = np.zeros(len(times) - 1)
        for row in joints.rows:
            unit = size if any(coordinate % PER_BODY != ANGLE for coordinate in row) else 1.0
            for coordinate, value in row.items():
                if np.ndim(value):
                    moves += (np.diff(value) / (unit if coordinate % PER_BODY == ANGLE else 1.0)) ** 2
        path = np.append(0.0, np.cumsum(np.sqrt(moves)))
        at, last, (value,) = 0, len(times) - 1, self._singular_values(joints, (0,))
        if math.isnan(self._start):
            self._start = value
        limit = SINGULAR * self._start
        while at < last:
            target = at + 1
            if value < math.inf:
                target = int(np.searchsorted(path, path[at] + value - limit)) - 1
            if target > at + 1:
                at = min(target, last)
                (value,) = self._singular_values(joints, (at,))
                continue
            (after,) = self._singular_values(joints, (at + 1,))
            if 0.5 * (value + after - (path[at + 1] - path[at])) < limit:
                self._least = min(self._least, self._least_inside(times, q, v, at))
            if self._least[0] < min(after, limit):  # it rises again
                return self._least[1]
            at, value = at + 1, after
        return math.inf

    def _least_inside(self, times: Array, q: Array, v: Array, at: int) -> tuple[float, float]:
        """Return the least singular value in a step, along cubic Hermite polynomials, and its time (s)."""
        step, rise = times[at + 1] - times[at], q[:, at + 1, None] - q[:, at, None]
        slope0, slope1 = step * v[:, at, None] - rise, rise - step * v[:, at + 1, None]
        low, high = 0.0, 1.0
        for _ in range(3):
            s = np.linspace(low, high, 17)
            path = q[:, at, None] + s * rise + s * (1.0 - s) * ((1.0 - s) * slope0 + s * slope1)
            joints = constraints(self._model.system, times[at] + s * step, path, path)
            values = self._singular_values(joints, range(len(s)))
            best = int(np.argmin(values))
            low, high = s[max(best - 1, 0)], s[min(best + 1, len(s) - 1)]
        return values[best], float(times[at] + s[best] * step)


def run_linkage(linkage: Linkage, report: Report | None) -> tuple[Run, tuple[dict[str, dict[str, Any]], str]]:
    """Run a linkage; return also its judged invariants. ``report`` is that of ``simulation.simulate``."""
    # Forces that grow far beyond those of the start may round to more than the tolerance
    for factor in (1.0, 1e2, 1e4):
        settings = replace(linkage.settings, tolerance=factor * linkage.settings.tolerance)
        model = build(linkage.system, settings.tick)
        choice = StepChoice(model, settings)
        recorder = LinkageRecorder(linkage, model, choice)
        outcome = Solution(model, settings, choice, recorder, Progress(report, settings.duration)).run()
        if outcome.status != "newton-failed":
            break
    step_settings = {
        "step_used": settings.tick,
        "steps_per_sample": settings.per_sample,
        "newton_tolerance": settings.tolerance,
    }
    if linkage.system.contacts:
        step_settings["longest_step"] = choice.longest_taken * settings.tick
    return Run(BODIES_AND_JOINTS, step_settings, recorder, outcome, recorder.drift), recorder.invariants()
