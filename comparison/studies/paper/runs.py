"""The paper's conditions by both models: the runs, and their readings in place of the printed numbers.

Values that the paper does not print, or rounds, are drawn at random and propagated to its numbers by the
reference: the distributions, with their reasons, are in ``uncertainty.toml``.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from importlib.resources import files
from itertools import islice, product
from math import nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares

from comparison.execution.run import Job, Progress, run_all, run_one, table_of
from comparison.execution.store import Row
from comparison.execution.tasks import CRASHED, SUCCESS, Task, measure_all, on_processes
from comparison.models import MODELS
from comparison.reliability.assessment import Assessment, assess, cap, ideal_scenes, reliability
from comparison.reliability.errors import QUANTITIES, Peak, SliderErrors, slider_errors
from comparison.scene import Scene, load_scene
from comparison.scene.schema import Limits
from comparison.studies.paper import fitting
from comparison.studies.shared.published import CONDITION, printed_rows
from comparison.studies.shared.scenes import at_tier, key_values
from comparison.tables.channels import Array, BoolArray
from comparison.tables.table import Table

CENTRAL, PIN, IDEAL = "150rpm-0.2mm", "crank-pin", "ideal"
ADAMS = "adams-impact"  # the central case with the contact law of the second program, Fig. 13
CONDITIONS = {
    ("translational", "150", "0.2", "210", "0.28"): CENTRAL,
    ("translational", "150", "0.2", "69", "0.28"): "69GPa",
    ("translational", "150", "0.2", "210", "0.33"): "poisson-0.33",
    ("translational", "90", "0.1", "210", "0.28"): "90rpm-0.1mm",
    ("translational", "90", "0.5", "210", "0.28"): "90rpm-0.5mm",
    ("translational", "300", "0.2", "210", "0.28"): "300rpm-0.2mm",
    ("revolute_A", "150", "0.2", "210", "0.28"): PIN,
    ("ideal", "150", "0", "210", "0.28"): IDEAL,
}
"""Parts of `CONDITION`, as printed -> scene; the last is the ideal mechanism of the central case."""
*SCENES, _ = CONDITIONS.values()
*SLIDER, _ = SCENES
RELIABILITIES = (CENTRAL, "90rpm-0.1mm", "90rpm-0.5mm", "300rpm-0.2mm")  # conditions of Figs. 16 and 17
CHANNELS = tuple(QUANTITIES.values())
PEAKS = {f"peak_{word}_error": channel for word, channel in QUANTITIES.items()}
RANGES = {
    "range_x_deviation": ("slider_x", "start"),
    "range_x_velocity": ("slider_vx", "nothing"),
    "range_y": ("slider_y", "start"),
    "range_y_velocity": ("slider_vy", "nothing"),
    "range_y_error": ("slider_y", "motion"),
    "range_y_velocity_error": ("slider_vy", "motion"),
}
"""Of Fig. 14: the channel, and the part of the ideal slider taken off: its start, nothing, or its motion."""
REACH = 0.025
"""Of a cycle, 9 degrees of the crank: a peak this close to the printed instant is the same passage. Three
times the 0.8 % by which the paper's own instants of one peak differ (0.4110 s and 0.4141 s)."""
GOLDEN, PIN_NUDGE = (5**0.5 - 1) / 2, 1e-7
"""From one member to the next: of the way between the walls, the start; degrees of the crank: < 1e-9 m."""


class Config(NamedTuple):
    """Extent of the runs."""

    samples: int
    """A cycle, of the two: 40 us apart at 150 rpm, where half of the contacts last more than 200 us."""
    long_samples: int  # a cycle, of many cycles; divides the former
    cycles: int  # of the central case, as in Figs. 14 and 15
    fewer: int = 0  # of the other cases: the paper follows them through fewer
    members: int = 1  # runs of two cycles from other starts
    draws: int = 0  # of values that the paper does not print, or rounds, without gravity as many
    long_draws: int = 0  # of the same, where runs are long: of many cycles, of variants


