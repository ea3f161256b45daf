"""The report's tables as text: channels, contacts, reliability, other measures, runs, the scene's numbers."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.formatting import MISSING, NO_BREAK, number, percent, pretty_unit, quantity
from comparison.metrics.contacts import SITUATIONS
from comparison.reliability.difference import Difference
from comparison.reliability.errors import unit_of
from comparison.report.svg import spans
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS, PIN
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.reliability import rounded


class Row(NamedTuple):
    """One line of a table: its name, of which ``title`` says more, and a text a column."""

    name: str
    cells: Sequence[str]
    verdict: str = ""
    title: str = ""
    strip: str | None = None
    """Background of the last cell, which shows the run from left to right; None: there is no such cell."""
    curves: Mapping[str, str] = {}
    """Class -> path of a drawing 1000 wide and 10 high in the last cell."""


class Table(NamedTuple):
    """Columns of numbers, in groups of a heading and subheadings."""

    first: str
    groups: Sequence[tuple[str, Sequence[str]]]
    rows: Sequence[Row]


def channel_table(scene: SceneComparison) -> Table | None:
    """Return the channels that were excited, and what their verdicts rest on; None without channels."""
    if not scene.channels:
        return None
    excited = [channel for channel in scene.channels.values() if channel.verdict != "unexcited"]
    judged = [channel for channel in excited if channel.threshold is not None]
    known = any(channel.u is not None for channel in judged)
    columns: list[tuple[str, str, Callable[[ChannelComparison], str]]] = []
    if judged:
        limit = f"{judged[0].limits.k:g}u" if known else "tolerance"
        within = f"of these ≤ {limit}" if known else "within"
        columns = [
            (judged[0].ratio_name, "", lambda c: number(c.ratio, 2)),
            ("Share of samples", "predictable", lambda c: percent(c.coverage, c.coverage_error)),
            ("Share of samples", within, lambda c: percent(c.explained)),
            ("Worst sample", "|E|", lambda c: quantity(c.worst_size, c.unit)),
            ("Worst sample", limit, lambda c: quantity(c.worst_threshold, c.unit)),
            ("Worst sample", "at (s)", lambda c: number(c.worst_time, 4)),
        ]
        if not known:
            del columns[1]
    columns += [
        ("|E| over the whole run", "largest", lambda c: quantity(c.max_difference, c.unit)),
        ("|E| over the whole run", "RMS", lambda c: quantity(c.rms_difference, c.unit)),
    ]
    groups: dict[str, list[str]] = {"Verdict": []}
    for group, part, _ in columns:
        groups.setdefault(group, []).extend([part] if part else [])
    if judged:
        groups["Predictable, over time" if known else "Beyond, over time"] = []
    rows = []
    for channel in excited:
        masks = {"--outside": channel.beyond, "--shade": ~channel.predictable}
        title = f"{channel.label} ({pretty_unit(channel.unit)})" if channel.unit != "1" else channel.label
        cells = [value(channel) for _, _, value in columns]
        strip = _strip(scene.time, masks) if judged else None
        rows.append(Row(channel.channel, cells, channel.verdict, title, strip))
    return Table("Channel", list(groups.items()), rows)


def _strip(time: Array, masks: Mapping[str, BoolArray]) -> str:
    """Return where masks hold over the run as CSS gradients, a colour's variable each, the first on top."""
    start, span = float(time[0]), float(time[-1] - time[0])
    layers = []
    for colour, mask in masks.items():
        stops, end = [], "0"
        for edges in spans(mask, time, columns=200):
            left, right = (f"{100 * (edge - start) / span:.4g}%" for edge in edges)
            stops.append(f"#0000 {end} {left},var({colour}) {left} {right}")
            end = right
        if stops:
            layers.append(f"linear-gradient(90deg,{','.join(stops)},#0000 {end})")
    return ",".join(layers) or "none"


