"""Sentences about a difference: causes found in the data, instant, confirmation and attribution."""

from collections.abc import Sequence
from math import ceil, isfinite, isnan, log10, nan

import pandas as pd

from comparison.formatting import NO_BREAK, percent, quantity
from comparison.metrics import contact_places
from comparison.scene.keys import readable
from comparison.tables.channels import CONTACTS, PIN
from comparison.tables.units import parse_unit
from comparison.verdict.confirmation import ENOUGH_MEMBERS
from comparison.verdict.results import (
    SUSPICIOUS,
    Cause,
    Doubt,
    Refinement,
    SceneComparison,
)

_DOUBTS = {
    Doubt.TOLERANCE: "the verdict uses a tolerance, to which ensembles do not apply",
    Doubt.RIGID: "no joint has clearance, so no start can be moved",
    Doubt.SLOW: "both models are too slow for an ensemble",
    Doubt.NO_STARTS: "no runs from moved starts beyond those of the uncertainty",
    Doubt.FEW_RUNS: f"fewer than {ENOUGH_MEMBERS} runs from moved starts succeeded",
    Doubt.ONE_STATE: "one state alone was moved",
    Doubt.UNREFINED: "a run at a finer setting failed",
    Doubt.NO_EFFECT: "the runs that show the error of one are equal, so it is not known",
    Doubt.UNMOVED: "a moved start changes nothing in one",
}
_UNPREDICTABLE = {
    "a": "the uncertainty of {0} alone",
    "b": "the uncertainty of {1} alone",
    "each": "the uncertainty of each model by itself",
    "together": "only both uncertainties together",
}


# ---- causes found in the data

_DIGITS = 7  # most digits of a number
_FEW = 3  # most names or scenes in one sentence
_LEAST_REST = 0.01  # least share of the difference without a cause that a sentence states
_ERROR = 1e-3  # permitted relative distance of an inexact ratio from that of two units
# Units that programs write instead of an SI unit.
_UNITS = {
    "m": ("mm", "cm", "in", "ft"),
    "rad": ("deg", "rev"),
    "m/s": ("mm/s", "cm/s", "in/s"),
    "rad/s": ("rpm", "deg/s"),
    "m/s^2": ("mm/s^2", "cm/s^2"),
    "rad/s^2": ("deg/s^2",),
    "N": ("kN", "mN", "lbf"),
    "N m": ("N mm", "kN m"),
    "J": ("mJ", "kJ"),
}


def causes(scene: SceneComparison) -> list[str]:
    """Return the causes found in the data of a comparison, by the share that they explain."""
    return [cause(one, scene) for one in scene.causes]


def lead(scenes: Sequence[SceneComparison]) -> list[str]:
    """Return the first lines of a report: all causes of one scene, the first of each of several.

    The causes are those of the tightest tier that has one.
    """
    lines: list[str] = []
    for scene in scenes:
        texts = next((texts for tier in reversed(scene.tiers) if (texts := causes(tier))), [])
        lines += texts if len(scenes) == 1 else [f"{scene.name}: {text}" for text in texts[:1]]
    rest = len(lines) - _FEW
    return [*lines[:_FEW], f"{rest} more causes are on the page"] if rest > 1 else lines


def cause(one: Cause, scene: SceneComparison) -> str:
    """Return a cause as a sentence without full stop, with the share that remains without it."""
    rest = f"; without it {one.rest:.0%} of the difference is left" if one.rest >= _LEAST_REST else ""
    return _cause_of(one, scene) + rest


