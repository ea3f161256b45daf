"""Sweeps: quantities, failures, resumption, processes and a cluster."""

import shutil
import socket
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fake_model import GRAVITY

from comparison.cli import main
from comparison.studies.sweep import DEFAULTS, SweepError, names, on_cluster, quantity
from comparison.tables.table import Table

pytestmark = pytest.mark.usefixtures("empty_folder")
QUICK = ["--set", "output.samples_per_cycle=50", "--set", "drive.cycles=2.0"]


def test_what_is_measured_of_a_run_whose_numbers_are_known():
    times = np.linspace(0.0, 2.0, 5)
    frame = pd.DataFrame({"time": times, "slider_y": [0.0, 9.0, 1.0, -3.0, 2.0]})
    events = pd.DataFrame({"impulse": [0.25, 0.5], "peak_force": [3.0, 7.0]})
    run = Table(frame, events, {"slider_y": {"min": -3.5, "max": 9.5}}, {"counters": {"steps": 12}})
    ideal = Table(pd.DataFrame({"time": times, "slider_y": [0.0, 0.0, 0.5, 0.0, 0.5]}))
    measures = {
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
    assert {name: quantity(name, run, ideal, 1.0) for name in measures} == measures
    assert quantity("max:slider_y", Table(frame), None, 1.0) == 9.0
    assert {quantity(name, Table(frame), None, 1.0) for name in ("contacts", "impulse", "steps")} == {None}
    assert quantity("largest:impulse", Table(frame, events[:0]), None, 1.0) == 0.0
    assert set(DEFAULTS) | set(measures) <= set(names({}))


def sweep(*arguments):
    return main(["study", "sweep", "150rpm-0.2mm", *QUICK, "--out", "out", *arguments])


def test_runs_that_fail_are_rows_and_only_what_befell_a_process_is_tried_again(fake_models, capsys):
    values = f"9.81,{GRAVITY.crash},{GRAVITY.refuse},{GRAVITY.fail},{GRAVITY.nan}"
    options = ["--grid", f"environment.gravity={values}", "--model", "reference,exudyn", "--jobs", "2"]
    assert sweep(*options) == 0
    out, err = capsys.readouterr()
    assert len(out.splitlines()) == 12  # every row, below the names, and the path
    assert err == "sixbar: warning: 4 of 10 runs did not succeed: see the column status\n"
    rows = pd.read_csv("out/sweep.csv").query("model == 'exudyn'")
    assert rows["status"].tolist() == ["success", "crashed", "bad input", "newton-failed", "unusable"]
    before = fake_models.read_text().count("\n")
    assert sweep(*options) == 0
    assert fake_models.read_text().count("\n") == before + 1


@pytest.mark.slow
def test_a_cluster_gives_the_same_table(fake_models):
    distributed = pytest.importorskip("distributed")
    axis = ["--latin", "contact.youngs_modulus.slider=1e9:2e9", "--points", "12"]
    options = [*axis, "--model", "reference,exudyn"]
    workers = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(host="127.0.0.1", **workers) as cluster:
        assert sweep(*options, "--scheduler", cluster.scheduler_address) == 0
    table = Path("out/sweep.csv").read_bytes()
    shutil.rmtree("out")
    assert sweep(*options, "--jobs", "2") == 0
    assert Path("out/sweep.csv").read_bytes() == table
    assert table.count(b",success,") == 24
    assert len({line.split()[-1] for line in fake_models.read_text().splitlines()}) == 4  # processes


# A server that listens and does not answer
@pytest.mark.parametrize("address", ["nowhere.invalid", pytest.param("silent", marks=pytest.mark.slow)])
def test_a_scheduler_that_does_not_answer_is_named_in_one_line(address):
    pytest.importorskip("distributed")
    with socket.create_server(("127.0.0.1", 0)) as server:
        host = f"127.0.0.1:{server.getsockname()[1]}" if address == "silent" else f"{address}:8786"
        with pytest.raises(SweepError, match=f"^--scheduler tcp://{host}: does not answer[^\n]*$"):
            on_cluster(f"tcp://{host}")