@dataclass(frozen=True)
class Runs:
    """Tables of all runs, by (scene, model)."""

    config: Config
    short: dict[tuple[str, str], list[Table]]  # two cycles of each member
    ideal: dict[tuple[str, str], Table]  # two cycles of the ideal mechanism, at the same times
    long: dict[tuple[str, str], Table]  # many cycles, of the scenes with clearance at the slider
    pin: dict[str, Table] = field(default_factory=dict)
    """Model -> two cycles with clearance at the crank pin, with the journal's path and forces."""
    standard: dict[tuple[str, str], Table] = field(default_factory=dict)
    """Two cycles at usual settings: of all scenes by the first model, of the central case by both."""
    adams: dict[str, Table] = field(default_factory=dict)
    """Model -> two cycles of the central case under the law of ADAMS, at the models' tightest settings."""
    solver: pd.DataFrame = field(default_factory=pd.DataFrame)  # `comparison.studies.paper.numerics`

    def two_cycles(self, scene: str, model: str, member: int = 0) -> SliderErrors:
        """Return the errors of a run over the two cycles, actual - ideal."""
        run = self.short[scene, model][member]
        return slider_errors(run, self.ideal[scene, model], float(run.time[-1]) / 2)

    def errors(self, scene: str, model: str, channel: str) -> Array:
        """Return the errors of a channel over the two cycles from the first start, shape (n,)."""
        return self.two_cycles(scene, model).by_channel[channel]

    @cached_property
    def laws_and_codes(self) -> dict[str, dict[str, Array]]:
        """Differences in the second cycle by change (law, code or both, as in Fig. 13) and channel."""
        a, b = (self.short[CENTRAL, model][0] for model in MODELS)
        others = {"code": b, "law": self.adams[MODELS[0]], "law and code": self.adams[MODELS[1]]}
        return {
            name: {each: (other.values(each) - a.values(each))[second_cycle(a)] for each in CHANNELS}
            for name, other in others.items()
        }

    def by_member(self, scene: str, model: str, channel: str, cycle: int = 2) -> list[Peak]:
        """Return the largest error of a cycle from each start."""
        each = (self.two_cycles(scene, model, k) for k in range(len(self.short[scene, model])))
        return [errors.peak(channel, (cycle - 1) * errors.period, cycle * errors.period) for errors in each]

    @cached_property
    def reliabilities(self) -> dict[tuple[str, str], dict[str, Assessment]]:
        """Those of the two cycles at a scene's limits, by (scene, model) and quantity: of `RELIABILITIES`."""
        return {
            (scene, model): assess(self.two_cycles(scene, model), load_scene(scene).reliability)
            for scene, model in self.short
            if scene in RELIABILITIES
        }

    def by_cycle(self, scene: str, model: str, channel: str) -> Array:
        """Return a channel of many cycles, a row each; without the last sample, which starts another."""
        return self.long[scene, model].values(channel)[:-1].reshape(-1, self.config.long_samples)

    def long_errors(self, scene: str, model: str, channel: str) -> Array:
        """Return actual - ideal over many cycles, a row each, shape (cycles, long_samples)."""
        samples, stride = self.config.samples, self.config.samples // self.config.long_samples
        ideal = self.ideal[scene, model].values(channel)[:samples:stride]
        return self.by_cycle(scene, model, channel) - ideal

    def pin_vector(self, model: str, x: str, y: str) -> NDArray[np.complex128]:
        """Return two channels of the crank pin in the second cycle as x + iy, shape (n,)."""
        run = self.pin[model]
        vector: NDArray[np.complex128] = run.values(x) + 1j * run.values(y)
        return vector[second_cycle(run)]


def second_cycle(run: Table) -> BoolArray:
    """Return a mask of the second of two cycles, both ends included, up to rounding."""
    return np.asarray(run.time >= run.time[-1] / 2 * (1 - 1e-9))


