"""MATLAB's files: vectors and structures arrive bit for bit, all else is refused or listed, none ends us."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from foreign_tables import read_pair
from scipy.io import savemat

from comparison.tables.mapping import load_mapping
from comparison.tables.table import Table, TableError

TIME = np.arange(0, 11) / 1000
COLUMNS = {"time": TIME, "slider_y": 0.1 * np.cos(400 * TIME), "slider_angle": 1e-3 * np.sin(400 * TIME)}
FILE = Path("a.mat")


def read(mapping: str | None = None) -> tuple[Table, tuple[str, ...]]:
    """Read the file beside itself."""
    rules = None
    if mapping is not None:
        Path("map.toml").write_text(mapping)
        rules = load_mapping(Path("map.toml"))
    table, _, warnings = read_pair(FILE, FILE, rules)
    return table, warnings


def same(table: Table) -> None:
    assert list(table.frame) == list(COLUMNS)
    for name, values in COLUMNS.items():
        assert table.frame[name].to_numpy().tobytes() == values.tobytes()


@pytest.mark.parametrize("structure", [True, False])
@pytest.mark.parametrize("shape", [(-1, 1), (1, -1)])
def test_vectors_and_a_structure_of_them(shape, structure):
    vectors = {name: values.reshape(shape) for name, values in COLUMNS.items()}
    savemat(FILE, {"run": vectors} if structure else vectors)
    same(read()[0])


def test_of_several_structures_the_name_counts():
    savemat(FILE, {"adams": COLUMNS, "other": COLUMNS})
    rules = "".join(
        f'[columns."adams.{name}"]\nchannel = "{name}"\nunit = "{unit}"\n'
        for name, unit in zip(COLUMNS, ("s", "m", "rad"), strict=True)
    )
    table, warnings = read(rules)
    same(table)
    assert "other.slider_y" in warnings[0]


@pytest.mark.parametrize(
    ("extra", "kind"),
    [
        (np.array(["a", {}], dtype=object), "objects or cells"),
        (np.eye(3), "matrix of 3 x 3"),
        (3.0, "single number"),
        ("slow", "text"),
        (1j * np.ones(11), "complex numbers"),
    ],
)
def test_what_is_no_vector_is_refused_or_listed(extra, kind):
    savemat(FILE, COLUMNS | {"more": extra})
    with pytest.raises(TableError, match=rf"'more \({kind}\)' is not a channel"):
        read()
    table, warnings = read('[columns.slider_y]\nchannel = "slider_y"\nunit = "m"')
    same(table)
    assert f"more ({kind})" in warnings[0]


def test_a_variable_may_have_the_name_of_an_argument():
    savemat(FILE, COLUMNS | {"file": 3.0, "others": np.zeros(11)})
    with pytest.raises(TableError, match=r"'file \(single number\)' is not a channel"):
        read()


def test_vectors_of_two_lengths_are_refused():
    savemat(FILE, COLUMNS | {"slider_x": np.zeros(5)})
    with pytest.raises(TableError, match="time holds 11 numbers and slider_x 5"):
        read()


def test_version_73_says_what_to_do():
    FILE.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + b"\x89HDF\r\n\x1a\n" + bytes(400))
    with pytest.raises(TableError, match=r"version 7\.3 .* save it with the option -v7"):
        read()


def test_a_file_that_is_not_there_is_one_line():
    with pytest.raises(TableError, match=r"^a\.mat: No such file or directory$"):
        read()


# The last three end scipy's parser by a wrong address.
@pytest.mark.parametrize(
    "broken",
    [
        lambda whole: whole[:60],
        lambda whole: whole[:200],
        lambda whole: whole[:-3],
        lambda whole: whole[:126] + b"??" + whole[128:],
        lambda whole: whole[:145] + b"\x0f" + whole[146:],
        lambda whole: whole[:154] + b"\x01" + whole[155:],
        lambda whole: whole[:177] + b"\x0e" + whole[178:],
    ],
)
def test_a_broken_file_is_one_line(broken):
    savemat("good.mat", COLUMNS)
    FILE.write_bytes(broken(Path("good.mat").read_bytes()))
    with pytest.raises(TableError, match=r"^a\.mat: is not a readable \.mat file$"):
        read()


@pytest.mark.parametrize("transposed", [True, False])
def test_a_result_of_dymola(transposed):
    """Names and matrices by their index, an alias with the opposite sign, a constant."""
    y, angle = COLUMNS["slider_y"], COLUMNS["slider_angle"]
    names = ["Time", "slider_y", "slider_angle", "reaction_A_x"]
    info = np.array([[0, 1, 0, -1], [2, 2, 0, -1], [2, -3, 0, -1], [1, 2, 0, 0]]).T
    constants, varying = np.array([[0.0, 0.01], [7.5, 7.5]]), np.array([TIME, y, -angle])
    width = max(map(len, names))
    padded = [name.ljust(width) for name in names]
    kind = "binTrans" if transposed else "binNormal"
    savemat(
        FILE,
        {
            "Aclass": [line.ljust(11) for line in ("Atrajectory", "1.1", "", kind)],
            "name": ["".join(column) for column in zip(*padded, strict=True)] if transposed else padded,
            "dataInfo": info if transposed else info.T,
            "data_1": constants if transposed else constants.T,
            "data_2": varying if transposed else varying.T,
        },
        format="4",
    )
    table, _ = read()
    for name, values in COLUMNS.items():
        np.testing.assert_array_equal(table.values(name), values)
    np.testing.assert_array_equal(table.values("reaction_A_x"), 7.5)


def test_a_file_that_takes_too_long_is_one_line(monkeypatch):
    savemat(FILE, COLUMNS)
    monkeypatch.setattr("comparison.tables.formats._LONGEST", 1e-3)  # s: the process has not begun
    with pytest.raises(TableError, match=r"a\.mat: cannot be read within 0\.001 s"):
        read()
