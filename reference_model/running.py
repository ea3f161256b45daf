"""A run: which formulation a scene gets, its start, stretch after stretch, how it ended."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from reference_model import compiled, integrate
from reference_model.chain import Chain
from reference_model.channels import requested
from reference_model.contact import CONTACTS, JOURNAL, MEMORY, TAIL
from reference_model.dop853 import POINT
from reference_model.equations import Model
from reference_model.events import (
    BEGIN,
    COLUMNS,
    CONTACT,
    DEPTH,
    ENDED,
    EVALUATIONS,
    EVENTS,
    IMPULSE,
    INSTANT,
    PARTED,
    PEAK,
    RECORDED,
    REJECTED,
    SPEED,
    STEPS,
    STOP,
    SWITCHES,
    Run,
)
from reference_model.invariants import CONTACT_NAMES, VIOLATED, as_mapping, check, violation
from reference_model.laws import acts_on_sides
from reference_model.linkage import (
    Array,
    bodies_from_rods,
    four_bar_rods,
    rod4_from_slider,
    turning,
)
from reference_model.minimal import TIP_ROWS, Minimal
from reference_model.multiplier import Linkage, press
from reference_model.observation import Observation, needs_bodies
from reference_model.parameters import SCIPY_METHODS, Parameters
from reference_model.recording import instants
from reference_model.results import EVENT_COLUMNS, Result, name_results

LARGEST_STEP_PER_CYCLE = 1.0 / 50.0
"""At loose tolerances flight would allow more, which hardly samples the motion's harmonics. No event depends
on it."""
ROWS_AT_ONCE = 4096
"""That are recorded before channels are made of them; more where one step holds so many samples."""
JAMMING = 1.0
"""Coefficient of friction up to which runs were seen to end."""
_FAILURES = {
    integrate.STEP_TOO_SMALL: ("step-too-small", "steps are below the round-off of time"),
    integrate.NOT_FINITE: (
        "non-finite",
        "the motion left the range of the linkage: check clearance, start and forces",
    ),
    integrate.CHATTER: (
        "chatter",
        "contacts open and close at one instant without end: choose a smaller solver.reference.tolerance",
    ),
    integrate.STEP_LIMIT: ("work-limit", "shorten drive.cycles to less than was reached"),
}


class Integrator(Protocol):
    """What moves a run on."""

    name: str
    settings: dict[str, float]

    def advance(self, t_stop: float) -> int:
        """Integrate until `t_stop` (s) is passed; return why it stopped."""

    @property
    def counters(self) -> dict[str, int]:
        """Work so far."""


def formulation(p: Parameters) -> tuple[Model, str]:
    """Return the smallest formulation for a scene, or the paper's where asked for, and its name."""
    if p.multipliers:
        model = press(p.mechanism, p.load, ideal_slider=p.ideal_slider, baumgarte=(p.alpha, p.beta))
        return model, f"multiplier (15 coordinates, {model.rows} multipliers)"
    if p.ideal_pin:
        table = np.empty((TIP_ROWS, int(POINT)))
        return Minimal(p.mechanism, p.load, table), "minimal: rod 4 and slider (2 coordinates)"
    if p.ideal_slider:
        return Chain(p.mechanism, p.load, True), "minimal: rod 2 and rocker (2 coordinates)"
    return Chain(p.mechanism, p.load, False), "minimal: rod 2, rocker, rod 4 and slider (4 coordinates)"


def start(p: Parameters, model: Model) -> Array:
    """Return coordinates and rates at t = 0.

    All bodies are where the ideal mechanism has them, but for the slider, which starts where the scene says;
    y and vy follow from rod 4. With clearance at A the pin is centred.
    """
    m = p.mechanism
    theta4, w4 = rod4_from_slider(m, *p.reach)
    rod2, rocker = four_bar_rods(m, np.zeros(1))
    if isinstance(model, Minimal):
        return np.array([theta4, p.slider_angle, w4, p.slider_omega])
    if isinstance(model, Linkage):
        slider = p.slider_angle, p.slider_omega, 0.0
        bodies = bodies_from_rods(m, np.zeros(1), (rod2, rocker, turning(theta4, w4, 0.0)), slider)[:, :, 0]
        return np.concatenate([bodies[:, :3].ravel(), bodies[:, 3:6].ravel()])
    theta2, theta3, w2, w3 = (float(rod[i][0]) for i in (2, 3) for rod in (rod2, rocker))
    if model.ideal_slider:
        return np.array([theta2, theta3, w2, w3])
    return np.array([theta2, theta3, theta4, p.slider_angle, w2, w3, w4, p.slider_omega])