# ---- runs


def _two_cycles(config: Config, name: str, *groups: str) -> Scene:
    values = {"drive.cycles": 2.0, "output.groups": list(groups), "output.samples_per_cycle": config.samples}
    return load_scene(name, values)


def short_scene(config: Config, name: str, member: int = 0) -> Scene:
    """Return two cycles of a condition, at the models' tightest settings."""
    scene = _two_cycles(config, name, "accelerations")
    mechanism = scene.data["mechanism"]
    start = {START: mechanism["reference_offset"]}
    if member:
        start = {START: (2.0 * (member * GOLDEN % 1.0) - 1.0) * scene.data["clearance"]["slider"]}
    if name == PIN:
        start = {"mechanism.crank_angle_deg": mechanism["crank_angle_deg"] + member * PIN_NUDGE}
    return at_tier(scene.with_values(start), "tight")


def ideal_scene(config: Config, name: str) -> Scene:
    """Return two cycles of the ideal mechanism at the times of a condition."""
    ideal = ideal_scenes(short_scene(config, name), "reference")["base"]
    return ideal.with_values({"output.samples_per_cycle": config.samples})


def long_scene(config: Config, name: str) -> Scene:
    """Return many cycles of a condition."""
    values = {
        "drive.cycles": float(config.cycles if name == CENTRAL else config.fewer),
        "output.groups": [],
        "output.samples_per_cycle": config.long_samples,
        "initial.slider_offset": load_scene(name).data["mechanism"]["reference_offset"],
        "solver.exudyn.formulation": "tree",
    }
    return load_scene(name, values)


def simulate(config: Config, n_jobs: int, on_progress: Progress | None) -> Runs:
    """Run all conditions in one go; `RunError` if one of the runs does not succeed."""
    pairs, many = list(product(SCENES, MODELS)), list(product(SLIDER, MODELS))
    # With clearance at the pin Exudyn, full (five bodies), needs the scene's own step: at 1 us it never lifts
    # the pin off its bearing in the second cycle, at 0.25 us it flies for 5 % of the time. That is not
    # converged in either model: with the reference it flies for 0, 3 and 17 % at 1e-11, 1e-12 and 1e-13.
    pin = _two_cycles(config, PIN, "joints", "corners")
    standard = [(scene, model) for scene, model in pairs if model == MODELS[0] or scene == CENTRAL]
    jobs = [
        *(Job(short_scene(config, scene, k), model) for scene, model in pairs for k in range(config.members)),
        *(Job(ideal_scene(config, scene), model) for scene, model in pairs),
        *(Job(long_scene(config, scene), model) for scene, model in many),
        *(Job(pin, model) for model in MODELS),
        *(Job(short_scene(config, ADAMS), model) for model in MODELS),
        *(Job(_two_cycles(config, scene, "accelerations"), model) for scene, model in standard),
    ]
    tables = map(table_of, run_all(jobs, n_jobs, on_progress), jobs)
    return Runs(
        config,
        short={pair: list(islice(tables, config.members)) for pair in pairs},
        ideal=dict(zip(pairs, islice(tables, len(pairs)), strict=True)),
        long=dict(zip(many, islice(tables, len(many)), strict=True)),
        pin=dict(zip(MODELS, islice(tables, len(MODELS)), strict=True)),
        adams=dict(zip(MODELS, islice(tables, len(MODELS)), strict=True)),
        standard=dict(zip(standard, tables, strict=True)),
    )


# ---- readings: numbers of a run in place of the printed ones

CAP = cap(Limits(upper=1.0))  # reliability without any error, whatever the limit


def lack(limit: float, assessment: Assessment) -> Array:
    """Return reliabilities' distances to the cap with another upper limit, the lower zero, shape (bins,)."""
    return CAP - reliability(Limits(upper=limit), assessment.mean, assessment.deviation)


