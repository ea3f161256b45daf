"""Which of two models errs where they differ: what the tables show against themselves, and third opinions.

Two kinds of evidence count. A run in which a corner is inside its wall outside every contact contradicts
itself, whoever else agrees with it. And an opinion that is made of a model's own code and nevertheless stands
with the other model's run says that the model's answer depends on its settings. That a model's other opinions
stand with its own run proves nothing: a fault in what they share is in all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from comparison.execution.job import MODELS, Outcome
from comparison.execution.ledger import Row
from comparison.formatting import quantity
from comparison.scene import Scene
from comparison.studies.campaign.opinions import FINE_SAMPLES, Opinion, excerpt, opinions, restart_sample
from comparison.studies.campaign.walls import Breach, breaches
from comparison.tables.arrays import Array
from comparison.tables.channels import CONTACTS
from comparison.tables.table import Table
from comparison.verdict.results import SceneComparison

Run = Callable[[Scene, str], Outcome]
WINDOW = 0.05
"""Of a cycle after the first sample outside its threshold, over which distances are taken."""
LOOK_BACK = 0.05
"""Of a cycle: what happened earlier has shown itself before the first sample outside its threshold."""
CLOSE = 0.25
"""Of the distance between the two models: an opinion this close to one is at least three times as far from
the other, and stands with the one."""
OPEN = "open"


@dataclass(frozen=True)
class Evidence:
    """What one opinion, or one look at a model's own run, says."""

    name: str
    model: str
    distances: tuple[float, ...]
    """Largest over the window from the run of the reference and of Exudyn, in the channel's unit; () if it
    did not succeed."""
    stands: str
    """With the run of which model; "" with neither."""
    status: str


def adjudicate(result: SceneComparison, tables: tuple[Table, Table], scene: Scene, run: Run) -> Row:
    """Return who errs, and all that says so, as JSON holds it.

    The result is that of reference and Exudyn, whose runs are the tables, with a channel that differs.
    """
    channel, first, last = deciding(result)
    seen = float(result.time[first])
    missing = unmatched(tables, (seen - LOOK_BACK * scene.period, seen))
    start = restart_sample(scene, tables, _root(result, tables, missing, first))
    part = excerpt(scene, tables[0], start, last)
    bases = [table.values(channel)[start : last + 1] for table in tables]
    judged = np.arange(first - start, last + 1 - start)
    judged = judged[result.channels[channel].predictable[first : last + 1]]
    found = [
        _asked(opinion, run(opinion.scene, opinion.model), channel, bases, judged)
        for opinion in opinions(part)
    ]
    inside = {model: _shown(run(excerpt(scene, tables[0], 0, last, FINE_SAMPLES), model)) for model in MODELS}
    span = float(result.time[start]), float(result.time[last])
    errs, why = decide(found, inside, span)
    return {
        "errs": errs,
        "why": why,
        "channel": channel,
        "time": seen,
        "from": span[0],
        "until": span[1],
        "apart": float(np.abs(bases[0] - bases[1])[judged].max()),
        "missing": missing,
        "evidence": [asdict(one) for one in found],
        "inside": {model: [asdict(one) for one in of] for model, of in inside.items()},
    }


def deciding(result: SceneComparison) -> tuple[str, int, int]:
    """Return the channel to take distances in, the first sample outside its threshold, and the window's last.

    A position that a clearance moves, where one differs; else of the channels that differ the earliest.
    """
    assert result.scene is not None
    firsts: dict[str, int] = {}
    for name, channel in result.channels.items():
        if channel.verdict == "differ" and channel.u is not None:
            outside = np.abs(channel.difference) > channel.limits.k * channel.u
            judged = channel.predictable & outside
            firsts[name] = int((judged if judged.any() else outside).argmax())
    positions = [name for name in ("slider_x", "slider_y") if name in firsts]
    name = min(positions or firsts, key=lambda one: firsts[one])
    assert result.period is not None
    samples = int(np.searchsorted(result.time, result.time[firsts[name]] + WINDOW * result.period))
    return name, firsts[name], min(samples, result.time.size - 1)


