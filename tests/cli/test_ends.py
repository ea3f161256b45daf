"""Rows that one of two tables has alone, and files beside tables: each is compared, refused or named.

Every case stands for a kind that comparisons pass over: a run that stops early, the row after an event, a
file of a folder, another program's record.
"""

import numpy as np
import pandas as pd
import pytest

from sixbar import compare

TIME = np.arange(101) * 0.01
FINE = np.linspace(0, 1, 1001)
UNEVEN_TIMES = np.sort(np.append(np.random.default_rng(1).uniform(0, 1, 99), [0.0, 1.0]))


def frame(time, spike=None):
    """Rows of a sine, with 1e6 in one of them."""
    x = np.sin(10 * np.asarray(time, dtype=float))
    if spike is not None:
        x[spike] = 1e6
    return pd.DataFrame({"time": time, "x": x})


def text(time):
    return frame(time).to_csv(index=False)


def spans(count, end=4.0, start=0.0):
    return start + np.arange(round((end - start) * count) + 1) / count


ONE_SPAN = {  # of equal motions: the times of both tables
    "rounded to three digits": (np.round(np.arange(121) / 120, 3), np.arange(121) / 120),
    "uneven": (UNEVEN_TIMES, TIME),
    "a solver that stops behind its end": (TIME, np.append(TIME[:-1], 1.0015)),
}
OTHER_SPANS = {  # the times of both tables, of which one has rows alone
    "last row": (TIME[:-1], TIME),
    "first row": (TIME[1:], TIME),
    "coarse that stops within its step": (spans(1, 3.0), spans(1000, 3.5)),
    "a row before the start": (TIME, np.append(-1e-6, TIME)),
    "dense at its end": (np.append(TIME[:50], 0.5 + np.arange(26) * 1e-3), np.linspace(0, 0.53, 54)),
    "counted from an epoch": (TIME, 1.7e9 + TIME),
}


@pytest.mark.parametrize("case", ONE_SPAN)
def test_tables_of_one_span_are_compared_up_to_their_last_rows(case):
    # Between 101 rows a line errs by 100 * 0.01^2 / 8 = 1e-3, of a range of 2; of uneven ones by more.
    options = {"tolerance": 0.02, "time_tolerance": 1e-9}
    first, second = ONE_SPAN[case]
    for a, b in ((first, second), (second, first)):
        result = compare(frame(a), frame(b), **options)
        assert result.verdict == "agree"
        assert "compared from" not in "".join(result.warnings)
        for row in (0, -1):
            assert compare(frame(a), frame(b, row), **options).verdict == "differ"


def refusals(sixbar, first, second, options, *pieces):
    """Require two texts of tables to be refused in either order, and return the messages."""
    sixbar.write("a.csv", first)
    sixbar.write("b.csv", second)
    pairs = ("a.csv b.csv", "b.csv a.csv")
    return [sixbar.refusal(f"compare {pair} {options}", *pieces) for pair in pairs]


@pytest.mark.parametrize("case", OTHER_SPANS)
def test_a_row_that_one_table_has_alone_at_an_end_is_refused(case, sixbar):
    first, second = map(text, OTHER_SPANS[case])
    for err in refusals(sixbar, first, second, "--tolerance 0.5", "truncated", "--common-time"):
        spans = [err.partition(f"{name} spans ")[2] or err.partition(f"{name} ")[2] for name in "ab"]
        assert len({span.partition(" s")[0] for span in spans}) == 2  # they can be told apart


def test_an_end_row_behind_a_hole_does_not_hide_it(sixbar):
    hole = text(np.append(spans(1000, 3.0), 4.0))
    message = "a has no row between 3 and 4 s: 999 rows are missing"
    refusals(sixbar, hole, text(spans(1)), "--tolerance 1", message)


def test_the_common_time_is_that_of_the_compared_rows():
    """The compared rows may end first; a hole behind them does not count."""
    for time, end in ((spans(1000, 3.9), 3), (np.append(spans(100, 5.0), spans(100, 9.0, 8.0)), 4)):
        a, b = frame(time), frame(spans(1))
        for pair in ((a, b), (b, a)):
            result = compare(*pair, tolerance=1e-9, common_time=True)
            assert result.verdict == "agree"
            assert f"compared from 0 to {end} s" in "".join(result.warnings)


def events(time, at, value=99.0, pattern="{!r}"):
    """Return the text of a table with a second row, of another value, at the time of one row."""
    lines = ["time,x"]
    for t in np.asarray(time).tolist():
        lines.append(f"{pattern.format(t)},{float(np.sin(10 * t))!r}")
        lines += [f"{pattern.format(t)},{value!r}"] if abs(t - at) < 1e-9 else []
    return "\n".join([*lines, ""])


