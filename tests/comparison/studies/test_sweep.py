"""Sweeps: quantities, failures, resumption, processes and a cluster."""

import importlib.util
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from comparison.cli import main
from comparison.studies import sweep as runs
from comparison.studies.sweep import USUAL, SweepError, names, on_cluster, quantity
from comparison.tables.table import Table

ROOT = Path(__file__).parents[3]
PATIENCE = 600.0
QUICK = ["--set", "output.samples_per_cycle=50", "--set", "drive.cycles=2.0"]


@pytest.fixture
def here(fake_models, elsewhere):  # noqa: ARG001
    """Fake models, and an empty working folder; the log of what ran."""
    return fake_models


def test_what_is_measured_of_a_run_whose_numbers_are_known():
    time_ = np.linspace(0.0, 2.0, 5)
    frame = pd.DataFrame({"time": time_, "slider_y": [0.0, 9.0, 1.0, -3.0, 2.0]})
    events = pd.DataFrame({"impulse": [0.25, 0.5], "peak_force": [3.0, 7.0]})
    run = Table(frame, events, {"slider_y": {"min": -3.5, "max": 9.5}}, {"counters": {"steps": 12}})
    ideal = Table(pd.DataFrame({"time": time_, "slider_y": [0.0, 0.0, 0.5, 0.0, 0.5]}))
    known = {
        "min:slider_y": -3.5,
        "max:slider_y": 9.5,
        "end:slider_y": 2.0,
        "rms:slider_y": np.sqrt(95 / 5),
        "peak_error:slider_y": 3.0,  # the largest, 9, is in the first cycle; in the second it is -3
        "contacts": 2.0,
        "impulse": 0.75,
        "largest:peak_force": 7.0,
        "steps": 12.0,
        "max:slider_vx": None,
    }
    assert {name: quantity(name, run, ideal, 1.0) for name in known} == known
    assert quantity("max:slider_y", Table(frame), None, 1.0) == 9.0
    assert {quantity(name, Table(frame), None, 1.0) for name in ("contacts", "impulse", "steps")} == {None}
    assert quantity("largest:impulse", Table(frame, events[:0]), None, 1.0) == 0.0
    assert set(USUAL) | set(known) <= set(names())


def lines(path):
    return path.read_bytes().count(b"\n") if path.exists() else 0


def sweep(*arguments):
    return main(["study", "sweep", "150rpm-0.2mm", *QUICK, "--out", "out", *arguments])


def test_runs_that_fail_in_any_way_are_rows_and_only_what_befell_a_process_is_tried_again(
    here, gravity, capsys
):
    values = f"9.81,{gravity.crash},{gravity.refuse},{gravity.fail},{gravity.nan}"
    asked = ["--grid", f"environment.gravity={values}", "--model", "reference,exudyn", "--jobs", "2"]
    assert sweep(*asked) == 0
    out, err = capsys.readouterr()
    assert len(out.splitlines()) == 12  # every row, below the names, and the path
    assert err == "sixbar: warning: 4 of 10 runs did not succeed: see the column status\n"
    theirs = pd.read_csv("out/sweep.csv").query("model == 'exudyn'")
    assert theirs["status"].tolist() == ["success", "crashed", "bad input", "newton-failed", "unusable"]
    before = lines(here)
    assert sweep(*asked) == 0
    assert lines(here) == before + 1


BAD = ["nan", "-inf", "fast", "", "2020-01-01", '"[1, nan]"', "0"]


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("values", "code"), [(BAD, 2), (["100", *BAD], 0), (["nan", "nan"], 2)])
def test_a_value_that_no_scene_takes_is_a_row_and_loses_no_other(values, code):
    Path("list.csv").write_text("\n".join(["drive.speed_rpm", *values, ""]).replace("\n\n", '\n""\n'))
    assert sweep("--list", "list.csv", "--output", "max:slider_vx", "--jobs", "1") == code
    rows = pd.read_csv("out/sweep.csv", keep_default_na=False)
    assert rows["status"].tolist() == ["success" if value == "100" else "bad input" for value in values]
    assert all("drive.speed_rpm = " in text for text in rows.query("status == 'bad input'")["message"])


@pytest.mark.usefixtures("here")
def test_the_table_does_not_depend_on_the_number_of_processes_and_a_partner_has_a_material_of_its_own():
    grids = [f"--grid=contact.{key}" for key in ("poisson=0.2,0.3", "youngs_modulus.slider=1e9,2e9")]
    tables = []
    for jobs in ("1", "2"):
        assert sweep(*grids, "--jobs", jobs) == 0
        tables.append(Path("out/sweep.csv").read_bytes())
        shutil.rmtree("out/runs")
    assert tables[0] == tables[1]
    assert tables[0].count(b",success,") == 4


