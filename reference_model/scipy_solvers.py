"""The equations of motion integrated by scipy's solvers, step by step, from event to event.

The paper integrates its 15 coordinates with a variable-order backward differentiation formula (MATLAB's
ode15s), which is BDF here. Steps, events, samples and channels are as in `reference_model.integrate`, but on
the solver's own dense output; after every event the solver restarts.
"""

import warnings
from typing import Any

import numpy as np
from scipy.integrate import BDF, DOP853, LSODA, OdeSolver, Radau
from scipy.optimize import minimize_scalar

from reference_model.constants import Constants
from reference_model.contact_steps import first_step_in_contact
from reference_model.dense_events import Dense, first_switch, turning_time
from reference_model.energy import ENERGIES
from reference_model.forces import CONTACTS, GAP, INSIDE, MEMORY, RATE, Array, no_contacts, normal_force
from reference_model.formulations import free, right_hand_side, state_size
from reference_model.integrate import (
    BUFFER_FULL,
    CHATTER,
    NOT_FINITE,
    REACHED,
    STEP_LIMIT,
    STEP_TOO_SMALL,
    SWITCHES_AT_ONCE,
    VELOCITY_TIME,
)
from reference_model.jacobian import jacobian
from reference_model.observation import CHANNELS, audit, note_forces, observe
from reference_model.parameters import SCIPY_METHODS
from reference_model.peaks import force_peak, has_peak
from reference_model.progress import (
    BUFFERED,
    ENDED,
    EVENT_BUFFER,
    SAMPLES,
    STEPS,
    SWITCHES,
    Progress,
    cycle_time,
    switch,
)
from reference_model.recording import MARKS, Samples, first_mark, keep, note_extrema, widen_cycle
from reference_model.watch import watch_contacts, watch_energy, watch_open

SOLVERS: dict[str, type[OdeSolver]] = dict(zip(SCIPY_METHODS, (BDF, Radau, LSODA, DOP853), strict=True))
"""By the name of the method in a scene."""

RTOL = 100.0 * float(np.finfo(np.float64).eps)
"""The smallest that scipy takes. The tolerance of a scene is absolute: that a coordinate is 0.55 m long makes
no larger error of it harmless, as a contact is only some 1e-6 m deep."""

_UNCONTROLLED = 1e30
"""Tolerance of the impulses and works: as in `integrate` they are quadratures, whose errors do not act back.
Not infinite, as LSODA divides by its inverse."""

_PEAK_SHARE = 1e-4
"""Of a step, to which a peak's instant is located. Even where a step is a whole contact, and the force a half
wave, this makes it short by (pi 1e-4)^2 / 2 = 5e-8 of itself."""


