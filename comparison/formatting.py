"""Formatting of numbers (significant digits, SI prefix, unit) and of Markdown tables."""

import math
import re
from collections.abc import Iterable, Sequence

_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
_TAKES_PREFIX = re.compile(r"(?:m|s|rad|N|J|W|Pa|Hz)(?![^\W\d])")
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MISSING = "n/a"
NO_BREAK = "\u00a0"


def pretty_unit(unit: str) -> str:
    """Return the unit with a superscript, "m/s^2" as "m/s²", and an empty string for the unit "1"."""
    return "" if unit == "1" else unit.replace("^2", "²")


def prefix(magnitude: float, unit: str) -> tuple[float, str]:
    """Return factor and prefixed unit, down to nano, that bring a magnitude below 1 to between 1 and 1000."""
    if _TAKES_PREFIX.match(unit) and math.isfinite(magnitude):
        for factor, letter in _PREFIXES:
            if magnitude >= factor * (1 - 5e-4):  # 999.6e-9 m rounds to 1.00 µm
                return factor, letter + pretty_unit(unit)
    return 1.0, pretty_unit(unit)


def number(value: float, digits: int = 3) -> str:
    """Return the value with `digits` significant digits, as a power of ten outside 0.001 .. 100,000."""
    if not math.isfinite(value):
        return MISSING if math.isnan(value) else ("∞" if value > 0 else "−∞")
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    if -3 <= power < 5:
        return f"{float(f'{mantissa}e{power}'):.{max(0, digits - 1 - power)}f}".replace("-", "−")
    return f"{mantissa}·10{str(power).translate(_SUPERSCRIPT)}".replace("-", "−")


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """Return value and unit with an SI prefix: ``quantity(5.2e-7, "m")`` is "520 nm"."""
    if math.isnan(value):
        return MISSING
    factor, scaled_unit = prefix(abs(value), unit)
    return f"{number(value / factor, digits)}{NO_BREAK}{scaled_unit}".rstrip()


def instant(time: float, *others: float) -> str:
    """Return a time (s) with the fewest digits, six at least, that distinguish it from the others."""
    text = ""
    for digits in range(6, 18):
        text = f"{time:.{digits}g}"
        if all(other == time or f"{other:.{digits}g}" != text for other in others):
            break
    return text


def spans(*ends: float) -> tuple[str, str]:
    """Return two spans, given as start, end, start, end (s), with digits that distinguish the four times."""
    start, end, other_start, other_end = (instant(each, *ends) for each in ends)
    return f"{start} to {end} s", f"{other_start} to {other_end} s"


def holes_line(where: str, holes: Sequence[tuple[float, float, int]]) -> str:
    """Return a sentence on the longest hole (start, end in s, missing rows); ``where`` is its beginning."""
    start, end, _ = max(holes, key=lambda hole: hole[1] - hole[0])
    missing = sum(rows for *_, rows in holes)
    more = f" (and {len(holes) - 1} more such holes)" if len(holes) > 1 else ""
    rows = f": {missing} {'row is' if missing == 1 else 'rows are'} missing" if missing else ""
    return f"{where} no row between {instant(start, end)} and {instant(end, start)} s{more}{rows}"


def decade(value: float) -> str:
    """Return a power of ten for an axis: ``decade(1e-9)`` is "10⁻⁹"."""
    return f"10{str(round(math.log10(value))).translate(_SUPERSCRIPT)}"


def percent(share: float, error: float = 0.0) -> str:
    """Return a share as percent, cut to two decimals: beside a failing verdict 98.999 % must not be 99.00 %.

    An error is added with one digit if it shows: "66.40 ± 0.3 %".
    """
    if math.isnan(share):
        return MISSING
    # The small addend undoes only the rounding of the product (0.29 * 10000 is 2900 - 5e-13).
    hundredths = math.floor(share * 10000 + 1e-8)
    text = "100" if hundredths == 10000 else f"{hundredths / 100:.2f}"
    if error >= 5e-5:
        text += f"{NO_BREAK}±{NO_BREAK}{number(100 * error, 1)}"
    return f"{text}{NO_BREAK}%"


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; bars inside cells are escaped."""
    texts = [[cell.replace("|", r"\|") for cell in cells] for cells in (headings, *rows)]
    head, *body = [f"| {' | '.join(cells)} |" for cells in texts]
    return "\n".join([head, f"|{'---|' * len(headings)}", *body])
