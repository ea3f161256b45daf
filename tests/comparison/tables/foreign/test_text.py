"""Tables that once were misread or refused, and their kin: what `sixbar compare` makes of them."""

import re
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
        ("% time; x\n0;1\n1;2\n", "x"),
        ("# time, x\n0 1\n1 2\n", "x"),  # numpy's savetxt with a header of one's own
        ("#\n# time x\n#\n0 1\n1 2\n", "x"),
        ('time   "slider pos"\n0      1\n1      2\n', "slider pos"),
        ("time x\n---- ----\n0 1\n1 2\n", "x"),
        ("TIME(Sec),x\n0,1\n1,2\n", "x"),
        ("time,T\n0,1\n1,2\n", "T"),
        ("time,t\n0,1\n1,2\n", "t"),
        (",x\n0.0,1\n0.5,2\n", "x"),  # pandas with the time as the index
        ("time,x,\n0,1\n1,2\n", "x"),
        ("time x1 x2\ns m2 m2\n0 1 2\n1 2 3\n", "x1 x2"),
        ("time,0,1\n0.0,1,2\n1.0,2,3\n", "0 1"),
        ("# rows: 2\n# columns: 2\n 0 1\n 1 2\n", "#2"),  # Octave's text
        ("sep=;\ntime;x\n0;1,5\n1;2\n", "x"),
        ("2 3\n0 1 2\n1 2 3\n", "#2 #3"),  # the number of rows and columns
        ("time,ratio\ns,1\n0,5\n1,6\n", "ratio"),
        ("time x\n0 1\t# impact\n1 2\n", "x"),
    ],
)
def test_a_table_as_programs_write_it_is_read_in_any_encoding(content, names):
    path = put("a.csv", content)
    for encoding in ("utf-16", "utf-8-sig"):
        a, b, _ = read_pair(path, put("b.csv", content, encoding))
        assert a.frame.equals(b.frame)
        assert (" ".join(a.channels), len(a.frame)) == (names, 2)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("time;x\n0;1.500\n1;2.500\n", "decimal sign is not clear from '1.500'"),
        ("time;x\n0;1,500\n1;2,500\n", "decimal sign is not clear from '1,500'"),
        ("time\tx\n0\t0,5\n1\t0.5\n", "decimal sign is not clear from '0.5' and '0,5'"),
        ("time;x\n" + "0;0\n" * 200 + "200;1,500\n201;2.5\n", "not clear from '2.5' and '1,5"),
        (",0,1\n0.5,0.6,0.7\n1,0.7,0.8\n", "line 1 holds 0, 1, which may be names or numbers"),
        ("3 2\n4 5\n5 6\n6 7\n", "line 1 holds 3, 2, which may be a row, or the size of the table"),
        (
            "time   slider pos\n0      1\n1      2\n",
            "the rows hold 2 numbers, but line 1 names 3: state names",
        ),
        ("# time   slider pos\n0 1\n1 2\n", "the rows hold 2 numbers, but line 1 names 3: state names"),
        ('time,"x\n[mm]"\n0,1\n1,2\n', "line 2, below the names, is neither units nor a row"),
        (
            "time x\n0 1\n1\n",
            "line 3 must hold 2 fields, as line 2, and close quotation marks: state separator",
        ),
        ("time,x\n0,1\n1,2,3\n", "line 3 must hold 2 fields, as line 2"),
        ('time,x\n0,1\n1,"2\n3"\n2,3\n', "line 3 must hold 2 fields, as line 2, and close quotation marks"),
        (
            'time,x,y\n0,1,a"b\n1,2,"c\n2,3,d\n',
            "line 2 must hold 3 fields, as line 2, and close quotation marks",
        ),
        ("time,x\n" + "".join(f"{n},1\n" for n in range(999)) + "\x00\n", "has a zero byte"),
        ("12:00,1\n12:01,2\n", "contains no row of two or more numbers"),
        ("time,x\n0,1\n12:01,2\n", "'time' is not a number in line 3: '12:01'"),
        ("time,x\n12:00,1\n12:01,2\n", "contains no row of two or more numbers"),
        ("0,1,false\n1,2,5\n2,3,6\n", "line 1 begins like a row of numbers, but is none"),
        ("0\t5 2\n1\t2 3\n", "line 1 has tabs and spaces between its numbers"),
        ("time,slider_y [mm each]\n0,1\n1,2\n", "'slider_y': unit 'mm each' is not known"),
        (",\n0,\n1,\n", "channel time is missing"),
        ("time x\n² ³\n0 1\n", "line 2, below the names, is neither units nor a row"),
        ("time;x;y\n0; #N/A ;1\n1;2;2\n", "'x' is not a number in line 2: '#N/A'"),
        ("time,slider_y\n0,1,2\n1,2,3\n", "the rows hold 3 numbers, but line 1 names 2: state names"),
        ("x;y\nms;mm\n20,5;1.2345,5\n30,5;1.2345,5\n", "not clear from '1.2345,5' and '20,5': state decimal"),
    ],
)
def test_what_is_not_clear_is_one_line(content, words):
    refused(words, put("a.csv", content))


