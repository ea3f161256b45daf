"""Tables that once were misread or refused, and their kin: what `sixbar compare` makes of them."""

import re
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_tables import put, read_pair, refused, text

from comparison.cli import main


def compared(capsys, a, b, *options):
    """The exit code of a comparison, and what it says; bad input is one line and makes no report."""
    code = main(["compare", str(a), str(b), "--tolerance", "1e-2", "--out", "out", *options])
    out, err = capsys.readouterr()
    assert not re.search(r"np\.|Traceback|internal error", out + err)
    if code == 2:
        assert out == ""
        assert len([line for line in err.splitlines() if "warning" not in line]) == 1
    return code, " ".join((out + err).split())


@pytest.mark.parametrize(
    ("content", "names"),
    [
        ("# time, x\n0 1\n1 2\n", "x"),  # numpy's savetxt with a header of one's own
        ("#\n# time x\n#\n0 1\n1 2\n", "x"),
        ('time   "slider pos"\n0      1\n1      2\n', "slider pos"),
        ("TIME(Sec),x\n0,1\n1,2\n", "x"),
        ("time,T\n0,1\n1,2\n", "T"),
        (",time,x\n0,0.0,1\n1,0.5,2\n", "x"),  # pandas with an index that counts
        ("time x1 x2\ns m2 m2\n0 1 2\n1 2 3\n", "x1 x2"),
        ("time,0,1\n0.0,1,2\n1.0,2,3\n", "0 1"),
        ("2 3\n0 1 2\n1 2 3\n", "#2 #3"),  # the number of rows and columns
        ("0,1,5\n0.5,2,6\n", "#2 #3"),
        ("time,ratio\ns,1\n0,5\n1,6\n", "ratio"),
        ("inDegrees=yes\nendheader\ntime knee\n0 1\n1 2\n", "knee"),
    ],
)
def test_a_table_as_programs_write_it_is_read_in_any_encoding(content, names):
    path = put("a.csv", content)
    a, b, warnings = read_pair(path, put("b.csv", content, "utf-16"))
    assert a.frame.equals(b.frame)
    assert (" ".join(a.channels), len(a.frame)) == (names, 2)
    assert any("inDegrees" in line for line in warnings) == ("inDegrees" in content)


FIELDS, BELOW = "must hold {} fields, as the first row", "line 2, below"
TITLE = "may be a row, name the columns or be a title: state decimal, thousands, names or skip"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            "time;y\nms;mm\n20,5;1.2345,5\n30,5;1.2345,5\n",
            "not clear from '1.2345,5' and '20,5': state decimal",
        ),
        (",0,1\n0.5,0.6,0.7\n1,0.7,0.8\n", "line 1 holds 0, 1, which may be names or numbers"),
        ("3 2\n4 5\n5 6\n6 7\n", "line 1 holds 3, 2, which may be names or numbers, or a size: state skip"),
        ("time   slider pos\n0      1\n1      2\n", TITLE),
        ("# time   slider pos\n0 1\n1 2\n", TITLE),
        ("# rows: 2\n# columns: 2\n 0 1\n 1 2\n", "line 2 may be a comment, a row or another heading"),
        ('time,"x\n[mm]"\n0,1\n1,2\n', BELOW),
        ("time x\n² ³\n0 1\n", BELOW),
        ("time x\n0 1\n1\n", f"line 3 {FIELDS.format(2)}, and close quotation marks: state separator"),
        ('time,x\n0,1\n1,"2\n3"\n2,3\n', f"line 3 {FIELDS.format(2)}"),
        ('time,x,y\n0,1,a"b\n1,2,"c\n2,3,d\n', f"line 2 {FIELDS.format(3)}"),
        ("time;x;y\n0; #N/A ;1\n1;2;2\n", BELOW),
        ("time,x\n" + "".join(f"{n},1\n" for n in range(999)) + "\x00\n", "has a zero byte"),
        ("time,x\n12:00,1\n12:01,2\n", "contains no row of two or more numbers"),
        ("time,x\n0,1\n12:01,2\n", "'time' is not a number in line 3: '12:01'"),
        ("0,1,false\n1,2,5\n2,3,6\n", TITLE),
        ("0\t5 2\n1\t2 3\n", "line 1 has tabs and spaces between its numbers"),
        ("time,slider_y [mm each]\n0,1\n1,2\n", "unit 'mm each' does not fit the channel slider_y"),
    ],
)
def test_what_is_not_clear_is_one_line(content, words):
    refused(words, put("a.csv", content))


def test_units_that_are_none_are_told_apart_by_a_mapping_as_the_message_says(capsys):
    put("a.csv", "time,U [V]\n0,1\n1,2\n")
    put("b.csv", "time,U [mV]\n0,1\n1,2\n")
    code, said = compared(capsys, "a.csv", "b.csv")
    assert code == 2
    section = re.search(r"with (\[channels\.\S+\]) and its (unit = )", said)
    put("map.toml", f'{section[1]}\n{section[2]}"N"\n')
    assert compared(capsys, "a.csv", "b.csv", "--mapping", "map.toml")[0] == 0


def test_names_of_another_program_are_escaped_in_the_report(capsys):
    put("one.csv", text("time [ms];<b>y</b> [mm];slider_angle [deg]", ";", ","))
    put("two.csv", text("time,<b>y</b>,slider_angle\nms,mm,deg"))
    assert compared(capsys, "one.csv", "two.csv")[0] == 0
    html = Path("out/report.html").read_text("utf-8")
    assert "taken from two.csv" in html
    assert "&lt;b&gt;y&lt;/b&gt;" in html
    assert "<b>y</b>" not in html


