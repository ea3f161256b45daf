"""Guesses which column of another program's table is which channel, in which unit, sign and offset.

Evidence are the names of the columns, the units that the tables state, and the data: a column is converted
and held against each column of the other table, on a grid of times that both span.
"""

import json
import re
import textwrap
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import product
from math import ceil, inf, isnan, log, log10, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from comparison.formatting import number
from comparison.scene import command_line
from comparison.tables.channels import JOINTS, Array, channels
from comparison.tables.dialect import Column
from comparison.tables.foreign import open_source
from comparison.tables.mapping import TIME, Dialect, Dialects, parse_unit, same_dimension

SURE, LIKELY, DOUBTFUL = "sure", "likely", "doubtful"
_GRID = 2000  # times at which columns are held against each other
# RMS distances as shares of the standard deviation: of unrelated columns they are 1 and more.
_FITS = 0.3  # two models of one motion are nearer, but for what chatter separates
_SIZE = 0.7  # the logarithm of a ratio of standard deviations, within which the name decides
_RIVAL = 5.0  # times the distance of the best fit, within which another column fits as well
_CONSTANT = 1e-9  # of the largest value: the standard deviation of what does not vary

# The units that programs write, the SI unit first.
_UNITS = {
    units.split(", ")[0]: units.split(", ")
    for units in (
        "s, ms, us, min",
        "m, mm, cm, in",
        "rad, deg, rev",
        "m/s, mm/s, cm/s, in/s",
        "rad/s, deg/s, rpm, deg/ms",
        "m/s^2, mm/s^2, cm/s^2, mm/ms^2",
        "rad/s^2, deg/s^2, rad/ms^2, deg/ms^2",
        "N, kN, mN, lbf",
        "N m, N mm",
        "J, mJ, kJ",
    )
}
# What is meant, and how programs spell it.
_WORDS = {
    "time": "t time",
    "angle": "phi theta psi rot rotation ang angle angular rz",
    "velocity": "v vel velocity speed dot d",
    "acceleration": "a acc accel acceleration ddot dd",
    "torque": "tq torque moment",
    "slider": "slider piston ram",
    "reaction": "reaction revolute joint",
    "velocity x": "vx xd xdot dx",
    "velocity y": "vy yd ydot dy",
    "velocity angle": "omega w wz phid phidot dphi",
    "acceleration x": "ax xdd xddot ddx",
    "acceleration y": "ay ydd yddot ddy",
    "acceleration angle": "alpha phidd phiddot ddphi",
    "reaction x": "fx",
    "reaction y": "fy",
}
_MEANING = {spelling: words.split() for words, spellings in _WORDS.items() for spelling in spellings.split()}


class Guess(NamedTuple):
    """Channel of a column, and the evidence for it; a conversion is that of a mapping's rule."""

    side: str  # "a" or "b"
    column: str
    channel: str  # of the press; where neither name nor unit tells one of the name of the other column
    unit: str | None  # None: both tables state it, or neither does
    sign: int
    offset: float
    stated: bool | None  # whether the table states the unit; None if nothing tells it
    named: bool  # whether the name of the column says the channel
    partner: str  # the column of the other table that it is held against
    distance: float  # RMS from that one, as a share of its standard deviation; nan where no data tell
    sureness: str


class Suggestion(NamedTuple):
    """Guesses of the columns of two tables, the time first; and side and name of all other columns."""

    paths: tuple[Path, Path]
    dialects: Dialects
    guesses: list[Guess]
    left: list[tuple[str, str]]


class _Side(NamedTuple):
    letter: str
    native: bool  # recorded by this project: its channels are known
    time: Column | None
    columns: list[Column]  # all others that are numbers
    others: list[str]

    def knows(self, column: Column) -> bool:
        """Whether a column is a channel by its name alone, in its unit."""
        named = column.name in channels() and not column.unit
        return named or (self.native and column.name in {TIME, *channels()})

    def units(self, column: Column, si: str) -> list[str]:
        """Return the units that a column of this dimension may be in: the one that is known, or the usual."""
        known = si if self.knows(column) else column.unit
        return _UNITS.get(si, [si]) if known is None else [known]


class _Fit(NamedTuple):
    """Channel that is a column of both, the second converted: ``sign * column + offset`` in its unit."""

    channel: str
    units: tuple[str, ...]  # empty: of a channel of one's own
    sign: int = 1
    offset: float = 0.0
    distance: float = nan
    size: float = nan  # the logarithm of the ratio of their standard deviations

    @property
    def order(self) -> float:
        """What the data do not tell apart is in the first, the most usual units."""
        return inf if isnan(self.distance) else round(self.distance + self.size, 6)


