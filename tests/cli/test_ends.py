"""Rows that one of two tables has alone, and files beside tables: each is compared, refused or named.

Every case stands for a kind that comparisons pass over: a run that stops early, the row after an event, a
file of a folder, another program's record.
"""

import numpy as np
import pandas as pd
import pytest

from sixbar import compare

STEP = 0.01
TIME = np.arange(101) * STEP
FINE = np.linspace(0, 1, 1001)
RNG = np.random.default_rng(1)
UNEVEN = np.sort(np.append(RNG.uniform(0, 1, 99), [0.0, 1.0]))


def frame(time, spike=None):
    """Rows of a sine, but 1e6 in one of them."""
    x = np.sin(10 * np.asarray(time, dtype=float))
    if spike is not None:
        x[spike] = 1e6
    return pd.DataFrame({"time": time, "x": x})


def text(time, spike=None):
    return frame(time, spike).to_csv(index=False)


def spans(count, end=4.0, start=0.0):
    return start + np.arange(round((end - start) * count) + 1) / count


ONE_SPAN = {  # of equal motions: the times of both tables
    "rounded": (TIME, TIME + 1e-7),
    "rounded to three digits": (np.round(np.arange(121) / 120, 3), np.arange(121) / 120),
    "other times": (TIME, np.linspace(0, 1, 137)),
    "finer": (TIME, FINE),
    "uneven": (UNEVEN, TIME),
    "a solver that stops behind its end": (TIME, np.append(TIME[:-1], 1.0015)),
}
OTHER_SPANS = {  # the times of both tables, of which one has rows alone
    "last row": (TIME[:-1], TIME),
    "first row": (TIME[1:], TIME),
    "1 kHz that stops at 3 of 4 s": (spans(1000, 3.0), spans(1)),
    "1 kHz that begins at 1 of 4 s": (spans(1000, 4.0, 1.0), spans(1)),
    "coarse that stops within its step": (spans(1, 3.0), spans(1000, 3.5)),
    "a row behind the end": (TIME, np.append(TIME, 1.0005)),
    "a row before the start": (TIME, np.append(-1e-6, TIME)),
    "half a step": (TIME, TIME[:-1] + STEP / 2),
    "dense at its end": (np.append(TIME[:50], 0.5 + np.arange(26) * 1e-3), np.linspace(0, 0.53, 54)),
    "counted from an epoch": (TIME, 1.7e9 + TIME),
}


@pytest.mark.parametrize("case", ONE_SPAN)
def test_tables_of_one_span_are_compared_up_to_their_last_rows(case):
    """From Python, which is the same as by the command line, without a page."""
    # Between 137 rows a line errs by 100 * 0.01^2 / 8 = 1e-3, of a range of 2; of uneven ones by more.
    options = {"tolerance": 0.02, "time_tolerance": 1e-9}
    first, second = ONE_SPAN[case]
    for a, b in ((first, second), (second, first)):
        result = compare(frame(a), frame(b), **options)
        assert (result.verdict, [line for line in result.warnings if "compared from" in line]) == (
            "agree",
            [],
        )
        for row in (0, -1):
            assert compare(frame(a), frame(b, row), **options).verdict == "differ"
            assert compare(frame(a, row), frame(b), **options).verdict == "differ"


@pytest.mark.parametrize("case", OTHER_SPANS)
def test_a_row_that_one_table_has_alone_at_an_end_is_refused(case, sixbar):
    for name, time in zip("ab", OTHER_SPANS[case], strict=True):
        sixbar.write(f"{name}.csv", text(time))
    for pair in ("ab", "ba"):
        err = sixbar.refused(
            f"compare {pair[0]}.csv {pair[1]}.csv --tolerance 0.5", "truncated", "--common-time"
        )
        spans = [err.partition(f"{name} spans ")[2] or err.partition(f"{name} ")[2] for name in "ab"]
        assert len({span.partition(" s")[0] for span in spans}) == 2  # they can be told apart


@pytest.mark.parametrize(
    ("time", "other", "missing"),
    [
        (np.delete(TIME, [1, 2]), TIME, "between 0 and 0.03 s: 2 rows are missing"),
        (np.append(spans(1000, 3.0), 4.0), spans(1), "between 3 and 4 s: 999 rows are missing"),
    ],
)
def test_an_end_row_behind_a_hole_does_not_hide_it(time, other, missing, sixbar):
    sixbar.write("a.csv", text(time))
    sixbar.write("b.csv", text(other))
    for pair in ("a.csv b.csv", "b.csv a.csv"):
        sixbar.refused(f"compare {pair} --tolerance 1", f"a has no row {missing}")


def test_the_common_time_is_that_of_the_compared_rows(sixbar):
    sixbar.write("a.csv", text(spans(1000, 3.9)))
    sixbar.write("b.csv", text(spans(1)))
    for pair in (("a.csv", "b.csv"), ("b.csv", "a.csv")):
        said = sixbar("compare", *pair, "--tolerance", "1e-9", "--common-time")
        assert "compared from 0 to 3 s" in said.err
    # A hole where they are not compared is none.
    sixbar.write("hole.csv", text(np.append(spans(100, 5.0), spans(100, 9.0, 8.0))))
    assert "compared from 0 to 4 s" in sixbar("compare", "hole.csv", "b.csv", "--common-time", code=3).err


