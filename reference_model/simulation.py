"""One scene in, one result out."""

import math
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from reference_model import integrate
from reference_model.constants import Constants, Formulation
from reference_model.endings import ending
from reference_model.energy import ENERGIES
from reference_model.forces import Array
from reference_model.ideal import observe_ideal
from reference_model.invariants import CONTACT_NAMES, VIOLATED, as_mapping, check, violation
from reference_model.observation import (
    ACCELERATIONS,
    CHANNELS,
    CORNER_CHANNELS,
    DRIFT,
    MOTION,
    NAMES,
)
from reference_model.parameters import SCIPY_METHODS, Parameters
from reference_model.progress import BUFFERED, SAMPLES, Progress, begin, cycle_time, reached
from reference_model.reactions import REACTIONS
from reference_model.reading import read_parameters
from reference_model.recording import Samples, finish, prepare_finish, samples_of
from reference_model.start import NAMES as FORMULATION_NAMES
from reference_model.start import formulation, start

if TYPE_CHECKING:
    from reference_model.scipy_solvers import ScipySolver

STEPS_PER_CYCLE_LIMIT = 10_000_000
"""Attempted steps and switches after which a run is stopped, some 20 s; the shipped scenes need some 2e3 a
cycle at tolerance 1e-9, those with a clearance at the crank pin 6e3, a slider that friction jams 9e6."""
SCIPY_STEPS_PER_CYCLE_LIMIT = 2_000_000
"""The same for scipy's solvers, which take 0.1 (LSODA) to 0.5 ms (scipy-DOP853) a step: 3 to 17 minutes."""
LARGEST_STEP_PER_CYCLE = 1.0 / 50.0
"""At loose tolerances flight would allow more, which hardly samples the motion's harmonics. No event depends
on it."""

EVENT_COLUMNS = ("start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")


@dataclass(frozen=True)
class Result:
    """What a simulation gives."""

    columns: dict[str, Array]
    """Channel -> values at the sample times, all of one length; "time" (s) first."""
    events: dict[str, NDArray[Any]]
    """One row a contact, ascending in start: "corner" and EVENT_COLUMNS (s, s, m/s, N s, N, m)."""
    extrema: dict[str, dict[str, float]]
    """Channel -> min, time_of_min, max, time_of_max over all integration steps, whatever the samples."""
    cycle_extrema: dict[str, Array]
    """The same of each crank cycle, such as "slider_ay_time_of_min": arrays of one length. An instant between
    two cycles belongs to both."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """What produced it: integrator, settings, versions, counters, wall time."""
    status: str = "success"
    remedy: str = ""
    """What to try where the status is not "success"."""


def simulate(scene: Mapping[str, Any], *, progress: Callable[[float], None] | None = None) -> Result:
    """Simulate a scene with the hand-written solver.

    Parameters
    ----------
    scene
        Complete nested mapping in the scene format.
    progress
        Called with the finished share, 0 to 1, at most once per 1/50 of the run.

    Returns
    -------
    Result

    Raises
    ------
    ValueError
        One line, where the scene cannot be simulated by this model.
    """
    started = time.perf_counter()
    p = read_parameters(scene)
    count = round(p.cycles * p.samples_per_cycle)
    times = np.arange(count + 1, dtype=np.float64) * (p.period / p.samples_per_cycle)
    kind = formulation(p)
    samples = samples_of(_requested(p), times)
    result = _ideal(p, samples) if kind is Formulation.IDEAL else _simulated(p, kind, samples, progress)
    result.provenance.update(
        model="reference",
        versions=dict(_versions()),
        platform=f"{platform.system()} {platform.machine()} Python {platform.python_version()}",
        wall_time_s=time.perf_counter() - started,
        status=result.status,
    )
    if progress is not None:
        progress(1.0)
    return result


@cache
def _versions() -> dict[str, str]:
    """Return the versions of what computes a run; looking them up takes longer than a short run."""
    return {name: version(name) for name in ("sixbar-crossval", "numpy", "scipy", "numba")}


def _ideal(p: Parameters, samples: Samples) -> Result:
    extrema = observe_ideal(p.constants, samples)
    finite = np.isfinite(samples.values).all(axis=0)
    if not finite.all():
        at = samples.times[np.argmin(finite)]
        raise ValueError(
            f"mechanism: rod 4 is too short: it does not reach the slider's line at t = {at:.6g} s"
        )
    provenance = {
        "formulation": FORMULATION_NAMES[Formulation.IDEAL],
        "integrator": "none",
        "settings": {},
        "counters": {"evaluations": samples.times.size},
    }
    return _result(samples, samples.times.size, np.empty((0, 7)), extrema, provenance)


def _simulated(
    p: Parameters, kind: Formulation, samples: Samples, progress: Callable[[float], None] | None
) -> Result:
    c, y0 = start(p, kind)
    largest = p.period * LARGEST_STEP_PER_CYCLE
    state = begin(c, y0, 1.0e-3 * largest, max(1, math.ceil(p.cycles - 1e-9)))
    cycles = max(1.0, p.cycles)
    scipy_solver = None if p.method not in SCIPY_METHODS else _scipy_solver(p, c, state, samples)
    # In cycles, often enough to report; a call of the compiled integrator takes as long as six steps.
    stretch = 0.02 * p.cycles if scipy_solver is not None else max(0.02 * p.cycles, 0.1)
    events = []
    t_end, t_stop, t_reported = samples.times[-1], 0.0, 0.0
    code = integrate.REACHED
    period = cycle_time(c)
    while not reached(period, state, t_end):
        now = state.clock[3] * period + state.clock[0]
        t_stop = min(t_end, max(now, t_stop) + p.period * min(stretch, 0.5))
        if scipy_solver is not None:
            code = scipy_solver.advance(t_stop, round(SCIPY_STEPS_PER_CYCLE_LIMIT * cycles))
        else:
            limit = round(STEPS_PER_CYCLE_LIMIT * cycles)
            code = integrate.advance(c, state, t_stop, t_end, p.tolerance, largest, limit, samples)
        events.append(_empty_buffer(state))
        if code not in (integrate.REACHED, integrate.BUFFER_FULL):
            break
        if progress is not None and t_stop - t_reported >= 0.02 * t_end:
            if t_reported == 0.0:
                # Others wait until then for what this process compiles: what is left each compiles anew, and
                # without the integrator's code that takes ten times as long.
                prepare_finish(c, state, samples)
            progress(t_stop / t_end)
            t_reported = t_stop
    finish(c, state, samples)
    events.append(_empty_buffer(state))
    settings = {"tolerance": p.tolerance, "largest_step_s": largest}
    counted = ("steps", "rejected", "rhs", "switches", "contacts")
    provenance: dict[str, Any] = {
        "formulation": FORMULATION_NAMES[kind],
        "integrator": "DOP853 with located events",
        "settings": settings,
        "counters": {name: int(state.counters[i]) for i, name in enumerate(counted)},
    }
    status, remedy = ending(code, p)
    if scipy_solver is not None:
        provenance["integrator"] = f"scipy {p.method.removeprefix('scipy-')} with located events"
        provenance["settings"] = settings | {"relative_tolerance": scipy_solver.rtol}
        provenance["counters"] = scipy_solver.counters
    if kind in (Formulation.MULTIPLIER, Formulation.MULTIPLIER_IDEAL):
        provenance["constraints"] = _largest_drift(state.extrema)
    rows = np.concatenate(events)
    found = check(p, state.watch, rows, provenance.get("constraints"))
    provenance["invariants"] = as_mapping(found)
    if status == "success" and (broken := violation(found)):
        status, remedy = VIOLATED, broken
    result = _result(samples, int(state.counters[SAMPLES]), rows, state.extrema, provenance)
    return replace(result, status=status, remedy=remedy)


def _scipy_solver(p: Parameters, c: Constants, state: Progress, samples: Samples) -> "ScipySolver":
    # Imported only where it is used: with scipy it takes longer than a short run.
    from reference_model.scipy_solvers import ScipySolver

    largest = p.period * LARGEST_STEP_PER_CYCLE
    return ScipySolver(p.method, c, state, samples.times[-1], largest, p.tolerance, samples)


def _largest_drift(extrema: Array) -> dict[str, float]:
    """Return the largest |Phi| (m, rad) and |Phi'| (m/s, rad/s) over all samples and steps, and when."""
    (_, _, position, position_time), (_, _, velocity, velocity_time) = _of_all(extrema)[DRIFT:].tolist()
    return {
        "position": position,
        "position_time_s": position_time,
        "velocity": velocity,
        "velocity_time_s": velocity_time,
    }