def contact_table(scene: SceneComparison) -> Table | None:
    """Return a row per corner (or pin) and one for all; None without contacts."""
    tables = [events for events in scene.events if events is not None]
    touched = {place for events in tables for place in events["corner"]}
    if not touched:
        return None

    def cells(events: pd.DataFrame | None, places: Iterable[str]) -> list[str]:
        if events is None:
            return [MISSING] * 6
        own = events[events["corner"].isin(list(places))]
        if own.empty:
            return ["0", *[MISSING] * 5]
        return [
            str(len(own)),
            quantity(float((own["end"] - own["start"]).median()), "s"),
            quantity(float(own["normal_speed"].max()), "m/s"),
            quantity(float(own["impulse"].sum()), "N s"),
            quantity(float(own["peak_force"].max()), "N"),
            quantity(float(own["largest_depth"].max()), "m"),
        ]

    headings = ("Number", "Median duration", "Largest normal speed", "Impulse", "Largest force", "Deepest")
    rows = {name: [place] for place, name in CONTACTS.items() if place in touched} | {"all": list(CONTACTS)}
    shown = {name: [cells(events, places) for events in scene.events] for name, places in rows.items()}
    return Table(
        "Where",
        [(heading, scene.labels) for heading in headings],
        [Row(name, np.array(both).T.ravel().tolist()) for name, both in shown.items()],
    )


def impact_table(scene: SceneComparison) -> Table | None:
    """Return a row for all contacts and one for the predictable part; None where none can be matched."""
    if scene.impacts is None or not (scene.impacts["all"].count_a or scene.impacts["all"].count_b):
        return None
    groups = [
        ("Number", (*scene.labels, "matched")),
        ("Matched share", scene.labels),
        ("Distance of starts", ("median", "largest")),
        ("Error of", ("total impulse", "impulses", "normal speed", "peak force")),
    ]
    errors = ("total_impulse_error", "impulse_error", "normal_speed_error", "peak_force_error")
    rows = [
        Row(
            {"all": "all", "predictable": "predictable part"}[part],
            [
                *map(str, (impacts.count_a, impacts.count_b, len(impacts.pairs))),
                *map(percent, (impacts.recall, impacts.precision)),
                *(quantity(delay, "s") for delay in (impacts.median_delay, impacts.largest_delay)),
                *(_share(getattr(impacts, error)) for error in errors),
            ],
        )
        for part, impacts in scene.impacts.items()
    ]
    return Table("Contacts", groups, rows)


def situation_table(scene: SceneComparison) -> Table | None:
    """Return the time share of each contact situation, and of a touching crank pin; None where unknown."""
    both, pins = scene.situations, scene.pin_contact
    rows = []
    if both != (None, None):
        rows += [
            Row(words, [_share(shares[key] if shares else None) for shares in both])
            for key, words in SITUATIONS.items()
        ]
    if pins != (None, None):
        rows.append(Row(f"{CONTACTS[PIN]} in contact", [_share(share) for share in pins]))
    return Table("Situation", [(label, ()) for label in scene.labels], rows) if rows else None


def _share(share: float | None) -> str:
    """Return percent with three digits, so that rare situations do not appear as zero."""
    return MISSING if share is None or np.isnan(share) else f"{number(100 * share)}{NO_BREAK}%"


def reliability_table(scene: SceneComparison) -> Table | None:
    """Return both models' smallest reliability and share within the limits, and their difference; or None."""
    if scene.reliability is None or not scene.reliability.quantities:
        return None
    groups: list[tuple[str, Sequence[str]]] = [
        ("Verdict", ()),
        ("Smallest reliability R", (*scene.labels, "at")),
        ("Difference of R", ("value", "±")),
        ("Smallest P(|error| ≤ limit)", (*scene.labels, "at")),
        ("95 % interval of R", scene.labels),
        ("Parts of ±", ("cycles", "numerics", "quadrature")),
        ("R over the crank cycle", ()),
    ]
    rows = []
    for name, difference in scene.reliability.quantities.items():
        limits, unit = difference.a.limits, unit_of(name)
        text = f"{quantity(limits.lower, unit)} to " if limits.lower else "≤ "
        text += quantity(limits.upper, unit)
        cells, curves = _reliability(difference), _curves(difference)
        rows.append(Row(f"{name}, {text}", cells, difference.verdict, curves=curves))
    return Table("Quantity", groups, rows)