def test_a_plus_beside_an_exponent_of_fortran_costs_no_digit():
    table, _, _ = read_pair(put("a.txt", "time x\n0 +912.7555772777217\n1 1.5D0\n"))
    assert table.values("x").tolist() == [912.7555772777217, 1.5]


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
    put("two.csv", text("time,slider_y,slider_angle\nms,mm,deg"))
    put("map.toml", '[a."<b>y</b>"]\nchannel = "slider_y"\n')
    assert compared(capsys, "one.csv", "two.csv", "--mapping", "map.toml")[0] == 0
    html = Path("out/report.html").read_text("utf-8")
    assert "taken from two.csv" in html
    assert "&lt;b&gt;y&lt;/b&gt;" in html
    assert "<b>y</b>" not in html


@pytest.mark.parametrize(
    ("step", "words"), [(0.01, "1700000000.07"), (1e-4, "1700000000.0007"), (2.0, "1700000014")]
)
def test_times_since_an_epoch_are_told_apart(step, words, capsys):
    for name, error in (("a", 0.0), ("b", 1.0)):
        rows = (f"{1.7e9 + n * step!r},{n % 5 + error * (n == 7)}\n" for n in range(20))
        put(f"{name}.csv", "time,x\n" + "".join(rows))
    code, said = compared(capsys, "a.csv", "b.csv")
    assert code == 1
    assert f"at worst at t = {words} s" in said
    again = Path("a.csv").read_text().replace(f"{1.7e9 + 8 * step!r}", f"{1.7e9 + 7 * step!r}")
    refused(f"time {words}|s is repeated in data row 9", put("again.csv", again))


def test_many_lines_without_numbers_are_passed_over_at_once(lines_run):
    """Twice as many take twice as long, not four times."""
    for name, lines in (("a", 2_000), ("b", 4_000)):
        put(f"{name}.txt", "a\n# time b\n" * lines + "time x\n0 1\n1 2\n")
    small, large = (lines_run(lambda file=name: read_pair(Path(f"{file}.txt"))) for name in "ab")
    assert large < 2.1 * small


def test_a_column_of_text_in_parquet():
    columns = {"x": ["a", "b", "c"], "y": [True, False, True], "z": [1, 2, None]}
    pd.DataFrame({"time": [0.0, 1.0, 2.0], **columns}).to_parquet("a.parquet")
    for name, words in (("x", "'x' is not a number|row 1: 'a'"), ("y", "'y' is not a number|row 1: 'True'")):
        refused(words, Path("a.parquet"), mapping=f"compare = ['{name}']\n")
    assert np.isnan(read_pair(Path("a.parquet"), mapping="compare = ['z']\n")[0].values("z")[2])


