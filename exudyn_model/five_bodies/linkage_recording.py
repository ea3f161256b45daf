"""Run of a linkage that a scene states: its channels, its singular positions, its energy."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.balance import Constraints, accelerations, applied_forces, constraints
from exudyn_model.five_bodies.contact import ANGLE, PER_BODY, Y
from exudyn_model.five_bodies.linkage_scene import Linkage, scaled
from exudyn_model.five_bodies.recording import BodiesRecorder
from exudyn_model.five_bodies.settings import Settings, StepChoice
from exudyn_model.five_bodies.solver import run_system
from exudyn_model.five_bodies.system import Drive, Model
from exudyn_model.run import Report, Run, StopError
from exudyn_model.workpiece import workpiece_forces

Array = NDArray[np.float64]

BODIES_AND_JOINTS = "bodies and joints"
_MOTION = ("x", "y", "angle", "vx", "vy", "omega")
SINGULAR = 1e-3
"""Share of its value at the start below which the least singular value of the constraints' Jacobian ends a run."""
# Steps ahead of a failure of Newton's method in which a singular position, of which it is then the cause, lies
_AHEAD = 20


def linkage_channels(linkage: Linkage) -> tuple[str, ...]:
    """Return the channels of a linkage's groups, in the order of the results."""
    system, groups = linkage.system, linkage.groups
    rates = ("ax", "ay", "alpha") if "accelerations" in groups else ()
    channels = [f"{name}.{part}" for name in linkage.names for part in (*_MOTION, *rates)]
    if "joints" in groups:
        channels += [f"{pin.name}.reaction_{axis}" for pin in system.pins for axis in "xy"]
        channels += [f"{guide.name}.{part}" for guide in system.turned_guides for part in ("force", "moment")]
        channels += ["drive.torque"] * isinstance(system.drive, Drive)
        channels += [f"{spring.name}.force" for spring in system.springs]
    if "energy" in groups:
        channels += [f"energy_{part}" for part in _energies(system.load is not None)]
    return tuple(channels)


def _energies(load: bool) -> tuple[str, ...]:
    names = ("kinetic", "gravity", "drive", "spring", "damping")
    return (*names, *(["load"] if load else []), "residual")