def _root(
    result: SceneComparison, tables: tuple[Table, Table], missing: Sequence[Mapping[str, Any]], first: int
) -> int:
    """Return the sample from which on the difference may have grown: it is seen only when it is large.

    That of the first contact which one of the two has alone, or at which a run contradicts itself, if that
    was shortly before.
    """
    seen = float(result.time[first])
    roots = [one["start"] for one in missing] + [one.since for table in tables for one in breaches(table)]
    since = min((time for time in roots if seen - LOOK_BACK * (result.period or 0.0) <= time), default=seen)
    return int(np.searchsorted(result.time, min(since, seen)))


def _asked(
    of: Opinion, outcome: Outcome, channel: str, bases: Sequence[Array], judged: np.ndarray
) -> Evidence:
    if outcome.table is None:
        return Evidence(of.name, of.model, (), "", outcome.status)
    values = outcome.table.values(channel)
    distances = tuple(float(np.abs(values - base)[judged].max()) for base in bases)
    apart = float(np.abs(bases[0] - bases[1])[judged].max())
    stands = [side for side, distance in zip(MODELS, distances, strict=True) if distance <= CLOSE * apart]
    return Evidence(of.name, of.model, distances, stands[0] if stands else "", outcome.status)


def _shown(outcome: Outcome) -> list[Breach]:
    table = outcome.table or outcome.partial
    return [] if table is None else breaches(table)


def unmatched(tables: tuple[Table, Table], span: tuple[float, float]) -> list[dict[str, Any]]:
    """Return the contacts within a span of time that one table has and the other has not.

    Two contacts of one corner that overlap in time are one.
    """
    events = [table.events for table in tables]
    if events[0] is None or events[1] is None:
        return []
    found = []
    for own, other, lacks in ((events[0], events[1], MODELS[1]), (events[1], events[0], MODELS[0])):
        for corner, start, end in own[["corner", "start", "end"]].itertuples(index=False):
            if start > span[1] or end < span[0]:
                continue
            same = other[other["corner"] == corner]
            if not ((same["start"] <= end) & (same["end"] >= start)).any():
                found.append({"corner": corner, "start": float(start), "end": float(end), "lacks": lacks})
    return found


def decide(
    evidence: Sequence[Evidence], inside: Mapping[str, Sequence[Breach]], span: tuple[float, float]
) -> tuple[str, str]:
    """Return the model that errs, or `OPEN`, and the reason in one clause.

    ``inside`` is what the run of each model shows against itself; what happens outside the span, s, has
    nothing to do with the difference.
    """
    against: dict[str, list[str]] = {model: [] for model in MODELS}
    for model, found in inside.items():
        against[model] += [_words(one) for one in found if one.until >= span[0] and one.since <= span[1]]
    for model, other in (MODELS, MODELS[::-1]):
        own = [one for one in evidence if one.model == model and one.distances]
        if crossed := [one.name for one in own if one.stands == other]:
            all_of = f"{len(crossed)} of {len(own)} opinions of its own code"
            against[model].append(f"{all_of} stand with the other model's run ({'; '.join(crossed)})")
    accused = [model for model, reasons in against.items() if reasons]
    if len(accused) == 1:
        return accused[0], "; ".join(against[accused[0]])
    if accused:
        return OPEN, "; ".join(f"{model}: {', '.join(against[model])}" for model in accused)
    return OPEN, "every opinion stands with its own model's run, or with neither"


def _words(one: Breach) -> str:
    where = CONTACTS[one.corner]
    if one.name == "overlap":
        return f"two contacts of the {where} overlap by {quantity(one.value, 's')} at {one.time:.7g} s"
    return (
        f"its {where} corner is {quantity(one.value, 'm')} inside the wall outside any contact, "
        f"{one.since:.7g} to {one.until:.7g} s"
    )
