"""What the paper does not print, or rounds, drawn at random and propagated to its figures by the reference.

The numbers, with their reasons, are in ``uncertainty.toml``.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from comparison.execution.run import Progress, RunError, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import Task, measure_all, on_processes
from comparison.scene import Scene, SceneError
from comparison.studies.identification import fitting
from comparison.studies.nonlinear.study import Chaos
from comparison.studies.paper.runs import CENTRAL, Config, Runs, long_scene, measure, short_scene
from comparison.studies.shared.scenes import settable

DATA = tomllib.loads(files("comparison.studies.paper").joinpath("uncertainty.toml").read_text("utf-8"))
INPUTS: list[dict[str, Any]] = DATA["input"]
VARIANTS: list[dict[str, Any]] = DATA["variant"]
SEED: int = DATA["seed"]
GEOMETRY: str = DATA["geometry"]["group"]
GROUPS = tuple(dict.fromkeys([GEOMETRY, *(one["group"] for one in INPUTS)]))
REFERENCE, CHUNK, ATTEMPTS = "reference", 50, 1000
IDEAL = {"joints.slider": "ideal", "joints.crank_pin": "ideal"}
FIELDS = ("value", "time", "first")
RODS = ("crank", "rod2", "rocker", "rod4")
OFFSET, START, ANGLE = "mechanism.reference_offset", "initial.slider_offset", "mechanism.crank_angle_deg"


# ---- what is drawn


def value(one: Mapping[str, Any], middle: float, u: float) -> float:
    """Return the value of an input for a number u between -1 and 1; its middle for 0."""
    if "other" in one:
        return float(one["other"]) if u < 0 else middle
    return float(middle * one["factor"] ** u if "factor" in one else middle + one["half"] * u)


@cache
def drawn(number: int, only: str) -> tuple[tuple[float, ...], fitting.Geometry | None, float]:
    """Return the numbers u of `INPUTS`, zero outside the group ``only``, geometry and its dead centre (deg).

    Drawn until the geometry meets every printed fact within its allowance; None: that of the scene.
    """
    rng, facts = np.random.default_rng([SEED, number]), fitting.printed_facts()
    allowances, topology = facts["allowance"].to_numpy(), fitting.TOPOLOGIES[0]
    lengths, keys = fitting.table_1()[0], [one["key"] for one in INPUTS]
    groups = [*(one["group"] for one in INPUTS), *[GEOMETRY] * len(facts)]
    counts = np.array([only in ("", group) for group in groups])
    rods = [keys.index(f"mechanism.{rod}.length") for rod in RODS]
    for _ in range(ATTEMPTS):
        u = rng.uniform(-1.0, 1.0, counts.size) * counts
        own, of_facts = tuple(u[: len(INPUTS)].tolist()), u[len(INPUTS) :]
        if not of_facts.any() and not u[rods].any():
            return own, None, 0.0
        printed = (lengths.crank, lengths.rod2, lengths.rocker, lengths.rod4)
        crank, rod2, rocker, rod4 = (
            value(INPUTS[k], length, own[k]) for k, length in zip(rods, printed, strict=True)
        )
        changed = fitting.Lengths(crank, rod2, rocker, rocker / 2, rod4)
        wanted = facts.assign(value=facts["value"] + allowances * of_facts)
        start, known = fitting.shipped_geometry(), (topology, wanted, allowances, changed)
        best = least_squares(fitting.residuals, start, args=known, x_scale=0.1)
        fitted = fitting.Geometry(*best.x.tolist())
        misses = fitting.residuals(fitted, topology, facts, allowances, changed)
        if np.abs(misses).max() <= 1.0:
            return own, fitted, float(fitting.shown(fitted, topology, changed)[1][0])
    raise ValueError(f"draw {number}: no geometry meets the printed facts")


def draw(scene: Scene, number: int, only: str = "") -> dict[str, object]:
    """Return the keys of a scene with the inputs of one draw, of all groups or of one alone.

    The same number draws the same inputs in every scene. All rods are uniform: centroids are in the middle.
    """
    own, geometry, top = drawn(number, only)
    middle = settable(scene.data)
    pairs = zip(INPUTS, own, strict=True)
    values: dict[str, float] = {one["key"]: value(one, middle[one["key"]], u) for one, u in pairs}
    values |= {f"mechanism.{rod}.centroid": values[f"mechanism.{rod}.length"] / 2 for rod in RODS}
    values[START] += values[OFFSET] - middle[OFFSET]  # the start is on the ideal slider's line
    if geometry is None:
        return dict(values)
    values[ANGLE] += top - middle[ANGLE]
    values["mechanism.guide_x"] = geometry.guide - values[OFFSET]
    return values | {"mechanism.rocker_pivot": [geometry.pivot_x, geometry.pivot_y]}


# ---- runs


@dataclass(frozen=True)
class Draws(Task):
    """Draws ``first`` to ``first + count - 1`` of a scene: what they show in place of the published rows."""

    name: str
    ids: tuple[str, ...]
    config: Config
    limits: Mapping[str, float]  # of the permitted error, by quantity
    count: int
    many: bool = False  # whether many cycles are run too
    only: str = ""  # the group of inputs that is drawn; all
    changes: Mapping[str, object] = field(default_factory=dict)  # of a variant
    first: int = 0
    models = (REFERENCE,)

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return self.count * (0.1 + 0.01 * self.config.cycles * self.many)


class Ensemble(NamedTuple):
    """What came of draws."""

    shown: pd.DataFrame
    """A row a draw that succeeded, by its number; columns (id, one of `FIELDS`), the last that of the first
    cycle."""
    failures: list[str]  # of each that did not its status, or why the model refused it


def run_draws(tasks: Sequence[Draws], n_jobs: int, on_progress: Progress | None) -> list[Ensemble]:
    """Run draws in chunks; what ran before is not run again."""
    chunks = [
        replace(one, first=n, count=min(CHUNK, one.count - n))
        for one in tasks
        for n in range(0, one.count, CHUNK)
    ]
    rows = iter(measure_all(measure_draws, chunks, on_processes(n_jobs), on_progress))
    joined = []
    for one in tasks:
        # The row of a chunk whose process died has a message alone.
        results = [next(rows) for _ in range(0, one.count, CHUNK)]
        shown = {number: each for row in results for number, each in row.get("shown", [])}
        columns = pd.MultiIndex.from_product([one.ids, FIELDS])
        frame = pd.DataFrame.from_dict(shown, orient="index", columns=columns, dtype=np.float64)
        failures = [text for row in results for text in row.get("failures", [row.get("message", "")])]
        joined.append(Ensemble(frame, failures))
    return joined


def measure_draws(draws: Draws, progress: Progress) -> Row:
    """Run a chunk; of a run that fails its status stays, or why the model refused the scene."""
    del progress
    shown, failures = [], []
    for number in range(draws.first, draws.first + draws.count):
        try:
            shown.append((number, _show(draws, number)))
        except RunError as error:
            failures.append(error.outcome.status)
        except SceneError as error:
            failures.append(str(error))
    return {"shown": shown, "failures": failures}


def _show(draws: Draws, number: int) -> list[float]:
    """Return the `FIELDS` of each id in one draw."""
    config, name = draws.config, draws.name
    base = short_scene(config, name)
    values = draw(base, number, draws.only) | dict(draws.changes)
    scene = base.with_values(values)
    ideal = run_one(scene.with_values(IDEAL), REFERENCE)
    many = {}
    if draws.many:
        many[name, REFERENCE] = run_one(long_scene(config, name).with_values(values), REFERENCE)
    short = {(name, REFERENCE): [run_one(scene, REFERENCE)]}
    both = {(name, REFERENCE): ideal, (CENTRAL, REFERENCE): ideal}
    runs = Runs(config, short, both, many, {}, Chaos.UNDECIDED, {})
    shown = []
    for each in draws.ids:
        peak, first = (measure(each, runs, REFERENCE, draws.limits, cycle) for cycle in (2, 1))
        shown += [peak.value, peak.time, first.value]
    return shown
