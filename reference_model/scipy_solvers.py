"""The equations of motion integrated by scipy's `solve_ivp`, from event to event.

The paper integrates its 15 coordinates with a variable-order backward differentiation formula (MATLAB's
ode15s), which is BDF here. Every margin of `reference_model.margins` is a terminal event of `solve_ivp`, so
the modes change as in `reference_model.integrate`. The solver starts anew after every event, and at each kink
of the load of a workpiece.

Scipy looks for an event only if a margin has opposite signs at the two ends of a step. It steps over a
contact that begins and ends within one step (`reference_model.integrate` isolates it for certain), and over
all else that turns twice. Steps of at most a fiftieth of a cycle make that rare, not impossible. Of two
events in one step the first is taken. A mode that is still past its end at a new start ends again.
Time counts from t = 0, not from the start of a cycle: beyond 16,000 cycles `cos_sin` loses digits.
"""

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from reference_model import events, integrate
from reference_model.compiled import kernel
from reference_model.dop853 import POINT, START, VELOCITY_TIME, evaluate, evaluate_nodes, free_states
from reference_model.formulations import Model
from reference_model.linkage import Array
from reference_model.margins import GATE, MARGINS, margin
from reference_model.parameters import Parameters
from reference_model.recording import EXTREMUM, SAMPLE, STEP, record
from reference_model.results import MARKS
from reference_model.state import Records, Run
from reference_model.steps import first_step_in_contact
from reference_model.workpiece import kinks

RTOL = 100.0 * float(np.finfo(np.float64).eps)
"""Smallest relative tolerance that scipy accepts. The tolerance of a scene is absolute: a coordinate of
0.55 m may have no larger error, as a contact is only some 1e-6 m deep."""
_UNCONTROLLED = 1e30
"""Tolerance of the impulses and works: as in `integrate` they are quadratures, whose errors do not act back.
Not infinite, as LSODA divides by its inverse."""
_POSITION, _VELOCITY = 1e-9, 1e-6
"""Increments of the Jacobian, m or rad and m/s or rad/s. Contacts are some um deep, so a thousandth of that
leaves both the curvature of the force and the round-off of the gap (1e-16 m) below 1e-3 of it: plenty for
Newton."""


@kernel
def begin(contacts: Records, run: Run) -> None:
    """Close the contacts that start inside their wall."""
    events.begin(contacts, run)


