"""Excel workbooks: numbers arrive bit for bit, what is ambiguous or damaged is one line."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from foreign_tables import FRAME, put, read_pair
from openpyxl import Workbook

from comparison.cli import main
from comparison.tables.formats import open_source
from comparison.tables.mapping import Mapping
from comparison.tables.table import Table, TableError

FILE = Path("run.xlsx")
NAMES = list(FRAME)
EXACT = FRAME.round(9)  # openpyxl writes 16 digits: too few for some doubles
ROWS = EXACT.to_numpy().tolist()


def workbook(*rows: list[object], more: dict[str, list[list[object]]] | None = None) -> None:
    book = Workbook()
    for name, content in {"Table": list(rows), **(more or {})}.items():
        sheet = book.active if name == "Table" else book.create_sheet()
        sheet.title = name
        for row in content:
            sheet.append(row)
    book.save(FILE)


def read() -> tuple[Table, tuple[str, ...]]:
    table, _, warnings = read_pair(FILE, FILE)
    return table, warnings


@pytest.mark.parametrize("head", [[NAMES], [["Adams/PostProcessor"], [], NAMES], [["run", None, 7.0], NAMES]])
def test_numbers_arrive_bit_for_bit_below_titles_and_above_a_blank_row(head):
    workbook(*head, *ROWS, [None], more={"Notes": [["made by", "hand"], [1.0]]})
    table, _ = read()
    assert list(table.frame) == NAMES
    for name in NAMES:
        assert table.values(name).tobytes() == EXACT[name].to_numpy().tobytes()


@pytest.mark.parametrize("units", [["ms", "mm", "deg"], ["[ms]", "[mm]", "[deg]"]])
def test_units_below_the_names(units):
    workbook(NAMES, units, *ROWS)
    table, _ = read()
    np.testing.assert_allclose(table.time, EXACT["time"] / 1e3, rtol=1e-15)
    np.testing.assert_allclose(table.values("slider_angle"), np.radians(EXACT["slider_angle"]), rtol=1e-15)


def test_columns_without_names_are_numbered_and_may_begin_anywhere():
    workbook([], *([None, None, *row] for row in ROWS))
    table, warnings = read()
    assert list(table.frame) == ["time", "#2", "#3"]
    assert "columns without names" in warnings[0]


def test_a_workbook_and_a_table_compare():
    workbook(NAMES, *ROWS)
    EXACT.to_csv("run.csv", index=False)
    assert main(["compare", "run.xlsx", "run.csv", "--tolerance", "1e-12"]) == 0
    workbook(NAMES, *ROWS[:5], [ROWS[5][0], ROWS[5][1] + 1e-3, ROWS[5][2]], *ROWS[6:])
    assert main(["compare", "run.xlsx", "run.csv", "--tolerance", "1e-3"]) == 1


@pytest.mark.parametrize(
    ("rows", "rule"),
    [
        ([NAMES, *ROWS[:3], [0.0, "late", 1.0]], "column 'slider_y' is not a number in data row 4: 'late'"),
        ([NAMES, *ROWS[:3], [0.0, True, 1.0]], "column 'slider_y' is not a number in data row 4: 'True'"),
        ([NAMES, *ROWS[:3], ["run 2"], *ROWS], "column 'time' is not a number in data row 4: 'run 2'"),
        (
            [["time", "slider_y"], *ROWS],
            "line 2 holds 3 numbers, but line 1 names 2: each column needs a name",
        ),
        ([["time", "q", "q"], *ROWS], "column 'q' occurs twice"),
        ([["time", "slider_y"], ["0.1", "0.2"]], "no sheet contains a row of two or more numbers"),
    ],
)
def test_a_sheet_that_is_no_table_is_one_line(rows, rule):
    workbook(*rows)
    with pytest.raises(TableError, match=rule) as refused:
        read()
    assert "\n" not in str(refused.value)


def test_an_empty_cell_is_no_number(capsys):
    workbook(NAMES, *ROWS[:3], [ROWS[3][0], None, ROWS[3][2]], *ROWS[4:])
    assert main(["compare", str(FILE), str(FILE), "--tolerance", "1"]) == 2
    assert "slider_y" in capsys.readouterr().err


def test_a_column_of_text_can_be_left_out_and_digits_as_text_are_no_number():
    names = [*NAMES, "contact\nof the corner"]
    workbook(
        names, *([*row, contact] for row, contact in zip(ROWS, ["no", "yes", None, *"12345678"], strict=True))
    )
    with pytest.raises(TableError, match="'contact of the corner' is not a number in data row 1: 'no'"):
        read()
    table, _, warnings = read_pair(FILE, FILE, Mapping(compare=["slider_y", "slider_angle"]))
    assert table.values("slider_y").tobytes() == EXACT["slider_y"].to_numpy().tobytes()
    assert "contact of the corner" in warnings[0]
    workbook(NAMES, *ROWS[:3], [0.004, "1.500", 1.0])
    with pytest.raises(TableError, match="'slider_y' is not a number in data row 4"):
        read()


def test_of_two_sheets_with_numbers_neither_is_taken():
    workbook(NAMES, *ROWS, more={"Run 2": [NAMES, *ROWS]})
    with pytest.raises(TableError, match="sheets 'Table' and 'Run 2' hold numbers: save one per file"):
        read()


def test_without_openpyxl_the_line_says_what_to_do(monkeypatch):
    workbook(NAMES, *ROWS)
    monkeypatch.setitem(sys.modules, "openpyxl", None)  # its import fails
    with pytest.raises(TableError, match=r"sixbar-crossval\[excel\].* to read it, or save its sheet as CSV$"):
        read()


@pytest.mark.parametrize("cut", [4, 100, 0.5, 0.9])
def test_a_damaged_workbook_is_one_line(cut):
    workbook(NAMES, *ROWS)
    whole = FILE.read_bytes()
    put(str(FILE), whole[: cut if isinstance(cut, int) else int(cut * len(whole))])
    with pytest.raises(TableError, match=r"^run\.xlsx: is not a readable \.xlsx workbook: save its sheet as"):
        read()


def test_a_workbook_that_is_small_only_while_packed_is_refused(monkeypatch):
    workbook(NAMES, *ROWS)
    packed = FILE.stat().st_size
    monkeypatch.setattr("comparison.tables.formats.LARGEST", packed)
    with pytest.raises(TableError, match=rf"run.xlsx: holds more than {packed} bytes once it is unpacked"):
        open_source(FILE)
