"""Processor time of whole commands relative to another checkout of this project: ratios of interleaved calls.

Every command is called in both checkouts in turn, in new processes and a cache of each checkout alone; its
children count. "Warm" commands are called once before they are measured, "cold" ones with an empty cache.

    git worktree add /tmp/before f248ffa
    python benchmarks/commands_against.py /tmp/before [NAME ...] [--rounds 5]

Without names all but the long ones: `validate` takes minutes a round, `ensemble` (10,000 runs of two cycles)
too.
"""

import argparse
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Command:
    """Arguments of ``sixbar``, and whether its second call counts."""

    arguments: tuple[str, ...]
    warm: bool = True
    long: bool = False


COMMANDS = {
    "help": Command(("--help",)),
    "ideal": Command(("run", "ideal", "--model", "reference", "--out", "OUT/ideal.csv")),
    "cycles": Command(
        (
            *("run", "150rpm-0.2mm", "--model", "reference", "--set", "drive.cycles=100"),
            *("--set", "output.samples_per_cycle=400", "--out", "OUT/cycles.csv"),
        )
    ),
    "validate": Command(("validate", "--out", "OUT/validate"), warm=False, long=True),
    "ensemble": Command(
        (
            *("study", "sweep", "150rpm-0.2mm", "--latin", "drive.speed_rpm=120:180", "--points", "10000"),
            *("--model", "reference", "--out", "OUT/ensemble"),
        ),
        warm=False,
        long=True,
    ),
}


def called(checkout: Path, command: Command, cache: Path) -> tuple[float, float]:
    """Call a command; return its processor time and wall time, s."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = [each.replace("OUT", folder) for each in command.arguments]
        # Bytecode is kept, as by a user's Python, whatever this machine's setting.
        environment = os.environ | {
            "PYTHONPATH": str(checkout),
            "SIXBAR_CACHE_DIR": str(cache),
            "PYTHONDONTWRITEBYTECODE": "",
            "PYTHONPYCACHEPREFIX": str(cache.with_suffix(".bytecode")),
        }
        before, begun = _children(), time.perf_counter()
        ended = subprocess.run(
            [sys.executable, "-m", "comparison", *arguments],
            cwd=folder, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        wall = time.perf_counter() - begun
    # 1: a verdict "differ", which f248ffa has by chance on processors with AVX-512
    if ended.returncode == 1:
        print(f"{checkout}: {' '.join(arguments)}: exit code 1", file=sys.stderr)
    elif ended.returncode:
        raise SystemExit(f"{checkout}: {' '.join(arguments)}: exit code {ended.returncode}\n{ended.stderr}")
    return _children() - before, wall


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", type=Path)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(COMMANDS))
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    if unknown := set(options.names) - set(COMMANDS):
        parser.error(f"{min(unknown)} is none of {', '.join(COMMANDS)}")
    names = options.names or [name for name, command in COMMANDS.items() if not command.long]
    checkouts = {"there": options.checkout.resolve(), "here": Path(__file__).resolve().parents[1]}
    print("| command | there (s) | here (s) | here / there: lowest | median | highest | wall time |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            rounds = _rounds(COMMANDS[name], checkouts, Path(folder), options.rounds)
            (there, wall_there), (here, wall_here) = (
                [statistics.median(times) for times in zip(*rounds[which], strict=True)]
                for which in checkouts
            )
            ratios = [h[0] / t[0] for t, h in zip(rounds["there"], rounds["here"], strict=True)]
            print(
                f"| {name} | {there:.2f} | {here:.2f} | {min(ratios):.3f} | {statistics.median(ratios):.3f} "
                f"| {max(ratios):.3f} | {wall_here / wall_there:.3f} |",
                flush=True,
            )


def _rounds(
    command: Command, checkouts: dict[str, Path], folder: Path, rounds: int
) -> dict[str, list[tuple[float, float]]]:
    times: dict[str, list[tuple[float, float]]] = {which: [] for which in checkouts}
    for n in range(rounds):
        for which, checkout in checkouts.items():
            cache = folder / which
            if command.warm and n == 0:
                called(checkout, command, cache)
            elif not command.warm and cache.exists():
                shutil.rmtree(cache)
            times[which].append(called(checkout, command, cache))
    return times


if __name__ == "__main__":
    main()
