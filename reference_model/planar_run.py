"""The run of a planar linkage: projected steps, singular positions, channels.

The equations of index 1 are integrated by DOP853, and each accepted state is projected onto the constraints,
else a linkage would stick near a singular position. Contacts of clearances are located as in `integrate`, on
the path that ends at the projected state. A step may leap over a singular position: the smallest singular
value of the constraints' Jacobian is followed within steps; the run ends where a minimum is close to zero.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_model import compiled, dop853, integrate
from reference_model.compiled import inlined, inner, kernel, merged
from reference_model.dop853 import END, POINT, START, dense, evaluate_nodes
from reference_model.events import begin, first_end
from reference_model.formulations import derivative
from reference_model.invariants import VIOLATED, Invariant, check_contacts, violation
from reference_model.linkage import Array
from reference_model.margins import NONE, has_ended, unsettled
from reference_model.multiplier import Linkage, constraints, solve
from reference_model.observation import Pulses
from reference_model.planar import Assembly, jacobian, read_linkage
from reference_model.recording import EXTREMUM, PART, SAMPLE, STEP, find_peaks, find_top, record
from reference_model.results import Extrema, Result, name_results
from reference_model.running import event_table, new_run, unfinished_events
from reference_model.state import WORKS, WORST, Event, Records, Run, records
from reference_model.steps import share_to_kink, step_before_separation, step_in_workpiece
from reference_model.workpiece import exists, load_energy

SINGULAR = 1e-3
"""Smallest singular value, relative to that at the start, of a singular position."""
ENERGY = 1e3
"""Bound of the spurious energy over the largest one, in tolerances; ten times as much with contacts."""
RATE_TIME = 1e-2
"""Time in which the error of a rate counts as an error of position, s."""
WORK = 10.0
"""Local error of works, relative to what moves, in units of the tolerance."""
STEPS_LIMIT = 2_000_000
"""Attempted steps after which a run is stopped, some minutes."""
LARGEST_STEP = 1.0 / 50.0
"""Longest step, as a share of the duration or of a cycle."""
PARTS = 6
"""Parts of a step at whose ends extrema and singular positions are looked for."""
LOCKING = 0.1
"""Singular value, relative to that at the start, below which a speed drive may be about to lock."""
AHEAD = 1e-4
"""Longest time (s) before a lock at which steps that cover less than the remaining time end the run."""
_STEPS = 128
"""Steps after which the compiled integrator returns."""
_REMEDIES = {
    integrate.STEP_TOO_SMALL: ("step-too-small", "steps are below the round-off of time"),
    integrate.STEP_LIMIT: ("work-limit", "shorten the run to less than was reached"),
    integrate.CHATTER: ("chatter", "contacts open and close without end: choose a smaller tolerance"),
}
MOTION = ("x", "y", "angle", "vx", "vy", "omega")
ACCELERATIONS = ("ax", "ay", "alpha")
ENERGIES = ("kinetic", "gravity", "drive", "spring", "damping", "load", "contact", "friction", "residual")
_SIGNS = np.array([-1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0])
"""Of the energies in the residual."""


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
def project(model: Linkage, t: float, y: Array, change: Array) -> bool:
    """Move a state at `t` (s) onto the constraints and their rates; return whether this succeeds."""
    size, drift, rounding = model.masses.size, math.inf, 1e-12 + 1e-15 * abs(model.omega) * t
    q, v = y[:size], y[size : 2 * size]
    constraints(model, t, q, v)
    for _ in range(6):
        correct(model, model.phi, q, change[:size])
        constraints(model, t, q, v)
        drift = 0.0
        for row in range(model.lambdas.size):
            drift += abs(model.phi[row])
        if drift <= rounding:
            break
    correct(model, model.rate, v, change[:size])
    return drift <= rounding


@inner
def observe(
    model: Linkage, run: Run, t: float, share: float, purpose: int, forces: Array, jacobians: Array
) -> None:
    """Record the state at `t` (s), a share of the step; see `advance`."""
    nodes, n, size = run.nodes, run.counters[0].recorded, model.lambdas.size
    dense(share, nodes.y.shape[1], nodes.y, run.f)
    # Contacts are located on the path as it is.
    if model.contacts.size == 0 and not project(model, t, nodes.y[POINT], nodes.dy[POINT]):
        dense(share, nodes.y.shape[1], nodes.y, run.f)  # a singular position has no projection
    evaluate_nodes(model, t, 0.0, POINT, POINT, run.modes, nodes)
    run.counters[0].evaluations += 1
    record(model.contacts, run, POINT, t, purpose)
    for i in range(size):
        forces[n, i] = model.lambdas[i]
        for k in range(model.masses.size):
            jacobians[n, i, k] = model.jacobian[i, k]
    for k in range(model.pulls.size):
        forces[n, size + k] = model.pulls.flat[k]


@merged
def work_error(model: Linkage, run: Run, h: float, free: int, tolerance: float) -> float:
    """Return the error of the works in a step of `h` (s), in units of the tolerance.

    No error of the motion knows of the work of a drive that prescribes it, or of a clipped contact.
    """
    size, moves = model.masses.size, 0.0
    for k in range(size):
        speed = abs(run.nodes.y[END, size + k])
        moves += model.masses[k] * speed * (1.0 + 0.5 * speed)
    if not moves > 0.0:
        return 0.0
    return dop853.error_norm(h, run.nodes.dy[:, free:], WORKS, WORK * tolerance * moves)


@merged
def accept(model: Linkage, run: Run, t: float, end: float, h: float, forces: Array, jacobians: Array) -> None:
    """Record a step of `h` from `t` to `end` (s), and go on to its end."""
    nodes, counters = run.nodes, run.counters[0]
    counters.steps += 1
    while run.instants[0, counters.instant] <= end:
        now = run.instants[0, counters.instant]
        observe(model, run, now, min(1.0, (now - t) / h), SAMPLE, forces, jacobians)
        counters.instant += 1
    find_peaks(model.contacts, run, run.peaks)
    for k in range(run.peaks.size):
        if run.peaks.flat[k]:
            top = find_top(model, run, t, h, k)
            observe(model, run, t + top * h, top, EXTREMUM, forces, jacobians)
    for k in range(PARTS + 1):
        purpose = PART if k < PARTS else PART + STEP + EXTREMUM
        observe(model, run, t + (end - t) * k / PARTS, k / PARTS, purpose, forces, jacobians)
    for k in range(nodes.y.shape[1]):
        nodes.y[START, k], nodes.dy[START, k] = nodes.y[POINT, k], nodes.dy[POINT, k]
    for k in range(model.contacts.size):
        nodes.touches[START, k] = nodes.touches[POINT, k]
    nodes.slider[0] = nodes.slider[POINT]


@kernel
def advance(
    model: Linkage, run: Run, settings: integrate.Settings, t_end: float, forces: Array, jacobians: Array
) -> int:
    """Integrate to `t_end` (s), or until a buffer is full; return a code as `integrate.advance` does.

    With each row go the multipliers and `pulls`, shape (n, rows + pulls), and the constraints' Jacobian, (n,
    rows, columns).
    """
    contacts, modes, place, n_located = model.contacts, run.modes, NONE, 0
    nodes, clock, counters, y, dy = run.nodes, run.clock[0], run.counters[0], run.nodes.y, run.nodes.dy
    t, h, next_h, status, turn = clock.time, clock.step, 0.0, integrate.REACHED, 3 * model.driven + 2
    if not counters.started:
        evaluate_nodes(model, t, 0.0, START, START, modes, nodes)
        if contacts.size > 0:
            begin(contacts, run)
            evaluate_nodes(model, t, 0.0, START, START, modes, nodes)
        counters.started = True
    last_switches = counters.switches
    while t < t_end:
        status = integrate.stop_code(run, settings, last_switches)
        if status != integrate.REACHED:
            break
        h = min(h, settings.largest)
        h = step_before_separation(contacts, modes, nodes.touches[0], h, settings.tolerance)
        h = step_in_workpiece(model.load, nodes.slider[0], h)
        end = t + h if h < t_end - t else t_end
        h = min(h, t_end - t)
        evaluate_nodes(model, t, h, dop853.FIRST, END, modes, nodes)
        counters.evaluations += dop853.STAGES
        free, there = dop853.free_states(nodes), False
        error = dop853.error_norm(h, dy, free, settings.tolerance, RATE_TIME)
        if model.omega != 0.0 or contacts.size > 0:
            error = max(error, work_error(model, run, h, free, settings.tolerance))
        factor = math.pow(error, -0.125) if 0.0 < error < math.inf else 4.0 if error == 0.0 else 0.0
        if error <= 1.0:
            first, last, angle = nodes.slider[0], nodes.slider[END], -(y[START, turn] % (2.0 * math.pi))
            share = share_to_kink(model.load, first.y, h * first.vy, last.y, h * last.vy)
            d0, d1, later = -h * dy[START, turn], -h * dy[END, turn], angle + y[START, turn] - y[END, turn]
            share = min(share, share_to_kink(model.torque, angle, d0, later, d1))
            if share < 1.0 and t + share * h > t:
                h, next_h, place = share * h, max(next_h, h), NONE
                continue
            if contacts.size > 0:
                there = project(model, end, y[END], dy[POINT])
                derivative(model, end, END, modes, nodes)
            integrate.prepare_dense_output(model, t, h, run)
            if contacts.size == 0:
                dense(1.0, y.shape[1], y, run.f)
                there = project(model, end, y[POINT], dy[POINT])
            elif there and unsettled(contacts, modes, nodes.touches, h, run.scales, run.unsettled):
                share, ends = first_end(model, t, h, run) if n_located < integrate.LOCATIONS else (1.0, place)
                if ends != NONE or t + share * h > t:
                    place = ends if ends != NONE or share < 1.0 else place
                    if share < 1.0:
                        next_h = max(next_h, h * min(3.0, 0.9 * factor)) if n_located == 0 else next_h
                        h, n_located = share * h, n_located + 1
                        if t + h == t:
                            h = integrate.change_mode(model, run, t, next_h, place, settings.tolerance)
                            place, n_located, next_h = NONE, 0, 0.0
                        continue
        if not there:
            counters.rejected += 1
            factor = factor if error > 0.0 else 0.0
            h, next_h, place, n_located = h * min(0.5, max(0.2, 0.9 * factor)), 0.0, NONE, 0
            if t + 0.1 * h == t:
                status = integrate.STEP_TOO_SMALL
                break
            continue
        if place != NONE and not has_ended(contacts, modes, nodes.touches[END], place, run.scales):
            place, next_h = NONE, min(next_h, h)
        accept(model, run, t, end, h, forces, jacobians)
        t, h, next_h = end, max(h * min(3.0, 0.9 * factor), next_h), 0.0
        last_switches = counters.switches
        if integrate.nothing_touches(modes):
            clock.flight_step = h
        if place != NONE:
            h = integrate.change_mode(model, run, t, h, place, settings.tolerance)
        place, n_located = NONE, 0
    clock.time, clock.step = t, h
    return status


def singular_time(assembly: Assembly, times: Array, y: Array, jacobians: Array) -> float:
    """Return the time (s) of the first minimum of a singular value near zero, or of a lock; else infinity.

    Times (steps, PARTS + 1), states and Jacobians are those of whole steps.
    """
    if len(times):  # short steps hardly change the Jacobian, nor by Weyl's inequality its singular values
        largest_change = np.linalg.norm((jacobians - jacobians[0, 0]) * assembly.units, axis=(2, 3)).max()
        if assembly.sigma(jacobians[0, 0]) - 2.0 * largest_change / assembly.smallest > LOCKING:
            return math.inf
    sigma, size = assembly.sigma(jacobians), assembly.model.masses.size
    around = np.pad(sigma, ((0, 0), (1, 1)), constant_values=np.inf)
    lowest = (sigma <= around[:, :-2]) & (sigma <= around[:, 2:])
    change = np.abs(np.diff(sigma)).max(axis=1, initial=0.0, keepdims=True)
    for step, k in np.argwhere(lowest & (sigma - change < SINGULAR)).tolist():
        # Imported only where they are used: it takes longer than a short run.
        from scipy.interpolate import CubicHermiteSpline
        from scipy.optimize import minimize_scalar

        neighbours = slice(max(k - 1, 0), k + 2)
        t, states = times[step, neighbours], y[step, neighbours]
        path = CubicHermiteSpline(t, states[:, :size], states[:, size : 2 * size])
        lower = minimize_scalar(
            lambda at, path=path: assembly.sigma(jacobian(assembly.model, path(at))),
            bounds=(t[0], t[-1]), method="bounded", options={"xatol": 1e-9 * (t[-1] - t[0])},
        )  # fmt: skip
        inside = lower.fun < sigma[step, k]
        # At the end of a step it may fall further in the next one; in the last it does where a drive locks.
        is_minimum = inside or k < PARTS or step == len(times) - 1
        if is_minimum and min(lower.fun, sigma[step, k]) < SINGULAR:
            return float(lower.x if inside else times[step, k])
    # Where a drive locks, the square of the singular value falls at a finite rate; steps at round-off creep.
    if assembly.model.omega != 0.0 and len(times):
        (first, last), duration = sigma.flat[[0, -1]] ** 2, times[-1, -1] - times[0, 0]
        remaining_time = last * duration / (first - last) if last < first < LOCKING**2 else math.inf
        if duration < remaining_time < AHEAD:
            return float(times[-1, -1] + remaining_time)
    return math.inf


class Observation:
    """Samples, extrema and the balance of energies of a run with a number of cycles of a period (s)."""

    def __init__(self, scene: Mapping[str, Any], assembly: Assembly, cycles: int, period: float) -> None:
        model = self._model = assembly.model
        self._springs, pins, loose = (
            [*scene.get("spring", {})],
            scene.get("pin", {}),
            scene.get("clearance", {}),
        )
        words = dict.fromkeys(pins, ("reaction_x", "reaction_y"))
        words |= dict.fromkeys(scene.get("guide", {}), ("force", "moment"))
        drive, place = ["drive.torque"] * (model.omega != 0.0), 2 * model.ideal[0]
        ideal = [f"{joint}.{word}" for joint in words if joint not in loose for word in words[joint]]
        self._rows = [*ideal[:place], *drive, *ideal[place:]]
        """Channels in the order of the rows, and of what `Linkage.pulls` holds of clearances."""
        rows = {name: ("x", "y", *words[name]) if name in pins else (*words[name], "", "") for name in loose}
        self._loose = [f"{name}.{word}" for name in loose for word in rows[name]]
        self._contact_prefixes = [f"{name}{'_' if '.' in name else '.'}" for name in assembly.contacts]
        self._groups = {f"{body}.{word}": "" if word in MOTION else "accelerations"
                        for body in scene["body"] for word in MOTION + ACCELERATIONS}  # fmt: skip
        for contact in self._contact_prefixes:
            axes = ["gap"] if contact.endswith("_") else ["x", "y"]
            self._groups |= {f"{contact}{word}": "contacts" for word in (*axes, "normal", "friction")}
        self._groups |= {f"{joint}.{word}": "joints" for joint in words for word in words[joint]}
        self._groups |= dict.fromkeys([*drive, *(f"{spring}.force" for spring in self._springs)], "joints")
        omissions = [*([] if loose else ["contact", "friction"]), *([] if exists(model.load) else ["load"])]
        self._groups |= {f"energy_{name}": "energy" for name in ENERGIES if name not in omissions}
        self.names = [name for name, of in self._groups.items() if of in ("", *scene["output"]["groups"])]
        self.pulses = Pulses([*assembly.contacts.values()])
        self.extrema = Extrema(len(self.names), cycles, period)
        self.samples = [np.empty((1 + len(self.names), 0))]
        """Time and channels, shape (1 + names, n) each."""
        self._first: dict[str, Array] = {}
        self._flow, self._residual, self._time = 0.0, 0.0, 0.0

    def _channels(self, y: Array, dy: Array, forces: Array, touches: Records) -> dict[str, Array]:
        """Return all channels of states, derivatives, forces and contacts, shape (n, columns) each."""
        model, size, count, rows = self._model, self._model.masses.size, len(y), len(self._rows)
        q, v, a, works = y.T[:size], y.T[size : 2 * size], dy.T[size : 2 * size], y.T[-WORKS:]
        motion = np.concatenate([each.reshape(size // 3, 3, count) for each in (q, v, a)], axis=1)
        out = dict(zip(self._groups, motion.reshape(3 * size, count), strict=False))
        pulls, loads = np.split(forces.T[rows:], [2 * len(self._springs)])
        out |= zip(self._rows, -forces.T[:rows], strict=True)
        out |= zip(self._loose, loads, strict=True)
        out |= {f"{spring}.force": pull for spring, pull in zip(self._springs, pulls[::2], strict=True)}
        for k, contact in enumerate(self._contact_prefixes):
            touch = touches[:, k]
            out |= {f"{contact}gap": touch["gap"], f"{contact}normal": np.maximum(touch["normal"], 0.0)}
            out[f"{contact}friction"] = touch["friction"]
        energies = [0.5 * model.masses @ v**2, model.weights @ q, works[0],
                    0.5 * model.springs[:, 0] @ (pulls[1::2] - model.springs[:, 1:2]) ** 2, works[1],
                    load_energy(model.load, q[3 * model.slider + 1])]  # fmt: skip
        energies += [touches["stored"].sum(axis=1), works[2]] if self._contact_prefixes else []
        out |= {f"energy_{name}": each for name, each in zip(ENERGIES, energies, strict=False)}
        out["energy_residual"] = _SIGNS[: len(energies)] @ np.stack(energies)
        return {name: out[name] for name in self._groups}

    def take(self, times: Array, purposes: NDArray[np.int64], *states: Any) -> None:
        """Add rows, of samples, of the parts of steps and of peaks."""
        table, masses = self._channels(*states), self._model.masses
        self._first = self._first or {name: table[name][:1] for name in ("energy_gravity", "energy_residual")}
        for name, first in self._first.items():
            table[name] = table[name] - first
        *flows, residual = (np.abs(row) for name, row in table.items() if self._groups[name] == "energy")
        momentum = np.abs(states[0][:, masses.size : 2 * masses.size]) @ masses
        self._flow = max(self._flow, float(np.max(flows)) + float(momentum.max()))
        if not residual.max() <= self._residual:
            self._residual, self._time = float(residual.max()), float(times[residual.argmax()])
        values, is_sample = np.stack([table[name] for name in self.names]), (purposes & SAMPLE) > 0
        self.samples.append(np.vstack([times, values])[:, is_sample])
        self.pulses.note(times, purposes, states[-1])
        self.extrema.widen(times[~is_sample], values[:, ~is_sample])
        parts = (purposes & PART) > 0
        times, values = times[parts], values[:, parts]
        whole = times.size - times.size % (PARTS + 1)
        for i, name in enumerate(self.names):
            moves = self._groups[name] == ""
            if moves and name.endswith(".x"):
                self.extrema.turn(times, values[i : i + 6], i)
            elif not (moves and name.endswith((".y", ".angle"))):
                each = (row[:whole].reshape(-1, PARTS + 1) for row in (times, values[i]))
                self.extrema.widen_between(i, *each)

    def energy(self, bound: float) -> Invariant:
        """Return the largest spurious energy, relative to the largest energy, and momentum times 1 m/s."""
        share = self._residual / self._flow if self._residual != 0.0 else 0.0
        return Invariant(share, bound, "1", self._time)


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
    contacts = assembly.contacts
    room = PARTS + 2 + math.ceil(largest / interval) + 2 * len(contacts)
    instants = np.stack([np.append(times, np.inf), np.zeros(times.size + 1)])
    capacity = _STEPS * (PARTS + 1) + 2 * room
    state = new_run(assembly.start, len(contacts), 1e-3 * largest, instants, capacity)
    forces = np.empty((capacity, model.rows + model.pulls.size))
    jacobians = np.empty((capacity, *assembly.units.shape))
    settings = integrate.Settings(tolerance, largest, room, STEPS_LIMIT)
    observation = Observation(scene, assembly, max(1, math.ceil(cycles - 1e-9)), period)
    events = [records(Event, 0)]
    code, end, last_report, counters = integrate.BUFFER_FULL, math.inf, 0.0, state.counters[0]
    while code == integrate.BUFFER_FULL and end == math.inf:
        code = advance(model, state, settings, t_end, forces, jacobians)
        n, now = int(counters["recorded"]), float(state.clock["time"][0])
        row_times, y, dy, counters["recorded"] = state.rows.times[:n], state.rows.y[:n], state.rows.dy[:n], 0
        events.append(state.events[: counters["events"]].copy())
        purposes, touches, counters["events"] = state.rows.purposes[:n], state.rows.touches[:n], 0
        steps = np.flatnonzero(purposes & PART).reshape(-1, PARTS + 1)
        if model.rows:
            end = singular_time(assembly, row_times[steps], y[steps], jacobians[steps])
        rows = np.flatnonzero((row_times <= end) & np.isfinite(dy).all(axis=1))
        if rows.size:
            observation.take(row_times[rows], purposes[rows], y[rows], dy[rows], forces[rows], touches[rows])
        if progress is not None and now - last_report > 0.02 * t_end:
            last_report = now
            progress(now / t_end)
    compiled.seal()
    contact_events = np.concatenate([*events, unfinished_events([*contacts.values()], state)])
    # Of contacts that begin at one instant the first in the list comes first.
    contact_events = contact_events[np.argsort(contact_events["contact"], kind="stable")]
    contact_events, table = event_table(contact_events[contact_events["start"] <= end], [*contacts])
    invariants, worst = (
        {"energy": observation.energy(ENERGY * tolerance * (10.0 if contacts else 1.0))},
        state.worst.tolist(),
    )
    if contacts:
        mobility = 2.0 * float((1.0 / model.masses[::3] + assembly.size**2 / model.masses[2::3]).max())
        arguments = dict(zip(WORST, worst, strict=True)), contact_events, t_end, tolerance, mobility, math.inf
        invariants = check_contacts(contacts, *arguments) | invariants
    status, remedy = _REMEDIES.get(code, ("success", ""))
    if end < math.inf:
        place = f"singular position at t = {end:.6g} s"
        status, remedy = "singular", f"{place}: the linkage loses its rank; end before it, or start elsewhere"
    elif status == "success" and (message := violation(invariants)):
        status, remedy = VIOLATED, message
    sample_times, *values = np.concatenate(observation.samples, axis=1)
    result = name_results(observation.names, sample_times, np.array(values), table, observation.extrema)
    pulses = observation.pulses.table(table, contact_events["contact"])
    provenance = {
        "formulation": assembly.formulation,
        "integrator": "DOP853 with projection",
        "settings": {"tolerance": tolerance, "largest_step_s": largest},
        "counters": {"rhs": int(counters["evaluations"])}
        | {k: int(counters[k]) for k in ("steps", "rejected", *(["switches", "contacts"] * bool(contacts)))},
        "invariants": {name: each._asdict() for name, each in invariants.items()},
    }
    return replace(result, pulses=pulses, provenance=provenance, status=status, remedy=remedy)
