"""Speed relative to another checkout of this project: ratios of interleaved runs.

    git worktree add /tmp/before COMMIT
    python benchmarks/against.py /tmp/before runs [--rounds 7]
    python benchmarks/against.py /tmp/before five-bodies
    python benchmarks/against.py /tmp/before commands [NAME ...]

In each round the two run in turn, each in a new process: where memory and code come to lie makes processes of
the same code differ by up to 25 %. Processor time counts, and of all rounds the quartiles of the ratios.

runs: the reference, a batch each of runs from starts a micrometre apart, as one trajectory may have more
contacts than another.
five-bodies: Exudyn's, a cycle at four steps.
commands: whole calls of `sixbar` with their children, wall time and peak memory beside, each checkout with a
cache of its own, filled by one call before ("warm") or empty ("cold"). Without names all but the long ones.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import pandas as pd

HERE = Path(__file__).resolve().parents[1]
RUNS: dict[str, dict[str, tuple[Any, ...]]] = {
    "runs": {
        scene: ("reference_model", scene, {"output.groups": [], "solver.reference.tolerance": 1e-9}, 20)
        for scene in ("150rpm-0.2mm", "300rpm-0.2mm", "90rpm-0.5mm", "crank-pin", "both-clearances")
    },
    "five-bodies": {
        f"{scene}, {step:g} s": ("exudyn_model", scene, {"drive.cycles": 1, "solver.exudyn.step": step}, 1)
        for scene in ("150rpm-0.2mm", "300rpm-0.2mm")
        for step in (8e-6, 4e-6, 2e-6, 1e-6)
    },
}
"""Model, scene, changes, and runs of a batch."""
Row = dict[str, Any]

_WORKER = """
import importlib, json, sys, time
from comparison.scene import load_scene
for line in sys.stdin:
    model, name, changes, batch = json.loads(line)
    simulate = importlib.import_module(model).simulate
    start = load_scene(name).data["initial"]["slider_offset"]
    starts = [{"initial.slider_offset": start + 1e-6 * i} for i in range(batch)]
    data = [load_scene(name, changes | each).data for each in starts]
    simulate(load_scene(name, changes | {"drive.cycles": 0.02}).data)  # compiles, or loads what is compiled
    started = time.process_time()
    results = [simulate(each) for each in data]
    seconds = (time.process_time() - started) / batch
    for result in results:
        if result.status != "success":
            sys.exit(f"{name}: {result.status}")
    print(json.dumps({"seconds": seconds, "steps": results[0].provenance["counters"]["steps"]}), flush=True)
"""


class Worker:
    """A process with one checkout's code."""

    def __init__(self, checkout: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", _WORKER],
            cwd=checkout, env=os.environ | {"PYTHONPATH": str(checkout)}, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def run(self, *case: Any) -> Row:
        """Return processor time (s) and steps of a run; a case: model, scene, changes, size of the batch."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(case) + "\n")
        self.process.stdin.flush()
        if not (line := self.process.stdout.readline()):
            raise SystemExit(1)  # its message stands above
        return dict(json.loads(line))


def interleaved(checkouts: dict[str, Path], cases: dict[Any, tuple[Any, ...]], rounds: int) -> pd.DataFrame:
    """Return a row a round, case and checkout."""
    rows = []
    for number in range(rounds):
        workers = {label: Worker(path) for label, path in checkouts.items()}
        for case, arguments in cases.items():
            for label, worker in workers.items():
                rows.append({"case": case, "round": number, "which": label} | worker.run(*arguments))
        for worker in workers.values():
            worker.process.communicate()
    return pd.DataFrame(rows)


def ratios(rows: pd.DataFrame, *columns: str) -> pd.DataFrame:
    """Return, for each case, medians of either checkout, and the quartiles of here / there in time."""
    seconds = rows.pivot_table("seconds", ["case", "round"], "which", sort=False)
    by_case = (seconds["here"] / seconds["there"]).groupby("case", sort=False)
    result = {
        f"{label} (s)": seconds[label].groupby("case", sort=False).median() for label in ("there", "here")
    }
    result |= {f"here/there {share:.0%}": by_case.quantile(share) for share in (0.25, 0.5, 0.75)}
    for column in columns:
        medians = rows.pivot_table(column, "case", "which", aggfunc="median", sort=False)
        result |= {f"{column} {label}": medians[label] for label in ("there", "here")}
    return pd.DataFrame(result)


COMMANDS = {
    "help": "warm --help",
    "ideal": "warm run ideal --model reference --out OUT/ideal.csv",
    "cycles": "warm run 150rpm-0.2mm --model reference --set drive.cycles=100 "
    "--set output.samples_per_cycle=400 --out OUT/cycles.csv",
    "validate": "cold validate --out OUT/validate",
    "ensemble": "cold study sweep 150rpm-0.2mm --latin drive.speed_rpm=120:180 --points 10000 "
    "--model reference --out OUT/ensemble",
}
LONG = ("validate", "ensemble")
"""A round takes minutes."""


def commands(checkouts: dict[str, Path], rounds: int, names: list[str]) -> pd.DataFrame:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            state, *arguments = COMMANDS[name].split()
            for number in range(rounds):
                for label, checkout in checkouts.items():
                    if state == "warm" and number == 0:
                        call(checkout, arguments, Path(folder, label))
                    elif state == "cold":
                        shutil.rmtree(Path(folder, label), ignore_errors=True)
                    result = call(checkout, arguments, Path(folder, label))
                    rows.append({"case": name, "round": number, "which": label} | result)
    return pd.DataFrame(rows)


def call(checkout: Path, arguments: list[str], cache: Path) -> Row:
    """Call a command; return processor and wall time (s) and peak memory (GB), its children's too."""
    with tempfile.TemporaryDirectory() as out:
        full = [each.replace("OUT", out) for each in arguments]
        # Bytecode is kept, as by a user's Python, whatever this machine's setting.
        env = {"PYTHONPATH": str(checkout), "SIXBAR_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": ""}
        env["PYTHONPYCACHEPREFIX"] = str(cache.with_suffix(".bytecode"))
        with Path(out, "stderr").open("w+") as log:
            start = time.perf_counter()
            child = subprocess.Popen(
                [sys.executable, "-m", "comparison", *full],
                cwd=out, env=os.environ | env, stdout=subprocess.DEVNULL, stderr=log,
            )  # fmt: skip
            _, status, usage = os.wait4(child.pid, 0)
            wall = time.perf_counter() - start
            child.returncode = os.waitstatus_to_exitcode(status)
            # 1: a verdict "differ", by chance or by a fault of that checkout.
            if child.returncode not in (0, 1):
                log.seek(0)
                raise SystemExit(f"{checkout}: {' '.join(full)}: exit code {child.returncode}\n{log.read()}")
    largest = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e9
    return {"seconds": usage.ru_utime + usage.ru_stime, "wall": wall, "GB": largest}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", type=Path)
    parser.add_argument("what", choices=(*RUNS, "commands"))
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of commands: {', '.join(COMMANDS)}")
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    if unknown := set(options.names) - set(COMMANDS):
        parser.error(f"{min(unknown)} is none of {', '.join(COMMANDS)}")
    checkouts = {"there": options.checkout.resolve(), "here": HERE}
    if options.what == "commands":
        names = options.names or [name for name in COMMANDS if name not in LONG]
        result = ratios(commands(checkouts, options.rounds, names), "wall", "GB")
    else:
        result = ratios(interleaved(checkouts, RUNS[options.what], options.rounds), "steps")
    print(result.to_string(float_format="{:.4g}".format))


if __name__ == "__main__":
    main()
