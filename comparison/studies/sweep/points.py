"""Which values of which keys: a grid, a list, or a Latin hypercube."""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Mapping, Sequence
from itertools import islice, product
from pathlib import Path

from scipy.stats import qmc

from comparison.files import check_size
from comparison.scene import Scene, parse_set
from comparison.studies.shared.scenes import settable

Point = dict[str, object]
"""Dotted keys of a scene and their values."""
MOST = 1_000_000
LARGEST_LIST = 200_000_000
"""Bytes of a list of points."""


class SweepError(ValueError):
    """A sweep that cannot be started or gone on with; the message is one line."""


def chosen_points(
    axes: Sequence[str] | None, file: Path | None, ranges: Sequence[str] | None, count: int, seed: int
) -> list[Point]:
    """Return the points that one of three ways gives: `grid`, `listed` or `latin_hypercube`.

    Raises
    ------
    SweepError
        If not exactly one of them is given.
    """
    given = [("--grid", bool(axes)), ("--list", file is not None), ("--latin", bool(ranges))]
    ways = [name for name, is_given in given if is_given]
    if len(ways) > 1:
        raise SweepError(f"{' and '.join(ways)}: give one of --grid, --list and --latin")
    if axes:
        return grid(axes)
    if ranges:
        return latin_hypercube(ranges, count, seed)
    if file is not None:
        return listed(file)
    raise SweepError("give one of --grid, --list and --latin: without any there is nothing to sweep")


def grid(axes: Sequence[str]) -> list[Point]:
    """Return every combination of the values of axes ``key=a,b,c``, those of the last key changing first.

    Values are as in TOML, what is not TOML is a string.

    Raises
    ------
    SweepError
        If there is no value, or a key comes twice.
    """
    values: dict[str, list[object]] = {}
    for axis in axes:
        key, text = _split("--grid", axis, "a,b,c")
        parsed = [_value(part) for part in text.split(",") if part.strip()]
        if not parsed:
            raise SweepError(f"--grid {axis!r}: needs at least one value, as in {key}=1,2,3")
        _once("--grid", key, values)
        values[key] = parsed
    count = math.prod(len(of) for of in values.values())
    if count > MOST:
        raise SweepError(f"--grid: {count} points; at most {MOST} are possible")
    return [dict(zip(values, chosen, strict=True)) for chosen in product(*values.values())]


def listed(path: Path) -> list[Point]:
    """Return the rows of a CSV file whose header names keys.

    Raises
    ------
    SweepError
        If it cannot be read, is empty, or a row has not as many values as the header.
    """
    try:
        check_size(path, LARGEST_LIST)
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(islice((row for row in csv.reader(file) if row), MOST + 2))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SweepError(f"--list {path}: cannot be read: {reason}") from error
    if len(rows) > MOST + 1:
        raise SweepError(f"--list {path}: more than {MOST} points")
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
    """Return points of a Latin hypercube over axes ``key=low:high``; the same seed gives the same points.

    Each key's range is cut into ``count`` parts, with a point in each.

    Raises
    ------
    SweepError
        If a range is none, or a key comes twice.
    """
    ranges: dict[str, tuple[float, float]] = {}
    for axis in axes:
        key, text = _split("--latin", axis, "low:high")
        low, colon, high = text.partition(":")
        try:
            bounds = float(low), float(high)
        except ValueError:
            bounds = (math.nan, math.nan)
        if not colon or not bounds[0] < bounds[1] or not math.isfinite(bounds[1] - bounds[0]):
            raise SweepError(f"--latin {axis!r}: needs two numbers low:high with low < high")
        _once("--latin", key, ranges)
        ranges[key] = bounds
    if not 1 <= count <= MOST:
        raise SweepError(f"--points {count} must be 1 to {MOST}")
    sample = qmc.LatinHypercube(len(ranges), rng=seed).random(count)
    lows, highs = zip(*ranges.values(), strict=True)
    return [dict(zip(ranges, map(float, row), strict=True)) for row in qmc.scale(sample, lows, highs)]


def check_keys(base: Scene, keys: Sequence[str]) -> None:
    """Refuse what is not a key of the scene, before anything is run.

    Raises
    ------
    SweepError
        Naming the nearest key that there is.
    """
    known = [key for key in settable(base.data) if not key.startswith("scene.")]
    for key in keys:
        if key not in known:
            close = difflib.get_close_matches(key, known, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            raise SweepError(f"sweep of scene {base.name!r}: {key!r} is not a key of a scene{hint}")


def _split(option: str, axis: str, form: str) -> tuple[str, str]:
    key, equals, text = axis.partition("=")
    if not equals or not all(part.strip() for part in key.split(".")):
        raise SweepError(f"{option} {axis!r} must be key={form}")
    return key.strip(), text


def _once(option: str, key: str, seen: Mapping[str, object]) -> None:
    if key in seen:
        raise SweepError(f"{option}: key {key!r} is given twice")


def _value(text: str) -> object:
    """Read a TOML value; what is none is a string."""
    return parse_set([f"key={text}"])["key"]