@pytest.mark.parametrize(
    ("first", "second", "at"),
    [
        (events(TIME, 0.5), text(TIME), 0.5),
        (events(TIME, 1.0), text(TIME), 1),
        (events(TIME, 0.0), text(TIME), 0),
        (events(FINE, 0.5), text(TIME), 0.5),
        # Two rows of one event, not quite at one time.
        (events(TIME, 0.5), text(np.sort(np.append(TIME, 0.500001))), 0.5),
    ],
)
def test_an_event_of_one_table_alone_is_refused(first, second, at, sixbar):
    pieces = f"a has two rows at {at} s", "b has not", "--at-events left or right"
    refusals(sixbar, first, second, "--tolerance 1e-3 --at-events both", *pieces)


@pytest.mark.parametrize(
    ("first", "second", "verdict"),
    [
        (events(TIME, 0.5), events(TIME, 0.5, value=98.0), "differ"),
        (events(FINE, 0.5), events(TIME, 0.5, value=98.0), "differ"),
        # Three digits leave the two rows of the jump at one time.
        (events(TIME, 0.5, pattern="{:.3f}"), events(TIME, 0.5), "agree"),
    ],
)
def test_both_rows_of_an_event_are_compared(first, second, verdict, sixbar):
    a, b = (sixbar.folder / sixbar.write(f"{name}.csv", text) for name, text in (("a", first), ("b", second)))
    for pair in ((a, b), (b, a)):
        assert compare(*pair, tolerance=1e-3, at_events="both").verdict == verdict
    assert compare(a, a, tolerance=1e-3, at_events="both").verdict == "agree"


ROWS = "time,x\n0,1\n1,2\n2,3\n"
OTHERS = ROWS.replace("1,2", "1,9")
CONTACTS = "corner,start,end,normal_speed,impulse,peak_force,largest_depth\nll,0.5,1,1,1,1,1e-6\n"
FOLDERS = {  # files besides run.csv of either folder, the exit code, and pieces of the output
    "what belongs to no table is named": (
        {"config.json": "{}", ".hidden.csv": ROWS, "run.events.csv": CONTACTS, "run.json": "{}"},
        {"s/o.csv": ROWS, "t/": "", ".DS_Store": "\0"},
        0,
        "a: not compared, since they are no tables: link.csv, config.json\n|"
        "b: not compared, since they are no tables: s/, t/\n",
    ),
    "what is named as one of its files is compared": (
        {"press.events.csv": ROWS, "run.pulses.csv": ROWS},
        {"press.events.csv": OTHERS, "run.pulses.csv": OTHERS},
        1,
        'press.events|run.pulses|"verdict": "differ"|"verdict": "agree"',
    ),
    "what has no partner or cannot be read": (
        {"x.extrema.csv": ROWS, "y.events.csv": CONTACTS},
        {"y.events.csv": CONTACTS, "z.csv": ROWS},
        2,
        'b has no table of this name|a/y.events.csv: |a has no table of this name|"cannot compare"',
    ),
    "two of one name": ({"run.txt": ROWS}, {}, 2, "run.csv and run.txt"),
}


@pytest.mark.parametrize("case", FOLDERS)
def test_nothing_of_a_folder_is_passed_over_in_silence(case, sixbar):
    first, second, code, message = FOLDERS[case]
    for folder, files in (("a", first), ("b", second)):
        for name, content in {"run.csv": ROWS, **files}.items():
            if name.endswith("/"):
                (sixbar.folder / folder / name).mkdir()
            else:
                sixbar.write(f"{folder}/{name}", content)
    (sixbar.folder / "a/link.csv").symlink_to("nothing")
    process = sixbar("compare", "a", "b", "--tolerance", "1e-3", "--json", code=code)
    assert all(piece in process.out + process.err for piece in message.split("|"))


BESIDE = {  # a file beside run.csv, its text, and a piece of the warning
    "no JSON": ("run.json", "{not json", "run.json"),
    "nested": ("run.json", "[" * 10_000 + "]" * 10_000, "run.json"),
    "a scene of another kind": ("run.json", '{"scene": {"camera": [0, 0, 1]}}', ""),
    "events of another program": ("run.events.csv", "time,event\n0.5,touch\n", "run.events.csv"),
    "damaged contacts": ("run.events.csv", CONTACTS + "ll,1,2,3,4,5,6,7\n", "run.events.csv"),
    "contacts": ("run.events.csv", CONTACTS, ""),
}


@pytest.mark.parametrize("case", BESIDE)
def test_another_programs_files_beside_a_table_are_named_and_not_read(case, sixbar):
    name, content, message = BESIDE[case]
    run, ref = (sixbar.folder / sixbar.write(table, ROWS) for table in ("run.csv", "ref.csv"))
    sixbar.write(name, content)
    for pair in ((run, ref), (ref, run)):
        result = compare(*pair, tolerance=1e-3)
        warnings = [line for line in result.warnings if "not read" in line]
        assert (result.verdict, bool(warnings)) == ("agree", bool(message))
        assert all(message in line for line in warnings)
