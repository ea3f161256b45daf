"""Comparisons: two sides judged as the results of one scene, and of which there are how many.

Pairs without a fault are drawn as ``draws.toml`` says; seeded faults; searches for the smallest change that
shows; hashes of one side's run.
"""

import hashlib
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import ceil, cos, pi, sin, sqrt
from typing import Any

import numpy as np

from comparison.accuracy import uncertainty
from comparison.accuracy.levels import TIERS, refinement
from comparison.accuracy.refine import levels, table_of_family
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Progress, RunError, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.files import plain
from comparison.models import MODELS
from comparison.scene import Scene, SceneError, load_scene, shipped_scenes
from comparison.studies.detection.faults import RECORDS, Fault, load_copy, scenes, spoiled
from comparison.studies.shared.scenes import at_tier, clearance_and_start, leaves, log_uniform
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import compare
from comparison.verdict.refinement import settle, without_violation
from comparison.verdict.results import SceneComparison
from comparison.words.differences import confirmation
from comparison.words.verdicts import scene_reason

DETECTED = ("differ", "cannot compare")  # where tables cannot be compared something is wrong with them
LEAST, MOST = 1e-9, 0.1  # relative changes between which the smallest is sought
HALVINGS = 6  # of the decades between them: 8 / 2^6, so that two changes remain which are 33 % apart
# Where an ensemble's starts lie apart.
_MOVED = ("initial.slider_offset", "initial.slider_angle", "mechanism.crank_angle_deg")
_KEPT = 8  # families that a process keeps, as many are compared with the same one
_families: dict[tuple[str, str], Runs] = {}
_ERRORS = (RunError, SceneError, TableError)


@dataclass(frozen=True)
class Side:
    """One of the two that are compared: a scene as this model is given it."""

    scene: Scene
    model: str
    engine: str = ""  # who runs it, where that is not the model itself but a copy of it

    @property
    def runs_by(self) -> str:
        """Name of the engine."""
        return self.engine or self.model

    @property
    def cost(self) -> float:
        """Expected time of its five runs, s, roughly."""
        solver, cycles = self.scene.data["solver"]["exudyn"], self.scene.data["drive"]["cycles"]
        if self.model == "reference":
            return 0.2
        tree = solver["formulation"] == "tree"
        return float(3.0 * cycles if tree else 6e-5 * self.scene.duration / solver["step"])

    def run(self, scene: Scene) -> Table:
        """Run a scene by this side's engine."""
        if self.engine:
            load_copy(self.engine)
        return run_one(scene, self.runs_by)

    def runs(self) -> Runs:
        """Run its scene at all levels; the last few families are kept."""
        key = (self.scene.hash, self.runs_by)
        if (runs := _families.pop(key, None)) is None:
            tables = {}
            for kind, scene in levels(self.scene, self.model).items():
                try:
                    tables[kind] = self.run(scene)
                except RunError as error:
                    if (table := table_of_family(kind, error.outcome)) is None:
                        raise
                    tables[kind] = table
            runs = Runs(refinement=refinement(self.model, self.scene), **tables)
        _families[key] = runs
        if len(_families) > _KEPT:
            del _families[next(iter(_families))]
        return runs


@dataclass(frozen=True)
class Measured(Task):
    """Something that is measured by runs of sides, in this process."""

    sides: tuple[Side, ...]  # the first has the scene that they are judged by

    @abstractmethod
    def find(self) -> Row:
        """Run and judge."""

    @property
    def scene(self) -> Scene:
        """The scene that is judged."""
        return self.sides[0].scene

    @property
    def models(self) -> tuple[str, ...]:
        """The engines of its sides."""
        return tuple(side.runs_by for side in self.sides)

    @property
    def cost(self) -> float:
        """Expected time, s; what the first is compared with is mostly kept."""
        return self.sides[-1].cost + (0.1 * self.sides[0].cost if len(self.sides) > 1 else 0.0)


def find(task: Measured, progress: Progress) -> Row:
    """Measure a task."""
    del progress
    return task.find()


def find_all(tasks: Sequence[Measured], n_jobs: int, on_progress: Progress | None = None) -> list[Row]:
    """Return a row for each task: also for what went wrong, since a copy with a fault may raise anything."""
    rows = measure_all(find, tasks, on_processes(n_jobs), on_progress)
    return [row if row["status"] == SUCCESS else row | refusal(row["message"]) for row in rows]