def suggest(a: Path, b: Path, dialects: Dialects | None = None) -> Suggestion:
    """Guess what the columns of two tables are; errors of reading are `TableError`."""
    dialects = dialects or Dialects()
    sides = [_side(letter, path, dialects.of(letter)) for letter, path in (("a", a), ("b", b))]
    sides.sort(key=lambda side: not side.native)  # the known one first
    times, data = _on_one_grid(sides)
    pairs = list(product(range(len(sides[0].columns)), range(len(sides[1].columns))))
    columns = {(n, m): (sides[0].columns[n], sides[1].columns[m]) for n, m in pairs}
    tried = {p: _fit(sides, columns[p], (data[0][p[0]], data[1][p[1]]) if data else None) for p in pairs}
    fits = {place: fit for place, fit in tried.items() if fit is not None}

    def score(place: tuple[int, int]) -> float:
        fit = fits[place]
        near = 0.0 if isnan(fit.distance) else max(0.0, 1.0 - fit.distance)
        return 2 * near + sum(_named(column.name) == fit.channel for column in columns[place])

    guesses: list[Guess] = []
    taken: set[tuple[str, str]] = set()
    for n, m in sorted(fits, key=score, reverse=True):
        fit = fits[n, m]
        both = {(side.letter, column.name) for side, column in zip(sides, columns[n, m], strict=True)}
        rivals = [other.distance for (k, j), other in fits.items() if (k == n) != (j == m)]
        unique = not any(distance <= _RIVAL * fit.distance for distance in rivals)
        own = list(_guesses(sides, columns[n, m], fit, unique=unique))
        if own and not both & taken and all(guess.channel != fit.channel for guess in guesses):
            guesses, taken = [*guesses, *own], taken | both
    order = dict(zip(channels(), range(len(channels())), strict=True))
    guesses.sort(key=lambda guess: order.get(guess.channel, len(order)))
    every = [(s.letter, name) for s in sides for name in (*(c.name for c in s.columns), *s.others)]
    if times is not None and sides[0].time is not None and sides[1].time is not None:
        # Two tables that tell the same motion at the same times have the right unit.
        nearest = min([times.distance, *(guess.distance for guess in guesses if guess.distance >= 0)])
        pair, times = (sides[0].time, sides[1].time), times._replace(distance=nearest)
        guesses = [*_guesses(sides, pair, times, unique=True), *guesses]
    return Suggestion((a, b), dialects, guesses, [name for name in every if name not in taken])


def _side(letter: str, path: Path, dialect: Dialect) -> _Side:
    source = open_source(path, dialect)
    numbers = [each for each in source.columns if each.text is None]
    times = [
        each for each in numbers if _named(each.name) in ("", TIME) and (np.diff(each.numbers) >= 0).all()
    ]
    time = min(times, key=lambda each: _named(each.name) != TIME, default=None)
    others = [f"{each.name} (text)" for each in source.columns if each.text is not None] + source.others
    columns = [each for each in numbers if each is not time]
    return _Side(letter, source.record is not None, time, columns, others)


