"""One scene through the stages: the cheap look, both families of runs, confirmation, adjudication.

The cheap look is one run of the tree and the family of the reference, which costs a tenth of that. No
difference has less uncertainty than the reference: what this leaves unpredictable or explains stays so.

Adjudication says which of two models errs where they differ: by what tables show against themselves, and by
third opinions. A model errs whose run contradicts itself, or whose own code, run otherwise, stands with the
other model. That its opinions stand with its own run proves nothing: they may share the fault.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import label

from comparison.accuracy.levels import refinement, thresholds
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Runs, model_uncertainty
from comparison.execution.run import VIOLATED, Job, Outcome, Progress, RunError, run_one, successful
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.formatting import quantity
from comparison.models import MODELS, engine_names
from comparison.scene import Scene, SceneError
from comparison.studies.campaign.population import Case, loose_joints
from comparison.studies.detection.pairs import summary
from comparison.tables.channels import CONTACTS, CORNERS, Array, channels, touching
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import compare
from comparison.verdict.confirmation import confirm
from comparison.verdict.results import SceneComparison
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
    spread = on_processes(n_jobs, LIMIT)
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
        outcome = run_here(level, model)
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
        tables = (run_here(each, model).table for each in scenes)
        return [table for table in tables if table is not None]

    bases = {model: table(model, "base", scene) for model in MODELS}
    row["breaches"] = {model: breaches(base) for model, base in bases.items() if base is not None}
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
        row["adjudication"] = adjudicate(result, (reference.base, tree), scene)
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


# ---- adjudication: what tables show against themselves, and opinions of the models' own code

# s after which a scene that hangs is stopped: ten times what the dearest that came to the last stage took.
LIMIT = 3600.0
WINDOW = 0.05  # of a cycle after the first sample outside its threshold, over which distances are taken
LOOK_BACK = 0.05  # of a cycle: what happened earlier has shown itself before that sample
# Of the distance between the models: an opinion this close to one is three times as far from the other.
CLOSE = 0.25
OPEN = "open"
SMALL_STEP = 1e-7  # s: a fifth of what five bodies take at "strict"
MOST_STEPS = 2_000_000  # of the five bodies, half a minute
FINE_SAMPLES = 20  # times as many samples in the runs that are searched for corners inside their walls
BESIDE = 2  # samples between the restart and the difference, at least
# m. A touch is located to where the gap rounds, a difference of coordinates of half a metre, 1e-16 m times
# the tens of operations it is made of; the interpolant of a sample errs by the tolerance, 1e-12 to 1e-11.
OPEN_DEPTH = 1e-11
# s. A corner that leaves and touches again at one instant ends one contact and begins another at one number.
OVERLAP = 1e-12
FINER_TREE = "tree, tolerance / 10, steps of 1e-5 s at most"
ENGINE = "pinocchio"  # that of ``examples/third_engine``


def run_here(scene: Scene, model: str) -> Outcome:
    """Run a scene in this process."""
    try:
        return Outcome("success", table=run_one(scene, model))
    except RunError as error:
        return error.outcome
    except SceneError as error:
        return Outcome("bad input", str(error))


def breaches(table: Table | None) -> list[Row]:
    """Return the worst breach of each kind and corner: inside a wall outside contacts, contacts that overlap.

    What a table shows against its own model, and by code that shares nothing with how a model locates
    contacts. ``time`` is that of the deepest sample, or where the overlap begins; ``since`` and ``until`` are
    the first and the last of the samples about it outside the ``bound``.
    """
    worst: list[Row] = []
    if table is None or table.events is None:
        return worst

    def breach(name: str, corner: str, *numbers: float) -> None:
        named = zip(("time", "value", "bound", "since", "until"), map(float, numbers), strict=True)
        worst.append({"name": name, "corner": corner, **dict(named)})

    scene, events, time = table.provenance.get("scene", {}), table.events, table.time
    for corner in CORNERS:
        if f"corner_{corner}_gap" not in table.frame:
            continue
        gap, sharing = table.values(f"corner_{corner}_gap"), touching(corner, scene)
        spans = events.loc[events["corner"].isin(sharing), ["start", "end"]].to_numpy(float)
        # How many contacts have begun before a sample, less how many have ended: closed intervals.
        begun = np.searchsorted(np.sort(spans[:, 0]), time, side="right")
        over = np.searchsorted(np.sort(spans[:, 1]), time, side="left")
        inside = (begun == over) & (gap < -OPEN_DEPTH)
        if inside.any():
            at = int(np.where(inside, gap, np.inf).argmin())
            labels, _ = label(inside)
            span = time[np.flatnonzero(labels == labels[at])[[0, -1]]]
            breach("open-depth", corner, time[at], -gap[at], OPEN_DEPTH, *span)
    for corner, own in events.groupby(events["corner"].map(lambda place: touching(place, scene)[0])):
        starts, ends = own.sort_values("start", kind="stable")[["start", "end"]].to_numpy(float).T
        # The latest end so far: a long contact may cover several later ones.
        overlap = np.maximum.accumulate(ends)[:-1] - starts[1:]
        if overlap.size and overlap.max() > OVERLAP:
            at = int(overlap.argmax())
            begin = starts[at + 1]
            breach("overlap", str(corner), begin, overlap[at], OVERLAP, begin, ends[at])
    return worst


def adjudicate(result: SceneComparison, tables: tuple[Table, Table], scene: Scene) -> Row:
    """Return who errs in a comparison whose runs are the tables, and all that says so, as JSON holds it."""
    channel, first, last = deciding(result)
    seen = float(result.time[first])
    missing = unmatched(tables, (seen - LOOK_BACK * scene.period, seen))
    # The difference is seen only when it is large: it may have begun where the contacts part.
    roots = [one["start"] for one in missing] + [one["since"] for table in tables for one in breaches(table)]
    root = min((time for time in roots if seen - LOOK_BACK * scene.period <= time <= seen), default=seen)
    start = restart_sample(scene, tables, int(np.searchsorted(result.time, root)))
    part = excerpt(scene, tables[0], start, last)
    bases = [table.values(channel)[start : last + 1] for table in tables]
    judged = np.arange(first, last + 1)[result.channels[channel].predictable[first : last + 1]] - start
    evidence = [
        opinion(name, model, run_here(asked, model), channel, bases, judged)
        for name, model, asked in opinions(part)
    ]
    fine = excerpt(scene, tables[0], 0, last, FINE_SAMPLES)
    outcomes = ((model, run_here(fine, model)) for model in MODELS)
    inside = {model: breaches(outcome.table or outcome.partial) for model, outcome in outcomes}
    span = float(result.time[start]), float(result.time[last])
    errs, why = decide(evidence, inside, span)
    return {
        "errs": errs,
        "why": why,
        "channel": channel,
        "time": seen,
        "from": span[0],
        "until": span[1],
        "apart": float(np.abs(bases[0] - bases[1])[judged].max()),
        "missing": missing,
        "evidence": evidence,
        "inside": inside,
    }


def deciding(result: SceneComparison) -> tuple[str, int, int]:
    """Return the channel to take distances in, the first sample outside its threshold, and the window's last.

    A position that a clearance moves, where one differs; else of the channels that differ the earliest.
    """
    firsts: dict[str, int] = {}
    for name, channel in result.channels.items():
        if channel.verdict == "differ" and channel.u is not None:
            outside = np.abs(channel.difference) > channel.limits.k * channel.u
            judged = channel.predictable & outside
            firsts[name] = int((judged if judged.any() else outside).argmax())
    positions = [name for name in ("slider_x", "slider_y") if name in firsts]
    name = min(positions or firsts, key=lambda one: firsts[one])
    assert result.period is not None
    last = int(np.searchsorted(result.time, result.time[firsts[name]] + WINDOW * result.period))
    return name, firsts[name], min(last, result.time.size - 1)


def unmatched(tables: tuple[Table, Table], span: tuple[float, float]) -> list[Row]:
    """Return the contacts within a span of time that one table alone has: none of that corner overlaps it."""
    a, b = (table.events for table in tables)
    missing: list[Row] = []
    for own, other, lacks in ((a, b, MODELS[1]), (b, a, MODELS[0])):
        if own is None or other is None:
            return []
        near = own[(own["start"] <= span[1]) & (own["end"] >= span[0])]
        for corner, start, end in near[["corner", "start", "end"]].itertuples(index=False):
            same = other[other["corner"] == corner]
            if not ((same["start"] <= end) & (same["end"] >= start)).any():
                missing.append({"corner": corner, "start": float(start), "end": float(end), "lacks": lacks})
    return missing


def restart_sample(scene: Scene, tables: tuple[Table, Table], before: int) -> int:
    """Return the last sample, `BESIDE` before another or more, at which nothing touches in either table.

    There four numbers are the whole state: opinions have nothing to magnify, five bodies can afford a small
    step. 0, the start, where there is none, or the motion has more coordinates than a scene gives a start.
    """
    if scene.data["joints"]["crank_pin"] != "ideal":
        return 0
    free = np.ones(max(1, before - BESIDE + 1), dtype=np.bool_)
    for table in tables:
        time = table.time[: free.size]
        for start, end in [] if table.events is None else table.events[["start", "end"]].to_numpy(float):
            free &= (time < start) | (time > end)
    return int(np.flatnonzero(free)[-1]) if free.any() else 0


def excerpt(scene: Scene, table: Table, first: int, last: int, finer: int = 1) -> Scene:
    """Return the scene from sample 0, or one at which nothing touches, to another, sampled so much finer."""
    per_cycle = scene.data["output"]["samples_per_cycle"]
    values: dict[str, object] = {
        "drive.cycles": (last - first) / per_cycle,
        "output.samples_per_cycle": per_cycle * finer,
    }
    if first:
        mechanism = scene.data["mechanism"]
        turned = np.sign(scene.data["drive"]["speed_rpm"]) * 360.0 * first / per_cycle
        state = {name: float(table.values(f"slider_{name}")[first]) for name in ("x", "angle", "vx", "omega")}
        values |= {
            "mechanism.crank_angle_deg": float(mechanism["crank_angle_deg"] + turned),
            "initial.slider_offset": state.pop("x") - mechanism["guide_x"],
        } | {f"initial.slider_{name}": value for name, value in state.items()}
    return scene.with_values(values)


def opinions(scene: Scene) -> list[tuple[str, str, Scene]]:
    """Return who is asked about a scene at the settings of the tight tier: name, model and its scene."""
    reference, exudyn = (scene.data["solver"][model]["tolerance"] for model in MODELS)
    step = max(SMALL_STEP, scene.duration / MOST_STEPS)
    changes: list[tuple[str, str, dict[str, object]]] = [
        ("reference, run again", "reference", {}),
        ("multipliers", "reference", {"formulation": "multiplier"}),
        ("reference, tolerance / 10", "reference", {"tolerance": reference / 10.0}),
        ("reference by scipy's DOP853", "reference", {"method": "scipy-DOP853"}),
        ("reference by LSODA", "reference", {"method": "LSODA"}),
        ("tree, run again", "exudyn", {}),
        (FINER_TREE, "exudyn", {"tolerance": exudyn / 10.0, "step": 1e-5}),
        ("five bodies", "exudyn", {"formulation": "full", "step": step}),
    ]
    if scene.data["joints"]["crank_pin"] != "ideal":
        del changes[1]
    return [
        (name, model, scene.with_values({f"solver.{model}.{key}": value for key, value in values.items()}))
        for name, model, values in changes
    ]


def opinion(
    name: str, model: str, outcome: Outcome, channel: str, bases: Sequence[Array], judged: Any
) -> Row:
    """Return an opinion's largest distances from both models' runs, and with which it ``stands``, or ""."""
    distances: list[float] = []
    stands: list[str] = []
    if outcome.table is not None:
        values = outcome.table.values(channel)
        distances = [float(np.abs(values - base)[judged].max()) for base in bases]
        apart = float(np.abs(bases[0] - bases[1])[judged].max())
        stands = [side for side, distance in zip(MODELS, distances, strict=True) if distance <= CLOSE * apart]
    side = stands[0] if len(stands) == 1 else ""
    return {"name": name, "model": model, "distances": distances, "stands": side, "status": outcome.status}


def decide(
    evidence: Sequence[Row], inside: Mapping[str, Sequence[Row]], span: tuple[float, float]
) -> tuple[str, str]:
    """Return the model that errs, or `OPEN`, and why; breaches ``inside`` count that touch the span, s."""
    against = {
        model: [_words(one) for one in shown if one["until"] >= span[0] and one["since"] <= span[1]]
        for model, shown in inside.items()
    }
    for model, other in (MODELS, MODELS[::-1]):
        own = [one for one in evidence if one["model"] == model and one["distances"]]
        if crossed := [one["name"] for one in own if one["stands"] == other]:
            share = f"{len(crossed)} of {len(own)} opinions of its own code"
            against[model].append(f"{share} stand with the other model's run ({'; '.join(crossed)})")
    accused = [model for model, reasons in against.items() if reasons]
    if len(accused) == 1:
        return accused[0], "; ".join(against[accused[0]])
    if accused:
        return OPEN, "; ".join(f"{model}: {', '.join(against[model])}" for model in accused)
    return OPEN, "every opinion stands with its own model's run, or with neither"


def _words(one: Row) -> str:
    where = CONTACTS[one["corner"]]
    if one["name"] == "overlap":
        return f"two contacts of the {where} overlap by {quantity(one['value'], 's')} at {one['time']:.7g} s"
    return (
        f"its {where} corner is {quantity(one['value'], 'm')} inside the wall outside any contact, "
        f"{one['since']:.7g} to {one['until']:.7g} s"
    )


# ---- a third engine, asked after the campaign, whose rows are the same whether or not it is installed


@dataclass(frozen=True)
class OpenTask(Task):
    """A scene whose difference is open."""

    case: Case
    adjudication: Mapping[str, Any]
    models = (*MODELS, ENGINE)


def with_third_opinions(rows: Sequence[tuple[Case, Row]], n_jobs: int) -> list[tuple[Case, Row]]:
    """Return cases and rows with the opinion of `ENGINE` on every open difference; as they are without it.

    The model errs with whose run it does not stand.
    """
    heard = list(rows)
    places = [n for n, (_, row) in enumerate(rows) if (row["adjudication"] or {}).get("errs") == OPEN]
    if not places or ENGINE not in engine_names():
        return heard
    tasks = [OpenTask(rows[n][0], rows[n][1]["adjudication"]) for n in places]
    for n, row in zip(places, measure_all(ask, tasks, on_processes(n_jobs, LIMIT)), strict=True):
        case, own = rows[n]
        said = row.get("evidence") or opinion(ENGINE, ENGINE, Outcome(row["status"]), "", [], None)
        side = said["stands"]
        stands = f" stands with {f'the run of {side}' if side else 'neither'}"
        why = f"{ENGINE}{stands if said['status'] == 'success' else ': ' + said['status']}"
        dispute = own["adjudication"] | {
            "errs": next((model for model in MODELS if side and model != side), OPEN),
            "why": f"{why}; {own['adjudication']['why']}",
            "evidence": [*own["adjudication"]["evidence"], said],
        }
        heard[n] = case, own | {"adjudication": dispute}
    return heard


def ask(task: OpenTask, progress: Progress) -> Row:
    """Return the opinion of `ENGINE`, at the tolerance of the reference, on an open adjudication."""
    progress(0.0)
    scene, dispute = task.case.scene, task.adjudication
    runs = [successful(run_here(scene, model), Job(scene, model)) for model in MODELS]
    first, seen, last = (
        int(np.abs(runs[0].time - dispute[key]).argmin()) for key in ("from", "time", "until")
    )
    tolerance = scene.data["solver"]["reference"]["tolerance"]
    try:
        part = excerpt(scene, runs[0], first, last).with_values({f"solver.{ENGINE}.tolerance": tolerance})
        outcome = run_here(part, ENGINE)
    except SceneError as error:
        outcome = Outcome(f"bad input: {error}")
    bases = [table.values(dispute["channel"])[first : last + 1] for table in runs]
    return {
        "evidence": opinion(ENGINE, ENGINE, outcome, dispute["channel"], bases, slice(seen - first, None))
    }