def _reliability(difference: Difference) -> list[str]:
    models = difference.a, difference.b
    least = [int(model.within.argmin()) for model in models]
    places = ["cap" if model.capped[model.worst] else f"{model.angle[model.worst]:g}°" for model in models]
    shares = [
        "everywhere" if np.all(model.within == model.within[0]) else f"{model.angle[place]:g}°"
        for model, place in zip(models, least, strict=True)
    ]
    half, *parts = (
        number(value, 2) if np.isfinite(value) else MISSING
        for value in (difference.half_width, difference.sampling, difference.numerical, difference.quadrature)
    )
    return [
        *(rounded(model.minimum) for model in models),
        ", ".join(dict.fromkeys(places)),
        number(difference.minimum, 2),
        half,
        *(f"{model.within[place]:.3f}" for model, place in zip(models, least, strict=True)),
        ", ".join(dict.fromkeys(shares)),
        *("{:.5f} … {:.5f}".format(*model.interval) for model in models),
        *parts,
    ]


def _curves(difference: Difference) -> dict[str, str]:
    """Return both models' reliability over the crank cycle as paths, the cap at the top."""
    curves = {"first": difference.a.reliability, "second": difference.b.reliability}
    low = min(float(curve.min()) for curve in curves.values())
    span = max(difference.a.cap, *(float(curve.max()) for curve in curves.values())) - low or 1.0
    paths = {}
    for model, curve in curves.items():
        places = 1000 * np.arange(curve.size) / max(1, curve.size - 1)
        heights = 9.5 - 9 * (curve - low) / span
        paths[model] = "M" + "L".join(f"{x:.0f} {y:.1f}" for x, y in zip(places, heights, strict=True))
    return paths


def information_table(scene: SceneComparison) -> Table | None:
    """Return common measures of similarity of each excited channel; None without one.

    Two digits: of impacts, which samples meet or miss, the third depends on the sampling.
    """
    groups: list[tuple[str, Sequence[str]]] = [
        ("Peak, second − first", ("value", "at (s)")),
        ("Sprague and Geers", ("M", "P", "C")),
        ("Russell", ("M", "P", "C")),
        ("ISO/TS 18571", ("R", "corridor", "phase", "magnitude", "slope")),
        ("Correlation", ()),
        ("Tube", ()),
    ]
    keys = (
        "peak_time_difference",
        *(f"sprague_geers_{part}" for part in ("magnitude", "phase", "combined")),
        *(f"russell_{part}" for part in ("magnitude", "phase", "comprehensive")),
        *("iso18571", *(f"iso18571_{part}" for part in ("corridor", "phase", "magnitude", "slope"))),
        "correlation",
        "tube_share",
    )
    rows = []
    for name, channel in scene.channels.items():
        if values := channel.metrics:
            peak = quantity(values["peak_difference"], channel.unit)
            rows.append(Row(name, [peak, *(number(values[key], 2) for key in keys)]))
    return Table("Channel", groups, rows) if rows else None


def run_rows(provenance: Mapping[str, Mapping[str, Any]]) -> list[dict[str, str]]:
    """Return one row per run; missing entries are "n/a"."""
    return [
        {
            "name": name,
            "integrator": ", ".join(str(run[key]) for key in ("formulation", "integrator") if run.get(key)),
            "settings": _pairs(run.get("settings")),
            "counters": _pairs(run.get("counters")),
            "constraints": _pairs(run["constraints"]) if "constraints" in run else "",
            "wall_time": MISSING if run.get("wall_time_s") is None else f"{run['wall_time_s']:.2f} s",
            "status": str(run.get("status", MISSING)),
        }
        for name, run in provenance.items()
    ]


def _pairs(values: Mapping[str, Any] | None) -> str:
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
