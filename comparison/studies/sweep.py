"""Sweeps: runs over any keys of a scene, in a grid, a list or a Latin hypercube; a table with a row a run."""

import csv
import logging
import math
import socket
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import islice, product, takewhile
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pandas as pd
from scipy.stats import qmc

from comparison.execution.pool import Attempt, Death
from comparison.execution.run import Progress, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Rows, Spread, Task, measure_all
from comparison.files import check_size, replacing
from comparison.metrics import rms
from comparison.models import find
from comparison.reliability.errors import slider_errors
from comparison.scene import Scene, parse_set
from comparison.scene.keys import did_you_mean, toml
from comparison.studies.shared.scenes import key_values
from comparison.tables.channels import known_channels
from comparison.tables.table import Table

# ---- the points

Point = dict[str, object]  # dotted keys of a scene and their values
MOST_POINTS = 1_000_000
LARGEST_LIST = 200_000_000  # bytes of a list of points


class SweepError(ValueError):
    """A sweep that cannot start or continue; the message is one line."""


def sweep_points(
    axes: Sequence[str] | None, file: Path | None, ranges: Sequence[str] | None, count: int, seed: int
) -> list[Point]:
    """Return the points of the option that has a value: `grid`, `read_list` or `latin_hypercube`."""
    options = [option for option, value in (("--grid", axes), ("--list", file), ("--latin", ranges)) if value]
    if len(options) > 1:
        raise SweepError(f"{' and '.join(options)}: give one of --grid, --list and --latin")
    if axes:
        return grid(axes)
    if ranges:
        return latin_hypercube(ranges, count, seed)
    if file is not None:
        return read_list(file)
    raise SweepError("give one of --grid, --list and --latin: without any there is nothing to sweep")


def check_set(points: Sequence[Point], values: Mapping[str, object]) -> None:
    """Raise a `SweepError` where a key that is set to a value is swept as well."""
    for key in values:
        if key in points[0]:
            raise SweepError(f"--set {key}: the key is swept and cannot be set as well")


def grid(axes: Sequence[str]) -> list[Point]:
    """Return every combination of the values of axes ``key=a,b,c``, those of the last key changing first."""
    values: dict[str, list[object]] = {}
    for key, text in _axes("--grid", axes, "a,b,c"):
        values[key] = [_value(part) for part in text.split(",") if part.strip()]
        if not values[key]:
            raise SweepError(f"--grid {key + '=' + text!r}: needs at least one value, as in {key}=1,2,3")
    count = math.prod(map(len, values.values()))
    if count > MOST_POINTS:
        raise SweepError(f"--grid: {count} points; at most {MOST_POINTS} are possible")
    return [dict(zip(values, row, strict=True)) for row in product(*values.values())]


def read_list(path: Path) -> list[Point]:
    """Return the rows of a CSV file whose header names keys."""
    try:
        check_size(path, LARGEST_LIST)
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(islice((row for row in csv.reader(file) if row), MOST_POINTS + 2))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SweepError(f"--list {path}: cannot be read: {reason}") from error
    if len(rows) > MOST_POINTS + 1:
        raise SweepError(f"--list {path}: more than {MOST_POINTS} points")
    if len(rows) < 2:
        raise SweepError(f"--list {path}: needs a line of keys and at least one line of values")
    keys = [key.strip() for key in rows[0]]
    if len(set(keys)) < len(keys):
        raise SweepError(f"--list {path}: names a key twice")
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(keys):
            raise SweepError(f"--list {path}: line {number} has {len(row)} values for {len(keys)} keys")
    return [dict(zip(keys, map(_value, row), strict=True)) for row in rows[1:]]


def latin_hypercube(axes: Sequence[str], count: int, seed: int) -> list[Point]:
    """Return points of a Latin hypercube over axes ``key=low:high``: one in each of ``count`` parts."""
    ranges: dict[str, tuple[float, float]] = {}
    for key, text in _axes("--latin", axes, "low:high"):
        try:
            low, high = map(float, text.split(":"))
        except ValueError:
            low = high = math.nan
        if not (low < high and math.isfinite(high - low)):
            raise SweepError(f"--latin {key + '=' + text!r}: needs two numbers low:high with low < high")
        ranges[key] = low, high
    if not 1 <= count <= MOST_POINTS:
        raise SweepError(f"--points {count} must be 1 to {MOST_POINTS}")
    sample = qmc.LatinHypercube(len(ranges), rng=seed).random(count)
    lows, highs = zip(*ranges.values(), strict=True)
    return [dict(zip(ranges, map(float, row), strict=True)) for row in qmc.scale(sample, lows, highs)]


