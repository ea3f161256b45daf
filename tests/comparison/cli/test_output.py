"""Where results go is checked before anything runs, and what ran is not lost. The models are fakes."""

from __future__ import annotations

import errno
import re
import tempfile
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.files import replacing_in
from comparison.tables.table_files import read

pytestmark = pytest.mark.usefixtures("fake_models")


@pytest.fixture(autouse=True)
def _temporary(tmp_path, monkeypatch):
    (tmp_path / "tmp").mkdir()
    (tmp_path / "home").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    Path("folder.csv").mkdir()
    Path("file").touch()
    Path("dangling.csv").symlink_to("nowhere/x.csv")


def run(scene: str, out: str) -> list[str]:
    return ["run", scene, "--model", "exudyn", "--set", "drive.cycles=1", f"--out={out}"]


@pytest.mark.parametrize(
    ("out", "reported"),
    [
        ("folder.csv", "folder.csv: is not a file"),
        ("dangling.csv", "dangling.csv: is a link to nothing"),
        ("file/a.csv", "file: is not a folder"),
        ("~nosuchuser/a.csv", "there is no such home folder"),
        ("a" * 240 + ".csv", "the name is longer than 200 bytes"),
    ],
)
def test_a_run_whose_table_could_not_be_written_does_not_begin(
    scene_file, fake_models, capsys, out, reported
):
    assert main(run(scene_file("own"), out)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert reported in err
    assert err.count("\n") == 1
    assert fake_models.read_text() == ""


@pytest.fixture
def _full(monkeypatch, tmp_path):
    """The disk of the working directory is full as soon as a result is written."""
    import comparison.files

    def full(part, folder):
        if tmp_path / "tmp" not in folder.parents:
            raise OSError(errno.ENOSPC, "No space left on device")
        return moved(part, folder)

    moved = comparison.files._move
    monkeypatch.setattr(comparison.files, "_move", full)
    with pytest.raises(OSError, match="No space"), replacing_in(Path("proof")) as part:
        (part / "a").touch()


@pytest.mark.usefixtures("_full")
@pytest.mark.parametrize("gravity_of", ["normal", "fail"])
def test_a_table_is_written_elsewhere_when_the_disk_is_full(scene_file, gravity, capsys, gravity_of):
    assert main(run(scene_file("own", getattr(gravity, gravity_of)), "out/a.csv")) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    reason, place = re.fullmatch(r"sixbar: (.*); the results are in (.*)\n", err).groups()
    assert reason.startswith("out/a")
    assert "No space left on device" in reason
    (table,) = (path for path in Path(place).glob("*.csv") if "events" not in path.name)
    assert len(read(table).frame) == 101
    assert not Path("out").exists()


@pytest.mark.usefixtures("_full")
def test_a_verdict_is_printed_and_the_report_is_elsewhere_when_the_disk_is_full(scene_file, capsys):
    assert main(["validate", scene_file("one"), "--out", "v", "--jobs", "1"]) == 2
    out, err = capsys.readouterr()
    assert out.splitlines()[1].startswith("one    standard  agree")
    assert err.count("\n") == 1
    reason, place = re.fullmatch(r"sixbar: (.*); the results are in (.*)\n", err).groups()
    assert "v: " in reason
    assert {"report.html", "summary.json", "junit.xml", "summary.md"} < {
        p.name for p in Path(place).iterdir()
    }
