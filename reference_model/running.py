"""Run a scene: integrate it in stretches, and collect the result."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_model import compiled, integrate
from reference_model import state as data
from reference_model.events import POINTS
from reference_model.formulations import Model, formulation, start
from reference_model.integrate import Settings
from reference_model.invariants import VIOLATED, check, violation
from reference_model.linkage import Array
from reference_model.margins import MARGINS
from reference_model.multiplier import Linkage
from reference_model.observation import Observation
from reference_model.parameters import SCIPY_METHODS, Contact, Parameters
from reference_model.recording import PARTS, schedule
from reference_model.results import EVENT_COLUMNS, Result, channel_names, name_results

LARGEST_STEP_PER_CYCLE = 1.0 / 50.0
"""At loose tolerances the error in flight would allow longer steps, which hardly sample the motion's
harmonics. No event depends on this limit."""
ROWS_AT_ONCE = 4096
"""Rows that are recorded before channels are computed from them; more if one step holds so many samples."""
JAMMING = 1.0
"""Largest coefficient of friction at which all observed runs reached their end."""
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


def new_run(y0: Array, contacts: int, first_step: float, instants: Array, capacity: int) -> data.Run:
    """Return a run at t = 0 from coordinates and rates `y0`, with a number of contacts and a first step (s).

    Rows are recorded at `instants` (`recording.schedule`) in a buffer of `capacity`; the caller empties it.
    """
    nodes = data.new_nodes(y0, contacts)
    size = nodes.y.shape[1]
    return data.Run(
        clock=np.array([(0.0, first_step, first_step, 0.0)], data.record(data.Clock)),
        counters=data.records(data.Counters, 1),
        nodes=nodes,
        modes=data.records(data.Mode, contacts),
        current_events=data.records(data.Event, contacts),
        events=data.records(data.Event, data.EVENT_BUFFER),
        rows=data.Rows(
            times=np.empty(capacity),
            cycles=np.empty(capacity),
            purposes=np.empty(capacity, dtype=np.int64),
            touches=data.records(data.Touch, capacity, contacts),
            slider=data.records(data.Motion, capacity),
            y=np.empty((capacity, size)),
            dy=np.empty((capacity, size)),
        ),
        instants=instants,
        worst=np.array([(0.0, 0.0, -1)] * len(data.WORST), data.record(data.Worst)),
        f=np.empty((7, size)),
        values=np.empty((contacts * MARGINS, POINTS)),
        scales=np.ones(contacts),
        unsettled=np.zeros(contacts * MARGINS, dtype=np.bool_),
        parts=np.empty(PARTS),
        peaks=np.zeros((contacts, 2), dtype=np.bool_),
    )


class Compiled:
    """The compiled integrator of one run, up to `t_end` (s) or `limit` attempted steps and switches."""

    name = "DOP853 with located events"

    def __init__(self, p: Parameters, model: Model, state: data.Run, t_end: float, limit: int) -> None:
        self._p, self._model, self._state, self._t_end = p, model, state, t_end
        self._settings = Settings(p.tolerance, p.period * LARGEST_STEP_PER_CYCLE, _room(p), limit)
        self.settings = {"tolerance": p.tolerance, "largest_step_s": self._settings.largest}
        self._instants_per_cycle = int(np.searchsorted(state.instants[0], p.period * (1.0 - 1e-9)))

    def advance(self, t_stop: float) -> int:
        """Integrate until `t_stop` (s) is passed; return a code of `integrate`."""
        clock, state = self._state.clock[0], self._state
        cycles = math.floor(clock["time"] / self._p.period)
        clock["time"] -= cycles * self._p.period
        clock["cycle"] += cycles * self._p.period
        state.counters["instant"] -= cycles * self._instants_per_cycle
        if isinstance(self._model, Linkage):
            turn = math.copysign(2.0 * math.pi * cycles, self._p.mechanism.omega)
            state.nodes.y[0, 3 * self._model.driven + 2] -= turn
        limits = t_stop - clock["cycle"], self._t_end - clock["cycle"]
        return int(integrate.advance(self._model, state, self._settings, *limits))

    @property
    def counters(self) -> dict[str, int]:
        """Work so far."""
        counters = self._state.counters[0]
        fields = {name: name for name in ("steps", "rejected", "rhs", "switches", "contacts")}
        return {name: int(counters[field]) for name, field in (fields | {"rhs": "evaluations"}).items()}


def _room(p: Parameters) -> int:
    """Return the number of rows that one step may need for samples, marks, parts and peaks."""
    return math.ceil(p.samples_per_cycle * min(LARGEST_STEP_PER_CYCLE, p.cycles)) + 100


def run(p: Parameters, times: Array, progress: Callable[[float], None] | None, limit: int) -> Result:
    """Run a scene, with samples at the times (s), until at most `limit` attempted steps and switches."""
    model, name = formulation(p)
    y0, names = start(p, model), channel_names(p)
    instants = schedule(p.samples_per_cycle, p.cycles, p.period)
    first_step = 1e-3 * LARGEST_STEP_PER_CYCLE * p.period
    state = new_run(y0, len(p.contacts), first_step, instants, ROWS_AT_ONCE + _room(p))
    observation = Observation(model, p, names, state, times.size)
    events = [data.records(data.Event, 0)]

    def drain() -> None:
        """Hand the buffered rows and events over, and empty the buffers."""
        counters = state.counters[0]
        observation.take(data.Rows._make(each[: counters["recorded"]] for each in state.rows))
        events.append(state.events[: counters["events"]].copy())
        counters["recorded"] = counters["events"] = 0

    last_report, t_end = 0, float(times[-1])

    def report(t: float) -> None:
        """Call `progress` when the run reaches a time (s), at most 50 times."""
        nonlocal last_report
        if progress is not None and last_report < math.floor(50.0 * t / t_end) < 50:
            if not last_report:
                compiled.seal()  # other processes wait for the code that this one compiles
            last_report = math.floor(50.0 * t / t_end)
            progress(t / t_end)

    integrator: Any
    if p.method in SCIPY_METHODS:
        # Imported only where it is used: scipy's integrators take longer to import than a short run.
        from reference_model.scipy_solvers import ScipySolver

        largest = p.period * LARGEST_STEP_PER_CYCLE
        integrator = ScipySolver(p, model, state, times, largest, limit, drain, report)
    else:
        integrator = Compiled(p, model, state, t_end, limit)
    # A call of compiled code takes as long as a hundred steps, so a stretch is long: a cycle, or 1/10 of it.
    stretch = p.period / (1 if progress is None else min(10, math.ceil(50.0 / p.cycles)))
    stop, now, code = 0, 0.0, integrate.REACHED
    while code in (integrate.REACHED, integrate.BUFFER_FULL) and t_end - now > 1e-12 * t_end:
        while stop * stretch <= now:
            stop += 1
        code = integrator.advance(min(t_end, stop * stretch))
        now = float((state.clock["cycle"] + state.clock["time"])[0])
        if code != integrate.REACHED or t_end - now <= 1e-12 * t_end:
            drain()
        report(now)
    events.append(unfinished_events(p.contacts, state))
    contacts, table = event_table(np.concatenate(events), p.contact_names)
    compiled.seal()
    provenance: dict[str, Any] = {
        "formulation": name,
        "integrator": integrator.name,
        "settings": integrator.settings,
        "counters": integrator.counters,
    }
    if observation.drift is not None:
        provenance["constraints"] = observation.drift
    invariants = check(p, observation.worst(), contacts, observation.drift)
    provenance["invariants"] = {name: each._asdict() for name, each in invariants.items()}
    status, remedy = status_and_remedy(code, p)
    if status == "success" and (message := violation(invariants, p.method)):
        status, remedy = VIOLATED, message
    n_samples, extrema = observation.n_samples, observation.extrema
    result = name_results(names, times[:n_samples], observation.samples[:, :n_samples], table, extrema)
    pulses = observation.pulses.table(table, contacts["contact"])
    return replace(result, pulses=pulses, provenance=provenance, status=status, remedy=remedy)


def event_table(events: data.Records, names: Sequence[str]) -> tuple[data.Records, dict[str, NDArray[Any]]]:
    """Return the events of all contacts in the order of their starts, and the table of these."""
    events = events[np.argsort(events["start"], kind="stable")]
    table = {"corner": np.array(names, dtype=np.str_)[events["contact"]]}
    return events, table | {column: events[column].copy() for column in EVENT_COLUMNS}


def unfinished_events(contacts: Sequence[Contact], state: data.Run) -> data.Records:
    """Return the events of the contacts that are still closed when the run ends."""
    numbers = np.flatnonzero(state.modes["speed"] > 0.0)
    rows = state.current_events[numbers].copy()
    impulses = state.nodes.y[0, -data.WORKS - len(contacts) : -data.WORKS]
    for row, k in zip(rows, numbers.tolist(), strict=True):
        side = impulses[contacts[k].other] if contacts[k].one_side else 0.0
        row["impulse"] = impulses[k] + side - row["impulse"]
    rows["end"] = state.clock["cycle"] + state.clock["time"]
    state.counters["contacts"] += numbers.size
    return rows


def status_and_remedy(code: int, p: Parameters) -> tuple[str, str]:
    """Return the status of a run, and its remedy if that is not "success".

    Each remedy was observed to help (the study extremes).
    """
    status, remedy = _FAILURES.get(code, ("success", ""))
    if status != "success" and p.journal.c_f > JAMMING:
        # Rounding decides when such a run ends, and with which status.
        return status, "lower friction.coefficient to 1 or less: above it a slider can jam in its guide"
    if status == "work-limit" and p.method in SCIPY_METHODS:
        remedy += "; or take solver.reference.method = 'dop853'"
    elif status == "work-limit":
        # The damping K d^n C d'/v is stiff at depths that an impact at the frozen speed v does not reach.
        remedy += "; where a corner stays pressed deep into a wall, take solver.reference.method = 'LSODA'"
    return status, remedy
