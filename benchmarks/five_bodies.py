"""Work and precision of Exudyn's five bodies relative to another checkout: ratios of interleaved runs.

For each step the processor time of a cycle and the largest error of x against the tree at its strict setting,
over the samples that can be predicted: where two runs of the tree, one of them started a billionth of the
clearance beside the other, stay within 1e-10 m. The checkouts run in turn, each in a process of its own, in
which all kernels are compiled or loaded before; of all rounds the median of the ratios counts.

    git worktree add /tmp/before b9bd796
    python benchmarks/five_bodies.py /tmp/before [--rounds 7] [--steps 8e-6 4e-6 2e-6 1e-6]
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

from comparison.scene import load_scene

SCENES = ("150rpm-0.2mm", "300rpm-0.2mm")

_RUNNER = """
import json, sys, time
from comparison.scene import load_scene
from exudyn_model import simulate
for line in sys.stdin:
    name, changes = json.loads(line)
    scene = load_scene(name, changes | {"drive.cycles": 1}).data
    started = time.process_time()
    result = simulate(scene)
    seconds = time.process_time() - started
    steps = result.provenance["counters"]["steps"]
    print(json.dumps([result.status, seconds, steps, result.columns["slider_x"].tolist()]), flush=True)
"""

Run = tuple[float, int, list[float]]


class Runner:
    """A process with one checkout's code."""

    def __init__(self, checkout: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _RUNNER],
            cwd=checkout, env=os.environ | {"PYTHONPATH": str(checkout)}, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def run(self, scene: str, changes: dict[str, object]) -> Run:
        """Return processor time (s), number of steps and x (m) of a run."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps([scene, changes]) + "\n")
        self._process.stdin.flush()
        status, seconds, steps, x = json.loads(self._process.stdout.readline())
        if status != "success":
            raise SystemExit(f"{scene}, {changes}: {status}")
        return seconds, steps, x

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def full(step: float) -> dict[str, object]:
    return {"solver.exudyn.formulation": "full", "solver.exudyn.step": step}


def largest_error(x: list[float], exact: list[float], beside: list[float]) -> float:
    """Return the largest distance (m) of ``x`` from ``exact`` over the predictable samples."""
    triples = zip(x, exact, beside, strict=True)
    return max(abs(a - b) for a, b, c in triples if abs(b - c) < 1e-10)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--steps", type=float, nargs="+", default=[8e-6, 4e-6, 2e-6, 1e-6])
    options = parser.parse_args()
    checkouts = {"there": options.checkout.resolve(), "here": Path(__file__).resolve().parents[1]}
    runners = {which: Runner(path) for which, path in checkouts.items()}
    for runner in runners.values():
        runner.run("150rpm-0.2mm", full(1e-5))  # compiles
    print(
        "| scene | step (s) | there (s) | error (m) | steps | here (s) | error (m) | steps | here / there |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for scene in SCENES:
        tree: dict[str, object] = {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-11}
        start = load_scene(scene).data["initial"]["slider_offset"]
        exact, beside = (
            runners["here"].run(scene, tree | {"initial.slider_offset": offset})[2]
            for offset in (start, start + 2e-13)
        )
        for step in options.steps:
            runs: dict[str, list[Run]] = {which: [] for which in checkouts}
            for _ in range(options.rounds):
                for which, runner in runners.items():
                    runs[which].append(runner.run(scene, full(step)))
            cells = []
            for which in checkouts:
                seconds = statistics.median(run[0] for run in runs[which])
                _, steps, x = runs[which][0]
                cells.append(f"{seconds:.2f} | {largest_error(x, exact, beside):.2e} | {steps}")
            pairs = zip(runs["there"], runs["here"], strict=True)
            ratio = statistics.median(new[0] / old[0] for old, new in pairs)
            print(f"| {scene} | {step:g} | {cells[0]} | {cells[1]} | {ratio:.3f} |", flush=True)
    for runner in runners.values():
        runner.close()


if __name__ == "__main__":
    main()
