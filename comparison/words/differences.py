"""Sentences about a difference: its instant, its confirmation by ensembles, and what it is due to."""

from math import isfinite, isnan

import pandas as pd

from comparison.formatting import NO_BREAK, percent
from comparison.tables.channels import CONTACTS, PIN
from comparison.verdict.confirmation import ENOUGH
from comparison.verdict.results import (
    SUSPICIOUS,
    Attribution,
    Confirmation,
    Doubt,
    SceneComparison,
)

# Of the samples outside, near which a run must still move as far. Where a stiffness of 0.1 % makes the
# difference it is 65 % at the standard tier, whose band is not much narrower.
_SUSPECT = 0.9
_MOST = 0.5  # of the samples that are not predictable
_DOUBTS = {
    Doubt.TOLERANCE: "the verdict uses a tolerance, to which ensembles do not apply",
    Doubt.RIGID: "no joint has clearance, so no start can be moved",
    Doubt.SLOW: "both models are too slow for an ensemble",
    Doubt.NO_STARTS: "no runs from moved starts beyond those of the uncertainty",
    Doubt.FEW_RUNS: f"fewer than {ENOUGH} runs from moved starts succeeded",
}
_CAUSES = {
    "a": "explained by the settings of {0}",
    "b": "explained by the settings of {1}",
    "round-off": "at round-off: no setting has an effect",
    "both": "explained by the settings of both models together",
    "neither": "within the uncertainty, but not resolved by refinement",
    "models": "difference of models: no refinement removes it",
}
_UNPREDICTABLE = {
    "a": "the uncertainty of {0} alone",
    "b": "the uncertainty of {1} alone",
    "each": "the uncertainty of each model by itself",
    "together": "only both uncertainties together",
}


def instant_of(time: float, scene: SceneComparison) -> str:
    """Return "0.0142 s (cycle 1, crank at 13°), during contact of the upper left corner"."""
    where = f"{time:.4g} s" if abs(time) < 1e4 else f"{time:.15g} s"  # counted from an epoch
    if scene.scene is not None and scene.period is not None:
        cycles, start = time / scene.period, scene.scene["mechanism"]["crank_angle_deg"]
        sense = -1.0 if scene.scene["drive"]["speed_rpm"] < 0 else 1.0
        where += f" (cycle {int(cycles) + 1}, crank at {(start + sense * 360 * cycles) % 360:.0f}°)"
    recorded = zip(scene.labels, scene.events, strict=True)
    contacts = {label: contact(time, events) for label, events in recorded if events is not None}
    if len(set(contacts.values())) <= 1:
        return ", ".join([where, *list(contacts.values())[:1]])
    return f"{where}, " + ", ".join(f"{words} ({label})" for label, words in contacts.items())


def contact(time: float, events: pd.DataFrame) -> str:
    """Return which places are in contact at an instant (s), or which were last before it."""
    begun = events[events["start"] <= time]
    if begun.empty:
        return "before the first contact"
    current, word = begun[begun["end"] >= time], "during"
    if current.empty:
        current, word = begun[begun["end"] == begun["end"].max()], "after"
    places = [_place(place) for place in CONTACTS if place in set(current["corner"])]
    return f"{word} contact of the {' and the '.join(places)}"


def _place(place: str) -> str:
    return CONTACTS.get(place, place) + ("" if place == PIN else " corner")


