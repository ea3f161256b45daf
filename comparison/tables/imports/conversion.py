"""Conversion of one column to the unit and sign of its channel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from comparison.tables.channels import Channel, channels
from comparison.tables.imports.exports import Column
from comparison.tables.imports.mapping import TIME, Rule
from comparison.tables.imports.units import parse
from comparison.tables.table import TableError


def convert(
    path: Path, column: Column, channel: Channel | None, rule: Rule | None, factor: float
) -> tuple[NDArray[np.float64], str]:
    """Return a column in its channel's unit (None: the time), and a description of the conversion.

    Raises
    ------
    TableError
        If its unit is unknown, has the wrong dimension, or is missing for a column with a rule.
    """
    where = f"{path}: column {column.name!r}"
    name, wanted = (TIME, "s") if channel is None else (channel.name, channel.unit)
    stated = column.unit if rule is None or rule.unit is None else rule.unit
    if stated is None and rule is not None and (channel is None or name in channels()):
        raise TableError(f"{where} has no unit, neither in the table nor in the mapping")
    stated = wanted if stated is None else stated
    values = column.numbers
    description = f"{column.name} in {stated}" if stated else column.name
    if rule is not None:
        factor = factor if rule.factor is None else rule.factor
        values = values if rule.sign == 1 else -values
        description = ("-" if rule.sign < 0 else "") + description
    if factor != 1:
        values, description = values * factor, f"{factor:g} {description}"
    if rule is not None and rule.offset:
        values, description = values + rule.offset, description + f" {rule.offset:+g}"
    unit, kind = parse(stated), parse(wanted)
    other = parse(column.unit) if column.unit is not None else None
    if factor != 1 and unit == parse("1"):
        other, unit, stated = None, kind, wanted  # the factor of a normalised column has the unit
    if stated != wanted or name in channels() or channel is None:
        if unit is None:
            raise TableError(f"{where}: unit {stated!r} is not known")
        if kind is None or unit.powers != kind.powers:
            raise TableError(
                f"{where}: unit {stated!r} does not fit the channel {name}, which is in {wanted}"
            )
    if other is not None and other != unit:
        raise TableError(f"{where}: the unit is {column.unit!r} in the table and {stated!r} in the mapping")
    return (values if unit is None or kind is None else unit.over(kind).to_si(values)), description
