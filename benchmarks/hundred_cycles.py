"""A hundred crank cycles at 150 rpm, 0.2 mm: time, and the share of correct samples.

Which part of so long a run can be right at all, strict runs say: one, one at a tenth of its tolerance, and a
perturbed run of each, started 1e-9 clearances aside. Where the four are within 1e-9 m of one another a run's
error has a meaning; elsewhere neighbouring motions have spread, and no solver can be right or wrong.

Times are of one core, of the whole call of `simulate`, the best and the median of interleaved runs.

    python benchmarks/hundred_cycles.py [--rounds 7] [--strict 1e-12]
"""

import argparse
import statistics
import time
from typing import Any

import numpy as np

from comparison.scene import load_scene
from reference_model import simulate

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


def speed(rounds: int) -> None:
    """Print times."""
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--strict", type=float, default=1e-12)
    options = parser.parse_args()
    accuracy(options.strict)
    speed(options.rounds)


if __name__ == "__main__":
    main()
