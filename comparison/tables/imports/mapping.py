"""Mapping file: channel, unit and sign of each column of another program's table; channels of one's own."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping as Pairs
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from comparison.files import contents
from comparison.scene.fields import Sign
from comparison.tables.channels import channels
from comparison.tables.imports.units import parse
from comparison.tables.table import TableError

TIME = "time"


class _Keys(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Rule(_Keys):
    """Conversion of a column: ``channel = (sign * factor * column + offset) * unit``."""

    channel: str
    unit: str | None = None
    """None: as stated in the table."""
    sign: Sign = 1
    offset: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    """In the column's unit."""
    factor: Annotated[float, Field(allow_inf_nan=False)] | None = None
    """Of the column, for one that is normalised; None: that of the channel."""


class Quantity(_Keys):
    """Channel of one's own; of a channel of the press only the scale can be given."""

    unit: str | None = None
    """Of the comparison; None: that of the tables."""
    scale: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    """In that unit; None: the range of the first table."""
    angle: bool = False
    """Whether whole revolutions do not matter."""
    rate: str | None = None
    """The channel that is its time derivative."""
    factor: Annotated[float, Field(allow_inf_nan=False)] = 1.0
    """Of its columns in both tables: what they are normalised by."""


class Mapping(_Keys):
    """Contents of a mapping file.

    Attributes
    ----------
    compare
        Channels to compare; None: all, and both tables must hold the same.
    columns
        Column name -> rule, for either table.
    channels
        Channel -> its definition.
    a, b
        As ``columns``, for the first or the second table only; takes precedence over ``columns``.
    """

    compare: Annotated[list[str], Field(min_length=1)] | None = None
    columns: dict[str, Rule] = {}
    channels: dict[str, Quantity] = {}
    a: dict[str, Rule] = {}
    b: dict[str, Rule] = {}

    def of(self, side: Literal["a", "b"]) -> Pairs[str, Rule]:
        """Return the rules that apply to one of the tables."""
        return self.columns | (self.a if side == "a" else self.b)


def load_mapping(path: Path) -> Mapping:
    """Read a mapping file.

    Raises
    ------
    TableError
        One line with key, value and violated rule.
    """
    try:
        mapping = Mapping.model_validate(tomllib.loads(contents(path)))
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    except ValidationError as error:  # before its base class ValueError
        raise TableError(f"{path}: {_explain(error)}") from error
    except ValueError as error:  # TOML's and UnicodeDecodeError
        raise TableError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    except RecursionError as error:
        raise TableError(f"{path}: is nested too deeply") from error
    for name, quantity in mapping.channels.items():
        _check_quantity(f"{path}: channels.{name!r}", name, quantity, mapping)
    for part, rules in (("columns", mapping.columns), ("a", mapping.a), ("b", mapping.b)):
        for column, rule in rules.items():
            where = f"{path}: {part}.{column!r}"
            if rule.channel != TIME and rule.channel not in {*channels(), *mapping.channels}:
                raise TableError(
                    f"{where}: channel = {rule.channel!r} is not a channel, nor defined by [channels]"
                )
            if rule.unit is not None and parse(rule.unit) is None:
                raise TableError(f"{where}: unit = {rule.unit!r} is not known")
            if rule.factor == 0:
                raise TableError(f"{where}: factor = 0 leaves nothing of the column")
    if not (mapping.columns or mapping.a or mapping.b or mapping.compare or mapping.channels):
        raise TableError(f"{path}: names no column")
    return mapping


def _check_quantity(where: str, name: str, quantity: Quantity, mapping: Mapping) -> None:
    """Reject what cannot be meant.

    Raises
    ------
    TableError
        One line.
    """
    if name == TIME:
        raise TableError(f"{where}: time is no channel; its unit is that of a column")
    if name in channels():
        if quantity.model_fields_set - {"scale"}:
            key = sorted(quantity.model_fields_set - {"scale"})[0]
            raise TableError(f"{where}: {key} is fixed for a channel of the press; only a scale can be given")
        return
    if quantity.unit is not None and parse(quantity.unit) is None:
        raise TableError(f"{where}: unit = {quantity.unit!r} is not known")
    if quantity.factor == 0:
        raise TableError(f"{where}: factor = 0 leaves nothing of the columns")
    if quantity.rate is not None and (
        quantity.rate == name or quantity.rate not in {*channels(), *mapping.channels}
    ):
        raise TableError(f"{where}: rate = {quantity.rate!r} is no other channel, nor defined by [channels]")


_RULES = {
    "extra_forbidden": "is not a known key",
    "missing": "is missing",
    "string_type": "must be a string",
    "bool_type": "must be true or false",
    "greater_than": "must be above 0",
    "float_type": "must be a number",
    "finite_number": "must be finite",
    "literal_error": "must be 1 or -1",
    "list_type": "must be a list of channels",
    "too_short": "must name at least one channel",
    "dict_type": "must be a section",
    "model_type": "must be a section",
    "model_attributes_type": "must be a section",
}


def _explain(error: ValidationError) -> str:
    first = error.errors()[0]
    key = ".".join(str(step) for step in first["loc"])
    value = "" if first["type"] in {"missing", "extra_forbidden"} else f" = {first['input']!r}"
    return f"{key}{value} {_RULES.get(first['type'], first['msg'])}"
