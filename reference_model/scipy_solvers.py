"""The equations of motion integrated by scipy's `solve_ivp`, from event to event.

The paper integrates its 15 coordinates with a variable-order backward differentiation formula (MATLAB's
ode15s), which is BDF here. Every margin of `reference_model.margins` is a terminal event of `solve_ivp`, so
the modes change as in `reference_model.integrate`; after every event the solver starts anew.

What that misses: scipy looks for an event only where a margin has opposite signs at the two ends of a step. A
contact that begins and ends within one step is stepped over (`reference_model.integrate` isolates it for
certain), and so is whatever else turns twice. Steps of at most a fiftieth of a cycle make that rare, not
impossible. Of two events in one step the first is taken. A mode that is still past its end where the solver
starts has ended once more.
"""

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from reference_model import integrate
from reference_model.compiled import kernel
from reference_model.contact import CONTACTS, GAP, JOURNAL, MEMORY, NORMAL, TAIL, no_contacts
from reference_model.dop853 import VELOCITY_TIME, Work
from reference_model.equations import Model, evaluate, right_hand_side
from reference_model.events import ENDED, RECORDED, SAMPLES, STEPS, SWITCHES, Run, note_forces, switch
from reference_model.integrate import first_step_in_contact
from reference_model.linkage import Array
from reference_model.margins import GATE, MARGINS, margin
from reference_model.parameters import FOUNDATION, Law, Parameters
from reference_model.recording import EXTREMUM, SAMPLE, STEP, record

RTOL = 100.0 * float(np.finfo(np.float64).eps)
"""The smallest that scipy takes. The tolerance of a scene is absolute: that a coordinate is 0.55 m long makes
no larger error of it harmless, as a contact is only some 1e-6 m deep."""
_UNCONTROLLED = 1e30
"""Tolerance of the impulses and works: as in `integrate` they are quadratures, whose errors do not act back.
Not infinite, as LSODA divides by its inverse."""
_POSITION, _VELOCITY = 1e-9, 1e-6
"""Increments of the Jacobian, m or rad and m/s or rad/s. Contacts are some um deep, so a thousandth of that
leaves both the curvature of the force and the round-off of the gap (1e-16 m) below 1e-3 of it: plenty for
Newton."""


@kernel
def margins_in(
    model: Model,
    law: Law,
    t: float,
    y: Array,
    run: Run,
    dy: Array,
    contacts: Array,
    slider: Array,
    out: Array,
) -> None:
    """Write all margins (CONTACTS MARGINS,); infinite those of contacts that do not exist."""
    right_hand_side(model, law, t, -1, y, run.modes, dy, contacts, slider)
    for place in range(out.size):
        k = place // MARGINS
        out[place] = (
            margin(law, run.modes, k, place % MARGINS, contacts, 1.0)
            if contacts[GAP + k] < math.inf
            else math.inf
        )


@kernel
def record_states(
    model: Model, law: Law, run: Run, times: Array, purposes: Array, states: Array, dy: Array, slider: Array
) -> int:
    """Record states, shape (n, size), at ascending times (s), as far as the buffer goes; return how many.

    Those at the ends of steps count for the peaks of the contacts, and where the run is.
    """
    for i in range(times.size):
        if run.counters[RECORDED] == run.rows.shape[0]:
            return i
        right_hand_side(model, law, times[i], -1, states[i], run.modes, dy, run.contacts, slider)
        record(run, times[i], purposes[i], states[i], dy, run.contacts, slider)
        if purposes[i] != SAMPLE:
            note_forces(law, run.modes, run.contacts, run.open_contacts)
        if purposes[i] & STEP:
            run.counters[STEPS] += 1
    return times.size


