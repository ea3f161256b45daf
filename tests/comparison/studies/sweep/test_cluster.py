"""Addresses at which there is no scheduler."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import threading

import pytest

from comparison.studies.sweep import cluster
from comparison.studies.sweep.cluster import on_cluster
from comparison.studies.sweep.points import SweepError

pytest.importorskip("distributed", reason="pip install 'sixbar-crossval[cluster]'")


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp://127.0.0.1:9", "does not answer"),
        ("127.0.0.1:9", "does not answer"),
        ("tcp://127.0.0.1", "must be tcp://host:port"),
        ("tcp://127.0.0.1:99999", "Port out of range"),
        ("tcp://nowhere.invalid:8786", "does not answer"),
        ("", "must be tcp://host:port"),
    ],
)
def test_dask_is_not_even_asked_where_nobody_listens(address, message, monkeypatch):
    """Its client would try for twice the time that it is given."""
    monkeypatch.setattr("distributed.Client", lambda *_, **__: pytest.fail("asked"))
    with pytest.raises(SweepError, match=message) as refused:
        on_cluster(address)
    assert "\n" not in str(refused.value)


def test_a_host_that_swallows_packets_costs_one_time_the_patience(monkeypatch):
    asked = []

    def swallow(_place, timeout):
        asked.append(timeout)
        raise TimeoutError("timed out")

    monkeypatch.setattr(socket, "create_connection", swallow)
    with pytest.raises(SweepError, match="does not answer: timed out"):
        on_cluster("tcp://10.255.255.1:8786")
    assert asked == [cluster.PATIENCE]


@pytest.mark.slow
def test_who_listens_and_is_no_scheduler_is_one_line():
    code = (
        "from comparison.studies.sweep import cluster\n"
        "cluster.PATIENCE = 1.0\n"
        "try:\n    cluster.on_cluster(__import__('sys').argv[1])\n"
        "except cluster.SweepError as error:\n    print(error)\n"
    )
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            with contextlib.suppress(OSError):
                while True:
                    server.accept()[0].close()

        threading.Thread(target=answer, daemon=True).start()
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        ended = subprocess.run(
            [sys.executable, "-c", code, address], capture_output=True, text=True, check=False
        )
    assert ended.stdout.startswith(f"--scheduler {address}: does not answer")
    assert ended.stdout.count("\n") == 1
    assert ended.stderr == ""