def refusal(reason: str) -> Row:
    """Return the row of what cannot be compared."""
    return {"verdict": "cannot compare", "reason": reason, "channels": {}, "first": None}


@dataclass(frozen=True)
class Pair(Measured):
    """Two sides judged as results of one scene, as in ``sixbar validate``; the row is that of `summary`."""

    tier: str
    spoil: str = ""  # what happens to the tables of the second, or of both: one of `faults.SPOILS`
    environment: tuple[tuple[str, str], ...] = ()

    def find(self) -> Row:
        """Run what this process does not have, judge, and have a difference confirmed."""
        try:
            row = summary(self.judged())
        except _ERRORS as error:
            row = refusal(str(error))
        return row | {"scene": self.scene.name}

    def judged(self) -> SceneComparison:
        """Compare the runs of both sides, one level finer where five bodies violate an invariant."""
        first, second = self.sides
        a, b = models = first.model, second.model
        scene, level = self.scene, 0
        try:
            runs = spoiled(self.spoil, first.runs(), second.runs())
        except RunError as error:
            failed = a if error.job.model == first.runs_by else b
            again = without_violation(scene, [(failed, error.outcome)], models, self.families)
            if again is None:
                raise
            (scene, runs, _), level = again, 1
        result = compare(*runs, scene=scene, labels=(a, b if a != b else f"{b} again"), tier=self.tier)
        return settle(
            result,
            runs,
            scene=scene,
            models=models,
            run=self.ensemble,
            run_families=self.families,
            level=level,
        ).comparison

    def families(self, scene: Scene) -> tuple[Runs, Runs] | None:
        """Run both sides at the settings of a scene; None if a run does not succeed."""
        try:
            a, b = (replace(side, scene=self.given(side, scene)).runs() for side in self.sides)
            return spoiled(self.spoil, a, b)
        except _ERRORS:
            return None

    def ensemble(self, scenes: Sequence[Scene], model: str) -> list[Table]:
        """Run scenes by the side of a model, of two of one model the first; those that succeed."""
        number = 0 if model == self.sides[0].model else 1
        side, tables = self.sides[number], []
        for scene in scenes:
            try:
                table = Runs(side.run(self.given(side, scene)))
                tables.append(spoiled(self.spoil, table, table)[number].base)
            except _ERRORS:
                continue
        return tables

    def given(self, side: Side, scene: Scene) -> Scene:
        """Return what a side is given for a scene: what it was given, ensembles' numbers moved from there."""
        before, after, theirs = (leaves(each.data) for each in (self.scene, side.scene, scene))
        changes = {
            key: theirs[key] + value - before[key] if key in _MOVED else value
            for key, value in after.items()
            if before.get(key) != value
        }
        return scene.with_values(changes) if changes else scene


def summary(result: SceneComparison) -> Row:
    """Return what the study needs of a comparison, as JSON holds it.

    ``first``: of the channels that differ, the earliest predictable sample outside its threshold; of several
    at that time the one that is the most outside.
    """
    outside: list[tuple[float, float, dict[str, Any]]] = []
    for name, channel in result.channels.items():
        if channel.verdict != "differ" or channel.u is None:
            continue
        size, threshold = np.abs(channel.difference), channel.limits.k * channel.u
        late = channel.judged & (size > threshold)
        if not late.any():
            # Separated by the largest uncertainty of all times, though no sample is predictable.
            threshold = np.full(threshold.shape, channel.worst_threshold)
            late = size > threshold
        at = int(late.argmax())
        time, difference, allowed = (float(values[at]) for values in (result.time, size, threshold))
        sample = {"time": time, "difference": difference, "threshold": allowed}
        outside.append((time, -difference / allowed, {"channel": name, "unit": channel.unit} | sample))
    made = result.confirmation
    numbers = {name: getattr(made, name, None) for name in ("outcome", "members", "factor", "suspicious")}
    return {
        "verdict": result.verdict,
        "reason": scene_reason(result),
        "channels": {name: [c.verdict, c.coverage] for name, c in result.channels.items()},
        "first": min(outside, key=lambda one: one[:2])[2] if outside else None,
        "refined": result.refined,
        "confirmation": made and plain(numbers | {"sentence": confirmation(result)}),
    }


