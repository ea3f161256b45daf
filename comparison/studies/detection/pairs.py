"""What is measured: two sides judged as the results of one scene, the smallest change that shows, hashes."""

import hashlib
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from comparison.accuracy.levels import refinement
from comparison.accuracy.refine import levels, table_of_family
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Progress, RunError, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.files import plain
from comparison.scene import Scene, SceneError
from comparison.studies.detection.faults import load_copy, spoiled
from comparison.studies.shared.scenes import leaves
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import compare
from comparison.verdict.confirmation import settle, without_violation
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