@pytest.mark.parametrize("ended", ["a", "b", "ideal", "finer"])
def test_a_reliability_names_the_rows_that_it_leaves_out(ended, sixbar):
    time = np.arange(1001) * 1e-3
    for name in ("a", "b", "ideal", "finer"):
        kept = time[:-1] if name == ended else time
        sixbar.table(f"{name}.csv", time=kept, slider_y=0.1 * np.sin(4 * np.pi * kept))
    command = "reliability a.csv b.csv --ideal ideal.csv --period 0.5 --finer-a finer.csv --finer-b b.csv"
    said = sixbar(*command.split())
    assert f"only its first 0.999 s count, where {ended}.csv ends" in said.err
    hole = np.delete(time, range(300, 350))
    sixbar.table(f"{ended}.csv", time=hole, slider_y=0.1 * np.sin(4 * np.pi * hole))
    assert (
        f"{ended}.csv has no row between 0.299 and 0.35 s: 50 rows are missing"
        in sixbar(*command.split(), "--allow-indeterminate").err
    )


def test_a_finer_run_that_ends_early_is_refused(sixbar):
    for name, time in (("a", TIME), ("b", TIME), ("short", TIME[:-1])):
        sixbar.write(f"{name}.csv", text(time))
    for side, other in (("a", "b"), ("b", "a")):
        further = f"--finer-{side} short.csv --finer-{other} {other}.csv"
        sixbar.refused(
            f"compare a.csv b.csv {further}", f"{side} finer: its times differ from those of {side}"
        )


# Events: two rows of one time


def events(time, at, after=99.0, written="{!r}"):
    """Return the text of a table that has at some of its rows a second one with another value."""
    lines = ["time,x"]
    for t in np.asarray(time).tolist():
        lines.append(f"{written.format(t)},{float(np.sin(10 * t))!r}")
        lines += [f"{written.format(t)},{after!r}"] if any(abs(t - each) < 1e-9 for each in at) else []
    return "\n".join([*lines, ""])


@pytest.mark.parametrize(
    ("first", "second", "alone"),
    [
        (events(TIME, [0.5]), events(TIME, []), "a has two rows at 0.5 s"),
        (events(TIME, [1.0]), events(TIME, []), "a has two rows at 1 s"),
        (events(TIME, [0.0]), events(TIME, []), "a has two rows at 0 s"),
        (events(FINE, [0.5]), events(TIME, []), "a has two rows at 0.5 s"),
        (events(TIME, [0.5]), events(FINE, []), "a has two rows at 0.5 s"),
        # Two rows of one event, not quite at one time.
        (events(TIME, [0.5]), text(np.sort(np.append(TIME, 0.500001))), "a has two rows at 0.5 s"),
    ],
)
def test_an_event_of_one_table_alone_is_refused(first, second, alone, sixbar):
    sixbar.write("a.csv", first)
    sixbar.write("b.csv", second)
    options = "--tolerance 1e-3 --at-events both"
    sixbar.refused(f"compare a.csv b.csv {options}", alone, "b has not", "--at-events left or right")
    sixbar.refused(f"compare b.csv a.csv {options}", alone, "b has not")
    a = sixbar.folder / "a.csv"
    assert compare(a, a, tolerance=1e-3, at_events="both").verdict == "agree"


@pytest.mark.parametrize(
    ("first", "second", "verdict"),
    [
        (events(TIME, [0.5]), events(TIME, [0.5], after=98.0), "differ"),
        (events(TIME, [1.0]), events(TIME, [1.0], after=98.0), "differ"),
        (events(FINE, [0.5]), events(TIME, [0.5], after=98.0), "differ"),
        # Three digits leave the two rows of the jump at one time.
        (events(TIME, [0.5], written="{:.3f}"), events(TIME, [0.5]), "agree"),
    ],
)
def test_both_rows_of_an_event_are_compared(first, second, verdict, sixbar):
    a, b = (sixbar.folder / sixbar.write(f"{name}.csv", text) for name, text in (("a", first), ("b", second)))
    for pair in ((a, b), (b, a)):
        assert compare(*pair, tolerance=1e-3, at_events="both").verdict == verdict


FEW_DIGITS = {
    "neighbours": ("".join(f"{t:.1f},{t}\n" for t in TIME), "most rows have the time before: too few digits"),
    "an event of three rows": ("0,1\n1,2\n1,9\n1,3\n2,4\n3,5\n", "time 1.0 s has more than two rows"),
    "out of order": ("0,1\n1.01,2\n1.00,3\n2,4\n", "time does not increase in data row 3: 1.01 s, then"),
}