class Compiled:
    """The compiled integrator of one run.

    Parameters
    ----------
    p, model, state, work
        Parameters, formulation, the run and what its steps are computed in.
    t_end
        s.
    limit
        Attempted steps and switches after which the run is stopped.
    """

    name = "DOP853 with located events"

    def __init__(self, p: Parameters, model: Model, state: Run, work: Any, t_end: float, limit: int) -> None:
        self._p, self._model, self._state, self._work, self._t_end = p, model, state, work, t_end
        self._largest = p.period * LARGEST_STEP_PER_CYCLE
        self.settings = {"tolerance": p.tolerance, "largest_step_s": self._largest}
        self._room, self._limit = _room(p), limit
        self._in_cycle = int(np.searchsorted(state.instants[0], p.period * (1.0 - 1e-9)))

    def advance(self, t_stop: float) -> int:
        """Integrate until `t_stop` (s) is passed."""
        clock, cycles = self._state.clock, math.floor(self._state.clock[0] / self._p.period)
        clock[0] -= cycles * self._p.period
        clock[3] += cycles * self._p.period
        self._state.counters[INSTANT] -= cycles * self._in_cycle
        if isinstance(self._model, Linkage):
            turned = math.copysign(2.0 * math.pi * cycles, self._p.mechanism.omega)
            self._state.nodes.y[0, 3 * self._model.driven + 2] -= turned
        return int(
            integrate.advance(
                self._model, self._p.law, self._state, self._work, t_stop - clock[3], self._t_end - clock[3],
                self._p.tolerance, self._largest, self._room, self._limit,
            )
        )  # fmt: skip

    @property
    def counters(self) -> dict[str, int]:
        """Work so far."""
        places = {
            "steps": STEPS,
            "rejected": REJECTED,
            "rhs": EVALUATIONS,
            "switches": SWITCHES,
            "contacts": ENDED,
        }
        return {name: int(self._state.counters[i]) for name, i in places.items()}


def _room(p: Parameters) -> int:
    """Return how many rows one step may need: samples and marks in it, its parts and peaks."""
    return math.ceil(p.samples_per_cycle * min(LARGEST_STEP_PER_CYCLE, p.cycles)) + 100


