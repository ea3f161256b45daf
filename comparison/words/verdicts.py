"""Sentences about verdicts: why a scene agrees or differs, what was confirmed, what to do next."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, isnan
from typing import Any

import pandas as pd

from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.uncertainty import (
    ENSEMBLE_FACTOR,
    PERTURBATION,
    SAFETY_FACTOR,
    SAFETY_FACTOR_IN_ORDER,
    WINDOW,
)
from comparison.formatting import NO_BREAK, instant, number, percent, quantity
from comparison.reliability.words import line as reliability_line
from comparison.scene import Scene, command_line
from comparison.tables.channels import CONTACTS, PIN
from comparison.tables.times import Shift
from comparison.verdict.confirmation import ENOUGH, MEMBERS, OTHER_MEMBERS
from comparison.verdict.results import (
    SUSPICIOUS,
    Attribution,
    Basis,
    ChannelComparison,
    Confirmation,
    Doubt,
    Refinement,
    SceneComparison,
    decisive,
    rank,
)
from comparison.verdict.several import Pair, Standing
from comparison.verdict.shipped import Departure

SYMBOLS = {
    "agree": "✓",
    "differ": "✗",
    "indeterminate": "?",
    "undecided": "?",
    "unexcited": "○",
    "cannot compare": "!",
}
"""Signs beside the words of a verdict, so that colour is not needed to tell it."""

_TIMES = ("", "once", "twice", "three times", "four times")
_CHANGED = 0.1  # of the difference: less is reported as a percentage, more as a factor
# Of the samples outside, near which a run must still move as far. Where a stiffness of 0.1 % makes the
# difference it is 65 % at the standard tier, whose band is not much narrower.
_SUSPECT = 0.9
_MOST = 0.5  # of the samples that are not predictable
_CHATTER = 0.05  # of a crank cycle before an instant: about one flight between two impacts
_MANY = 5  # contacts that begin in it


# One channel


def reason(channel: ChannelComparison) -> str:
    """Return why the verdict of a channel is what it is."""
    limits, basis = channel.limits, channel.basis
    if basis is Basis.RANGE:
        floor = _value(channel.definition.floor, channel.unit)
        return f"its range in both, {_value(channel.extent, channel.unit, 2)}, is below {floor}"
    if basis is Basis.NO_LIMIT:
        return "there is neither an uncertainty nor a tolerance"
    if basis is Basis.COVERAGE:
        return (
            f"{channel.coverage:.1%} of the samples are predictable, required: at least {limits.coverage:.0%}"
        )
    if basis is Basis.NOTHING_JUDGED:
        return "no predictable sample is non-zero"
    if basis is Basis.LARGEST:
        return (
            f"at t = {_worst_instant(channel)} s the difference is "
            f"{_value(channel.worst_difference, channel.unit)}, {limits.k:g} times the largest uncertainty "
            f"of all times {_value(channel.worst_threshold, channel.unit, 2)}"
        )
    count = int(channel.judged.sum())
    if basis is Basis.FEW_JUDGED:
        return f"{count} predictable samples are non-zero, required: at least {limits.least_judged}"
    if basis is Basis.FEW_OUTSIDE:
        return (
            f"{channel.outside} of {count} predictable samples are outside their threshold: too many to "
            f"agree, fewer than the {limits.least_outside} that show a difference"
        )
    fixed = channel.u is None
    text = (
        f"{channel.outside} of {count} {'samples' if fixed else 'predictable samples'} are outside "
        f"{'the tolerance' if fixed else 'their threshold'}"
        f"{', at worst' if channel.outside else ', the nearest'} at t = {_worst_instant(channel)} s: the "
        f"difference is {_value(channel.worst_difference, channel.unit)}, the threshold "
        f"{_value(channel.worst_threshold, channel.unit, 2)}"
    )
    if fixed and channel.worst_threshold == 0.0:
        text += "; the channel is constant in the first table, so its scale is zero unless one is given"
    if channel.verdict == "differ" and limits.share < 1.0:
        text += f"; {channel.explained:.1%} are within, required: at least {100 * limits.share:g}%"
    if channel.verdict == "differ" and channel.coverage < limits.coverage:
        text += f"; that is decided although only {channel.coverage:.1%} of the samples are predictable"
    return text


def threshold_name(channel: ChannelComparison) -> str:
    """Return the name of the threshold of |difference|: "2 u", or "tolerance"; empty without one."""
    if channel.u is not None:
        return f"{channel.limits.k:g} u"
    return "" if channel.tolerance is None else "tolerance"


def _worst_instant(channel: ChannelComparison) -> str:
    assert channel.worst is not None
    return instant(channel.worst_time, *channel.time[max(0, channel.worst - 1) : channel.worst + 2])


def _value(value: float, unit: str, digits: int = 3) -> str:
    """Return value and unit; of a channel of another mechanism the unit may be unknown."""
    return f"{value:.{digits}g} {unit}".rstrip()


# A scene


def scene_reason(scene: SceneComparison) -> str:
    """Return why the verdict of a scene is what it is."""
    if scene.error:
        return scene.error
    if not isnan(scene.allowed_shift) and scene.shift is not None:
        return f"{shift(scene.shift, scene.labels)} The tolerance allows {scene.allowed_shift:.2g} s"
    if scene.unsettled:
        return (
            "the models differ, but refinement still moves five bodies by as much at a step of "
            f"{_step(scene):g} s: what they converge to is unknown. {_channels_differ(scene)}"
        )
    excited = [channel for channel in scene.channels.values() if channel.verdict != "unexcited"]
    if not excited:
        return "no channel is excited: nothing was compared"
    if scene.verdict == "differ":
        return _channels_differ(scene)
    unsettled = [channel for channel in excited if channel.verdict == "indeterminate"]
    if scene.verdict == "indeterminate":
        worst = min(unsettled, key=lambda channel: channel.coverage)
        reasons = {reason(channel) for channel in unsettled}
        which = "" if len(reasons) == 1 else f", most of all {worst.channel}"
        return f"{len(unsettled)} of {len(excited)} channels are indeterminate{which}: {reason(worst)}"
    agreeing = [channel for channel in excited if channel.verdict == "agree"]
    text = (
        f"{len(agreeing)} of {len(excited)} excited channels agree, nearest to its limit {_named(agreeing)}"
    )
    known = any(channel.u is not None for channel in excited)
    text += f"; {_percent(scene.coverage)} of all samples are predictable" if known else ""
    if unsettled:
        text += f"; indeterminate: {', '.join(f'{c.channel} ({reason(c)})' for c in unsettled)}"
    return text


def _channels_differ(scene: SceneComparison) -> str:
    excited = [channel for channel in scene.channels.values() if channel.verdict != "unexcited"]
    differing = [channel for channel in excited if channel.verdict == "differ"]
    return f"{len(differing)} of {len(excited)} channels differ, most of all {_named(differing)}"


def _named(channels: Sequence[ChannelComparison]) -> str:
    """Return which of the judged channels is the worst, and why."""
    worst = decisive(channels)
    assert worst is not None
    return f"{worst.channel}, {worst.ratio_name} = {number(worst.ratio, 2)}: {reason(worst)}"


def finer_runs(scene: SceneComparison) -> str:
    """Return the settings of refined runs; empty where the models ran at the scene's own."""
    if not scene.refined or scene.scene is None:
        return ""
    return (
        "judged with finer runs, since those at the scene's settings left the verdict open: step of "
        f"five bodies halved {_TIMES[scene.refined]}, to {_step(scene):.3g} s"
    )


