"""One table in the dialects of all programs: the same names, units and numbers, or one line and exit code 2.

The number of examples is DIALECTS, else a few.
"""

import os
import re
from pathlib import Path

import numpy as np
from dialects import ENTRIES, NAMES, SPACED, UNITS, dialects, meant, written
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st

from comparison.tables.foreign import read_tables
from comparison.tables.mapping import Mapping
from comparison.tables.table import TableError
from comparison.tables.units import parse

EXAMPLES = int(os.environ.get("DIALECTS", "100"))
many = settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
TIMES = st.sampled_from(["time", "Time", "TIME", "t"])
VALUES = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, 0.5, 1.5, 12.125, 250.0, 1500.0, -1234.5, 1234567.875, 1e-9, 1.5e-101]),
    st.floats(-1e6, 1e6).filter(lambda value: value == 0 or abs(value) > 1e-200),
)
ALWAYS = r"a point or a comma is the decimal sign is not clear from"
"""What a table may be refused for that has names and nothing but numbers."""
NAMELESS = (
    "which may be names or numbers|begins like a row of numbers|has tabs and spaces between its numbers|"
    "may be a row, or the size of the table"
)


@st.composite
def tables(draw, dialect):
    """Draw names, units and columns, the time first, as this dialect can hold them."""
    count, rows = draw(st.integers(2, 5)), draw(st.sampled_from([2, 3, 5, 7, 120]))
    with_units = dialect.header not in ("names", "comment", "none")
    beside = with_units and dialect.header in ("[]", "()", "attached")
    # A quotation mark does not go with the unit beside a name, or a comment, where spaces separate.
    bare = dialect.spaces and (beside or dialect.header.startswith("comment"))
    names = draw(st.permutations(NAMES if bare else NAMES + SPACED))[: count - 1]
    units = None
    if with_units:
        known = [unit for unit in UNITS if not (dialect.spaces and " " in unit)]
        if dialect.header in ("()", "attached"):
            known = [u for u in known if "(" not in u and (u != "furlong" or dialect.header == "()")]
        units = [draw(st.sampled_from(["s", "ms", "sec"])), *(draw(st.sampled_from(known)) for _ in names)]
        # Brackets at the end of a name that has a unit in brackets are the unit's.
        marked = "below" not in dialect.header
        names = [f"{name}.u" if name[-1] in "])" and marked else name for name in names]
    step = {".3f": 0.125, ".0f": 1.0}.get(dialect.number, draw(st.sampled_from([0.25, 0.5, 1.0])))
    columns = [[n * step for n in range(rows)]]
    for _ in names:
        own = draw(st.lists(VALUES, min_size=min(rows, 7), max_size=min(rows, 7)))
        # What is not whole may begin after a hundred rows.
        columns.append([float(n % 3) for n in range(rows - len(own))] + own)
    return [draw(TIMES), *names], units, columns


Contents = dict[str, tuple[str | None, np.ndarray]]
"""Unit and numbers by name."""


def read(content, compare=None):
    """Return what a table holds, or why it is refused, in one line."""
    Path("a.csv").write_bytes(content)
    tables, message = [], ""
    try:
        tables, _ = read_tables([Path("a.csv")], ["a"], compare and Mapping(compare=compare))
    except TableError as error:
        message = str(error)
    note(message)
    assert not re.search(r"\n|\bnp\.|dtype|<class", message)
    units = {name: channel.unit or None for table in tables for name, channel in table.own.items()}
    return {n: (units.get(n, "s"), table.values(n)) for table in tables for n in table.frame}, message


def wanted(names, units, columns, dialect):
    if dialect.header == "none":
        names = ["time", *(f"#{n + 1}" for n in range(1, len(columns)))]
    result = {
        name: (None if units is None else units[n], np.array([meant(value, dialect) for value in column]))
        for n, (name, column) in enumerate(zip(["time", *names[1:]], columns, strict=True))
    }
    return result | {"time": ("s", parse(units[0] if units else "s").convert(result["time"][1], parse("s")))}


def same(result, expected):
    assert list(result) == list(expected)
    for name, (unit, numbers) in expected.items():
        assert result[name][0] == unit
        np.testing.assert_array_equal(result[name][1], numbers)


@many
@given(data=st.data(), dialect=dialects())
def test_a_table_is_read_as_it_is_meant_or_refused_in_one_line(data, dialect):
    names, units, columns = data.draw(tables(dialect))
    content = written(names, units, columns, dialect)
    note(repr(content))
    contents, message = read(content)
    if message:
        assert re.search(f"{ALWAYS}|{NAMELESS}" if dialect.header == "none" else ALWAYS, message)
    else:
        same(contents, wanted(names, units, columns, dialect))


@many
@given(data=st.data(), dialect=dialects(), entry=st.sampled_from(ENTRIES))
def test_what_is_no_number_is_refused_and_does_not_harm_the_other_columns(data, dialect, entry):
    names, units, columns = data.draw(tables(dialect))
    place, row = data.draw(st.integers(1, len(columns) - 1)), data.draw(st.integers(0, len(columns[0]) - 1))
    if dialect.spaces and (not entry or " " in entry):
        return
    content = written(names, units, columns, dialect, (place, row, entry))
    note(repr(content))
    expected = wanted(names, units, columns, dialect)
    name = list(expected)[place]
    result, message = read(content)
    assert message or not np.isfinite(result[name][1]).all()
    others = {other: value for other, value in expected.items() if other != name}
    if len(others) > 1:
        result, message = read(content, [other for other in others if other != "time"])
        if not message:
            same(result, others)
