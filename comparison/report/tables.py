"""The report's tables: channels, contacts, reliability, other measures, runs, the scene's numbers."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from markupsafe import Markup

from comparison.formatting import MISSING, NO_BREAK, number, percent, pretty_unit, quantity
from comparison.metrics.contacts import SITUATIONS, Impacts
from comparison.reliability.difference import Difference
from comparison.reliability.errors import unit_of
from comparison.report.svg import spans
from comparison.tables.channels import CONTACTS, PIN
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.reliability import rounded
from comparison.words.verdicts import SYMBOLS

Column = tuple[str, str, Callable[[Any], str]]
"""Its heading, the subheading ("" without one), and what it says of a row; Markup is a whole cell."""
_VERDICT: Column = (
    "Verdict",
    "",
    lambda judged: Markup('<td class="verdict {}">{} {}</td>').format(
        judged.verdict.split()[0], SYMBOLS.get(judged.verdict, "!"), judged.verdict
    ),
)
_CONTACTS = {
    "Median duration": ("duration", "median", "s"),
    "Largest normal speed": ("normal_speed", "max", "m/s"),
    "Impulse": ("impulse", "sum", "N s"),
    "Largest force": ("peak_force", "max", "N"),
    "Deepest": ("largest_depth", "max", "m"),
}
"""Heading -> column of the event table, its statistic and unit."""
_MEASURES = [
    ("Peak, second − first", "at (s)", "peak_time_difference"),
    ("Sprague and Geers", "M", "sprague_geers_magnitude"),
    ("Sprague and Geers", "P", "sprague_geers_phase"),
    ("Sprague and Geers", "C", "sprague_geers_combined"),
    ("Russell", "M", "russell_magnitude"),
    ("Russell", "P", "russell_phase"),
    ("Russell", "C", "russell_comprehensive"),
    ("ISO/TS 18571", "R", "iso18571"),
    ("ISO/TS 18571", "corridor", "iso18571_corridor"),
    ("ISO/TS 18571", "phase", "iso18571_phase"),
    ("ISO/TS 18571", "magnitude", "iso18571_magnitude"),
    ("ISO/TS 18571", "slope", "iso18571_slope"),
    ("Correlation", "", "correlation"),
    ("Tube", "", "tube_share"),
]
"""Heading, subheading, metric."""


class Table(NamedTuple):
    """Groups of columns, each a heading with its subheadings, and the cells of each row."""

    first: str
    groups: list[tuple[str, list[str]]]
    rows: dict[str, list[str]]
    titles: Mapping[str, str]  # of rows, which say more than their names


def _table(
    first: str, columns: Sequence[Column], rows: Mapping[str, Any], titles: Mapping[str, str] | None = None
) -> Table | None:
    """Return a table; None without a row."""
    groups: dict[str, list[str]] = {}
    for group, part, _ in columns:
        groups.setdefault(group, []).extend([part] if part else [])
    cells = {name: [say(row) for *_, say in columns] for name, row in rows.items()}
    return Table(first, list(groups.items()), cells, titles or {}) if rows else None


def channel_table(scene: SceneComparison) -> Table | None:
    """Return the channels that were excited, and what their verdicts rest on."""
    excited = scene.excited
    judged = [channel for channel in excited.values() if channel.threshold is not None]
    known = any(channel.u is not None for channel in judged)
    columns: list[Column] = [_VERDICT]
    if judged:
        limit = f"{judged[0].limits.k:g}u" if known else "tolerance"
        within = f"of these ≤ {limit}" if known else "within"
        columns.append((judged[0].ratio_name, "", lambda c: number(c.ratio, 2)))
        if known:
            columns.append(
                ("Share of samples", "predictable", lambda c: percent(c.coverage, c.coverage_error))
            )
        columns += [
            ("Share of samples", within, lambda c: percent(c.explained)),
            ("Worst sample", "|E|", lambda c: quantity(c.worst_size, c.unit)),
            ("Worst sample", limit, lambda c: quantity(c.worst_threshold, c.unit)),
            ("Worst sample", "at (s)", lambda c: number(c.worst_time, 4)),
        ]
    columns += [
        ("|E| over the whole run", "largest", lambda c: quantity(c.max_difference, c.unit)),
        ("|E| over the whole run", "RMS", lambda c: quantity(c.rms_difference, c.unit)),
    ]
    if judged:
        columns.append(("Predictable, over time" if known else "Beyond, over time", "", _strip))
    titles = {name: f"{c.label} ({pretty_unit(c.unit)})".removesuffix(" ()") for name, c in excited.items()}
    return _table("Channel", columns, excited, titles)


def _strip(channel: ChannelComparison) -> Markup:
    """Return a cell that shows over the run where a channel is beyond and where it is not predictable."""
    time, layers = channel.time, []
    start, span = float(time[0]), float(time[-1] - time[0])
    for colour, mask in {"--outside": channel.beyond, "--shade": ~channel.predictable}.items():
        stops, end = [], "0"
        for edges in spans(mask, time, columns=200):
            left, right = (f"{100 * (edge - start) / span:.4g}%" for edge in edges)
            stops.append(f"#0000 {end} {left},var({colour}) {left} {right}")
            end = right
        if stops:
            layers.append(f"linear-gradient(90deg,{','.join(stops)},#0000 {end})")
    cell = Markup('<td class="strip" style="background-image:{}"></td>')
    return cell.format(",".join(layers) or "none")


def contact_table(scene: SceneComparison) -> Table | None:
    """Return a row per corner (or pin) and one for all; None without contacts."""
    touched = {place for events in scene.events if events is not None for place in events["corner"]}
    rows = {name: [place] for place, name in CONTACTS.items() if place in touched}
    if rows:
        rows["all"] = list(CONTACTS)

    def column(heading: str, events: pd.DataFrame | None) -> Callable[[list[str]], str]:
        def say(places: list[str]) -> str:
            if events is None:
                return MISSING
            own = events[events["corner"].isin(places)]
            if heading == "Number":
                return str(len(own))
            name, statistic, unit = _CONTACTS[heading]
            values = own["end"] - own["start"] if name == "duration" else own[name]
            return quantity(float(values.agg(statistic)), unit) if len(own) else MISSING

        return say

    columns = [
        (heading, label, column(heading, events))
        for heading in ("Number", *_CONTACTS)
        for label, events in zip(scene.labels, scene.events, strict=True)
    ]
    return _table("Where", columns, rows)


def impact_table(scene: SceneComparison) -> Table | None:
    """Return a row for all contacts and one for the predictable part; None where none can be matched."""
    found: Mapping[str, Impacts] = scene.impacts or {}
    if not any(impacts.count_a or impacts.count_b for impacts in found.values()):
        return None
    a, b = scene.labels
    columns: list[Column] = [
        ("Number", a, lambda impacts: str(impacts.count_a)),
        ("Number", b, lambda impacts: str(impacts.count_b)),
        ("Number", "matched", lambda impacts: str(len(impacts.pairs))),
        ("Matched share", a, lambda impacts: percent(impacts.recall)),
        ("Matched share", b, lambda impacts: percent(impacts.precision)),
        ("Distance of starts", "median", lambda impacts: quantity(impacts.median_delay, "s")),
        ("Distance of starts", "largest", lambda impacts: quantity(impacts.largest_delay, "s")),
        ("Error of", "total impulse", lambda impacts: _share(impacts.total_impulse_error)),
        ("Error of", "impulses", lambda impacts: _share(impacts.impulse_error)),
        ("Error of", "normal speed", lambda impacts: _share(impacts.normal_speed_error)),
        ("Error of", "peak force", lambda impacts: _share(impacts.peak_force_error)),
    ]
    names = {"all": "all", "predictable": "predictable part"}
    return _table("Contacts", columns, {names[part]: impacts for part, impacts in found.items()})


def situation_table(scene: SceneComparison) -> Table | None:
    """Return the time share of each contact situation, and of a touching crank pin; None where unknown."""
    rows: dict[str, Sequence[float | None]] = {}
    if scene.situations != (None, None):
        for key, words in SITUATIONS.items():
            rows[words] = [shares[key] if shares else None for shares in scene.situations]
    if scene.pin_contact != (None, None):
        rows[f"{CONTACTS[PIN]} in contact"] = scene.pin_contact
    a, b = scene.labels
    columns: list[Column] = [
        (a, "", lambda shares: _share(shares[0])),
        (b, "", lambda shares: _share(shares[1])),
    ]
    return _table("Situation", columns, rows)


def _share(share: float | None) -> str:
    """Return percent with three digits, so that rare situations do not appear as zero."""
    return MISSING if share is None or np.isnan(share) else f"{number(100 * share)}{NO_BREAK}%"


def reliability_table(scene: SceneComparison) -> Table | None:
    """Return both models' smallest reliability and share within the limits, and their difference; or None."""
    a, b = scene.labels

    def finite(value: float) -> str:
        return number(value, 2) if np.isfinite(value) else MISSING

    def least(difference: Difference) -> str:
        models = difference.a, difference.b
        places = (
            "cap" if model.capped[model.worst] else f"{model.angle[model.worst]:g}°" for model in models
        )
        return ", ".join(dict.fromkeys(places))

    def least_within(difference: Difference) -> str:
        places = [
            "everywhere" if np.ptp(model.within) == 0.0 else f"{model.angle[model.within.argmin()]:g}°"
            for model in (difference.a, difference.b)
        ]
        return ", ".join(dict.fromkeys(places))

    columns: list[Column] = [
        _VERDICT,
        ("Smallest reliability R", a, lambda difference: rounded(difference.a.minimum)),
        ("Smallest reliability R", b, lambda difference: rounded(difference.b.minimum)),
        ("Smallest reliability R", "at", least),
        ("Difference of R", "value", lambda difference: number(difference.minimum, 2)),
        ("Difference of R", "±", lambda difference: finite(difference.half_width)),
        ("Smallest P(|error| ≤ limit)", a, lambda difference: f"{difference.a.within.min():.3f}"),
        ("Smallest P(|error| ≤ limit)", b, lambda difference: f"{difference.b.within.min():.3f}"),
        ("Smallest P(|error| ≤ limit)", "at", least_within),
        ("95 % interval of R", a, lambda difference: "{:.5f} … {:.5f}".format(*difference.a.interval)),
        ("95 % interval of R", b, lambda difference: "{:.5f} … {:.5f}".format(*difference.b.interval)),
        ("Parts of ±", "cycles", lambda difference: finite(difference.sampling)),
        ("Parts of ±", "numerics", lambda difference: finite(difference.numerical)),
        ("Parts of ±", "quadrature", lambda difference: finite(difference.quadrature)),
        ("R over the crank cycle", "", _curves),
    ]
    rows = {}
    for name, difference in scene.reliability.quantities.items() if scene.reliability else ():
        limits, unit = difference.a.limits, unit_of(name)
        lower = f"{quantity(limits.lower, unit)} to " if limits.lower else "≤ "
        rows[f"{name}, {lower}{quantity(limits.upper, unit)}"] = difference
    return _table("Quantity", columns, rows)


