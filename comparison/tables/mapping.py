"""Mapping file: channel, unit and sign of each column of another program's table; channels of one's own."""

import math
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError

from comparison.files import contents
from comparison.scene.keys import explain
from comparison.scene.schema import Positive, Real, Section, integer
from comparison.tables.channels import Array, Channel, channels
from comparison.tables.table import TableError
from comparison.tables.table_files import readable
from comparison.tables.units import parse, same_dimension

TIME = "time"
# Of the largest value: a channel that varies by less varies by the rounding of its numbers.
_ROUND_OFF = 4 * float(np.finfo(np.float64).eps)


class Rule(Section):
    """Conversion of a column: ``channel = (sign * factor * column + offset) * unit``."""

    channel: str
    unit: str | None = None  # None: as stated in the table
    sign: Annotated[Literal[-1, 1], BeforeValidator(integer)] = 1
    offset: Real = 0.0  # in the column's unit
    factor: Real | None = None  # of the column, for one that is normalised; None: that of the channel


class Quantity(Section):
    """Channel of one's own; of a channel of the press only the scale can be given."""

    unit: str | None = None  # of the comparison; None: that of the tables
    scale: Positive | None = None  # in that unit; None: the range of the first table
    angle: bool = False  # whether whole revolutions do not matter
    rate: str | None = None  # the channel that is its time derivative
    factor: Real = 1.0  # of its columns in both tables: what they are normalised by


class Mapping(Section):
    """Contents of a mapping file."""

    compare: Annotated[list[str], Field(min_length=1)] | None = None
    """Channels to compare; None: all, and both tables must hold the same."""
    columns: dict[str, Rule] = Field(default={})  # column name -> rule, for either table
    channels: dict[str, Quantity] = Field(default={})
    a: dict[str, Rule] = Field(default={})
    """As ``columns``, for the first or the second table only; takes precedence over ``columns``."""
    b: dict[str, Rule] = Field(default={})
    ideal: dict[str, Rule] = Field(default={})
    """The same for the table of the ideal mechanism, which without has the rules of the side that it fits."""
    gate: dict[str, Real] = Field(default={})  # metric -> its limit, for every channel

    _file: str = PrivateAttr("mapping")

    @property
    def file(self) -> str:
        """Its file, for messages; "mapping" of one that was made in Python."""
        return self._file


def load_mapping(path: Path) -> Mapping:
    """Read a mapping file; a `TableError` tells key, value and violated rule."""
    with readable(path):
        content = tomllib.loads(contents(path))
        try:
            mapping = Mapping.model_validate(content)
        except ValidationError as error:
            raise TableError(explain(error, Mapping)) from error
        if fault := next(_faults(mapping), ""):
            raise TableError(fault)
    mapping._file = str(path)
    return mapping


def _faults(mapping: Mapping) -> Iterator[str]:
    """Yield rules that contradict each other or name unknown channels or units."""
    every, known = {*channels(), *mapping.channels}, "channel of the press or of [channels]"
    for part in ("channels", "columns", "a", "b", "ideal"):
        for name, given in getattr(mapping, part).items():
            where = f"{part}.{name!r}"
            if part != "channels":
                if given.channel not in {TIME, *every}:
                    yield f"{where}: channel = {given.channel!r} is not a {known}"
            elif name == TIME:
                yield f"{where}: time is no channel; its unit is that of a column"
            elif name in channels() and (keys := sorted(given.model_fields_set - {"scale"})):
                yield f"{where}: {keys[0]} is fixed for a channel of the press; only a scale can be given"
            if given.unit is not None and parse(given.unit) is None:
                yield f"{where}: unit = {given.unit!r} is not known"
            if given.factor == 0:
                yield f"{where}: factor = 0 leaves nothing of the column"
            rate = getattr(given, "rate", None)
            if rate is not None and (rate == name or rate not in every):
                yield f"{where}: rate = {rate!r} is not another {known}"
    if not any(mapping.model_dump().values()):
        yield "names no column"


class Stated(NamedTuple):
    """What one table says of a channel; its unit is None if nothing."""

    table: str
    unit: str | None
    values: Array


def own_channel(name: str, quantity: Quantity, stated: Sequence[Stated], file: str = "mapping") -> Channel:
    """Return the definition of a channel that is not the press's, in the given unit, else the tables'."""
    unit = quantity.unit if quantity.unit is not None else _common_unit(name, stated)
    turn = 2 * math.pi
    if quantity.angle:
        known = parse(unit)
        if known is None or not same_dimension(known, parse("rad")):
            raise TableError(f"{file}: channels.{name!r}: angle = true, but its unit {unit!r} is no angle")
        turn /= float(known.factor)
    finite = (np.abs(each.values[np.isfinite(each.values)]) for each in stated)
    largest = max((float(sizes.max(initial=0.0)) for sizes in finite), default=0.0)
    return Channel(
        name=name,
        label=name,
        unit=unit,
        sign="",
        group="own",
        scale="range",
        floor=max(_ROUND_OFF * largest, float(np.finfo(np.float64).tiny)),
        round_off=0.0,
        rate=quantity.rate,
        angle=quantity.angle,
        turn=turn,
        given=quantity.scale,
    )


def check_rates(defined: dict[str, Channel], file: str) -> None:
    """Reject a rate whose unit is not that of its channel per second: a cubic through both would be wrong."""
    known, second = channels() | defined, parse("s")
    for channel in defined.values():
        rate = known.get(channel.rate or "")
        unit, of_rate = parse(channel.unit), parse(rate.unit) if rate else None
        if rate and unit and of_rate and second and of_rate.times(second) != unit:
            units = f"is in {rate.unit}, which is not {channel.unit} per second"
            raise TableError(f"{file}: channels.{channel.name!r}: rate = {rate.name!r} {units}")


def is_prose(unit: str) -> bool:
    """Return whether what stands in brackets beside a name is no unit, not even one that is not known."""
    return " " in unit and parse(unit) is None


def _common_unit(name: str, stated: Sequence[Stated]) -> str:
    units = {None if s.unit is None or is_prose(s.unit) else s.unit: s.table for s in stated}
    if len(units) < 2:
        return next(iter(units), None) or ""
    (first, a), (second, b) = list(units.items())[:2]
    decides = f'a mapping (--mapping) with [channels."{name}"] and its unit = "..." decides'
    if first is None or second is None:
        has, lacks = (a, b) if second is None else (b, a)
        raise TableError(f"{has}: column {name!r} is in {first or second}, {lacks} states no unit; {decides}")
    message = f"column {name!r} is in {first} in {a} and in {second} in {b}"
    for unit in (first, second):
        if parse(unit) is None:
            raise TableError(f"{message}; {unit!r} is not a known unit: {decides}")
    if not same_dimension(parse(first), parse(second)):
        raise TableError(message)
    return first
