"""Guesses which column of another program's table is which channel, in which unit and with which sign.

Evidence are the names of the columns, the units that the tables state, and the data: a column is converted
and held against each column of the other table, on a grid of times that both span.
"""

import re
import textwrap
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import product
from math import isnan, nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from comparison.formatting import number
from comparison.scene.keys import toml
from comparison.tables.channels import Array, channels
from comparison.tables.dialect import Source
from comparison.tables.foreign import open_source
from comparison.tables.mapping import TIME, Dialects, parse_unit, same_dimension

SURE, LIKELY, DOUBTFUL = "sure", "likely", "doubtful"
_GRID = 2000  # times at which columns are held against each other
# RMS distances as shares of the larger standard deviation: of unrelated columns they are 1 and more.
_NEAR = 0.3  # two models of one motion are nearer, but for what chatter separates
_ALIKE = 0.9  # of two columns whose names say one channel
_CONSTANT = 1e-9  # of the largest value: the standard deviation of what does not vary

# The units that programs write, the SI unit first.
_UNITS = {"s": "s ms us min", "m": "m mm cm in", "rad": "rad deg rev", "N": "N kN mN lbf", "J": "J mJ kJ"}
# What is meant, and how programs spell it.
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


class Guess(NamedTuple):
    """Channel of a column, and the evidence for it."""

    side: str  # "a" or "b"
    column: str
    channel: str  # of the press, or one's own with the name of a column
    unit: str | None  # None: of a channel of one's own, whose unit both tables state, or neither does
    partner: str  # the column of the other table that it is held against
    sign: int = 1
    named: bool = True  # whether the names say the channel
    distance: float = nan  # RMS from the partner, as a share of the standard deviation; nan: no data tell
    sureness: str = LIKELY

    @property
    def pair(self) -> set[tuple[str, str]]:
        """Side and name of both columns."""
        return {(self.side, self.column), ("ab".replace(self.side, ""), self.partner)}


class _Column(NamedTuple):
    side: str
    name: str
    meaning: str  # the channel that the name says, or the time; empty for none
    known: bool  # whether it is that channel without a rule
    unit: str | None  # None: to be guessed
    values: Array

    def units(self, si: str) -> list[str]:
        """Return the units of this dimension that the column may be in."""
        if self.unit is not None:
            return [self.unit] * same_dimension(parse_unit(self.unit), parse_unit(si))
        first = si.split("/")[0].split(" ")[0]
        ends = dict.fromkeys([si.removeprefix(first), si.removeprefix(first).replace("/s", "/ms")])
        usual = [unit + end for end in ends for unit in _UNITS.get(first, first).split()]
        return usual + ["rpm"] * (si == "rad/s")

    @property
    def deviation(self) -> float:
        """Standard deviation; 0 of a constant, and without values."""
        deviation = float(np.std(self.values)) if self.values.size else 0.0
        return deviation if deviation > _CONSTANT * np.abs(self.values).max(initial=0.0) else 0.0


Left = dict[str, list[str]]
"""Side -> its columns that are not assigned."""


def suggest(a: Path, b: Path, dialects: Dialects | None = None) -> tuple[list[Guess], Left]:
    """Guess what the columns of two tables are, the time first; errors of reading are `TableError`."""
    dialects = dialects or Dialects()
    sources = {side: open_source(path, dialects.of(side)) for side, path in (("a", a), ("b", b))}
    times, tables = _on_one_grid([_columns(side, source) for side, source in sources.items()])
    matches = [match for pair in product(*tables) if (match := _match(pair))]
    guesses: dict[str, list[Guess]] = {}
    taken: set[tuple[str, str]] = set()
    # The best first, by names and data.
    for match in sorted(matches, key=lambda own: min(1.0, own[0].distance) - own[0].named):
        if match[0].channel not in guesses and not taken & match[0].pair:
            guesses[match[0].channel] = match
            taken |= match[0].pair
    ordered = [guess for name in dict.fromkeys([*channels(), *guesses]) for guess in guesses.get(name, [])]
    if SURE in {guess.sureness for guess in ordered}:  # at wrong times nothing would be near
        times = [guess._replace(sureness=SURE) for guess in times]
    taken = taken.union(*(guess.pair for guess in times))
    taken |= {("a", TIME), ("b", TIME)}  # it needs no rule
    names = {side: [*source.names, *source.others] for side, source in sources.items()}
    left = {side: [name for name in own if (side, name) not in taken] for side, own in names.items()}
    return [*times, *ordered], left


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


