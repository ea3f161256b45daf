"""Sentences about the causes of a difference that the data name: what is said first of a comparison."""

import json
from collections.abc import Sequence
from math import ceil, isnan, log10
from typing import Any

from comparison.formatting import quantity
from comparison.tables.channels import CONTACTS, PIN
from comparison.tables.units import parse_unit
from comparison.verdict.results import Cause, SceneComparison

_DIGITS = 7  # of a number that is known to more
_MANY = 3  # names or scenes in one sentence
_SHOWN = 0.01  # of the difference, from which on the part that is left is said
_UNIT = 1e-3  # share by which a ratio may miss that of two units, if it is not known better
# What programs write for an SI unit.
_UNITS = {
    "m": ("mm", "cm", "in", "ft"),
    "rad": ("deg", "rev"),
    "m/s": ("mm/s", "cm/s", "in/s"),
    "rad/s": ("rpm", "deg/s"),
    "m/s^2": ("mm/s^2", "cm/s^2"),
    "rad/s^2": ("deg/s^2",),
    "N": ("kN", "mN", "lbf"),
    "N m": ("N mm", "kN m"),
    "J": ("mJ", "kJ"),
}


def causes(scene: SceneComparison) -> list[str]:
    """Return the causes that the data of a comparison name, those that explain most first."""
    return [cause(one, scene) for one in scene.causes]


def lead(scenes: Sequence[SceneComparison]) -> list[str]:
    """Return what is said first: all causes of one scene, the first of each of several.

    At the tightest tier that names one.
    """
    lines: list[str] = []
    for scene in scenes:
        texts = next((texts for tier in reversed(scene.tiers) if (texts := causes(tier))), [])
        lines += texts if len(scenes) == 1 else [f"{scene.name}: {text}" for text in texts[:1]]
    left = len(lines) - _MANY
    return [*lines[:_MANY], f"{left} more causes are on the page"] if left > 1 else lines


def cause(one: Cause, scene: SceneComparison) -> str:
    """Return a cause as a sentence without its full stop, and what of the difference it does not explain."""
    rest = f"; without it {one.left:.0%} of the difference is left" if one.left >= _SHOWN else ""
    return _cause(one, scene) + rest


def _cause(one: Cause, scene: SceneComparison) -> str:
    a, b = scene.labels
    name, several = _named(one.channels), len(one.channels) > 1
    unit = scene.channels[one.channels[0]].unit if one.channels else ""
    those = "those" if several else "that"
    of_b = f"{name} of {b} {'are' if several else 'is'}"
    place = CONTACTS.get(one.place, "") + ("" if one.place == PIN else " corner")
    impact = f"the first impact, at {one.time:.6g} s ({place}),"
    known = _known(one.value, one.uncertainty)
    match one.kind:
        case "keys":
            keys = [f"{key} is {_value(its)} in {a} and {_value(own)} in {b}" for key, its, own in one.keys]
            more = len(keys) - _MANY
            return "; ".join(keys[:_MANY] + [f"{more} more keys of the scenes differ"] * (more > 0))
        case "ratio":
            return _ratio(one, of_b, f"{those} of {a}", unit, scene.labels)
        case "offset":
            size, sense = _known(abs(one.value), one.uncertainty, unit), "above" if one.value > 0 else "below"
            return f"{of_b} {size} {sense} {those} of {a}, at all times"
        case "constant":
            return f"{of_b} constant, {quantity(one.value, unit)}"
        case "shift":
            late, early = (b, a) if one.value > 0 else (a, b)
            size = _known(abs(one.value), one.uncertainty, "s")
            return f"{late} is later than {early} by {size} in {name}"
        case "friction":
            its, own = (f"{value:.6g}" for value in one.values)
            return f"friction over normal force is {its} in {a} and {own} in {b}, {known} times"
        case "gravity":
            size = _known(one.value, one.uncertainty, unit, sign=True)
            return f"before the first contact {name} differs by {size} in {b}, whatever slider_ay is: gravity"
        case "stiffness":
            return (
                f"{impact} has equal impulses, and forces as of {known} times the stiffness in {b}: "
                "the material, radius or stiffness of the contact"
            )
        case "restitution":
            return (
                f"{impact} has {known} times the impulse in {b}, at equal approach speed: "
                "restitution or damping"
            )
        case "contact":
            having, lacking = (a, b) if one.side == "b" else (b, a)
            return f"{lacking} lacks the contact of the {place} at {one.time:.6g} s, which {having} has"


def _ratio(one: Cause, of_b: str, of_a: str, unit: str, labels: tuple[str, str]) -> str:
    size = abs(one.value)
    text = f"{of_b} {_known(one.value, one.uncertainty)} times {of_a}"
    if (
        size - 1.0 <= max(one.uncertainty, 1e-9)
        and 1.0 - size <= max(one.uncertainty, 1e-9)
        and one.value < 0
    ):
        text = f"{of_b} minus {of_a}: the sign"
    text += (
        f", {'plus' if one.offset > 0 else 'minus'} {quantity(abs(one.offset), unit)}" if one.offset else ""
    )
    for other in _UNITS.get(unit, ()):
        units = parse_unit(unit), parse_unit(other)
        assert units[0] is not None
        assert units[1] is not None
        times = float(units[0].factor / units[1].factor)
        for label, factor in ((labels[1], times), (labels[0], 1.0 / times)):
            if abs(size / factor - 1.0) <= max(_UNIT if one.left > 1e-6 else 1e-6, one.uncertainty / size):
                rest = labels[0] if label == labels[1] else labels[1]
                return f"{text}: perhaps {other} in {label} and {unit} in {rest}"
    return text


def _named(channels: Sequence[str]) -> str:
    if len(channels) <= _MANY:
        return " and ".join(filter(None, (", ".join(channels[:-1]), channels[-1]))) if channels else ""
    return f"{', '.join(channels[: _MANY - 1])} and {len(channels) - _MANY + 1} more channels"


def _value(value: Any) -> str:
    return "not stated" if value is None else json.dumps(value, ensure_ascii=False)


def _known(value: float, uncertainty: float, unit: str = "", *, sign: bool = False) -> str:
    """Return a number to the digits that are known, and its uncertainty where it shows in these."""
    share = uncertainty / abs(value) if value and not isnan(uncertainty) else 0.0
    if share < 10.0**-_DIGITS:
        return f"{value:{'+' if sign else ''}#.{_DIGITS}g} {unit}".rstrip().removesuffix(".")
    digits = max(1, min(_DIGITS, ceil(-log10(share)) + 1))
    return f"{value:{'+' if sign else ''}#.{digits}g} ± {uncertainty:.1g} {unit}".rstrip()
