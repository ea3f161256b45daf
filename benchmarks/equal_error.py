"""One crank cycle at 150 rpm, 0.2 mm: the minimal form against other methods at equal error of slider x.

- the paper's: 15 coordinates with multipliers, by BDF of scipy, which is of the family of MATLAB's ode15s. It
  has our compiled right-hand side and Jacobian. Its tolerance is swept until a run fails or the minutes are
  used up; the smallest error that it reached counts;
- scipy's own DOP853 on the same two equations, with the same located events;
- Exudyn's explicit adaptive solver on rod 4 and slider (its formulation "tree");
- Exudyn's implicit solver on all five bodies.

Each is timed against the largest tolerance of the minimal form with no larger error, interleaved on one core.
What counts is the ratio of the medians.

    python benchmarks/equal_error.py [--minutes 10] [--rounds 5]
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import exudyn_model
import reference_model
from comparison.scene import load_scene
from reference_model import parameters

SCENE = load_scene("150rpm-0.2mm", {"drive.cycles": 1.0, "output.groups": []})
MINIMAL_TOLERANCES = 10.0 ** -np.arange(6.0, 13.6, 0.25)
EXACT, CONFIRMED = 1e-13, 1e-14

Run = Callable[[], Any]


def reference(tolerance: float, **settings: str) -> Run:
    changes = {f"solver.reference.{key}": value for key, value in settings.items()}
    data = SCENE.with_values({**changes, "solver.reference.tolerance": tolerance}).data
    return lambda: reference_model.simulate(data)


def exudyn(**settings: Any) -> Run:
    data = SCENE.with_values({f"solver.exudyn.{key}": value for key, value in settings.items()}).data
    return lambda: exudyn_model.simulate(data)


def timed(run: Run) -> tuple[float, Any]:
    started = time.perf_counter()
    result = run()
    return time.perf_counter() - started, result


def error_of(result: Any, exact: np.ndarray) -> float:
    x = result.columns["slider_x"]
    return float(np.abs(x - exact[: x.size]).max())


def smallest_by_bdf(exact: np.ndarray, minutes: float) -> float:
    """Sweep BDF's tolerance, print a table, and return the tolerance of the smallest error."""
    print("\n| BDF: tolerance | status | largest error of x (m) | time (s) | steps | largest Phi |")
    print("|---|---|---|---|---|---|")
    errors: dict[float, float] = {}
    left = 60.0 * minutes
    for tolerance in 10.0 ** -np.arange(6.0, 19.0):
        seconds, result = timed(reference(float(tolerance), formulation="multiplier", method="BDF"))
        error, work = error_of(result, exact), result.provenance
        print(
            f"| {tolerance:.0e} | {result.status} | {error:.1e} | {seconds:.2f} "
            f"| {work['counters']['steps']:,} | {work['constraints']['position']:.1e} |",
            flush=True,
        )
        left -= seconds
        if result.status != "success":
            break
        errors[float(tolerance)] = error
        if left < 3.0 * seconds:  # what a ten times smaller tolerance costs at order five
            print(f"\nThe {minutes:g} minutes are used up.")
            break
    return min(errors, key=lambda tolerance: errors[tolerance])


def minimal_at(error: float, exact: np.ndarray) -> tuple[float, float]:
    """Return the largest tolerance of the minimal form with no larger error, and its error."""
    for tolerance in MINIMAL_TOLERANCES:
        reached = error_of(reference(float(tolerance))(), exact)
        if reached <= error:
            return float(tolerance), reached
    raise SystemExit(f"the minimal form does not reach an error of {error:.1e} m")


def compare(name: str, other: Run, exact: np.ndarray, known: float, rounds: int) -> str:
    """Time a run against the minimal form at no larger error; return a row of the table."""
    # An error below that of the exact solution cannot be distinguished from it.
    error = max(error_of(other(), exact), known)
    tolerance, reached = minimal_at(error, exact)
    minimal = reference(tolerance)
    ours, theirs = [], []
    for _ in range(rounds):
        ours += [timed(minimal)[0] for _ in range(20)]
        theirs.append(timed(other)[0])
    few, many = statistics.median(ours), statistics.median(theirs)
    return (
        f"| {name} | {error:.1e} | {many:.3f} | {tolerance:.1e} | {reached:.1e} | {few * 1e3:.1f} "
        f"| {many / few:.0f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0, help="time for the sweep of BDF's tolerance")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    # A scene ends at 1e-14. BDF may go on, to see where it ends itself.
    parameters.SMALLEST_TOLERANCE = 0.0
    exact = reference(EXACT)().columns["slider_x"]
    known = error_of(reference(CONFIRMED)(), exact)
    print(f"The exact solution, minimal at {EXACT:g}, is {known:.1e} m from minimal at {CONFIRMED:g}.")
    reference(1e-6, formulation="multiplier", method="BDF")()  # compiles
    bdf = smallest_by_bdf(exact, options.minutes)
    others = {
        f"multipliers, BDF, tolerance {bdf:.0e}": reference(bdf, formulation="multiplier", method="BDF"),
        "scipy's DOP853, two coordinates, tolerance 1e-9": reference(1e-9, method="scipy-DOP853"),
        "Exudyn, rod 4 and slider, tolerance 1e-8": exudyn(formulation="tree", tolerance=1e-8, step=1e-4),
        "Exudyn, rod 4 and slider, tolerance 1e-10": exudyn(formulation="tree", tolerance=1e-10, step=1e-4),
        "Exudyn, five bodies, step 1e-6 s": exudyn(step=1e-6),
    }
    print("\n| | error (m) | time (s) | minimal: tolerance | error (m) | time (ms) | ratio |")
    print("|---|---|---|---|---|---|---|")
    for name, other in others.items():
        print(compare(name, other, exact, known, options.rounds), flush=True)


if __name__ == "__main__":
    main()
