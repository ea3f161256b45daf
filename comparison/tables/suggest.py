"""Suggestion of a mapping: channel, unit and sign of each column of another program's table.

Each column is compared with each column of the other table at times that both span; with a channel of the
press in all units that programs use. A name counts only for the column of the time.
"""

from collections.abc import Iterator, Sequence
from itertools import product, starmap
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from comparison.formatting import number
from comparison.scene.keys import toml
from comparison.tables.channels import channels
from comparison.tables.dialect import Column, Source
from comparison.tables.foreign import open_source
from comparison.tables.mapping import TIME, Dialects
from comparison.tables.units import alternatives, parse_unit, same_dimension

_GRID = 2000  # times at which columns are compared
# RMS distance as a share of the larger standard deviation: of unrelated columns it is 1 and more, two models
# of one motion are nearer, except where chatter separates them.
_LARGEST_DISTANCE = 0.3
_CONSTANT = 1e-9  # standard deviation of a constant column, as a share of its largest value


class Guess(NamedTuple):
    """Two columns that are near each other as one channel."""

    pair: tuple[Column, Column]  # of the first and of the second table
    channel: str  # a channel of the press, or a new one with the name of a column
    units: tuple[str, ...]  # units of both columns; none for a new channel of numbers
    sign: int = 1
    distance: float = 0.0  # RMS, as a share of the larger standard deviation

    def rules(self) -> Iterator[dict[str, Any]]:
        """Yield side, column, channel, unit, sign and partner of each column that needs a rule."""
        units = self.units or (None, None)
        for side, column, partner, unit in zip("ab", self.pair, self.pair[::-1], units, strict=True):
            sign = self.sign if side == "b" or _is_known(partner) else 1
            # The column `time` in seconds needs none, as a channel of the press in SI.
            if not _is_known(column) and (column.name, unit) != (TIME, "s"):
                rule = {"side": side, "column": column.name, "channel": self.channel, "unit": unit}
                yield rule | {"sign": sign, "partner": partner.name, "distance": self.distance}


def suggest(a: Path, b: Path, dialects: Dialects) -> tuple[list[Guess], dict[str, list[str]]]:
    """Guess the channels of the columns of two tables, the time first; list the other columns by side.

    Errors of reading are `TableError`.
    """
    sources = [open_source(path, dialects.of(side)) for side, path in (("a", a), ("b", b))]
    guesses, tables = _on_one_grid(sources)
    for guess in sorted(filter(None, starmap(_match, product(*tables))), key=lambda guess: guess.distance):
        one, other = guess.pair
        rivals = [g for g in guesses if g.channel == guess.channel or g.pair[0] is one or g.pair[1] is other]
        if not rivals:
            guesses.append(guess)
    rest = {
        side: [name for name in source.names if all(name != guess.pair[n].name for guess in guesses)]
        + source.others
        for n, (side, source) in enumerate(zip("ab", sources, strict=True))
    }
    return guesses, rest


def _on_one_grid(sources: Sequence[Source]) -> tuple[list[Guess], list[list[Column]]]:
    """Return the guess of the times, and other columns of numbers at times that both span; else nothing."""
    columns = [[column for column in source.columns if column.text is None] for source in sources]
    times: list[Column] = []
    choices: list[list[str]] = []
    for source, each in zip(sources, columns, strict=True):
        varying = [column for column in each if _varies(column)]
        matches = [column for column in varying if column.name == source.time_name]
        increasing = [column for column in varying if (np.diff(column.numbers) > 0.0).all()]
        for time in (matches or increasing)[:1]:
            times.append(time)
            choices.append(["s"] if source.companions.provenance else _units(time, "s"))
    if len(times) < 2 or not all(choices):
        return [], [[], []]
    options = product(*choices)
    # The units in which both tables last equally long.
    ratio = float(np.ptp(times[0].numbers) / np.ptp(times[1].numbers))
    units = min(options, key=lambda pair: round(abs(np.log(ratio * _factor(pair[0]) / _factor(pair[1]))), 2))
    seconds = [time.numbers * _factor(unit) for time, unit in zip(times, units, strict=True)]
    start, end = max(each[0] for each in seconds), min(each[-1] for each in seconds)
    grid = np.linspace(start, end, _GRID if start < end else 0)
    tables = [
        [each._replace(numbers=np.interp(grid, at, each.numbers)) for each in others if each is not time]
        for others, time, at in zip(columns, times, seconds, strict=True)
    ]
    return [Guess((times[0], times[1]), TIME, units)], tables


