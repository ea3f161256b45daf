"""The runs behind ``comparison/accuracy/measured.toml``: errors from moved starts, and processor times."""

import math
import time
from contextlib import suppress
from typing import Any

import numpy as np

from comparison.accuracy.measured import SETTINGS, at
from comparison.execution.run import RunError, run_one
from comparison.models import key_of, model_of
from comparison.scene import Scene, load_scene

STARTS = {"minimal": 60, "multiplier": 10, "tree": 20, "full": 2}
"""As many as a few minutes allow: a cycle takes the reference 10 ms, the five bodies up to 30 s.
"""
APART = 1e-8
"""m; between starts: far below what is known of any press, far above every error bound a start could hide."""
EXACT = 1e-14
"""Tolerance of the reference's run that counts as exact."""
MOST_STEPS = 400_000
"""A run of more is not timed: a step of it takes as long as one of the next coarser setting."""
CLOCK_TICK = 1e-6
"""s, by which a run takes longer than its start at least: of the closed form that difference is noise."""


Found = dict[str, Any]


def first_cycle(name: str) -> Scene:
    scene = load_scene(name)
    return scene.with_values({"drive.cycles": min(1.0, scene.data["drive"]["cycles"])})


def moved(scene: Scene, metres: float) -> Scene:
    return scene.with_values({"initial.slider_offset": scene.data["initial"]["slider_offset"] + metres})


def starts(count: int) -> list[float]:
    """Return 0, 1, -1, 2, -2 ... times 10 nm."""
    return [(n + 1) // 2 * (1 if n % 2 else -1) * APART for n in range(count)]


def x(scene: Scene, formulation: str, setting: float) -> np.ndarray:
    return run_one(at(scene, formulation, setting), model_of(formulation)).values("slider_x")


def errors(scene: Scene, formulation: str) -> Found:
    """Return the error of each setting from one start, m."""
    exact = x(scene, "minimal", EXACT)
    found: Found = {"errors": {}, "failed": {}}
    for setting in SETTINGS[formulation]:
        try:
            error = np.abs(x(scene, formulation, setting) - exact).max()
            found["errors"][f"{setting:g}"] = float(error)
        except RunError as failure:
            found["failed"][f"{setting:g}"] = str(failure)
    return found


def seconds(scene: Scene, formulation: str, rounds: int) -> Found:
    """Return what a start costs and, at each setting, a cycle or a step, s."""
    model, stepped = model_of(formulation), key_of(formulation).endswith("step")
    if stepped:
        scene = scene.with_values({"drive.cycles": min(1.0, scene.data["drive"]["cycles"])})
    one_sample = scene.with_values({"drive.cycles": 1 / scene.data["output"]["samples_per_cycle"]})
    timed = {"start": at(one_sample, formulation, SETTINGS[formulation][0])}
    for setting in SETTINGS[formulation]:
        if not stepped or scene.duration / setting <= MOST_STEPS:
            timed[f"{setting:g}"] = at(scene, formulation, setting)
    best: dict[str, float] = {}
    # In turn: a machine may be slower for a minute.
    for _ in range(rounds):
        for name, job in timed.items():
            with suppress(RunError):  # `failed` reports it
                best[name] = min(best.get(name, math.inf), least(job, model, 1))
    found: Found = {"start": best["start"], "seconds": {}}
    for setting in SETTINGS[formulation]:
        if (name := f"{setting:g}") in best:
            count = scene.duration / setting if stepped else scene.duration / scene.period
            rate = max(best[name] - best["start"], CLOCK_TICK) / count
        elif name in timed:
            continue
        found["seconds"][name] = rate
    return found


def least(scene: Scene, model: str, rounds: int) -> float:
    """Return the least processor time of a run with its table made and checked, s."""
    best = float("inf")
    for _ in range(rounds):
        before = time.process_time()
        run_one(scene, model)
        best = min(best, time.process_time() - before)
    return best
