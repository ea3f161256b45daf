"""Files of other programs: numbers arrive bit for bit, an ambiguous or damaged file is one line."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from foreign_tables import FRAME, put, read_pair, refused
from openpyxl import Workbook
from scipy.io import savemat

pytestmark = pytest.mark.usefixtures("empty_folder")
SAMPLES = Path(__file__).with_name("samples")
NAMES = list(FRAME)
COLUMNS = {name: FRAME[name].to_numpy() for name in FRAME}


def require_same(table, expected=COLUMNS):
    assert list(table.frame) == list(expected)
    for name, values in expected.items():
        assert table.values(name).tobytes() == values.tobytes()


# Samples in the layouts of other programs: the motion x = 0.1 m cos(2 pi t)
TIME = np.arange(21) * 0.05
X, V = 0.1 * np.cos(2 * np.pi * TIME), -0.2 * np.pi * np.sin(2 * np.pi * TIME)
LAYOUTS = {
    "adams.xlsx": (".press.slider.X", ".press.slider.VX", ("meter", "meter/sec"), 15),
    "chrono_adams.txt": ("X_Pos", "X_Vel", ("", ""), 6),
    "openfast.out": ("PtfmSurge", "PtfmSurgeV", ("m", "m/s"), 5),
    "hydrodyn.out": ("PtfmSurge", "PtfmSurgeV", ("m", "m/s"), 5),
    "opensim.sto": ("pelvis_tx", "pelvis_tx_u", ("", ""), 7),
    "opensim.mot": ("pelvis_tx", "pelvis_tx_u", ("", ""), 7),
    "fmi.csv": ("x", "der(x)", ("", ""), 8),
    "modelica.csv": ("body.r_0[1]", "body.v_0[1]", ("", ""), 8),
    "exudyn_sensor.txt": ("#2", "#3", ("", ""), 8),
    "exudyn_solution.txt": ("#2", "#3", ("", ""), 8),
    "siconos.ref": ("#2", "#3", ("", ""), 15),
    "siconos_nodim.ref": ("#2", "#3", ("", ""), 15),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_sample_gives_its_columns_and_units_and_its_ending_says_nothing(name):
    x, v, units, digits = LAYOUTS[name]
    table, copy, warnings = read_pair(SAMPLES / name, Path(shutil.copy(SAMPLES / name, "run.37")))
    assert list(table.frame) == ["time", x, v]
    assert (table.overrides[x].unit, table.overrides[v].unit) == units
    np.testing.assert_allclose(table.time, TIME, rtol=0, atol=1e-15)
    # The digits of the sample.
    np.testing.assert_allclose(table.values(x), X, rtol=0, atol=10.0**-digits)
    np.testing.assert_allclose(table.values(v), V, rtol=0, atol=10.0**-digits)
    assert ("no unit is stated" in "".join(warnings)) == (units == ("", ""))
    assert ("columns without names" in "".join(warnings)) == (x == "#2")
    assert copy.frame.equals(table.frame)


MAT = Path("a.mat")


def test_vectors_of_a_file_and_of_its_structures():
    savemat(MAT, {name: values.reshape(-1, 1) for name, values in COLUMNS.items()})
    savemat("b.mat", {"adams": COLUMNS, "other": COLUMNS})
    units = zip(NAMES, ["s", "m", "rad"], strict=True)
    rules = (f'[b."adams.{name}"]\nchannel = "{name}"\nunit = "{unit}"\n' for name, unit in units)
    vectors, structures, warnings = read_pair(MAT, Path("b.mat"), "".join(rules))
    require_same(vectors)
    require_same(structures)
    assert "other.slider_y" in warnings[0]


def test_what_is_no_vector_is_refused_or_listed():
    cells = np.array(["a", {}], dtype=object)
    others = {"file": cells, "m": np.eye(3), "n": 3.0, "t": "slow", "c": 1j * np.ones(11)}
    savemat(MAT, COLUMNS | others)  # a variable may have the name of an argument
    table, _, warnings = read_pair(MAT, None, '[columns.slider_y]\nchannel = "slider_y"\nunit = "m"')
    require_same(table)
    for entry in ("m (float64 of shape (3, 3))", "n (float64 of shape ())", "t (str", "c (complex128 of "):
        assert entry in warnings[0]
    refused("a.mat: 'file (object of shape (2,))' is not a channel", MAT)


def test_a_broken_file_is_one_line():
    savemat(MAT, COLUMNS | {"slider_x": np.zeros(5)})
    refused("a.mat: time holds 11 numbers and slider_x 5", MAT)
    content = MAT.read_bytes()
    # The last one ends scipy's parser by a wrong address.
    for fragment in (content[:-3], content[:145] + b"\x0f" + content[146:]):
        refused("a.mat: is not a readable .mat file", put("a.mat", fragment))


def dymola(places, *, transposed=True, **matrices):
    """Write a result of Dymola: matrix and row of each name; the first row of a matrix has its times."""
    names = [name.ljust(12) for name in places]
    matrices["dataInfo"] = np.array([[*place, 0, -1] for place in places.values()]).T
    kind = "binTrans" if transposed else "binNormal"
    content = {
        "Aclass": [text.ljust(11) for text in ("Atrajectory", "1.1", "", kind)],
        "name": ["".join(column) for column in zip(*names, strict=True)] if transposed else names,
    }
    content |= {name: np.array(each if transposed else np.transpose(each)) for name, each in matrices.items()}
    savemat(MAT, content, format="4")


@pytest.mark.parametrize("transposed", [True, False])
def test_a_result_of_dymola(transposed):
    """Names and matrices by their index, an alias with the opposite sign, a constant."""
    time, y, angle = COLUMNS.values()
    places = {"Time": (0, 1), "slider_y": (2, 2), "slider_angle": (2, -3), "reaction_A_x": (1, 2)}
    dymola(places, transposed=transposed, data_1=[[0.0, 0.01], [7.5, 7.5]], data_2=[time, y, -angle])
    require_same(read_pair(MAT)[0], COLUMNS | {"reaction_A_x": np.full(11, 7.5)})


@pytest.mark.parametrize(
    ("matrix", "rule"),
    [
        ([[0.0, 1.0, 2.0], [5.0, 6.0, 7.0]], ""),  # the same times
        ([[0.0, 2.0], [7.0, 7.0]], ""),  # constant
        ([[0.0, 2.0], [7.0, 8.0]], "'v3 (of data_3, which has times of its own)' is not a channel"),
    ],
)
def test_a_further_matrix_of_a_result_is_read_if_its_times_are_the_same(matrix, rule):
    places = {"time": (0, 1), "v2": (2, 2), "v3": (3, 2)}
    dymola(places, data_2=[[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]], data_3=matrix)
    if rule:
        refused(rule, MAT)
    else:
        expected = matrix[1] if len(matrix[1]) == 3 else [7.0, 7.0, 7.0]
        assert read_pair(MAT)[0].values("v3").tolist() == expected


def signals(*labels):
    dtype = [("values", "O"), ("dimensions", "O"), ("label", "O"), ("blockName", "O")]
    parts = np.zeros((1, len(labels)), dtype=dtype)
    for n, label in enumerate(labels):
        parts[0, n] = (n + np.c_[TIME, 2 * TIME][:, : n + 1], n + 1.0, label, f"press/Out{n + 1}")
    return parts


COLUMN = TIME.reshape(-1, 1)


@pytest.mark.parametrize(
    ("content", "names"),
    [
        ({"tout": COLUMN, "xout": COLUMN, "yout": np.c_[TIME, 2 * TIME]}, "xout yout(1) yout(2)"),
        ({"tout": COLUMN, "yout": {"time": COLUMN, "signals": signals("angle")}}, "angle"),
        ({"tout": COLUMN, "yout": {"time": [], "signals": signals("", "F")}}, "Out1 F(1) F(2)"),
        ({"tout": COLUMN, "a": {"time": COLUMN, "signals": signals("q")},
          "b": {"time": COLUMN, "signals": signals("q")}}, "a.q b.q"),
    ],
)  # fmt: skip
def test_what_simulink_saves(content, names):
    savemat(MAT, content)
    table, _, warnings = read_pair(MAT)
    assert sorted(table.channels) == sorted(names.split())
    np.testing.assert_array_equal(table.time, TIME)
    column = table.values(names.split()[-1])
    assert (np.diff(column) > 0).all()
    assert not any("not compared" in line for line in warnings)


@pytest.mark.parametrize("matrix", [np.eye(21), np.ones((4, 2))])
def test_a_matrix_whose_rows_are_no_times_is_refused(matrix):
    savemat(MAT, {"tout": COLUMN, "yout": matrix})
    refused("a.mat: 'yout (float64 of shape ", MAT)


ROWS = FRAME.round(9).to_numpy().tolist()  # openpyxl writes 16 digits: too few for some doubles
EXACT = {name: column.round(9) for name, column in COLUMNS.items()}


def workbook(*rows, more=None):
    book = Workbook()
    for name, content in {"Table": list(rows), **(more or {})}.items():
        sheet = book.active if name == "Table" else book.create_sheet()
        sheet.title = name
        for row in content:
            sheet.append(row)
    book.save("run.xlsx")
    return Path("run.xlsx")


def test_numbers_arrive_bit_for_bit_below_titles_and_above_a_blank_row():
    head = [["Adams/PostProcessor"], [], ["run", None, 7.0], NAMES]
    path = workbook(*head, *ROWS, [None], more={"Notes": [["made by", "hand"], [1.0]]})
    require_same(read_pair(path)[0], EXACT)


@pytest.mark.parametrize(
    ("rows", "rule"),
    [
        ([NAMES, *ROWS[:3], ["run 2"], *ROWS], "line 5 is text"),
        ([[*NAMES, "a\nb"], *([*row, "no"] for row in ROWS)], "'a b' is not a number in line 2: 'no'"),
        ([["time", "slider_y"], ["0.1", "0.2"]], "of its sheets none hold rows of two or more numbers"),
    ],
)  # fmt: skip
def test_a_sheet_that_is_no_table_is_one_line(rows, rule):
    refused(f"run.xlsx: |{rule}", workbook(*rows))
    path = workbook(NAMES, *ROWS, more={"Run 2": [NAMES, *ROWS]})
    refused("of its sheets 'Table' and 'Run 2' hold rows of two or more numbers: save one", path)


def test_an_empty_cell_is_no_number():
    assert np.isnan(read_pair(workbook(NAMES, [0.0, None, 1.0], *ROWS[1:]))[0].values("slider_y")[0])