def _is_known(column: Column) -> bool:
    """Return whether a column is a channel of the press by its name, in SI as without a mapping."""
    return column.unit is None and column.name in channels()


def _varies(column: Column) -> bool:
    numbers = column.numbers
    return bool(numbers.size and np.std(numbers) > _CONSTANT * np.abs(numbers).max())


def _units(column: Column, si: str) -> list[str]:
    """Return the units of this dimension that a column may be in."""
    if column.unit is not None:
        return [column.unit] * same_dimension(parse_unit(column.unit), parse_unit(si))
    return [si] if _is_known(column) else alternatives(si)


def _factor(unit: str) -> float:
    definition = parse_unit(unit)
    return np.nan if definition is None else float(definition.factor)


def _match(one: Column, other: Column) -> Guess | None:
    """Return the guess, of all units and signs, by which two columns are nearest; None if they are far."""
    names = [column.name for column in (one, other) if _is_known(column)]
    # A constant equals any other in some unit.
    if len(names) > 1 or not (_varies(one) and _varies(other)):
        return None
    options: list[tuple[str, ...]] = [()] * (one.unit == other.unit)
    if names:
        options = [*product(*(_units(column, channels()[names[0]].unit) for column in (one, other)))]
    elif unit := one.unit or other.unit:  # by one at least
        options += product(*(_units(column, unit) for column in (one, other)))
    sign = 1 if np.mean(one.numbers * other.numbers) >= 0 else -1

    def guess(units: tuple[str, ...]) -> Guess:
        x = one.numbers * (_factor(units[0]) / _factor(units[1]) if units else 1.0)
        y = sign * other.numbers
        distance = float(np.sqrt(np.mean((x - y) ** 2)) / max(np.std(x), np.std(y)))
        return Guess((one, other), (names or [one.name])[0], units, sign, distance)

    best = min(map(guess, options), key=lambda guess: round(guess.distance, 6), default=None)
    return best if best and best.distance < _LARGEST_DISTANCE else None


def mapping_text(
    guesses: Sequence[Guess], rest: dict[str, list[str]], dialects: Dialects, command: str
) -> str:
    """Return the text of a mapping file, to be edited, for a command."""
    lines = [
        "# A suggestion: check what it rests on, edit it, then",
        f"#   {command}",
        '# "a" is the first table. A channel is (sign * column + offset) * unit: write the offset by hand.',
    ]
    if dialect := dialects.model_dump(exclude_unset=True):
        lines += ["", f"dialect = {toml(dialect)}"]
    names = [guess.channel for guess in guesses if guess.channel != TIME]
    if names:
        lines += ["", "compare = [", *(f"    {toml(name)}," for name in names), "]"]
    for rule in (rule for guess in guesses for rule in guess.rules()):
        data = f"{number(100 * rule['distance'], 2)} % (RMS) away from {rule['partner']}"
        lines += ["", f"# {data}"] if rule["channel"] != TIME else [""]
        lines += [f"[{rule['side']}.{toml(rule['column'])}]", f"channel = {toml(rule['channel'])}"]
        lines += [f'unit = "{rule["unit"]}"'] * (rule["unit"] is not None)
        lines += ["sign = -1"] * (rule["sign"] < 0)
    lines += [line for name in names if name not in channels() for line in ("", f"[channels.{toml(name)}]")]
    for side, columns in rest.items():
        lines += ["", f'# Not assigned of "{side}":', *(f"#   {name}" for name in columns)]
    # A name may hold what TOML does not allow in a comment.
    return "".join("".join(c if c.isprintable() else " " for c in line) + "\n" for line in lines)
