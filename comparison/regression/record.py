"""Baseline of the models: a text file of few numbers of each run, and the choice of these.

Three runs per scene: the reference at the tight tier, Exudyn's five bodies with the scene's settings, and its
tree at the tight tier. Of each: settings, counters, and some samples, the checkpoints, where the model's own
uncertainty is small.

A sample can be a checkpoint where the run is predictable, as in `comparison.verdict.compare` but by the
uncertainty of this model alone, and where the channel is further from zero than its threshold: a force is
zero most of the time, whatever the model does. A constant channel has one.

Perturbed runs do not show where round-off alone may lead after chatter: runs from starts next to that of the
gated run, its neighbours, count as well. On another machine round-off leads to one of them, after each
chatter to another one.
"""

import json
import os
import tomllib
from collections.abc import Mapping, Sequence
from decimal import ROUND_CEILING, Context, Decimal
from math import ceil, cos, floor, log10, pi, sin, sqrt
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from comparison.accuracy.levels import refinement, thresholds, thresholds_record, tight
from comparison.accuracy.refine import family, usable_table
from comparison.accuracy.uncertainty import (
    Runs,
    model_uncertainty,
    move_start,
    perturbation,
    spread,
    window_samples,
)
from comparison.execution.run import Job, Progress, run_all, table_of
from comparison.files import contents, reading, write_text
from comparison.models import MODELS, platform_name, smallest, versions
from comparison.scene import Scene, digest, load_scene, shipped_scenes
from comparison.scene.keys import explain, toml
from comparison.scene.loading import shipped_linkages
from comparison.tables.channels import Array, BoolArray, expected
from comparison.tables.table import Table

Finite = Annotated[float, Field(allow_inf_nan=False, strict=True)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]
Count = Annotated[int, Field(ge=0, strict=True)]
Which = tuple[str, str]
"""A model and a tier."""

COUNT = 5
"""Checkpoints of a channel: a scene takes some 10 kB of the file."""
RECORDED = range(8)
"""Numbers of the neighbours that widen a baseline's thresholds."""
CONFIRMING = range(8, 28)
"""Numbers of the neighbours that confirm a failed check: twenty, as a "differ" needs 19 at least."""
LATER = 5
"""Chatter ends earlier or later from one start to the next, and its remainder falls by decades within a
hundredth of a cycle: neighbours are compared within a window wider than that of u by this factor."""
RATES = Path("reports/trust/trust.json")
"""The measured rates of the verdicts' errors, as seen from the baseline's folder."""

HEADER = """\
# What the models gave when this file was made. `sixbar gate` compares; `sixbar gate --update` makes it anew.
# A checkpoint is [time in s, value, threshold], the last two in the channel's unit.
"""


# ---- the file


class BaselineError(ValueError):
    """Baseline that cannot be used or created; the message is one line."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Checkpoint(NamedTuple):
    """A value at a predictable sample (time in s), and the threshold for another run of the model."""

    time: Finite
    value: Finite
    threshold: Positive


class RunRecord(_Part):
    """One run of a model."""

    settings: dict[str, str | bool | int | float]  # the scene's of this model, with the formulation it chose
    counters: dict[str, Count]  # of the work, and the number of contacts
    spread: dict[str, Count] = {}  # largest differences of these between neighbouring starts
    unexcited: list[str] = []  # channels that are constant: their range is below their floor
    unpredictable: list[str] = []  # channels without a predictable sample at which something happens
    channels: dict[str, list[Checkpoint]]


class SceneRecord(_Part):
    """A scene, the hash of its numbers without the solvers' settings, and its runs by their tier."""

    source: str  # a shipped name, or the path of a file as seen from the baseline's folder
    hash: str
    reference: dict[Literal["standard", "tight"], RunRecord] = {}
    exudyn: dict[Literal["standard", "tight"], RunRecord] = {}

    @property
    def runs(self) -> dict[Which, RunRecord]:
        """Its runs by model and tier."""
        models = {"reference": self.reference, "exudyn": self.exudyn}
        return {(model, tier): run for model, tiers in models.items() for tier, run in tiers.items()}