def _of_all(extrema: Array) -> Array:
    """Return the extrema over all cycles, shape (CHANNELS, 4)."""
    lowest, highest, rows = extrema[:, :, 0].argmin(0), extrema[:, :, 2].argmax(0), np.arange(CHANNELS)
    return np.column_stack([extrema[lowest, rows, :2], extrema[highest, rows, 2:]])


def _empty_buffer(state: Progress) -> Array:
    rows = state.events[: state.counters[BUFFERED]].copy()
    state.counters[BUFFERED] = 0
    return rows


def _result(
    samples: Samples, recorded: int, events: Array, extrema: Array, provenance: dict[str, Any]
) -> Result:
    """Name what was recorded."""
    names = [NAMES[i] for i in samples.wanted]
    keys = ("min", "time_of_min", "max", "time_of_max")
    rows = zip(names, _of_all(extrema)[samples.wanted].tolist(), strict=True)
    begun = extrema[np.isfinite(extrema[:, samples.wanted[0], 0])][:, samples.wanted].reshape(
        -1, 4 * len(names)
    )
    parts = [f"{name}_{key}" for name in names for key in keys]
    return Result(
        columns={"time": samples.times[:recorded]}
        | dict(zip(names, samples.values[:, :recorded], strict=True)),
        events=_event_table(events),
        extrema={name: dict(zip(keys, row, strict=True)) for name, row in rows},
        cycle_extrema=dict(zip(parts, begun.T.copy(), strict=True)),
        provenance=provenance,
    )


def _requested(p: Parameters) -> list[str]:
    """Return the channels that the scene asks for; an ideal slider has no corners to speak of."""
    names = [*MOTION]
    if "accelerations" in p.groups:
        names += ACCELERATIONS
    if "corners" in p.groups and not p.ideal_slider:
        names += CORNER_CHANNELS
    if "joints" in p.groups:
        names += REACTIONS if p.ideal_slider else REACTIONS[:-2]
    if "energy" in p.groups:
        names += ENERGIES
    return names


def _event_table(rows: Array) -> dict[str, NDArray[Any]]:
    rows = rows[np.argsort(rows[:, 1], kind="stable")]
    table: dict[str, NDArray[Any]] = {"corner": np.array(CONTACT_NAMES)[rows[:, 0].astype(int)]}
    return table | {name: rows[:, i + 1].copy() for i, name in enumerate(EVENT_COLUMNS)}
