"""The run of a planar linkage: projected steps, singular positions, channels.

The equations of index 1 are integrated by DOP853, and each accepted state is projected onto the constraints,
else a linkage would stick near a singular position. A step may leap over one: the smallest singular value of
the constraints' Jacobian is followed within steps, and the run ends where a minimum of it is close to zero.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model import compiled
from reference_model.compiled import inlined, inner, kernel
from reference_model.dop853 import (
    END,
    FIRST,
    POINT,
    STAGES,
    START,
    dense,
    error_norm,
    evaluate_nodes,
    free_states,
)
from reference_model.integrate import (
    BUFFER_FULL,
    REACHED,
    STEP_LIMIT,
    STEP_TOO_SMALL,
    Settings,
    prepare_dense_output,
    stop_code,
)
from reference_model.invariants import VIOLATED, Invariant, violation
from reference_model.linkage import Array
from reference_model.multiplier import Linkage, constraints, solve
from reference_model.planar import Assembly, jacobian, read_linkage, smallest
from reference_model.recording import PART, SAMPLE, record
from reference_model.results import EVENT_COLUMNS, Extrema, Result, name_results
from reference_model.running import new_run
from reference_model.state import Run
from reference_model.steps import share_to_kink, step_in_workpiece
from reference_model.workpiece import exists, load_energy

SINGULAR = 1e-3
"""Smallest singular value, relative to that at the start, of a singular position."""
ENERGY = 1e3
"""Bound of the spurious energy, relative to the largest energy, in units of the tolerance."""
RATE_TIME = 1e-2
"""Time in which the error of a rate counts as an error of position, s."""
STEPS_LIMIT = 2_000_000
"""Attempted steps after which a run is stopped, some minutes."""
LARGEST_STEP = 1.0 / 50.0
"""Longest step, as a share of the duration or of a cycle."""
PARTS = 6
"""Parts of a step at whose ends extrema and singular positions are looked for."""
_STEPS = 128
"""Steps after which the compiled integrator returns."""
_REMEDIES = {
    STEP_TOO_SMALL: ("step-too-small", "steps are below the round-off of time"),
    STEP_LIMIT: ("work-limit", "shorten the run to less than was reached"),
}
MOTION = ("x", "y", "angle", "vx", "vy", "omega")
ACCELERATIONS = ("ax", "ay", "alpha")


class Trace(NamedTuple):
    """What the rows of a run leave with them."""

    forces: Array
    """Multipliers, then tension (N) and length (m) of each spring, shape (n, rows + 2 springs)."""
    jacobians: Array
    """Of the constraints, shape (n, rows, 3 n)."""
    accuracy: float
    """Largest sum of all |Phi| in a row, m and rad."""


@inlined
def correct(model: Linkage, errors: Array, values: Array, change: Array) -> None:
    """Change coordinates or rates, by least M, to remove their errors in the rows of Phi or Phi'."""
    for k in range(values.size):
        model.applied[k] = 0.0
    for row in range(model.lambdas.size):
        model.lambdas[row] = errors[row]
    solve(model, change)
    for k in range(values.size):
        values[k] += change[k]


@inner
def project(model: Linkage, t: float, y: Array, change: Array, accuracy: float) -> bool:
    """Move a state at `t` (s) to |Phi| <= `accuracy` (m, rad) and Phi' = 0; return whether it went there."""
    size, drift = model.masses.size, math.inf
    q, v = y[:size], y[size : 2 * size]
    constraints(model, t, q, v)
    for _ in range(6):
        correct(model, model.phi, q, change[:size])
        constraints(model, t, q, v)
        drift = 0.0
        for row in range(model.lambdas.size):
            drift += abs(model.phi[row])
        if drift <= accuracy:
            break
    correct(model, model.rate, v, change[:size])
    return drift <= accuracy


@inner
def observe(model: Linkage, run: Run, t: float, share: float, purpose: int, trace: Trace) -> None:
    """Record the state at `t` (s), a share of the step, with multipliers, springs and Jacobian."""
    nodes, n, size = run.nodes, run.counters[0].recorded, model.lambdas.size
    dense(share, nodes.y.shape[1], nodes.y, run.f)
    if not project(model, t, nodes.y[POINT], nodes.dy[POINT], trace.accuracy):
        dense(share, nodes.y.shape[1], nodes.y, run.f)  # a singular position has no projection
    evaluate_nodes(model, t, 0.0, POINT, POINT, run.modes, nodes)
    run.counters[0].evaluations += 1
    record(model.contacts, run, POINT, t, purpose)
    for i in range(size):
        trace.forces[n, i] = model.lambdas[i]
        for k in range(model.masses.size):
            trace.jacobians[n, i, k] = model.jacobian[i, k]
    for k in range(model.pulls.shape[0]):
        for i in range(2):
            trace.forces[n, size + 2 * k + i] = model.pulls[k, i]