ROWS = "0,1,5\n1,2,6\n"
SPACED = ROWS.replace(",", " ")
NAMED, HASH = 'names = ["time", "p", "q"]', 'comment = "#"'
CLOCK = 'skip = 1\nnames = ["time", "x", "flag"]\n[columns.x]\nchannel = "x"\n[channels.x]'
STATED = [  # content, words of the refusal, what a mapping states, names, values of the second column
    # Columns of several levels
    (",b1,b2\n,x,x\ntime,,\n" + ROWS, "line 1, above the names, may be names", NAMED, "p q", [1, 2]),
    ("time,b1,b1\n,x,y\n" + ROWS, "line 2, below the names, is neither units nor", NAMED, "p q", [1, 2]),
    ("body,left,right\ntime,x,y\n" + ROWS, "line 1, above the names, may be", "skip = 1", "x y", [1, 2]),
    ("time\tb1\tb2\nstep\tx\tx\n" + ROWS.replace(",", "\t"), "line 2, below the names", NAMED, "p q", [1, 2]),
    ("time,x,x\n" + ROWS, "column 'x' occurs twice", NAMED, "p q", [1, 2]),
    ("time,load (left),load (right)\n" + ROWS, "column 'load' occurs twice", NAMED, "p q", [1, 2]),
    # Units
    ("s,mm,N\ntime,x,F\n" + ROWS, "line 1, above the names", NAMED, "p q", [1, 2]),
    ("# s mm N\n# time x F\n" + SPACED, "line 1, above the names", "skip = 1", "x F", [1, 2]),
    ("time,x [mm],F\ns,in,N\n" + ROWS, "'x' states 'mm' beside its name and 'in'", NAMED, "p q", [1, 2]),
    ("time (s) x (m) F (N)\nms mm N\n" + SPACED, "'time' states 's' beside", NAMED, "p q", [1, 2]),
    ("time x F\ns mm N\n[s] [m] [N]\n" + SPACED, "line 3, below the names, holds", NAMED, "p q", [1, 2]),
    # What may be a comment
    ("time,x,F\n0,1,5\n#0.5,9,9\n1,2,6\n", "line 3 may be a comment or a row", HASH, "x F", [1, 2]),
    ("time x F\n%0.5 9 9\n" + SPACED, "line 2 may be a comment or a row", 'comment = "%"', "x F", [1, 2]),
    ("time;x;F\n0;1;5\n!;9;9\n1;2;6\n", "line 3 may be a comment or a row", 'comment = "!"', "x F", [1, 2]),
    ("#0 9 9\n" + SPACED, "line 1 may be a comment or a row", HASH, "#2 #3", [1, 2]),
    ("time,x,F\n0,1,5\n#N/A,#N/A,#N/A\n1,2,6\n", "line 3 may be", HASH, "x F", [1, 2]),
    ("time x F\n0 1 5\n# time y F\n1 2 6\n", "line 3 may be a comment or another", HASH, "x F", [1, 2]),
    ("# time x F\n0 1 5\n# time x F\n1 2 6\n", "line 3 may be a comment or another", HASH, "x F", [1, 2]),
    ("time x F\n0 1 5\n% s m N\n1 2 6\n", "line 3 may be a comment", 'comment = "%"', "x F", [1, 2]),
    ("time,den,F\n" + ROWS + "end,of,run\n", "number in line 4: 'end'", 'comment = "end"', "den F", [1, 2]),
    # Numbers
    ("time;x;F\n0;1.500;5\n1;2.500;6\n", "not clear from '1.500'", 'decimal = "."', "x F", [1.5, 2.5]),
    ("time;x;F\n0;1.500;5\n1;2.500;6\n", "not clear from '1.500'", 'thousands = "."', "x F", [1500, 2500]),
    ("time;x;F\n0;1.500,5;5\n1;2,5;6\n", "'1.500,5'", 'thousands = "."', "x F", [1500.5, 2.5]),
    ("time;x;F\n0;1 500;5\n1;2;6\n", "'x' is not a number in line 2", 'thousands = " "', "x F", [1500, 2]),
    ('time,x,F\n0,"1,500",5\n1,"2,500",6\n', "not clear from '1,500'", 'decimal = ","', "x F", [1.5, 2.5]),
    ('time,x,F\n0,"1,500.5",5\n115,250,6\n', "not clear", 'thousands = ","', "x F", [1500.5, 250]),
    ("time\tx\tF\n0\t1,500.5\t5\n1\t2\t6\n", "not clear", 'thousands = ","', "x F", [1500.5, 2]),
    # Names, rows, separators
    ("0,1,5\n0.5,2,6\n", "", "", "#2 #3", [1, 2]),
    ("0,1,2\n0.5,3,6\n", "may be names or numbers", "names = []", "#2 #3", [1, 3]),
    ("time|x|F\n0|1|5\n1|2|6\n", "contains no row of two or more", 'separator = "|"', "x F", [1, 2]),
    ("0 1\t5\n1 2\t6\n", "tabs and spaces", 'separator = " "', "#2 #3", [1, 2]),
    ("2024 11 28\n12 30 45\ntime x F\n" + SPACED, "not a number in line 3", "skip = 2", "x F", [1, 2]),
    ("clock;x;flag\n0;1;no\n1;2;yes\n", "contains no row", CLOCK, "x", [1, 2]),
]  # fmt: skip