def why(scene: SceneComparison) -> str:
    """Return the reason of the verdict, preceded by what its runs and its confirmation need explained."""
    return ". ".join(filter(None, (confirmation(scene), finer_runs(scene), scene_reason(scene))))


def mark(scene: SceneComparison) -> str:
    """Return what stands beside the verdict: that its runs are finer, and its confirmation."""
    marks = [f"step halved {_TIMES[scene.refined]}"] if scene.refined else []
    if (result := scene.confirmation) is not None:
        marks.append(
            {
                "confirmed": f"confirmed by at least {result.fewest} runs",
                "unconfirmed": f"unconfirmed, {result.fewest} runs",
                "underestimated": f"uncertainty underestimated {result.factor:.2g} times",
            }[result.outcome]
        )
    return "; ".join(marks)


def shift(estimate: Shift, labels: tuple[str, str]) -> str:
    """Return the estimated time shift between two results as a sentence."""
    if estimate.reason:
        return f"A time shift between the two cannot be estimated: {estimate.reason}."
    size = f"{abs(estimate.value):.3g} s ± {estimate.uncertainty:.2g} s"
    if not estimate.seen:
        return f"No significant time shift: {size}."
    late, early = labels[::-1] if estimate.value > 0 else labels
    return f"{late} is later than {early} by {size} (estimated, not applied)."


