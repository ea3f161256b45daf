"""Work spread over an existing Dask cluster, whose workers have this package installed."""

from __future__ import annotations

import logging
import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from comparison.execution.pool import Attempt, Died
from comparison.execution.tasks import Finished, Spread, Task
from comparison.studies.sweep.points import SweepError

PATIENCE = 10.0
"""s, after which waiting for a scheduler that does not answer is stopped."""


def on_cluster(address: str) -> Spread:
    """Return what spreads work over the workers of a scheduler.

    Raises
    ------
    SweepError
        If dask is not installed, or the scheduler does not answer.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise SweepError("--scheduler needs dask: pip install 'sixbar-crossval[cluster]'") from error
    _check_reachable(address)
    # What they say about a lost connection is said here, in one line.
    for name in ("distributed", "tornado", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SweepError(f"--scheduler {address}: does not answer: {reason}") from error

    def spread(attempt: Attempt, tasks: Mapping[str, Task]) -> Finished:
        try:
            yield from _work(client, address, attempt, tasks)
        finally:
            with suppress(OSError, TimeoutError):
                client.close(timeout=2)

    return spread


def _check_reachable(address: str) -> None:
    """Refuse an address at which nobody listens; dask's own client tries for twice its patience.

    Raises
    ------
    SweepError
        If there is no connection within `PATIENCE`.
    """
    parts = urlsplit(address if "://" in address else f"tcp://{address}")
    if parts.scheme not in ("tcp", "tls"):
        return
    try:
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise SweepError(f"--scheduler {address}: {error}") from error
    if not host or not port:
        raise SweepError(f"--scheduler {address}: must be tcp://host:port")
    try:
        socket.create_connection((host, port), timeout=PATIENCE).close()
    except OSError as error:
        raise SweepError(f"--scheduler {address}: does not answer: {error.strerror or error}") from error


def _work(client: Any, address: str, attempt: Attempt, tasks: Mapping[str, Task]) -> Finished:
    from distributed import as_completed

    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        raise SweepError(f"--scheduler {address}: has no workers") from error
    futures = {
        client.submit(_alone, attempt, task, key=f"sixbar-{key}", pure=False, retries=0): key
        for key, task in tasks.items()
    }
    for future in as_completed(futures, loop=client.loop):
        if future.status == "finished":
            yield futures[future], future.result()
        elif future.status == "error" and type(future.exception()).__name__ == "KilledWorker":
            yield futures[future], Died("its worker died")
        else:
            raise SweepError(f"--scheduler {address}: lost; finished runs are kept")


def _alone(attempt: Attempt, task: Any) -> Any:
    """Work off a task of which nobody asks how far it is (on the cluster)."""

    def ignore(share: float) -> None:
        del share

    return attempt(task, ignore)