@kernel
def all_margins(contacts: Records, modes: Records, touches: Records, out: Array) -> None:
    """Write all margins, shape (contacts MARGINS,)."""
    for place in range(out.size):
        out[place] = margin(contacts, modes, touches, place // MARGINS, place % MARGINS, 1.0)


@kernel
def record_states(model: Model, run: Run, times: Array, purposes: Array, states: Array) -> int:
    """Record states, shape (n, size), at ascending times (s) until the buffer is full; return the number."""
    for i in range(times.size):
        if run.counters[0].recorded == run.rows.times.size:
            return i
        for m in range(states.shape[1]):
            run.nodes.y[POINT, m] = states[i, m]
        evaluate_nodes(model, times[i], 0.0, POINT, POINT, run.modes, run.nodes)
        record(model.contacts, run, POINT, times[i], purposes[i])
        if purposes[i] & STEP:
            run.counters[0].steps += 1
    return times.size


@kernel
def change_mode(contacts: Records, t: float, place: int, run: Run, tolerance: float) -> float:
    """Change the mode whose margin ended; return the longest first step (s) in a contact that begins then."""
    k = place // MARGINS
    had_touched = run.modes[k].speed > 0.0
    events.switch(contacts, t, place, run)
    speed = run.modes[k].speed
    if place % MARGINS == GATE and speed > 0.0 and not had_touched:
        return first_step_in_contact(contacts, k, speed, run.nodes.touches[0], tolerance)
    return math.inf


def jacobian(derivative: Callable[[float, Array], Array], t: float, y: Array, free: int) -> Array:
    """Return the derivative of dy/dt in frozen modes by differences, shape (size, size).

    The columns of the integrals behind the `free` states are zero: nothing depends on them.
    """
    out, reference = np.zeros((y.size, y.size)), derivative(t, y)
    for j in range(free):
        neighbour = y.copy()
        neighbour[j] += _POSITION if 2 * j < free else _VELOCITY
        out[:, j] = (derivative(t, neighbour) - reference) / (neighbour[j] - y[j])
    return out


class ScipySolver:
    """One run by one of scipy's solvers, with samples at `times` (s) and no step longer than `largest` (s).

    After `limit` steps and switches it is stopped. `drain` empties the buffer of recorded rows; `report` is
    called with the time (s) of each step.
    """

    def __init__(
        self, p: Parameters, model: Model, state: Run, times: Array, largest: float, limit: int,
        drain: Callable[[], None], report: Callable[[float], None],
    ) -> None:  # fmt: skip
        self._p, self._model, self._run, self._times = p, model, state, times
        self._t_end, self._drain, self._report = float(times[-1]), drain, report
        self._method = p.method.removeprefix("scipy-")
        self.name = f"scipy {self._method} with located events"
        self.settings = {"tolerance": p.tolerance, "largest_step_s": largest, "relative_tolerance": RTOL}
        self._first_step, self._last_step, self._largest = math.inf, largest, largest
        size = state.nodes.y.shape[1]
        self._atol = np.full(size, _UNCONTROLLED)
        self._free = free = int(free_states.py_func(state.nodes))  # type: ignore[attr-defined]
        self._atol[:free] = p.tolerance
        self._atol[free // 2 : free] /= VELOCITY_TIME
        self._limit, self._sampled = limit, 0
        self._work = np.zeros(3, dtype=np.int64)
        self._margins = np.empty(len(p.contacts) * MARGINS)
        y0 = state.nodes.y[0].copy()
        self._evaluate(0.0, y0, START)
        begin(model.contacts, state)
        record_states(model, state, np.zeros(1), np.array([EXTREMUM]), y0[None])

    def _evaluate(self, t: float, y: Array, node: int = POINT) -> Records:
        """Evaluate a state at `t` (s); return the states of its contacts."""
        nodes = self._run.nodes
        nodes.y[node] = y
        evaluate(self._model, t, node, self._run.modes, nodes)
        return nodes.touches[node]

    @property
    def counters(self) -> dict[str, int]:
        """Work so far; the evaluations behind a Jacobian are not among the right-hand sides."""
        counters, (rhs, jacobians, factorizations) = self._run.counters[0], map(int, self._work)
        implicit = {"jacobians": jacobians, "factorizations": factorizations}
        return {
            "steps": int(counters["steps"]),
            "rhs": rhs,
            **({} if self._method == "DOP853" else implicit),
            "switches": int(counters["switches"]),
            "contacts": int(counters["contacts"]),
        }

    def advance(self, t_stop: float) -> int:
        """Integrate until `t_stop` (s); return why it stopped, as `integrate.advance` does."""
        # LSODA warns of what its status says anyway; BDF reads differences that it has not yet written; trial
        # states may overflow before the step is shortened.
        with np.errstate(invalid="ignore", over="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            status = self._advance(t_stop)
        run = self._run
        if run.clock[0]["time"] >= self._t_end:
            self._keep(run.clock["time"], np.array([SAMPLE]), run.nodes.y[:1].copy())
        return status

    def _advance(self, t_stop: float) -> int:
        run, last_switches = self._run, self._run.counters[0]["switches"]
        while run.clock[0]["time"] < t_stop:
            if run.counters[0]["switches"] - last_switches > integrate.SWITCHES_AT_ONCE:
                return integrate.CHATTER
            t = float(run.clock[0]["time"])
            end_place = self._find_end(t)
            if end_place is None:
                solution = self._solve(t)
                if not np.isfinite(solution.y).all():
                    return integrate.NOT_FINITE
                if solution.status < 0:
                    # LSODA gives up where its first step is far too long, instead of shortening it.
                    self._first_step = 1e-3 * min(self._first_step, self._largest)
                    if solution.t[-1] > t or t + self._first_step == t:
                        return integrate.STEP_TOO_SMALL
                    continue
                self._work += solution.nfev, solution.njev, solution.nlu
                if solution.t[-1] > t:
                    last_switches = run.counters[0]["switches"]
                    self._record(solution)
                    run.clock[0]["time"], run.nodes.y[0] = solution.t[-1], solution.y[:, -1]
                    last = solution.sol.interpolants[-1]  # covers the whole step, also beyond the event
                    self._last_step = float(last.t - last.t_old)
                at_margins = solution.t_events[1 : 1 + len(self._places)]
                hits = [place for place, at in zip(self._places, at_margins, strict=True) if at.size]
                end_place = hits[0] if hits else None
                if solution.t_events[0].size:
                    return integrate.STEP_LIMIT
            if end_place is not None:
                t = float(run.clock[0]["time"])
                self._evaluate(t, run.nodes.y[0], START)
                first_step = change_mode(self._model.contacts, t, end_place, run, self._p.tolerance)
                # Scipy's own choice tries the forces far ahead of it, where a corner may be deep inside the
                # wall.
                self._first_step = min(0.5 * self._last_step, first_step)
            elif run.clock[0]["time"] < self._t_end:  # at a kink
                self._first_step = 0.5 * self._last_step
        return integrate.REACHED

    def _all_margins(self, t: float, y: Array) -> Array:
        all_margins(self._model.contacts, self._run.modes, self._evaluate(t, y), self._margins)
        return self._margins

    def _find_end(self, t: float) -> int | None:
        """Return the place of a margin that is below zero by more than the tolerance, if any."""
        margins, tolerance = self._all_margins(t, self._run.nodes.y[0]), self._p.tolerance
        limits = np.where(np.arange(margins.size) % MARGINS == GATE, tolerance, tolerance / VELOCITY_TIME)
        below = np.flatnonzero(margins < -limits)
        return int(below[0]) if below.size else None

    def _solve(self, t: float) -> Any:
        """Solve from `t` (s) to the end or to the first event, in the present modes."""
        run = self._run
        self._places = [
            int(place) for place in np.flatnonzero(np.isfinite(self._all_margins(t, run.nodes.y[0])))
        ]
        steps, limit, latest = int(run.counters[0]["steps"]), math.inf, t
        # Margins by time at both ends of a step, from the states there: LSODA's dense output, on which scipy
        # looks for the zero, differs from these by up to the tolerance.
        ends = {t: self._margins.copy()}

        def derivative(t: float, y: Array) -> Array:
            self._evaluate(t, y)
            dy: Array = run.nodes.dy[POINT].copy()
            return dy

        def steps_left(t: float, y: Array) -> float:
            """Note the end of each step, as solve_ivp evaluates it first; turn negative beyond the limit."""
            nonlocal steps, limit, latest
            if t > latest:  # otherwise scipy is searching for the zero
                margins = {latest: ends[latest], t: self._all_margins(t, y).copy()}
                ends.clear()
                ends.update(margins)
                latest, steps = t, steps + 1
                if steps + run.counters[0]["switches"] > self._limit:
                    limit = min(limit, t)
                self._report(float(t))
            return 1.0 if t < limit else -1.0

        def margin_at(place: int) -> Callable[[float, Array], float]:
            def value(t: float, y: Array) -> float:
                margins = ends[t] if t in ends else self._all_margins(t, y)
                return float(margins[place])

            value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
            return value

        def height_over(kink: float) -> Callable[[float, Array], float]:
            def value(t: float, y: Array) -> float:
                self._evaluate(t, y)
                return float(run.nodes.slider[POINT]["y"]) - kink

            # The event is a crossing from the side on which the slider is, or to which it is about to move.
            self._evaluate(t, run.nodes.y[0])
            above, speed = float(run.nodes.slider[POINT]["y"]) - kink, float(run.nodes.slider[POINT]["vy"])
            falls = above > 0.0 if abs(above) > self._p.tolerance else speed > 0.0
            value.terminal, value.direction = True, -1.0 if falls else 1.0  # type: ignore[attr-defined]
            return value

        steps_left.terminal = True  # type: ignore[attr-defined]
        options: dict[str, Any] = {}
        if self._method != "DOP853":
            # Where it overflows Newton's method fails with any matrix, and the solver halves its step.
            options["jac"] = lambda t, y: np.nan_to_num(
                jacobian(derivative, t, y, self._free), posinf=0.0, neginf=0.0
            )
        if math.isfinite(self._first_step):
            options["first_step"] = min(self._first_step, self._t_end - t)
        events = [steps_left, *map(margin_at, self._places), *map(height_over, kinks(self._p.load))]
        return solve_ivp(  # type: ignore[call-overload]
            derivative, (t, self._t_end), run.nodes.y[0].copy(), self._method, dense_output=True, rtol=RTOL,
            atol=self._atol, max_step=self._largest, events=events, **options,
        )  # fmt: skip

    def _record(self, solution: Any) -> None:
        """Record samples, marks, steps and the peaks of the contacts of one solution."""
        run, first, last = self._run, float(solution.t[0]), float(solution.t[-1])
        interval, count = self._p.period / MARKS, self._sampled
        # A sample at the end of a solution belongs to the next one: the right limit counts at a jump.
        samples = self._times[count : count + int(np.searchsorted(self._times[count:], last))]
        marks = interval * np.arange(math.ceil(first / interval), math.ceil(last / interval))
        peaks, ends = self._peaks(solution), solution.t[1:]
        inside = np.concatenate([samples, marks, peaks])
        times = np.concatenate([inside, ends])
        sizes = (samples.size, marks.size + peaks.size, ends.size)
        purposes = np.repeat([SAMPLE, EXTREMUM, EXTREMUM + STEP], sizes)
        inner_states = solution.sol(inside).T if inside.size else np.empty((0, run.nodes.y.shape[1]))
        states = np.concatenate([inner_states, solution.y[:, 1:].T])
        order = np.argsort(times, kind="stable")
        times, purposes, states = times[order], purposes[order], np.ascontiguousarray(states[order])
        self._sampled += samples.size
        self._keep(times, purposes, states)

    def _keep(self, times: Array, purposes: Array, states: Array) -> None:
        """Record states, and empty the buffer as often as it is full."""
        while times.size:
            count = record_states(self._model, self._run, times, purposes, states)
            times, purposes, states = times[count:], purposes[count:], states[count:]
            if times.size:
                self._drain()

    def _peaks(self, solution: Any) -> Array:
        """Return the times (s) at which force or depth of a closed contact is largest in a solution."""
        peaks = []

        def depth_or_force(t: float, k: int, quantity: str) -> float:
            """Return the gap (m) or the force (N) with its sign changed: least at the peak."""
            touches, contact = self._evaluate(t, solution.sol(t)), self._p.contacts[k]
            if quantity == "gap":
                return float(touches["gap"][k])
            side = touches["normal"][contact.other] if contact.one_side else 0.0
            return float(-touches["normal"][k] - side)

        for k in np.flatnonzero(self._run.modes["speed"] > 0.0).tolist():
            for quantity in ("normal", "gap"):
                values = [depth_or_force(t, k, quantity) for t in solution.t]
                best = int(np.argmin(values))
                lo, hi = solution.t[max(best - 1, 0)], solution.t[min(best + 1, solution.t.size - 1)]
                peak = minimize_scalar(
                    depth_or_force, bounds=(lo, hi), args=(k, quantity), method="bounded",
                    options={"xatol": 1e-5 * (hi - lo)},
                )  # fmt: skip
                if peak.fun < values[best]:
                    peaks.append(float(peak.x))
        return np.array(peaks)
