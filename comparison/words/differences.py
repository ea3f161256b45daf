"""Sentences about a difference: its instant, its confirmation by ensembles, and what it is due to."""

from math import isfinite, isnan, nan

import pandas as pd

from comparison.formatting import NO_BREAK, percent, quantity
from comparison.tables.channels import CONTACTS, PIN
from comparison.verdict.confirmation import ENOUGH
from comparison.verdict.results import (
    SUSPICIOUS,
    Doubt,
    Refinement,
    SceneComparison,
)

_CHATTER = 0.05  # of a crank cycle before an instant: about one flight between two impacts
_MANY = 5  # contacts that begin in it
_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")
_DOUBTS = {
    Doubt.TOLERANCE: "the verdict uses a tolerance, to which ensembles do not apply",
    Doubt.RIGID: "no joint has clearance, so no start can be moved",
    Doubt.SLOW: "both models are too slow for an ensemble",
    Doubt.NO_STARTS: "no runs from moved starts beyond those of the uncertainty",
    Doubt.FEW_RUNS: f"fewer than {ENOUGH} runs from moved starts succeeded",
}
_UNPREDICTABLE = {
    "a": "the uncertainty of {0} alone",
    "b": "the uncertainty of {1} alone",
    "each": "the uncertainty of each model by itself",
    "together": "only both uncertainties together",
}


def instant_of(time: float, scene: SceneComparison) -> str:
    """Return "0.0142 s (cycle 1, crank at 13°), during the first contact of the upper left corner"."""
    where = f"{time:.4g} s" if abs(time) < 1e4 else f"{time:.15g} s"  # counted from an epoch
    if scene.scene is not None and scene.period is not None:
        cycles, start = time / scene.period, scene.scene["mechanism"]["crank_angle_deg"]
        sense = -1.0 if scene.scene["drive"]["speed_rpm"] < 0 else 1.0
        where += f" (cycle {int(cycles) + 1}, crank at {(start + sense * 360 * cycles) % 360:.0f}°)"
    recorded = zip(scene.labels, scene.events, strict=True)
    contacts = {label: contact(time, events) for label, events in recorded if events is not None}
    if len(set(contacts.values())) <= 1:
        where = ", ".join([where, *list(contacts.values())[:1]])
    else:
        where += ", " + ", ".join(f"{words} ({label})" for label, words in contacts.items())
    events = next((events for events in scene.events if events is not None), None)
    if events is None or scene.period is None:
        return where
    before = _CHATTER * scene.period
    count = int(((events["start"] > time - before) & (events["start"] <= time)).sum())
    span = quantity(before, "s", 2).replace(NO_BREAK, " ")
    return f"{where}, just after chatter ({count} contacts in the {span} before)" if count >= _MANY else where


def contact(time: float, events: pd.DataFrame) -> str:
    """Describe the contacts at an instant (s), or the last ones before it, numbered by corner.

    Two corners of one side often touch at one instant: of the last contacts, all that overlap the one that
    ended last are listed.
    """
    numbered = events.sort_values("start", kind="stable")
    numbered = numbered.assign(count=numbered.groupby("corner").cumcount() + 1)
    begun = numbered[numbered["start"] <= time]
    if begun.empty:
        return "before the first contact"
    current, word = begun[begun["end"] >= time], "during"
    if current.empty:
        last = begun["end"].to_numpy().argmax()
        current, word = begun[begun["end"] >= begun["start"].to_numpy()[last]], "after"
    order = list(CONTACTS)
    named = sorted(zip(current["corner"], current["count"], strict=True), key=lambda row: order.index(row[0]))
    places = (f"the {_ordinal(count)} contact of the {_place(place)}" for place, count in named)
    return f"{word} {' and '.join(places)}"


def _place(place: str) -> str:
    return CONTACTS.get(place, place) + ("" if place == PIN else " corner")


def _ordinal(count: int) -> str:
    if count <= len(_ORDINALS):
        return _ORDINALS[count - 1]
    teens = count % 100 in (11, 12, 13)
    return f"{count}{'th' if teens else {1: 'st', 2: 'nd', 3: 'rd'}.get(count % 10, 'th')}"


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
            what = "a discontinuous event, possibly an intermittent fault"
            text += f"; a factor above {SUSPICIOUS:g} indicates {what}"
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
    return text if result.parting is None else f"{text}; they are first separated by {parting(scene)}"


def parting(scene: SceneComparison) -> str:
    """Return "the contact of the upper left corner at 0.2454 s, which occurs in 3 of 99 reference runs"."""
    if scene.confirmation is None or (contact := scene.confirmation.parting) is None:
        return ""
    counts = zip(contact.having, contact.sizes, scene.labels, strict=True)
    occurs = " and ".join(f"{count} of {size} {label} runs" for count, size, label in counts)
    return f"the contact of the {_place(contact.corner)} at {contact.start:.6g} s, which occurs in {occurs}"


def attribution_lines(scene: SceneComparison) -> list[str]:
    """Return the numbers of what the difference of a scene is due to; empty if none is known."""
    result, known = scene.attribution, not isnan(scene.attribution.explained)
    lines = [f"{plain_percent(result.explained)} of the judged samples explained"] if known else []
    if not isnan(result.remaining.get("both", nan)):
        shares = [_share(result.remaining[key]) for key in ("a", "b", "both")]
        refined = [*map(_refined, result.refinements), "both"]
        left = [f"{share} with {what}" for share, what in zip(shares, refined, strict=True)]
        lines.append(f"left of the difference: {', '.join(left)}")
    if result.outside_in:
        what, where = "band" if scene.known else "tolerance", instant_of(result.outside_from, scene)
        lines.append(f"first outside the {what}: {result.outside_in} at {where}")
    if result.unpredictable:
        whose = (
            f"{words.format(*scene.labels)} {result.unpredictable[key]:.0%}"
            for key, words in _UNPREDICTABLE.items()
            if result.unpredictable[key] >= 0.005
        )
        lines.append(f"not predictable in the indeterminate channels by {', '.join(whose)}")
    return lines


def _refined(change: Refinement) -> str:
    """Return "exudyn's step / 2 (2e-06 s; with its tolerance, 1e-07; 25% if all were its error)"."""
    (chief, value), *others = change.settings.items() or [("setting", nan)]
    now = [] if isnan(value) else [f"{value:g}{' s' if chief == 'step' else ''}"]
    now += [f"with its {key}, {other:g}" for key, other in others]
    now.append(f"{1 / change.gain:.3g} of its own error")
    return f"{change.label}'s {chief} / {change.factor:g} ({'; '.join(now)})"


def _share(remaining: float) -> str:
    return f"{remaining:.1%}" if remaining < 10.0 else f"{remaining:.2g} times"


def plain_percent(share: float) -> str:
    """Return a share as percent in plain characters, truncated: "100.00%" only for all."""
    text = percent(share).replace(NO_BREAK, "")
    return "100.00%" if text == "100%" else text
