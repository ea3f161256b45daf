"""Every write of a command fails once in turn: afterwards the old files or the new ones, and one line.

As SQLite is tested: the first change of a file fails, then the second, until a command passes without one.
The models are fakes. How many faults there were is printed at the end.
"""

from __future__ import annotations

import errno
import itertools
import shutil
import tempfile
from collections import Counter
from pathlib import Path

import pytest
from faulty_disk import contents, failing, small_files

from comparison.cli import main
from comparison.execution.store import fetch, keep
from comparison.report.templates import origin

pytest.importorskip("resource", reason="limits of file sizes are POSIX")
pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("fake_models")]

VOLATILE = ("runs.jsonl",)
"""A store of finished runs grows row by row."""
COMMANDS = {
    "run": ["run", "{scene}", "--model", "reference", "--no-check", "--out", "out/a.csv"],
    "validate": ["validate", "{scene}", "--quick", "--out", "out", "--jobs", "1"],
    "gate": ["gate", "{scene}", "--update", "--baseline", "out/b.toml", "--jobs", "1"],
    "sweep": [
        "study",
        "sweep",
        "{scene}",
        "--grid",
        "drive.speed_rpm={speed}",
        "--out",
        "out",
        "--jobs",
        "1",
    ],
}


LEAST = {"run": 4, "validate": 15, "gate": 2, "sweep": 2}
"""Changes of files by which a command writes its result."""
CODES = [errno.ENOSPC, errno.EACCES, errno.EIO, errno.EROFS]
SIZES = (0, 1, 10, 100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000)
FAULTS: Counter[str] = Counter()


@pytest.fixture(scope="module", autouse=True)
def _reported(request):
    yield
    with request.config.pluginmanager.getplugin("capturemanager").global_and_fixture_disabled():
        print(f"\n{FAULTS.total()} faults of the disk: {dict(FAULTS)}")  # noqa: T201


@pytest.fixture
def command(scene_file, tmp_path, monkeypatch, fake_model):
    """Return what gives a command, old or new, in this process: its exit code and the files in ``out``.

    Its runs are in the cache, which is elsewhere.
    """
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    monkeypatch.setattr("comparison.execution.run.load", lambda _: fake_model.simulate)
    monkeypatch.delenv("SIXBAR_TEST_LOG")  # a file that the fakes write
    written = origin()
    monkeypatch.setattr("comparison.report.templates.origin", lambda: written)  # with the time of day
    text = Path(scene_file("own", 9.0, "groups = []\n")).read_text()
    for which, gravity in (("old", "9.0"), ("new", "9.5")):
        (tmp_path / which).mkdir()
        (tmp_path / which / "own.toml").write_text(text.replace("9.0", gravity))

    def give(name: str, which: str) -> int:
        values = {"scene": tmp_path / which / "own.toml", "speed": 100 if which == "old" else 150}
        return main([word.format(**values) for word in COMMANDS[name]])

    return give


def comparable(files: dict[str, bytes]) -> dict[str, bytes]:
    return {name: content for name, content in files.items() if not name.endswith(VOLATILE)}


def restore(files: dict[str, bytes]) -> None:
    shutil.rmtree("out")
    for name, content in files.items():
        path = Path("out", name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def prepared(command, name, capsys) -> tuple[dict[str, bytes], dict[str, bytes]]:
    """Return the files of the old and of the new state; all runs are cached then."""
    assert command(name, "old") == 0
    old = contents(Path("out"))
    assert command(name, "new") == 0
    new = contents(Path("out"))
    capsys.readouterr()
    assert comparable(old) != comparable(new)
    return old, new


def held(code: int, old, new, capsys, what: str) -> None:
    out, err = capsys.readouterr()
    assert code in (0, 2), (what, code, err)
    assert "Traceback" not in out + err, what
    assert "internal error" not in err, (what, err)
    assert err.count("\n") == (code == 2), (what, err)
    found = comparable(contents(Path("out")))
    states = [comparable(files) for files in (old, new)]
    assert found in states, (what, sorted(found))
    if code == 0:
        assert found == states[1], what


@pytest.mark.parametrize(
    ("name", "codes"),
    # The one that takes longest has all in turn: what it does with the others is up to the same lines.
    [
        pytest.param(name, codes, id="-".join([name, *(errno.errorcode[code] for code in codes)]))
        for name in COMMANDS
        for codes in ([CODES] if name == "validate" else [[code] for code in CODES])
    ],
)
def test_each_change_of_a_file_fails_in_turn(name, codes, command, capsys):
    old, new = prepared(command, name, capsys)
    faults = 0
    for number in itertools.count(1):
        restore(old)
        with failing(number, codes[number % len(codes)], Path.cwd() / "out") as seen:
            status = command(name, "new")
        held(status, old, new, capsys, f"{name}: {seen[number - 1 : number]}")
        if len(seen) < number:
            break
        faults += 1
    FAULTS[name] += faults
    assert faults >= LEAST[name]


@pytest.mark.parametrize("name", COMMANDS)
def test_a_write_that_ends_in_the_middle(name, command, capsys):
    old, new = prepared(command, name, capsys)
    for size in SIZES:
        restore(old)
        with small_files(size):
            status = command(name, "new")
        held(status, old, new, capsys, f"{name}: {size} bytes")
        FAULTS[name] += status != 0


@pytest.mark.parametrize("code", CODES)
def test_a_cache_holds_a_run_as_it_is_or_not_at_all(code, make_table, monkeypatch, tmp_path):
    folder, table = tmp_path / "own", make_table()
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(folder))
    for number in itertools.count(1):
        folder.mkdir()
        with failing(number, code, folder) as seen:
            keep("key", table)
        found = fetch("key", table.channels, (table.time[0], table.time[-1]))
        assert found is None or found.frame.equals(table.frame), seen[number - 1 :]
        assert not list(folder.rglob(".part-*"))
        if len(seen) < number:
            break
        FAULTS["cache"] += 1
        shutil.rmtree(folder)
    assert found is not None
    assert number > 4  # of the files of a run, and of their folder
