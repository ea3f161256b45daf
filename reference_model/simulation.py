"""One scene in, one result out."""

import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np

from reference_model.assembly import assemble
from reference_model.channels import requested
from reference_model.ideal import observe_ideal
from reference_model.linkage import Array
from reference_model.parameters import Parameters, read_parameters
from reference_model.results import EVENT_COLUMNS, Result, begun_cycles, name_results

STEPS_PER_CYCLE_LIMIT = 10_000_000
"""Attempted steps and switches after which a run is stopped, some 20 s; the shipped scenes need some 2e3 a
cycle at tolerance 1e-9, those with a clearance at the crank pin 6e3, a slider that friction jams 9e6."""
SCIPY_STEPS_PER_CYCLE_LIMIT = 2_000_000
"""The same for scipy's solvers, which take 0.1 (LSODA) to 0.5 ms (scipy-DOP853) a step: 3 to 17 minutes."""
BODIES = ("crank", "rod 2", "rocker", "rod 4", "slider")


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
    assemble(p)
    count = round(p.cycles * p.samples_per_cycle)
    times = np.arange(count + 1, dtype=np.float64) * (p.period / p.samples_per_cycle)
    if _closed(p):
        result = _ideal(p, times)
    else:
        # Imported only where it is used: it brings the compiler, which takes longer than a short run.
        from reference_model.running import run

        limit = STEPS_PER_CYCLE_LIMIT if p.method == "dop853" else SCIPY_STEPS_PER_CYCLE_LIMIT
        result = run(p, times, progress, round(limit * max(1.0, p.cycles)))
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


def check(scene: Mapping[str, Any]) -> dict[str, float]:
    """Raise the `ValueError` with which `simulate` refuses a scene; else return the forces of its workpiece.

    ``load_at_start`` and ``largest_load``, N: that on an ideal slider over a cycle.
    """
    return assemble(read_parameters(scene))._asdict()


simulate.check = check  # type: ignore[attr-defined]


def plan(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return what `simulate` integrates of a scene: ``formulation``, as in the provenance, and ``bodies``.

    With the numbers of their ``coordinates`` and of the ``constraints`` between these; raises as `check`.
    """
    p = read_parameters(scene)
    if _closed(p):
        return {"formulation": "closed form", "bodies": [], "coordinates": 0, "constraints": 0}
    from reference_model.multiplier import Linkage
    from reference_model.running import formulation

    model, name = formulation(p)
    if isinstance(model, Linkage):
        return {"formulation": name, "bodies": [*BODIES], "coordinates": 15, "constraints": model.rows}
    free = [*([] if p.ideal_pin else BODIES[1:3]), *([] if p.ideal_slider else BODIES[3:])]
    return {"formulation": name, "bodies": free, "coordinates": len(free), "constraints": 0}


simulate.plan = plan  # type: ignore[attr-defined]


def _closed(p: Parameters) -> bool:
    """Return whether a scene leaves nothing to integrate."""
    return p.ideal_slider and p.ideal_pin and not p.multipliers


@cache
def _versions() -> dict[str, str]:
    """Return the versions of what computes a run; looking them up takes longer than a short run."""
    return {name: version(name) for name in ("sixbar-crossval", "numpy", "scipy", "numba")}


def _ideal(p: Parameters, times: Array) -> Result:
    names, cycles = requested(p), begun_cycles(p)
    values, extrema = observe_ideal(p.mechanism, p.load, names, times, cycles)
    provenance = {
        "formulation": "closed form",
        "integrator": "none",
        "settings": {},
        "counters": {"evaluations": times.size},
    }
    nothing = {name: np.empty(0) for name in EVENT_COLUMNS}
    result = name_results(names, times, values, {"corner": np.empty(0, dtype=str)} | nothing, extrema)
    return replace(result, provenance=provenance)