def shift_line(scene: SceneComparison) -> str:
    """Return the estimated time shift between the two results, if any, as a sentence."""
    return "" if scene.shift is None else shift(scene.shift, scene.labels)


def reasons(scene: SceneComparison) -> list[tuple[str, str]]:
    """Return why a verdict at one tier is what it is: what each sentence is about, and the sentence.

    The reason, finer runs, the confirmation of a difference, the attribution, the reliability of the motion.
    """
    lines = [
        ("reason", scene_reason(scene)),
        ("runs", finer_runs(scene)),
        ("confirmation", confirmation(scene)),
        ("why", "; ".join(attribution_lines(scene))),
        ("reliability", "" if scene.reliability is None else reliability_line(scene.reliability)),
    ]
    return [(topic, text) for topic, text in lines if text]


def _step(scene: SceneComparison) -> float:
    assert scene.scene is not None
    return float(scene.scene["solver"]["exudyn"]["step"])


def _percent(share: float) -> str:
    """Return a share as percent in plain characters, truncated: "100.00%" only for all."""
    return "100.00%" if share == 1.0 else percent(share).replace(NO_BREAK, "")


# An instant


def describe(
    time: float,
    events: Mapping[str, pd.DataFrame | None],
    *,
    period: float | None,
    scene: Mapping[str, Any] | None,
) -> str:
    """Return "0.0142 s (cycle 1, crank at 13°), during the first contact of the upper left corner".

    Parameters
    ----------
    time
        Since the start, s.
    events
        Label of a model -> its event table. Where the models are in different contacts, both are named.
    period
        Of a crank cycle, s; None: cycle and angle are not reported.
    scene
        The scene mapping, for the crank's angle at the start and its sense of rotation; without it from zero.
    """
    where = f"{time:.4g} s" if abs(time) < 1e4 else f"{time:.15g} s"  # counted from an epoch
    if period is not None:
        cycles = time / period
        start = 0.0 if scene is None else float(scene["mechanism"]["crank_angle_deg"])
        sense = -1.0 if scene is not None and scene["drive"]["speed_rpm"] < 0 else 1.0
        where += f" (cycle {int(cycles) + 1}, crank at {(start + sense * 360 * cycles) % 360:.0f}°)"
    contacts = {label: contact(time, table) for label, table in events.items() if table is not None}
    if len(set(contacts.values())) <= 1:
        return ", ".join([where, *list(contacts.values())[:1]])
    return f"{where}, " + ", ".join(f"{words} ({label})" for label, words in contacts.items())


def contact(time: float, events: pd.DataFrame) -> str:
    """Describe the contacts at an instant, or the last ones before it, numbered by corner.

    Two corners of one side often touch at one instant: of the last contacts, all that overlap the one that
    ended last are listed.

    Parameters
    ----------
    time
        Of the instant, s.
    events
        One row per contact: ``corner``, ``start`` and ``end`` in s.
    """
    numbered = events.sort_values("start", kind="stable")
    numbered = numbered.assign(count=numbered.groupby("corner").cumcount() + 1)
    begun = numbered[numbered["start"] <= time]
    if begun.empty:
        return "before the first contact"
    current = begun[begun["end"] >= time]
    word = "after" if current.empty else "during"
    if current.empty:
        last = begun["end"].to_numpy().argmax()
        current = begun[begun["end"] >= begun["start"].to_numpy()[last]]
    order = list(CONTACTS)
    named = sorted(zip(current["corner"], current["count"], strict=True), key=lambda row: order.index(row[0]))
    return f"{word} " + " and ".join(
        f"the {_ordinal(count)} contact of the {_place(place)}" for place, count in named
    )


def _place(place: str) -> str:
    return CONTACTS.get(place, place) + ("" if place == PIN else " corner")


def _ordinal(count: int) -> str:
    words = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")
    if count <= len(words):
        return words[count - 1]
    ending = {1: "st", 2: "nd", 3: "rd"}.get(count % 10, "th") if count % 100 not in {11, 12, 13} else "th"
    return f"{count}{ending}"


def _of_scene(time: float, scene: SceneComparison) -> str:
    events = dict(zip(scene.labels, scene.events, strict=True))
    return describe(time, events, period=scene.period if scene.scene else None, scene=scene.scene)


# Confirmation


