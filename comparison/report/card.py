"""Verdict card of a scene at one tier: one plain sentence, the observed orders, what to do next."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from math import isnan

from comparison.agreement.event_description import describe
from comparison.agreement.observed_order import Order
from comparison.agreement.results import ChannelComparison, SceneComparison
from comparison.formatting import NO_BREAK, number, percent, quantity
from comparison.report.ratio import deciding_channel
from comparison.report.summary import worst_channel

Orders = Mapping[tuple[str, str], tuple[Order, Order]]
"""(scene, tier) -> order of either model, see `comparison.agreement.observed_order`."""

_CHATTER = 0.05  # of a crank cycle before an instant: about one flight between two impacts
_MANY = 5  # contacts that begin in it


@dataclass(frozen=True)
class Card:
    """Texts of a card."""

    sentence: str
    order: str
    advice: str
    commands: tuple[str, ...]


def card(scene: SceneComparison, orders: Orders) -> Card:
    """Return the card of a scene at one tier; ``scene`` is the comparison at that tier.

    Parameters
    ----------
    scene
        The comparison.
    orders
        May lack the scene: then no order is stated.
    """
    advice, commands = _next(scene)
    return Card(
        sentence=_sentence(scene),
        order=_order(scene, orders),
        advice=advice,
        commands=tuple(commands),
    )


def _sentence(scene: SceneComparison) -> str:
    if not scene.channels:
        return f"{scene.reason}."
    if scene.verdict == "indeterminate":
        return _undecided(scene)
    channel, _ = deciding_channel(scene)
    if channel is None:
        return f"{scene.reason}."
    said = f", of finer runs ({scene.mark})" if scene.refined and scene.confirmation is None else ""
    said += _confirmed(scene)
    if scene.verdict == "differ":
        channel = worst_channel(scene) or channel
        return f"{_numbers(channel)}, {_instant(scene, channel)}{said}."
    return f"{_numbers(channel)}, at {_seconds(channel.worst_time)}, the worst of all channels{said}."


def _numbers(channel: ChannelComparison) -> str:
    """Return "slider x: 6.4 nm against 3.8 nm, 1.7 times"."""
    size, limit = abs(channel.worst_difference), channel.worst_threshold
    times = number(size / limit, 2) if limit else "∞"
    what = f"{channel.limits.k:g}u" if channel.u is not None else "tolerance"
    return (
        f"{channel.label}: difference {quantity(size, channel.unit, 2)} against "
        f"{quantity(limit, channel.unit, 2)} ({what}), {times} times"
    )


def _instant(scene: SceneComparison, worst: ChannelComparison) -> str:
    """Describe from when the models differ: crank angle, contact, and whether the slider chattered before."""
    found = scene.attribution
    since = worst.worst_time if found is None or isnan(found.outside_from) else found.outside_from
    events = dict(zip(scene.labels, scene.events, strict=True))
    place = describe(since, events, period=scene.period, scene=scene.scene)
    return f"first at {place}{_chatter(scene, since)}"


def _chatter(scene: SceneComparison, instant: float) -> str:
    """Return ", just after chatter (7 contacts in the 20 ms before)"; empty where there was none."""
    table = next((events for events in scene.events if events is not None), None)
    if table is None or scene.period is None:
        return ""
    before = _CHATTER * scene.period
    count = int(((table["start"] > instant - before) & (table["start"] <= instant)).sum())
    if count < _MANY:
        return ""
    return f", just after chatter ({count} contacts in the {quantity(before, 's', 2)} before)"


def _confirmed(scene: SceneComparison) -> str:
    found = scene.confirmation
    if found is None:
        return ""
    if found.outcome == "underestimated":
        return f"; the uncertainty had been underestimated {number(found.factor, 2)} times and is corrected"
    return f"; {found.mark}"


def _undecided(scene: SceneComparison) -> str:
    worst = worst_channel(scene)
    if worst is None or isnan(scene.coverage):
        return f"Not decided: {scene.reason}."
    said = f"Not decided: {percent(scene.coverage)} of the samples are predictable, at least "
    said += (
        f"{worst.limits.coverage:.0%} are required; least of all {worst.label} ({percent(worst.coverage)})"
    )
    if scene.confirmation is not None:
        said += _confirmed(scene)
    return f"{said}."


def _order(scene: SceneComparison, orders: Orders) -> str:
    found = orders.get((scene.name, scene.tier))
    if found is None:
        return ""
    return ", ".join(
        f"{label} {number(order.observed, 2)} (expected {order.expected:g})"
        for label, order in zip(scene.labels, found, strict=True)
        if not isnan(order.observed)
    )


def _next(scene: SceneComparison) -> tuple[str, list[str]]:
    """Return what to do next, and the commands for it; the latter empty where there is nothing to do."""
    source = _source(scene)
    if source is None or scene.scene is None:
        return _of_tables(scene)
    strict = shlex.join(["sixbar", "validate", source, "--accuracy", "strict"])
    if scene.verdict == "cannot compare":
        model = next((label for label in scene.labels if f"the {label} run" in scene.reason), None)
        if model is None:
            return "Run the scene again once the cause is removed:", [scene.command]
        run = ["sixbar", "run", source, "--model", model, "--out", f"{scene.name}-{model}.csv"]
        return "Repeat the run that failed, by itself:", [shlex.join(run)]
    if scene.verdict == "indeterminate":
        return "See whether finer settings decide it:", [strict]
    if scene.verdict == "differ":
        other = _third_opinion(scene, source)
        return "Find which model errs, by a third opinion:", other
    if scene.confirmation is not None and scene.confirmation.suspicious:
        return "A discontinuous event decides; look at it at finer settings:", [strict]
    return "Nothing to do.", []


def _third_opinion(scene: SceneComparison, source: str) -> list[str]:
    """Return commands that run another formulation of one model and compare it with the reference."""
    data = scene.scene or {}
    model, formulation = "exudyn", "full"
    if data["solver"]["exudyn"]["formulation"] == "full":
        # The reference's multipliers are for an ideal crank pin.
        ideal = data["joints"]["crank_pin"] == "ideal"
        model, formulation = ("reference", "multiplier") if ideal else ("exudyn", "tree")
    third = f"{scene.name}-{formulation}.csv"
    host = scene.labels[1] if model == "reference" else scene.labels[0]
    own = f"{scene.name}-{host}.csv"
    runs = [
        ["sixbar", "run", source, "--model", model, "--formulation", formulation, "--out", third],
        ["sixbar", "run", source, "--model", host, "--out", own],
        ["sixbar", "compare", own, third],
    ]
    return [shlex.join(run) for run in runs]


def _of_tables(scene: SceneComparison) -> tuple[str, list[str]]:
    if (
        scene.verdict == "indeterminate"
        and scene.command
        and all(c.u is None for c in scene.channels.values())
    ):
        return "State the difference that is allowed, as a share of each scale:", [
            f"{scene.command} --tolerance 0.01"
        ]
    return "", []


def _source(scene: SceneComparison) -> str | None:
    """Return the scene as `sixbar validate` takes it; None for a comparison of tables."""
    words = shlex.split(scene.command)
    return words[2] if words[:2] == ["sixbar", "validate"] and len(words) > 2 else None


def _seconds(time: float) -> str:
    return f"{time:.4g}{NO_BREAK}s"