def _cause_of(one: Cause, scene: SceneComparison) -> str:
    a, b = scene.labels
    name, several = _names(one.channels), len(one.channels) > 1
    unit = scene.channels[one.channels[0]].unit if one.channels else ""
    those = "those" if several else "that"
    of_b = f"{name} of {b} {'are' if several else 'is'}"
    place = _place(one.place)
    impact = f"the first impact, at {one.time:.6g} s ({place}),"
    factor = _round(one.value, one.uncertainty)
    match one.kind:
        case "keys":
            keys = [f"{key} is {readable(x)} in {a} and {readable(y)} in {b}" for key, x, y in one.keys]
            more = len(keys) - _FEW
            return "; ".join(keys[:_FEW] + [f"{more} more keys of the scenes differ"] * (more > 0))
        case "ratio":
            return _ratio(one, of_b, f"{those} of {a}", unit, scene.labels)
        case "offset":
            size, sense = _round(abs(one.value), one.uncertainty, unit), "above" if one.value > 0 else "below"
            return f"{of_b} {size} {sense} {those} of {a}, at all times"
        case "turns":
            return f"{of_b} whole turns away from {those} of {a}: a mapping leaves them out by angle = true"
        case "constant":
            return f"{of_b} constant, {quantity(one.value, unit)}"
        case "shift":
            later, earlier = (b, a) if one.value > 0 else (a, b)
            size = _round(abs(one.value), one.uncertainty, "s")
            return f"{later} is later than {earlier} by {size} in {name}"
        case "friction":
            x, y = (f"{value:.6g}" for value in one.values)  # noqa: PD011
            return f"friction over normal force is {x} in {a} and {y} in {b}, {factor} times"
        case "gravity":
            size = _round(one.value, one.uncertainty, unit, sign=True)
            return f"before the first contact {name} differs by {size} in {b}, whatever slider_ay is: gravity"
        case "stiffness":
            return (
                f"{impact} has equal impulses, and forces as of {factor} times the stiffness in {b}: "
                "the material, radius or stiffness of the contact"
            )
        case "restitution":
            return (
                f"{impact} has {factor} times the impulse in {b}, at equal approach speed: "
                "restitution or damping"
            )
        case "contact":
            owner, other = (a, b) if one.side == "b" else (b, a)
            return f"{other} lacks the contact of the {place} at {one.time:.6g} s, which {owner} has"


def _ratio(one: Cause, of_b: str, of_a: str, unit: str, labels: tuple[str, str]) -> str:
    size = abs(one.value)
    text = f"{of_b} {_round(one.value, one.uncertainty)} times {of_a}"
    if (
        size - 1.0 <= max(one.uncertainty, 1e-9)
        and 1.0 - size <= max(one.uncertainty, 1e-9)
        and one.value < 0
    ):
        text = f"{of_b} minus {of_a}: the sign"
    text += (
        f", {'plus' if one.offset > 0 else 'minus'} {quantity(abs(one.offset), unit)}" if one.offset else ""
    )
    for candidate in _UNITS.get(unit, ()):
        units = parse_unit(unit), parse_unit(candidate)
        assert units[0] is not None
        assert units[1] is not None
        times = float(units[0].factor / units[1].factor)
        for label, factor in ((labels[1], times), (labels[0], 1.0 / times)):
            if abs(size / factor - 1.0) <= max(_ERROR if one.rest > 1e-6 else 1e-6, one.uncertainty / size):
                partner = labels[0] if label == labels[1] else labels[1]
                return f"{text}: perhaps {candidate} in {label} and {unit} in {partner}"
    return text


def _names(channels: Sequence[str]) -> str:
    if len(channels) <= _FEW:
        return " and ".join(filter(None, (", ".join(channels[:-1]), channels[-1]))) if channels else ""
    return f"{', '.join(channels[: _FEW - 1])} and {len(channels) - _FEW + 1} more channels"


def _round(value: float, uncertainty: float, unit: str = "", *, sign: bool = False) -> str:
    """Return a number with its significant digits, and with its uncertainty if that affects them."""
    share = uncertainty / abs(value) if value and not isnan(uncertainty) else 0.0
    if share < 10.0**-_DIGITS:
        return f"{value:{'+' if sign else ''}#.{_DIGITS}g} {unit}".rstrip().removesuffix(".")
    digits = max(1, min(_DIGITS, ceil(-log10(share)) + 1))
    return f"{value:{'+' if sign else ''}#.{digits}g} ± {uncertainty:.1g} {unit}".rstrip()


# ---- its instant, confirmation and attribution


def instant_of(time: float, scene: SceneComparison) -> str:
    """Return "0.0142 s (cycle 1, crank at 13°), during contact of the upper left corner"."""
    where = f"{time:.4g} s" if abs(time) < 1e4 else f"{time:.15g} s"  # counted from an epoch
    if scene.scene is not None and scene.period is not None:
        cycles, start = time / scene.period, scene.scene["mechanism"]["crank_angle_deg"]
        sense = -1.0 if scene.scene["drive"]["speed_rpm"] < 0 else 1.0
        where += f" (cycle {int(cycles) + 1}, crank at {(start + sense * 360 * cycles) % 360:.0f}°)"
    tables = zip(scene.labels, scene.events, strict=True)
    contacts = {label: contact(time, events) for label, events in tables if events is not None}
    if len(set(contacts.values())) <= 1:
        return ", ".join([where, *list(contacts.values())[:1]])
    return f"{where}, " + ", ".join(f"{words} ({label})" for label, words in contacts.items())


