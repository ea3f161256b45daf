"""Files are complete or as before (tests/cli has what cannot be written)."""

import errno
from pathlib import Path

import pytest

from comparison.files import replacing, replacing_in


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()


def test_an_error_of_writing_names_the_file():
    """The system's own error on a full disk names none."""
    with pytest.raises(OSError, match="No space") as full, replacing(Path("folder/a.csv")):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert full.value.filename == "folder/a.csv"


@pytest.mark.parametrize("failing", ["b", "sub/c"])
def test_files_of_one_folder_are_replaced_together_or_not_at_all(failing):
    """Moving the last, to a folder with content or below a file, fails after the others have moved."""
    folder = Path("folder")
    (folder / "a").write_text("old")
    (folder / "b" / "c").mkdir(parents=True)
    (folder / "sub").write_text("old")
    before = {path: path.read_text() for path in folder.rglob("*") if path.is_file()}

    def write(*names):
        with replacing_in(folder) as part:
            for name in names:
                (part / name).parent.mkdir(exist_ok=True)
                (part / name).write_text("new")

    with pytest.raises(OSError, match="folder") as refused:
        write("0", "a", failing)
    assert str(refused.value.filename).startswith("folder/")
    assert {path: path.read_text() for path in folder.rglob("*") if path.is_file()} == before
    write("a", "other/c")
    assert (folder / "a").read_text() == (folder / "other" / "c").read_text() == "new"
    assert not list(folder.glob(".*"))
