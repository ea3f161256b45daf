"""The report's tables as text: channels, contacts, reliability, other measures, runs, the scene's numbers.

A `Table` has groups of columns, (heading, subheadings), and rows of one text a column.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from comparison.formatting import MISSING, NO_BREAK, number, percent, pretty_unit, quantity
from comparison.metrics.contacts import SITUATIONS
from comparison.reliability.assessment import Assessment
from comparison.reliability.difference import Difference
from comparison.reliability.errors import unit_of
from comparison.report import svg
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS, PIN
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words import verdicts
from comparison.words.reliability import rounded

Groups = Sequence[tuple[str, Sequence[str]]]


@dataclass(frozen=True)
class Row:
    """One line of a table."""

    name: str
    cells: Sequence[str]
    verdict: str = ""
    title: str = ""
    """More about the name."""
    strip: str | None = None
    """Background of the last cell, which shows the run from left to right; None: there is no such cell."""
    curves: Mapping[str, str] = field(default_factory=dict)
    """Class -> path of a drawing 1000 wide and 10 high in the last cell."""


@dataclass(frozen=True)
class Table:
    """Columns of numbers."""

    first: str
    groups: Groups
    rows: Sequence[Row]


def channel_table(scene: SceneComparison) -> Table:
    """Return the channels of a scene at one tier that were excited, and what their verdicts rest on."""
    excited = [channel for channel in scene.channels.values() if channel.verdict != "unexcited"]
    judged = [channel for channel in excited if channel.threshold is not None]
    known = any(channel.u is not None for channel in judged)
    columns: list[tuple[str, str, Callable[[ChannelComparison], str]]] = []
    if judged:
        limit = f"{judged[0].limits.k:g}u" if known else "tolerance"
        columns = [(judged[0].ratio_name, "", lambda c: number(c.ratio, 2))]
        if known:
            columns += [("Share of samples", "predictable", lambda c: percent(c.coverage, c.coverage_error))]
        columns += [
            (
                "Share of samples",
                f"of these ≤ {limit}" if known else "within",
                lambda c: percent(c.explained),
            ),
            ("Worst sample", "|E|", lambda c: quantity(c.worst_size, c.unit)),
            ("Worst sample", limit, lambda c: quantity(c.worst_threshold, c.unit)),
            ("Worst sample", "at (s)", lambda c: number(c.worst_time, 4)),
        ]
    columns += [
        ("|E| over the whole run", "largest", lambda c: quantity(c.max_difference, c.unit)),
        ("|E| over the whole run", "RMS", lambda c: quantity(c.rms_difference, c.unit)),
    ]
    groups: dict[str, list[str]] = {"Verdict": []}
    for group, part, _ in columns:
        groups.setdefault(group, []).extend([part] if part else [])
    if judged:
        groups["Predictable, over time" if known else "Beyond, over time"] = []
    rows = [
        Row(
            channel.channel,
            [value(channel) for _, _, value in columns],
            channel.verdict,
            f"{channel.label} ({pretty_unit(channel.unit)})" if channel.unit != "1" else channel.label,
            _strip(scene.time, {"--outside": channel.beyond, "--shade": ~channel.predictable})
            if judged
            else None,
        )
        for channel in excited
    ]
    return Table("Channel", list(groups.items()), rows)


def open_channels(scene: SceneComparison) -> list[tuple[str, str]]:
    """Return the channels that neither agree nor are unexcited, with the reason of each verdict."""
    return [
        (name, verdicts.reason(channel))
        for name, channel in scene.channels.items()
        if channel.verdict not in {"agree", "unexcited"}
    ]


def contact_table(scene: SceneComparison) -> Table | None:
    """Return a row per corner (or pin) and one for all; None without contacts."""
    if all(events is None or events.empty for events in scene.events):
        return None
    touched = {place for events in scene.events if events is not None for place in events["corner"]}
    rows = [(CONTACTS[place], place) for place in CONTACTS if place in touched] + [("all", "")]
    headings = ("Number", "Median duration", "Largest normal speed", "Impulse", "Largest force", "Deepest")
    return Table(
        "Where",
        [(heading, scene.labels) for heading in headings],
        [
            Row(name, [cell for pair in zip(*cells, strict=True) for cell in pair])
            for name, place in rows
            for cells in [[_contacts(events, place, len(headings)) for events in scene.events]]
        ],
    )


def _contacts(events: pd.DataFrame | None, place: str, columns: int) -> list[str]:
    if events is None:
        return [MISSING] * columns
    if place:
        events = events[events["corner"] == place]
    if events.empty:
        return ["0", *[MISSING] * (columns - 1)]
    return [
        str(len(events)),
        quantity(float((events["end"] - events["start"]).median()), "s"),
        quantity(float(events["normal_speed"].max()), "m/s"),
        quantity(float(events["impulse"].sum()), "N s"),
        quantity(float(events["peak_force"].max()), "N"),
        quantity(float(events["largest_depth"].max()), "m"),
    ]


def impact_table(scene: SceneComparison) -> Table | None:
    """Return a row for all contacts and one for the predictable part; None where none can be matched."""
    if scene.impacts is None or not (scene.impacts["all"].count_a or scene.impacts["all"].count_b):
        return None
    names = {"all": "all", "predictable": "predictable part"}
    return Table(
        "Contacts",
        [
            ("Number", (*scene.labels, "matched")),
            ("Matched share", scene.labels),
            ("Distance of starts", ("median", "largest")),
            ("Error of", ("total impulse", "impulses", "normal speed", "peak force")),
        ],
        [
            Row(
                names[part],
                [
                    str(impacts.count_a),
                    str(impacts.count_b),
                    str(len(impacts.pairs)),
                    percent(impacts.recall),
                    percent(impacts.precision),
                    quantity(impacts.median_delay, "s"),
                    quantity(impacts.largest_delay, "s"),
                    _share(impacts.total_impulse_error),
                    _share(impacts.impulse_error),
                    _share(impacts.normal_speed_error),
                    _share(impacts.peak_force_error),
                ],
            )
            for part, impacts in scene.impacts.items()
        ],
    )


def situation_table(scene: SceneComparison) -> Table | None:
    """Return the time share of each contact situation, and of a touching crank pin; None where unknown.

    Situations that occur in neither model are omitted.
    """
    both, pins = scene.situations, scene.pin_contact
    rows = []
    if both != (None, None):
        rows += [
            Row(words, [_share(shares[key]) if shares else MISSING for shares in both])
            for key, words in SITUATIONS.items()
        ]
    if pins != (None, None):
        cells = [MISSING if share is None else _share(share) for share in pins]
        rows.append(Row(f"{CONTACTS[PIN]} in contact", cells))
    return Table("Situation", [(label, ()) for label in scene.labels], rows) if rows else None


def reliability_table(scene: SceneComparison) -> Table | None:
    """Return both models' smallest reliability and share within the limits, and their difference; or None."""
    if scene.reliability is None or not scene.reliability.quantities:
        return None
    return Table(
        "Quantity",
        [
            ("Verdict", ()),
            ("Smallest reliability R", (*scene.labels, "at")),
            ("Difference of R", ("value", "±")),
            ("Smallest P(|error| ≤ limit)", (*scene.labels, "at")),
            ("95 % interval of R", scene.labels),
            ("Parts of ±", ("cycles", "numerics", "quadrature")),
            ("R over the crank cycle", ()),
        ],
        [
            Row(
                f"{name}, {_limits(name, difference.a)}",
                _reliability(difference),
                difference.verdict,
                curves=_curves(difference),
            )
            for name, difference in scene.reliability.quantities.items()
        ],
    )


