"""Tables in the dialects that programs write, at random: their bytes, and what they mean."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

NAMES = [
    "x", "y", "q1", "s1", "s2", "m2", "x[0]", "x[1]", "pos(1)", "pos(2)", "der(x)", "rod2[w.X]", "rod2[v.Y]",
    ".press.X", "/body/rod|q", "V(out)", "N", "rad", "t_end", "T", "Δφ", "8th", "a-b", "x.1", "100%",
]  # fmt: skip
SPACED = ["slider x", "Joint angle 2", "F, left", "a; b", "hit #3", "time to go"]
"""Names that are quoted where the separator is in them."""
UNITS = ["mm", "m", "deg", "N", "m/s^2", "N mm", "kg/(m^3)", "-", "furlong", "°"]
TITLES = [
    "Press run 7", "Press\frun", "Press\vrun", "Press\x85run", "Press\u2028run", "5\" pipe", '"Press', 'run "7"',
    "it's", "a, b, c", "a;b;c;d", "7 runs of 3", "v1.2.3, 2026-01-01 12:00", "Δt = 0,5 s", "x" * 300, "", "  ",
    "sep=;", "===", "-----", "(", "[]", "made on a day, in May", "inDegrees=no", "endheader", "\ufeff",
]  # fmt: skip
COMMENTS = ["# run 7", "#", "% made by hand", "! end of block", "# 1 2 3", '# "', "  # it's", "#0,1"]


@dataclass(frozen=True)
class Written:
    """A table as it is in a file, and as it is meant.

    Attributes
    ----------
    content
        Of the file.
    names, units, columns
        In the order of the file, the time first.
    text
        Name of a column that is no numbers; or empty.
    dialect
        How it is written.
    """

    content: bytes
    names: list[str]
    units: list[str | None]
    columns: list[list[float]]
    text: str
    dialect: dict[str, Any]


def number(draw: st.DrawFn, kind: str, value: float) -> str:
    """Write a number with a point."""
    if kind == "D":
        return f"{value:.6E}".replace("E", "D")
    if kind == "no letter" and value:
        mantissa = f"{value:.6E}".partition("E")[0]
        return f"{mantissa}{draw(st.sampled_from(['-', '+']))}10{draw(st.integers(0, 9))}"
    if kind == "repr" or kind == "no letter":
        return repr(value)
    return f"{value:{kind}}"


@st.composite
def written(draw: st.DrawFn, *, sound: bool = False) -> Written:
    """Draw a table; a sound one holds nothing but numbers and can be compared."""
    pick = lambda *options: draw(st.sampled_from(options))  # noqa: E731
    chance = lambda: draw(st.integers(0, 3)) == 0  # noqa: E731
    separator = pick(",", ";", "\t", " ", ", ", "   ", " ; ", "\t ", "  \t")
    spaces = not separator.strip(" \t") and separator in (" ", "   ", "  \t")
    decimal = pick(".", ".", ",")
    quotes = pick("none", "none", "all", "needed", "names")
    kind = pick("repr", "repr", ".3f", ".6e", "g", ".10g", ".15g", "+.4e", "D", "no letter", ".0f", "E")
    thousands = pick("", "", "", {".": ",", ",": "."}[decimal]) if kind in (".3f", "repr", ".0f") else ""
    if thousands == "." and separator.strip() == ",":
        thousands = ""  # no program writes this
    count, rows = draw(st.integers(2, 5)), draw(st.integers(2, 7))
    late = chance()  # what is not whole begins after a hundred rows
    rows += 110 * late
    # The columns.
    step = pick(0.1, 0.25, 1.0, 0.001, 1 / 3)
    if kind in ("+.4e", "g", ".3f", ".0f"):
        step = {".3f": 0.125, ".0f": 1.0}.get(kind, 0.25)
    time = [n * step for n in range(rows)]
    values = st.one_of(
        st.sampled_from([0.0, -0.0, 1.0, 0.5, 1.5, 12.125, 250.0, 1500.0, -1234.5, 1234567.875, 1e-9]),
        st.floats(-1e6, 1e6).map(lambda v: v if abs(v) > 1e-90 else 0.0),
    )
    columns = [time]
    for _ in range(count - 1):
        own = draw(st.lists(values, min_size=min(rows, 7), max_size=min(rows, 7)))
        columns.append([float(n % 3) for n in range(rows - len(own))] + own)
    if late:
        columns[0] = [float(n) for n in range(rows)]
    cells = [[number(draw, kind, v) for v in column] for column in columns]
    if late:  # as %g writes them
        cells = [[f"{v:.0f}" if v == round(v) else c for v, c in zip(column, own, strict=True)]
                 for column, own in zip(columns, cells, strict=True)]  # fmt: skip
    meant = [[_meant(cell) for cell in own] for own in cells]
    if thousands:
        cells = [[_grouped(cell) for cell in own] for own in cells]
    swap = {".": decimal, ",": thousands}
    cells = [["".join(swap.get(c, c) for c in cell) for cell in own] for own in cells]
    text = ""
    # The heading.
    header = pick("names", "names", "units below", "[]", "()", "attached", "none", "comment", "comment units")
    pool = NAMES if spaces and quotes not in ("all", "names") else NAMES + SPACED
    names = [pick("time", "Time", "TIME", "t"), *draw(st.permutations(pool))[: count - 1]]
    units: list[str | None] = [None] * count
    if header in ("units below", "[]", "()", "attached", "comment units"):
        known = [u for u in UNITS if not (spaces and " " in u)]
        if header != "[]":
            known.remove("kg/(m^3)")
        if header == "attached":
            known = [u for u in known if u != "furlong"]
        units = [pick("s", "ms", "sec"), *(pick(*known) for _ in names[1:])]
    if header in ("[]", "()", "attached"):  # whose brackets are not the unit's
        names = [name if name[-1] not in "])" else f"{name}.u" for name in names]
    if not sound and count > 2 and chance():
        place, row = draw(st.integers(1, count - 1)), draw(st.integers(0, rows - 1))
        entry = pick("nan", "NaN", "-nan", "1.#QNAN", "-1.#IND", "nan(ind)", "", "false", "N/A", "***", "−5", "1 5",
                     "0x10", "inf", "1_0", "1.5.2", "#N/A", "12:30", "5%")  # fmt: skip
        if not (spaces and (not entry or " " in entry)) and not ("," in entry and decimal == ","):
            cells[place][row] = entry
            text = names[place] if header != "none" else f"#{place + 1}"
    heading = _heading(draw, header, names, units, separator, spaces, quotes)
    index = not spaces and heading and not header.startswith("comment") and chance()
    trailing = pick("", "", "rows", "both") if not spaces else ""
    lines = []
    for n in range(rows):
        fields = [own[n] for own in cells]
        if index:
            fields = [str(n), *fields]
        fields = [_quoted(f, separator, quotes in ("all",), quotes) for f in fields]
        line = (" " * draw(st.integers(0, 2)) if spaces and chance() else "") + separator.join(fields)
        lines.append(line + (separator.strip(" ") if trailing else ""))
    if index:
        heading = [separator.strip(" ") + h for h in heading]
    if trailing == "both":
        heading = [h + separator.strip(" ") for h in heading]
    odd = {"blank": chance(), "comments": chance(), "empty rows": chance() and not spaces, "inline": chance()}
    if odd["comments"]:
        lines.insert(draw(st.integers(1, len(lines))), pick(*COMMENTS))
    if odd["blank"]:
        lines.insert(draw(st.integers(1, len(lines))), pick("", "  "))
    if odd["empty rows"]:
        lines.append(separator.strip(" ") * (count - 1))
    if odd["inline"] and quotes == "none":
        at = draw(st.integers(0, len(lines) - 1))
        lines[at] += pick(" # impact", " #")
    titles = draw(st.lists(st.sampled_from(TITLES), max_size=3)) if header != "none" else []
    comments = draw(st.lists(st.sampled_from(COMMENTS), max_size=2))
    end = pick("\n", "\n", "\r\n", "\r", "mixed")
    everything = [*titles, *comments, *heading, *lines]
    if chance() and heading:
        everything.insert(0, '"A title' + end.replace("mixed", "\n") + 'of two lines"')
    if end == "mixed":
        content = "".join(line + pick("\n", "\r\n", "\r") for line in everything)
        # A carriage return that ends a line and an empty line that ends with a line feed are one end.
    else:
        content = end.join(everything) + pick("", end)
    encoding = pick("utf-8", "utf-8", "utf-8-sig", "utf-16", "cp1252")
    try:
        encoded = content.encode(encoding)
    except UnicodeEncodeError:
        encoded = content.encode("utf-8")
    if header == "none":
        names = ["time", *(f"#{n + 1}" for n in range(1, count))]
    dialect = {"separator": separator, "decimal": decimal, "quotes": quotes, "number": kind, "header": header,
               "thousands": thousands, "end": end, "encoding": encoding, "index": bool(index), "late": late,
               "trailing": trailing} | odd  # fmt: skip
    return Written(encoded, ["time", *names[1:]], units, meant, text, dialect)


def _meant(cell: str) -> float:
    cell = cell.replace("D", "E")
    mantissa, sign, exponent = cell.rpartition("-") if "-10" in cell[1:] else cell.rpartition("+")
    if mantissa and mantissa[-1].isdigit() and len(exponent) == 3 and "." in mantissa and "e" not in cell.lower():
        cell = f"{mantissa}e{sign}{exponent}"
    return float(cell)


def _grouped(cell: str) -> str:
    whole, point, rest = cell.partition(".")
    digits = whole.lstrip("+-")
    if "e" in cell.lower() or len(digits) < 4:
        return cell
    return whole[: len(whole) - len(digits)] + f"{int(digits):,}" + point + rest


def _quoted(field: str, separator: str, always: bool, quotes: str) -> str:
    needed = separator.strip(" ") and separator.strip(" ") in field
    return f'"{field}"' if always or (needed and quotes != "none") or (needed and separator.strip() == ",") else field


def _heading(
    draw: st.DrawFn,
    header: str,
    names: list[str],
    units: list[str | None],
    separator: str,
    spaces: bool,
    quotes: str,
) -> list[str]:
    always = quotes in ("all", "names")
    if header == "none":
        return []
    if header in ("[]", "()"):
        names = [f"{name} {header[0]}{unit}{header[1]}" for name, unit in zip(names, units, strict=True)]
    if header == "attached":
        names = [f"{name}[{unit}]" for name, unit in zip(names, units, strict=True)]
    sign = draw(st.sampled_from(["# ", "#", "% "])) if header.startswith("comment") else ""
    lines = [sign + separator.join(_quoted(name, separator, always, "needed") for name in names)]
    if header in ("units below", "comment units"):
        brackets = draw(st.booleans())
        bare = [f"[{unit}]" if brackets else str(unit) for unit in units]
        lines.append(sign + separator.join(_quoted(unit, separator, False, "needed") for unit in bare))
    return lines
