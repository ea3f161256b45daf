"""Every write of a command fails once in turn: afterwards the old files or the new ones, and one line.

As SQLite is tested: the first change of a file fails, then the second, until a command passes without one.
The models are fakes. How many faults there were is printed at the end.
"""

import errno
import itertools
import os
import shutil
import sys
import tempfile
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.execution.store import fetch, keep
from comparison.report.page import origin

pytest.importorskip("resource", reason="limits of file sizes are POSIX")
pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("fake_models")]

_CHANGES = ("os.rename", "os.mkdir", "os.link", "os.symlink", "os.truncate")
_hooks = []


def _audit(event, arguments):
    for hook in _hooks:
        hook(event, arguments)


sys.addaudithook(_audit)


def _changed(event, arguments):
    """Return the paths that an operation creates or changes."""
    if event == "open":
        _, mode, flags = arguments
        writing = (isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)) or (
            isinstance(mode, str) and set(mode) & set("wax+")
        )
        paths = arguments[:1] if writing else ()
    else:
        paths = arguments[:2] if event in _CHANGES else ()
    return [os.fsdecode(path) for path in paths if isinstance(path, str | bytes)]


@contextmanager
def failing(number, code, folder):
    """Let the ``number``-th change below a folder fail, and none after it; yields the changes so far."""
    seen = []

    def hook(event, arguments):
        for path in _changed(event, arguments):
            if folder in (Path.cwd() / path).parents:
                seen.append(f"{event} {path}")
                if len(seen) == number:
                    raise OSError(code, os.strerror(code), path if code == errno.EACCES else None)
                return

    _hooks.append(hook)
    try:
        yield seen
    finally:
        _hooks.clear()


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


COMMANDS = {
    "run": "run {scene} --model reference --out out/a.csv",
    "validate": "validate {scene} --quick --out out --jobs 1",
    "gate": "gate {scene} --update --baseline out/b.toml --jobs 1",
    "sweep": "study sweep {scene} --grid drive.speed_rpm={speed} --out out --jobs 1",
}
LEAST = {"run": 4, "validate": 15, "gate": 2, "sweep": 2}
"""Changes of files by which a command writes its result."""
CODES = [errno.ENOSPC, errno.EACCES, errno.EIO, errno.EROFS]
FAULTS = Counter()


@pytest.fixture(scope="module", autouse=True)
def _reported(request):
    yield
    with request.config.pluginmanager.getplugin("capturemanager").global_and_fixture_disabled():
        print(f"\n{FAULTS.total()} faults of the disk: {dict(FAULTS)}")  # noqa: T201


def state():
    """Files in ``out`` but for the store of a sweep, which grows row by row."""
    files = contents(Path("out"))
    return {name: content for name, content in files.items() if not name.endswith("runs.jsonl")}


@pytest.fixture
def tried(scene_file, tmp_path, monkeypatch, fake_model, capsys):
    """Return what gives a command while the disk fails, and holds what is left against the old and new state.

    The command is given in this process; its runs are in the cache, which is elsewhere.
    """
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    monkeypatch.setattr("comparison.execution.run.load", lambda _: fake_model.simulate)
    monkeypatch.delenv("SIXBAR_TEST_LOG")  # a file that the fakes write
    written = origin()
    monkeypatch.setattr("comparison.cli.results.origin", lambda: written)  # with the time of day
    text = Path(scene_file("own", 9.0, "groups = []\n")).read_text()
    for which, gravity in (("old", "9.0"), ("new", "9.5")):  # now, while the disk has no fault
        (tmp_path / f"{which}-scene").mkdir()
        (tmp_path / f"{which}-scene" / "own.toml").write_text(text.replace("9.0", gravity))
    kept = {}

    def give(name, which):
        scene, speed = tmp_path / f"{which}-scene" / "own.toml", {"old": 100, "new": 150}[which]
        return main(COMMANDS[name].format(scene=scene, speed=speed).split())

    def attempt(name, fault):
        if not kept:
            for which in ("old", "new"):
                assert give(name, which) == 0
                kept[which] = state()
                if which == "old":
                    shutil.copytree("out", tmp_path / "old")
            assert kept["old"] != kept["new"]
        shutil.rmtree("out")
        shutil.copytree(tmp_path / "old", "out")
        capsys.readouterr()
        with fault as seen:
            code = give(name, "new")
        out, err = capsys.readouterr()
        assert code in (0, 2), err
        assert "Traceback" not in out + err
        assert "internal error" not in err
        assert err.count("\n") == (code == 2), err
        assert state() in ([kept["new"]] if code == 0 else list(kept.values()))
        FAULTS[name] += code != 0
        return seen

    return attempt


@pytest.mark.parametrize("code", [*CODES, None], ids=lambda code: errno.errorcode.get(code, "all in turn"))
@pytest.mark.parametrize("name", COMMANDS)
def test_each_change_of_a_file_fails_in_turn(name, code, tried):
    # The one that takes longest has all in turn: what it does with the others is up to the same lines.
    if (code is None) != (name == "validate"):
        pytest.skip("either each, or all in turn")
    for number in itertools.count(1):
        seen = tried(name, failing(number, code or CODES[number % len(CODES)], Path.cwd() / "out"))
        if len(seen) < number:
            break
    assert number > LEAST[name]


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
        result = fetch("key", table.channels, (table.time[0], table.time[-1]))
        assert result is None or result.frame.equals(table.frame), seen[number - 1 :]
        assert not list(folder.rglob(".part-*"))
        if len(seen) < number:
            break
        FAULTS["cache"] += 1
        shutil.rmtree(folder)
    assert result is not None
    assert number > 4  # of the files of a run, and of their folder
