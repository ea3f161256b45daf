"""Run one scene from its plain mapping to a result."""

import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import exudyn as exu
import numba
import numpy as np
from numpy.typing import NDArray

from exudyn_model.channels import ACCELERATIONS, CORNER_CHANNELS, ENERGIES, REACTIONS, STATE
from exudyn_model.five_bodies.run import run_five_bodies
from exudyn_model.invariants import judge, scales
from exudyn_model.parameters import Parameters
from exudyn_model.reading import read_scene
from exudyn_model.run import Run
from exudyn_model.seen import Seen, seen_in_contacts, seen_in_energy, seen_in_events, seen_in_samples
from exudyn_model.tables import whole_extrema
from exudyn_model.tree.run import run_tree


@dataclass(frozen=True)
class Result:
    """Results of a run.

    Attributes
    ----------
    columns : dict of ndarray
        Sampled channels, SI units, "time" first; all of one length.
    events : dict of ndarray
        One row a contact, sorted by start: corner, start, end (s), normal_speed (m/s), impulse (N s),
        peak_force (N), largest_depth (m).
    pulses : dict of ndarray
        Normal forces of the contacts at the slider's corners in the accepted states: row (in ``events``),
        time (s), force (N), sorted by row and time. Of a very long run the first contacts alone have one.
    extrema : dict
        Channel to "min", "time_of_min", "max", "time_of_max" over all integration steps.
    cycle_extrema : dict
        The same in each cycle of the crank, such as "slider_ay_time_of_min", as arrays of one length; where
        cycles meet, in both.
    provenance : dict
        Model, settings, versions, counters, wall time, status; only what JSON can hold.
    status : str
        "success", "newton-failed", "step-too-small", "work-limit", "out-of-range", "non-finite", or, of a run
        that came to its end, "invariant-violated": see ``invariants``.
    remedy : str
        What to try after a failure, else empty.
    """

    columns: dict[str, NDArray[np.float64]]
    events: dict[str, NDArray[Any]]
    extrema: dict[str, dict[str, float]]
    cycle_extrema: dict[str, NDArray[np.float64]]
    provenance: dict[str, Any]
    status: str
    remedy: str
    pulses: dict[str, NDArray[Any]]


def simulate(scene: Mapping[str, Any], *, progress: Callable[[float], None] | None = None) -> Result:
    """Simulate a scene with Exudyn.

    Parameters
    ----------
    scene : mapping
        Complete scene, defaults filled in.
    progress : callable, optional
        Receives the finished fraction of the run, 0 to 1.

    Returns
    -------
    Result

    Raises
    ------
    ValueError
        In one line: what cannot be simulated or assembled.
    """
    started = time.perf_counter()
    parameters = read_scene(scene)
    run = (run_tree if parameters.integration.formulation == "tree" else run_five_bodies)(
        parameters, progress
    )
    recorder, outcome = run.recorder, run.outcome
    events = recorder.events()
    channels = _channels(parameters)
    columns = recorder.columns(channels)
    times = np.arange(len(columns["slider_x"]), dtype=np.float64) * parameters.sample_interval
    provenance = {
        "model": "exudyn",
        "formulation": run.formulation,
        "integrator": parameters.integration.method,
        "settings": asdict(parameters.integration) | run.settings,
        "versions": {
            "python": platform.python_version(),
            "exudyn": exu.__version__,
            "numpy": np.__version__,
            "numba": numba.__version__,
        },
        "platform": platform.platform(),
        "counters": outcome.counters,
        "wall_time_s": time.perf_counter() - started,
        "status": outcome.status,
    }
    if run.constraints:
        provenance["constraints"] = {name: value for name, (value, _) in run.constraints.items()} | {
            f"{name}_time_s": time_s for name, (_, time_s) in run.constraints.items()
        }
    by_cycle = recorder.cycle_extrema(channels)
    extrema = whole_extrema(by_cycle, channels)
    status, remedy = outcome.status, outcome.remedy
    provenance["invariants"], broken = _invariants(parameters, run, columns, events, extrema)
    if broken and status == "success":
        status = "invariant-violated"
        remedy = f"{broken}; lower solver.exudyn.{'step' if run.constraints else 'tolerance'}"
    provenance["status"] = status
    return Result(
        columns={"time": times} | columns,
        events=events,
        extrema=extrema,
        cycle_extrema=by_cycle,
        provenance=provenance,
        status=status,
        remedy=remedy,
        pulses=recorder.pulses(events),
    )


def _channels(parameters: Parameters) -> tuple[str, ...]:
    """List the channels that a scene asks for."""
    channels: tuple[str, ...] = STATE
    if parameters.integration.accelerations:
        channels += ACCELERATIONS
    if parameters.integration.corners:
        channels += CORNER_CHANNELS
    if parameters.integration.joints:
        channels += (*REACTIONS, "crank_torque")
        if parameters.mechanism.ideal_slider:
            channels += ("guide_force", "guide_moment")
    if parameters.integration.energy:
        channels += ENERGIES
    return channels


def _invariants(
    parameters: Parameters,
    run: Run,
    columns: dict[str, NDArray[np.float64]],
    events: dict[str, NDArray[Any]],
    extrema: dict[str, dict[str, float]],
) -> tuple[dict[str, dict[str, Any]], str]:
    """Judge a run by its results: see ``invariants``."""
    integration = parameters.integration
    seen = [*seen_in_contacts(run.contacts), seen_in_events(events, parameters.contact.law)]
    if not parameters.mechanism.ideal_slider:
        seen.append(seen_in_samples(columns, events, parameters))
    seen += [
        Seen(f"constraint-{name}", value, time_s, "a constraint")
        for name, (value, time_s) in run.constraints.items()
    ]
    if integration.energy and parameters.contact.law != "paper-switching":
        seen.append(seen_in_energy(columns, extrema))
    names = "step_used", "longest_step", "newton_tolerance"
    steps = (run.settings.get(name, 0.0) for name in names)
    found = scales(parameters, run.contacts, events, extrema, *steps)
    return judge(seen, integration.formulation, integration.method, found)