def scene_of(identifier: str) -> str:
    """Return the scene of a published row, such as ``F9-69-d``."""
    return CONDITIONS[tuple(printed_rows().loc[identifier, CONDITION])]


@cache
def numbers() -> pd.DataFrame:
    """Return the printed numbers by the id that prints each first, in the order of the paper.

    With their ``scene``, and all ``ids``. A number is printed again where condition, quantity and size are
    the same; sign and instant may differ: then the paper contradicts itself.
    """
    same = [*CONDITION, "quantity", "size"]
    rows = printed_rows().assign(size=printed_rows()["value"].astype(float).abs())
    ids = rows.reset_index().groupby(same, sort=False)["id"].agg(", ".join)
    first = rows.drop_duplicates(same)
    return first.assign(ids=ids.to_numpy(), scene=[scene_of(str(name)) for name in first.index])


class Reading(NamedTuple):
    """Value of a run in place of a printed number, in its unit."""

    value: float
    time: float = nan
    """Of a largest error, s; of a smallest reliability its crank angle, deg."""
    shortfall: float = 0.0  # by which its samples may miss it
    other: float = nan
    """The same of the first cycle; of a range that from the second cycle on."""
    other_time: float = nan


def shortfall(sizes: Array, largest: float) -> float:
    """Return the amount by which samples may miss the largest of sizes: zero where a larger one is known.

    A third of the miss of every second sample, as it falls with the square of the interval, or the height
    of the parabola through the top above it, if that is more: the one is blind to a top in the middle of
    two samples, the other to a narrow one.
    """
    top = int(sizes.argmax())
    if largest > sizes[top]:
        return 0.0
    every_second = float(sizes[top] - min(sizes[::2].max(), sizes[1::2].max()))
    before, at, after = sizes[np.clip([top - 1, top, top + 1], 0, sizes.size - 1)].tolist()
    curvature = 2 * at - before - after
    return max(every_second / 3, (after - before) ** 2 / (8 * curvature) if curvature else 0.0)


def measure(identifier: str, runs: Runs, model: str, limits: Mapping[str, float]) -> Reading:
    """Return the reading of a model's run in place of a published row.

    The largest error of the second cycle. The smallest reliability is that with the upper limit of its
    quantity, the lower zero.
    """
    scene, quantity = scene_of(identifier), str(printed_rows().loc[identifier, "quantity"])
    if channel := PEAKS.get(quantity):
        first, peak = (runs.by_member(scene, model, channel, cycle)[0] for cycle in (1, 2))
        errors = runs.errors(scene, model, channel)
        sizes = np.abs(errors[second_cycle(runs.ideal[scene, model])])
        return Reading(peak.value, peak.time, shortfall(sizes, abs(peak.value)), first.value, first.time)
    if quantity.startswith("min_"):
        name = quantity.split("_")[1]
        assessment = runs.reliabilities[scene, model][name]
        lacks = lack(limits[name], assessment)
        return Reading(CAP - float(lacks.max()), float(assessment.angle[lacks.argmax()]))
    ideal, samples = runs.ideal[CENTRAL, model], runs.config.samples
    y, velocity = ideal.values("slider_y"), ideal.values("slider_vy")
    if quantity == "lowest_displacement":
        at = samples + int(y[samples:].argmin())
        return Reading(float(y[at] - y[0]), float(ideal.time[at]))
    if quantity == "crank_angle_at_top_dead_centre":  # the zero of the velocity where y is highest
        at = samples // 2 + int(y[samples // 2 : -samples // 2].argmax())
        rise = (velocity[at + 1] - velocity[at - 1]) / 2
        data = ideal.provenance.get("scene") or load_scene(IDEAL).data
        start = float(data["mechanism"]["crank_angle_deg"])
        turn = float((at - velocity[at] / rise) / samples - 1.0)
        return Reading(start + 360.0 * turn, turn * float(ideal.time[-1]) / 2)
    return _range(quantity, runs, scene, model)