def test_many_lines_without_numbers_are_passed_over_at_once():
    """Twice as many take twice as many lines of Python, not four times."""
    counts, before = Counter(), sys.gettrace()

    def trace(_frame, event, _argument):
        counts[lines] += event == "line"
        return trace

    for lines in (2_000, 4_000):
        put(f"{lines}.txt", "a\n# time b\n" * lines + "time x\n0 1\n1 2\n")
        sys.settrace(trace)
        try:
            read_pair(Path(f"{lines}.txt"))
        finally:
            sys.settrace(before)
    assert counts[4_000] < 2.1 * counts[2_000]


def test_a_column_of_text_in_parquet():
    columns = {"x": ["a", "b", "c"], "y": [True, False, True], "z": [1, 2, None]}
    pd.DataFrame({"time": [0.0, 1.0, 2.0], **columns}).to_parquet("a.parquet")
    for name, words in (("x", "'x' is not a number|row 1: 'a'"), ("y", "'y' is not a number|row 1: 'True'")):
        refused(words, Path("a.parquet"), mapping=f"compare = ['{name}']\n")
    assert np.isnan(read_pair(Path("a.parquet"), mapping="compare = ['z']\n")[0].values("z")[2])
    pd.DataFrame({"time [ms]": [0.0, 1.0], "x": [1.0, 2.0]}).to_parquet("b.parquet")
    refused("channel time is missing; columns: time [ms], x", Path("b.parquet"))  # it states no units


ROWS = "0,1,5\n1,2,6\n"
SPACED = ROWS.replace(",", " ")
NAMED, HASH = 'names = ["time", "p", "q"]', 'comment = "#"'
CLOCK = 'skip = 1\nnames = ["time", "x", "flag"]\n[columns.x]\nchannel = "x"\n[channels.x]'
ZEIT = 'skip = 0\n[columns.Zeit]\nchannel = "time"\nunit = "s"\n[columns.x]\nchannel = "x"\n[channels.x]'
COMMENT = "may be a comment, a row or another heading"
STATED = [  # content, words of the refusal, what a mapping states, names, values of the second column
    # Columns of several levels
    (",b1,b2\n,x,x\ntime,,\n" + ROWS, "line 1, above the names, may be names", NAMED, "p q", [1, 2]),
    ("body,left,right\ntime,x,y\n" + ROWS, "line 1, above the names, may be", "skip = 1", "x y", [1, 2]),
    ("time,load (left),load (right)\n" + ROWS, "column 'load' occurs twice", NAMED, "p q", [1, 2]),
    # Units
    ("# s mm N\n# time x F\n" + SPACED, "line 1, above the names", "skip = 1", "x F", [1, 2]),
    # What may be a comment
    ("time,x,F\n0,1,5\n#0.5,9,9\n1,2,6\n", f"line 3 {COMMENT}", HASH, "x F", [1, 2]),
    ("#0 9 9\n" + SPACED, f"line 1 {COMMENT}", HASH, "#2 #3", [1, 2]),
    ("time,x,F\n0,1,5\n#N/A,#N/A,#N/A\n1,2,6\n", f"line 3 {COMMENT}", HASH, "x F", [1, 2]),
    ("time x F\n0 1 5\n% s m N\n1 2 6\n", f"line 3 {COMMENT}", 'comment = "%"', "x F", [1, 2]),
    ("time,den,F\n" + ROWS + "end,of,run\n", "number in line 4: 'end'", 'comment = "end"', "den F", [1, 2]),
    # Numbers
    ("time;x;F\n0;1.500;5\n1;2.500;6\n", "not clear from '1.500'", 'decimal = "."', "x F", [1.5, 2.5]),
    ("time;x;F\n0;1.500;5\n1;2.500;6\n", "not clear from '1.500'", 'thousands = "."', "x F", [1500, 2500]),
    # Names, rows, separators
    ("time x F\n---- ---- ----\n" + SPACED, BELOW, NAMED, "p q", [1, 2]),
    ("Zeit;x;F\n0;1;5\n1;2;6\n", f"line 1 {TITLE}", ZEIT, "x", [1, 2]),
    (",x,F\n0.0,1,5\n0.5,2,6\n", f"line 1 {TITLE}", "skip = 0", "x F", [1, 2]),  # an index of pandas
    ("0,1,2\n0.5,3,6\n", "may be names or numbers", "names = []", "#2 #3", [1, 3]),
    ("time|x|F\n0|1|5\n1|2|6\n", "contains no row of two or more", 'separator = "|"', "x F", [1, 2]),
    ("0 1\t5\n1 2\t6\n", "tabs and spaces", 'separator = " "', "#2 #3", [1, 2]),
    ("2024 11 28\n12 30 45\ntime x F\n" + SPACED, "not a number in line 3", "skip = 2", "x F", [1, 2]),
    ("clock;x;flag\n0;1;no\n1;2;yes\n", "contains no row", CLOCK, "x", [1, 2]),
]  # fmt: skip


@pytest.mark.parametrize(("content", "words", "keys", "names", "values"), STATED)
def test_what_has_two_readings_is_read_once_a_mapping_states_the_key(content, words, keys, names, values):
    path = put("a.csv", content)
    refused(words, path)
    table, _, _ = read_pair(path, mapping=f"[dialect]\n{keys}")
    assert (" ".join(table.channels), table.values(table.channels[0]).tolist()) == (names, values)


def test_a_dialect_may_be_that_of_one_table():
    a, b = put("a.csv", "time;x\n0;1.500\n1;2.500\n"), put("b.csv", "time|x\n0|1,5\n1|2,5\n")
    first, second, _ = read_pair(
        a, b, '[dialect]\ndecimal = "."\n[dialect.b]\nseparator = "|"\ndecimal = ","'
    )
    assert first.frame.equals(second.frame)