@dataclass(frozen=True)
class Search(Measured):
    """The smallest change of one number in one model that the verdict detects: by halving the decades.

    Families are compared; what they end with is confirmed by ensembles, or else the next larger change.
    """

    key: str  # of the number, which the second side gets changed
    tier: str
    halvings: int = HALVINGS

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return self.halvings * super().cost

    def find(self) -> Row:
        """Return the changes ``found``, ``missed``, and ``shown`` by families alone; None without one."""
        missed, low, high = None, LEAST, MOST
        if not self.shows(high):
            return {"found": None, "missed": high, "shown": None}
        for _ in range(self.halvings):
            middle = (low * high) ** 0.5
            if self.shows(middle):
                high = middle
            else:
                missed = low = middle
        shown, step = high, float((MOST / LEAST) ** 0.5**self.halvings)
        while not self.confirmed(high):
            missed, high = high, high * step
            if high > MOST * step**0.5:
                return {"found": None, "missed": missed, "shown": shown}
        return {"found": high, "missed": missed, "shown": shown}

    def pair(self, change: float) -> Pair:
        """Return the comparison with this relative change."""
        value = float(leaves(self.scene.data)[self.key]) * (1.0 + change)
        first, second = self.sides
        changed = replace(second, scene=self.scene.with_values({self.key: value}))
        return Pair((first, changed), self.tier)

    def shows(self, change: float) -> bool:
        """Return whether the families differ with this relative change."""
        try:
            both = (side.runs() for side in self.pair(change).sides)
            return compare(*both, scene=self.scene, tier=self.tier).verdict == "differ"
        except (RunError, TableError):
            return True

    def confirmed(self, change: float) -> bool:
        """Return whether the verdict detects this relative change."""
        return self.pair(change).find()["verdict"] in DETECTED


@dataclass(frozen=True)
class Bits(Measured):
    """The hash of one run under a variant of rounding."""

    environment: tuple[tuple[str, str], ...] = ()

    def find(self) -> Row:
        """Return the hash of all numbers of the table."""
        frame = self.sides[0].run(self.scene).frame
        return refusal("") | {"bits": hashlib.sha256(frame.to_numpy().tobytes()).hexdigest()}


# ---- which are made: without a fault

SEED, OWN_SEED = 21112025, 13062025
SHARE = 0.02  # of the clearance, by which a start is moved at most
MOST_DRAWS = 1.25  # draws for each one that is to be decided, at most
MOST_KEYS = 3
# Which model gets the change whose smallest is sought, at which tier.
PLACES = (("reference", "tight"), ("exudyn", "tight"), ("reference", "standard"))
# Model and tier of the tables whose bits are compared.
HASHED = tuple((model, tier) for tier in TIERS for model in MODELS)
_shipped = cache(load_scene)


@dataclass(frozen=True)
class Kind:
    """Comparisons without a fault: of a model with itself, or of both, see ``draws.toml``."""

    label: str
    tier: str
    draws: int
    changed: bool = False
    model: str = ""
    setting: str = ""
    cycles: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Rounding:
    """A variant of rounding: variables of the environment, and whether copies run that are rearranged."""

    name: str
    environment: tuple[tuple[str, str], ...] = ()
    rearranged: bool = False

    def side(self, scene: Scene, model: str) -> Side:
        """Return the side of a model under this variant."""
        return Side(scene, model, f"{model}_rearranged" if self.rearranged else "")


BOTH, OWN = ([Kind(**row) for row in RECORDS[name]] for name in ("both", "own"))
# The first one is what the others are held against.
ROUNDINGS = tuple(
    Rounding(**(row | {"environment": tuple(row.get("environment", {}).items())}))
    for row in RECORDS["rounding"]
)


def own_pairs(kind: Kind) -> list[Pair]:
    """Draw all pairs of a model with itself; the same ones every time."""
    number = [other.label for other in OWN].index(kind.label)
    return [own_pair(kind, np.random.default_rng([OWN_SEED, number, draw])) for draw in range(kind.draws)]