def confirmation(scene: SceneComparison) -> str:
    """Return what ensembles of runs say of a verdict "differ"; empty where none was."""
    result, labels = scene.confirmation, scene.labels
    if result is None:
        return ""
    since = "" if isnan(result.since) else f" from {result.since:.4g} s on"
    if result.outcome == "unconfirmed":
        return f"differ (unconfirmed, {result.fewest} runs){since}: {_doubt(result)}"
    if result.outcome == "confirmed":
        return _confirmed(result, labels, since)
    return _underestimated(result, labels, since)


def _doubt(result: Confirmation) -> str:
    return {
        Doubt.TOLERANCE: "the verdict uses a tolerance, to which ensembles do not apply",
        Doubt.RIGID: "no joint has clearance, so no start can be moved",
        Doubt.SLOW: "both models are too slow for an ensemble",
        Doubt.NO_STARTS: "no runs from moved starts beyond those of the uncertainty",
        Doubt.FEW_RUNS: f"fewer than {ENOUGH} runs from moved starts succeeded",
        None: "",
    }[result.doubt]


def _confirmed(result: Confirmation, labels: tuple[str, str], since: str) -> str:
    outside = "each model's run is outside those of the other"
    if 0 in result.members:
        host, guest = labels if result.members[0] else labels[::-1]
        outside = f"the {guest} run is outside those of {host}"
    runs = " and ".join(
        f"{count} {label}" for count, label in zip(result.members, labels, strict=True) if count
    )
    text = f"difference confirmed{since} by {runs} runs from moved starts: {outside}"
    if isfinite(result.excess):  # not where all members are one
        text += f", {result.excess:.3g} times as far as the farthest of these"
    return text if result.parting is None else f"{text}; they are first separated by {parting(result)}"


def _underestimated(result: Confirmation, labels: tuple[str, str], since: str) -> str:
    inside = " and ".join(
        f"{count} of {members} {host} runs from moved starts are as far out as the {guest} run"
        for count, members, host, guest in zip(
            result.farther, result.members, labels, labels[::-1], strict=True
        )
        if count
    )
    text = (
        "no difference of models, the uncertainty was underestimated by a factor "
        f"{result.factor:.2g}{since}: {inside}"
    )
    if not result.suspicious:
        return text
    sign = "they split into clusters" if result.clustered else f"a factor above {SUSPICIOUS:g}"
    return (
        f"{text}; {sign}, which indicates a discontinuous event, possibly an intermittent fault: "
        f"{parting(result) or 'no single contact'}"
    )


def parting(result: Confirmation) -> str:
    """Return "the contact of the upper left corner at 0.2454 s, which occurs in 3 of 99 reference runs"."""
    if result.parting is None:
        return ""
    having, sizes = result.parting.having, result.parting.sizes
    counts = list(zip(having, sizes, result.parted, strict=True))
    if result.parted[0] == result.parted[1]:  # two parts of one ensemble
        counts = [(sum(having), sum(sizes), result.parted[0])]
    occurs = " and ".join(f"{count} of {size} {label} runs" for count, size, label in counts)
    start = result.parting.start
    return f"the contact of the {_place(result.parting.corner)} at {start:.6g} s, which occurs in {occurs}"


# Attribution


def attribution_lines(scene: SceneComparison) -> list[str]:
    """Return what the difference of a scene is due to, most important first; empty if nothing is known."""
    result = scene.attribution
    outside = f"{result.outside_in} at {_of_scene(result.outside_from, scene)}" if result.outside_in else ""
    if isnan(result.explained):
        known = any(channel.u is not None for channel in scene.channels.values())
        return [f"first outside the {'band' if known else 'tolerance'}: {outside}"] if outside else []
    lines = [f"{_percent(result.explained)} of the judged samples explained"]
    if result.cause:
        lines.append(_cause(result))
    if outside:
        lines.append(f"first outside the band: {outside}")
    lines += [
        f"but near {result.still_moves[key]:.0%} of the samples outside {label} still changes under "
        "refinement by as much as the difference: its uncertainty may be underestimated"
        for key, label in zip("ab", scene.labels, strict=True)
        if result.still_moves.get(key, 0.0) >= _SUSPECT
    ]
    if result.unpredictable:
        lines.append(_unpredictable(result, scene.labels) + _advice(result))
    return lines


