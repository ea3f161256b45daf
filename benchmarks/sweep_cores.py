"""How much of two cores a sweep uses: processor time of its workers over wall time, and what the rest is.

    python benchmarks/sweep_cores.py [RUNS]

On a machine that does nothing else. The worker processes' start counts; what they need for it is printed.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

from comparison.execution.tasks import on_processes
from comparison.scene import load_scene
from comparison.studies.sweep.outputs import USUAL
from comparison.studies.sweep.points import latin_hypercube
from comparison.studies.sweep.study import sweep

CORES = 2


def main() -> None:
    """Sweep, and print the share."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    points = latin_hypercube(["drive.speed_rpm=120:180", "clearance.slider=1e-4:3e-4"], runs, seed=0)
    with tempfile.TemporaryDirectory() as folder:
        before, start = used(), time.perf_counter()
        scene = load_scene("150rpm-0.2mm")
        sweep(scene, points, ["reference"], USUAL, Path(folder), on_processes(CORES))
        wall = time.perf_counter() - start
    own, workers = (after - b for after, b in zip(used(), before, strict=True))
    print(f"{runs} runs in {wall:.1f} s: {1e3 * wall / runs:.2f} ms a run")
    print(f"processor time: workers {workers:.1f} s, the parent {own:.1f} s")
    print(f"of {CORES} cores the workers used {workers / (CORES * wall):.1%}")


def used() -> tuple[float, float]:
    """Return the processor time of this process and of its children that have ended, s."""
    times = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return times[0].ru_utime + times[0].ru_stime, times[1].ru_utime + times[1].ru_stime


if __name__ == "__main__":
    main()