def _range(quantity: str, runs: Runs, scene: str, model: str) -> Reading:
    """Return an end of a range over all cycles; ``other`` without the first one.

    Of coordinates that of the model's own extrema; of errors that of the samples, the first two cycles being
    sampled as densely as runs of two.
    """
    name, _, end = quantity.rpartition("_")
    (channel, origin), sign = RANGES[name], 1.0 if end == "high" else -1.0
    if origin == "motion":
        parts = [sign * row for row in runs.long_errors(scene, model, channel)]
        dense = sign * runs.errors(scene, model, channel)
        parts[:2] = np.array_split(dense, [runs.config.samples])
        ends = [(float(part.max()), shortfall(part, -np.inf)) for part in parts]
        extreme, later_extreme = (max(ends[first:])[0] for first in (0, 1))
        bound = max(top + miss for top, miss in ends)
        return Reading(sign * extreme, shortfall=bound - extreme, other=sign * later_extreme)
    zero = float(runs.ideal[scene, model].values(channel)[0]) if origin == "start" else 0.0
    table = runs.long[scene, model]
    extremes, word = table.extrema[channel], "max" if end == "high" else "min"
    by_cycle = (table.cycle_extrema or {}).get(f"{channel}_{word}", [nan, nan])
    later = sign * float(np.max(sign * np.asarray(by_cycle[1:], dtype=np.float64)))
    return Reading(extremes[word] - zero, other=later - zero)


# ---- draws

DATA = tomllib.loads(files("comparison.studies.paper").joinpath("uncertainty.toml").read_text("utf-8"))
INPUTS: list[dict[str, Any]] = DATA["input"]
VARIANTS: list[dict[str, Any]] = DATA["variant"]
SEED: int = DATA["seed"]
REFERENCE, ATTEMPTS = "reference", 1000
WITHOUT_CLEARANCE = {"joints.slider": "ideal", "joints.crank_pin": "ideal"}
HYPOTHESES: dict[str, dict[str, object]] = {"gravity": {}, "none": {"environment.gravity": 0.0}}
"""Changes of a scene, whose own gravity is 9.81 m/s^2: the paper does not mention it."""
RODS = ("crank", "rod2", "rocker", "rod4")
OFFSET, START, ANGLE = "mechanism.reference_offset", "initial.slider_offset", "mechanism.crank_angle_deg"


def value(one: Mapping[str, Any], middle: Mapping[str, Any], u: float) -> float:
    """Return the value of an input for a number u between -1 and 1; its middle for 0 where it has one."""
    if "within" in one:
        return float(u * middle[one["within"]])
    base = middle[one["key"]]
    return float(base * one["factor"] ** u if "factor" in one else base + one["half"] * u)


@cache
def draw_inputs(number: int) -> tuple[tuple[float, ...], fitting.Geometry, float]:
    """Return the numbers u of `INPUTS`, a geometry and its dead centre (deg).

    Drawn until the geometry meets every printed fact within its allowance.
    """
    rng, facts = np.random.default_rng([SEED, number]), fitting.printed_facts()
    allowances, topology = facts["allowance"].to_numpy(), fitting.TOPOLOGIES[0]
    table, keys = fitting.table_1()[0], [one["key"] for one in INPUTS]
    for _ in range(ATTEMPTS):
        deviates = tuple(rng.uniform(-1.0, 1.0, len(INPUTS)).tolist())
        targets = facts.assign(value=facts["value"] + allowances * rng.uniform(-1.0, 1.0, len(facts)))
        by_rod = {}
        for rod in RODS:
            k = keys.index(f"mechanism.{rod}.length")
            by_rod[rod] = value(INPUTS[k], {keys[k]: getattr(table, rod)}, deviates[k])
        lengths = fitting.Lengths(**by_rod, rocker_centroid=by_rod["rocker"] / 2)
        arguments = (topology, targets, allowances, lengths)
        best = least_squares(fitting.residuals, fitting.shipped_geometry(), args=arguments, x_scale=0.1)
        geometry = fitting.Geometry(*best.x.tolist())
        misses = fitting.residuals(geometry, topology, facts, allowances, lengths)
        if np.abs(misses).max() <= 1.0:
            return deviates, geometry, float(fitting.facts_of(geometry, topology, lengths)[1][0])
    raise ValueError(f"draw {number}: no geometry meets the printed facts")