def contact(time: float, events: pd.DataFrame) -> str:
    """Return the places in contact at an instant (s), or those of the last contact before it."""
    contacts = events[events["start"] <= time]
    if contacts.empty:
        return "before the first contact"
    rows, word = contacts[contacts["end"] >= time], "during"
    if rows.empty:
        rows, word = contacts[contacts["end"] == contacts["end"].max()], "after"
    return f"{word} contact of {' and '.join(map(_the, contact_places(rows)))}"


def _place(place: str) -> str:
    return CONTACTS.get(place, place) + " corner" * (place in CONTACTS and place != PIN)


def _the(place: str) -> str:
    return f"the {_place(place)}" if place in CONTACTS else place


def confirmation(scene: SceneComparison) -> str:
    """Return the result of the ensembles for a verdict "differ"; empty without ensembles."""
    result, labels = scene.confirmation, scene.labels
    if result is None:
        return ""
    begin = result.since if isnan(scene.since) else scene.since
    since = "" if isnan(begin) else f" from {begin:.4g} s on"
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
    pairs = zip(result.members, labels, strict=True)
    runs = " and ".join(f"{count} of {label}" for count, label in pairs if count)
    text = f"difference confirmed{since} by runs from moved starts, {runs}: {outside}"
    if isfinite(result.excess):  # not where all members are one
        text += f", {result.excess:.3g} times as far as the farthest of these"
    return text if result.parting is None else f"{text}; they are first separated by {parting(scene)}"


def parting(scene: SceneComparison) -> str:
    """Return "the contact of the upper left corner at 0.2454 s, which occurs in 3 of 99 reference runs"."""
    if scene.confirmation is None or (event := scene.confirmation.parting) is None:
        return ""
    counts = zip(event.counts, event.sizes, scene.labels, strict=True)
    occurs = " and ".join(f"{count} of {size} {label} runs" for count, size, label in counts)
    return f"the contact of {_the(event.corner)} at {event.start:.6g} s, which occurs in {occurs}"


def attribution_lines(scene: SceneComparison) -> list[str]:
    """Return lines on the origins of a scene's difference and their shares; empty without any."""
    result, has_shares = scene.attribution, not isnan(scene.attribution.explained)
    lines = [f"{plain_percent(result.explained)} of the judged samples explained"] if has_shares else []
    if not isnan(result.remaining.get("both", nan)):
        shares = [_share(result.remaining[key]) for key in ("a", "b", "both")]
        settings = [*map(_refinement, result.refinements), "both"]
        parts = [f"{share} with {setting}" for share, setting in zip(shares, settings, strict=True)]
        lines.append(f"remaining difference: {', '.join(parts)}")
    if result.outside_in:
        setting, where = "band" if scene.has_u else "tolerance", instant_of(result.outside_from, scene)
        lines.append(f"first outside the {setting}: {result.outside_in} at {where}")
    if result.unpredictable:
        origins = (
            f"{words.format(*scene.labels)} {result.unpredictable[key]:.0%}"
            for key, words in _UNPREDICTABLE.items()
            if result.unpredictable[key] >= 0.005
        )
        lines.append(f"not predictable in the indeterminate channels by {', '.join(origins)}")
    return lines


def _refinement(change: Refinement) -> str:
    """Return "exudyn's step / 2 (2e-06 s; with its tolerance, 1e-07; 25% if all were its error)"."""
    (chief, value), *others = change.settings.items() or [("setting", nan)]
    details = [] if isnan(value) else [f"{value:g}{' s' if chief == 'step' else ''}"]
    details += [f"with its {key}, {other:g}" for key, other in others]
    details.append(f"{1 / change.gain:.3g} of its own error")
    return f"{change.label}'s {chief} / {change.factor:g} ({'; '.join(details)})"


def _share(remaining: float) -> str:
    return f"{remaining:.1%}" if remaining < 10.0 else f"{remaining:.2g} times"


def plain_percent(share: float) -> str:
    """Return a share as percent in plain characters, truncated: "100.00%" only for all."""
    text = percent(share).replace(NO_BREAK, "")
    return "100.00%" if text == "100%" else text