def _cause(result: Attribution) -> str:
    left = result.remaining
    first, second = (
        f"{_refining(change, _setting(change))} {_effect(left[key], change.gain)}"
        for key, change in zip("ab", result.refinements, strict=True)
    )
    both = f"both together {_effect(left['both'], min(change.gain for change in result.refinements))}"
    if left["both"] > 1 + _CHANGED:
        both += "; it grows, as accumulated round-off does with more steps"
    if result.cause in {"a", "b"}:
        side = "ab".index(result.cause)
        chief, other = result.refinements[side], (second, first)[side]
        effect = _effect(left[result.cause], chief.gain, "the difference")
        return f"explained by {_setting(chief)}: {_refining(chief, 'it')} {effect}; {other}"
    return {
        "round-off": "at round-off: no setting has an effect",
        "both": f"both contribute: {first}, {second}, {both}",
        "neither": f"within the uncertainty, but not resolved by refinement: {first}, {second}, {both}",
        "models": f"difference of models: no refinement removes it ({first}, {second})",
    }[result.cause]


def _refining(change: Refinement, setting: str) -> str:
    """Return "halving exudyn's step (2e-06 s)"."""
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
        return f"divides {what} by {1 / remaining if remaining else float('inf'):.2g} ({gain:.3g} expected)"
    if abs(remaining - 1) < 5e-4:
        return f"changes {what} by less than 0.1%"
    return f"changes {what} by {remaining - 1:+.1%}"


def _unpredictable(result: Attribution, labels: tuple[str, str]) -> str:
    """State whose uncertainty makes samples of the indeterminate channels unpredictable."""
    whose = {
        "a": f"the uncertainty of {labels[0]} alone",
        "b": f"the uncertainty of {labels[1]} alone",
        "each": "the uncertainty of each model by itself",
        "together": "only both uncertainties together",
    }
    shares = sorted(((result.unpredictable[key], words) for key, words in whose.items()), reverse=True)
    (chief, words), *others = [item for item in shares if item[0] >= 0.005]
    rest = f" ({', '.join(f'{words} {share:.0%}' for share, words in others)})" if others else ""
    return (
        f"of the samples that are not predictable in the indeterminate channels, {words} makes "
        f"{chief:.0%} so, from {result.unpredictable_from:.4g} s on{rest}"
    )


def _advice(result: Attribution) -> str:
    """State whether finer settings can help: not where neighbouring trajectories diverge too far."""
    neighbours = result.unpredictable["neighbours"]
    if neighbours >= _MOST:
        return (
            f"; for {neighbours:.0%} of them the spread of neighbouring starts suffices, whatever the setting"
        )
    # The tight tier has its own settings, independent of --accuracy.
    return "; try --accuracy strict" if result.strict_helps else ""


# The verdict card of a scene


@dataclass(frozen=True)
class Card:
    """Texts of a card: one plain sentence, the observed orders, what to do next."""

    sentence: str
    order: str
    advice: str
    commands: tuple[str, ...]


def card(scene: SceneComparison) -> Card:
    """Return the card of a scene at one tier."""
    advice, commands = _next(scene)
    order = ", ".join(
        f"{change.label} {number(change.observed, 2)} (expected {change.order:g})"
        for change in scene.attribution.refinements
        if not isnan(change.observed)
    )
    return Card(_sentence(scene), order, advice, tuple(filter(None, commands)))


def _sentence(scene: SceneComparison) -> str:
    if scene.verdict == "indeterminate":
        return f"Not decided: {_undecided(scene)}."
    channel = scene.decisive
    if channel is None:
        return f"{scene_reason(scene)}."
    size, limit = (
        quantity(value, channel.unit, 2) for value in (abs(channel.worst_difference), channel.worst_threshold)
    )
    most = "" if channel.limits.share == 1.0 else f", the maximum {number(channel.largest_ratio, 2)}"
    text = (
        f"{channel.label}: {channel.ratio_name} is {number(channel.ratio, 2)}{most}: {size} against {limit}"
    )
    if scene.verdict == "differ":
        since = scene.attribution.outside_from
        since = channel.worst_time if isnan(since) else since
        text += f"; the trajectories diverge at {_of_scene(since, scene)}{_chatter(scene, since)}"
    else:
        text += f", at {channel.worst_time:.4g}{NO_BREAK}s; no channel is nearer to its limit"
    if scene.refined and scene.confirmation is None:
        text += f", of finer runs ({mark(scene)})"
    return f"{text}{_card_confirmation(scene)}."