class Baseline(_Part):
    """The whole file; ``thresholds`` is the content of ``thresholds.toml``."""

    checksum: str = ""  # of the numbers; read and written, and empty in between
    platform: str
    versions: dict[str, str]
    thresholds: dict[str, Any]
    detection: dict[str, Any] | None = None  # rates of false alarms and of detected faults with these
    scenes: Annotated[dict[str, SceneRecord], Field(min_length=1)]


def read(path: Path) -> Baseline:
    """Read a baseline; a `BaselineError` without one, or for a file that `write` has not written."""
    with reading(path, BaselineError, "TOML"):
        try:
            baseline = Baseline.model_validate(tomllib.loads(contents(path)))
        except FileNotFoundError as error:
            raise BaselineError("there is no such baseline; sixbar gate --update makes one") from error
        except ValidationError as error:  # the place of a bad value and the rule
            raise BaselineError(explain(error, Baseline)) from error
    if baseline.checksum != checksum(baseline):
        fault = "does not match its checksum: it was edited" if baseline.checksum else "has no checksum"
        raise BaselineError(f"{path}: {fault}; restore it, or delete it and run sixbar gate --update")
    return baseline.model_copy(update={"checksum": ""})


def checksum(baseline: Baseline) -> str:
    """Return a hash of the numbers, whatever the layout of the text."""
    return digest(baseline.model_dump(mode="json", exclude={"checksum"}))


def physics_hash(scene: Scene) -> str:
    """Hash of a scene's numbers without the solvers' settings, which the baseline holds itself."""
    return digest({key: part for key, part in scene.data.items() if key not in ("scene", "solver")})[:16]


def source(scene: Scene, folder: Path) -> str:
    """Return the source of a scene: its shipped name, or its path relative to a folder."""
    if scene.source in (*shipped_scenes(), *shipped_linkages()):
        return scene.source
    return Path(os.path.relpath(Path(scene.source).expanduser(), folder)).as_posix()


def scenes_of(baseline: Baseline, folder: Path) -> tuple[list[Scene], list[str]]:
    """Load the scenes of a baseline in a folder; the second list names those that no longer exist."""
    scenes, missing = [], []
    for name, scene in baseline.scenes.items():
        if scene.source in (*shipped_scenes(), *shipped_linkages()):
            scenes.append(load_scene(scene.source))
        elif (folder / scene.source).is_file():
            scenes.append(load_scene(folder / scene.source))
        else:
            missing.append(name)
    return scenes, missing


def write(baseline: Baseline, path: Path) -> Path:
    """Write a baseline under a temporary name first; equal ones give the same bytes."""
    lines = [HEADER, f"checksum = {toml(checksum(baseline))}"]
    lines += [f"{key} = {toml(getattr(baseline, key))}" for key in ("platform", "versions", "thresholds")]
    if baseline.detection:
        lines += ["\n[detection]", *(f"{name} = {toml(rates)}" for name, rates in baseline.detection.items())]
    for name, scene in baseline.scenes.items():
        section = f"scenes.{toml(name)}"
        lines += [f"\n[{section}]", f"source = {toml(scene.source)}", f"hash = {toml(scene.hash)}"]
        for (model, tier), run in scene.runs.items():
            lines.append(f"\n[{section}.{model}.{tier}]")
            for key in ("settings", "counters", "spread", "unexcited", "unpredictable"):
                if (value := getattr(run, key)) or key in ("settings", "counters"):
                    lines.append(f"{key} = {toml(value)}")
            lines.append(f"\n[{section}.{model}.{tier}.channels]")
            for channel, points in run.channels.items():
                key = channel if channel.isidentifier() else toml(channel)  # a dot would make a table
                lines += [f"{key} = [", *(f"  {toml([*point])}," for point in points), "]"]
    write_text("\n".join(lines) + "\n", path)
    return path


# ---- runs and their records


def gated_runs(scene: Scene) -> dict[Which, Job]:
    """Return the runs of a scene that have a baseline."""
    if scene.is_linkage:
        return {(model, "standard"): Job(scene, model) for model in MODELS}
    closest = tight(scene, MODELS)
    assert closest is not None  # both models are ours
    jobs = {("reference", "tight"): Job(closest, "reference"), ("exudyn", "standard"): Job(scene, "exudyn")}
    if smallest("exudyn", scene.data) == "tree":
        jobs["exudyn", "tight"] = Job(closest, "exudyn")
    return jobs


