"""The model that errs where two differ: breaches of a table against itself, and third opinions.

A model errs whose run contradicts itself, or whose own code, run otherwise, stands with the other model. That
its opinions stand with its own run proves nothing: they may share the fault. Last, where it is installed and
covers the scene, the truth engine is asked: it decides if it stands with one model alone.
"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import label

from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import run_here
from comparison.execution.store import Row
from comparison.formatting import quantity
from comparison.models import MODELS, engine_names
from comparison.scene import Scene
from comparison.studies.shared.scenes import at_tier
from comparison.tables.channels import CONTACTS, CORNERS, Array, BoolArray, corners_of
from comparison.tables.table import Table
from comparison.verdict.results import SceneComparison

WINDOW = 0.05  # of a cycle after the first sample outside its threshold, over which distances are taken
LOOK_BACK = 0.05  # of a cycle: an earlier breach has shown itself before that sample
# Of the distance between the models: an opinion this close to one is three times as far from the other.
CLOSE = 0.25
OPEN = "open"
TRUTH = "truth"  # model of examples/truth_engine
SMALL_STEP = 1e-7  # s: a fifth of the step of five bodies at "strict"
MOST_STEPS = 2_000_000  # of the five bodies, half a minute
FINE_SAMPLES = 20  # times as many samples in the runs that are searched for corners inside their walls
# m. A touch is located to where the gap rounds, a difference of coordinates of half a metre, 1e-16 m times
# the tens of operations it is made of; the interpolant of a sample errs by the tolerance, 1e-12 to 1e-11.
OPEN_DEPTH = 1e-11
# s. A corner that leaves and touches again at one instant ends one contact and begins another at one number.
OVERLAP = 1e-12


def breaches(table: Table | None) -> list[Row]:
    """Return the worst breach of each kind and corner: inside a wall outside contacts, contacts that overlap.

    They speak against the table's own model, by code that shares nothing with a model's location of
    contacts. ``time`` is that of the deepest sample, or where the overlap begins; ``since`` and ``until`` are
    the first and the last of the samples about it outside the bound.
    """
    worst: list[Row] = []
    if table is None or table.events is None:
        return worst

    def breach(name: str, corner: str, *numbers: float) -> None:
        row = zip(("time", "value", "since", "until"), map(float, numbers), strict=True)
        worst.append({"name": name, "corner": corner, **dict(row)})

    scene, events, time = table.provenance.get("scene", {}), table.events, table.time
    for corner in CORNERS:
        if f"corner_{corner}_gap" not in table.frame:
            continue
        gap, sharing = table.values(f"corner_{corner}_gap"), corners_of(corner, scene)
        spans = events.loc[events["corner"].isin(sharing), ["start", "end"]].to_numpy(float)
        # Contacts that began before a sample, and those that ended: closed intervals.
        starts_before = np.searchsorted(np.sort(spans[:, 0]), time, side="right")
        ends_before = np.searchsorted(np.sort(spans[:, 1]), time, side="left")
        deep = (starts_before == ends_before) & (gap < -OPEN_DEPTH)
        if deep.any():
            at = int(np.where(deep, gap, np.inf).argmin())
            labels, _ = label(deep)
            span = time[np.flatnonzero(labels == labels[at])[[0, -1]]]
            breach("open-depth", corner, time[at], -gap[at], *span)
    for corner, contacts in events.groupby(events["corner"].map(lambda place: corners_of(place, scene)[0])):
        starts, ends = contacts.sort_values("start", kind="stable")[["start", "end"]].to_numpy(float).T
        # The latest end so far: a long contact may cover several later ones.
        overlap = np.maximum.accumulate(ends)[:-1] - starts[1:]
        if overlap.size and overlap.max() > OVERLAP:
            at = int(overlap.argmax())
            begin = starts[at + 1]
            breach("overlap", str(corner), begin, overlap[at], begin, ends[at])
    return worst


def breach_words(one: Row) -> str:
    """Return a breach in a few words."""
    where = CONTACTS[one["corner"]]
    if one["name"] == "overlap":
        return f"two contacts of the {where} overlap by {quantity(one['value'], 's')} at {one['time']:.7g} s"
    return (
        f"its {where} corner is {quantity(one['value'], 'm')} inside the wall outside any contact, "
        f"{one['since']:.7g} to {one['until']:.7g} s"
    )


def adjudicate(result: SceneComparison, runs: Sequence[Runs], scene: Scene) -> tuple[str, str]:
    """Return the model that errs in a comparison that differs, or `OPEN`, and why.

    Both models run the scene again up to just after the difference: with finer samples, searched for corners
    inside their walls, and with the other settings of `opinions`. As only predictable samples are judged,
    no such run has a reason to leave its own model.
    """
    assert result.attribution is not None
    channel, begin = result.attribution.outside_in, result.attribution.outside_from
    if not channel:
        return OPEN, "open: no sample that differs is predictable"
    window = np.array([begin, begin + WINDOW * scene.period])
    first, last = np.searchsorted(result.time, window).clip(max=result.time.size - 1)
    per_cycle = scene.data["output"]["samples_per_cycle"]
    short_scene = at_tier(scene.with_values({"drive.cycles": float(last / per_cycle)}), "tight")
    bases = [side.base.values(channel)[first : last + 1] for side in runs]
    judged = result.channels[channel].judged[first : last + 1]
    fine_scene = short_scene.with_values({"output.samples_per_cycle": FINE_SAMPLES * per_cycle})
    evidence: dict[str, list[str]] = {model: [] for model in MODELS}
    for model in MODELS:
        outcome = run_here(fine_scene, model)
        evidence[model] += [
            breach_words(one)
            for one in breaches(outcome.table or outcome.partial)
            if one["until"] >= begin - LOOK_BACK * scene.period
        ]
    for name, model, opinion in opinions(short_scene):
        table = run_here(opinion, model).table
        side = "" if table is None else stands(table.values(channel)[first : last + 1], bases, judged)
        if side not in ("", model):
            evidence[model].append(f"its own code stands with the other model's run ({name})")
    errs, reason = decide(evidence)
    table = run_here(short_scene, TRUTH).table if TRUTH in engine_names() else None
    side = "" if table is None else stands(table.values(channel)[first : last + 1], bases, judged)
    if not side:
        return errs, reason
    errs = next(model for model in MODELS if model != side)
    return errs, f"{errs} errs: the truth engine stands with {side} alone; without it: {reason}"


def opinions(scene: Scene) -> list[tuple[str, str, Scene]]:
    """Return the opinions on a scene at the settings of the tight tier: name, model and its scene."""
    reference, exudyn = (scene.data["solver"][model]["tolerance"] for model in MODELS)
    step = max(SMALL_STEP, scene.duration / MOST_STEPS)
    changes: list[tuple[str, str, dict[str, object]]] = [
        ("multipliers", "reference", {"formulation": "multiplier"}),
        ("reference, tolerance / 10", "reference", {"tolerance": reference / 10.0}),
        ("reference by scipy's DOP853", "reference", {"method": "scipy-DOP853"}),
        ("reference by LSODA", "reference", {"method": "LSODA"}),
        ("tree, run again", "exudyn", {}),
        (
            "tree, tolerance / 10, steps of 1e-5 s at most",
            "exudyn",
            {"tolerance": exudyn / 10.0, "step": 1e-5},
        ),
        ("five bodies", "exudyn", {"formulation": "full", "step": step}),
    ]
    if scene.data["joints"]["crank_pin"] != "ideal":
        del changes[0]
    return [
        (name, model, scene.with_values({f"solver.{model}.{key}": value for key, value in values.items()}))
        for name, model, values in changes
    ]


def stands(values: Array, bases: Sequence[Array], judged: BoolArray) -> str:
    """Return the model with whose run alone an opinion stands on the judged samples, or ""."""
    distance = float(np.abs(bases[0] - bases[1])[judged].max())
    sides = [
        model
        for model, base in zip(MODELS, bases, strict=True)
        if np.abs(values - base)[judged].max() <= CLOSE * distance
    ]
    return sides[0] if len(sides) == 1 else ""


def decide(evidence: dict[str, list[str]]) -> tuple[str, str]:
    """Return the one model that there is something against, or `OPEN`, and why."""
    accused = [model for model in MODELS if evidence[model]]
    if len(accused) == 1:
        return accused[0], f"{accused[0]} errs: {'; '.join(evidence[accused[0]])}"
    if accused:
        return OPEN, "open: " + "; ".join(f"{model}: {', '.join(evidence[model])}" for model in accused)
    return OPEN, "open: every opinion stands with its own model's run, or with neither"