def own_pair(kind: Kind, rng: np.random.Generator) -> Pair:
    """Draw a scene, and a start beside its own with another setting: numerically another run, no more."""
    base, ranges = _shipped("150rpm-0.2mm"), RECORDS["own_ranges"]
    start = clearance_and_start(rng, ranges["clearance"], base.data["mechanism"]["slider"]["length"])
    values: dict[str, object] = {
        **start,
        "drive.speed_rpm": log_uniform(rng, ranges["speed_rpm"]),
        "drive.cycles": round(float(rng.uniform(*kind.cycles)), 3),
        "contact.restitution": float(rng.uniform(*ranges["restitution"])),
        "contact.youngs_modulus": log_uniform(rng, ranges["modulus"]),
        "friction.coefficient": float(rng.uniform(*ranges["friction"])),
    }
    scene = at_tier(base.with_values(values), kind.tier)
    beside = moved(scene, uncertainty.PERTURBATION, rng)
    setting = scene.data["solver"][kind.model][kind.setting] * log_uniform(rng, ranges["factors"])
    other = beside.variant({f"solver.{kind.model}.{kind.setting}": setting})
    return Pair((Side(scene, kind.model), Side(other, kind.model)), kind.tier)


def moved(scene: Scene, share: float, rng: np.random.Generator) -> Scene:
    """Return the scene with its start moved by up to a share of the clearance.

    The slider, uniformly in the disc of offset and angle times its length; where only the crank pin has
    clearance the crank, to either side.
    """
    clearance = scene.data["clearance"]
    if uncertainty.movable(scene) != "slider":
        return uncertainty.moved(scene, share * clearance["crank_pin"] * rng.uniform(-1.0, 1.0), 0.0)
    shift = share * clearance["slider"] * sqrt(rng.uniform())
    direction = rng.uniform(0.0, 2.0 * pi)
    return uncertainty.moved(scene, shift * cos(direction), shift * sin(direction))


def both_pair(kind: Kind, rounding: Rounding, number: int) -> Pair:
    """Draw one comparison of both models under a variant of rounding; the same one every time."""
    place = [kind.label for kind in BOTH].index(kind.label), ROUNDINGS.index(rounding)
    shipped = scenes_with_clearance()
    rng = np.random.default_rng([SEED, *place, number])
    scene = _shipped(shipped[(number + place[1]) % len(shipped)])
    if kind.changed:
        scene = changed(scene, rng)
    scene = at_tier(moved(scene, SHARE, rng), kind.tier)
    sides = tuple(rounding.side(scene, model) for model in MODELS)
    return Pair(sides, kind.tier, environment=rounding.environment)


@cache
def scenes_with_clearance() -> list[str]:
    """Name the shipped scenes in which a joint has clearance."""
    return [name for name in shipped_scenes() if "clearance" in _shipped(name).data["joints"].values()]


def keys(scene: Scene) -> dict[str, Any]:
    """Return the keys that users change, with how each is drawn: not those that the scene does not use."""
    changes, joints = RECORDS["changes"], scene.data["joints"]
    loose = [changes[joint] for joint in ("slider", "crank_pin") if joints[joint] == "clearance"]
    return {key: how for part in (changes["all"], *loose) for key, how in part.items()}