def _chatter(scene: SceneComparison, time: float) -> str:
    """Return ", just after chatter (7 contacts in the 20 ms before)"; empty where there was none."""
    table = next((events for events in scene.events if events is not None), None)
    if table is None or scene.period is None:
        return ""
    before = _CHATTER * scene.period
    count = int(((table["start"] > time - before) & (table["start"] <= time)).sum())
    if count < _MANY:
        return ""
    return f", just after chatter ({count} contacts in the {quantity(before, 's', 2)} before)"


def _card_confirmation(scene: SceneComparison) -> str:
    result = scene.confirmation
    if result is None:
        return ""
    if result.outcome == "underestimated":
        return f"; the uncertainty had been underestimated {number(result.factor, 2)} times and is corrected"
    return f"; {mark(scene)}"


def _undecided(scene: SceneComparison) -> str:
    worst = scene.worst_channel
    if worst is None or isnan(scene.coverage) or scene.unsettled:
        return scene_reason(scene)
    text = f"{percent(scene.coverage)} of the samples are predictable, at least "
    text += f"{worst.limits.coverage:.0%} are required"
    excited = [channel for channel in scene.channels.values() if channel.verdict != "unexcited"]
    if any(channel.coverage > worst.coverage for channel in excited):
        text += f"; least of all {worst.label} ({percent(worst.coverage)})"
    return text + _card_confirmation(scene)


def _next(scene: SceneComparison) -> tuple[str, list[str]]:
    """Return what to do next, and the commands for it; the latter empty where there is nothing to do."""
    if scene.verdict == "indeterminate" and scene.closer_command:
        tables = "State the difference that is allowed, as a share of each scale:"
        return tables if scene.ran is None else "See whether finer settings decide it:", [
            scene.closer_command
        ]
    if scene.ran is None or scene.verdict == "indeterminate":
        return "", []
    if scene.verdict == "cannot compare":
        if scene.failed is None:
            return "Run the scene again once the cause is removed:", [scene.command]
        return "Repeat the run that failed, by itself:", [_run(scene, scene.failed.scene, scene.failed.model)]
    if scene.verdict == "differ":
        return "Find which model errs, by a third opinion:", _third_opinion(scene, scene.ran)
    if scene.confirmation is not None and scene.confirmation.suspicious:
        what, closer = "A discontinuous event decides", scene.closer_command
        return (f"{what}; look at it at finer settings:", [closer]) if closer else (f"{what}.", [])
    return "Nothing to do.", []


def _third_opinion(scene: SceneComparison, ran: Scene) -> list[str]:
    """Return commands that run another formulation of one model and compare it with the reference."""
    model, formulation = "exudyn", "full"
    if ran.data["solver"]["exudyn"]["formulation"] == "full":
        # The reference's multipliers are for an ideal crank pin.
        ideal = ran.data["joints"]["crank_pin"] == "ideal"
        model, formulation = ("reference", "multiplier") if ideal else ("exudyn", "tree")
    host = scene.labels[1] if model == "reference" else scene.labels[0]
    third = ran.variant({f"solver.{model}.formulation": formulation})
    return [
        _run(scene, third, model, formulation),
        _run(scene, ran, host),
        command_line("compare", [f"{scene.name}-{which}.csv" for which in (host, formulation)], {}),
    ]


def _run(scene: SceneComparison, ran: Scene, model: str, what: str = "") -> str:
    """Return the command of one run."""
    return ran.command("run", "--model", model, "--out", f"{scene.name}-{what or model}.csv")


# All scenes


def overall_verdict(scenes: Sequence[SceneComparison]) -> str:
    """Return the worst verdict of the scenes at any tier; without a scene nothing was compared."""
    verdicts = [tier.verdict for scene in scenes for tier in scene.tiers]
    return max(verdicts, key=rank, default="cannot compare")


def headline(scenes: Sequence[SceneComparison]) -> str:
    """Return one sentence for all scenes: "Of 8 scenes 1 differs and 7 agree.".

    Where some were also compared at the tight tier: "At the standard tier all 8 agree; at the tight tier of 8
    scenes 1 differs and 7 agree.". A second one follows where an uncertainty had been underestimated.
    """
    closer = [scene.tight for scene in scenes if scene.tight is not None]
    text = _counted(scenes)
    text = f"At the standard tier {text}; at the tight tier {_counted(closer)}" if closer else text
    corrected = sum(
        judged.confirmation is not None and judged.confirmation.outcome == "underestimated"
        for judged in (*scenes, *closer)
    )
    rest = "1 of these verdicts rests" if corrected == 1 else f"{corrected} of these verdicts rest"
    return f"{text[0].upper()}{text[1:]}." + (f" {rest} on a corrected uncertainty." if corrected else "")


