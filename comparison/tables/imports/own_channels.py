"""Channels other than the press's: those that a mapping defines, and columns of one name in both tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from comparison.tables.arrays import Array
from comparison.tables.channels import Channel, channels
from comparison.tables.imports.mapping import Quantity
from comparison.tables.imports.units import Unit, parse
from comparison.tables.table import TableError

GROUP = "own"
# Of the largest value: a channel that varies by less varies by the rounding of its numbers.
_ROUND_OFF = 4 * float(np.finfo(np.float64).eps)


class Stated(NamedTuple):
    """What one table says of a channel."""

    table: str
    unit: str | None
    """None: nothing."""
    values: Array


def own_channel(name: str, quantity: Quantity, stated: Sequence[Stated]) -> Channel:
    """Return the definition of a channel.

    Its unit is the given one, else the tables': of two that differ but measure the same the first table's.

    Raises
    ------
    TableError
        If the tables' units exclude each other, or one states a unit and the other none.
    """
    unit = quantity.unit if quantity.unit is not None else _common_unit(name, stated)
    known = parse(unit)
    turn = 2 * math.pi
    if quantity.angle:
        if known is None or known.powers != (0, 0, 0, 1):
            raise TableError(f"mapping: channels.{name!r}: angle = true, but its unit {unit!r} is no angle")
        turn /= float(known.factor)
    largest = max(
        (float(np.abs(of.values[np.isfinite(of.values)]).max(initial=0.0)) for of in stated), default=0.0
    )
    return Channel(
        name=name,
        label=name,
        unit=unit,
        sign="",
        group=GROUP,
        scale="range",
        floor=max(_ROUND_OFF * largest, float(np.finfo(np.float64).tiny)),
        round_off=0.0,
        rate=quantity.rate,
        angle=quantity.angle,
        turn=turn,
        given=quantity.scale,
    )


def check_rates(defined: Iterable[Channel]) -> None:
    """Reject a rate whose unit is not that of its channel per second: a cubic through both would be wrong.

    Raises
    ------
    TableError
        One line.
    """
    known = {channel.name: channel for channel in defined}
    second = parse("s")
    for channel in known.values():
        rate = known.get(channel.rate or "") or channels().get(channel.rate or "")
        units = (parse(channel.unit), None if rate is None else parse(rate.unit))
        if rate is None or units[0] is None or units[1] is None or second is None:
            continue
        if units[1] * second != units[0]:
            raise TableError(
                f"mapping: channels.{channel.name!r}: rate = {rate.name!r} is in {rate.unit}, "
                f"which is not {channel.unit} per second"
            )


def is_prose(unit: str) -> bool:
    """Return whether what stands in brackets beside a name is no unit, not even one that is not known."""
    return " " in unit and parse(unit) is None


def _common_unit(name: str, stated: Sequence[Stated]) -> str:
    units = {None if of.unit is None or is_prose(of.unit) else of.unit: of.table for of in stated}
    if len(units) < 2:
        return next(iter(units)) or "" if units else ""
    (first, a), (second, b) = list(units.items())[:2]
    if first is None or second is None:
        has, lacks = (a, b) if second is None else (b, a)
        raise TableError(
            f"{has}: column {name!r} is in {first or second}, {lacks} states no unit; {_decides(name)}"
        )
    known: tuple[Unit | None, Unit | None] = (parse(first), parse(second))
    message = f"column {name!r} is in {first} in {a} and in {second} in {b}"
    if known[0] is None or known[1] is None:
        unknown = first if known[0] is None else second
        raise TableError(f"{message}; {unknown!r} is not a known unit: {_decides(name)}")
    if known[0].powers != known[1].powers:
        raise TableError(message)
    return first


def _decides(name: str) -> str:
    return f'a mapping (--mapping) with [channels."{name}"] and its unit = "..." decides'
