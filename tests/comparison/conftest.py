"""Tables with known differences, and models with a known answer for the worker processes."""

import shutil
import sys
from contextlib import contextmanager
from pathlib import Path

import fake_model as model
import pandas as pd
import pytest
from installed import write_package

from comparison.cli.console import Lines
from comparison.execution.pool import kept_workers
from comparison.models import ROOT
from comparison.scene import load_scene
from comparison.tables.table import Table

FAKES = ("reference_model", "exudyn_model", "truth_press")


@pytest.fixture(autouse=True)
def _progress_without_time(monkeypatch):
    """Stop the clock of progress: the output of a command does not depend on the time of its runs."""
    monkeypatch.setattr(Lines.__init__, "__defaults__", (lambda: 0.0,))


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    """An empty cache: every run is a new one."""
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))


@pytest.fixture
def scene():
    """The paper's central case with fewer samples; the tests of the report have another."""
    return load_scene("150rpm-0.2mm", {"output.samples_per_cycle": 200})


@pytest.fixture
def make_table():
    """Tables of the central case: ``make_table(error=..., stretch=...)``, see `fake_model.signals`."""
    central_case = load_scene("150rpm-0.2mm", {"output.samples_per_cycle": 200})

    def make(error=0.0, stretch=0.0, scene=central_case, **changes):
        return Table(pd.DataFrame(model.signals(scene.data, error, stretch) | changes))

    return make


@contextmanager
def _fakes(folder, monkeypatch):
    """Put fakes of both models and of a truth engine where worker processes find them.

    The folder holds their cache too; the value is the log, with a line a run.
    """
    for name in ("reference_model", "exudyn_model"):
        (folder / "fakes" / name).mkdir(parents=True, exist_ok=True)
        shutil.copy(model.__file__, folder / "fakes" / name / "__init__.py")
        shutil.copy(ROOT / name / "formulations.toml", folder / "fakes" / name)
    source = Path(model.__file__).read_text("utf-8")
    write_package(folder / "fakes", "truth_press", source, {"truth": "truth_press:simulate"})
    for name in FAKES:
        # Another test may have imported the real one, whose sources would then stand for the fake's.
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(str(folder / "fakes"))
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(folder / "cache"))
    log = folder / "log"
    monkeypatch.setenv("SIXBAR_TEST_LOG", str(log))
    log.touch()
    with kept_workers():  # nothing that they import changes meanwhile
        yield log
    for name in FAKES:
        sys.modules.pop(name, None)  # this process may have imported the fake; the real one is put back


@pytest.fixture(scope="session")
def fakes():
    """Context of fake models with a folder of their own, for fixtures that several tests share."""
    return _fakes


@pytest.fixture
def fake_models(tmp_path, monkeypatch):
    """Fake models and an empty cache; the value is the log of the runs."""
    with _fakes(tmp_path, monkeypatch) as log:
        yield log


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Put a package where Python and its worker processes find it, as an installer would."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)

    def make(module, source, points, version="1"):
        monkeypatch.delitem(sys.modules, module, raising=False)
        return write_package(site, module, source, points, version)

    return make