def _curves(difference: Difference) -> Markup:
    """Return a cell with both models' reliability over the crank cycle, the cap at the top."""
    curves = {"first": difference.a.reliability, "second": difference.b.reliability}
    low = min(float(curve.min()) for curve in curves.values())
    span = max(difference.a.cap, *(float(curve.max()) for curve in curves.values())) - low or 1.0
    paths = []
    for model, curve in curves.items():
        places = 1000 * np.arange(curve.size) / max(1, curve.size - 1)
        heights = 9.5 - 9 * (curve - low) / span
        path = "M" + "L".join(f"{x:.0f} {y:.1f}" for x, y in zip(places, heights, strict=True))
        paths.append(Markup('<path class="{}" d="{}"/>').format(model, path))
    attributes = 'class="curves" viewBox="0 0 1000 10" preserveAspectRatio="none" aria-hidden="true"'
    return Markup("<td><svg {}>{}</svg></td>").format(Markup(attributes), Markup("").join(paths))


def information_table(scene: SceneComparison) -> Table | None:
    """Return common measures of similarity of each excited channel; None without one.

    Two digits: of impacts, which samples meet or miss, the third depends on the sampling.
    """

    def measure(key: str) -> Callable[[ChannelComparison], str]:
        return lambda channel: number(channel.metrics[key], 2)

    columns: list[Column] = [
        ("Peak, second − first", "value", lambda c: quantity(c.metrics["peak_difference"], c.unit)),
        *((group, part, measure(key)) for group, part, key in _MEASURES),
    ]
    return _table("Channel", columns, {name: c for name, c in scene.channels.items() if c.metrics})