def changed(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene with one to `MOST_KEYS` keys drawn anew, with equal probability each."""
    ways = keys(scene)
    count = int(rng.integers(1, MOST_KEYS + 1))
    chosen = map(str, rng.choice(list(ways), size=count, replace=False))
    return scene.with_values({key: _value(rng, scene.data, key, ways[key]) for key in chosen})


def _value(rng: np.random.Generator, data: Mapping[str, Any], key: str, how: Mapping[str, Any]) -> object:
    before: Any = leaves(data).get(key)
    match dict(how):
        case {"log": bounds, **rest}:
            value = log_uniform(rng, bounds)
            return -value if rest and rng.uniform() < rest["reversed"] else value
        case {"uniform": bounds}:
            return float(rng.uniform(*bounds))
        case {"times": factor}:
            times = log_uniform(rng, (1.0 / factor, factor))
            if before is None:  # a material of each partner
                section, _, name = key.partition(".")
                return {partner: value * times for partner, value in data[section][name].items()}
            return before * times
        case {"clearances": share, "length": power}:
            reach = share * data["clearance"]["slider"] / data["mechanism"]["slider"]["length"] ** power
            return float(rng.uniform(-reach, reach))
        case {"choice": values}:
            return int(rng.choice(values))
        case {"other": [first, second]}:
            return first if before == second else second
    raise ValueError(f"draws.toml: {key}: {how}")


def sample(
    kind: Kind, roundings: Sequence[Rounding], find: Callable[[Sequence[tuple[Rounding, int]]], Sequence[Row]]
) -> dict[Rounding, list[Row]]:
    """Draw until each variant has its equal share of decided comparisons, at most `MOST_DRAWS` times as many.

    ``find`` returns a row for each variant and number that it is asked for.
    """
    wanted = ceil(kind.draws / len(roundings))
    most = ceil(MOST_DRAWS * wanted)
    drawn: dict[Rounding, list[Row]] = {rounding: [] for rounding in roundings}
    while True:
        asked = [
            (rounding, number)
            for rounding, rows in drawn.items()
            for number in range(len(rows), min(most, len(rows) + wanted - decided(rows)))
        ]
        if not asked:
            return drawn
        for (rounding, _), row in zip(asked, find(asked), strict=True):
            drawn[rounding].append(row)


def decided(rows: Sequence[Row]) -> int:
    """Count the comparisons with a verdict: enough of the run is predictable for one."""
    return sum(row["verdict"] != "indeterminate" for row in rows)


def bits(roundings: Sequence[Rounding]) -> list[Bits]:
    """Return what is hashed of the variants, one after the other: of each as many as there are `HASHED`."""
    return [
        Bits((variant.side(scenes(tier)["press"], model),), variant.environment)
        for variant in roundings
        for model, tier in HASHED
    ]


def hashes(roundings: Sequence[Rounding], rows: Sequence[Row]) -> dict[Rounding, tuple[str, ...]]:
    """Return the hashes of each variant from the rows of `bits`; of a run that failed, why."""
    texts = iter([str(row.get("bits", row["reason"])) for row in rows])
    return {variant: tuple(next(texts) for _ in HASHED) for variant in roundings}


def effective(measured: Mapping[Rounding, tuple[str, ...]], tier: str) -> list[Rounding]:
    """Return the variants that give runs of their own at a tier: the first, and each unlike all before it."""
    known: dict[tuple[str, ...], Rounding] = {}
    for rounding, texts in measured.items():
        own = tuple(text for text, place in zip(texts, HASHED, strict=True) if place[1] == tier)
        known.setdefault(own, rounding)
    return list(known.values())


# ---- which are made: with a fault


@dataclass(frozen=True)
class Trial:
    """A fault in one model, looked for at one tier."""

    fault: Fault
    model: str
    tier: str

    @property
    def pair(self) -> Pair:
        """The other model as it is, against this one."""
        scene = scenes(self.tier)[self.fault.scene]
        faulty = Side(self.fault.given(scene), self.model, self.fault.engine)
        return Pair((Side(scene, _other(self.model)), faulty), self.tier, self.fault.spoil)

    def detected(self, row: Row) -> bool:
        """Return whether this fault is detected."""
        if self.fault.unexcited:
            return bool(row["channels"].get(self.fault.unexcited, [""])[0] == "unexcited")
        return row["verdict"] in DETECTED


def _other(model: str) -> str:
    return MODELS[1 - MODELS.index(model)]


def trials(faults: Sequence[Fault]) -> list[Trial]:
    """Return where each fault is looked for; a wrong number not in five bodies, which are slow."""
    return [
        Trial(fault, model, tier)
        for fault in faults
        for tier in TIERS
        for model in MODELS
        if model == (fault.model or ("exudyn" if fault.kind == "table" else model))
        and (fault.kind != "number" or tier == "tight" or model == "reference")
        and tier == (fault.tier or tier)
    ]


def controls() -> list[Pair]:
    """Pairs without a fault, of each scene and tier: no detection counts where these differ."""
    return [
        Pair(tuple(Side(scene, model) for model in MODELS), tier)
        for tier in TIERS
        for scene in scenes(tier).values()
    ]


def searches(halvings: int = HALVINGS) -> list[Search]:
    """Return the searches for the smallest change of all numbers: for each one a place."""
    return [
        Search((Side(scene, _other(model)), Side(scene, model)), number["key"], tier, halvings)
        for number in RECORDS["smallest"].values()
        for model, tier in PLACES
        for scene in [scenes(tier)[number["scene"]]]
    ]
