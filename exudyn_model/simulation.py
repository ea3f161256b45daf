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

from exudyn_model.clearances import CORNERS
from exudyn_model.five_bodies.linkage_recording import BODIES_AND_JOINTS, linkage_channels, run_linkage
from exudyn_model.five_bodies.linkage_scene import read_linkage
from exudyn_model.five_bodies.solver import run_five_bodies
from exudyn_model.invariants import judge_run
from exudyn_model.kernels import seal
from exudyn_model.linkage import SLIDER, assemble
from exudyn_model.parameters import Parameters, read_scene
from exudyn_model.run import Run
from exudyn_model.tables import (
    ACCELERATIONS,
    JOURNAL,
    REACTIONS,
    STATE,
    corner_channels,
    energy_channels,
    run_extrema,
)
from exudyn_model.tree.solver import run_tree, tree_name
from exudyn_model.workpiece import load_forces

BODIES = ("crank", "rod 2", "rocker", "rod 4", "slider")
TWO_ROTORS = "Exudyn steps two rotors driven by equations written here; only five bodies test its own joints"


@dataclass(frozen=True)
class Result:
    """Results of a run.

    Attributes
    ----------
    columns : dict of ndarray
        Sampled channels, SI units, "time" first; all of one length.
    events : dict of ndarray
        One row for each contact, sorted by start: corner, start, end (s), normal_speed (m/s), impulse (N s),
        peak_force (N), largest_depth (m).
    pulses : dict of ndarray
        Normal forces of the contacts at the slider's corners in the accepted states: row (in ``events``),
        time (s), force (N), sorted by row and time. Very long runs keep those of the first contacts.
    extrema : dict
        Channel to "min", "time_of_min", "max", "time_of_max" over all integration steps; times in s.
    cycle_extrema : dict
        Extrema of each crank cycle, such as "slider_ay_time_of_min", as arrays of one length; the state
        where two cycles meet counts in both.
    provenance : dict
        Model, settings, versions, counters, wall time, status; all of it JSON.
    status : str
        "success", "newton-failed", "step-too-small", "work-limit", "non-finite", "singular" (in a singular
        position of a linkage), or, for a run that reached its end, "invariant-violated": see ``invariants``.
    remedy : str
        Advice after a failure, else empty.
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
        If the scene cannot be simulated or assembled; one line.
    """
    start_time = time.perf_counter()
    try:
        if "body" in scene:
            linkage = read_linkage(scene)
            run, judgement = run_linkage(linkage, progress)
            interval, settings = linkage.settings.sample_interval, {"method": linkage.settings.method}
            channels = linkage_channels(linkage, linkage.groups)
            return _result(run, channels, settings, interval, judgement, start_time)
        parameters, _ = _read_and_check(scene)
        integration = parameters.integration
        run = (run_tree if integration.formulation == "tree" else run_five_bodies)(parameters, progress)
    finally:
        seal()
    recorder, channels = run.recorder, _channels(parameters)
    events, columns = recorder.event_table(), recorder.columns(channels)
    extrema = run_extrema(recorder.extrema.by_cycle(recorder.channels, channels), channels)
    contacts, constraints = recorder.contacts, run.constraints
    judgement = judge_run(
        parameters, recorder.watch, contacts, events, columns, extrema, constraints, run.settings
    )
    return _result(run, channels, asdict(integration), parameters.sample_interval, judgement, start_time)


