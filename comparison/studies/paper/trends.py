"""Statements that compare two conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from comparison.formatting import number, quantity
from comparison.reliability.interference import ROUNDING
from comparison.studies.paper.decision import CONTRADICTED, SUPPORTED, UNDECIDED, Decision, decide, per_cent
from comparison.studies.paper.measures import largest_error, reliabilities
from comparison.studies.paper.runs import Runs
from comparison.tables.arrays import Array
from comparison.tables.channels import channels

MOST = 0.75
"""Of all pairs of cycles: from so much on the one condition's cycle is said to be worse than the other's."""
LITTLE = 0.05
"""Relative difference of two peaks that counts as little."""


def larger(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether one condition's errors are larger than another's.

    Compared twice: the second cycle, as the paper has it, from several starts; and the largest errors of
    every later cycle. Supported where both say so: all starts of the one are above all of the other, and so
    are most of the cycles. Contradicted where both say the opposite.
    """
    channel = claim["channel"]
    more, less = (_second_cycle(runs, claim[side], model, channel) for side in ("more", "less"))
    unit = channels()[channel].unit
    evidence = f"second cycle {_span(more, unit)} against {_span(less, unit)}"
    verdicts = [_order(more.min() > less.max(), more.max() < less.min())]
    many = [later_cycles(runs, claim[side], model, channel) for side in ("more", "less")]
    if all(each.size for each in many):
        share = above(*many)
        verdicts.append(_order(share >= MOST, share <= 1 - MOST))
        what = "largest force" if channel == "slider_ay" else "largest error"
        evidence += f"; later cycles: {what} greater in {per_cent(share)} of the pairs"
    verdict = verdicts[0] if len(set(verdicts)) == 1 else UNDECIDED
    return Decision(verdict, evidence)


def alike(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether two conditions' largest errors of the second cycle are nearly the same."""
    channel = claim["channel"]
    a, b = (np.median(_second_cycle(runs, scene, model, channel)) for scene in claim["scenes"])
    unit = channels()[channel].unit
    change = float(abs(b / a - 1))
    evidence = f"{quantity(float(a), unit)} and {quantity(float(b), unit)}, {per_cent(change)} apart"
    return decide(-change, -2 * LITTLE, -LITTLE, evidence)


def more_contacts(runs: Runs, model: str, claim: Mapping[str, Any]) -> Decision:
    """Decide whether the slider touches its guide more often in a cycle."""
    counts = [contacts_by_cycle(runs, claim[side], model)["size"] for side in ("more", "less")]
    share = above(*(of.to_numpy(np.float64) for of in counts))
    medians = " and ".join(number(float(of.median())) for of in counts)
    evidence = f"{medians} contacts in the median cycle; more in {per_cent(share)} of the pairs of cycles"
    return decide(share, 1 - MOST, MOST, evidence)


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


def later_cycles(runs: Runs, scene: str, model: str, channel: str) -> Array:
    """Return the largest error of each cycle from the second on, of the acceleration the largest force.

    A contact is shorter than the interval of the samples of a long run; its peak force, which the
    acceleration's error follows, stands in the table of contacts.
    """
    if (scene, model) not in runs.long:
        return np.empty(0)
    if channel == "slider_ay":
        return contacts_by_cycle(runs, scene, model)["max"].to_numpy(np.float64)
    return np.asarray(np.abs(runs.long_errors(scene, model, channel)).max(axis=1)[1:])


def contacts_by_cycle(runs: Runs, scene: str, model: str) -> pd.DataFrame:
    """Return number (``size``) and largest force (``max``, N) of the contacts of each later cycle."""
    run = runs.long[scene, model]
    cycles = (run.time.size - 1) // runs.config.long_samples
    none = pd.DataFrame(columns=["start", "peak_force"], dtype=np.float64)
    events = none if run.events is None else run.events
    of_cycle = (events["start"] / run.time[-1] * cycles).astype(int)
    found = events["peak_force"].astype(float).groupby(of_cycle).agg(["size", "max"])
    return found.reindex(range(1, cycles), fill_value=0)


def _second_cycle(runs: Runs, scene: str, model: str, channel: str) -> Array:
    members = range(len(runs.short[scene, model]))
    return np.array([abs(largest_error(runs, scene, model, channel, k).value) for k in members])


def _order(over: bool | np.bool_, under: bool | np.bool_) -> str:
    return SUPPORTED if over else CONTRADICTED if under else UNDECIDED


def _span(values: Sequence[float] | Array, unit: str) -> str:
    low, high = quantity(float(np.min(values)), unit), quantity(float(np.max(values)), unit)
    return low if low == high else f"{low} … {high}"