@kernel
def advance(model: Linkage, run: Run, settings: Settings, t_end: float, trace: Trace) -> int:
    """Integrate to `t_end` (s), or until a buffer is full; return a code as `integrate.advance` does."""
    nodes, clock, counters, y, dy = run.nodes, run.clock[0], run.counters[0], run.nodes.y, run.nodes.dy
    t, h, planned, status, turn = clock.time, clock.step, 0.0, REACHED, 3 * model.driven + 2
    if not counters.started:
        evaluate_nodes(model, t, 0.0, START, START, run.modes, nodes)
        counters.started = True
    while t < t_end:
        status = stop_code(run, settings, 0)
        if status != REACHED:
            break
        h = step_in_workpiece(model.load, nodes.slider[0], min(h, settings.largest))
        end = t + h if h < t_end - t else t_end
        h = min(h, t_end - t)
        evaluate_nodes(model, t, h, FIRST, END, run.modes, nodes)
        counters.evaluations += STAGES
        error, there = error_norm(h, dy, free_states(nodes), settings.tolerance, RATE_TIME), False
        if error <= 1.0:
            first, last, angle = nodes.slider[0], nodes.slider[END], y[START, turn] % (2.0 * math.pi)
            share = min(
                share_to_kink(model.load, first.y, h * first.vy, last.y, h * last.vy),
                share_to_kink(
                    model.torque,
                    -angle,
                    -h * dy[START, turn],
                    y[START, turn] - y[END, turn] - angle,
                    -h * dy[END, turn],
                ),
            )
            if share < 1.0 and t + share * h > t:
                h, planned = share * h, max(planned, h)
                continue
            prepare_dense_output(model, t, h, run)
            dense(1.0, y.shape[1], y, run.f)
            there = project(model, end, y[POINT], dy[POINT], trace.accuracy)
        factor = math.pow(error, -0.125) if 0.0 < error < math.inf else 4.0 if there else 0.0
        if not there:
            counters.rejected += 1
            h, planned = h * min(0.5, max(0.2, 0.9 * factor)), 0.0
            if t + 0.1 * h == t:
                status = STEP_TOO_SMALL
                break
            continue
        counters.steps += 1
        while run.instants[0, counters.instant] <= end:
            now = run.instants[0, counters.instant]
            observe(model, run, now, min(1.0, (now - t) / h), SAMPLE, trace)
            counters.instant += 1
        for k in range(PARTS + 1):
            observe(model, run, t + (end - t) * k / PARTS, k / PARTS, PART, trace)
        for k in range(y.shape[1]):
            y[START, k], dy[START, k] = y[POINT, k], dy[POINT, k]
        nodes.slider[0] = nodes.slider[POINT]
        t, h, planned = end, max(h * min(3.0, 0.9 * factor), planned), 0.0
    clock.time, clock.step = t, h
    return status


def singular_time(assembly: Assembly, times: Array, y: Array, jacobians: Array) -> float:
    """Return the first time (s) at which the smallest singular value has a minimum near zero, or infinity.

    Times (steps, PARTS + 1), states and Jacobians are those of whole steps.
    """
    if not assembly.model.rows:
        return math.inf
    size = assembly.model.masses.size
    sigma = smallest(jacobians * assembly.units) / assembly.sigma
    around = np.pad(sigma, ((0, 0), (1, 1)), constant_values=np.inf)
    lowest = (sigma <= around[:, :-2]) & (sigma <= around[:, 2:])
    change = np.abs(np.diff(sigma)).max(axis=1, initial=0.0, keepdims=True)
    for step, k in np.argwhere(lowest & (sigma - change < SINGULAR)).tolist():
        # Imported only where it is used: it takes longer than a short run.
        from scipy.interpolate import CubicHermiteSpline
        from scipy.optimize import minimize_scalar

        near = slice(max(k - 1, 0), k + 2)
        t, q, v = times[step, near], y[step, near, :size], y[step, near, size : 2 * size]
        path = CubicHermiteSpline(t, q, v)

        lower = minimize_scalar(
            lambda at, path=path: (
                smallest(jacobian(assembly.model, path(at)) * assembly.units) / assembly.sigma
            ),
            bounds=(t[0], t[-1]),
            method="bounded",
            options={"xatol": 1e-9 * (t[-1] - t[0])},
        )
        inside = lower.fun < sigma[step, k]
        # At the end of a step it may fall further in the next one; in the last it does where a drive locks.
        known = inside or k < PARTS or step == len(times) - 1
        if known and min(lower.fun, sigma[step, k]) < SINGULAR:
            return float(lower.x if inside else times[step, k])
    return math.inf


