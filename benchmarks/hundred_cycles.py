"""A hundred crank cycles at 150 rpm, 0.2 mm: time, its distribution, and the share of correct samples.

Which part of so long a run can be right at all, strict runs say: one, one at a tenth of its tolerance, and a
perturbed run of each, started 1e-9 clearances aside. Where the four are within 1e-9 m of one another a run's
error has a meaning; elsewhere neighbouring motions have spread, and no solver can be right or wrong.

Times are of one core, of the whole call of `simulate`, the best and the median of interleaved runs. The
shares are measured part by part: each kernel alone, in a loop, times how often a run calls it.

    python benchmarks/hundred_cycles.py [--rounds 7] [--strict 1e-12]
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from reference_model.constants import Formulation
from reference_model.forces import MEMORY, REGIME, no_contacts, slider_forces
from reference_model.formulations import DRIVEN, right_hand_side, state_size
from reference_model.progress import begin
from reference_model.reading import read_parameters
from reference_model.start import start

from comparison.scene import load_scene
from reference_model import simulate
from reference_model.dop853 import NODES, ROWS, STAGES, prepare_dense, take_step
from reference_model.linkage import rocker_tip
from reference_model.observation import CHANNELS, MOTION, MOTION_ONLY, observe, widen

CYCLES = 100.0
SCENE = load_scene("150rpm-0.2mm", {"drive.cycles": CYCLES, "output.groups": []})
TOLERANCES = (1e-7, 1e-8, 1e-9, 1e-10)
WITHIN = 1e-8
"""m."""
SPREAD = 1e-9
"""m."""


def run(tolerance: float, perturbed: bool = False) -> Any:
    data = SCENE.data
    changes: dict[str, Any] = {"solver.reference.tolerance": tolerance}
    if perturbed:
        clearance = data["clearance"]["slider"]
        changes["initial.slider_offset"] = data["initial"]["slider_offset"] + 1e-9 * clearance
        changes["initial.slider_angle"] = 1e-9 * clearance / data["mechanism"]["slider"]["length"]
    return simulate(SCENE.with_values(changes).data)


def accuracy(strict: float) -> None:
    """Print, for each tolerance, the share of the meaningful samples that are right, and the worst."""
    runs = [
        run(t, perturbed).columns["slider_x"] for t in (strict, strict / 10.0) for perturbed in (False, True)
    ]
    meaningful = np.ptp(runs, axis=0) < SPREAD
    share = meaningful.mean()
    print(
        f"Strict runs at {strict:g} and perturbed runs: within {SPREAD:g} m on {share:.1%} of the samples\n"
    )
    print(f"| tolerance | of these within {WITHIN:g} m | worst (m) |")
    print("|---|---|---|")
    for tolerance in TOLERANCES:
        miss = np.abs(run(tolerance).columns["slider_x"] - runs[0])[meaningful]
        print(f"| {tolerance:g} | {(miss <= WITHIN).mean():.3%} | {miss.max():.1e} |")


def speed(rounds: int) -> float:
    """Print times; return the best at 1e-8, s."""
    seconds: dict[float, list[float]] = {tolerance: [] for tolerance in TOLERANCES}
    for _ in range(rounds):
        for tolerance, times in seconds.items():
            started = time.perf_counter()
            run(tolerance)
            times.append(time.perf_counter() - started)
    print("\n| tolerance | best (s) | median (s) |")
    print("|---|---|---|")
    for tolerance, times in seconds.items():
        print(f"| {tolerance:g} | {min(times):.3f} | {statistics.median(times):.3f} |")
    return min(seconds[1e-8])


# Each kernel in a loop of its own. What one call gives goes into the next, so that none is left out or begun
# before the one before is done.
@numba.njit(error_model="numpy")
def _tips(n: int, c: Any, t: float) -> float:
    s = 0.0
    for _ in range(n):
        Cx, Cy, vCx, vCy, aCx, aCy = rocker_tip(c, t + s)
        s += 1e-30 * (Cx + Cy + vCx + vCy + aCx + aCy)
    return s


@numba.njit(error_model="numpy")
def _contacts(n: int, c: Any, modes: np.ndarray, contacts: np.ndarray) -> None:
    x = angle = 0.0
    for _ in range(n):
        state = (x - 0.550201, 0.0, angle + 1e-4, 0.01, 1.0, 0.1)
        Fx, Fy, M, damping, friction = slider_forces(c, state, modes, contacts)
        x += 1e-30 * (Fx + Fy + damping + friction)
        angle += 1e-30 * M


@numba.njit(error_model="numpy")
def _equations(
    n: int, c: Any, t: float, y: np.ndarray, modes: np.ndarray, dy: np.ndarray, contacts: np.ndarray
) -> None:
    for i in range(n):
        right_hand_side(c, t + 1e-9 * i, y, modes, dy, contacts)
        y[0] += 1e-30 * dy[2]


@numba.njit(error_model="numpy")
def _steps(
    n: int,
    c: Any,
    t: float,
    y: np.ndarray,
    modes: np.ndarray,
    k: np.ndarray,
    y1: np.ndarray,
    stages: np.ndarray,
    table: np.ndarray,
) -> None:
    for i in range(n):
        take_step(c, t + 1e-9 * i, 1e-6, y, modes, k, y1, stages, table)
        y[0] += 1e-30 * y1[2]


@numba.njit(error_model="numpy")
def _interpolants(
    n: int, c: Any, t: float, y: np.ndarray, y1: np.ndarray, modes: np.ndarray, k: np.ndarray,
    table: np.ndarray, scratch: np.ndarray, contacts: np.ndarray, f: np.ndarray,
) -> None:  # fmt: skip
    for i in range(n):
        prepare_dense(c, t + 1e-9 * i, 1e-6, y, y1, modes, k, table, 4, scratch, contacts, f)
        y[0] += 1e-30 * f[6, 0]


@numba.njit(error_model="numpy")
def _observations(
    n: int, c: Any, t: float, y: np.ndarray, modes: np.ndarray, dy: np.ndarray, contacts: np.ndarray,
    energies: np.ndarray, out: np.ndarray, extrema: np.ndarray, wanted: np.ndarray,
) -> None:  # fmt: skip
    for i in range(n):
        observe(c, t + 1e-9 * i, y, modes, dy, contacts, MOTION_ONLY, energies, out)
        widen(extrema, wanted, t, out)
        y[0] += 1e-30 * out[0]


def nanoseconds(loop: Callable[..., Any], *arguments: Any, count: int = 200_000) -> float:
    """Return the time of one call in a compiled loop, ns."""
    loop(1, *arguments)
    best = np.inf
    for _ in range(5):
        started = time.perf_counter()
        loop(count, *arguments)
        best = min(best, time.perf_counter() - started)
    return best / count * 1e9


def profile(total: float) -> None:
    """Print what share of a run at 1e-8, `total` s long, goes to which part."""
    p = read_parameters(SCENE.data)
    c, y0 = start(p, Formulation.SLIDER)
    progress = begin(c, y0, 1e-6)
    modes, size = progress.modes, state_size(c)
    modes[MEMORY, 0], modes[REGIME, 0] = 0.02, 2.0  # one corner closed, full friction
    y, y1, dy, scratch = progress.y, np.empty(size), np.zeros(size), np.empty(size)
    k, f, contacts, out = np.zeros((ROWS, size)), np.empty((7, size)), no_contacts(), np.empty(CHANNELS)
    t = 0.1
    tip = nanoseconds(_tips, c, t)
    contact = nanoseconds(_contacts, c, modes, contacts)
    equations = nanoseconds(_equations, c, t, y, modes, dy, contacts)
    stages = np.zeros((STAGES + 1, *contacts.shape))
    table = np.empty((DRIVEN, NODES.size))
    step = nanoseconds(_steps, c, t, y, modes, k, y1, stages, table)
    interpolant = nanoseconds(_interpolants, c, t, y, y1, modes, k, table, scratch, contacts, f)
    observing = nanoseconds(
        _observations, c, t, y, modes, dy, contacts, progress.start, out, progress.extrema[0],
        np.arange(len(MOTION)),
    )  # fmt: skip
    counters = run(1e-8).provenance["counters"]
    attempts = counters["steps"] + counters["rejected"] + counters["switches"] // 2
    samples = CYCLES * p.samples_per_cycle
    # The interpolant serves switches, peaks and samples.
    interpolants = counters["switches"] + counters["contacts"] + 0.5 * samples
    parts = {
        f"steps, {STAGES} evaluations each": (step, attempts),
        "interpolants, 3 evaluations each": (interpolant, interpolants),
        "recording: channels, extrema": (observing, counters["steps"] + samples),
    }
    print("\n| part | one call (ns) | share of a run at 1e-8 |")
    print("|---|---|---|")
    for name, (each, calls) in parts.items():
        print(f"| {name} | {each:.0f} | {each * calls * 1e-9 / total:.0%} |")
    # Alone each waits for its own results; together the processor overlaps them.
    print(f"| the equations of motion alone | {equations:.0f} | |")
    print(f"| - linkage (the rocker's tip) alone | {tip:.0f} | |")
    print(f"| - contact (corners, forces, friction) alone | {contact:.0f} | |")
    left = 1.0 - sum(each * calls for each, calls in parts.values()) * 1e-9 / total
    print(f"| location of events, bookkeeping of a step, set-up of the run | | {left:.0%} |")
    print(f"\n{counters}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--strict", type=float, default=1e-12)
    options = parser.parse_args()
    accuracy(options.strict)
    profile(speed(options.rounds))


if __name__ == "__main__":
    main()
