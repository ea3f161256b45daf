"""Mapping file: channel, unit and sign of each column of another program's table."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping as Pairs
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from comparison.tables.channels import channels
from comparison.tables.imports.units import parse
from comparison.tables.table import TableError

TIME = "time"


class _Keys(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Rule(_Keys):
    """Conversion of a column: ``channel = (sign * column + offset) * unit``."""

    channel: str
    unit: str | None = None
    """None: as stated in the table."""
    sign: Literal[1, -1] = 1
    offset: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    """In the column's unit."""


class Mapping(_Keys):
    """Contents of a mapping file.

    Attributes
    ----------
    compare
        Channels to compare; None: all, and both tables must hold the same.
    columns
        Column name -> rule, for either table.
    a, b
        The same for the first or the second table only; takes precedence over ``columns``.
    """

    compare: Annotated[list[str], Field(min_length=1)] | None = None
    columns: dict[str, Rule] = {}
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
        mapping = Mapping.model_validate(tomllib.loads(path.read_text("utf-8")))
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    except ValidationError as error:  # before its base class ValueError
        raise TableError(f"{path}: {_explain(error)}") from error
    except ValueError as error:  # TOML's and UnicodeDecodeError
        raise TableError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    for name in mapping.compare or ():
        if name not in channels():
            raise TableError(f"{path}: compare: {name!r} is not a channel")
    for part, rules in (("columns", mapping.columns), ("a", mapping.a), ("b", mapping.b)):
        for column, rule in rules.items():
            where = f"{path}: {part}.{column!r}"
            if rule.channel != TIME and rule.channel not in channels():
                raise TableError(f"{where}: channel = {rule.channel!r} is not a channel")
            if rule.unit is not None and parse(rule.unit) is None:
                raise TableError(f"{where}: unit = {rule.unit!r} is not known")
    if not (mapping.columns or mapping.a or mapping.b or mapping.compare):
        raise TableError(f"{path}: names no column")
    return mapping


_RULES = {
    "extra_forbidden": "is not a known key",
    "missing": "is missing",
    "string_type": "must be a string",
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