def channels(
    scene: Mapping[str, Any], model: Linkage, states: tuple[Array, Array, Array]
) -> dict[str, Array]:
    """Return all channels of states, derivatives and forces, shape (n, columns) each.

    Of gravity and residual only the change counts.
    """
    y, dy, forces = (each.T for each in states)
    size, count, pins = model.masses.size, y.shape[1], 2 * len(scene.get("pin", {}))
    q, v, (drive, lost, _) = y[:size], y[size : 2 * size], y[2 * size :]
    motion = np.concatenate(
        [each.reshape(size // 3, 3, count) for each in (q, v, dy[size : 2 * size])], axis=1
    )
    lambdas, pulls = -forces[: model.rows], forces[model.rows :].reshape(len(model.springs), 2, count)
    labels = [f"{body}.{word}" for body in scene["body"] for word in MOTION + ACCELERATIONS]
    labels += [f"{pin}.reaction_{axis}" for pin in scene.get("pin", {}) for axis in "xy"]
    labels += [f"{guide}.{what}" for guide in scene.get("guide", {}) for what in ("force", "moment")]
    labels += ["drive.torque"] * (model.omega != 0.0) + [
        f"{spring}.force" for spring in scene.get("spring", {})
    ]
    guides = pins + (model.omega != 0.0)
    rows = [
        *motion.reshape(3 * size, count),
        *lambdas[:pins],
        *lambdas[guides:],
        *lambdas[pins:guides],
        *pulls[:, 0],
    ]
    stretch, load = pulls[:, 1] - model.springs[:, 1:2], load_energy(model.load, q[3 * model.slider + 1])
    energies = {
        "kinetic": 0.5 * model.masses @ v**2,
        "gravity": model.weights @ q,
        "drive": drive,
        "spring": 0.5 * model.springs[:, 0] @ stretch**2,
        "damping": lost,
        "load": load,
    }
    signs = np.array([-1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
    energies["residual"] = signs @ np.stack([*energies.values()])
    return dict(zip(labels, rows, strict=True)) | {f"energy_{name}": row for name, row in energies.items()}


class Observation:
    """Samples, extrema and the balance of energies of a run with a number of cycles of a period (s)."""

    def __init__(
        self, scene: Mapping[str, Any], model: Linkage, run: Run, cycles: int, period: float
    ) -> None:
        self._scene, self._model = scene, model
        self._first: dict[str, Array] = {}
        none = np.empty((0, run.f.shape[1]))
        words = channels(scene, model, (none, none, np.empty((0, model.rows + model.pulls.size))))
        groups = {name: _group(name) for name in words if name != "energy_load" or exists(model.load)}
        self.names = [name for name, group in groups.items() if group in ("", *scene["output"]["groups"])]
        self.extrema = Extrema(len(self.names), cycles, period)
        self.samples = [np.empty((1 + len(self.names), 0))]
        """Time and channels, shape (1 + names, n) each."""
        self._flow, self._residual, self._time = 0.0, 0.0, 0.0

    def take(self, times: Array, sampled: NDArray[np.bool_], states: tuple[Array, Array, Array]) -> None:
        """Add rows, of samples and of the parts of steps."""
        every = channels(self._scene, self._model, states)
        self._first = self._first or {name: every[name][:1] for name in ("energy_gravity", "energy_residual")}
        for name, first in self._first.items():
            every[name] = every[name] - first
        *flows, residual = (np.abs(row) for name, row in every.items() if _group(name) == "energy")
        momentum = (
            np.abs(states[0][:, self._model.masses.size :][:, : self._model.masses.size]) @ self._model.masses
        )
        self._flow = max(self._flow, float(np.max(flows)) + float(momentum.max()))
        if not residual.max() <= self._residual:
            self._residual, self._time = float(residual.max()), float(times[residual.argmax()])
        values = np.stack([every[name] for name in self.names])
        self.samples.append(np.vstack([times, values])[:, sampled])
        times, values = times[~sampled], values[:, ~sampled]
        whole = times.size - times.size % (PARTS + 1)
        self.extrema.widen(times, values)
        for i, name in enumerate(self.names):
            if name.endswith(".x"):
                self.extrema.turn(times, values[i : i + 6], i)
            elif not name.endswith((".y", ".angle")):
                each = (row[:whole].reshape(-1, PARTS + 1) for row in (times, values[i]))
                self.extrema.widen_between(i, *each)

    def energy(self, bound: float) -> Invariant:
        """Return the largest spurious energy, relative to the largest energy."""
        share = self._residual / self._flow if self._residual != 0.0 else 0.0
        return Invariant(share, bound, "1", self._time)


def _group(name: str) -> str:
    """Return the group of a channel; empty: it is always there."""
    word = name.rpartition(".")[2]
    if word in MOTION:
        return ""
    return "accelerations" if word in ACCELERATIONS else "joints" if "." in name else "energy"


def run(scene: Mapping[str, Any], progress: Callable[[float], None] | None) -> Result:
    """Simulate a linkage's scene; raise as `read_linkage`."""
    assembly, output, cycles = read_linkage(scene), scene["output"], 1.0
    model, tolerance = assembly.model, float(scene["solver"]["reference"]["tolerance"])
    if model.omega != 0.0:
        period, cycles = 2.0 * math.pi / abs(model.omega), float(scene["drive"]["cycles"])
        interval = period / output["samples_per_cycle"]
    else:
        period = float(output["duration"])
        interval = period / output["samples"]
    times = np.arange(round(cycles * period / interval) + 1, dtype=np.float64) * interval
    t_end, largest = float(times[-1]), LARGEST_STEP * min(period, float(times[-1]))
    room = PARTS + 2 + math.ceil(largest / interval)
    instants = np.stack([np.append(times, np.inf), np.zeros(times.size + 1)])
    capacity = _STEPS * (PARTS + 1) + 4 * room
    state = new_run(assembly.start, 0, 1e-3 * largest, instants, capacity)
    trace = Trace(
        np.empty((capacity, model.rows + model.pulls.size)),
        np.empty((capacity, *assembly.units.shape)),
        # The angle of a drive is rounded.
        max(1e-3 * tolerance, 1e-12) + 1e-15 * abs(model.omega) * t_end,
    )
    observation = Observation(scene, model, state, max(1, math.ceil(cycles - 1e-9)), period)
    code, end, reported, counters = BUFFER_FULL, math.inf, 0.0, state.counters[0]
    while code == BUFFER_FULL and end == math.inf:
        code = advance(model, state, Settings(tolerance, largest, room, STEPS_LIMIT), t_end, trace)
        recorded, now = slice(int(counters["recorded"])), float(state.clock["time"][0])
        counters["recorded"] = 0
        at, purposes = state.rows.times[recorded], state.rows.purposes[recorded]
        y, dy, forces = state.rows.y[recorded], state.rows.dy[recorded], trace.forces[recorded]
        steps = np.flatnonzero(purposes == PART).reshape(-1, PARTS + 1)
        end = singular_time(assembly, at[steps], y[steps], trace.jacobians[steps])
        kept = (at <= end) & np.isfinite(dy).all(axis=1)
        if at.size:
            observation.take(at[kept], (purposes == SAMPLE)[kept], (y[kept], dy[kept], forces[kept]))
        if progress is not None and now - reported > 0.02 * t_end:
            reported = now
            progress(now / t_end)
    compiled.seal()
    energy = observation.energy(ENERGY * tolerance)
    status, remedy = _REMEDIES.get(code, ("success", ""))
    if end < math.inf:
        place = f"singular position at t = {end:.6g} s"
        status, remedy = "singular", f"{place}: the linkage loses its rank; end before it, or start elsewhere"
    elif status == "success" and (message := violation({"energy": energy})):
        status, remedy = VIOLATED, message
    sampled, *values = np.concatenate(observation.samples, axis=1)
    events = {"corner": np.empty(0, dtype=str)} | {name: np.empty(0) for name in EVENT_COLUMNS}
    result = name_results(observation.names, sampled, np.array(values), events, observation.extrema)
    provenance = {
        "formulation": assembly.formulation,
        "integrator": "DOP853 with projection",
        "settings": {"tolerance": tolerance, "largest_step_s": largest},
        "counters": {
            "steps": int(counters["steps"]),
            "rejected": int(counters["rejected"]),
            "rhs": int(counters["evaluations"]),
        },
        "invariants": {"energy": energy._asdict()},
    }
    return replace(result, provenance=provenance, status=status, remedy=remedy)