@pytest.mark.parametrize("case", FEW_DIGITS)
def test_times_without_an_order_are_refused(case, sixbar):
    rows, piece = FEW_DIGITS[case]
    sixbar.write("a.csv", f"time,x\n{rows}")
    sixbar.refused("compare a.csv a.csv --tolerance 1 --at-events both", piece)
    sixbar.refused("compare a.csv a.csv --tolerance 1", "time")


# Folders, and files beside a table

ROWS = "time,x\n0,1\n1,2\n2,3\n"
OTHERS = ROWS.replace("1,2", "1,9")
CONTACTS = "corner,start,end,normal_speed,impulse,peak_force,largest_depth\nll,0.5,1,1,1,1,1e-6\n"
FOLDERS = {  # files besides run.csv of either folder, the exit code, and what is said
    "events of no table": ({"press.events.csv": ROWS}, {"press.events.csv": OTHERS}, 1, "press.events"),
    "another program's pulses": ({"run.pulses.csv": ROWS}, {"run.pulses.csv": OTHERS}, 1, "run.pulses"),
    "extrema of no table": ({"x.extrema.csv": ROWS}, {}, 2, "b has no table of this name"),
    "contacts of no table": ({"x.events.csv": CONTACTS}, {"x.events.csv": CONTACTS}, 2, "a/x.events.csv: "),
    "only the second has it": ({}, {"x.events.csv": ROWS}, 2, "a has no table of this name"),
    "two folders": ({}, {"s/o.csv": ROWS, "t/": ""}, 0, "b: not compared, since they are no tables: s/, t/"),
    "JSON of no table": ({"config.json": "{}"}, {}, 0, "since they are no tables: config.json"),
    "a link to nothing": ({"link.csv": None}, {}, 0, "a: not compared, since they are no tables: link.csv"),
    "hidden": ({".hidden.csv": ROWS}, {".DS_Store": "\0"}, 0, ""),
    "its own": ({"run.events.csv": CONTACTS, "run.json": "{}"}, {}, 0, ""),
    "two of one name": ({"run.txt": ROWS}, {}, 2, "run.csv and run.txt"),
}


@pytest.mark.parametrize("case", FOLDERS)
def test_nothing_of_a_folder_is_passed_over_in_silence(case, sixbar):
    first, second, code, said = FOLDERS[case]
    for folder, files in (("a", first), ("b", second)):
        sixbar.write(f"{folder}/run.csv", ROWS)
        for name, content in files.items():
            if content is None:
                (sixbar.folder / folder / name).symlink_to("nothing")
            elif name.endswith("/"):
                (sixbar.folder / folder / name).mkdir()
            else:
                sixbar.write(f"{folder}/{name}", content)
    ended = sixbar(*["compare", "a", "b", "--tolerance", "1e-3"], code=code)
    assert said in ended.out + ended.err
    assert said or len(ended.err.splitlines()) == 1  # that no unit is stated


BESIDE = {  # a file beside run.csv, and what is said
    "a list": ("run.json", "[1, 2, 3]", "run.json"),
    "no JSON": ("run.json", "{not json", "run.json"),
    "nested": ("run.json", "[" * 10_000 + "]" * 10_000, "run.json"),
    "binary": ("run.json", b"\xff\xfe\0\1", "run.json"),
    "settings of another kind": ("run.json", '{"settings": [1]}', "run.json"),
    "a scene of another kind": ("run.json", '{"scene": {"camera": [0, 0, 1]}}', ""),
    "keys of its own": ("run.json", '{"a": 1}', ""),
    "events of another program": ("run.events.csv", "time,event\n0.5,touch\n", "run.events.csv"),
    "events that are binary": ("run.events.csv", b"\x89PNG\0\xff", "run.events.csv"),
    "damaged contacts": ("run.events.csv", CONTACTS + "ll,1,2,3,4,5,6,7\n", "run.events.csv"),
    "contacts": ("run.events.csv", CONTACTS, ""),
}


@pytest.mark.parametrize("case", BESIDE)
def test_another_programs_files_beside_a_table_are_named_and_not_read(case, sixbar):
    name, content, said = BESIDE[case]
    run, ref = (sixbar.folder / sixbar.write(table, ROWS) for table in ("run.csv", "ref.csv"))
    sixbar.write(name, content)
    for pair in ((run, ref), (ref, run), (run, run)):
        result = compare(*pair, tolerance=1e-3)
        warned = [line for line in result.warnings if "not read" in line]
        assert (result.verdict, bool(warned)) == ("agree", bool(said))
        assert all(said in line for line in warned)


def test_contacts_with_a_fault_are_refused(sixbar):
    no_depth = CONTACTS.replace(",largest_depth", "").replace(",1e-6", "")
    for contacts, piece in (
        (CONTACTS.replace("0.5", "x"), "start of contact 1 must be a number"),
        (no_depth, "no column largest_depth"),
    ):
        sixbar.write("run.csv", ROWS)
        sixbar.write("run.events.csv", contacts)
        sixbar.refused("compare run.csv run.csv --tolerance 1", piece)
