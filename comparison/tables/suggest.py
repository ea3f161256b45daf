"""Suggestion of a mapping: channel, unit and sign of each column of another program's table.

Each column is compared with each column of the other table at times that both span; with a channel of the
press in all units that programs use. Names say no more than which column is the time.
"""

import textwrap
from collections.abc import Iterator, Sequence
from itertools import product, starmap
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from comparison.formatting import number
from comparison.scene.keys import toml
from comparison.tables.channels import Array, channels
from comparison.tables.dialect import Source
from comparison.tables.foreign import open_source, times
from comparison.tables.mapping import TIME, Dialects
from comparison.tables.units import alternatives, parse_unit, same_dimension

_GRID = 2000  # times at which columns are compared
# RMS distance as a share of the larger standard deviation: of unrelated columns it is 1 and more, two models
# of one motion are nearer, except where chatter separates them.
_NEAR = 0.3
_CONSTANT = 1e-9  # standard deviation of a constant column, as a share of its largest value


class _Column(NamedTuple):
    side: str
    name: str
    known: bool  # whether it is a channel of the press, or the time, without a rule
    unit: str | None  # None: to be guessed
    values: Array

    def units(self, si: str) -> list[str]:
        """Return the units of this dimension that the column may be in."""
        if self.unit is None:
            return alternatives(si)
        return [self.unit] * same_dimension(parse_unit(self.unit), parse_unit(si))

    def varies(self) -> bool:
        return bool(self.values.size and np.std(self.values) > _CONSTANT * np.abs(self.values).max())


class Guess(NamedTuple):
    """Two columns that are near each other as one channel."""

    pair: tuple[_Column, _Column]
    channel: str  # a channel of the press, or a new one with the name of a column
    units: tuple[str, ...]  # units of both columns; none for a new channel of numbers
    sign: int = 1
    distance: float = 0.0  # RMS, as a share of the larger standard deviation

    def rules(self) -> Iterator[dict[str, Any]]:
        """Yield side, column, channel, unit, sign and partner of each column that needs a rule."""
        for column, partner, unit in zip(self.pair, self.pair[::-1], self.units or (None, None), strict=True):
            sign = self.sign if partner.known or column is self.pair[1] else 1
            if not column.known:
                rule = {"side": column.side, "column": column.name, "channel": self.channel, "unit": unit}
                yield rule | {"sign": sign, "partner": partner.name, "distance": self.distance}


def suggest(a: Path, b: Path, dialects: Dialects | None = None) -> tuple[list[Guess], dict[str, list[str]]]:
    """Guess the channels of the columns of two tables, the time first; and list what is left, by side.

    Errors of reading are `TableError`.
    """
    dialects = dialects or Dialects()
    sources = {side: open_source(path, dialects.of(side)) for side, path in (("a", a), ("b", b))}
    guesses, tables = _on_one_grid(sources)
    taken = {(column.side, column.name) for guess in guesses for column in guess.pair}
    for guess in sorted(filter(None, starmap(_match, product(*tables))), key=lambda guess: guess.distance):
        columns = {(column.side, column.name) for column in guess.pair}
        if guess.channel not in (each.channel for each in guesses) and not taken & columns:
            guesses.append(guess)
            taken |= columns
    order = [TIME, *channels(), *(guess.channel for guess in guesses)]
    guesses.sort(key=lambda guess: order.index(guess.channel))
    left = {
        side: [name for name in source.names if (side, name) not in taken and name != TIME] + source.others
        for side, source in sources.items()
    }
    return guesses, left


def _on_one_grid(sources: dict[str, Source]) -> tuple[list[Guess], list[list[_Column]]]:
    """Return the guess of the times, and the other columns of numbers at times that both span.

    Channels without a unit, and the time of our own tables, are in SI. Without times nothing is returned.
    """
    own: list[_Column] = []
    others: list[list[_Column]] = []
    for side, source in sources.items():
        si = {name: channel.unit for name, channel in channels().items()}
        si |= {TIME: "s"} if source.beside.provenance else {}
        columns = []
        for each in source.columns:
            if each.text is None:
                known = each.unit is None and each.name in si
                unit = si[each.name] if known else each.unit
                columns.append(_Column(side, each.name, known, unit, each.numbers))
        own += [column for column in columns if column.name in times(source) and column.varies()][:1]
        others.append(columns)
    options = list(product(*(time.units("s") for time in own)))
    if len(own) < 2 or not options:
        return [], [[], []]
    # The units in which both last equally long.
    ratio = float(np.ptp(own[0].values) / np.ptp(own[1].values))
    units = min(options, key=lambda pair: round(abs(np.log(ratio * _factor(pair[0]) / _factor(pair[1]))), 2))
    seconds = [time.values * _factor(unit) for time, unit in zip(own, units, strict=True)]
    start, end = max(each[0] for each in seconds), min(each[-1] for each in seconds)
    grid = np.linspace(start, end, _GRID if start < end else 0)
    tables = [
        [each._replace(values=np.interp(grid, at, each.values)) for each in columns if each not in own]
        for columns, at in zip(others, seconds, strict=True)
    ]
    return [Guess((own[0], own[1]), TIME, units)], tables


def _factor(unit: str) -> float:
    known = parse_unit(unit)
    return np.nan if known is None else float(known.factor)


def _match(one: _Column, other: _Column) -> Guess | None:
    """Return the guess, of all units and signs, by which two columns are nearest; None if they are far."""
    known = [column.name for column in (one, other) if column.known]
    # In some unit a constant equals any other.
    if len(known) > 1 or not (one.varies() and other.varies()):
        return None
    options: list[tuple[str, ...]] = [()] * (one.unit == other.unit)
    if known:
        options = [*product(*(column.units(channels()[known[0]].unit) for column in (one, other)))]
    elif one.unit and other.unit and same_dimension(parse_unit(one.unit), parse_unit(other.unit)):
        options = [(one.unit, other.unit)]
    sign = 1 if np.mean(one.values * other.values) >= 0 else -1

    def guess(units: tuple[str, ...]) -> Guess:
        x = one.values * (_factor(units[0]) / _factor(units[1]) if units else 1.0)
        y = sign * other.values
        distance = float(np.sqrt(np.mean((x - y) ** 2)) / max(np.std(x), np.std(y)))
        return Guess((one, other), (known or [one.name])[0], units, sign, distance)

    best = min(map(guess, options), key=lambda guess: round(guess.distance, 6), default=None)
    return best if best and best.distance < _NEAR else None


def mapping_text(
    guesses: Sequence[Guess], left: dict[str, list[str]], dialects: Dialects | None, command: str
) -> str:
    """Return the text of a mapping file, to be edited, for a command."""
    lines = [
        "# A suggestion: check what it rests on, edit it, then",
        f"#   {command}",
        '# "a" is the first table. A channel is (sign * column + offset) * unit: write the offset by hand.',
    ]
    if dialects and (stated := dialects.model_dump(exclude_unset=True)):
        lines += ["", f"dialect = {toml(stated)}"]
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
    for side, columns in left.items():
        listed = textwrap.wrap("; ".join(columns), 100, break_long_words=False)
        lines += ["", f'# Not assigned of "{side}":', *(f"#   {line}" for line in listed)]
    # A name may hold what TOML does not allow in a comment.
    return "".join("".join(c if c.isprintable() else " " for c in line) + "\n" for line in lines)