def _counted(scenes: Sequence[SceneComparison]) -> str:
    if not scenes:
        return "there is no scene to compare"
    words = {
        "cannot compare": ("cannot be compared", "cannot be compared"),
        "differ": ("differs", "differ"),
        "indeterminate": ("is indeterminate", "are indeterminate"),
        "agree": ("agrees", "agree"),
    }
    count = Counter(scene.verdict for scene in scenes)
    ordered = sorted(count.items(), key=lambda item: -rank(item[0]))
    if len(scenes) == 1:
        return f"the scene {scenes[0].name} {words[scenes[0].verdict][0]}"
    parts = [f"{count} {words[verdict][count > 1]}" for verdict, count in ordered]
    return f"all {parts[0]}" if len(parts) == 1 else f"of {len(scenes)} scenes {listed(parts)}"


def incomplete(scenes: Sequence[SceneComparison], missing: Sequence[str]) -> str:
    """Return which scenes were not compared; nothing if all were."""
    if not missing:
        return ""
    total = len(scenes) + len(missing)
    names = ", ".join(missing)
    return f"Incomplete: interrupted after {len(scenes)} of {total} scenes. Not compared: {names}."


def departures(changed: Sequence[Departure], made: Mapping[str, str]) -> str:
    """Return which verdicts are not those on record; nothing where all are.

    Parameters
    ----------
    changed
        Of these.
    made
        Machine and date of the record.
    """
    if not changed:
        return ""
    verdicts = [f"{each.scene}, {each.tier}: {each.verdict}, not {each.recorded}" for each in changed]
    return f"not the verdicts on record (on {made['machine']}; {made['date']}): {'; '.join(verdicts)}"


def standing(result: Standing) -> str:
    """Return the position of three or more models to each other as a sentence."""
    text = _standing(result)
    if result.left_out:
        text += f"; {listed(result.left_out)} cannot be compared"
    return f"{text[0].upper()}{text[1:]}."


def _standing(result: Standing) -> str:
    models = result.compared
    if result.outcome == "cannot compare":
        return "no two models can be compared"
    if result.outcome == "agree":
        return f"{listed(models)} agree" if len(models) == 2 else f"all {len(models)} agree"
    if result.outcome == "outlier":
        others = [model for model in models if model != result.outlier]
        return f"{result.outlier} is the outlier: it differs from {listed(others)}, which agree"
    pairs: dict[str, list[Pair]] = {}
    for pair, verdict in result.verdicts.items():
        pairs.setdefault(verdict, []).append(pair)
    parts = [f"{listed(pair)} differ" for pair in pairs.get("differ", [])]
    for verdict in ("indeterminate", "cannot compare"):
        parts += [f"{listed(pair)}: {verdict}" for pair in pairs.get(verdict, [])]
    parts += [f"{listed(pair)} agree" for pair in pairs.get("agree", [])]
    head = "undecided" if result.outcome == "undecided" else "no model is the outlier"
    return f"{head}: {'; '.join(parts)}"


def standings(results: Sequence[Standing]) -> str:
    """Return one sentence for all scenes of three or more models: which is the outlier, how often."""
    outliers = Counter(result.outlier for result in results if result.outlier)
    parts = [f"{model} is the outlier on {count}" for model, count in outliers.items()]
    agreed = sum(result.outcome == "agree" for result in results)
    if agreed:
        parts.append(f"all models that can be compared agree on {agreed}")
    if rest := len(results) - outliers.total() - agreed:
        parts.append(f"neither on {rest}")
    return f"Of {len(results)} scene{'s' * (len(results) > 1)}: {'; '.join(parts)}."