class LinkageRecorder(BodiesRecorder):
    """Recorder of a linkage.

    Attributes
    ----------
    ending : tuple of str
        Status and remedy of a run that ended in a singular position, else empty.
    """

    def __init__(self, linkage: Linkage, model: Model, choice: StepChoice, settings: Settings) -> None:
        super().__init__(model, choice, settings, linkage_channels(linkage))
        self._linkage = linkage
        # Least singular value at the start and, while it falls, its least value below the limit, with its time
        self._start, self._least = math.nan, (math.inf, 0.0)
        # Largest residual with its time, sum of the energies' errors of the steps, largest energy; J, s, J, J
        self._residual, self._error, self._scale = (0.0, 0.0), 0.0, 0.0

    def accept(self) -> float:
        """Take the next state; return how many ticks the next step may take: one."""
        if self.ending:
            raise StopError(self.ending[0])
        self._log_state()
        return 1.0

    def _observe(self) -> None:
        if self.ending:
            return
        log = self._log[: self._count]
        times, q, v = (log[:, columns].T for columns in (slice(0, 1), *self._columns[1:3]))
        joints = constraints(self._model.system, times[0], q, v)
        end = self._singular_time(times[0], q, v, joints)
        if end < math.inf:
            self._end(end)
            self._count = max(1, int(np.searchsorted(times[0], end, side="right")))
        super()._observe()

    def explain_failure(self) -> None:
        """Find the singular position, if any, in which Newton's method has failed."""
        log = self._log[: self._count]
        if self._count < 2 or self.ending:
            return
        times, (q, v) = log[-2:, 0], (log[-2:, columns].T for columns in self._columns[1:3])
        before, last = self._singular_values(constraints(self._model.system, times, q, v), (0, 1))
        # It falls in proportion to the time that is left, or to its root where the rates grow without bound
        left = last / (before - last) * (times[1] - times[0]) if last < before else math.inf
        if left <= _AHEAD * self._settings.tick:
            self._end(float(times[1] + 0.5 * left))

    def _end(self, time: float) -> None:
        self.ending = (
            "singular",
            (
                f"singular position at t = {time:.4g} s: the linkage loses its rank; end before it, or start elsewhere"
            ),
        )

    def _singular_values(self, joints: Constraints, states: Any) -> list[float]:
        size, count = self._linkage.size, PER_BODY * len(self._linkage.names)
        if not joints.rows:
            return [1.0 for _ in states]
        matrices = np.array([scaled(joints, state, count, size) for state in states])
        values: list[float] = np.linalg.svd(matrices, compute_uv=False)[:, -1].tolist()
        return values

    def _singular_time(self, times: Array, q: Array, v: Array, joints: Constraints) -> float:
        """Return the time of a singular position in the logged steps; infinite without one.

        A singular value moves no more than the Jacobian does, in the Frobenius norm. States from which it
        cannot fall below the limit are passed over; a step in which it can is searched for its least value.
        """
        moves = np.zeros(len(times) - 1)
        for row in joints.rows:
            lengths = bool(row.keys() - set(range(ANGLE, len(q), PER_BODY)))
            for coordinate, value in row.items():
                if np.ndim(value):
                    unit = self._linkage.size if lengths and coordinate % PER_BODY == ANGLE else 1.0
                    moves += (np.diff(value) / unit) ** 2
        path = np.append(0.0, np.cumsum(np.sqrt(moves)))
        at, last = 0, len(times) - 1
        value = self._singular_values(joints, (0,))[0]
        if math.isnan(self._start):
            self._start = value
        limit = SINGULAR * self._start
        while at < last:
            to = int(np.searchsorted(path, path[at] + value - limit, side="left")) - 1
            if to > at:  # not below the limit until then
                at = min(to, last)
                value = self._singular_values(joints, (at,))[0]
                continue
            following = self._singular_values(joints, (at + 1,))[0]
            if 0.5 * (value + following - (path[at + 1] - path[at])) < limit:
                least, when = self._least_inside(times, q, v, at)
                if least < min(limit, self._least[0]):
                    self._least = least, when
            if self._least[0] < following:  # it has passed its least value
                return self._least[1]
            at, value = at + 1, following
        return math.inf

    def _least_inside(self, times: Array, q: Array, v: Array, at: int) -> tuple[float, float]:
        """Return the least singular value inside a step, along cubic Hermite polynomials, and its time."""
        step = times[at + 1] - times[at]
        rise = q[:, at + 1] - q[:, at]
        leaves, arrives = step * v[:, at] - rise, rise - step * v[:, at + 1]
        low, high = 0.0, 1.0
        for _ in range(6):
            s = np.linspace(low, high, 33)
            inside = q[:, at, None] + s * rise[:, None]
            inside += s * (1.0 - s) * ((1.0 - s) * leaves[:, None] + s * arrives[:, None])
            joints = constraints(self._model.system, times[at] + s * step, inside, 0.0 * inside)
            values = self._singular_values(joints, range(len(s)))
            best = int(np.argmin(values))
            low, high = s[max(best - 1, 0)], s[min(best + 1, len(s) - 1)]
        return values[best], float(times[at] + s[best] * step)

    def _values(
        self, times: Array, q: Array, v: Array, multipliers: Array, memory: Any, loads: Any, required: Any
    ) -> Array:
        """Return all channels, shape (channels, n)."""
        del memory, loads
        system, linkage, rows = self._model.system, self._linkage, []
        joints = constraints(system, times, q, v)
        self._take_drift(times, required, joints)
        force, tensions, stored, damped, driven = applied_forces(system, q, v)
        load = np.zeros_like(times)
        if system.load is not None:
            y = PER_BODY * system.observed + Y
            push, load = workpiece_forces(q[y], self._model.workpiece)
            force[y] += push
        acceleration, balanced = accelerations(system, joints, force)
        reactions = -multipliers if self._settings.index2 else -balanced
        own = 2 * len(system.pins)
        if isinstance(system.drive, Drive):
            driven = reactions[own] * system.drive.omega
        energies = self._energy(times, v, q, acceleration, np.array([driven, damped]), stored, load)
        for body in range(len(system.bodies)):
            coordinates = slice(PER_BODY * body, PER_BODY * (body + 1))
            rows += [*q[coordinates], *v[coordinates]]
            rows += [*acceleration[coordinates]] if "accelerations" in linkage.groups else []
        if "joints" in linkage.groups:
            guides = reactions[len(reactions) - 2 * len(system.turned_guides) :]
            guides[::2] *= -1.0
            rows += [*reactions[:own], *guides]
            rows += [reactions[own]] if isinstance(system.drive, Drive) else []
            rows += [*tensions]
        return np.array(rows + (energies if "energy" in linkage.groups else []))

    def _energy(
        self, times: Array, v: Array, q: Array, acceleration: Array, powers: Array, spring: Array, load: Array
    ) -> list[Array]:
        """Audit the energy, as `BodiesRecorder` does; return the channels of ``_energies``, J."""
        system = self._model.system
        driven, damped = self._integrate(times, powers)
        kinetic = 0.5 * system.masses @ (v * v)
        height = system.gravity * system.masses[Y::PER_BODY] @ q[Y::PER_BODY]
        if times[0] == 0.0:
            self._initial = float(height[0]), float(kinetic[0] + spring[0] + load[0])
        gravity = self._initial[0] - height
        residual = driven + gravity - (kinetic + spring + load - self._initial[1]) - damped
        at = int(np.argmax(np.abs(residual)))
        if not abs(residual[at]) <= self._residual[0]:
            self._residual = abs(float(residual[at])), float(times[at])
        force = system.masses[:, None] * np.diff(acceleration)
        self._error += 0.25 * float(np.sum(np.diff(times) * np.abs(force * np.diff(v))))
        self._scale = max(self._scale, float(np.max(kinetic + spring + load + damped)))
        parts = [kinetic, gravity, driven, spring, damped]
        return [*parts, *([load] if system.load is not None else []), residual]

    def invariants(self) -> tuple[dict[str, dict[str, Any]], str]:
        """Return the invariants as `invariants.judge_run` does."""
        settings, (value, time) = self._settings, self._residual
        # The rule advances by mean forces and mean rates, the audit by their mean product
        scale = self._scale or 1.0
        bound = min(1e-3, 1e-9 + 10.0 * self._error / scale)
        worst = {"energy": (value / scale, time, bound, "1")}
        drift, rate = self.drift["position"], self.drift["velocity"]
        del drift, rate, settings
        invariants = {
            name: {"value": amount, "bound": limit, "unit": unit, "time_s": when}
            for name, (amount, when, limit, unit) in worst.items()
        }
        broken = ""
        for name, (amount, when, limit, _) in worst.items():
            if not amount <= limit:
                broken = f"{name}: the audit is off by {amount:.3g} at {when:.9g} s, bound {limit:.3g}"
        return invariants, broken


def run_linkage(linkage: Linkage, report: Report | None) -> Run:
    """Run a linkage; ``report`` as for ``simulation.simulate``."""
    settings = linkage.settings

    def recorder_of(model: Model, choice: StepChoice, chosen: Settings) -> LinkageRecorder:
        return LinkageRecorder(linkage, model, choice, chosen)

    recorder, _, outcome = run_system(linkage.system, settings, report, recorder_of)
    used = {
        "step_used": settings.tick,
        "steps_per_sample": settings.per_sample,
        "newton_tolerance": settings.tolerance,
    }
    return Run(BODIES_AND_JOINTS, used, recorder, outcome, recorder.drift)