def _axes(option: str, axes: Sequence[str], form: str) -> list[tuple[str, str]]:
    """Return the key of each axis and its text; no key twice."""
    texts: dict[str, str] = {}
    for axis in axes:
        key, equals, text = axis.partition("=")
        if not equals or not all(part.strip() for part in key.split(".")):
            raise SweepError(f"{option} {axis!r} must be key={form}")
        if key.strip() in texts:
            raise SweepError(f"{option}: key {key.strip()!r} is given twice")
        texts[key.strip()] = text
    return list(texts.items())


def _value(text: str) -> object:
    """Read a TOML value; any other text is a string."""
    return parse_set([f"key={text}"])["key"]


# ---- the quantities of each run, and the processes

ROWS, TABLE = "runs", "sweep.csv"
IDEAL: Point = {"joints.slider": "ideal", "joints.crank_pin": "ideal", "output.groups": ["accelerations"]}
STATISTICS = ("min", "max", "rms", "end")  # min and max over the integration steps
ERROR_CHANNELS = ("slider_y", "slider_vy", "slider_ay")  # the paper shows their errors
CONTACT_COLUMNS = ("normal_speed", "impulse", "peak_force", "largest_depth")
DEFAULTS = (*(f"peak_error:{name}" for name in ERROR_CHANNELS), "contacts", "impulse", "largest:peak_force")
PATIENCE = 10.0  # s, after which waiting for a scheduler that does not answer is stopped


def names(scene: Mapping[str, Any]) -> list[str]:
    """List every quantity of a run of a scene; no model writes channels of the crank."""
    channels = [name for name, channel in known_channels(scene).items() if channel.group != "crank"]
    return [
        *(f"{statistic}:{channel}" for statistic in STATISTICS for channel in channels),
        *(f"peak_error:{channel}" for channel in ERROR_CHANNELS),
        "contacts",
        "impulse",
        *(f"largest:{column}" for column in CONTACT_COLUMNS),
        "steps",
    ]


def quantity(name: str, run: Table, ideal: Table | None, period: float) -> float | None:
    """Return one of the `names` of a run; None where the run lacks the channel or its contacts.

    A peak error is the largest over the second cycle, as in the paper; over all where there is no second.
    """
    kind, _, part = name.partition(":")
    if kind in ("peak_error", *STATISTICS) and part not in run.names:
        return None
    if kind == "peak_error":
        assert ideal is not None
        second = (period, 2 * period) if run.time[-1] >= 2 * period * (1 - 1e-9) else ()
        return abs(slider_errors(run, ideal, period, names=(part,)).peak(part, *second).value)
    if kind in ("min", "max") and part in run.extrema:
        return float(run.extrema[part][kind])
    if kind in STATISTICS:
        values = run.values(part)
        summary = {"min": values.min(), "max": values.max(), "end": values[-1], "rms": rms(run.time, values)}
        return float(summary[kind])
    if kind == "steps":
        steps = run.provenance.get("counters", {}).get("steps")
        return None if steps is None else float(steps)
    if run.events is None:
        return None
    if kind == "largest":
        return float(run.events[part].max()) if len(run.events) else 0.0
    return float(len(run.events) if kind == "contacts" else run.events["impulse"].to_numpy().sum())


@dataclass(frozen=True)
class SweepRun(Task):
    """Run of the base scene with a point's values by a model, and the quantities to measure."""

    base: Scene
    point: Point
    model: str
    quantities: tuple[str, ...]

    @property
    def identity(self) -> dict[str, Any]:
        """Its fields, the point as texts: JSON has neither nan nor dates, and a run refuses both."""
        return super().identity | {"point": _texts(self.point)}

    @property
    def models(self) -> tuple[str, ...]:
        """Its model, and the reference, which has the ideal mechanism in closed form."""
        return self.model, "reference"


def _texts(point: Point) -> dict[str, str]:
    return {key: toml(value) for key, value in point.items()}


def run_point(task: SweepRun, progress: Progress) -> Row:
    """Run a point and measure its quantities."""
    del progress
    scene = task.base.with_values(task.point)
    run, ideal = run_one(scene, task.model), None
    if any(name.startswith("peak_error:") for name in task.quantities):
        # Its closed form is the reference model's, whoever runs the scene: all motion is the drive's.
        ideal = run_one(scene.with_values(IDEAL), "reference")
    return {"values": {name: quantity(name, run, ideal, scene.period) for name in task.quantities}}