def neighbours(gated: Job, tier: str, numbers: Sequence[int]) -> list[Job]:
    """Return runs from starts next to that of a gated run, in all directions.

    There are none without clearance, nor at the standard tier, where the steps matter more than the start.
    """
    if tier != "tight" or not gated.scene.loose:
        return []
    jobs = []
    for number in numbers:
        # Once and twice as far as a perturbed run, turned by the golden angle from one to the next.
        angle, shift = number * pi * (3.0 - sqrt(5.0)), (1 + number % 2) * perturbation(gated.scene)
        jobs.append(Job(move_start(gated.scene, shift * cos(angle), shift * sin(angle)), gated.model))
    return jobs


def scatter(gated: Job, table: Table, neighbours: Sequence[Table], channel: str) -> Array:
    """Return the part of a run's uncertainty that its neighbours show, shape (n,), in the channel's unit."""
    time = table.time
    width = window_samples(gated.scene.period, float(time[-1] - time[0]) / (time.size - 1))
    values = [neighbour.values(channel) for neighbour in neighbours]
    return spread(table.values(channel), values, LATER * width)


def record(runs: Runs, gated: Job, tier: str, neighbours: Sequence[Table] = ()) -> RunRecord:
    """Choose a run's checkpoints, spread evenly over the samples that can be one.

    ``runs`` are the run, made by ``gated`` at a tier, and the others of its family that give the uncertainty;
    ``neighbours`` those from starts next to its own.
    """
    limits, scene, table = thresholds(tier), gated.scene, runs.base
    predictable: dict[str, BoolArray] = {}
    checkpoints, unexcited, unpredictable = {}, [], []
    for name in expected(scene.data):  # positions come before what follows from them
        channel, values = table.definitions[name], table.values(name)
        u = model_uncertainty(runs, name, scene.period)
        assert u is not None  # every model of ours can be refined
        u = np.maximum(u, scatter(gated, table, neighbours, name))
        extent = float(np.ptp(values))
        predictable[name] = limits.predictable(u, channel.scale_value(scene.data, extent))
        if channel.follows is not None:
            predictable[name] &= predictable[channel.follows]
        candidates = np.flatnonzero(predictable[name] & (np.abs(values) > limits.k * u))
        if extent < channel.floor:
            unexcited.append(name)
            n = int(u.argmin())
            threshold = max(limits.k * float(u[n]), channel.floor)
            checkpoints[name] = [_checkpoint(float(table.time[n]), float(values[n]), threshold)]
        elif not candidates.size:
            unpredictable.append(name)
        else:
            at = candidates[np.unique(((np.arange(COUNT) + 0.5) / COUNT * candidates.size).astype(int))]
            rows = zip(table.time[at], values[at], limits.k * u[at], strict=True)
            checkpoints[name] = [_checkpoint(*map(float, row)) for row in rows]
    return RunRecord(
        settings=settings(scene.data, table, gated.model),
        counters=counters(table),
        spread=_spread(runs, neighbours),
        unexcited=unexcited,
        unpredictable=unpredictable,
        channels=checkpoints,
    )


def _checkpoint(time: float, value: float, threshold: float) -> Checkpoint:
    """Keep the significant digits: of the value to a hundredth of the threshold, of the threshold two."""
    rounded = Context(prec=2, rounding=ROUND_CEILING).create_decimal(Decimal(threshold))
    digits = 2 - floor(log10(threshold))
    return Checkpoint(float(f"{time:.9g}"), round(value, digits) + 0.0, float(rounded))  # without -0


