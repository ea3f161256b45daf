"""One scene in, one result out."""

import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_model import integrate
from reference_model.contact import CORNERS
from reference_model.linkage import ideal_slider, rod4_from_slider
from reference_model.minimal import Array
from reference_model.observation import ACCELERATIONS, CORNER_CHANNELS, MOTION, NAMES
from reference_model.parameters import Parameters, read_parameters
from reference_model.progress import BUFFERED, SAMPLES, begin

STEPS_PER_CYCLE_LIMIT = 5_000_000
"""Work after which a run is given up; the shipped scenes need some 2e4 steps a cycle at tolerance 1e-9."""
LARGEST_STEP_PER_CYCLE = 1.0 / 50.0
"""So that a corner cannot dip into a wall twice within one step."""

EVENT_COLUMNS = ("start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")

_FAILURES = {
    integrate.STEP_TOO_SMALL: (
        "step-too-small",
        "the tolerance is below round-off here: raise solver.reference.tolerance",
    ),
    integrate.NOT_FINITE: (
        "non-finite",
        "the motion left the range of the linkage: check clearance and start, or lower the speed",
    ),
    integrate.STEP_LIMIT: (
        "work-limit",
        "raise solver.reference.tolerance, shorten drive.cycles, or soften the contact",
    ),
}


@dataclass(frozen=True)
class Result:
    """What a simulation gives."""

    columns: dict[str, Array]
    """Channel -> values at the sample times, all of one length; "time" (s) first."""
    events: dict[str, NDArray[Any]]
    """One row a contact, ascending in start: "corner" and EVENT_COLUMNS (s, s, m/s, N s, N, m)."""
    extrema: dict[str, dict[str, float]]
    """Channel -> min, time_of_min, max, time_of_max over all integration steps."""
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
    result = _ideal(p, times) if p.ideal_slider else _with_clearance(p, times, progress)
    result.provenance.update(
        model="reference",
        versions={
            "sixbar-crossval": version("sixbar-crossval"),
            "numpy": np.__version__,
            "numba": version("numba"),
        },
        platform=f"{platform.system()} {platform.machine()} Python {platform.python_version()}",
        wall_time_s=time.perf_counter() - started,
        status=result.status,
    )
    if progress is not None:
        progress(1.0)
    return result


def _ideal(p: Parameters, times: Array) -> Result:
    y, vy, ay = ideal_slider(p.constants, times)
    if not np.isfinite(y).all():
        at = times[np.argmin(np.isfinite(y))]
        raise ValueError(
            f"mechanism: rod 4 is too short: it does not reach the slider's line at t = {at:.6g} s"
        )
    values = dict.fromkeys(_requested(p, corners=False), np.zeros_like(times))
    values |= {"slider_x": np.full_like(times, p.constants.line_x), "slider_y": y, "slider_vy": vy}
    if "slider_ay" in values:
        values["slider_ay"] = ay
    columns = {"time": times} | {name: value.copy() for name, value in values.items()}
    # The closed form has no steps of its own: the extrema are those of the samples.
    extrema = {
        name: {
            "min": float(v.min()),
            "time_of_min": float(times[v.argmin()]),
            "max": float(v.max()),
            "time_of_max": float(times[v.argmax()]),
        }
        for name, v in columns.items()
        if name != "time"
    }
    provenance = {
        "formulation": "closed-form",
        "integrator": "none",
        "settings": {},
        "counters": {"evaluations": times.size},
    }
    return Result(columns, _event_table(np.empty((0, 7))), extrema, provenance)


def _with_clearance(p: Parameters, times: Array, progress: Callable[[float], None] | None) -> Result:
    c = p.constants
    theta4, omega4 = rod4_from_slider(c, 0.0, p.guide_x + p.slider_offset, p.slider_vx)
    if not np.isfinite(theta4) or not np.isfinite(ideal_slider(c, np.linspace(0.0, p.period, 1000))).all():
        raise ValueError(
            "mechanism: rod 4 is too short: it does not reach the guide all the way round"
        )
    largest = p.period * LARGEST_STEP_PER_CYCLE
    state = begin(c, np.array([theta4, p.slider_angle, omega4, p.slider_omega]), 1.0e-3 * largest)
    samples = np.empty((times.size, len(NAMES)))
    limit = round(STEPS_PER_CYCLE_LIMIT * max(1.0, p.cycles))
    events = []
    t_end, t_stop = times[-1], 0.0
    code = integrate.REACHED
    while state.clock[0] < t_end:
        t_stop = min(t_end, max(state.clock[0], t_stop) + 0.02 * t_end)
        code = integrate.advance(c, state, t_stop, t_end, p.tolerance, largest, limit, times, samples)
        events.append(state.events[: state.counters[BUFFERED]].copy())
        state.counters[BUFFERED] = 0
        if code not in (integrate.REACHED, integrate.BUFFER_FULL):
            break
        if progress is not None:
            progress(state.clock[0] / t_end)
    integrate.finish(c, state, times, samples)
    events.append(state.events[: state.counters[BUFFERED]])
    recorded = state.counters[SAMPLES]
    names = _requested(p)
    columns = {"time": times[:recorded]} | {n: samples[:recorded, NAMES.index(n)].copy() for n in names}
    keys = ("min", "time_of_min", "max", "time_of_max")
    extrema = {n: dict(zip(keys, map(float, state.extrema[NAMES.index(n)]), strict=True)) for n in names}
    counted = ("steps", "rejected", "rhs", "switches", "contacts")
    provenance = {
        "formulation": "minimal (rod 4 and slider)",
        "integrator": "DOP853 with located events",
        "settings": {"tolerance": p.tolerance, "largest_step_s": largest},
        "counters": {name: int(state.counters[i]) for i, name in enumerate(counted)},
    }
    status, remedy = _FAILURES.get(code, ("success", ""))
    return Result(columns, _event_table(np.concatenate(events)), extrema, provenance, status, remedy)


def _requested(p: Parameters, corners: bool = True) -> list[str]:
    """Return the channels that the scene asks for; an ideal slider has no corners to speak of."""
    names = [*MOTION]
    if "accelerations" in p.groups:
        names += ACCELERATIONS
    if corners and "corners" in p.groups:
        names += CORNER_CHANNELS
    return names


def _event_table(rows: Array) -> dict[str, NDArray[Any]]:
    rows = rows[np.argsort(rows[:, 1], kind="stable")]
    table: dict[str, NDArray[Any]] = {"corner": np.array(CORNERS)[rows[:, 0].astype(int)]}
    return table | {name: rows[:, i + 1].copy() for i, name in enumerate(EVENT_COLUMNS)}