@kernel
def change_mode(law: Law, t: float, place: int, run: Run, tolerance: float) -> float:
    """Change the mode whose margin ended; return the first step (s) that the force allows then."""
    had_touched = run.modes[MEMORY + place // MARGINS] > 0.0
    switch(law, t, place, run.contacts, run)
    speed = run.modes[MEMORY + place // MARGINS]
    if place % MARGINS == GATE and speed > 0.0 and not had_touched:
        return first_step_in_contact(law, place // MARGINS, speed, run.contacts, tolerance)
    return math.inf


@kernel
def jacobian(
    model: Model, law: Law, t: float, y: Array, run: Run, dy: Array, contacts: Array, slider: Array
) -> Array:
    """Return the derivative of dy/dt in frozen modes by differences, shape (size, size).

    The columns of the integrals behind the coordinates are zero: nothing depends on them.
    """
    size, free = y.size, y.size - TAIL
    moved, reference, out = y.copy(), np.empty(size), np.zeros((size, size))
    right_hand_side(model, law, t, -1, y, run.modes, reference, contacts, slider)
    for j in range(free):
        moved[j] = y[j] + (_POSITION if 2 * j < free else _VELOCITY)
        right_hand_side(model, law, t, -1, moved, run.modes, dy, contacts, slider)
        for i in range(size):
            out[i, j] = (dy[i] - reference[i]) / (moved[j] - y[j])
        moved[j] = y[j]
    return out


class ScipySolver:
    """One run by one of scipy's solvers.

    Parameters
    ----------
    p, model, state, work
        Parameters, formulation, the run, which is updated in place, and the compiled integrator's arrays.
    t_end
        s.
    largest
        Longest step, s.
    limit
        Steps and switches after which the run is stopped.
    drain
        Empties the buffer of recorded rows.
    report
        Called with the time (s) of each step.
    """

    def __init__(
        self, p: Parameters, model: Model, state: Run, work: Work, t_end: float, largest: float, limit: int,
        drain: Callable[[], None], report: Callable[[float], None],
    ) -> None:  # fmt: skip
        self._p, self._model, self._run, self._work = p, model, state, work
        self._t_end, self._drain, self._report = t_end, drain, report
        self._method = p.method.removeprefix("scipy-")
        self.name = f"scipy {self._method} with located events"
        self.settings = {"tolerance": p.tolerance, "largest_step_s": largest, "relative_tolerance": RTOL}
        self._first_step, self._last_step, self._largest = math.inf, largest, largest
        size = state.y.size
        self._atol = np.full(size, _UNCONTROLLED)
        self._atol[: size - TAIL] = p.tolerance
        self._atol[(size - TAIL) // 2 : size - TAIL] /= VELOCITY_TIME
        self._limit = limit
        self._spent = np.zeros(3, dtype=np.int64)
        self._dy, self._contacts, self._slider = np.empty(size), no_contacts(), np.empty(9)
        self._margins, self._margins_at = np.empty(CONTACTS * MARGINS), math.nan
        self._pass(0.0)  # begins the run

    def _pass(self, t_end: float) -> None:
        """Let the compiled integrator begin the run, or take its last sample at `t_end` (s)."""
        run = self._run
        integrate.advance(
            self._model,
            self._p.law,
            run,
            self._work,
            0.0,
            t_end if t_end else math.inf,
            1.0,
            1.0,
            0,
            self._limit,
        )

    @property
    def counters(self) -> dict[str, int]:
        """Work so far; the evaluations behind a Jacobian are not among the right-hand sides."""
        counters, (rhs, jacobians, factorizations) = self._run.counters, map(int, self._spent)
        implicit = {"jacobians": jacobians, "factorizations": factorizations}
        return {
            "steps": int(counters[STEPS]),
            "rhs": rhs,
            **({} if self._method == "DOP853" else implicit),
            "switches": int(counters[SWITCHES]),
            "contacts": int(counters[ENDED]),
        }

    def advance(self, t_stop: float) -> int:
        """Integrate until `t_stop` (s); return why it stopped, as `integrate.advance` does."""
        # LSODA warns of what its status says anyway; BDF reads differences that it has not yet written; trial
        # states may overflow before the step is shortened.
        with np.errstate(invalid="ignore", over="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            status = self._advance(t_stop)
        if self._run.clock[0] >= self._t_end:
            self._pass(self._run.clock[0])
        return status

    def _advance(self, t_stop: float) -> int:
        run, switched = self._run, self._run.counters[SWITCHES]
        while run.clock[0] < t_stop:
            if run.counters[SWITCHES] - switched > integrate.SWITCHES_AT_ONCE:
                return integrate.CHATTER
            t = float(run.clock[0])
            ended = self._already_ended(t)
            if ended is None:
                solution = self._solve(t)
                if not np.isfinite(solution.y).all():
                    return integrate.NOT_FINITE
                if solution.status < 0:
                    # LSODA gives up where its first step is far too long, instead of shortening it.
                    self._first_step = 1e-3 * min(self._first_step, self._largest)
                    if solution.t[-1] > t or t + self._first_step == t:
                        return integrate.STEP_TOO_SMALL
                    continue
                self._spent += solution.nfev, solution.njev, solution.nlu
                if solution.t[-1] > t:
                    switched = run.counters[SWITCHES]
                    self._record(solution)
                    run.clock[0], run.y[:] = solution.t[-1], solution.y[:, -1]
                    last = solution.sol.interpolants[-1]  # all of the step, beyond the event too
                    self._last_step = float(last.t - last.t_old)
                hits = [
                    place for place, at in zip(self._places, solution.t_events[1:], strict=True) if at.size
                ]
                ended = hits[0] if hits else None
                if solution.t_events[0].size:
                    return integrate.STEP_LIMIT
            if ended is not None:
                t = float(run.clock[0])
                self._all_margins(t, run.y)
                run.contacts[:] = self._contacts
                touch = change_mode(self._p.law, t, ended, run, self._p.tolerance)
                # Scipy's own choice tries the forces far ahead of it, where a corner may be deep inside the
                # wall.
                self._first_step = min(0.5 * self._last_step, touch)
        return integrate.REACHED

    def _all_margins(self, t: float, y: Array) -> Array:
        margins_in(
            self._model, self._p.law, t, y, self._run, self._dy, self._contacts, self._slider, self._margins
        )
        return self._margins

    def _already_ended(self, t: float) -> int | None:
        """Return the place of a margin that is further below zero than the tolerance, if any."""
        margins, tolerance = self._all_margins(t, self._run.y), self._p.tolerance
        limits = np.where(np.arange(margins.size) % MARGINS == GATE, tolerance, tolerance / VELOCITY_TIME)
        below = np.flatnonzero(margins < -limits)
        return int(below[0]) if below.size else None

    def _solve(self, t: float) -> Any:
        """Solve from `t` (s) to the end or to the first event, in the modes of now."""
        run, p = self._run, self._p
        self._places = [int(place) for place in np.flatnonzero(np.isfinite(self._all_margins(t, run.y)))]
        steps, limit, latest = int(run.counters[STEPS]), math.inf, t
        # By time, at both ends of a step, from the states there: LSODA's dense output, on which scipy looks
        # for the zero, meets them only to within the tolerance.
        ends = {t: self._margins.copy()}

        def derivative(t: float, y: Array) -> Array:
            dy = np.empty(y.size)
            evaluate(self._model, p.law, t, y, run.modes, dy, self._contacts, self._slider)
            return dy

        def left(t: float, y: Array) -> float:
            """Look at the end of a step, of which it is told first; its zero is the step too many."""
            nonlocal steps, limit, latest
            if t > latest:  # not where the zero is searched for
                kept = {latest: ends[latest], t: self._all_margins(t, np.ascontiguousarray(y)).copy()}
                ends.clear()
                ends.update(kept)
                latest, steps = t, steps + 1
                if steps + run.counters[SWITCHES] > self._limit:
                    limit = min(limit, t)
                self._report(float(t))
            return 1.0 if t < limit else -1.0

        def of(place: int) -> Callable[[float, Array], float]:
            def value(t: float, y: Array) -> float:
                margins = ends[t] if t in ends else self._all_margins(t, np.ascontiguousarray(y))
                return float(margins[place])

            value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
            return value

        left.terminal = True  # type: ignore[attr-defined]
        options: dict[str, Any] = {}
        if self._method != "DOP853":
            # Where it overflows Newton's method fails with any matrix, and the solver halves its step.
            options["jac"] = lambda t, y: np.nan_to_num(
                jacobian(self._model, p.law, t, y, run, self._dy, self._contacts, self._slider),
                posinf=0.0,
                neginf=0.0,
            )
        if math.isfinite(self._first_step):
            options["first_step"] = min(self._first_step, self._t_end - t)
        return solve_ivp(  # type: ignore[call-overload]
            derivative, (t, self._t_end), run.y.copy(), self._method, dense_output=True, rtol=RTOL,
            atol=self._atol, max_step=self._largest, events=[left, *map(of, self._places)], **options,
        )  # fmt: skip

    def _record(self, solution: Any) -> None:
        """Record samples, marks, steps and the peaks of the contacts of one solution."""
        run, first, last = self._run, float(solution.t[0]), float(solution.t[-1])
        interval, count = self._work.interval, int(run.counters[SAMPLES])
        # A sample on a solution's end belongs to the next one: the right limit at a jump.
        samples = run.times[count : count + int(np.searchsorted(run.times[count:], last))]
        marks = interval * np.arange(math.ceil(first / interval), math.ceil(last / interval))
        peaks, ends = self._peaks(solution), solution.t[1:]
        inside = np.concatenate([samples, marks, peaks])
        times = np.concatenate([inside, ends])
        sizes = (samples.size, marks.size + peaks.size, ends.size)
        purposes = np.repeat([SAMPLE, EXTREMUM, EXTREMUM + STEP], sizes)
        within = solution.sol(inside).T if inside.size else np.empty((0, run.y.size))
        states = np.concatenate([within, solution.y[:, 1:].T])
        order = np.argsort(times, kind="stable")
        times, purposes, states = times[order], purposes[order], np.ascontiguousarray(states[order])
        run.counters[SAMPLES] += samples.size
        while times.size:
            done = record_states(
                self._model, self._p.law, run, times, purposes, states, self._dy, self._slider
            )
            times, purposes, states = times[done:], purposes[done:], states[done:]
            if times.size:
                self._drain()

    def _peaks(self, solution: Any) -> Array:
        """Return when force or depth of a closed contact is largest in a solution, s."""
        peaks = []

        def of(t: float, k: int, row: int) -> float:
            evaluate(
                self._model,
                self._p.law,
                t,
                solution.sol(t),
                self._run.modes,
                self._dy,
                self._contacts,
                self._slider,
            )
            side = self._p.law.law == FOUNDATION and k != JOURNAL
            force = self._contacts[NORMAL + k] + (self._contacts[NORMAL + (k + 2) % 4] if side else 0.0)
            return float(-force if row == NORMAL else self._contacts[GAP + k])

        for k in np.flatnonzero(self._run.modes[MEMORY : MEMORY + CONTACTS] > 0.0).tolist():
            for row in (NORMAL, GAP):
                values = [of(t, k, row) for t in solution.t]
                best = int(np.argmin(values))
                lo, hi = solution.t[max(best - 1, 0)], solution.t[min(best + 1, solution.t.size - 1)]
                found = minimize_scalar(
                    of, bounds=(lo, hi), args=(k, row), method="bounded", options={"xatol": 1e-5 * (hi - lo)}
                )
                if found.fun < values[best]:
                    peaks.append(float(found.x))
        return np.array(peaks)