def _limits(name: str, model: Assessment) -> str:
    unit, limits = unit_of(name), model.limits
    upper = quantity(limits.upper, unit)
    return f"{quantity(limits.lower, unit)} to {upper}" if limits.lower else f"≤ {upper}"


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
    return {
        model: "M" + "L".join(
            f"{1000 * n / max(1, curve.size - 1):.0f} {9.5 - 9 * (value - low) / span:.1f}"
            for n, value in enumerate(curve.tolist())
        )
        for model, curve in curves.items()
    }  # fmt: skip


def information_table(scene: SceneComparison) -> Table | None:
    """Return common measures of similarity of each excited channel; None without one.

    Two digits: of impacts, which samples meet or miss, the third depends on the sampling.
    """
    groups = [
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
    rows = [
        Row(
            name,
            [
                quantity(channel.metrics["peak_difference"], channel.unit),
                *(number(channel.metrics[key], 2) for key in keys),
            ],
        )
        for name, channel in scene.channels.items()
        if channel.metrics
    ]
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


def version_lines(provenance: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return one line for each set of versions and platform, naming the runs that share it."""
    lines: dict[str, list[str]] = {}
    for name, run in provenance.items():
        versions = run.get("versions") or {}
        parts = [f"{package} {version}" for package, version in versions.items()]
        line = ", ".join([*parts, *([str(run["platform"])] if "platform" in run else [])])
        if line:
            lines.setdefault(line, []).append(name)
    return [f"{', '.join(names)}: {line}" for line, names in lines.items()]


def scene_values(scene: Mapping[str, Any] | None) -> str:
    """Return the scene as lines ``drive.speed_rpm = 150.0``, keys as `--set` takes them; no texts."""
    return "\n".join(_flat({key: value for key, value in (scene or {}).items() if key != "scene"}))


def _flat(mapping: Mapping[str, Any], start: str = "") -> Iterable[str]:
    for key, value in mapping.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{start}{key}.")
        else:
            yield f"{start}{key} = {json.dumps(value, ensure_ascii=False)}"


def _strip(time: Array, masks: Mapping[str, BoolArray]) -> str:
    """Return where masks hold over the run as CSS gradients, a colour's variable each, the first on top."""
    start, span = float(time[0]), float(time[-1] - time[0])
    layers = []
    for colour, mask in masks.items():
        stops, end = [], "0"
        for low, high in svg.spans(mask, time, columns=200):
            left, right = (f"{100 * (edge - start) / span:.4g}%" for edge in (low, high))
            stops.append(f"#0000 {end} {left},var({colour}) {left} {right}")
            end = right
        if stops:
            layers.append(f"linear-gradient(90deg,{','.join(stops)},#0000 {end})")
    return ",".join(layers) or "none"


def _share(share: float) -> str:
    """Return percent with three digits, so that rare situations do not appear as zero."""
    return MISSING if np.isnan(share) else f"{number(100 * share)}{NO_BREAK}%"


def _pairs(values: Mapping[str, Any] | None) -> str:
    """Return "steps 123,456, tolerance 1e-10"."""
    if not values:
        return MISSING
    return ", ".join(f"{key} {_plain(value)}" for key, value in values.items())


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
