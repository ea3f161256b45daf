"""Cost of a reference run relative to another checkout of this project: ratios of interleaved runs.

In each round each checkout gets a new process, in which its kernels are compiled or loaded before anything is
measured: where memory and code come to lie makes processes of the same code differ by up to 25 %. The two run
in turn, a batch each, of runs from starts a micrometre apart, as one trajectory may have more contacts than
another. A batch's processor time counts, and of all rounds the median of the ratios.

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

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--batch", type=int, default=20)
    parser.add_argument("--tolerance", type=float, default=1e-9)
    options = parser.parse_args()
    checkouts = {"there": options.checkout.resolve(), "here": Path(__file__).resolve().parents[1]}
    times: dict[tuple[str, str], list[float]] = {
        (scene, which): [] for scene in SCENES for which in checkouts
    }
    for _ in range(options.rounds):
        runners = {which: Runner(path, options.tolerance) for which, path in checkouts.items()}
        for scene in SCENES:
            for which, runner in runners.items():
                runner.seconds(scene, 1)
                times[scene, which].append(runner.seconds(scene, options.batch))
        for runner in runners.values():
            runner.close()
    print("| scene | there (ms) | here (ms) | here / there: quartile | median | quartile |")
    print("|---|---|---|---|---|---|")
    for scene in SCENES:
        there, here = (statistics.median(times[scene, which]) for which in checkouts)
        pairs = zip(times[scene, "there"], times[scene, "here"], strict=True)
        low, median, high = statistics.quantiles([new / old for old, new in pairs], n=4)
        print(f"| {scene} | {1e3 * there:.2f} | {1e3 * here:.2f} | {low:.3f} | {median:.3f} | {high:.3f} |")


if __name__ == "__main__":
    main()