def pairs(values: Mapping[str, Any] | None) -> str:
    """Return "steps 123,456, tolerance 1e-10"."""

    def plain(value: object) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, int):
            return f"{value:,}"
        return f"{value:.6g}" if isinstance(value, float) else str(value)

    return ", ".join(f"{key} {plain(value)}" for key, value in (values or {}).items()) or MISSING


def version_lines(provenance: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return one line for each set of versions and platform, naming the runs that share it."""
    lines: dict[str, list[str]] = {}
    for name, run in provenance.items():
        parts = [f"{package} {version}" for package, version in (run.get("versions") or {}).items()]
        if line := ", ".join([*parts, *([str(run["platform"])] if "platform" in run else [])]):
            lines.setdefault(line, []).append(name)
    return [f"{', '.join(names)}: {line}" for line, names in lines.items()]


def scene_values(scene: Mapping[str, Any] | None) -> str:
    """Return the scene as lines ``drive.speed_rpm = 150.0``, keys as `--set` takes them; no texts."""

    def flat(mapping: Mapping[str, Any], start: str = "") -> Iterable[str]:
        for key, value in mapping.items():
            if isinstance(value, Mapping):
                yield from flat(value, f"{start}{key}.")
            else:
                yield f"{start}{key} = {json.dumps(value, ensure_ascii=False)}"

    return "\n".join(flat({key: value for key, value in (scene or {}).items() if key != "scene"}))
