"""Statements that compare two conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from comparison.formatting import number, quantity
from comparison.reliability.interference import ROUNDING
from comparison.studies.paper.decision import CONTRADICTED, SUPPORTED, UNDECIDED, Decision, decide, per_cent
from comparison.studies.paper.measures import largest_error, members, reliabilities
from comparison.studies.paper.runs import LONG_SAMPLES, Runs
from comparison.tables.arrays import Array
from comparison.tables.channels import channels

MOST = 0.75
"""Of all pairs of turns: from so much on the one condition's turn is said to be worse than the other's."""
LITTLE = 0.05
"""Relative difference of two peaks that counts as little."""


def larger(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether one condition's errors are larger than another's.

    Two looks: the second turn, as the paper has it, from several starts; and the largest errors of every
    later turn. Supported where both say so: all starts of the one are above all of the other, and so are
    most of the turns. Contradicted where both say the opposite.
    """
    channel = claim["channel"]
    more, less = (_second_turn(runs, claim[side], model, channel) for side in ("more", "less"))
    unit = channels()[channel].unit
    told = f"second turn {_span(more, unit)} against {_span(less, unit)}"
    looks = [_order(more.min() > less.max(), more.max() < less.min())]
    many = [later_turns(runs, claim[side], model, channel) for side in ("more", "less")]
    if all(each.size for each in many):
        share = above(*many)
        looks.append(_order(share >= MOST, share <= 1 - MOST))
        what = "largest force" if channel == "slider_ay" else "largest error"
        told += f"; later turns: {what} greater in {per_cent(share)} of the pairs"
    verdict = looks[0] if len(set(looks)) == 1 else UNDECIDED
    return Decision(verdict, told)


def alike(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether two conditions' largest errors of the second turn are nearly the same."""
    channel = claim["channel"]
    a, b = (np.median(_second_turn(runs, scene, model, channel)) for scene in claim["scenes"])
    unit = channels()[channel].unit
    change = float(abs(b / a - 1))
    evidence = f"{quantity(float(a), unit)} and {quantity(float(b), unit)}, {per_cent(change)} apart"
    return decide(-change, -2 * LITTLE, -LITTLE, evidence)


def more_contacts(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether the slider touches its guide more often in a turn."""
    more, less = (contacts_per_turn(runs, claim[side], model) for side in ("more", "less"))
    share = above(more, less)
    told = (
        f"{number(float(np.median(more)))} and {number(float(np.median(less)))} contacts in the median turn"
    )
    return decide(share, 1 - MOST, MOST, f"{told}; more in {per_cent(share)} of the pairs of turns")


def less_reliable(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether the smallest reliability falls, by more than the rounding of the print."""
    more, less = (reliabilities(runs, claim[side], model)[claim["quantity"]] for side in ("more", "less"))
    evidence = f"{more.minimum:.7f} against {less.minimum:.7f}"
    if more.capped[more.worst] and less.capped[less.worst]:
        evidence += ", both at the cap"
    return decide(less.minimum - more.minimum, -ROUNDING, ROUNDING, evidence)


def above(a: Array, b: Array) -> float:
    """Return the share of pairs in which the first is larger, ties half: Mann and Whitney's statistic."""
    difference = a[:, None] - b[None, :]
    return float(np.mean((difference > 0) + 0.5 * (difference == 0)))


def later_turns(runs: Runs, scene: str, model: str, channel: str) -> Array:
    """Return what each turn from the second on has: the largest error, of the acceleration the largest force.

    A contact is shorter than the interval of the samples of a long run; its peak force, which the
    acceleration's error follows, stands in the table of contacts.
    """
    if (scene, model) not in runs.long:
        return np.empty(0)
    if channel == "slider_ay":
        return _largest_forces(runs, scene, model)
    return np.asarray(np.abs(runs.long_errors(scene, model, channel)).max(axis=1)[1:])


def contacts_per_turn(runs: Runs, scene: str, model: str) -> Array:
    """Return how many contacts begin in each turn of a long run, from the second on."""
    turn, _, turns = _contacts(runs, scene, model)
    return np.bincount(turn, minlength=turns)[1:].astype(np.float64)


def _largest_forces(runs: Runs, scene: str, model: str) -> Array:
    turn, forces, turns = _contacts(runs, scene, model)
    found = np.zeros(turns)
    np.maximum.at(found, turn, forces)
    return found[1:]


def _contacts(runs: Runs, scene: str, model: str) -> tuple[np.ndarray[Any, np.dtype[np.intp]], Array, int]:
    """Return of each contact the turn in which it begins and its peak force, N; and the number of turns."""
    run = runs.long[scene, model]
    turns = (run.time.size - 1) // LONG_SAMPLES
    if run.events is None:
        return np.empty(0, np.intp), np.empty(0), turns
    turn = (run.events["start"].to_numpy(dtype=np.float64) / run.time[-1] * turns).astype(np.intp)
    inside = turn < turns
    return turn[inside], run.events["peak_force"].to_numpy(dtype=np.float64)[inside], turns


def _second_turn(runs: Runs, scene: str, model: str, channel: str) -> Array:
    return np.array(
        [abs(largest_error(runs, scene, model, channel, k).value) for k in range(members(runs, scene, model))]
    )


def _order(over: bool | np.bool_, under: bool | np.bool_) -> str:
    return SUPPORTED if over else CONTRADICTED if under else UNDECIDED


def _span(values: Sequence[float] | Array, unit: str) -> str:
    low, high = quantity(float(np.min(values)), unit), quantity(float(np.max(values)), unit)
    return low if low == high else f"{low} … {high}"
