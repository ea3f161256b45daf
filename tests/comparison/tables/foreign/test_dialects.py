"""One table in the dialects of all programs: the same names, units and numbers, or one line and exit code 2.

A refusal names keys of a mapping's ``[dialect]``; once they are stated the table is read. DIALECTS is the
number of dialects, which are drawn at random, each by a seed of its own.
"""

import itertools
import os
import random
import re
from pathlib import Path
from types import SimpleNamespace as Dialect

import numpy as np
import pytest

from comparison.tables.foreign import read_tables
from comparison.tables.mapping import Mapping
from comparison.tables.table import TableError
from comparison.tables.units import parse_unit

pytestmark = pytest.mark.usefixtures("empty_folder")
NAMES = [
    "x", "y", "q1", "s1", "s2", "m2", "x[0]", "x[1]", "pos(1)", "pos(2)", "der(x)", "rod2[w.X]", "rod2[v.Y]",
    ".press.X", "/body/rod|q", "V(out)", "N", "rad", "t_end", "T", "Δφ", "8th", "a-b", "x.1", "100%",
]  # fmt: skip
PHRASES = ["slider x", "Joint angle 2", "F, left", "a; b", "hit #3", "time to go"]
"""Names that need quotation marks where the separator is in them."""
UNITS = ["mm", "m", "deg", "N", "m/s^2", "N mm", "kg/(m^3)", "-", "furlong", "°"]
TITLES = [
    "Press run 7", "Press\frun", "Press\vrun", "Press\x85run", "Press\u2028run", '5" pipe', '"Press',
    'run "7"', "it's", "a, b, c", "a;b;c;d", "7 runs of 3", "v1.2.3, 2026-01-01 12:00", "Δt = 0,5 s",
    "x" * 300, "", "  ", "sep=;", "===", "-----", "(", "[]", "made on a day, in May", "inDegrees=no",
    "endheader", "\ufeff", "Simulation time 10 s", "Time,13:05:00", "Samples,3", "Rate;100", "Time;13:05:00",
    "Step size 0.01 s", "run time", "time", "t 5 x", "Units: mm",
]  # fmt: skip
COMMENTS = ["# run 7", "#", "# made by hand", "# 1 2 3", '# "', "  # it's", "#0,1", "# s mm", "#time x"]
ENTRIES = [
    "nan", "NaN", "-nan", "1.#QNAN", "-1.#IND", "1.#INF", "nan(ind)", "", "false", "N/A", "***", "−5", "1 5",
    "0x10", "inf", "1_0", "1.5.2", "#N/A", "12:30", "5%", "1e", "1'000", "1-101",
    "#", "#5", "%5", "!", "\x1a",
]  # fmt: skip
OPTIONS = {
    "separator": [",", ";", "\t", " ", ", ", "  ", " ; ", "\t ", "  \t", "     "],
    "decimal": [".", ".", ","],
    "thousands": ["", "", "", "", "yes", "'", "\u202f"],
    # A format, "D" for Fortran's exponents, or "no letter" for its exponents of three digits.
    "number": ["repr", ".3f", ".6e", "g", ".10g", ".15g", "+.4e", "D", "no letter", ".0f", "E"],
    "quotes": ["all", "names", "needed", "needed"],
    "header": ["names", "units below", "[]", "()", "attached", "comment", "comment units", "none"] * 3
    + ["units above"],
    "end": ["\n", "\r\n", "\r", "mixed"],  # of lines; "mixed": one of three in turn
    "last_end": ["", "", "none", "\x1a", "\x1a\n"],
    "encoding": ["utf-8", "utf-8", "utf-8-sig", "utf-16", "cp1252"],
    "mark": "###%!",  # of comments
    "index": [False, False, True],  # a first column without a name counts the rows
    "trailing": ["", "", "rows", "all"],  # lines that end with a separator
    "blank": [None, None, 1, 3],  # row of the table that follows
    "comment": [None] * len(COMMENTS) + [(2, comment) for comment in COMMENTS],  # with the row that follows
    "inline": [None, None, (1, " # impact"), (2, " #"), (4, " # impact")],  # with its row
    "empty_rows": [False, False, True],
}  # fmt: skip
"""The choices of a dialect."""


def random_dialect(rng):
    choices = {name: rng.choice(options) for name, options in OPTIONS.items()}
    dialect = Dialect(**choices, sign=choices["separator"].strip(" "))
    dialect.spaces = dialect.separator.isspace() and not dialect.separator.startswith("\t")
    if dialect.header in ("none", "comment", "comment units"):
        dialect.index = False
    lines = TITLES + [line.replace("#", dialect.mark) for line in COMMENTS]
    dialect.titles = rng.choices(lines, k=rng.randrange(5) if dialect.header != "none" else 0)
    grouped = dialect.thousands and dialect.number in ("repr", ".3f", ".0f")
    dialect.thousands = dialect.thousands if grouped else ""
    if dialect.thousands == "yes":
        dialect.thousands = {".": ",", ",": "."}[dialect.decimal]
    if dialect.thousands == "." and dialect.sign == ",":  # no program groups with its separator
        dialect.thousands = ""
    if dialect.spaces:  # several count as one
        dialect.index, dialect.trailing, dialect.empty_rows = False, "", False
    if dialect.comment is not None:
        dialect.comment = (dialect.comment[0], dialect.comment[1].replace("#", dialect.mark))
    if dialect.mark != "#":
        dialect.inline = None
    return dialect


