"""A sweep as it is run: rows, resumption after a kill, a full disk, a cluster."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from comparison.cli import main
from comparison.execution.store import LedgerError, append_row, read_rows

ROOT = Path(__file__).parents[4]


PATIENCE = 600.0


QUICK = ["--set", "output.samples_per_cycle=50", "--set", "drive.cycles=2.0"]


def sweep(*arguments):
    return main(["study", "sweep", "150rpm-0.2mm", *QUICK, "--out", "out", *arguments])


def test_a_sweep_writes_a_row_for_every_run_also_for_those_that_fail(here, gravity, capsys):
    values = f"9.81,{gravity.crash},{gravity.refuse},{gravity.fail},{gravity.nan}"
    asked = ["--grid", f"environment.gravity={values}", "--model", "reference,exudyn", "--jobs", "2"]
    assert sweep(*asked) == 0
    out, err = capsys.readouterr()
    assert out.startswith("point  environment.gravity  model")
    assert out.endswith("... and 5 more rows\nout/sweep.csv\n")
    assert err == "sixbar: warning: 4 of 10 runs did not succeed: see the column status\n"
    table = pd.read_csv("out/sweep.csv")
    assert table["point"].tolist() == [1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    assert table["model"].tolist() == ["reference", "exudyn"] * 5
    theirs = table[table["model"] == "exudyn"]
    assert theirs["status"].tolist() == ["success", "crashed", "bad input", "newton-failed", "unusable"]
    assert theirs["message"].iloc[1] == "its process ended with code 3"
    assert theirs["message"].iloc[4].startswith("the exudyn run: slider_vy is nan in data row 8")
    assert table["contacts"].notna().sum() == 6
    # What happened to a process is tried again, what a run came to is not.
    runs = here.read_text().count("\n")
    assert sweep(*asked) == 0
    assert here.read_text().count("\n") == runs + 1


@pytest.mark.usefixtures("here")
def test_the_table_does_not_depend_on_the_number_of_processes():
    assert sweep("--latin", "drive.speed_rpm=100:200", "--points", "12", "--jobs", "1") == 0
    one = Path("out/sweep.csv").read_bytes()
    Path("out/runs.jsonl").unlink()
    assert sweep("--latin", "drive.speed_rpm=100:200", "--points", "12", "--jobs", "2") == 0
    assert Path("out/sweep.csv").read_bytes() == one


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--grid", "drive.sped_rpm=1"], "'drive.sped_rpm' is not a key of a scene; did you mean 'drive.sp"),
        (["--grid", "drive=1"], "'drive' is not a key of a scene"),
        (["--grid", "drive.speed_rpm="], "needs at least one value"),
        (["--grid", "drive.speed_rpm"], "must be key=a,b,c"),
        ([], "give one of --grid, --list and --latin"),
        (["--grid", "drive.speed_rpm=1", "--latin", "drive.speed_rpm=1:2"], "give one of --grid"),
        (["--latin", "drive.speed_rpm=2:1"], "low < high"),
        (["--latin", "drive.speed_rpm=1:2", "--points", "0"], "--points 0 must be"),
        (["--list", "none.csv"], "--list none.csv: cannot be read: No such file"),
        (["--grid", "drive.speed_rpm=1", "--output", "peak_eror:slider_y"], "did you mean 'peak_error:sl"),
        (["--grid", "drive.speed_rpm=1", "--model", "adams"], "model 'adams' is not known"),
    ],
)  # fmt: skip
def test_a_mistake_is_reported_in_one_line_before_anything_runs(arguments, message, here, capsys):
    assert sweep(*arguments) == 2
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert here.read_text() == ""


def environment(tmp_path):
    """What a process of its own needs to find this package and the fake models."""
    paths = [str(tmp_path / "fakes"), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(paths)}


def command(*arguments):
    return [sys.executable, "-m", "comparison", "study", "sweep", "150rpm-0.2mm", *QUICK, *arguments]


def finished(command_, env, cwd):
    subprocess.run(command_, env=env, cwd=cwd, check=True, stdout=subprocess.DEVNULL)


def lines(path):
    return path.read_bytes().count(b"\n") if path.exists() else 0


def killed_half_way(command_, ledger, count, env, cwd):
    """Start a sweep, kill its whole process group when half of its rows are kept; how many rows there are."""
    with subprocess.Popen(command_, env=env, cwd=cwd, start_new_session=True) as process:
        while lines(ledger) < count // 2:
            assert process.poll() is None
            time.sleep(0.002)
        os.killpg(process.pid, signal.SIGKILL)
    return lines(ledger)


def test_a_killed_sweep_goes_on_where_it_was_and_ends_with_the_same_table(here, tmp_path):
    count = 60
    axis = ["--latin", "clearance.slider=1e-4:3e-4", "--points", str(count), "--jobs", "2"]
    env = environment(tmp_path)
    subprocess.run(
        command(*axis, "--out", "whole"), env=env, cwd=tmp_path, check=True, stdout=subprocess.DEVNULL
    )
    ledger = tmp_path / "broken" / "runs.jsonl"
    # Two runs a row: the scene's and the ideal mechanism's. After three quarters of them the models wait.
    held = env | {"SIXBAR_TEST_HOLD": str(here.read_text().count("\n") + 2 * count * 3 // 4)}
    kept = killed_half_way(command(*axis, "--out", "broken"), ledger, count, held, tmp_path)
    assert count // 2 <= kept < count
    assert not (tmp_path / "broken" / "sweep.csv").exists()
    before = here.read_text().count("\n")
    finished(command(*axis, "--out", "broken"), env, tmp_path)
    assert here.read_text().count("\n") - before == 2 * (count - kept)
    assert (tmp_path / "broken" / "sweep.csv").read_bytes() == (tmp_path / "whole" / "sweep.csv").read_bytes()


FULL = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
from comparison.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_a_full_disk_is_reported_in_one_line_and_what_was_kept_stays(here, tmp_path):
    """The system refuses to let any file grow beyond 2000 bytes, in the midst of a line."""
    axis = ["--grid", "drive.speed_rpm=100,110,120,130,140,150,160,170,180,190", "--jobs", "1"]
    env = environment(tmp_path)
    whole = command(*axis, "--out", "whole")
    finished(whole, env, tmp_path)
    arguments = [sys.executable, "-c", FULL, *command(*axis, "--out", "full")[3:]]
    ended = subprocess.run(arguments, env=env, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr.startswith("sixbar: full/runs.jsonl: cannot be written: ")
    assert ended.stderr.count("\n") == 1
    kept = len(read_rows(tmp_path / "full" / "runs.jsonl"))
    assert 1 <= kept < 10
    before = here.read_text().count("\n")
    finished(command(*axis, "--out", "full"), env, tmp_path)
    assert here.read_text().count("\n") - before == 2 * (10 - kept)
    assert (tmp_path / "full" / "sweep.csv").read_bytes() == (tmp_path / "whole" / "sweep.csv").read_bytes()


def test_a_ledger_passes_over_a_line_that_was_cut_off_and_gives_the_same_bits(tmp_path):
    path = tmp_path / "runs.jsonl"
    assert read_rows(path) == {}
    row = append_row(path, "a", {"x": 0.1 + 0.2, "y": np.float64("nan"), "z": [1, None]})
    assert row == {"x": 0.1 + 0.2, "y": None, "z": [1, None]}
    with path.open("ab") as file:
        file.write(b'{"key":"b","row":{"x"')
    append_row(path, "c", {"x": 1.0})
    assert read_rows(path) == {"a": row, "c": {"x": 1.0}}
    assert [json.loads(line)["key"] for line in path.read_text().splitlines() if '"sha256"' in line] == [
        "a",
        "c",
    ]
    with pytest.raises(LedgerError, match="cannot be written"):
        append_row(tmp_path / "none" / "runs.jsonl", "a", {})


NO_DASK = "dask is not installed: pip install 'sixbar-crossval[cluster]'"


@pytest.fixture
def scheduler(fake_models, tmp_path):
    """The address of a scheduler with two workers, in processes of their own on this machine."""
    assert fake_models.exists()  # its workers' models
    if importlib.util.find_spec("distributed") is None:
        pytest.skip(NO_DASK)
    found, env = tmp_path / "scheduler.json", environment(tmp_path)
    quiet = {"env": env, "cwd": tmp_path, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    local = ["--host", "127.0.0.1", "--no-dashboard"]
    start = [sys.executable, "-m", "distributed.cli.dask_scheduler", *local, "--port", "0"]
    processes = [subprocess.Popen([*start, "--scheduler-file", str(found)], **quiet)]
    try:
        until = time.monotonic() + PATIENCE
        while not found.exists() and time.monotonic() < until:
            time.sleep(0.05)
        address = json.loads(found.read_text())["address"]
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


def test_a_scheduler_that_is_not_there_is_reported_in_one_line(here, tmp_path):
    if importlib.util.find_spec("distributed") is None:
        pytest.skip(NO_DASK)
    arguments = command("--grid", "drive.speed_rpm=1", "--scheduler", "tcp://127.0.0.1:9", "--out", "out")
    ended = subprocess.run(
        arguments, env=environment(tmp_path), cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 2
    assert "--scheduler tcp://127.0.0.1:9: does not answer" in ended.stderr
    assert ended.stderr.count("\n") == 1
    assert here.read_text() == ""


@pytest.mark.slow
def test_five_hundred_runs_of_the_reference_killed_half_way(tmp_path):
    count = 500
    axis = [
        "--latin",
        "drive.speed_rpm=120:180",
        "--latin",
        "clearance.slider=1e-4:3e-4",
        "--points",
        str(count),
    ]
    env = environment(tmp_path)
    subprocess.run(
        command(*axis, "--out", "whole"), env=env, cwd=tmp_path, check=True, stdout=subprocess.DEVNULL
    )
    broken = command(*axis, "--out", "broken")
    kept = killed_half_way(broken, tmp_path / "broken" / "runs.jsonl", count, env, tmp_path)
    assert count // 2 <= kept < count
    finished(broken, env, tmp_path)
    assert (tmp_path / "broken" / "sweep.csv").read_bytes() == (tmp_path / "whole" / "sweep.csv").read_bytes()
    assert pd.read_csv(tmp_path / "whole" / "sweep.csv")["status"].eq("success").all()


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("asked", [["--output", "max:nope"], ["--model", "nobody"]])
def test_a_refused_sweep_leaves_no_folder(asked):
    assert sweep("--grid", "drive.speed_rpm=100", *asked) == 2
    assert not Path("out").exists()
