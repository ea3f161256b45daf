"""Small tables that were once misread, dropped or refused: the exit code of a comparison, and its words.

Each row stands for a kind. The files lie in ``cases``; a table that differs from itself by nothing agrees.
"""

import shutil
from pathlib import Path

import pytest

CASES = Path(__file__).with_name("cases")
TABLES = [  # files and options, tolerance, exit code, words of what is said
    ("tables/nan_a.out tables/nan_b.out", 1e-2, 2, "'ratio' is not a number in line 4: '1.#QNAN'"),
    ("tables/th_a.csv tables/th_b.csv", 1e-2, 2, "decimal sign is not clear from '1.500' and '0,0'"),
    ("tables/qt_a.csv tables/qt_b.csv", 1e-2, 1, "at worst at t = 0 s"),
    ("tables/ff_a.txt tables/ff_b.txt", 1e-2, 1, "at worst at t = 0 s"),
    ("tables/nn_a.csv tables/nn_b.csv", 1e-2, 2, "line 1 holds 0, 1, 2, which may be names or numbers"),
    ("tables/cs.csv tables/cs.csv", 1e-2, 0, "x"),
    ("tables/br.csv tables/br.csv", 1e-2, 0, "/bodyset/rod2[v.Y]"),
    ("tables/os_a.csv tables/os_b.csv", 1e-2, 0, "os_b.csv: '8 real output' beside thrust is not a unit"),
    ("tables/s1.txt tables/s1.txt", 1e-2, 0, "no unit is stated for s1, s2"),
    ("tables/lc.csv tables/lc.csv", 1e-2, 0, "F agree"),
    ("tables/tx.csv tables/tx.csv", 1e-2, 2, "'contact' is not a number in line 2: 'false'; state skip"),
    ("tables/ep_a.csv tables/ep_b.csv", 1e-2, 2, "1700000000 to 1700000000.2 s and ep_b"),
    ("dropped/multi_a.csv dropped/multi_b.csv", 1e-3, 2, "line 1, above the names, may be names or units"),
    (
        "dropped/second_a.txt dropped/second_b.txt",
        1e-3,
        2,
        "line 5 may be a comment, a row or another heading",
    ),
    ("dropped/title_a.txt dropped/title_b.csv", 1e-3, 0, "y agree"),
    ("dropped/title_c.csv dropped/title_d.csv", 1e-3, 0, "title_c.csv: line 2 is taken for a title: 'Time,1"),
    (
        "dropped/unit_a.csv dropped/unit_b.csv",
        1e-3,
        2,
        "column 'x' states 'mm' beside its name and 'm' below",
    ),
    ("dropped/bom_a.csv dropped/bom_a.csv --mapping dropped/bom_map.toml", 1e-3, 0, "x agree"),
]


@pytest.fixture(scope="module")
def cases(make):
    """The program in a folder that holds the cases."""
    sixbar = make()
    shutil.copytree(CASES, sixbar.folder, dirs_exist_ok=True)
    return sixbar


@pytest.mark.parametrize(("command", "tolerance", "code", "words"), TABLES, ids=[row[0] for row in TABLES])
def test_a_case_ends_as_it_must(command, tolerance, code, words, cases):
    """A refusal is one line beside warnings, and writes nothing."""
    ended = cases("compare", *command.split(), "--tolerance", tolerance, "--out", "out", code=code)
    said = ended.out + ended.err
    assert " ".join(words.split()) in " ".join(said.split())
    assert "np." not in said
    if code == 2 and not any((cases.folder / part).is_dir() for part in command.split()[:2]):
        assert ended.out == ""
        assert len([line for line in ended.err.splitlines() if "warning" not in line]) == 1


def test_a_scene_may_begin_with_a_byte_order_mark(sixbar):
    """As editors of Windows write it; in UTF-16 it is one line."""
    text = '[scene]\nextends = "ideal"\n'
    sixbar.write("plain.toml", text)
    sixbar.write("marked.toml", text.encode("utf-8-sig"))
    sixbar.write("wide.toml", text.encode("utf-16"))
    plain, marked = (sixbar("plan", f"{name}.toml").out for name in ("plain", "marked"))
    assert plain.replace("plain", "marked") == marked
    sixbar.refused("plan wide.toml", "wide.toml", "cannot be read")
