"""The run of a planar linkage: steps that are projected onto the constraints, singular positions, the result.

The index-1 equations are integrated by DOP853. Without the projection after each step a linkage sticks where it
comes near a singular position; with it, a step leaps over. So the smallest singular value of the constraints'
Jacobian is followed along the dense output, and the run ends where a minimum of it is close to zero.
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
    FIRST_DENSE,
    LAST_DENSE,
    POINT,
    START,
    dense,
    error_norm,
    evaluate_nodes,
    free_states,
    prepare_dense,
)
from reference_model.invariants import VIOLATED, Invariant, violation
from reference_model.linkage import Array
from reference_model.planar import Assembly, assemble, project, stretch
from reference_model.results import EVENT_COLUMNS, Extrema, Result, name_results
from reference_model.state import Mode, Nodes, Records, new_nodes, records
from reference_model.steps import share_to_kink, step_in_workpiece
from reference_model.workpiece import exists, load_energy

SINGULAR = 1e-3
"""Smallest singular value, relative to that of the start, below which a position is singular."""
ENERGY = 1e3
"""Bound of the spurious energy, relative to what flows, in units of the tolerance."""
STEPS_LIMIT = 2_000_000
"""Attempted steps after which a run is stopped, some minutes."""
LARGEST_SHARE = 1.0 / 50.0
"""Longest step, as a share of the duration or of a cycle."""
PARTS = 6
"""Parts of each step at whose ends extrema and singular positions are looked for."""
_CHUNK = 128
FULL, REACHED, STEP_TOO_SMALL, STEP_LIMIT = range(4)
MOTION = ("x", "y", "angle", "vx", "vy", "omega")
ACCELERATIONS = ("ax", "ay", "alpha")
_REMEDIES = {
    STEP_TOO_SMALL: ("step-too-small", "steps are below the round-off of time"),
    STEP_LIMIT: ("work-limit", "shorten the run to less than was reached"),
}


class Height(NamedTuple):
    """A motion that may meet a kink of a load."""

    y: float
    vy: float
    ay: float


class Limits(NamedTuple):
    """Limits of the steps of a run."""

    tolerance: float
    largest: float
    """Longest step, s."""
    attempts: int


class Track(NamedTuple):
    """State of a run, and the rows that it leaves; each row is time, state, derivative, multipliers."""

    clock: Array
    """Time and next step, s."""
    counts: NDArray[np.int64]
    """Steps and samples in the buffers, samples, steps, attempts, evaluations in all."""
    nodes: Nodes
    modes: Records
    f: Array
    parts: Array
    """Rows at the ends of the parts of steps, shape (steps, PARTS + 1, columns), ..."""
    jacobians: Array
    """... and Jacobians, shape (steps, PARTS + 1, rows, 3 n)."""
    samples: Array
    """Rows of samples."""
    times: Array
    """Times of all samples, s, and infinity."""


@inner
def observe(model: Any, track: Track, t: float, share: float, accuracy: float, row: Array) -> bool:
    """Write the row of the state at `t` (s), a share of the step; return whether it meets the constraints."""
    nodes = track.nodes
    size = nodes.y.shape[1]
    dense(share, size, nodes.y, track.f)
    there = project(model, t, nodes.y[POINT], accuracy)
    evaluate_nodes(model, t, 0.0, POINT, POINT, track.modes, nodes)
    track.counts[5] += 1
    row[0] = t
    for k in range(size):
        row[1 + k], row[1 + size + k] = nodes.y[POINT, k], nodes.dy[POINT, k]
    for k in range(model.lambdas.size):
        row[1 + 2 * size + k] = model.lambdas[k]
    return there


@inlined
def share_to_any_kink(model: Any, nodes: Nodes, h: float) -> float:
    """Return the share of a step of `h` (s) before the first kink of load or torque; 1: there is none."""
    y, size = nodes.y, model.masses.size
    at, turn = model.loaded, model.driven
    angle = -(y[START, turn] % (2.0 * math.pi))
    beyond = angle - (y[END, turn] - y[START, turn])
    of_load = share_to_kink(
        model.load,
        Height(y[START, at], y[START, size + at], 0.0),
        Height(y[END, at], y[END, size + at], 0.0),
        h,
    )
    of_torque = share_to_kink(
        model.table, Height(angle, -y[START, size + turn], 0.0), Height(beyond, -y[END, size + turn], 0.0), h
    )
    return min(of_load, of_torque)


@kernel
def advance(model: Any, track: Track, limits: Limits) -> int:
    """Integrate to the last sample or until a buffer is full; return FULL, REACHED, STEP_TOO_SMALL, STEP_LIMIT."""
    nodes, counts, clock, modes = track.nodes, track.counts, track.clock, track.modes
    y, dy, at, size = nodes.y, nodes.dy, model.loaded, model.masses.size
    t_end, accuracy = track.times[track.times.size - 2], max(1e-3 * limits.tolerance, 1e-12)
    counts[0] = counts[1] = 0
    t, h, planned = clock[0], clock[1], 0.0
    if counts[4] == 0:
        evaluate_nodes(model, t, 0.0, START, START, modes, nodes)
    while t < t_end:
        due = np.searchsorted(track.times, t + min(limits.largest, t_end - t)) - counts[2] + 1
        if counts[0] == track.parts.shape[0] or counts[1] + due > track.samples.shape[0]:
            clock[0], clock[1] = t, h
            return FULL
        if counts[4] >= limits.attempts:
            return STEP_LIMIT
        h = step_in_workpiece(model.load, Height(y[0, at], y[0, size + at], dy[0, size + at]), h)
        h = min(h, limits.largest)
        final = h >= t_end - t
        h = t_end - t if final else h
        counts[4] += 1
        evaluate_nodes(model, t, h, FIRST, END, modes, nodes)
        error, there, part = error_norm(h, dy, free_states(nodes), limits.tolerance), False, counts[0]
        if error <= 1.0:
            share = share_to_any_kink(model, nodes, h)
            if share < 1.0 and t + share * h > t:
                planned, h = max(planned, h), h * share
                continue
            evaluate_nodes(model, t, h, FIRST_DENSE, LAST_DENSE, modes, nodes)
            prepare_dense(h, y, dy, track.f)
            end = t_end if final else t + h
            there = observe(model, track, end, 1.0, accuracy, track.parts[part, PARTS])
        if not there:
            h *= max(0.2, 0.9 * math.pow(error, -0.125)) if 1.0 < error < math.inf else 0.2
            planned = 0.0
            if t + 0.1 * h == t:
                return STEP_TOO_SMALL
            continue
        track.jacobians[part, PARTS] = model.jacobian
        for k in range(y.shape[1]):
            y[END, k], dy[END, k] = y[POINT, k], dy[POINT, k]
        for k in range(PARTS):
            observe(model, track, t + k * h / PARTS, k / PARTS, accuracy, track.parts[part, k])
            track.jacobians[part, k] = model.jacobian
        while track.times[counts[2]] <= end:
            now = track.times[counts[2]]
            observe(model, track, now, min(1.0, (now - t) / h), accuracy, track.samples[counts[1]])
            counts[1] += 1
            counts[2] += 1
        for k in range(y.shape[1]):
            y[START, k], dy[START, k] = y[END, k], dy[END, k]
        counts[0] += 1
        counts[3] += 1
        t = end
        h *= min(3.0, 0.9 * math.pow(error, -0.125)) if error > 0.0 else 3.0
        h, planned = max(h, planned), 0.0
    clock[0], clock[1] = t, h
    return REACHED


def singular_time(assembly: Assembly, parts: Array, jacobians: Array, last: bool) -> float:
    """Return the first time (s) at which the singular value has a minimum close to zero; infinite if none.

    `last` says whether the run ends with these steps.
    """
    sigma = assembly.sigmas(jacobians) / assembly.sigma
    size = assembly.model.masses.size
    around = np.pad(sigma, ((0, 0), (1, 1)), constant_values=np.inf)
    lowest = (sigma <= around[:, :-2]) & (sigma <= around[:, 2:])
    steepest = np.abs(np.diff(sigma)).max(axis=1, initial=0.0)
    for step, k in np.argwhere(lowest & (sigma - steepest[:, None] < SINGULAR)).tolist():
        # Imported only where it is used: it takes longer than a short run.
        from scipy.interpolate import CubicHermiteSpline
        from scipy.optimize import minimize_scalar

        near = parts[step, max(k - 1, 0) : k + 2]
        path = CubicHermiteSpline(near[:, 0], near[:, 1 : 1 + size], near[:, 1 + size : 1 + 2 * size])
        ends = near[0, 0], near[-1, 0]
        lower = minimize_scalar(
            lambda t, path=path: float(assembly.sigmas(assembly.jacobian_at(path(t)))),
            bounds=ends, method="bounded", options={"xatol": 1e-9 * (ends[1] - ends[0])},
        )  # fmt: skip
        inside = lower.fun / assembly.sigma < sigma[step, k]
        # At the end of a step it may fall further in the next one.
        if min(lower.fun / assembly.sigma, sigma[step, k]) < SINGULAR and (
            inside or k < PARTS or (last and step == len(parts) - 1)
        ):
            return float(lower.x) if inside else float(parts[step, k, 0])
    return math.inf


def channels(assembly: Assembly, rows: Array) -> dict[str, Array]:
    """Return all channels of rows, shape (n, columns); of gravity and residual the change is what counts."""
    model, names, size, rows = assembly.model, assembly.names, assembly.model.masses.size, rows.T
    q, v, works, a = (
        rows[1 : 1 + size],
        rows[1 + size :][:size],
        rows[1 + 2 * size :],
        rows[4 + 3 * size :][:size],
    )
    bodies = np.stack([q, v, a]).reshape(3, -1, 3, rows.shape[1])[:, :-1]
    labels = [f"{body}.{word}" for body in names["body"] for word in MOTION + ACCELERATIONS]
    motion = bodies.swapaxes(0, 1).reshape(len(labels), -1)
    labels += [f"{pin}.reaction_{axis}" for pin in names["pin"] for axis in "xy"]
    labels += [f"{guide}.{what}" for guide in names["guide"] for what in ("force", "moment")]
    labels += ["drive.torque"] * (model.omega != 0.0)
    out = dict(zip(labels, [*motion, *-rows[7 + 4 * size :]], strict=True))
    stored, load = np.zeros(rows.shape[1]), load_energy(model.load, q[model.loaded])
    for k, name in enumerate(names["spring"]):
        stiffness, free, damping = model.springs[k]
        _, _, length, rate = stretch(model, k, q, v)
        out[f"{name}.force"] = stiffness * (length - free) + damping * rate
        stored += 0.5 * stiffness * (length - free) ** 2
    kinetic, gravity, drive, lost = (
        0.5 * model.masses[:-3] @ v[:-3] ** 2,
        model.weights @ q,
        works[0],
        works[1],
    )
    out |= {
        "energy_kinetic": kinetic,
        "energy_gravity": gravity,
        "energy_drive": drive,
        "energy_spring": stored,
    }
    out |= {"energy_damping": lost} | ({"energy_load": load} if exists(model.load) else {})
    return out | {"energy_residual": drive + gravity - lost - kinetic - stored - load}


class Observation:
    """Samples, extrema and the balance of energies, from the rows of a run.

    `first` is the row at t = 0, `cycles` the number of begun cycles and their period (s).
    """

    def __init__(
        self, assembly: Assembly, groups: list[str], cycles: tuple[int, float], first: Array
    ) -> None:
        self._assembly, self._first = assembly, channels(assembly, first[None])
        words = {name: name.rpartition(".")[2] for name in self._first}
        group = {name: "" if word in MOTION else "accelerations" if word in ACCELERATIONS
                 else "joints" if "." in name else "energy" for name, word in words.items()}  # fmt: skip
        self.names = [name for name in words if group[name] in ("", *groups)]
        self._energies = [name for name in words if group[name] == "energy"]
        self.extrema, self.times, self.values = Extrema(len(self.names), *cycles), [], []
        self._flow, self._residual, self._time = 0.0, 0.0, 0.0

    def take(self, parts: Array, samples: Array, end: float) -> None:
        """Add the rows of steps and of samples until the time `end` (s)."""
        rows, whole = parts.reshape(-1, parts.shape[2]), parts[parts[:, -1, 0] <= end]
        rows, samples = rows[rows[:, 0] <= end], samples[samples[:, 0] <= end]
        values, times = self._channels(rows), rows[:, 0].copy()
        self.extrema.widen(times, values)
        for i, name in enumerate(self.names):
            if name.endswith(".x"):
                self.extrema.turn(times, values[i : i + 6], i)
            elif not name.endswith((".y", ".angle")):
                steps = values[i, : whole[..., 0].size].reshape(whole.shape[:2])
                self.extrema.widen_between(i, whole[..., 0], steps)
        self.times.append(samples[:, 0].copy())
        self.values.append(self._channels(samples))

    def _channels(self, rows: Array) -> Array:
        every = channels(self._assembly, rows)
        for name in ("energy_gravity", "energy_residual"):
            every[name] = every[name] - self._first[name]
        if len(rows):
            *flows, residual = (np.abs(every[name]) for name in self._energies)
            self._flow = max(self._flow, np.max(flows))
            if not residual.max() <= self._residual:
                self._residual, self._time = float(residual.max()), float(rows[residual.argmax(), 0])
        return np.stack([every[name] for name in self.names])

    def imbalance(self, bound: float) -> Invariant:
        """Return the largest spurious energy, relative to the largest energy that flows."""
        share = self._residual / self._flow if self._residual != 0.0 else 0.0
        return Invariant(share, bound, "1", self._time)


def _track(assembly: Assembly, times: Array, largest: float) -> Track:
    """Return a run at t = 0 with samples at the times (s) and steps up to the largest (s)."""
    nodes, (rows, columns) = new_nodes(assembly.start, 0), assembly.model.jacobian.shape
    size = nodes.y.shape[1]
    width = 1 + 2 * size + rows
    return Track(
        clock=np.array([0.0, 1e-3 * largest]),
        counts=np.zeros(6, np.int64),
        nodes=nodes,
        modes=records(Mode, 0),
        f=np.zeros((7, size)),
        parts=np.zeros((_CHUNK, PARTS + 1, width)),
        jacobians=np.empty((_CHUNK, PARTS + 1, rows, columns)),
        samples=np.empty((np.searchsorted(times, largest) + 1000, width)),
        times=np.append(times, np.inf),
    )


def run(scene: Mapping[str, Any], progress: Callable[[float], None] | None) -> Result:
    """Simulate the scene of a linkage; raise as `planar.assemble`."""
    assembly, output, solver = assemble(scene), scene["output"], scene["solver"]["reference"]
    tolerance, cycles, omega = float(solver["tolerance"]), 1.0, abs(assembly.model.omega)
    if omega:
        period, cycles = 2.0 * math.pi / omega, float(scene["drive"]["cycles"])
        count, interval = round(cycles * output["samples_per_cycle"]), period / output["samples_per_cycle"]
    else:
        count, period = output["samples"], float(output["duration"])
        interval = period / count
    times = np.arange(count + 1, dtype=np.float64) * interval
    limits = Limits(tolerance, LARGEST_SHARE * min(period, float(times[-1])), STEPS_LIMIT)
    track = _track(assembly, times, limits.largest)
    start = np.zeros(track.samples.shape[1])
    start[1 : 1 + track.nodes.y.shape[1]] = track.nodes.y[0]
    seen = Observation(assembly, output["groups"], (max(1, math.ceil(cycles - 1e-9)), period), start)
    end, code, reported = math.inf, FULL, 0.0
    while code == FULL and end == math.inf:
        code = int(advance(assembly.model, track, limits))
        steps, samples = track.counts[:2]
        parts = track.parts[:steps]
        end = singular_time(assembly, parts, track.jacobians[:steps], code != FULL)
        seen.take(parts, track.samples[:samples], end)
        if progress is not None and track.clock[0] - reported > 0.02 * times[-1]:
            reported = float(track.clock[0])
            progress(reported / times[-1])
    compiled.seal()
    energy = seen.imbalance(ENERGY * tolerance)
    status, remedy = _REMEDIES.get(code, ("success", ""))
    if end < math.inf:
        status = "singular"
        remedy = f"singular position at t = {end:.6g} s: the linkage loses its rank; end before it, or start elsewhere"
    elif status == "success" and (message := violation({"energy": energy})):
        status, remedy = VIOLATED, message
    accepted, attempts, others = track.counts[3:].tolist()
    rows, columns = (units.size for units in assembly.units)
    events = {"corner": np.empty(0, dtype=str)} | {name: np.empty(0) for name in EVENT_COLUMNS}
    result = name_results(
        seen.names, np.concatenate(seen.times), np.concatenate(seen.values, 1), events, seen.extrema
    )
    provenance = {
        "formulation": f"multiplier ({columns} coordinates, {rows} multipliers)",
        "integrator": "DOP853 with projection onto the constraints",
        "settings": {"tolerance": tolerance, "largest_step_s": limits.largest},
        "counters": {
            "steps": accepted,
            "rejected": attempts - accepted,
            "rhs": 12 * attempts + 3 * accepted + others,
        },
        "invariants": {"energy": energy._asdict()},
    }
    return replace(result, provenance=provenance, status=status, remedy=remedy)
