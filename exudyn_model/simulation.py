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

from exudyn_model import solver
from exudyn_model.assembly import assemble
from exudyn_model.mechanism import build
from exudyn_model.recording import ACCELERATIONS, CORNER_CHANNELS, STATE, Recorder
from exudyn_model.scene_reading import read_scene


@dataclass(frozen=True)
class Result:
    """What a run produced.

    Attributes
    ----------
    columns : dict of ndarray
        Sampled channels, SI units, "time" first; all of one length.
    events : dict of ndarray
        One row a contact, sorted by start: corner, start, end (s), normal_speed (m/s), impulse (N s),
        peak_force (N), largest_depth (m).
    extrema : dict
        Channel to "min", "time_of_min", "max", "time_of_max" over all integration steps.
    provenance : dict
        Model, settings, versions, counters, wall time, status; only what JSON can hold.
    status : str
        "success", "newton-failed" or "non-finite".
    remedy : str
        What to try after a failure, else empty.
    """

    columns: dict[str, NDArray[np.float64]]
    events: dict[str, NDArray[Any]]
    extrema: dict[str, dict[str, float]]
    provenance: dict[str, Any]
    status: str
    remedy: str


def simulate(scene: Mapping[str, Any], *, progress: Callable[[float], None] | None = None) -> Result:
    """Simulate a scene with Exudyn.

    Parameters
    ----------
    scene : mapping
        Complete scene, defaults filled in.
    progress : callable, optional
        Receives the finished share, 0 to 1.

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
    steps = solver.choose_steps(parameters.drive, parameters.integration)
    model = build(parameters, assemble(parameters), steps.size)
    recorder = Recorder(parameters.mechanism, model.law, model.corners, steps.per_sample, steps.samples)
    outcome = solver.solve(model.mbs, steps, parameters.integration.tolerance, recorder, progress)
    channels: tuple[str, ...] = STATE
    if parameters.integration.accelerations:
        channels += ACCELERATIONS
    if parameters.integration.corners:
        channels += CORNER_CHANNELS
    columns = recorder.columns(channels)
    times = np.arange(len(columns["slider_x"]), dtype=np.float64) * steps.sample_interval
    provenance = {
        "model": "exudyn",
        "formulation": "redundant-coordinates",
        "integrator": "generalized-alpha",
        "settings": asdict(parameters.integration)
        | {"spectral_radius": solver.SPECTRAL_RADIUS}
        | {"step_used": steps.size, "steps_per_sample": steps.per_sample},
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
    return Result(
        {"time": times} | columns,
        recorder.events(),
        recorder.extrema(channels),
        provenance,
        outcome.status,
        outcome.remedy,
    )