def sweep(
    base: Scene,
    points: Sequence[Point],
    models: Sequence[str],
    quantities: Sequence[str],
    folder: Path,
    spread: Spread,
    on_progress: Progress | None = None,
) -> tuple[Path, int]:
    """Run all points by all models; return the path of the table and the number of failed runs.

    Each run's row is kept in the folder as soon as it ends: a sweep that was interrupted resumes. The table
    does not depend on the order of the runs; failed runs are rows too, with their reason. The folder is made
    once all keys and quantities are known: an unknown one is a `SweepError`, a row that cannot be stored an
    `OSError`.
    """
    choices = names(base.data)
    for name in quantities:
        if name not in choices:
            close = get_close_matches(name, choices, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"such as {', '.join(DEFAULTS)}"
            raise SweepError(f"--output {name!r} is not a quantity of a run; {hint}")
    keys = [key for key in key_values(base.data) if not key.startswith("scene.")]
    for key in dict.fromkeys(key for point in points for key in point):
        if key not in keys:
            hint = f"is not a key of a scene{did_you_mean(key, base.schema)}"
            raise SweepError(f"sweep of scene {base.name!r}: {key!r} {hint}")
    for model in models:
        find(model)
    folder.mkdir(parents=True, exist_ok=True)
    tasks = [SweepRun(base, point, model, tuple(quantities)) for point in points for model in models]
    rows = measure_all(run_point, tasks, spread, on_progress, folder=folder / ROWS)
    lines = [
        {"point": number // len(models) + 1, **task.point, "model": task.model}
        | {"status": row["status"], "message": row["message"]}
        | {name: row.get("values", {}).get(name) for name in task.quantities}
        for number, (task, row) in enumerate(zip(tasks, rows, strict=True))
    ]
    path = folder / TABLE
    previous = _content(path) if path.exists() else set()
    with replacing(path) as part:
        pd.DataFrame(lines).to_csv(part, index=False)
    if not previous <= _content(path):
        again = "its own command writes it again from the stored runs"
        logging.getLogger(__name__).warning("%s: replaces the table of another sweep; %s", path, again)
    return path, sum(row["status"] != SUCCESS for row in rows)


def _content(path: Path) -> set[str]:
    """Return the columns of a table, and the point and the model of each of its rows, as texts."""
    with path.open(encoding="utf-8", errors="replace", newline="") as file:
        rows = csv.DictReader(file)
        inputs = {str([*takewhile(lambda cell: cell[0] != "status", row.items())][1:]) for row in rows}
        return inputs | {*(rows.fieldnames or ())}


def on_cluster(address: str) -> Spread:
    """Return a `Spread` over the workers of a Dask scheduler, which have this package installed."""
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise SweepError("--scheduler needs dask: pip install 'sixbar-crossval[cluster]'") from error
    # The message on a lost connection is the one line below, not theirs.
    for name in ("distributed", "tornado", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    where = f"--scheduler {address}"
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise SweepError(f"{where}: {error}") from error
    if not host or not port:
        raise SweepError(f"{where}: must be tcp://host:port")
    try:
        # Dask's own client tries for twice its patience where nobody listens, and without end where one who
        # listens stays silent. A scheduler speaks first, except in the handshake of TLS.
        with socket.create_connection((host, port), timeout=PATIENCE) as connection:
            if parts.scheme == "tcp":
                connection.recv(1)
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split()) or type(error).__name__
        raise SweepError(f"{where}: does not answer: {reason}") from error

    def spread(attempt: Attempt, tasks: Mapping[str, Task]) -> Rows:
        try:
            try:
                client.wait_for_workers(1, timeout=PATIENCE)
            except TimeoutError as error:
                raise SweepError(f"{where}: has no workers") from error
            futures = {
                client.submit(_run_task, attempt, task, key=f"sixbar-{key}", pure=False, retries=0): key
                for key, task in tasks.items()
            }
            for future in as_completed(futures, loop=client.loop):
                if future.status == "finished":
                    yield futures[future], future.result()
                elif future.status == "error" and type(future.exception()).__name__ == "KilledWorker":
                    yield futures[future], Death("its worker died")
                else:
                    raise SweepError(f"{where}: lost; finished runs are kept")
        finally:
            with suppress(OSError, TimeoutError):
                client.close(timeout=2)

    return spread


def _run_task(attempt: Attempt, task: Task) -> Any:
    """Run a task on the cluster, where no progress is reported."""
    return attempt(task, lambda _: None)
