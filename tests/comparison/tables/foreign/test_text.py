"""Tables that once were misread or refused, of kinds that the random ones (test_dialects) have not."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_tables import put, read_pair, refused


@pytest.mark.parametrize(
    ("content", "names"),
    [
        ("# time, x\n0 1\n1 2\n", "x"),  # numpy's savetxt with a header of one's own
        ("TIME(Sec),x\n0,1\n1,2\n", "x"),
        ("time,T\n0,1\n1,2\n", "T"),
        ("time x1 x2\ns m2 m2\n0 1 2\n1 2 3\n", "x1 x2"),
        ("time,0,1\n0.0,1,2\n1.0,2,3\n", "0 1"),
        ("2 3\n0 1 2\n1 2 3\n", "#2 #3"),  # the number of rows and columns
        ("0,1,5\n0.5,2,6\n", "#2 #3"),
        ("time,ratio\ns,1\n0,5\n1,6\n", "ratio"),
        ("inDegrees=yes\nendheader\ntime knee\n0 1\n1 2\n", "knee"),
    ],
)
def test_a_table_as_programs_write_it_is_read_in_any_encoding(content, names):
    a, b, warnings = read_pair(put("a.csv", content), put("b.csv", content, "utf-16"))
    assert a.frame.equals(b.frame)
    assert (" ".join(a.channels), len(a.frame)) == (names, 2)
    assert any("inDegrees" in line for line in warnings) == ("inDegrees" in content)


FIELDS, BELOW = "must hold {} fields, as the first row", "line 2, below"
TITLE = "may be a row, name the columns or be a title: state decimal, thousands, names or skip"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("time;y\nms;mm\n20,5;1.2345,5\n30,5;1.2345,5\n", "not clear from '1.2345,5' and '20,5'"),
        ("3 2\n4 5\n5 6\n6 7\n", "line 1 holds 3, 2, which may be names or numbers, or a size: state skip"),
        ("time   slider pos\n0      1\n1      2\n", TITLE),
        ('time,"x\n[mm]"\n0,1\n1,2\n', BELOW),
        ("time x\n0 1\n1\n", f"line 3 {FIELDS.format(2)}, and close quotation marks: state separator"),
        ('time,x\n0,1\n1,"2\n3"\n2,3\n', f"line 3 {FIELDS.format(2)}"),
        ("time,x\n" + "".join(f"{n},1\n" for n in range(999)) + "\x00\n", "has a zero byte"),
        ("time,x\n0,1\n12:01,2\n", "'time' is not a number in line 3: '12:01'"),
        ("time,slider_y [mm each]\n0,1\n1,2\n", "unit 'mm each' does not fit the channel slider_y"),
    ],
)
def test_what_is_not_clear_is_one_line(content, words):
    refused(words, put("a.csv", content))


def test_a_column_of_text_in_parquet():
    columns = {"x": ["a", "b", "c"], "y": [True, False, True], "z": [1, 2, None]}
    pd.DataFrame({"time": [0.0, 1.0, 2.0], **columns}).to_parquet("a.parquet")
    for name, words in (("x", "'x' is not a number|row 1: 'a'"), ("y", "'y' is not a number|row 1: 'True'")):
        refused(words, Path("a.parquet"), mapping=f"compare = ['{name}']\n")
    assert np.isnan(read_pair(Path("a.parquet"), mapping="compare = ['z']\n")[0].values("z")[2])


ROWS = "0,1,5\n1,2,6\n"
NAMED = 'names = ["time", "p", "q"]'
CLOCK = 'skip = 1\nnames = ["time", "x", "flag"]\n[columns.x]\nchannel = "x"\n[channels.x]'
ZEIT = 'skip = 0\n[columns.Zeit]\nchannel = "time"\nunit = "s"\n[columns.x]\nchannel = "x"\n[channels.x]'
COMMENT = "may be a comment, a row or another heading"


@pytest.mark.parametrize(
    ("content", "words", "keys", "names", "values"),
    [
        ("time,load (left),load (right)\n" + ROWS, "column 'load' occurs twice", NAMED, "p q", [1, 2]),
        ("time,x,F\n0,1,5\n#0.5,9,9\n1,2,6\n", f"line 3 {COMMENT}", 'comment = "#"', "x F", [1, 2]),
        (
            "time,den,F\n" + ROWS + "end,of,run\n",
            "number in line 4: 'end'",
            'comment = "end"',
            "den F",
            [1, 2],
        ),
        (
            "time;x;F\n0;1.500;5\n1;2.500;6\n",
            "not clear from '1.500'",
            'thousands = "."',
            "x F",
            [1500, 2500],
        ),
        ("Zeit;x;F\n0;1;5\n1;2;6\n", f"line 1 {TITLE}", ZEIT, "x", [1, 2]),
        ("0,1,2\n0.5,3,6\n", "may be names or numbers", "names = []", "#2 #3", [1, 3]),
        ("time|x|F\n0|1|5\n1|2|6\n", "contains no row of two or more", 'separator = "|"', "x F", [1, 2]),
        ("2024 11 28\n12 30 45\ntime x F\n0 1 5\n1 2 6\n", "number in line 3", "skip = 2", "x F", [1, 2]),
        ("clock;x;flag\n0;1;no\n1;2;yes\n", "contains no row", CLOCK, "x", [1, 2]),
    ],
)
def test_what_has_two_readings_is_read_once_a_mapping_states_the_key(content, words, keys, names, values):
    path = put("a.csv", content)
    refused(words, path)
    table, _, _ = read_pair(path, mapping=f"[dialect]\n{keys}")
    assert (" ".join(table.channels), table.values(table.channels[0]).tolist()) == (names, values)


def test_a_dialect_may_be_that_of_one_table():
    a, b = put("a.csv", "time;x\n0;1.500\n1;2.500\n"), put("b.csv", "time|x\n0|1,5\n1|2,5\n")
    stated = '[dialect]\ndecimal = "."\n[dialect.b]\nseparator = "|"\ndecimal = ","'
    first, second, _ = read_pair(a, b, stated)
    assert first.frame.equals(second.frame)