@cache
def _words(name: str) -> frozenset[str]:
    """Return the words of a name that say what is measured: of ``.slider.cm_vel.X`` slider, velocity, x."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    words = {word for part in parts for word in _MEANING.get(part.lower(), [part.lower()])}
    if "reaction" in words:  # at a joint, which is a capital
        words = words - {"acceleration"} | {part for part in parts if part in list(JOINTS)}
    usual = {word for channel in channels() for word in channel.split("_")}
    return frozenset(words & usual.union(*_MEANING.values()))


@cache
def _named(name: str) -> str:
    """Return the channel that a name says, or the time; one of no body is of the slider. Empty for none."""
    meanings = {_words(channel): channel for channel in (TIME, *channels())}
    words = _words(name)
    return name if name in channels() else meanings.get(words, meanings.get(words | {"slider"}, ""))


def _factor(unit: str) -> float:
    known = parse_unit(unit)
    return nan if known is None else float(known.factor)


def _on_one_grid(sides: Sequence[_Side]) -> tuple[_Fit | None, list[list[Array]]]:
    """Return the units of the times, which follow from the spans where they are not stated, and the columns.

    These are at times that both tables span; there are none without such times.
    """
    if any(side.time is None for side in sides):
        return None, []
    known = [(side, side.time) for side in sides if side.time is not None]
    fits = []
    for units in product(*(side.units(time, "s") for side, time in known)):
        spans = [
            float(np.ptp(time.numbers)) * _factor(unit) for (_, time), unit in zip(known, units, strict=True)
        ]
        distance = round(abs(log(spans[0] / spans[1])), 2) if all(spans) else nan
        fits.append(_Fit(TIME, units, distance=distance, size=0.0))
    best = min(fits, key=lambda fit: fit.order)
    at = [time.numbers * _factor(unit) for (_, time), unit in zip(known, best.units, strict=True)]
    start, end = max(each[0] for each in at), min(each[-1] for each in at)
    grid = np.linspace(start, end, _GRID)
    columns = [
        [np.interp(grid, time, column.numbers) for column in side.columns]
        for side, time in zip(sides, at, strict=True)
    ]
    return best, columns if end > start else []


def _fit(
    sides: Sequence[_Side], pair: tuple[Column, Column], data: tuple[Array, Array] | None
) -> _Fit | None:
    """Return the channel that two columns may be, and how near they come; None if nothing suggests one."""
    known = [column.name for side, column in zip(sides, pair, strict=True) if side.knows(column)]
    fits = []
    for channel in known[:1] or dict.fromkeys(_named(column.name) for column in pair):
        if channel not in channels():
            continue
        si = channels()[channel].unit
        for units in product(sides[0].units(pair[0], si), sides[1].units(pair[1], si)):
            if all(same_dimension(parse_unit(unit), parse_unit(si)) for unit in units):
                fits.append(_conversion(_Fit(channel, units), data))
    best = min(fits, key=lambda fit: fit.order, default=None)
    stated = {column.unit for column in pair}
    if not known and len(stated) == 1 and (best is None or stated == {None}):
        own = _conversion(_Fit(pair[0].name, ("1", "1")), data)
        alike = pair[0].name == pair[1].name or ((own.sign, own.offset) == (1, 0) and own.distance <= _FITS)
        if alike and (best is None or own.distance <= best.distance or len({*best.units}) == 1):
            return own._replace(units=())
    return best


def _conversion(fit: _Fit, data: tuple[Array, Array] | None) -> _Fit:
    """Return how near two columns in these units come, with a sign and an offset where these tell."""
    if data is None or any(np.std(each) <= _CONSTANT * np.abs(each).max() for each in data):
        return fit  # in some unit, or with an offset, a constant equals any other
    factor = _factor(fit.units[1])
    a, b = data[0] * _factor(fit.units[0]), data[1] * factor
    deviation = float(np.std(a))
    fit = fit._replace(size=abs(log(deviation / float(np.std(b)))))
    for sign in (1, -1):
        apart = a - sign * b
        plain, spread = float(np.sqrt(np.mean(apart**2))) / deviation, float(np.std(apart)) / deviation
        offset = 0.0
        if 1e-3 < plain > _RIVAL * spread and spread <= _FITS:
            digits = ceil(-log10(max(spread * deviation / factor, 1e-12)))
            offset, plain = round(float(np.mean(apart)) / factor, digits), spread
        if sign == 1 or (plain <= _FITS and plain < fit.distance):
            fit = fit._replace(sign=sign, offset=offset, distance=plain)
    return fit


def _guesses(
    sides: Sequence[_Side], pair: tuple[Column, Column], fit: _Fit, *, unique: bool
) -> Iterator[Guess]:
    """Yield the guesses of two columns, but of one that is known; none if neither names nor data tell."""
    foreign = [column for side, column in zip(sides, pair, strict=True) if not side.knows(column)]
    names = {_named(column.name) or column.name for column in pair}
    named = any(_named(column.name) == fit.channel for column in foreign) or (
        not fit.units and len(names) == 1
    )
    stated = [side.knows(column) or column.unit is not None for side, column in zip(sides, pair, strict=True)]
    near, plain = fit.distance <= _FITS, (fit.sign, fit.offset) == (1, 0.0)
    # Names alone must be those of both.
    alike = named and (len(foreign) < 2 or len(names) == 1)
    if not (alike or (near and (named or unique))):
        return
    sureness = DOUBTFUL
    if near and (named or plain):
        sureness = SURE if named and plain and any(stated) else LIKELY
    elif named and (fit.size <= _SIZE or (isnan(fit.size) and all(stated))):
        sureness = LIKELY
    for n, (side, column, known) in enumerate(zip(sides, pair, stated, strict=True)):
        if not side.knows(column):
            yield Guess(
                side=side.letter,
                column=column.name,
                channel=fit.channel,
                unit=fit.units[n] if fit.units else None,
                sign=fit.sign if n else 1,
                offset=fit.offset if n else 0.0,
                stated=known if fit.units or any(stated) else None,
                named=named and _named(column.name) in ("", fit.channel),
                partner=pair[1 - n].name,
                distance=fit.distance,
                sureness=sureness,
            )


# ---- the mapping as a file to edit, with what each guess rests on, and as lines for the console


def mapping_text(suggestion: Suggestion, path: Path) -> str:
    """Return the mapping that is written to a path; doubtful rules are comments."""
    names = [str(each) for each in suggestion.paths]
    options = ["--mapping", str(path), "--tolerance", "0.01"]
    lines = [
        "# A suggestion: check what it rests on, edit it, then",
        f"#   {command_line('compare', names, {}, options)}",
        f'# "a" is {names[0]}, "b" is {names[1]}. A channel is (sign * column + offset) * unit.',
        "# What is doubtful is commented out: uncomment what is right, in `compare` as well.",
        "",
    ]
    for side in ("", "a", "b"):
        dialect = getattr(suggestion.dialects, side) if side else suggestion.dialects
        if keys := sorted(dialect.model_fields_set & Dialect.model_fields.keys()):
            lines.append(f"[dialect{side and '.'}{side}]")
            lines += [f"{key} = {json.dumps(getattr(dialect, key), ensure_ascii=False)}" for key in keys]
    doubts = {g.channel: g.sureness == DOUBTFUL for g in suggestion.guesses if g.channel != TIME}
    none = "# " if all(doubts.values()) else ""
    if doubts:
        named = (
            f"{none}    {'' if none else '# ' * doubt}{json.dumps(name)}," for name, doubt in doubts.items()
        )
        lines[4:4] = [f"{none}compare = [", *named, f"{none}]"]
    for guess in suggestion.guesses:
        mark = "# " if guess.sureness == DOUBTFUL else ""
        lines += ["", f"# {guess.sureness}: {_grounds(guess)}", *(mark + line for line in _rule(guess))]
    own = (name for name in doubts if name not in channels())
    lines += [line for name in own for line in ("", f"[channels.{json.dumps(name, ensure_ascii=False)}]")]
    for side in "ab":
        if rest := [column for letter, column in suggestion.left if letter == side]:
            lines += ["", f'# Not assigned of "{side}":']
            lines += (f"#   {line}" for line in textwrap.wrap("; ".join(rest), 100, break_long_words=False))
    # A name may hold what TOML does not allow in a comment.
    return "".join("".join(c if c.isprintable() else " " for c in line) + "\n" for line in lines)


def summary(suggestion: Suggestion) -> Iterator[str]:
    """Yield a line for each guess, and how many columns are left."""
    for guess in suggestion.guesses:
        unit = f" ({guess.unit})" if guess.unit else ""
        yield f"{guess.sureness:<8}  {guess.side}: {guess.column} is {guess.channel}{unit}"
    for side in "ab":
        if rest := [column for which, column in suggestion.left if which == side]:
            yield f"{side}: not assigned: {', '.join(rest)}"


def _grounds(guess: Guess) -> str:
    """Return what a guess rests on."""
    unit = "no unit is stated in either table"
    if guess.stated is not None:
        unit = f"the unit {'is stated' if guess.stated else f'by comparison with {guess.partner}'}"
    data = f"{number(100 * guess.distance, 2)} % (RMS) away from {guess.partner}"
    if isnan(guess.distance):
        data = "the data do not tell"
    name = "by its name" if guess.named else "not by its name"
    return "; ".join([name, *([data] if guess.channel != TIME else []), unit])


def _rule(guess: Guess) -> Iterator[str]:
    """Yield the lines of a rule."""
    yield f"[{guess.side}.{json.dumps(guess.column, ensure_ascii=False)}]"
    yield f'channel = "{guess.channel}"'
    if guess.unit:
        yield f'unit = "{guess.unit}"'
    if guess.sign != 1:
        yield f"sign = {guess.sign}"
    if guess.offset:
        yield f"offset = {guess.offset!r}"