def _result(
    run: Run,
    channels: tuple[str, ...],
    settings: dict[str, Any],
    interval: float,
    judgement: tuple[dict[str, dict[str, Any]], str],
    start_time: float,
) -> Result:
    """Return the result of a run: the samples of ``channels``, each ``interval`` (s)."""
    recorder, outcome, constraints = run.recorder, run.outcome, run.constraints
    events, columns = recorder.event_table(), recorder.columns(channels)
    cycle_extrema = recorder.extrema.by_cycle(recorder.channels, channels)
    invariants, violation = judgement
    status, remedy = outcome.status, outcome.remedy
    if violation and status == "success":
        status = "invariant-violated"
        remedy = f"{violation}; lower solver.exudyn.{'step' if constraints else 'tolerance'}"
    provenance = {
        "model": "exudyn",
        "formulation": run.formulation,
        "integrator": settings["method"],
        "settings": settings | run.settings,
        "versions": {
            "python": platform.python_version(),
            "exudyn": exu.__version__,
            "numpy": np.__version__,
            "numba": numba.__version__,
        },
        "platform": platform.platform(),
        "counters": outcome.counters,
        "wall_time_s": time.perf_counter() - start_time,
        "invariants": invariants,
        "status": status,
    }
    if constraints:
        provenance["constraints"] = {name: value for name, (value, _) in constraints.items()} | {
            f"{name}_time_s": time_s for name, (_, time_s) in constraints.items()
        }
    times = np.arange(len(columns[channels[0]]), dtype=np.float64) * interval
    return Result(
        columns={"time": times} | columns,
        events=events,
        extrema=run_extrema(cycle_extrema, channels),
        cycle_extrema=cycle_extrema,
        provenance=provenance,
        status=status,
        remedy=remedy,
        pulses=recorder.contacts.pulses(events),
    )


def check(scene: Mapping[str, Any]) -> dict[str, float]:
    """Raise the ValueError with which :func:`simulate` refuses a scene; else return the workpiece's forces.

    ``load_at_start`` (N), and ``largest_load`` (N) on an ideal slider over a turn of the crank.
    """
    if "body" in scene:
        return read_linkage(scene).forces
    return dict(zip(("load_at_start", "largest_load"), _read_and_check(scene)[1], strict=True))


simulate.check = check  # type: ignore[attr-defined]


def plan(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return the equations of :func:`simulate` for a scene; raise a ValueError if it cannot be simulated.

    Keys: ``formulation`` as in the provenance, ``bodies``, numbers of ``coordinates`` and ``constraints``,
    and a ``note`` about the equations if they need one; of a linkage also its ``freedom``, the difference,
    and the ``start`` of each body: centroid (m) and angle (rad).
    """
    if "body" in scene:
        linkage = read_linkage(scene)
        rows, count = len(linkage.system.multipliers), 3 * len(linkage.names)
        description = {"formulation": BODIES_AND_JOINTS, "bodies": linkage.names, "coordinates": count}
        contacts = {"contacts": [*linkage.system.contact_names]} if linkage.system.contacts else {}
        start = dict(zip(linkage.names, (body.position for body in linkage.system.bodies), strict=True))
        return description | {"constraints": rows, "freedom": count - rows, "start": start} | contacts
    parameters = read_scene(scene)
    ideal_slider, ideal_pin = parameters.guide is None, parameters.journal is None
    if parameters.integration.formulation == "full":
        # Two rows a pin, one of the drive, two of an ideal slider
        rows = (12 if ideal_pin else 10) + 1 + (2 if ideal_slider else 0)
        return {"formulation": "five bodies", "bodies": [*BODIES], "coordinates": 15, "constraints": rows}
    free = [*BODIES[3 if ideal_pin else 1 :]]
    # An ideal slider is a point mass at the end of rod 4
    description = {"formulation": tree_name(parameters), "bodies": free, "constraints": 0}
    description |= {"coordinates": len(free) - ideal_slider}
    return description | ({"note": TWO_ROTORS} if ideal_pin else {})


simulate.plan = plan  # type: ignore[attr-defined]


def _read_and_check(scene: Mapping[str, Any]) -> tuple[Parameters, tuple[float, float]]:
    """Read a scene and check that it can be assembled; return also its workpiece's `load_forces`, N."""
    parameters = read_scene(scene)
    start = assemble(parameters)
    return parameters, load_forces(parameters, start.positions[SLIDER, 1])


def _channels(parameters: Parameters) -> tuple[str, ...]:
    """Return the channels that a scene requests."""
    integration = parameters.integration
    channels: tuple[str, ...] = STATE
    if integration.accelerations:
        channels += ACCELERATIONS
    if integration.corners and parameters.guide is not None:
        channels += corner_channels(CORNERS)
    if integration.corners and parameters.journal is not None:
        channels += JOURNAL
    if integration.joints:
        channels += (*REACTIONS, "crank_torque")
        if parameters.guide is None:
            channels += ("guide_force", "guide_moment")
    if integration.energy:
        channels += energy_channels(parameters.load is not None)
    return channels