class ScipySolver:
    """One run by one of scipy's solvers.

    Parameters
    ----------
    method
        Key of `SOLVERS`.
    c, progress
        Constants and progress; the latter is updated in place.
    t_end, max_step
        s.
    tolerance
        Absolute local error of the coordinates, m and rad.
    samples
        Written when their times are passed; one at `t_end` is left to `finish`.
    """

    def __init__(
        self,
        method: str,
        c: Constants,
        progress: Progress,
        t_end: float,
        max_step: float,
        tolerance: float,
        samples: Samples,
    ) -> None:
        self._class, self.rtol = SOLVERS[method], RTOL
        self._c, self._p, self._samples = c, progress, samples
        self._t_end, self._max_step, self._tolerance = t_end, max_step, tolerance
        self._atol = np.full(state_size(c), _UNCONTROLLED)
        self._atol[: free(c)] = tolerance
        self._atol[free(c) // 2 : free(c)] /= VELOCITY_TIME
        self._solver: OdeSolver | None = None
        self._first_step: float | None = None
        self._work = np.zeros(3, dtype=np.int64)
        self._rate, self._observed = np.empty(state_size(c)), np.zeros(CHANNELS)
        self._before, self._after, self._contacts = no_contacts(), no_contacts(), no_contacts()
        right_hand_side(c, progress.clock[0], progress.y, progress.modes, self._rate, self._before)

    @property
    def counters(self) -> dict[str, int]:
        """Work so far; the evaluations behind a Jacobian are not among the right-hand sides."""
        rhs, jacobians, factorizations = map(int, self._work + _work_of(self._solver))
        implicit = {"jacobians": jacobians, "factorizations": factorizations}
        counters = self._p.counters
        return {
            "steps": int(counters[STEPS]),
            "rhs": rhs,
            **({} if self._class is DOP853 else implicit),
            "switches": int(counters[SWITCHES]),
            "contacts": int(counters[ENDED]),
        }

    def advance(self, t_stop: float, step_limit: int) -> int:
        """Integrate until `t_stop` is passed; arguments and result as of `integrate.advance`."""
        # LSODA warns of what its status says anyway; BDF reads differences that it has not yet written; trial
        # states may overflow before the step is shortened.
        with np.errstate(invalid="ignore", over="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            status = self._advance(t_stop, step_limit)
            self._watch_energy()
        return status

    def _watch_energy(self) -> None:
        """Note the residual of the energy balance in the present state."""
        c, p, energies = self._c, self._p, np.empty(len(ENERGIES))
        right_hand_side(c, p.clock[0], p.y, p.modes, self._rate, self._contacts)
        audit(c, p.clock[0], p.y, p.modes, self._rate, self._contacts, p.start, energies)
        watch_energy(c, energies, p.start, p.clock[0], p.watch)

    def _advance(self, t_stop: float, step_limit: int) -> int:
        c, p, before, after = self._c, self._p, self._before, self._after
        switched = p.counters[SWITCHES]
        while p.clock[0] < t_stop:
            if p.counters[BUFFERED] + CONTACTS > EVENT_BUFFER:
                return BUFFER_FULL
            if p.counters[STEPS] + p.counters[SWITCHES] >= step_limit:
                return STEP_LIMIT
            if p.counters[SWITCHES] - switched > SWITCHES_AT_ONCE:
                return CHATTER
            self._solver = self._solver or self._begin()
            failure = step(self._solver)
            if failure != REACHED:
                return failure
            t, end, y = p.clock[0], self._solver.t, self._solver.y
            dense = self._solver.dense_output()
            if not np.isfinite(dense(0.5 * (t + end))).all():
                return NOT_FINITE
            right_hand_side(c, end, y, p.modes, self._rate, after)
            found = first_switch(c, p.modes, after, t, end, dense, self._tolerance)
            if found is not None:
                end, y = found[0], dense(found[0])
            if end > t:
                p.counters[STEPS] += 1
                self._note_step(t, end, y, dense)
                p.clock[0], p.y[:], before[:] = end, y, after
                switched = p.counters[SWITCHES]
            if found is not None:
                self._switch(*found, self._solver.t - t)
        return REACHED

    def _begin(self) -> OdeSolver:
        """Return a solver that starts where the run is, in the modes of now."""
        c, p = self._c, self._p
        contacts = no_contacts()

        def derivative(t: float, y: Array) -> Array:
            dy = np.empty(y.size)
            right_hand_side(c, t, y, p.modes, dy, contacts)
            return dy

        options: dict[str, Any] = {"rtol": self.rtol, "atol": self._atol, "max_step": self._max_step}
        if self._class is not DOP853:
            # Where it overflows Newton's method fails with any matrix, and the solver halves its step.
            options["jac"] = lambda t, y: np.nan_to_num(jacobian(c, t, y, p.modes), posinf=0.0, neginf=0.0)
        if self._first_step is not None:
            options["first_step"] = min(self._first_step, self._t_end - p.clock[0])
        return self._class(derivative, p.clock[0], p.y.copy(), self._t_end, **options)

    def _note_step(self, t: float, end: float, y: Array, dense: Dense) -> None:
        """Record samples, extrema and contact peaks from `t` to `end`, where the state is `y`."""
        p, samples = self._p, self._samples
        count, times = p.counters[SAMPLES], samples.times
        interval = cycle_time(self._c) / MARKS
        for mark in range(first_mark(t, interval), first_mark(end, interval)):
            self._observe(mark * interval, dense(mark * interval), self._contacts, self._observed)
            note_extrema(self._c, p, samples, mark * interval, self._observed)
        while count < times.size and times[count] < end:
            # A sample on a step's end belongs to the next step: the right limit at a jump.
            self._observe(times[count], dense(times[count]), self._contacts, self._observed)
            keep(samples, count, self._observed)
            watch_open(p.modes, self._contacts, times[count], p.watch)
            count += 1
        p.counters[SAMPLES] = count
        self._observe(end, y, self._after, self._observed)
        note_extrema(self._c, p, samples, end, self._observed)
        note_forces(self._c, p.modes, self._after, p.open_contacts)
        watch_contacts(p.modes, self._after, end, p.watch)
        if has_peak(self._c, p.modes, end - t, self._before, self._after):
            self._note_peaks(t, end, dense)

    def _note_peaks(self, t: float, end: float, dense: Dense) -> None:
        """Record the contacts whose depth or force peaks within a step."""
        c, p, h = self._c, self._p, end - t
        before, after = self._before, self._after
        for k in range(CONTACTS):
            speed = p.modes[MEMORY, k]
            if p.modes[INSIDE, k] > 0.0 and before[RATE, k] < 0.0 < after[RATE, k]:
                self._note_peak(turning_time(c, p.modes, k, t, end, dense), dense)
            if speed > 0.0 and force_peak(c, k, speed, h, before, after) > 0.0:
                share = minimize_scalar(
                    lambda share, k=k: -self._force(k, t + share * h, dense),
                    bounds=(0.0, 1.0),
                    method="bounded",
                    options={"xatol": _PEAK_SHARE},
                ).x
                self._note_peak(t + share * h, dense)

    def _force(self, k: int, t: float, dense: Dense) -> float:
        """Return the normal force of contact `k` within a step, N."""
        right_hand_side(self._c, t, dense(t), self._p.modes, self._rate, self._contacts)
        return normal_force(self._c, self._contacts, k)

    def _note_peak(self, t: float, dense: Dense) -> None:
        """Record the contacts' forces and depths within a step."""
        self._observe(t, dense(t), self._contacts, self._observed)
        widen_cycle(self._c, self._p, self._samples, t, self._observed)
        note_forces(self._c, self._p.modes, self._contacts, self._p.open_contacts)

    def _observe(self, t: float, y: Array, contacts: Array, out: Array) -> None:
        """Write contacts and channels of a state."""
        p = self._p
        right_hand_side(self._c, t, y, p.modes, self._rate, contacts)
        observe(self._c, t, y, p.modes, self._rate, contacts, self._samples.what, p.start, out)

    def _switch(self, t: float, kind: int, contact: int, last: float) -> None:
        """Change the mode that ended at `t`, and with it the solver, whose last step is given (s)."""
        c, p = self._c, self._p
        self._work += _work_of(self._solver)
        self._solver = None
        switch(c, t, kind, contact, self._before, p)
        right_hand_side(c, t, p.y, p.modes, self._rate, self._before)
        # Scipy's own choice tries the forces far ahead of it, where a corner may be deep inside the wall.
        # Half the last step, lest two modes hand over to each other for ever in a step too coarse for either.
        self._first_step = 0.5 * last
        if kind == GAP and p.modes[MEMORY, contact] > 0.0:
            speed = p.modes[MEMORY, contact]
            touch = first_step_in_contact(c, contact, speed, self._before, self._tolerance)
            self._first_step = min(self._first_step, touch)


def step(solver: OdeSolver) -> int:
    """Take one step; return REACHED, STEP_TOO_SMALL or NOT_FINITE."""
    solver.step()
    # LSODA takes a step into nan for a good one.
    if not np.isfinite(solver.y).all():
        return NOT_FINITE
    return STEP_TOO_SMALL if solver.status == "failed" else REACHED


def _work_of(solver: OdeSolver | None) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return right-hand sides, Jacobians and factorizations of a solver so far."""
    if solver is None:
        return np.zeros(3, dtype=np.int64)
    return np.array([solver.nfev, solver.njev, solver.nlu], dtype=np.int64)