@pytest.mark.parametrize(("content", "words", "keys", "names", "values"), STATED)
def test_what_has_two_readings_is_read_once_a_mapping_states_the_key(content, words, keys, names, values):
    path = put("a.csv", content)
    if words:
        refused(words, path)
    table, _, _ = read_pair(path, mapping=f"[dialect]\n{keys}")
    assert (" ".join(table.channels), table.values(table.channels[0]).tolist()) == (names, values)


TITLES = [
    "Simulation time 10 s\nStep size 0.01 s", "Date;2024-11-28\nTime;13:05:00\nSamples;3\nRate;100",
    "Time of the run\nto time", "time 5", "t 5 x", "Run time: 7\n# time to go 3",
    "Elapsed time 10 s\nStep 1 2 s",
]  # fmt: skip


@pytest.mark.parametrize("titles", TITLES)
@pytest.mark.parametrize("separator", [" ", ",", ";", "\t"])
def test_lines_with_the_word_time_are_titles_unless_they_name_the_rows_below(titles, separator):
    table, _, _ = read_pair(put("a.csv", titles + "\ntime x y z\n0 1 2 3\n1 2 3 4\n".replace(" ", separator)))
    assert (table.channels, table.values("z").tolist()) == (["x", "y", "z"], [3.0, 4.0])


@pytest.mark.parametrize(
    ("start", "end"),
    [("", "\x1a"), ("", "\n\x1a\n"), ("\ufeff", "\x1a\x1a"), ("\ufeff# made\n", "\r\n\x1a \n")],
)
def test_marks_at_the_start_and_the_end_are_no_part_of_the_table(start, end):
    table, _, _ = read_pair(put("a.csv", f"{start}time,x\n0,1\n1,2{end}"))
    assert table.values("x").tolist() == [1.0, 2.0]
    refused("'time' is not a number in line 3: '1\\x1a'", put("a.csv", "time,x\n0,1\n1\x1a,2\n"))


DEGREES = "inDegrees={}\nendheader\ntime slider_angle knee\n0 180 1\n1 90 2\n"


@pytest.mark.parametrize(
    ("head", "first", "says"), [("yes", np.pi, True), ("no", 180.0, False), ("true", np.pi, True)]
)
def test_a_header_that_states_degrees_counts_for_angles_of_the_press(head, first, says):
    path = put("a.sto", DEGREES.format(head))
    table, _, warnings = read_pair(path)
    assert table.values("slider_angle")[0] == first
    assert any("states degrees for all angles" in line for line in warnings) == says
    other = put("b.sto", DEGREES.format("no" if says else "yes"))
    refused("states degrees for all angles|radians: state the units of knee", path, other)
    units = '[columns.knee]\nchannel = "knee"\nunit = "deg"\n[channels.knee]\nunit = "deg"\n'
    read_pair(path, other, units + '[columns.slider_angle]\nchannel = "slider_angle"')


def test_a_dialect_may_be_that_of_one_table():
    a, b = put("a.csv", "time;x\n0;1.500\n1;2.500\n"), put("b.csv", "time|x\n0|1,5\n1|2,5\n")
    first, second, _ = read_pair(
        a, b, '[dialect]\ndecimal = "."\n[dialect.b]\nseparator = "|"\ndecimal = ","'
    )
    assert first.frame.equals(second.frame)