def run(p: Parameters, times: Array, progress: Callable[[float], None] | None, limit: int) -> Result:
    """Run a scene, with samples at the times (s) and at most so many attempted steps and switches."""
    model, name = formulation(p)
    y0, names = start(p, model), requested(p)
    schedule = instants(p.samples_per_cycle, p.cycles, p.period)
    state, work = integrate.new_run(
        y0,
        1e-3 * LARGEST_STEP_PER_CYCLE * p.period,
        schedule,
        ROWS_AT_ONCE + _room(p),
        states=needs_bodies(names) or isinstance(model, Linkage),
    )
    observation = Observation(model, p, names, state, times.size)
    events = [np.empty((0, COLUMNS))]

    def drain() -> None:
        """Take what is in the buffers, and empty them."""
        counters = state.counters
        observation.take(state.rows[: counters[RECORDED]], state.accelerations[: counters[PARTED]])
        events.append(state.events[: counters[EVENTS]].copy())
        counters[RECORDED] = counters[PARTED] = counters[EVENTS] = 0

    reported, t_end = 0, float(times[-1])

    def report(t: float) -> None:
        """Tell who listens that a time (s) is reached, at most once per 1/50 of the run."""
        nonlocal reported
        if progress is not None and reported < math.floor(50.0 * t / t_end) < 50:
            if not reported:
                compiled.seal()  # others wait until then for what this process compiles
            reported = math.floor(50.0 * t / t_end)
            progress(t / t_end)

    integrator: Integrator
    if p.method in SCIPY_METHODS:
        # Imported only where it is used: scipy's integrators take longer to import than a short run.
        from reference_model.scipy_solvers import ScipySolver

        largest = p.period * LARGEST_STEP_PER_CYCLE
        integrator = ScipySolver(p, model, state, times, largest, limit, drain, report)
    else:
        integrator = Compiled(p, model, state, work, t_end, limit)
    in_cycle = 1 if progress is None else min(10, math.ceil(50.0 / p.cycles))
    code = _advance_to_end(p.period / in_cycle, integrator, state, drain, t_end, report)
    events.append(_not_ended(state, acts_on_sides(p.law)))
    rows = np.concatenate(events)
    rows = rows[np.argsort(rows[:, BEGIN], kind="stable")]
    compiled.seal()
    numbers = rows[:, CONTACT].astype(int)
    table = {"corner": np.array(CONTACT_NAMES)[numbers]} | {
        column: rows[:, i].copy()
        for column, i in zip(EVENT_COLUMNS, (BEGIN, STOP, SPEED, IMPULSE, PEAK, DEPTH), strict=True)
    }
    sampled = observation.sampled
    result = name_results(
        names, times[:sampled], observation.samples[:, :sampled], table, observation.extrema
    )
    provenance: dict[str, Any] = {
        "formulation": name,
        "integrator": integrator.name,
        "settings": integrator.settings,
        "counters": integrator.counters,
    }
    if observation.drift is not None:
        provenance["constraints"] = observation.drift
    invariants = check(p, observation.worst(), rows, observation.drift)
    provenance["invariants"] = as_mapping(invariants)
    status, remedy = ending(code, p)
    if status == "success" and (broken := violation(invariants, p.method)):
        status, remedy = VIOLATED, broken
    pulses = observation.pulses(table, numbers)
    return replace(result, pulses=pulses, provenance=provenance, status=status, remedy=remedy)


def _not_ended(state: Run, of_sides: bool) -> Array:
    """Return the rows of the contacts that are closed when the run ends."""
    closed = np.flatnonzero(state.modes[MEMORY : MEMORY + CONTACTS] > 0.0)
    rows, impulses = state.open_contacts[closed].copy(), state.nodes.y[0, -TAIL:][:CONTACTS]
    sides = [(k + 2) % JOURNAL if of_sides and k != JOURNAL else k for k in closed]
    rows[:, STOP] = state.clock[3] + state.clock[0]
    rows[:, IMPULSE] = impulses[closed] + np.where(sides == closed, 0.0, impulses[sides]) - rows[:, IMPULSE]
    state.counters[ENDED] += closed.size
    return rows


def _advance_to_end(
    stretch: float, integrator: Integrator, state: Run, drain: Callable[[], None], t_end: float,
    report: Callable[[float], None],
) -> int:  # fmt: skip
    """Integrate stretch after stretch (s, one or more a cycle); return why it stopped.

    A call of compiled code takes as long as a hundred steps.
    """
    stop, now, code = 0, 0.0, integrate.REACHED
    while code <= integrate.BUFFER_FULL and t_end - now > 1e-12 * t_end:
        while stop * stretch <= now:
            stop += 1
        code = integrator.advance(min(t_end, stop * stretch))
        now = state.clock[3] + state.clock[0]
        if code != integrate.REACHED or t_end - now <= 1e-12 * t_end:
            drain()
        report(now)
    return code


def ending(code: int, p: Parameters) -> tuple[str, str]:
    """Return the status of a run and what to try where that is not "success".

    What to try is what was seen to help (tests/contract/test_remedies.py, the study extremes), or nothing.
    """
    status, remedy = _FAILURES.get(code, ("success", ""))
    if status != "success" and p.law.c_f > JAMMING:
        # Where such a run ends, and with which status, rounding decides.
        return status, "lower friction.coefficient to 1 or less: above it a slider can jam in its guide"
    if status == "work-limit" and p.method in SCIPY_METHODS:
        remedy += "; or take solver.reference.method = 'dop853'"
    elif status == "work-limit":
        # Damping over the frozen impact speed: of depths that no such impact reaches, it is stiff.
        remedy += "; where a corner stays pressed deep into a wall, take solver.reference.method = 'LSODA'"
    return status, remedy
