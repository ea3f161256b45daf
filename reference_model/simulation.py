"""Simulate a scene, or refuse it before the first step if its linkage cannot be assembled."""

import math
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np

from reference_model.ideal import observe_ideal
from reference_model.linkage import Array, four_bar_rods
from reference_model.parameters import Parameters, read_parameters
from reference_model.results import EVENT_COLUMNS, Result, channel_names, count_cycles, name_results
from reference_model.workpiece import exists, load_force

STEPS_PER_CYCLE_LIMIT = 10_000_000
"""Attempted steps and switches after which a run is stopped, some 20 s. The shipped scenes need some 2e3 a
cycle at tolerance 1e-9, scenes with a clearance at the crank pin 6e3, a slider that friction jams 9e6."""
SCIPY_STEPS_PER_CYCLE_LIMIT = 2_000_000
"""The same for scipy's solvers: a step takes 0.1 (LSODA) to 0.5 ms (scipy-DOP853), so 3 to 17 minutes."""
BODIES = ("crank", "rod 2", "rocker", "rod 4", "slider")


_ANGLES = 1000
"""Crank angles at which `check_assembly` tests rod 4's reach, and again about each extreme of it."""


def simulate(scene: Mapping[str, Any], *, progress: Callable[[float], None] | None = None) -> Result:
    """Simulate a scene with the hand-written solver.

    Parameters
    ----------
    scene
        Complete nested mapping in the scene format.
    progress
        Called with the finished share, 0 to 1, at most 50 times.

    Returns
    -------
    Result

    Raises
    ------
    ValueError
        One line, if this model cannot simulate the scene.
    """
    start_time = time.perf_counter()
    if "body" in scene:
        from reference_model import planar_run

        result = planar_run.run(scene, progress)
    else:
        result = _press(scene, progress)
    result.provenance.update(
        model="reference",
        versions=dict(_versions()),
        platform=f"{platform.system()} {platform.machine()} Python {platform.python_version()}",
        wall_time_s=time.perf_counter() - start_time,
        status=result.status,
    )
    if progress is not None:
        progress(1.0)
    return result


def _press(scene: Mapping[str, Any], progress: Callable[[float], None] | None) -> Result:
    p = read_parameters(scene)
    check_assembly(p)
    count = round(p.cycles * p.samples_per_cycle)
    times = np.arange(count + 1, dtype=np.float64) * (p.period / p.samples_per_cycle)
    if _is_prescribed(p):
        return _ideal(p, times)
    # Imported only where it is used: it brings the compiler, which takes longer than a short run.
    from reference_model.running import run

    limit = STEPS_PER_CYCLE_LIMIT if p.method == "dop853" else SCIPY_STEPS_PER_CYCLE_LIMIT
    return run(p, times, progress, round(limit * max(1.0, p.cycles)))


def check(scene: Mapping[str, Any]) -> dict[str, float]:
    """Raise the `ValueError` with which `simulate` refuses a scene; else return the forces of its workpiece.

    These are ``load_at_start`` (N) and ``largest_load`` (N), the largest on an ideal slider over a cycle; of
    the press alone.
    """
    if "body" in scene:
        plan(scene)
        return {}
    return check_assembly(read_parameters(scene))


simulate.check = check  # type: ignore[attr-defined]