def statement(keys, names, units, dialect):
    """Return the ``[dialect]`` that states these keys."""
    labels = list(names)
    if units is not None:
        labels = [f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)]
    values = {
        "separator": " " if dialect.spaces else dialect.sign,
        "decimal": dialect.decimal,
        "thousands": dialect.thousands or None,
        "skip": len(re.findall(r"\r\n|\r|\n", _join(dialect.titles, dialect))),
        "names": [] if dialect.header == "none" else [""] * dialect.index + labels,
        "comment": dialect.mark,
    }
    also = {"names"} if dialect.header == "none" else set()  # else the first row is one of names
    return {key: values[key] for key in keys | also if values[key] is not None}


def encode(names, units, columns, dialect):
    cells = [[_cell(value, dialect) for value in column] for column in columns]
    heading = _heading(names, units, dialect)
    lines = []
    for n, row in enumerate(zip(*cells, strict=True)):
        fields = [str(n), *row] if dialect.index else row
        line = dialect.separator.join(_quote(field, dialect, dialect.quotes == "all") for field in fields)
        lines.append(line + (dialect.sign if dialect.trailing else ""))
    if dialect.inline is not None and dialect.inline[0] < len(lines):
        lines[dialect.inline[0]] += dialect.inline[1]
    if dialect.comment is not None:
        lines.insert(*dialect.comment)
    if dialect.blank is not None:
        lines.insert(dialect.blank, "")
    if dialect.empty_rows:
        lines.append(dialect.sign * (len(cells) - 1))
    text = _join([*dialect.titles, *heading, *lines], dialect)
    text = text.rstrip("\r\n") if dialect.last_end == "none" else text + dialect.last_end
    try:
        return text.encode(dialect.encoding)
    except UnicodeEncodeError:
        return text.encode("utf-8")


def _join(lines, dialect):
    ends = ["\n", "\r\n", "\r"] if dialect.end == "mixed" else [dialect.end]
    # A carriage return before an empty line that ends with a line feed is the end of one line.
    return "".join(line + ("\n" if not line else ends[n % len(ends)]) for n, line in enumerate(lines))


def _number(value, kind):
    if kind == "repr":
        return repr(value)
    if kind in ("D", "no letter"):
        mantissa, _, exponent = f"{value:.6E}".partition("E")
        # Exponents of three digits lose their letter, as in 1.5-101; those of two keep it.
        return f"{mantissa}D{exponent}" if kind == "D" or len(exponent) < 4 else mantissa + exponent
    return f"{value:{kind}}"


def _cell(value, dialect):
    text = _number(value, dialect.number)
    digits = re.match(r"[+-]?(\d+)", text)
    if dialect.thousands and digits is not None and "e" not in text:
        text = text.replace(digits[1], f"{int(digits[1]):,}", 1)
    return text.translate(str.maketrans({".": dialect.decimal, ",": dialect.thousands or ","}))


def _quote(field, dialect, always):
    needed = any(c in field for c in (" \t" if dialect.spaces else dialect.sign))
    return f'"{field}"' if always or needed else field


def _heading(names, units, dialect):
    if dialect.header == "none":
        return []
    rows = [list(names)]
    if units is not None and dialect.header in ("[]", "()", "attached"):
        left, right = {"[]": (" [", "]"), "()": (" (", ")"), "attached": ("[", "]")}[dialect.header]
        rows = [[f"{name}{left}{unit}{right}" for name, unit in zip(names, units, strict=True)]]
    if units is not None and dialect.header in ("units below", "comment units", "units above"):
        rows.insert(0 if dialect.header == "units above" else 1, list(units))
    always = dialect.quotes in ("all", "names")
    lines = []
    for fields in rows:
        # Between names and their units there may be a space; of both together it needs no quotes.
        bare = dialect.spaces and dialect.header in ("[]", "()") and not always
        line = dialect.separator.join(f if bare else _quote(f, dialect, always) for f in fields)
        line = (dialect.sign if dialect.index else "") + line
        line += dialect.sign if dialect.trailing == "all" else ""
        lines.append((f"{dialect.mark} " if dialect.header.startswith("comment") else "") + line)
    return lines


EXAMPLES = int(os.environ.get("DIALECTS", "200"))
TIMES = ["time", "Time", "TIME", "t"]
VALUES = [0.0, -0.0, 1.0, 0.5, 1.5, 12.125, 250.0, 1500.0, -1234.5, 1234567.875, 1e-9, 1.5e-101]