def environment(tmp_path):
    """What a process of its own needs to find this package and the fake models."""
    paths = [str(tmp_path / "fakes"), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(paths)}


def command(*arguments):
    return [sys.executable, "-m", "comparison", "study", "sweep", "150rpm-0.2mm", *QUICK, *arguments]


def test_a_killed_sweep_goes_on_where_it_was_and_ends_with_the_same_table(here, tmp_path):
    count = 30
    axis = ["--latin", "clearance.slider=1e-4:3e-4", "--points", str(count), "--jobs", "2"]
    where = {"env": environment(tmp_path), "cwd": tmp_path}
    subprocess.run(command(*axis, "--out", "whole"), **where, check=True, stdout=subprocess.DEVNULL)
    # Two runs a row: the scene's and the ideal mechanism's. After three quarters of them the models wait.
    held = where["env"] | {"SIXBAR_TEST_HOLD": str(lines(here) + 2 * count * 3 // 4)}
    rows = tmp_path / "broken" / "runs"
    broken = command(*axis, "--out", "broken")
    with subprocess.Popen(broken, env=held, cwd=tmp_path, start_new_session=True) as process:
        while len(list(rows.glob("[0-9a-f]*"))) < count // 2:
            assert process.poll() is None
            time.sleep(0.002)
        os.killpg(process.pid, signal.SIGKILL)
    kept = len(list(rows.glob("[0-9a-f]*")))
    assert count // 2 <= kept < count
    assert not (tmp_path / "broken" / "sweep.csv").exists()
    before = lines(here)
    subprocess.run(broken, **where, check=True, stdout=subprocess.DEVNULL)
    assert lines(here) - before == 2 * (count - kept)
    assert (tmp_path / "broken" / "sweep.csv").read_bytes() == (tmp_path / "whole" / "sweep.csv").read_bytes()


NO_DASK = "dask is not installed: pip install 'sixbar-crossval[cluster]'"


@pytest.fixture
def scheduler(fake_models, tmp_path):
    """The address of a scheduler with two workers, in processes of their own on this machine."""
    assert fake_models.exists()  # its workers' models
    if importlib.util.find_spec("distributed") is None:
        pytest.skip(NO_DASK)
    result, env = tmp_path / "scheduler.json", environment(tmp_path)
    quiet = {"env": env, "cwd": tmp_path, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    local = ["--host", "127.0.0.1", "--no-dashboard"]
    start = [sys.executable, "-m", "distributed.cli.dask_scheduler", *local, "--port", "0"]
    processes = [subprocess.Popen([*start, "--scheduler-file", str(result)], **quiet)]
    try:
        until = time.monotonic() + PATIENCE
        while not result.exists() and time.monotonic() < until:
            time.sleep(0.05)
        address = json.loads(result.read_text())["address"]
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, *local, "--nthreads", "1"]
        processes += [subprocess.Popen([*worker, "--no-nanny"], **quiet) for _ in range(2)]
        yield address
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def test_a_cluster_gives_the_same_table(scheduler, here, tmp_path):
    axis = ["--latin", "drive.speed_rpm=100:200", "--points", "12", "--model", "reference,exudyn"]
    env = environment(tmp_path)
    for more in (["--out", "processes", "--jobs", "2"], ["--out", "cluster", "--scheduler", scheduler]):
        subprocess.run(command(*axis, *more), env=env, cwd=tmp_path, check=True, timeout=PATIENCE)
    ours, theirs = (Path(tmp_path, name, "sweep.csv").read_bytes() for name in ("processes", "cluster"))
    assert ours == theirs
    assert len({line.split()[-1] for line in here.read_text().splitlines()}) == 4  # processes


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("127.0.0.1:9", "does not answer"),
        ("tcp://127.0.0.1", "must be tcp://host:port"),
        ("tcp://127.0.0.1:99999", "Port out of range"),
        ("tcp://nowhere.invalid:8786", "does not answer"),
        ("stays silent", "does not answer"),
    ],
)
def test_a_scheduler_that_does_not_answer_is_named_in_one_line(address, message, monkeypatch):
    """Dask's client would try for twice the time that it is given, or without end."""
    pytest.importorskip("distributed", reason=NO_DASK)
    monkeypatch.setattr(runs, "PATIENCE", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        if address == "stays silent":
            address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(SweepError, match=f"^--scheduler {address}: {message}[^\n]*$"):
            on_cluster(address)
