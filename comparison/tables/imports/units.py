"""Conversion of units of other programs to SI.

A table of exact factors and a rule for products and powers. A units library would add four packages, a third
of a second, and misinterpretations (``newton-mm`` as a difference).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Unit:
    """Unit as a multiple of SI.

    Attributes
    ----------
    factor
        SI units per unit, exact; for degrees and revolutions the nearest double.
    powers
        Exponents of kg, m, s and rad. An angle has its own dimension, so that millimetres are not radians.
    """

    factor: Fraction
    powers: tuple[int, int, int, int]

    def __mul__(self, other: Unit) -> Unit:
        powers = tuple(p + q for p, q in zip(self.powers, other.powers, strict=True))
        return Unit(self.factor * other.factor, powers)  # type: ignore[arg-type]

    def __pow__(self, exponent: int) -> Unit:
        powers = tuple(p * exponent for p in self.powers)
        return Unit(self.factor**exponent, powers)  # type: ignore[arg-type]

    def over(self, other: Unit) -> Unit:
        """Return this unit in multiples of another of the same dimension, with its powers."""
        return Unit(self.factor / other.factor, self.powers)

    def to_si(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values in SI, unchanged if they already are.

        A unit that is an integer fraction of SI divides: 12.5 mm is then exactly the double 0.0125.
        """
        if self.factor == 1:
            return values
        if self.factor.numerator == 1:
            return values / float(self.factor.denominator)
        return values * float(self.factor)


_KG, _M, _S, _RAD = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)
_N, _J = (1, 1, -2, 0), (1, 2, -2, 0)
_DEGREE = Fraction(math.pi) / 180
_TURN = Fraction(2 * math.pi)

# Names, SI units per unit, dimension. Lengths, times and forces of the inch system are exact by definition.
_TABLE: tuple[tuple[str, Fraction | str, tuple[int, int, int, int]], ...] = (
    ("m meter meters metre metres", "1", _M),
    ("mm millimeter millimeters millimetre millimetres", "1e-3", _M),
    ("cm centimeter centimetre", "1e-2", _M),
    ("um µm μm micrometer micrometre", "1e-6", _M),
    ("in inch inches", "0.0254", _M),
    ("ft foot feet", "0.3048", _M),
    ("s sec second seconds", "1", _S),
    ("ms msec millisecond milliseconds", "1e-3", _S),
    ("us µs μs microsecond microseconds", "1e-6", _S),
    ("ns nanosecond nanoseconds", "1e-9", _S),
    ("min minute minutes", "60", _S),
    ("h hr hour hours", "3600", _S),
    ("rad radian radians", "1", _RAD),
    ("deg degree degrees °", _DEGREE, _RAD),
    ("rev turn turns", _TURN, _RAD),
    ("kg kilogram", "1", _KG),
    ("g gram", "1e-3", _KG),
    ("lbm", "0.45359237", _KG),
    ("N newton newtons", "1", _N),
    ("mN", "1e-3", _N),
    ("kN kilonewton", "1000", _N),
    ("lbf pound_force", "4.4482216152605", _N),
    ("J joule joules", "1", _J),
    ("mJ", "1e-3", _J),
    ("kJ", "1000", _J),
    ("Nm", "1", _J),
    ("Nmm", "1e-3", _J),
    ("kNm", "1000", _J),
    ("W watt", "1", (1, 2, -3, 0)),
    ("kW", "1000", (1, 2, -3, 0)),
    ("Pa pascal", "1", (1, -1, -2, 0)),
    ("kPa", "1000", (1, -1, -2, 0)),
    ("MPa", "1e6", (1, -1, -2, 0)),
    ("GPa", "1e9", (1, -1, -2, 0)),
    ("Hz hertz", "1", (0, 0, -1, 0)),
    ("1 -", "1", (0, 0, 0, 0)),
)
_NAMED = {
    name: Unit(Fraction(factor), powers) for names, factor, powers in _TABLE for name in names.split()
} | {"rpm": Unit(_TURN / 60, (0, 0, -1, 1))}
_FACTOR = re.compile(r"(?P<name>[^\W\d]+|°|1(?!\d))(?:(?:\^|\*\*)?\(?(?P<exponent>[+-]?\d)\)?)?")
_SUPERSCRIPT = {"⁻¹": "^-1", "⁻²": "^-2", "²": "^2", "³": "^3"}


def parse(text: str) -> Unit | None:
    """Return the unit that a text denotes, None if it denotes none.

    Factors are separated by a space, ``*``, ``·``, ``.`` or ``-`` and may carry a power (``s^2``, ``s**2``,
    ``s2``); what follows a ``/`` divides: ``mm/s^2``, ``newton-mm``, ``N·m``, ``deg/sec**2``.
    """
    text = text.strip()
    for sign, plain in _SUPERSCRIPT.items():
        text = text.replace(sign, plain)
    if text in _NAMED:
        return _NAMED[text]
    over, *under = text.replace("**", "^").split("/")
    unit = _product(over)
    for part in under:
        divisor = _product(part.strip("() "))
        unit = None if unit is None or divisor is None else unit * divisor**-1
    return unit


def _product(text: str) -> Unit | None:
    # A hyphen joins two names, but after a power sign it is the sign of the number.
    parts = [part for part in re.split(r"[\s*·.]+|(?<=[^\W\d])-(?=[^\W\d])", text.strip()) if part]
    if not parts:
        return None
    unit = _NAMED["1"]
    for part in parts:
        found = _FACTOR.fullmatch(part)
        name = found["name"] if found is not None else ""
        # DEG, but not MM, which may be megametres.
        factor = _NAMED.get(name) or (_NAMED.get(name.lower()) if len(name) > 2 else None)
        if found is None or factor is None:
            return None
        unit = unit * factor ** int(found["exponent"] or 1)
    return unit
