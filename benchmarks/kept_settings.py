"""Whether what `sixbar settings` recommends keeps its error, on random scenes as in kept_accuracy.py.

Each recommended setting is held against runs that are more accurate than any it was chosen by: the reference
at 1e-14 and Exudyn's tree at 1e-12, whichever is farther, where `sixbar settings` calls the motion known.

    python benchmarks/kept_settings.py [--first 0] [--scenes 50] [--seconds 60] [--seed 1] [--trust]
"""

import argparse
import time

import numpy as np
from kept_accuracy import population

from comparison.accuracy.levels import at
from comparison.accuracy.refine import CHANNEL
from comparison.accuracy.work_precision import DECADES, WorkPrecision, work_precision
from comparison.execution.run import Job, run_all
from comparison.formatting import table
from comparison.models import model_of
from comparison.scene import Scene, SceneError

JUDGES = {"minimal": 1e-14, "tree": 1e-12}
MOST = 3.0
"""Times its error that a recommended setting may err by."""


def judged(scene: Scene, result: WorkPrecision, jobs: int) -> tuple[int, int, float]:
    """Return the numbers of judges and of recommendations, and the largest error over the recommended one."""
    asked = [Job(at(scene, name, setting), model_of(name)) for name, setting in JUDGES.items()]
    tables = [outcome.table for outcome in run_all(asked, jobs) if outcome.table is not None]
    worst, count = 0.0, 0
    for error in DECADES:
        row = result.cheapest(error)
        if row is None or row.x is None:
            continue
        count += 1
        known = result.known <= error
        for judge in tables:
            distance = np.abs(row.x - judge.values(CHANNEL))
            worst = max(worst, float(distance[known].max(initial=0.0)) / error)
    return len(tables), count, worst


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="number of the first scene, to go on with")
    for name, default in {"scenes": 50, "seed": 1, "jobs": 2}.items():
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--trust", action="store_true", help="scenes of study trust")
    asked = parser.parse_args()
    rows: list[list[str]] = []
    outside = 0
    for number in range(asked.first, asked.first + asked.scenes):
        try:
            drawn = population(number, asked.seed, trust=asked.trust)
        except SceneError:
            continue
        scene = drawn.with_values({"drive.cycles": 1.0})
        begun = time.monotonic()
        result = work_precision(scene, asked.seconds, n_jobs=asked.jobs)
        took = time.monotonic() - begun
        judges, count, worst = judged(scene, result, asked.jobs)
        outside += worst > MOST
        confirmed = "yes" if result.confirmed else "no"
        row = [number, scene.data["contact"]["law"], f"{took:.0f}", confirmed, count, judges, f"{worst:.2g}"]
        rows.append([str(cell) for cell in row])
        print(rows[-1], flush=True)
    head = ["scene", "law", "wall time (s)", "confirmed by both models", "errors with a command", "judges"]
    print(table([*head, "largest error over the recommended"], rows))
    print(f"{outside} of {len(rows)} outside a factor of {MOST:g}")


if __name__ == "__main__":
    main()
