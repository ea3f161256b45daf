"""Suggestion of a mapping: channel, unit and sign of each column of another program's table.

A column is converted and compared with each column of the other table, on a grid of times that both span. The
names of the columns, and units that the tables state, narrow the choice.
"""

import re
import textwrap
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import product, starmap
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from comparison.formatting import number
from comparison.scene.keys import toml
from comparison.tables.channels import Array, channels
from comparison.tables.dialect import Source
from comparison.tables.foreign import open_source
from comparison.tables.mapping import TIME, Dialects
from comparison.tables.units import alternatives, parse_unit, same_dimension

_GRID = 2000  # times at which columns are compared
# RMS distances as shares of the larger standard deviation: of unrelated columns they are 1 and more.
_NEAR = 0.3  # two models of one motion are nearer, except where chatter separates them
_ALIKE = 0.9  # for two columns whose names denote one channel
_CONSTANT = 1e-9  # standard deviation of a constant column, as a share of its largest value

# Words of channel names -> their spellings in other programs.
_WORDS = {
    "time": "t time tout",
    "angle": "phi theta psi rot rotation ang angle angular rz",
    "velocity": "v vel velocity speed dot d",
    "acceleration": "a acc accel acceleration ddot dd",
    "torque": "tq torque moment",
    "slider": "slider piston ram",
    "velocity x": "vx xd xdot dx",
    "velocity y": "vy yd ydot dy",
    "velocity angle": "omega w wz phid phidot dphi",
    "acceleration x": "ax xdd xddot ddx",
    "acceleration y": "ay ydd yddot ddy",
    "acceleration angle": "alpha phidd phiddot ddphi",
}
_MEANING = {spelling: words.split() for words, spellings in _WORDS.items() for spelling in spellings.split()}


class _Column(NamedTuple):
    side: str
    name: str
    meaning: str  # the channel that the name denotes, or the time; empty for none
    known: bool  # whether it is that channel without a rule
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
    units: tuple[str, ...]  # units of both columns; none for a new channel
    sign: int = 1
    named: bool = True  # whether the names denote the channel
    distance: float = 0.0  # RMS, as a share of the standard deviation

    def rules(self) -> Iterator[dict[str, Any]]:
        """Yield side, column, channel, unit, sign and partner of each column that needs a rule."""
        for column, partner, unit in zip(self.pair, self.pair[::-1], self.units or (None, None), strict=True):
            sign = self.sign if partner.known or column is self.pair[1] else 1
            if not column.known:
                rule = {"side": column.side, "column": column.name, "channel": self.channel, "unit": unit}
                yield rule | {"sign": sign, "partner": partner.name, "distance": self.distance}


Left = dict[str, list[str]]
"""Side -> its columns that are not assigned, each with the channel that its name denotes."""


def suggest(a: Path, b: Path, dialects: Dialects | None = None) -> tuple[list[Guess], Left]:
    """Guess the channels of the columns of two tables, the time first; errors of reading are `TableError`."""
    dialects = dialects or Dialects()
    sources = {side: open_source(path, dialects.of(side)) for side, path in (("a", a), ("b", b))}
    times, tables = _on_one_grid([_columns(side, source) for side, source in sources.items()])
    matches = filter(None, starmap(_match, product(*tables)))
    chosen: dict[str, Guess] = {}
    taken: set[tuple[str, str]] = set()
    for guess in [*times, *sorted(matches, key=lambda guess: guess.distance - guess.named)]:
        columns = {(column.side, column.name) for column in guess.pair}
        if guess.channel not in chosen and not taken & columns:
            chosen[guess.channel] = guess
            taken |= columns
    left: Left = {}
    for side, source in sources.items():
        names = [name for name in source.names if (side, name) not in taken and name != TIME]
        meanings = [_meaning(name) for name in names]
        said = [f"{name} ({meant}?)" if meant else name for name, meant in zip(names, meanings, strict=True)]
        left[side] = said + source.others
    return [chosen[name] for name in dict.fromkeys([TIME, *channels(), *chosen]) if name in chosen], left


def _columns(side: str, source: Source) -> list[_Column]:
    """Return the columns of numbers; channels without a unit, and the time of our own tables, are in SI."""
    si = {name: channel.unit for name, channel in channels().items()}
    if source.record is not None:
        si[TIME] = "s"
    columns: list[_Column] = []
    for each in source.columns:
        if each.text is None:
            meaning = TIME if source.nameless and not columns else _meaning(each.name)
            known = each.unit is None and each.name in si
            unit = si[each.name] if known else each.unit
            columns.append(_Column(side, each.name, meaning, known, unit, each.numbers))
    return columns


