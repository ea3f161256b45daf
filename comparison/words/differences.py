"""Sentences about a difference: its instant, its confirmation by ensembles, and what it is due to."""

from math import inf, isfinite, isnan

import pandas as pd

from comparison.formatting import NO_BREAK, percent, quantity
from comparison.tables.channels import CONTACTS, PIN
from comparison.verdict.confirmation import ENOUGH
from comparison.verdict.results import (
    SUSPICIOUS,
    Attribution,
    Confirmation,
    Doubt,
    Refinement,
    SceneComparison,
)

_CHATTER = 0.05  # of a crank cycle before an instant: about one flight between two impacts
_MANY = 5  # contacts that begin in it
_CHANGED = 0.1  # of the difference: less is reported as a percentage, more as a factor
# Of the samples outside, near which a run must still move as far. Where a stiffness of 0.1 % makes the
# difference it is 65 % at the standard tier, whose band is not much narrower.
_SUSPECT = 0.9
_MOST = 0.5  # of the samples that are not predictable
_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")
_DOUBTS = {
    Doubt.TOLERANCE: "the verdict uses a tolerance, to which ensembles do not apply",
    Doubt.RIGID: "no joint has clearance, so no start can be moved",
    Doubt.SLOW: "both models are too slow for an ensemble",
    Doubt.NO_STARTS: "no runs from moved starts beyond those of the uncertainty",
    Doubt.FEW_RUNS: f"fewer than {ENOUGH} runs from moved starts succeeded",
}
_CAUSES = {
    "a": "explained by {own_a}; {b}",
    "b": "explained by {own_b}; {a}",
    "round-off": "at round-off: no setting has an effect",
    "both": "both contribute: {a}, {b}, {both}",
    "neither": "within the uncertainty, but not resolved by refinement: {a}, {b}, {both}",
    "models": "difference of models: no refinement removes it ({a}, {b})",
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
    """Return what the difference of a scene is due to, most important first; empty if nothing is known."""
    result, known = scene.attribution, not isnan(scene.attribution.explained)
    lines = [f"{plain_percent(result.explained)} of the judged samples explained"] if known else []
    lines += [_cause(result)] if result.cause else []
    if result.outside_in:
        what, where = "band" if scene.known else "tolerance", instant_of(result.outside_from, scene)
        lines.append(f"first outside the {what}: {result.outside_in} at {where}")
    lines += [
        f"but near {result.still_moves[key]:.0%} of the samples outside {label} still changes under "
        "refinement by as much as the difference: its uncertainty may be underestimated"
        for key, label in zip("ab", scene.labels, strict=True)
        if result.still_moves.get(key, 0.0) >= _SUSPECT
    ]
    return [*lines, _unpredictable(result, scene.labels)] if known and result.unpredictable else lines


def _cause(result: Attribution) -> str:
    left, (a, b) = result.remaining, result.refinements
    words = {"both": f"both together {_effect(left['both'], min(a.gain, b.gain))}"}
    if left["both"] > 1 + _CHANGED:
        words["both"] += "; it grows, as accumulated round-off does with more steps"
    for key, change in zip("ab", result.refinements, strict=True):
        removed = _effect(left[key], change.gain, "the difference")
        words[f"own_{key}"] = f"{_setting(change)}: {_refining(change, 'it')} {removed}"
        words[key] = f"{_refining(change, _setting(change))} {_effect(left[key], change.gain)}"
    return _CAUSES[result.cause].format(**words)


def _refining(change: Refinement, setting: str) -> str:
    return f"halving {setting}" if change.factor == 2 else f"dividing {setting} by {change.factor:g}"


def _setting(change: Refinement) -> str:
    """Return "exudyn's step (2e-06 s; with its tolerance, 1e-7)"."""
    if not change.settings:
        return f"{change.label}'s setting"
    (chief, value), *others = change.settings.items()
    along = "".join(f"; with its {key}, {other:g}" for key, other in others)
    return f"{change.label}'s {chief} ({value:g}{' s' if chief == 'step' else ''}{along})"


def _effect(remaining: float, gain: float, what: str = "it") -> str:
    if remaining <= 1 - _CHANGED:
        return f"divides {what} by {1 / remaining if remaining else inf:.2g} ({gain:.3g} expected)"
    if abs(remaining - 1) < 5e-4:
        return f"changes {what} by less than 0.1%"
    return f"changes {what} by {remaining - 1:+.1%}"


def _unpredictable(result: Attribution, labels: tuple[str, str]) -> str:
    """State whose uncertainty makes samples of the indeterminate channels unpredictable, and the remedy."""
    whose = {key: words.format(*labels) for key, words in _UNPREDICTABLE.items()}
    shares = sorted(((result.unpredictable[key], words) for key, words in whose.items()), reverse=True)
    (chief, words), *others = [item for item in shares if item[0] >= 0.005]
    rest = f" ({', '.join(f'{words} {share:.0%}' for share, words in others)})" if others else ""
    text = (
        f"of the samples that are not predictable in the indeterminate channels, {words} makes "
        f"{chief:.0%} so, from {result.unpredictable_from:.4g} s on{rest}"
    )
    neighbours = result.unpredictable["neighbours"]
    if neighbours >= _MOST:
        what = "the spread of neighbouring starts suffices, whatever the setting"
        return f"{text}; for {neighbours:.0%} of them {what}"
    # The tight tier has its own settings, independent of --accuracy.
    return f"{text}; try --accuracy strict" if result.strict_helps else text


def plain_percent(share: float) -> str:
    """Return a share as percent in plain characters, truncated: "100.00%" only for all."""
    text = percent(share).replace(NO_BREAK, "")
    return "100.00%" if text == "100%" else text
