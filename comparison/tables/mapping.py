"""The mapping file: channel, unit and sign of other programs' columns, and definitions of new channels."""

import tomllib
from collections.abc import Iterator
from collections.abc import Mapping as Pairs
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr, ValidationError

from comparison.files import contents
from comparison.scene.keys import explain
from comparison.scene.schema import Positive, Real, Section, Sign
from comparison.tables.channels import channels
from comparison.tables.table import TableError
from comparison.tables.table_files import readable
from comparison.tables.units import parse_unit

TIME = "time"


class Rule(Section):
    """Conversion of a column: ``channel = (sign * factor * column + offset) * unit``."""

    channel: str
    unit: str | None = None  # None: as stated in the table
    sign: Sign = 1
    offset: Real = 0.0  # in the column's unit
    factor: Real | None = None  # undoes a normalisation of the column; None: the channel's factor


class Quantity(Section):
    """Definition of a new channel; for a channel of the press only the scale can be given."""

    unit: str | None = None  # unit of the comparison; None: that of the tables
    scale: Positive | None = None  # in that unit; None: the range of the first table
    angle: bool = False  # whole revolutions do not matter
    rate: str | None = None  # the channel that is its time derivative
    factor: Real = 1.0  # undoes a normalisation of its columns in both tables


_Sign = Annotated[str, Field(min_length=1, max_length=1)]


class Dialect(Section):
    """Layout of a text table; None: guessed, or refused where two readings are possible."""

    separator: _Sign | None = None  # separator of columns; a space: any number of spaces and tabs
    decimal: Literal[".", ","] | None = None
    thousands: _Sign | None = None
    skip: Annotated[int, Field(ge=0)] | None = None  # lines above that of the names, or above the numbers
    names: list[str] | None = None  # names of columns, with units as in "x [mm]"; []: there are none
    comment: str | None = None  # sign with which comments begin; "": there are none


class Dialects(Dialect):
    """Dialect of all tables, and deviations from it in one of them."""

    a: Dialect = Dialect()
    b: Dialect = Dialect()
    ideal: Dialect = Dialect()

    def of(self, side: str) -> Dialect:
        """Return the dialect of the tables of a side: "a", "b" or "ideal"."""
        dialect: Dialect = getattr(self, side)
        return self.model_copy(update={key: getattr(dialect, key) for key in dialect.model_fields_set})


class Mapping(Section):
    """Contents of a mapping file."""

    dialect: Dialects = Dialects()

    compare: Annotated[list[str], Field(min_length=1)] | None = None
    """Channels to compare; None: all, and both tables must hold the same."""
    columns: dict[str, Rule] = Field(default={})  # column name -> rule, for either table
    channels: dict[str, Quantity] = Field(default={})
    a: dict[str, Rule] = Field(default={})
    """As ``columns``, for the first or the second table only; takes precedence over ``columns``."""
    b: dict[str, Rule] = Field(default={})
    ideal: dict[str, Rule] = Field(default={})
    """As ``columns``, for the ideal table; without it that table has the rules of the side that it fits."""
    gate: dict[str, Real] = Field(default={})  # metric -> its limit, for every channel

    _file: str = PrivateAttr("mapping")

    @property
    def file(self) -> str:
        """Path of the file, for messages; "mapping" if it was created in Python."""
        return self._file


def load_mapping(path: Path) -> Mapping:
    """Read a mapping file; a `TableError` tells key, value and violated rule."""
    with readable(path):
        mapping = mapping_of(tomllib.loads(contents(path)))
    mapping._file = str(path)
    return mapping


def mapping_of(content: Pairs[str, Any]) -> Mapping:
    """Return the mapping of the contents of a file; errors are those of `load_mapping`."""
    try:
        mapping = Mapping.model_validate(content)
    except ValidationError as error:
        raise TableError(explain(error, Mapping)) from error
    if fault := next(_faults(mapping), ""):
        raise TableError(fault)
    return mapping


def _faults(mapping: Mapping) -> Iterator[str]:
    """Yield rules that contradict each other or name unknown channels or units."""
    names, kind = {*channels(), *mapping.channels}, "channel of the press or of [channels]"
    for part in ("channels", "columns", "a", "b", "ideal"):
        for name, entry in getattr(mapping, part).items():
            where = f"{part}.{name!r}"
            if part != "channels":
                if entry.channel not in {TIME, *names}:
                    yield f"{where}: channel = {entry.channel!r} is not a {kind}"
            elif name == TIME:
                yield f"{where}: time is no channel; its unit is that of a column"
            elif name in channels() and (keys := sorted(entry.model_fields_set - {"scale"})):
                yield f"{where}: {keys[0]} is fixed for a channel of the press; only a scale can be given"
            if entry.unit is not None and parse_unit(entry.unit) is None:
                yield f"{where}: unit = {entry.unit!r} is not known"
            if entry.factor == 0:
                yield f"{where}: factor = 0 leaves nothing of the column"
            rate = getattr(entry, "rate", None)
            if rate is not None and (rate == name or rate not in names):
                yield f"{where}: rate = {rate!r} is not another {kind}"
