"""Which values of which keys a sweep runs: a grid, a list, or a Latin hypercube."""

import csv
import difflib
import math
from collections.abc import Iterable, Sequence
from itertools import islice, product
from pathlib import Path

from scipy.stats import qmc

from comparison.files import check_size
from comparison.scene import parse_set

Point = dict[str, object]  # dotted keys of a scene and their values
MOST = 1_000_000
LARGEST_LIST = 200_000_000  # bytes of a list of points


class SweepError(ValueError):
    """A sweep that cannot be started or gone on with; the message is one line."""


def chosen_points(
    axes: Sequence[str] | None, file: Path | None, ranges: Sequence[str] | None, count: int, seed: int
) -> list[Point]:
    """Return the points that one of three ways gives: `grid`, `listed` or `latin_hypercube`."""
    ways = [name for name, given in (("--grid", axes), ("--list", file), ("--latin", ranges)) if given]
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
    """Return every combination of the values of axes ``key=a,b,c``, those of the last key changing first."""
    values: dict[str, list[object]] = {}
    for key, text in _axes("--grid", axes, "a,b,c"):
        values[key] = [_value(part) for part in text.split(",") if part.strip()]
        if not values[key]:
            raise SweepError(f"--grid {key + '=' + text!r}: needs at least one value, as in {key}=1,2,3")
    count = math.prod(map(len, values.values()))
    if count > MOST:
        raise SweepError(f"--grid: {count} points; at most {MOST} are possible")
    return [dict(zip(values, chosen, strict=True)) for chosen in product(*values.values())]


def listed(path: Path) -> list[Point]:
    """Return the rows of a CSV file whose header names keys."""
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
    if not 1 <= count <= MOST:
        raise SweepError(f"--points {count} must be 1 to {MOST}")
    sample = qmc.LatinHypercube(len(ranges), rng=seed).random(count)
    lows, highs = zip(*ranges.values(), strict=True)
    return [dict(zip(ranges, map(float, row), strict=True)) for row in qmc.scale(sample, lows, highs)]


def close_to(name: str, known: Iterable[str]) -> str:
    """Return a hint at the name that may have been meant; nothing where none is near."""
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"did you mean {close[0]!r}?" if close else ""


def _axes(option: str, axes: Sequence[str], form: str) -> list[tuple[str, str]]:
    """Return the key of each axis and what it says of it; no key twice."""
    split: dict[str, str] = {}
    for axis in axes:
        key, equals, text = axis.partition("=")
        if not equals or not all(part.strip() for part in key.split(".")):
            raise SweepError(f"{option} {axis!r} must be key={form}")
        if key.strip() in split:
            raise SweepError(f"{option}: key {key.strip()!r} is given twice")
        split[key.strip()] = text
    return list(split.items())


def _value(text: str) -> object:
    """Read a TOML value; what is none is a string."""
    return parse_set([f"key={text}"])["key"]
