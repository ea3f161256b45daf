"""Units of other programs in multiples of SI: exact factors, and a rule for products and powers.

An angle has its own dimension. A units library would read ``Nm`` as a number times a metre and ``newton-mm``
as a difference, and take ``T``, ``t`` and ``a`` for units.
"""

import math
import re
import unicodedata
from fractions import Fraction
from typing import NamedTuple

from comparison.tables.channels import Array

# Exponents of kg, m, s and rad -> names, the usual one first -> SI units per unit, of the inch system exact
# by definition. The SI unit is the first of its dimension.
_TABLE: dict[tuple[int, ...], dict[str, str | Fraction]] = {
    (0, 0, 0, 0): {"1 -": "1"},
    (0, 1, 0, 0): {
        "m meter meters metre metres": "1",
        "mm millimeter millimeters millimetre millimetres": "1e-3",
        "cm centimeter centimetre": "1e-2",
        "in inch inches": "0.0254",
        "ft foot feet": "0.3048",
        "um μm micrometer micrometre": "1e-6",
    },
    (0, 0, 1, 0): {
        "s sec second seconds": "1",
        "ms msec millisecond milliseconds": "1e-3",
        "us μs microsecond microseconds": "1e-6",
        "min minute minutes": "60",
        "h hr hour hours": "3600",
        "ns nanosecond nanoseconds": "1e-9",
    },
    (0, 0, -1, 0): {"Hz hertz": "1"},
    (0, 0, 0, 1): {
        "rad radian radians": "1",
        "deg degree degrees °": Fraction(math.pi) / 180,
        "rev turn turns": Fraction(2 * math.pi),
    },
    (0, 0, -1, 1): {"rpm": Fraction(2 * math.pi) / 60},
    (1, 0, 0, 0): {"kg kilogram": "1", "g gram": "1e-3", "lbm": "0.45359237"},
    (1, 1, -2, 0): {
        "N newton newtons": "1",
        "kN kilonewton": "1e3",
        "mN": "1e-3",
        "lbf pound_force": "4.4482216152605",
    },
    (1, 2, -2, 0): {"J joule joules Nm": "1", "mJ Nmm": "1e-3", "kJ kNm": "1e3"},
    (1, 2, -3, 0): {"W watt": "1", "kW": "1e3"},
    (1, -1, -2, 0): {"Pa pascal": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9"},
}
_FACTOR = re.compile(r"(?P<name>[^\W\d]+|°|1(?!\d))(?:(?:\^|\*\*)?\(?(?P<exponent>[+-]?\d)\)?)?")
# A hyphen joins two names, but after a power sign it is the sign of the number.
_BETWEEN = re.compile(r"[\s*·.]+|(?<=[^\W\d])-(?=[^\W\d])")


class Unit(NamedTuple):
    """Unit: its multiple of SI, exact except for angles, and the exponents of kg, m, s and rad."""

    factor: Fraction
    powers: tuple[int, ...]

    def times(self, other: "Unit", exponent: int = 1) -> "Unit":
        """Return the product with a power of another unit."""
        powers = tuple(p + exponent * q for p, q in zip(self.powers, other.powers, strict=True))
        return Unit(self.factor * other.factor**exponent, powers)

    def convert(self, values: Array, to: "Unit") -> Array:
        """Return values in another unit of the same dimension, unchanged if it is the same one."""
        ratio = self.factor / to.factor
        if ratio == 1:
            return values
        # An integer fraction divides: 12.5 mm is exactly the double 0.0125.
        return values / float(ratio.denominator) if ratio.numerator == 1 else values * float(ratio)


_UNITS = {
    name: Unit(Fraction(factor), powers)
    for powers, units in _TABLE.items()
    for names, factor in units.items()
    for name in names.split()
}


def parse_unit(text: str) -> Unit | None:
    """Return the unit that a text such as ``mm/s^2``, ``newton-mm`` or ``deg/sec**2`` denotes, None if none.

    A space, ``*``, ``·``, ``.`` or ``-`` separates factors; what follows a ``/`` divides.
    """
    text = unicodedata.normalize("NFKC", text.strip()).replace("\u2212", "-")  # mm/s², m s⁻²
    if text in _UNITS:
        return _UNITS[text]
    unit = _UNITS["1"]
    for n, part in enumerate(text.replace("**", "^").split("/")):
        factors = list(filter(None, _BETWEEN.split((part.strip("() ") if n else part).strip())))
        for match in map(_FACTOR.fullmatch, factors):
            name = match["name"] if match else ""
            # DEG, but not MM, which may be megametres.
            entry = _UNITS.get(name) or (_UNITS.get(name.lower()) if len(name) > 2 else None)
            if match is None or entry is None:
                return None
            unit = unit.times(entry, int(match["exponent"] or 1) * (-1 if n else 1))
        if not factors:
            return None
    return unit


def same_dimension(one: Unit | None, other: Unit | None) -> bool:
    """Return whether two units are known, and measure the same."""
    return one is not None and other is not None and one.powers == other.powers


def alternatives(si: str) -> list[str]:
    """Return the units that programs write for one such as ``m/s^2``, itself first."""
    first = re.split("[/ ]", si)[0]
    spellings = (names.split()[0] for names in _TABLE.get(_UNITS[first].powers, {}))
    units = dict.fromkeys([first, *spellings])
    return [unit + si.removeprefix(first) for unit in units] + ["rpm"] * (si == "rad/s")