def draw(scene: Scene, number: int) -> dict[str, object]:
    """Return the keys of a scene with the inputs of one draw.

    The same number draws the same inputs in every scene. All rods are uniform: centroids are in the middle.
    """
    deviates, geometry, top = draw_inputs(number)
    middle = key_values(scene.data)
    pairs = zip(INPUTS, deviates, strict=True)
    values: dict[str, float] = {one["key"]: value(one, middle, u) for one, u in pairs}
    values |= {f"mechanism.{rod}.centroid": values[f"mechanism.{rod}.length"] / 2 for rod in RODS}
    values[ANGLE] += top - middle[ANGLE]
    values["mechanism.guide_x"] = geometry.guide - values[OFFSET]
    return values | {"mechanism.rocker_pivot": [geometry.pivot_x, geometry.pivot_y]}


@dataclass(frozen=True)
class Draw(Task):
    """A draw of a scene: its readings in place of published rows."""

    name: str
    ids: tuple[str, ...]
    config: Config
    limits: Mapping[str, float]  # of the permitted error, by quantity
    many: bool = False  # many cycles are run too
    left_open: bool = True  # values that the paper leaves open are drawn
    changes: Mapping[str, object] = field(default_factory=dict)  # of a hypothesis or a variant
    number: int = 0
    models = (REFERENCE,)


class Ensemble(NamedTuple):
    """Results of the draws."""

    readings: pd.DataFrame  # a row a draw that succeeded, by its number; columns (id, field of `Reading`)
    failures: list[str]  # of each other draw its status, or the reason of the model's refusal


def run_draws(draws: Sequence[tuple[Draw, int]], n_jobs: int, on_progress: Progress | None) -> list[Ensemble]:
    """Run so many draws of each, from the first on; stored draws are not run again."""
    tasks = [replace(one, number=number) for one, count in draws for number in range(count)]
    rows = iter(measure_all(measure_draw, tasks, on_processes(n_jobs), on_progress))
    ensembles = []
    for one, count in draws:
        results = list(islice(rows, count))
        readings = {number: row["shown"] for number, row in enumerate(results) if row["status"] == SUCCESS}
        columns = pd.MultiIndex.from_product([one.ids, Reading._fields])
        frame = pd.DataFrame.from_dict(readings, orient="index", columns=columns, dtype=np.float64)
        rest = [row for row in results if row["status"] != SUCCESS]
        # Where the status is none of a model's the message is the reason.
        reasons = [row["message" if row["status"] in ("bad input", CRASHED) else "status"] for row in rest]
        ensembles.append(Ensemble(frame, reasons))
    return ensembles


def measure_draw(task: Draw, progress: Progress) -> Row:
    """Run a draw and return the `Reading` of each id, one after the other."""
    del progress
    config, name = task.config, task.name
    base = short_scene(config, name)
    values = (draw(base, task.number) if task.left_open else {}) | dict(task.changes)
    scene = base.with_values(values)
    ideal = run_one(scene.with_values(WITHOUT_CLEARANCE), REFERENCE)
    many = {}
    if task.many:
        many[name, REFERENCE] = run_one(long_scene(config, name).with_values(values), REFERENCE)
    short = {(name, REFERENCE): [run_one(scene, REFERENCE)]}
    runs = Runs(config, short, {(name, REFERENCE): ideal, (CENTRAL, REFERENCE): ideal}, many)
    rows = [measure(each, runs, REFERENCE, task.limits) for each in task.ids]
    return {"shown": [value for row in rows for value in row]}