def _spread(runs: Runs, neighbours: Sequence[Table]) -> dict[str, int]:
    """Return the largest distance of each counter that varies; of contacts in the whole family.

    Without neighbours (five bodies) the work varies in proportion to the contacts: where the contacts of the
    family differ, rounding alone leads to other ones, and to their steps.
    """
    counts = counters(runs.base)
    relatives = [run for run in (runs.finer, runs.coarser, *runs.perturbed_runs) if run is not None]
    others = [*map(counters, neighbours), *({"contacts": counters(run)["contacts"]} for run in relatives)]
    largest = {
        name: max((abs(other.get(name, value) - value) for other in others), default=0)
        for name, value in counts.items()
    }
    if not neighbours and counts["contacts"]:
        share = largest["contacts"] / counts["contacts"]
        largest |= {name: ceil(share * value) for name, value in counts.items() if name != "contacts"}
    return {name: distance for name, distance in largest.items() if distance}


def settings(scene: Mapping[str, Any], table: Table, model: str) -> dict[str, Any]:
    """Return the model's settings of a scene, with the formulation that it chose by itself."""
    formulation = table.provenance.get("formulation")
    return {**scene["solver"][model], **({} if formulation is None else {"formulation": formulation})}


def counters(table: Table) -> dict[str, int]:
    """Return the counters of a run's work, and the number of its contacts."""
    contacts = 0 if table.events is None else len(table.events)
    return {**table.provenance.get("counters", {}), "contacts": contacts}


def new_baseline(
    scenes: Sequence[Scene],
    folder: Path,
    old: Baseline | None = None,
    *,
    n_jobs: int = 1,
    on_progress: Progress | None = None,
) -> Baseline:
    """Create the baseline of scenes: every gated run with its family, which determines the thresholds.

    Paths of scenes are relative to its folder. The other scenes of an old one, which has none unless it is of
    the `same_origin`, are kept; so are its rates if there are no newer ones: thresholds that changed without
    them are a `BaselineError`. A failed run is a `RunError`.
    """
    rates = _rates(folder / RATES, old)
    plans = [
        (scene, which, gated, family(gated.scene, gated.model), neighbours(gated, which[1], RECORDED))
        for scene in scenes
        for which, gated in gated_runs(scene).items()
    ]
    jobs = [job for *_, relatives, others in plans for job in (*(job for _, job in relatives), *others)]
    outcomes = iter(run_all(jobs, n_jobs, on_progress))
    records: dict[str, Any] = {
        scene.name: {"source": source(scene, folder), "hash": physics_hash(scene)} for scene in scenes
    }
    for scene, (model, tier), gated, relatives, others in plans:
        tables = {}
        for kind, job in relatives:
            outcome = next(outcomes)
            table = usable_table(kind, outcome)
            tables[kind] = table_of(outcome, job) if table is None else table
        nearby = [table_of(next(outcomes), job) for job in others]
        runs = Runs(refinement=refinement(model, gated.scene), **tables)
        records[scene.name].setdefault(model, {})[tier] = record(runs, gated, tier, nearby)
    scene_records = {name: SceneRecord.model_validate(parts) for name, parts in records.items()}
    previous = {} if old is None else old.scenes
    return Baseline(
        platform=platform_name(),
        versions=versions(),
        thresholds=thresholds_record(),
        detection=rates,
        scenes=dict(sorted({**previous, **scene_records}.items())),
    )


def same_origin(baseline: Baseline) -> bool:
    """Return whether a baseline made here and now would have its platform, versions and thresholds."""
    now = (platform_name(), versions(), thresholds_record())
    return (baseline.platform, baseline.versions, baseline.thresholds) == now


def _rates(path: Path, old: Baseline | None) -> dict[str, Any] | None:
    """Find the rates that belong to the present thresholds; None where none were measured."""
    if path.is_file():
        with reading(path, BaselineError, "JSON"):
            rates = json.loads(contents(path))
            names = ("false_alarms", "detected")
            if not isinstance(rates, dict) or not {*names, "thresholds"} <= rates.keys():
                raise BaselineError(f"must hold thresholds, {' and '.join(names)}")
            if rates["thresholds"] != thresholds_record():
                raise BaselineError("was measured with other thresholds than those of thresholds.toml")
            return {name: rates[name] for name in names}
    if old is None or old.detection is None:
        return None
    if old.thresholds != thresholds_record():
        raise BaselineError(f"{path}: is required, with newly measured rates, since thresholds.toml changed")
    return old.detection