@cache
def _words(name: str) -> frozenset[str]:
    """Return the words of a name that say what is measured: of ``.slider.cm_vel.X`` slider, velocity, x."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    words = {word for part in parts for word in _MEANING.get(part.lower(), [part.lower()])}
    usual = {word for channel in channels() for word in channel.split("_")}
    return frozenset(words & usual.union(*_MEANING.values()))


@cache
def _meaning(name: str) -> str:
    """Return the channel that a name says, or the time; one of no body is of the slider. Empty for none."""
    meanings = {_words(channel): channel for channel in (TIME, *channels())}
    words = _words(name)
    return name if name in channels() else meanings.get(words, meanings.get(words | {"slider"}, ""))


def _factor(unit: str | None) -> float:
    known = parse_unit(unit or "1")
    return nan if known is None else float(known.factor)


def _on_one_grid(tables: Sequence[list[_Column]]) -> tuple[list[Guess], list[list[_Column]]]:
    """Return guesses of the times, and the other columns at times that both span; else without values."""
    times = ([each for each in table if each.meaning == TIME and each.deviation] for table in tables)
    pair = [columns[0] for columns in times if columns]
    options = list(product(*(column.units("s") for column in pair)))
    if len(pair) < 2 or not options:
        return [], [[column._replace(values=np.array([])) for column in table] for table in tables]
    spans = [float(np.ptp(time.values)) for time in pair]
    one, other = ([span * _factor(units[n]) for units in options] for n, span in enumerate(spans))
    units = options[int(np.argmin(np.abs(np.log(np.divide(one, other))).round(2)))]
    at = [time.values * _factor(unit) for time, unit in zip(pair, units, strict=True)]
    start, end = max(each[0] for each in at), min(each[-1] for each in at)
    grid = np.linspace(start, end, _GRID if start < end else 0)
    others = [
        [each._replace(values=np.interp(grid, seconds, each.values)) for each in table if each is not time]
        for table, time, seconds in zip(tables, pair, at, strict=True)
    ]
    return _guesses(pair, TIME, units), others


def _match(pair: Sequence[_Column]) -> list[Guess]:
    """Return guesses of two columns that may be one channel; empty if neither names nor data say so."""
    one, other = pair
    known = [column.name for column in pair if column.known]
    options = [
        (name, units)
        for name in dict.fromkeys(known or (one.meaning, other.meaning))
        if name in channels() and len(known) < 2
        for units in product(*(column.units(channels()[name].unit) for column in pair))
    ]
    if not known and one.unit == other.unit:
        options.insert(len(options) if one.unit else 0, (one.name, ()))
    if not options:
        return []
    (channel, units), sign, distance = options[0], 1, nan
    if one.deviation and other.deviation:  # in some unit a constant equals any other
        ways = [(*_apart(pair, each[1], sign), each, sign) for each in options for sign in (1, -1)]
        _, distance, (channel, units), sign = min(ways, key=lambda way: way[0])
    named = one.meaning == other.meaning == channel if units else one.name == other.name
    stated = [column.unit is not None for column in pair]
    near = distance <= _NEAR
    if not near and not named:
        return []
    alike = all(stated) if isnan(distance) else distance <= _ALIKE
    sure = near and named and sign == 1 and any(stated)
    sureness = SURE if sure else LIKELY if alike else DOUBTFUL
    return _guesses(pair, channel, units, sign, named, distance, sureness)


def _apart(pair: Sequence[_Column], units: Sequence[str], sign: int) -> tuple[float, float]:
    """Return standard deviation and RMS of a difference as shares of the larger standard deviation."""
    one, other = (column.values * _factor(unit) for column, unit in zip(pair, units or "11", strict=True))
    difference, size = one - sign * other, max(np.std(one), np.std(other))
    return round(float(np.std(difference) / size), 6), float(np.sqrt(np.mean(difference**2)) / size)


def _guesses(
    pair: Sequence[_Column], channel: str, units: Sequence[str], sign: int = 1, *evidence: Any
) -> list[Guess]:
    """Return the guesses of two columns, the last with the sign; of one alone if the other is known."""
    signs = (sign if pair[1].known else 1, sign)
    return [
        Guess(column.side, column.name, channel, unit, partner.name, own, *evidence)
        for column, partner, unit, own in zip(pair, pair[::-1], units or (None, None), signs, strict=True)
        if not column.known
    ]


# ---- the mapping as a file to edit, with what each guess rests on, and as lines for the console


def mapping_text(guesses: Sequence[Guess], left: Left, dialects: Dialects | None, command: str) -> str:
    """Return the mapping that a command is to use; doubtful rules are comments."""
    lines = [
        "# A suggestion: check what it rests on, edit it, then",
        f"#   {command}",
        '# "a" is the first table. A channel is (sign * column + offset) * unit: write the offset by hand.',
        "# What is doubtful is commented out: uncomment what is right, in `compare` as well.",
    ]
    if dialects and (stated := dialects.model_dump(exclude_unset=True)):
        lines += ["", f"dialect = {toml(stated)}"]
    marks = {each.channel: "# " * (each.sureness == DOUBTFUL) for each in guesses if each.channel != TIME}
    if marks:
        none = min(marks.values())
        named = (f"    {mark}{toml(name)}," for name, mark in marks.items())
        lines += ["", f"{none}compare = [", *named, f"{none}]"]
    for guess in guesses:
        data = "the data do not tell"
        if not isnan(guess.distance):
            data = f"{number(100 * guess.distance, 2)} % (RMS) away from {guess.partner}"
        lines += ["", f"# {guess.sureness}: {'' if guess.named else 'not '}by its name; {data}"]
        rule = [f"[{guess.side}.{toml(guess.column)}]", f"channel = {toml(guess.channel)}"]
        rule += [f'unit = "{guess.unit}"'] * (guess.unit is not None) + ["sign = -1"] * (guess.sign < 0)
        lines += [marks.get(guess.channel, "") + line for line in rule]
    lines += [line for name in marks if name not in channels() for line in ("", f"[channels.{toml(name)}]")]
    for side, names in left.items():
        listed = textwrap.wrap("; ".join(names), 100, break_long_words=False)
        lines += ["", f'# Not assigned of "{side}":', *(f"#   {line}" for line in listed)]
    # A name may hold what TOML does not allow in a comment.
    return "".join("".join(c if c.isprintable() else " " for c in line) + "\n" for line in lines)


def summary(guesses: Sequence[Guess], left: Left) -> Iterator[str]:
    """Yield a line for each guess, and the columns that are left."""
    for guess in guesses:
        unit = f" ({guess.unit})" if guess.unit else ""
        yield f"{guess.sureness:<8}  {guess.side}: {guess.column} is {guess.channel}{unit}"
    for side, names in left.items():
        yield f"{side}: not assigned: {', '.join(names) or 'none'}"