def _words(name: str) -> frozenset[str]:
    """Return the words of a name that denote a quantity: of ``.slider.cm_vel.X`` slider, velocity, x."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    words = {word for part in parts for word in _MEANING.get(part.lower(), [part.lower()])}
    usual = {word for channel in channels() for word in channel.split("_")}
    return frozenset(words & usual.union(*_MEANING.values()))


@cache
def _meaning(name: str) -> str:
    """Return the channel that a name denotes, by default of the slider, or the time; empty for none."""
    meanings = {_words(channel): channel for channel in (TIME, *channels())}
    words = _words(name)
    return name if name in channels() else meanings.get(words, meanings.get(words | {"slider"}, ""))


def _factor(unit: str) -> float:
    known = parse_unit(unit)
    return np.nan if known is None else float(known.factor)


def _on_one_grid(tables: Sequence[list[_Column]]) -> tuple[list[Guess], list[list[_Column]]]:
    """Return the guess of the times, and the other columns at times that both span; none without times."""
    times = [[each for each in table if each.meaning == TIME and each.varies()][:1] for table in tables]
    options = [pair for own in product(*times) for pair in product(*(time.units("s") for time in own))]
    if not options:
        return [], [[], []]
    one, other = times[0][0], times[1][0]
    ratio = float(np.ptp(one.values) / np.ptp(other.values))
    # The units in which both last equally long.
    units = min(options, key=lambda pair: round(abs(np.log(ratio * _factor(pair[0]) / _factor(pair[1]))), 2))
    at = [time.values * _factor(unit) for time, unit in zip((one, other), units, strict=True)]
    start, end = max(each[0] for each in at), min(each[-1] for each in at)
    grid = np.linspace(start, end, _GRID if start < end else 0)
    others = [
        [each._replace(values=np.interp(grid, seconds, each.values)) for each in table if each is not time]
        for table, time, seconds in zip(tables, (one, other), at, strict=True)
    ]
    return [Guess((one, other), TIME, units)], others


def _match(one: _Column, other: _Column) -> Guess | None:
    """Return the guess, of all channels, units and signs, by which two columns are nearest; None if far."""
    known = [column.name for column in (one, other) if column.known]
    options: list[tuple[str, tuple[str, ...]]] = [
        (name, units)
        for name in dict.fromkeys(known or (one.meaning, other.meaning))
        if name in channels() and len(known) < 2
        for units in product(*(column.units(channels()[name].unit) for column in (one, other)))
    ]
    if not known and one.unit == other.unit:
        options.insert(len(options) if one.unit else 0, (one.name, ()))
    if not (one.varies() and other.varies()):  # in some unit a constant equals any other
        return None
    best, least = None, np.inf
    for (channel, units), sign in product(options, (1, -1)):
        first, second = (
            column.values * _factor(unit)
            for column, unit in zip((one, other), units or ("1", "1"), strict=True)
        )
        difference = (first - sign * second) / max(np.std(first), np.std(second))
        spread, distance = round(float(np.std(difference)), 6), float(np.sqrt(np.mean(difference**2)))
        if spread < least:
            least, meant = (
                spread,
                one.meaning == other.meaning == channel if units else one.name == other.name,
            )
            best = Guess((one, other), channel, units, sign, meant, distance)
    return best if best and best.distance <= (_ALIKE if best.named else _NEAR) else None


def mapping_text(guesses: Sequence[Guess], left: Left, dialects: Dialects | None, command: str) -> str:
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
        lines += [f'unit = "{rule["unit"]}"'] * (rule["unit"] is not None) + ["sign = -1"] * (
            rule["sign"] < 0
        )
    lines += [line for name in names if name not in channels() for line in ("", f"[channels.{toml(name)}]")]
    for side, columns in left.items():
        listed = textwrap.wrap("; ".join(columns), 100, break_long_words=False)
        lines += ["", f'# Not assigned of "{side}":', *(f"#   {line}" for line in listed)]
    # A name may hold what TOML does not allow in a comment.
    return "".join("".join(c if c.isprintable() else " " for c in line) + "\n" for line in lines)
