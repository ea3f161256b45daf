"""Twins of the press followed in worker processes; what was found is kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from comparison.arrays import Array
from comparison.cache import cache_folder
from comparison.engines import fingerprint
from comparison.ledger import Row
from comparison.machine import platform_name
from comparison.nonlinear.twins import Twins, follow
from comparison.run import Progress, RunError, runner
from comparison.scene import Scene, SceneError, digest
from comparison.sources import sources
from comparison.spread import finish, on_processes
from comparison.studies.nonlinear.press import CLEAR_OF_WALLS, Press, Run, by_turn, gaps, scale, states

TRANSIENT = 10
"""Turns before the first that counts; the start is forgotten after one."""
SAMPLES = 200
"""A turn; stages begin and end at samples."""
ROUND_OFF = 1e-15
"""m; some ten times the rounding of a coordinate of 0.55 m."""
_SOURCES = ("nonlinear/twins.py", "run.py", "studies/nonlinear/chains.py", "studies/nonlinear/press.py")


@dataclass(frozen=True)
class Chain:
    """Twins that are followed through many turns.

    Attributes
    ----------
    scene
        With its solvers' settings.
    model
        Who runs it.
    turns
        How many are noted.
    distances
        m, growing.
    """

    scene: Scene
    model: str
    turns: int
    distances: tuple[float, ...]


def followed(chains: Sequence[Chain], n_jobs: int, on_progress: Progress | None) -> list[Row]:
    """Follow all chains; the row of each, in their order: see `attempt`."""
    files = sources(*_SOURCES)
    prints = {model: fingerprint(model) for model in {chain.model for chain in chains}}
    keys = [
        digest(
            {
                "scene": chain.scene.hash,
                "model": [chain.model, prints[chain.model]],
                "turns": chain.turns,
                "distances": chain.distances,
                "sources": files,
                "machine": platform_name(),
            }
        )
        for chain in chains
    ]
    cache_folder().mkdir(parents=True, exist_ok=True)
    ledger = cache_folder() / f"nonlinear-{files[:16]}.jsonl"
    rows = finish(attempt, dict(zip(keys, chains, strict=True)), ledger, on_processes(n_jobs), on_progress)
    return [rows[key] for key in keys]


def attempt(chain: Chain, progress: Callable[[float], None]) -> Row:
    """Follow one chain; what goes wrong becomes its row's message."""
    del progress
    try:
        twins = follow_press(chain)
    except (RunError, SceneError, ValueError) as error:
        return {"status": "failed", "message": " ".join(str(error).split())}
    return {
        "status": "success",
        "times": twins.times.tolist(),
        "logs": twins.logs.tolist(),
        "collapsed": twins.collapsed.tolist(),
        "noise": twins.noise.tolist(),
    }


def twins_of(row: Row, chain: Chain) -> Twins | None:
    """Return what a row holds; None where the chain failed."""
    if row["status"] != "success":
        return None
    return Twins(
        np.array(chain.distances),
        np.array(row["times"]),
        np.array(row["logs"], dtype=np.float64),
        np.array(row["collapsed"], dtype=bool),
        np.array(row["noise"], dtype=np.float64),
    )


def follow_press(chain: Chain) -> Twins:
    """Run the scene until its start is forgotten, and follow twins from there."""
    run = runner(chain.model)
    scene = chain.scene.with_values({"output.groups": ["corners"], "output.samples_per_cycle": SAMPLES})
    before = scene.with_values({"drive.cycles": float(TRANSIENT + 1)})
    when, state = _in_flight(before, run)
    press = Press(scene, run)
    return follow(
        press.orbit,
        press.twin,
        state,
        when,
        when + chain.turns * SAMPLES,
        distances=np.array(chain.distances),
        round_off=ROUND_OFF,
        scale=scale(scene),
    )


def _in_flight(scene: Scene, run: Run) -> tuple[int, Array]:
    """Return when the slider first flies in the last turn, and its state there."""
    table = run(scene)
    gap = by_turn(gaps(table), scene)[-1]
    when = TRANSIENT * SAMPLES + int(np.argmax(gap > CLEAR_OF_WALLS * scene.data["clearance"]["slider"]))
    return when, states(table, scene)[when]