def listed(names: Sequence[str]) -> str:
    """Return "a, b and c"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


# The rule


def definition(scenes: Sequence[SceneComparison]) -> list[str]:
    """Return the definition of the verdicts of these scenes, one step per line."""
    tiers = {tier.tier: thresholds(tier.tier) for scene in scenes for tier in scene.tiers}
    judged = [tier for scene in scenes for tier in scene.tiers]
    known = [channel.u is not None for tier in judged for channel in tier.channels.values()]
    fixed = thresholds()
    alpha = _by_tier({name: f"{limits.alpha:g}" for name, limits in tiers.items()})
    floor = _by_tier({name: f"{limits.coverage:.0%}" for name, limits in tiers.items()})
    lines = []
    if "tight" in tiers:
        lines.append(
            "Each scene is judged at two tiers. Standard: the scene's settings, as a user runs it. Tight: "
            "the reference at its strict setting and Exudyn's tree of free bodies with error control; a "
            "scene that requires five bodies (no clearance, reactions) runs with its own settings."
        )
    if any(known) or not known:
        lines += [
            f"Uncertainty u(t) of one model: {SAFETY_FACTOR:g} times the largest distance of its run to its "
            "refined run, to its coarser run (divided by the error ratio expected between two levels) and of "
            f"the coarser run to its perturbed runs (start moved by {number(PERTURBATION, 1)} of the "
            "clearance, offset and angle with equal and with opposite signs) "
            f"within ±{WINDOW:.0%} of a crank cycle; where the three levels show the method's order, "
            f"{SAFETY_FACTOR_IN_ORDER:g} times the extrapolated error; never below round-off. "
            "Of both models: u = √(u₁² + u₂²).",
            f"Predictable: the samples with u ≤ {alpha} of the channel's scale; of a force or an "
            "acceleration only where the position that it depends on is predictable too. "
            f"Coverage is their share; below {floor} the channel is indeterminate.",
            f"Agree: |difference| ≤ {fixed.k:g} u on at least {fixed.share:.0%} of the predictable samples "
            f"(explained), so that |E|/{fixed.k:g}u ({fixed.share:.0%}), the ratio that this share stays "
            "within, is at most 1; that of a scene is the largest of its channels. Samples at which both "
            "models are exactly zero are not counted. Differ: on fewer; of a channel below the floor, if it "
            "would be fewer even with all other samples explained. A scene differs if one channel does; else "
            "its coverage, the mean over its excited channels (one without a sample to judge counts as "
            "zero), is compared with the same floor: below it is indeterminate, at or above it agrees.",
        ]
    if any(known):
        lines.append(
            "Differ is confirmed before it is reported: each model is rerun from at least "
            f"{OTHER_MEMBERS} starts (the reference {MEMBERS['reference']}) that are moved by the initial "
            "perturbation equivalent to its own error, and the other model's run is ranked in that ensemble "
            "by its largest distance from the centre. It is confirmed if this exceeds, in both ensembles, "
            "the distance of every member left out. Otherwise the uncertainty was underestimated: "
            f"{ENSEMBLE_FACTOR:g} times the largest distance in the ensemble replaces it, and the runs are "
            "judged again. Exudyn's run of five bodies is ranked in an ensemble of the other model; any "
            "verdict of theirs but agree is first re-tested at half the step, up to four times, until it is "
            "known what they converge to, and a difference of models is what outlasts this. With fewer than "
            f"{ENOUGH} runs the difference stays unconfirmed."
        )
    if any(tier.attribution.cause for tier in judged):
        lines.append(
            "Attribution of a difference: one model's run is replaced by its refined run, the other's is "
            "kept. A setting whose refinement removes the difference explains it; a difference above the "
            "threshold that no refinement removes is a difference of models."
        )
    if not all(known):
        lines.append(
            "Tables without a refined run carry no uncertainty: a fixed tolerance (a share of the scale) is "
            "the threshold, every sample counts as predictable and all must be within it, unless a smaller "
            "share was asked for; without a tolerance the verdict is indeterminate."
        )
    return lines


def ratio(scenes: Sequence[SceneComparison]) -> tuple[str, str]:
    """Return the name of the ratio that these verdicts rest on, and what it is."""
    channels = [c for scene in scenes for tier in scene.tiers for c in tier.channels.values()]
    limits = channels[0].limits if channels else thresholds()
    against = "tolerance" if channels and channels[0].u is None else f"{limits.k:g}u"
    share = f"{100 * limits.share:g}%"
    name = channels[0].ratio_name if channels else f"|E|/{against} ({share})"
    return name, f"the |difference| / {against} that {share} of the judged samples stay within"


def _by_tier(numbers: Mapping[str, str]) -> str:
    """Return "0.01 (standard tier) or 5e-05 (tight tier)"; for a single tier the number alone."""
    if len(numbers) < 2:
        return next(iter(numbers.values()), "")
    return " or ".join(f"{text} ({tier} tier)" for tier, text in numbers.items())