def confirmation(scene: SceneComparison) -> str:
    """Return what ensembles of runs say of a verdict "differ"; empty where none was."""
    result, labels = scene.confirmation, scene.labels
    if result is None:
        return ""
    since = "" if isnan(result.since) else f" from {result.since:.4g} s on"
    if result.doubt is not None:
        return f"differ (unconfirmed, {result.fewest} runs){since}: {_DOUBTS[result.doubt]}"
    if result.outcome == "underestimated":
        counts = zip(result.farther, result.members, labels, labels[::-1], strict=True)
        inside = " and ".join(
            f"{count} of {members} {host} runs from moved starts are as far out as the {guest} run"
            for count, members, host, guest in counts
            if count
        )
        factor = f"the uncertainty was underestimated by a factor {result.factor:.2g}"
        text = f"no difference of models, {factor}{since}: {inside}"
        if result.suspicious:
            text += "; they split into clusters" if result.clustered else f"; a factor above {SUSPICIOUS:g}"
            text += ", which indicates a discontinuous event, possibly an intermittent fault: "
            text += parting(result) or "no single contact"
        return text
    outside = "each model's run is outside those of the other"
    if 0 in result.members:
        host, guest = labels if result.members[0] else labels[::-1]
        outside = f"the {guest} run is outside those of {host}"
    counted = zip(result.members, labels, strict=True)
    runs = " and ".join(f"{count} {label}" for count, label in counted if count)
    text = f"difference confirmed{since} by {runs} runs from moved starts: {outside}"
    if isfinite(result.excess):  # not where all members are one
        text += f", {result.excess:.3g} times as far as the farthest of these"
    return text if result.parting is None else f"{text}; they are first separated by {parting(result)}"


def parting(result: Confirmation) -> str:
    """Return "the contact of the upper left corner at 0.2454 s, which occurs in 3 of 99 reference runs"."""
    if result.parting is None:
        return ""
    having, sizes = result.parting.having, result.parting.sizes
    counts = list(zip(having, sizes, result.parted, strict=True))
    if result.parted[0] == result.parted[1]:  # two parts of one ensemble
        counts = [(sum(having), sum(sizes), result.parted[0])]
    occurs = " and ".join(f"{count} of {size} {label} runs" for count, size, label in counts)
    place, start = _place(result.parting.corner), result.parting.start
    return f"the contact of the {place} at {start:.6g} s, which occurs in {occurs}"


def attribution_lines(scene: SceneComparison) -> list[str]:
    """Return the cause of the difference of a scene, its first instant and its caveats, where known."""
    result, lines = scene.attribution, []
    if result.cause:
        left = zip((*scene.labels, "both"), result.remaining.values(), strict=False)
        shares = ", ".join(f"{name} {share:.1%}" for name, share in left)
        lines.append(_CAUSES[result.cause].format(*scene.labels))
        lines[0] += f" (of it refinement leaves: {shares})" if result.cause != "round-off" else ""
    if result.outside_in:
        what, where = "band" if scene.known else "tolerance", instant_of(result.outside_from, scene)
        lines.append(f"first outside the {what}: {result.outside_in} at {where}")
    lines += [
        f"refinement moves {label} as far as this difference near {result.still_moves[key]:.0%} of the "
        "samples outside: its uncertainty may be underestimated"
        for key, label in zip("ab", scene.labels, strict=True)
        if result.still_moves.get(key, 0.0) >= _SUSPECT
    ]
    if not isnan(result.explained) and result.unpredictable:
        lines.append(_unpredictable(result, scene.labels))
    return lines


def _unpredictable(result: Attribution, labels: tuple[str, str]) -> str:
    """Return whose uncertainty makes samples of the indeterminate channels unpredictable, and the remedy."""
    whose = {key: words.format(*labels) for key, words in _UNPREDICTABLE.items()}
    shares = sorted(((result.unpredictable[key], words) for key, words in whose.items()), reverse=True)
    listed = ", ".join(f"{words} ({share:.0%})" for share, words in shares if share >= 0.005)
    text = (
        f"not predictable in the indeterminate channels, from {result.unpredictable_from:.4g} s on: {listed}"
    )
    if (neighbours := result.unpredictable["neighbours"]) >= _MOST:
        return f"{text}; neighbouring starts part too far in {neighbours:.0%}, whatever the setting"
    # The tight tier has its own settings, independent of --accuracy.
    return f"{text}; try --accuracy strict" if result.strict_helps else text


def plain_percent(share: float) -> str:
    """Return a share as percent in plain characters, truncated: "100.00%" only for all."""
    text = percent(share).replace(NO_BREAK, "")
    return "100.00%" if text == "100%" else text
