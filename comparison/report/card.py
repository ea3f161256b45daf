"""Verdict card of a scene at one tier: one plain sentence, the observed orders, what to do next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isnan

from comparison.accuracy.uncertainty import Order
from comparison.agreement.event_description import describe
from comparison.agreement.results import ChannelComparison, SceneComparison
from comparison.formatting import NO_BREAK, number, percent, quantity
from comparison.report.summary import worst_channel
from comparison.scene import Scene, command_line

Orders = Mapping[tuple[str, str], tuple[Order, Order]]
"""(scene, tier) -> order of either model, see `comparison.accuracy.uncertainty`."""

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
        commands=tuple(filter(None, commands)),
    )


def _sentence(scene: SceneComparison) -> str:
    if not scene.channels:
        return f"{scene.reason}."
    if scene.verdict == "indeterminate":
        return _undecided(scene)
    channel = scene.decisive
    if channel is None:
        return f"{scene.reason}."
    said = f", of finer runs ({scene.mark})" if scene.refined and scene.confirmation is None else ""
    said += _confirmed(scene)
    if scene.verdict == "differ":
        return f"{_numbers(channel)}; {_instant(scene, channel)}{said}."
    return f"{_numbers(channel)}, at {_seconds(channel.worst_time)}; no channel is nearer to its limit{said}."


def _numbers(channel: ChannelComparison) -> str:
    """Return "slider x: |E|/2u (99%) is 1.2, the maximum 1.7: 6.4 nm against 3.8 nm"."""
    size, limit = (
        quantity(v, channel.unit, 2) for v in (abs(channel.worst_difference), channel.worst_threshold)
    )
    most = "" if channel.limits.share == 1.0 else f", the maximum {number(channel.largest_ratio, 2)}"
    return (
        f"{channel.label}: {channel.ratio_name} is {number(channel.ratio, 2)}{most}: {size} against {limit}"
    )


def _instant(scene: SceneComparison, worst: ChannelComparison) -> str:
    """Describe from when the models differ: crank angle, contact, and whether the slider chattered before."""
    found = scene.attribution
    since = worst.worst_time if found is None or isnan(found.outside_from) else found.outside_from
    events = dict(zip(scene.labels, scene.events, strict=True))
    place = describe(since, events, period=scene.period, scene=scene.scene)
    return f"the models part first at {place}{_chatter(scene, since)}"


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
    said += f"{worst.limits.coverage:.0%} are required"
    excited = [channel for channel in scene.channels.values() if channel.verdict != "unexcited"]
    if any(channel.coverage > worst.coverage for channel in excited):
        said += f"; least of all {worst.label} ({percent(worst.coverage)})"
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
    if scene.verdict == "indeterminate" and scene.closer_command:
        of_tables = "State the difference that is allowed, as a share of each scale:"
        what = of_tables if scene.ran is None else "See whether finer settings decide it:"
        return what, [scene.closer_command]
    if scene.ran is None or scene.verdict == "indeterminate":
        return "", []
    if scene.verdict == "cannot compare":
        if scene.failed is None:
            return "Run the scene again once the cause is removed:", [scene.command]
        return "Repeat the run that failed, by itself:", [_run(scene, scene.failed.scene, scene.failed.model)]
    if scene.verdict == "differ":
        return "Find which model errs, by a third opinion:", _third_opinion(scene, scene.ran)
    if scene.confirmation is not None and scene.confirmation.suspicious:
        what = "A discontinuous event decides"
        closer = scene.closer_command
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


def _seconds(time: float) -> str:
    return f"{time:.4g}{NO_BREAK}s"