def plan(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return the formulation that `simulate` integrates for a scene; raise as `check` does.

    Keys: ``formulation``, as in the provenance; ``bodies``, their names; ``coordinates`` and ``constraints``,
    the numbers of these; of a linkage of bodies and pins also ``freedom``, its degrees besides the drive.
    """
    if "body" in scene:
        from reference_model import planar

        return planar.plan(scene)
    p = read_parameters(scene)
    if _is_prescribed(p):
        return {"formulation": "closed form", "bodies": [], "coordinates": 0, "constraints": 0}
    from reference_model.formulations import formulation
    from reference_model.multiplier import Linkage

    model, name = formulation(p)
    if isinstance(model, Linkage):
        return {"formulation": name, "bodies": [*BODIES], "coordinates": 15, "constraints": model.rows}
    free = [*([] if p.ideal_pin else BODIES[1:3]), *([] if p.ideal_slider else BODIES[3:])]
    return {"formulation": name, "bodies": free, "coordinates": len(free), "constraints": 0}


simulate.plan = plan  # type: ignore[attr-defined]


def _is_prescribed(p: Parameters) -> bool:
    """Return whether the drive prescribes the whole motion: nothing is to be integrated."""
    return p.ideal_slider and p.ideal_pin and not p.multipliers


@cache
def _versions() -> dict[str, str]:
    """Return the versions of the packages that compute a run, cached: the look-up outlasts a short run."""
    return {name: version(name) for name in ("sixbar-crossval", "numpy", "scipy", "numba")}


def _ideal(p: Parameters, times: Array) -> Result:
    """Return the result at the times (s) of a scene whose motion is prescribed."""
    names, cycles = channel_names(p), count_cycles(p)
    values, extrema = observe_ideal(p.mechanism, p.load, names, times, cycles)
    provenance = {
        "formulation": "closed form",
        "integrator": "none",
        "settings": {},
        "counters": {"evaluations": times.size},
    }
    events = {"corner": np.empty(0, dtype=str)} | {name: np.empty(0) for name in EVENT_COLUMNS}
    result = name_results(names, times, values, events, extrema)
    return replace(result, provenance=provenance)


def check_assembly(p: Parameters) -> dict[str, float]:
    """Close the linkage at the start and over a whole cycle; return the forces of `check`.

    Raises
    ------
    ValueError
        One line, if the linkage does not close or the force of the workpiece is not finite.
    """
    _require_four_bar(p)
    m = p.mechanism
    tip_x, tip_y = _tip(p, np.linspace(0.0, p.period, _ANGLES + 1))
    for outermost in (tip_x.argmin(), tip_x.argmax()):
        times = p.period / _ANGLES * (outermost + np.linspace(-1.0, 1.0, _ANGLES + 1))
        tip_x, tip_y = (np.concatenate(pair) for pair in zip((tip_x, tip_y), _tip(p, times), strict=True))
    # A slider with clearance moves about the centre line; reliabilities refer to the ideal slider's line.
    lines = [m.line_x] if p.ideal_slider else [m.line_x, p.guide_x]
    if any(np.abs(x - tip_x).max() >= m.L4 for x in lines):
        raise ValueError("mechanism: rod 4 is too short: it does not reach the guide all the way round")
    first_x, first_y = _tip(p, np.zeros(1))
    rest = m.L4**2 - (p.slider_start[0] - first_x) ** 2
    if not rest > 0.0:
        raise ValueError(f"initial.slider_offset = {p.slider_offset!r} m: rod 4 does not reach that far")
    if not exists(p.load):
        return {"load_at_start": 0.0, "largest_load": 0.0}
    heights = tip_y + m.slider_branch * np.sqrt(m.L4**2 - (m.line_x - tip_x) ** 2)
    start = first_y + m.slider_branch * np.sqrt(rest)
    with np.errstate(over="ignore"):
        at_start, largest = (float(load_force(p.load, y).max()) for y in (start, heights))
    if not math.isfinite(at_start + largest):
        raise ValueError(
            f"load.surface = {p.load.surface!r} m: the load on a slider down to y = {heights.min():.3g} m is "
            "beyond the numbers of the machine"
        )
    return {"load_at_start": at_start, "largest_load": largest}


def _tip(p: Parameters, times: Array) -> tuple[Array, Array]:
    """Return the position of the rocker's tip C (m) at times (s)."""
    m = p.mechanism
    _, (c3, s3, *_) = four_bar_rods(m, times)
    return m.Hx + m.L3 * c3, m.Hy + m.L3 * s3


def _require_four_bar(p: Parameters) -> None:
    """Raise unless the four-bar O-A-B-H closes over the whole revolution of the crank."""
    m = p.mechanism
    pivot = math.hypot(m.Hx, m.Hy)
    near, far = abs(pivot - m.L1), pivot + m.L1
    longest, shortest = m.L2 + m.Ls3, abs(m.L2 - m.Ls3)
    if far >= longest or near <= shortest:
        raise ValueError(
            f"mechanism: the linkage cannot be assembled over a whole revolution: crank pin to rocker pivot "
            f"is {near:.6g}..{far:.6g} m, rod 2 and rocker reach {shortest:.6g}..{longest:.6g} m"
        )
