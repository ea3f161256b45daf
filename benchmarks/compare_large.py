"""`sixbar compare` on two tables of a million rows and nine channels: time and peak memory.

The tables are the slider's motion and accelerations of a made-up run of 25 crank cycles with noise of 1e-9 of
each channel's size, in 17 digits. They are compared with a tolerance, once on the same times and once on
others (the second table is interpolated), as text and as Parquet. The report is written each time. Each call
is a process of its own, started `--rounds` times: the least wall time, the least processor time (both
cores together; it does not count what else runs on the machine) and the largest memory.

    python benchmarks/compare_large.py [--rows 1000000] [--rounds 3]
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from comparison.tables.channels import channels
from comparison.tables.table import Table
from comparison.tables.table_files import write

PERIOD, CYCLES = 0.4, 25
NAMES = [name for name, channel in channels().items() if channel.group in {"motion", "accelerations"}]


def table(rows: int, seed: int) -> Table:
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, PERIOD * CYCLES, rows)
    w = 2 * np.pi / PERIOD
    columns = {"time": t}
    for n, (position, velocity, acceleration) in enumerate(
        zip(NAMES[:3], NAMES[3:6], NAMES[6:], strict=True)
    ):
        size, phase = (1e-3, 0.1, 1e-2)[n], 7 * w * t + n
        for name, values in (
            (position, np.sin(phase)),
            (velocity, 7 * w * np.cos(phase)),
            (acceleration, -((7 * w) ** 2) * np.sin(phase)),
        ):
            columns[name] = size * (values + 1e-9 * np.abs(values).max() * rng.normal(size=rows))
    return Table(pd.DataFrame(columns)[["time", *NAMES]])


def measure(a: Path, b: Path, out: Path) -> tuple[float, float, float]:
    """Return wall and processor time in s and peak memory in GB of one call."""
    command = [
        sys.executable,
        "-m",
        "comparison",
        "compare",
        str(a),
        str(b),
        "--tolerance",
        "0.01",
        "--out",
        str(out),
    ]
    started = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    seconds = time.perf_counter() - started
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        raise SystemExit(f"{' '.join(command)} ended with {child.returncode}")
    return (
        seconds,
        usage.ru_utime + usage.ru_stime,
        usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e9,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(f"{options.rows} rows, {len(NAMES)} channels, {os.cpu_count()} CPUs")
        print("\n| files | times | wall (s) | processor (s) | peak memory (GB) |")
        print("|---|---|---|---|---|")
        for ending in ("csv", "parquet"):
            paths = [folder / f"{which}.{ending}" for which in ("a", "same", "other")]
            for seed, (path, rows) in enumerate(zip(paths, (1.0, 1.0, 1.1), strict=True)):
                write(table(round(options.rows * rows), seed), path)
            for times, other in (("same", paths[1]), ("different", paths[2])):
                runs = [measure(paths[0], other, folder / "out") for _ in range(options.rounds)]
                wall, processor, memory = zip(*runs, strict=True)
                print(
                    f"| {ending} | {times} | {min(wall):.1f} | {min(processor):.1f} | {max(memory):.2f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
