"""Runs to be judged: changed scenes in both models, and random tables without any model."""

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pandas as pd
from by_keywords import compare

from comparison.accuracy.levels import refinement, tight
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import run_one
from comparison.scene import Scene, load_scene
from comparison.tables.table import Table

MODELS = ("reference", "exudyn")
KINDS = ("base", "finer", "coarser", "perturbed", "other_perturbed")
SCENES = {
    "soft": ("poisson-0.33", "standard", {"contact.youngs_modulus": 27656975981.20822}),
    "wide": ("90rpm-0.5mm", "standard", {"clearance.slider": 0.0005731302022989521}),
    "fast": ("poisson-0.33", "tight", {
        "drive.speed_rpm": 278.54184180634775, "friction.coefficient": 0.24551667641884076,
        "initial.slider_angle": -0.0002984215478242201}),
}  # fmt: skip
"""A shipped scene, a tier, and a user's changes."""
CASES = (("soft", 0.0), ("wide", 0.0), ("wide", 0.02), ("fast", 0.0))
"""Names and faults for `changed_scene`: both tiers; the fast one is indeterminate, a faulty one differs."""
PERIOD = 0.4  # of the random tables, s: that of the scene 150rpm-0.2mm


class Pair(NamedTuple):
    """A scene and the runs of both models."""

    scene: Scene
    tier: str
    a: Runs
    b: Runs


def family(model, scene):
    """All runs that the uncertainty of a model's run takes."""
    tables = {kind: run_one(level, model) for kind, level in levels(scene, model).items()}
    return Runs(refinement=refinement(model, scene), **tables)


@lru_cache(maxsize=12)
def changed_scene(name, *, fault=0.0):
    """A changed scene by both models, Exudyn's tree instead of five bodies, with all their runs.

    ``fault`` is a relative error of the second model's restitution.
    """
    source, tier, changes = SCENES[name]
    tree = {"solver.exudyn.formulation": "auto", "solver.exudyn.tolerance": 1e-8}
    scene = load_scene(source, tree | changes)
    scene = scene if tier == "standard" else tight(scene, MODELS)
    assert scene is not None
    other = scene.with_values({"contact.restitution": scene.data["contact"]["restitution"] * (1 + fault)})
    return Pair(scene, tier, family(MODELS[0], scene), family(MODELS[1], other))


@lru_cache(maxsize=128)
def random_tables(seed):
    """Tables whose errors and differences are drawn over decades, by channel and stretch of time.

    No mechanism moves like that; the tables lead the judge into every branch.
    """
    rng = np.random.default_rng(seed)
    tier = str(rng.choice(["standard", "tight"]))
    per_cycle, cycles = int(rng.integers(40, 260)), float(rng.choice([0.5, 1.0]))
    values = {"output.samples_per_cycle": per_cycle, "drive.cycles": cycles}
    scene = load_scene("150rpm-0.2mm", values)
    count = round(per_cycle * cycles)
    time = np.arange(count + 1) * (PERIOD / per_cycle)
    limits = {"standard": 1e-2, "tight": 5e-5}
    sizes = {"slider_x": 2e-4, "slider_y": 4e-5, "slider_vx": 5e-2, "slider_ax": 500.0}
    sizes |= {"corner_ll_gap": 2e-4, "corner_ll_normal": 40.0, "corner_ll_friction": 6.0}
    followers = {"slider_ax", "corner_ll_normal", "corner_ll_friction"}
    sides = tuple({kind: {"time": time} for kind in KINDS} for _ in range(2))
    most = rng.choice([0.0, 1.3])  # upper limit of the decades from the errors to a difference
    for name, size in sizes.items():
        signal = size * np.sin(2 * np.pi * time / PERIOD * rng.uniform(0.5, 5) + rng.uniform(0, 6))
        if name in followers:  # mostly zero
            signal = np.where(rng.random(time.size) < rng.choice([0.02, 0.3]), np.abs(signal), 0.0)
        if rng.random() < 0.05:
            signal = np.full(time.size, -0.55)
        level = limits[tier] * size * 10 ** rng.uniform(-4, 0.5, 4)  # one for each quarter of the time
        level = level[4 * np.arange(time.size) // time.size]
        happens = signal != 0
        errors = [level * rng.normal(size=time.size) * happens for _ in range(5)]
        part = rng.choice([0.006, 0.02, 1.0])
        size_of = 10 ** rng.uniform(-1 if part == 1 else 1, 1.3 if part < 1 else most)
        distance = level * size_of * rng.normal(size=time.size) * (rng.random(time.size) < part)
        if most > 0 and rng.random() < 0.1:
            distance = distance + 30 * size
        for side, shift in ((sides[0], 0.0), (sides[1], distance * happens)):
            scale = [1.0, rng.choice([0.25, 0.1, 1.0]), rng.choice([4.0, 10.0, 1.0]), 1.0, 0.1]
            for kind, error, times in zip(KINDS, errors, scale, strict=True):
                side[kind][name] = signal + shift + times * error * rng.choice([1.0, 1.0, 0.0])
    kinds = KINDS[: 5 - rng.choice([0, 0, 1, 2])]

    def runs(side, refinement):
        return Runs(refinement=refinement, **{kind: Table(pd.DataFrame(side[kind])) for kind in kinds})

    return Pair(scene, tier, runs(sides[0], (2.0, 2.0)), runs(sides[1], (10.0, 1.0)))


def comparison_of(pair, **options):
    """Return the product's comparison of the channels that the tables have."""
    defaults = {"scene": pair.scene, "tier": pair.tier, "labels": MODELS, "only": pair.a.base.channels}
    return compare(pair.a, pair.b, **(defaults | options))


def alter(runs, change):
    """Return the runs of one model with every table changed in the same way."""
    return replace(runs, **{kind: change(table) for kind, table in tables_of(runs).items()})


def tables_of(runs):
    return {kind: getattr(runs, kind) for kind in KINDS if getattr(runs, kind) is not None}


def frames(runs):
    """The bare numbers of one model's runs."""
    return {kind: table.frame for kind, table in tables_of(runs).items()}
