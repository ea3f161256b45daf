"""The rooms: few at the top, data beside what reads it, tests where their sources are."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "comparison"


def folders(of: Path) -> set[str]:
    return {
        path.relative_to(of).as_posix()
        for path in of.rglob("*")
        if path.is_dir() and "__pycache__" not in path.parts and any(path.glob("*.py"))
    }


def test_the_top_of_the_comparison_can_be_taken_in_at_a_glance():
    names = {path.stem for path in PACKAGE.iterdir() if path.suffix == ".py" or path.is_dir()}
    assert len(names - {"__init__", "__main__", "__pycache__"}) <= 16
    assert not [path.name for path in PACKAGE.glob("*.toml")]


def test_tests_of_the_comparison_lie_as_their_sources_do():
    assert folders(ROOT / "tests" / "comparison") <= folders(PACKAGE)
    rooms = {path for path in folders(PACKAGE) if "/" not in path}
    assert rooms <= folders(ROOT / "tests" / "comparison")


def test_data_is_read_in_its_own_room():
    for path in PACKAGE.rglob("*.py"):
        for package in re.findall(r'files\("([\w.]+)"\)', path.read_text("utf-8")):
            data = ROOT.joinpath(*package.split("."))
            if not data.is_dir():
                continue  # in a docstring
            assert data == path.parent or data.parent == path.parent, f"{path} reads {package}"


def test_documented_imports_work():
    """Those of the README, the docs and the packages' entry points."""
    from comparison.cli import main
    from comparison.compare import Runs, compare
    from comparison.pytest_plugin import assert_agree
    from comparison.scene import load_scene
    from comparison.tables.table import Table

    assert all(map(callable, (main, compare, Runs, assert_agree, load_scene, Table)))
