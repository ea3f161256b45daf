"""What a run of the reference costs, against another checkout of this project: ratios of interleaved runs.

Each checkout gets a process of its own, in which its kernels are compiled before anything is measured. The
two run in turn, a batch each, of runs from starts a micrometre apart, as one trajectory may have more
contacts than another. A batch's processor time counts, and of all rounds the median of the ratios.

    git worktree add /tmp/before f248ffa
    python benchmarks/against.py /tmp/before [--rounds 15] [--batch 20] [--tolerance 1e-9]
"""

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

SCENES = ("150rpm-0.2mm", "300rpm-0.2mm", "90rpm-0.5mm", "crank-pin", "both-clearances")

_RUNNER = """
import sys, time
from comparison.scene import load_scene
from reference_model import simulate
changes = {"output.groups": [], "solver.reference.tolerance": float(sys.argv[1])}
for line in sys.stdin:
    name, batch = line.split()
    start = load_scene(name).data["initial"]["slider_offset"]
    starts = [start + 1e-6 * i for i in range(int(batch))]
    data = [load_scene(name, changes | {"initial.slider_offset": x}).data for x in starts]
    simulate(data[0])
    started = time.process_time()
    status = [simulate(each).status for each in data]
    worst = min(set(status) - {"success"}, default="success")
    print((time.process_time() - started) / int(batch), worst, flush=True)
"""


class Runner:
    """A process with one checkout's code."""

    def __init__(self, checkout: Path, tolerance: float) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _RUNNER, str(tolerance)],
            cwd=checkout, env=os.environ | {"PYTHONPATH": str(checkout)}, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def seconds(self, scene: str, batch: int) -> float:
        """Return the processor time of a run, s, the mean of a batch."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{scene} {batch}\n")
        self._process.stdin.flush()
        seconds, status = self._process.stdout.readline().split()
        if status != "success":
            raise SystemExit(f"{scene}: {status}")
        return float(seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--batch", type=int, default=20)
    parser.add_argument("--tolerance", type=float, default=1e-9)
    options = parser.parse_args()
    here = Runner(Path(__file__).resolve().parents[1], options.tolerance)
    there = Runner(options.checkout.resolve(), options.tolerance)
    print("| scene | there (ms) | here (ms) | ratio here / there: least | median | greatest |")
    print("|---|---|---|---|---|---|")
    for scene in SCENES:
        here.seconds(scene, 1)
        there.seconds(scene, 1)
        pairs = [
            (there.seconds(scene, options.batch), here.seconds(scene, options.batch))
            for _ in range(options.rounds)
        ]
        before, after = (statistics.median(times) for times in zip(*pairs, strict=True))
        ratios = [new / old for old, new in pairs]
        print(
            f"| {scene} | {1e3 * before:.2f} | {1e3 * after:.2f} | {min(ratios):.3f} "
            f"| {statistics.median(ratios):.3f} | {max(ratios):.3f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
