"""One scene through the stages: the cheap look, both families of runs, confirmation, adjudication.

The cheap look is one run of the tree and the family of the reference, which costs a tenth of that. No
difference has less uncertainty than the reference: what this leaves unpredictable or explains stays so.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from comparison.accuracy.levels import refinement, thresholds
from comparison.accuracy.refine import levels
from comparison.execution.run import VIOLATED, Job, Progress
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.studies.campaign import adjudication
from comparison.studies.campaign.population import Case, loose_joints
from comparison.studies.detection.comparisons import summary
from comparison.tables.channels import channels
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import Runs, compare, model_uncertainty
from comparison.verdict.confirmation import confirm
from comparison.words.record import confirmation_record

TIER = "tight"
# m: the largest u of a predictable sample of slider_x at the tight tier with 0.2 mm of clearance.
DISTANCE = 1e-8
MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
STAGES = ("single runs", "families", "confirmation", "adjudication")
SCREENED, COMPARED, CONFIRMED, ADJUDICATED = STAGES
OUTCOMES = ("agree", "underestimated", "differ", "broken invariant", "not decided", "cannot compare")
AGREE, UNDERESTIMATED, DIFFER, BROKEN, NOT_DECIDED, FAILED = OUTCOMES


@dataclass(frozen=True)
class CaseTask(Task):
    """A case of the population."""

    case: Case
    models = MODELS

    @property
    def cost(self) -> float:
        """Expected time of the tree's runs: it grows with a cycle's duration, which `Job.cost` leaves out."""
        scene = self.case.scene
        return Job(scene, "exudyn").cost * (5.0 if self.case.family else 1.0) * (1.0 + scene.period)


def run_cases(cases: Sequence[Case], n_jobs: int, on_progress: Progress | None) -> list[Row]:
    """Return the rows of `examine`; cases that were examined before are not again."""
    spread = on_processes(n_jobs, adjudication.LIMIT)
    rows = measure_all(examine_case, [CaseTask(case) for case in cases], spread, on_progress)
    return [row if row["status"] == SUCCESS else empty(row["message"]) for row in rows]


def examine_case(task: CaseTask, progress: Progress) -> Row:
    """Examine a case in this process."""
    progress(0.0)
    return examine(task.case)


def empty(reason: str) -> Row:
    """Return the row of a scene of which nothing is known but why."""
    row = dict.fromkeys(("screening", "coverage", "first", "confirmation", "adjudication"))
    row |= {"outcome": FAILED, "reason": reason, "stage": ""}
    return row | {"breaches": {}, "failures": [], "seconds": {}}


class _FailedError(Exception):
    """A run without which there is nothing to compare."""


def examine(case: Case) -> Row:
    """Take a scene through the stages.

    The row has one of `OUTCOMES`; ``stage``, `SCREENED` or `COMPARED`; ``screening``, see `screen`;
    ``breaches`` by model; ``failures``: runs without success; ``first``, the earliest sample of a difference;
    ``confirmation`` and ``adjudication``, None where nothing was to be confirmed; ``seconds`` by stage.
    """
    row = empty("") | {"stage": SCREENED}
    try:
        _examine(row, case)
    except _FailedError:
        first = row["failures"][0]
        row["reason"] = f"{first['model']}, {first['kind']} run: {first['status']}"
        if any(one["status"] == VIOLATED for one in row["failures"]):
            row["outcome"] = BROKEN
    except TableError as error:
        row["reason"] = str(error)
    if row["outcome"] != DIFFER and any(row["breaches"].values()):
        messages = [f"{model}: {one['name']}" for model, shown in row["breaches"].items() for one in shown]
        row |= {"outcome": BROKEN, "reason": "; ".join(dict.fromkeys(messages))}
    return row


def _examine(row: Row, case: Case) -> None:
    """Go from stage to stage and note what is found in the row."""
    scene, begun = case.scene, time.process_time()

    def lap(stage: str) -> None:
        row["seconds"][stage] = time.process_time() - begun - sum(row["seconds"].values())

    def table(model: str, kind: str, level: Scene) -> Table | None:
        outcome = adjudication.run_here(level, model)
        if outcome.table is None:
            numbers = {"model": model, "kind": kind, "status": outcome.status, "message": outcome.message}
            said = {} if outcome.partial is None else outcome.partial.provenance.get("invariants", {})
            broken = [name for name, one in said.items() if one["value"] > one["bound"]]
            row["failures"].append(numbers | {"invariants": broken})
        return outcome.table

    def family(model: str) -> Runs:
        tables = {"base": bases[model]} | {
            kind: table(model, kind, level) for kind, level in levels(scene, model).items() if kind != "base"
        }
        there = {kind: one for kind, one in tables.items() if one is not None}
        if len(there) < len(tables):
            raise _FailedError
        return Runs(refinement=refinement(model, scene), **there)

    def ensemble(scenes: Sequence[Scene], model: str) -> list[Table]:
        tables = (adjudication.run_here(each, model).table for each in scenes)
        return [table for table in tables if table is not None]

    bases = {model: table(model, "base", scene) for model in MODELS}
    row["breaches"] = {
        model: adjudication.breaches(base) for model, base in bases.items() if base is not None
    }
    reference, tree = family(MODELS[0]), bases[MODELS[1]]
    if tree is None:
        raise _FailedError
    seen = row["screening"] = screen(scene, reference, tree)
    coverage, floor = seen["coverage"], thresholds(TIER).coverage
    row["coverage"] = coverage
    lap(SCREENED)
    if not (seen["parted"] or case.family or any(row["breaches"].values())):
        reason = "" if coverage >= floor else f"{coverage:.1%} of the samples are predictable"
        row |= {"outcome": NOT_DECIDED if reason else AGREE, "reason": reason}
        return
    row["stage"] = COMPARED
    both = reference, family(MODELS[1])
    result = compare(*both, scene=scene, tier=TIER, labels=MODELS)
    lap(COMPARED)
    if result.verdict == "differ":
        result = confirm(result, both, scene=scene, models=MODELS, run=ensemble)
        row["confirmation"] = confirmation_record(result)
        lap(CONFIRMED)
    positions = [result.channels[name] for name in ("slider_x", "slider_y")]
    coverage = min((one.coverage for one in positions if one.verdict != "unexcited"), default=0.0)
    short = summary(result)
    row |= {"outcome": NOT_DECIDED, "coverage": coverage, "reason": short["reason"], "first": short["first"]}
    if result.verdict == "differ":
        row["outcome"] = DIFFER
        row["adjudication"] = adjudication.adjudicate(result, (reference.base, tree), scene)
        lap(ADJUDICATED)
    elif result.verdict == "agree" and result.confirmation is not None:
        row["outcome"] = UNDERESTIMATED
    elif result.verdict == "agree" and coverage >= floor:
        row["outcome"] = AGREE


def screen(scene: Scene, reference: Runs, tree: Table) -> dict[str, Any]:
    """Compare one run of the tree with the reference.

    ``parted``: whether in a channel of the motion any sample before the first unpredictable stretch may speak
    against agreement, or more of all predictable samples than a verdict lets pass; ``time`` and ``channel``
    of the first; ``distance``: largest over the predictable samples, on the scale of each channel, times the
    clearance, m; ``coverage``: share of these samples, of the positions the least.
    """
    limits, size = thresholds(TIER), float(scene.data["clearance"][loose_joints(scene)[0]])
    parted, farthest, coverage = [], 0.0, 1.0
    for name in MOTION:
        channel = channels()[name]
        a, b = reference.base.values(name), tree.values(name)
        extent = float(max(a.max(), b.max()) - min(a.min(), b.min()))
        u = model_uncertainty(reference, name, scene.period)
        if u is None or extent < channel.floor:
            continue
        scale = channel.scale_value(scene.data, extent)
        predictable, apart = u <= limits.alpha * scale, np.abs(a - b)
        against = predictable & (apart > np.maximum(DISTANCE / size * scale, limits.k * u))
        known = np.logical_and.accumulate(predictable)
        if (against & known).any() or against.sum() > (1.0 - limits.share) * predictable.sum():
            parted.append((float(tree.time[against.argmax()]), name))
        farthest = max(farthest, float(apart[predictable].max(initial=0.0)) / scale)
        if channel.rate is not None:
            coverage = min(coverage, float(predictable.mean()))
    first, where = min(parted, default=(None, ""))
    numbers = {"time": first, "channel": where, "distance": farthest * size, "coverage": coverage}
    return {"parted": bool(parted)} | numbers