def random_table(rng, dialect):
    count, rows = rng.randrange(2, 6), rng.choice([2, 3, 5, 7, 120])
    with_units = dialect.header not in ("names", "comment", "none")
    beside = dialect.header in ("[]", "()", "attached")
    # A quotation mark does not go with the unit beside a name, or a comment, where spaces separate.
    bare = dialect.spaces and (beside or dialect.header.startswith("comment"))
    names = rng.sample(NAMES if bare else NAMES + PHRASES, count - 1)
    units = None
    if with_units:
        choices = [unit for unit in UNITS if not (dialect.spaces and " " in unit)]
        if dialect.header in ("()", "attached"):
            choices = [u for u in choices if "(" not in u and (u != "furlong" or dialect.header == "()")]
        units = [rng.choice(["s", "ms", "sec"]), *(rng.choice(choices) for _ in names)]
        # Brackets at the end of a name that has a unit in brackets are the unit's.
        marked = not dialect.header.startswith(("units", "comment"))
        names = [f"{name}.u" if name[-1] in "])" and marked else name for name in names]
    step = {".3f": 0.125, ".0f": 1.0}.get(dialect.number, rng.choice([0.25, 0.5, 1.0]))
    columns = [[n * step for n in range(rows)]]
    for _ in names:
        end = [rng.choice([*VALUES, rng.uniform(-1e6, 1e6), rng.uniform(-9, 9)]) for _ in range(min(rows, 7))]
        # Numbers that are not whole may begin after a hundred rows.
        columns.append([float(n % 3) for n in range(rows - len(end))] + end)
    return [rng.choice(TIMES), *names], units, columns


def read(content, mapping=None):
    """Return unit and numbers by name, and the message of a refusal, in one line."""
    Path("a.csv").write_bytes(content)
    message = ""
    try:
        (table,), _ = read_tables([Path("a.csv")], ["a"], mapping and Mapping.model_validate(mapping))
    except TableError as error:
        message = str(error)
    assert not re.search(r"\n|\bnp\.|dtype|<class", message)
    if message:
        return {}, message
    units = {name: channel.unit or None for name, channel in table.overrides.items()}
    return {name: (units.get(name, "s"), table.values(name)) for name in table.frame}, ""


def expectation(names, units, columns, dialect):
    if dialect.header == "none":
        names = ["time", *(f"#{n + 1}" for n in range(1, len(columns)))]
    result = {}
    for name, unit, column in zip(["time", *names[1:]], units or [None] * len(names), columns, strict=True):
        texts = (_number(value, dialect.number).replace("D", "e") for value in column)
        result[name] = unit, np.array([float(re.sub(r"(?<=\d)(?=[+-]\d{3}$)", "e", text)) for text in texts])
    unit, time = result["time"]
    return result | {"time": ("s", parse_unit(unit or "s").convert(time, parse_unit("s")))}


def require_same(result, expected, message):
    assert list(result) == list(expected), message
    for name, (unit, numbers) in expected.items():
        assert result[name][0] == unit, message
        np.testing.assert_array_equal(result[name][1], numbers, message)


def check_dialect(seed):
    """Require the meant reading of a table, at once or with the keys of its refusals; True if at once."""
    rng = random.Random(seed)
    dialect = random_dialect(rng)
    names, units, columns = random_table(rng, dialect)
    content, keys = encode(names, units, columns, dialect), set()
    contents, message = read(content)
    while message:
        hint = re.search(r"state (.*) in \[dialect\]", message)
        hints = set(re.findall("separator|decimal|thousands|skip|names|comment", hint[1] if hint else ""))
        assert hints - keys, f"seed {seed}: {message} {content!r}"
        keys |= hints
        contents, message = read(content, {"dialect": statement(keys, names, units, dialect)})
    require_same(contents, expectation(names, units, columns, dialect), f"seed {seed}: {keys} {content!r}")
    return not keys


@pytest.mark.parametrize("sign", [",", ";", "\t", " "])
def test_what_is_no_number_is_refused_or_none_and_does_not_harm_the_other_column(sign):
    for entry, row in itertools.product(ENTRIES, range(1, 4)):
        if sign == " " and (not entry or " " in entry):
            continue
        lines = ["time;x;y", "0.5;1.5;2.5", "1.5;-2.5;3.5", "2.5;3.25;4.5"]
        lines[row] = f"{row - 0.5};{entry};{row + 1.5}"
        content = "\n".join([*lines, ""]).replace(";", sign).encode()
        result, message = read(content)
        assert message or not np.isfinite(result["x"][1]).all(), content
        result, message = read(content, {"compare": ["y"]})
        assert message or result["y"][1].tolist() == [2.5, 3.5, 4.5], content


@pytest.mark.parametrize(
    "seeds",
    [range(EXAMPLES), pytest.param(range(10_000, 10_000 + 5 * EXAMPLES), marks=pytest.mark.slow)],
    ids=["few", "many"],
)
def test_a_table_is_read_as_it_is_meant_or_the_refusal_names_the_key(seeds):
    """At most 30 % need a mapping: unclear tables are not guessed, but most are clear."""
    count = sum(not check_dialect(seed) for seed in seeds)
    assert count <= 0.3 * len(seeds), f"{count} of {len(seeds)} need a mapping"
