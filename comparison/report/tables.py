"""Rows of the report's tables as text: channels, contacts, runs, the scene's numbers."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from comparison.formatting import MISSING, NO_BREAK, number, percent, pretty_unit, quantity
from comparison.metrics.contacts import SITUATIONS
from comparison.report.decimate import spans
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS, PIN
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.verdicts import reason

CONTACT_HEADINGS = (
    "Contacts",
    "Median duration",
    "Largest normal speed",
    "Total impulse",
    "Largest force",
    "Deepest",
)

INFORMATION_HEADINGS = {
    "sprague_geers_magnitude": "M",
    "sprague_geers_phase": "P",
    "sprague_geers_combined": "C",
    "iso18571": "R",
    "iso18571_corridor": "Corridor",
    "iso18571_phase": "Phase",
    "iso18571_magnitude": "Magnitude",
    "iso18571_slope": "Slope",
    "tube_share": "In the tube",
}


def channel_row(channel: ChannelComparison, time: Array) -> dict[str, Any]:
    """Return one row of the channel table; ``time`` (s) has shape (n,)."""
    unit = channel.unit
    within = channel.largest_predictable
    compared = channel.verdict != "unexcited"
    located = compared and not np.isnan(channel.worst_threshold)
    relation = ">" if abs(channel.worst_difference) > channel.worst_threshold else "≤"
    return {
        "name": channel.channel,
        "label": channel.label,
        "unit": pretty_unit(unit),
        "verdict": channel.verdict,
        "coverage": percent(channel.coverage, channel.coverage_error) if compared else MISSING,
        "explained": percent(channel.explained) if compared else MISSING,
        "largest": quantity(channel.max_difference, unit),
        "largest_scaled": _of_scale(channel.max_scaled),
        "largest_predictable": quantity(within, unit),
        "largest_predictable_scaled": _of_scale(within / channel.scale if channel.scale else np.nan),
        "rms": quantity(channel.rms_difference, unit),
        "rms_error": "" if np.isnan(channel.rms_error) else f"± {quantity(channel.rms_error, unit, 1)}",
        "rms_scaled": _of_scale(channel.rms_scaled),
        "worst": quantity(abs(channel.worst_difference), unit) if located else MISSING,
        "worst_threshold": (
            f"{relation} {quantity(channel.worst_threshold, unit)}, at {channel.worst_time:.4f} s"
            if located
            else ""
        ),
        "reason": reason(channel),
        "has_strip": compared,
        "unpredictable": _strip(~channel.predictable, time),
        "outside": _strip(channel.beyond, time),
    }


def contact_rows(scene: SceneComparison) -> list[dict[str, Any]]:
    """Return one row per corner (or pin) and one for all; empty without contacts."""
    if all(events is None or events.empty for events in scene.events):
        return []
    met = [set(events["corner"]) for events in scene.events if events is not None]
    places = [place for place in CONTACTS if place in set().union(*met)]
    rows = [(CONTACTS[place], [_of_place(events, place) for events in scene.events]) for place in places]
    rows.append(("all", list(scene.events)))
    return [
        {"place": name, "cells": list(zip(*(_contacts(events) for events in pair), strict=True))}
        for name, pair in rows
    ]


def impact_rows(scene: SceneComparison) -> list[dict[str, Any]]:
    """Return one row for all contacts and one for the predictable part; empty without contacts."""
    words = {"all": "all", "predictable": "predictable part"}
    if scene.impacts is None or not (scene.impacts["all"].count_a or scene.impacts["all"].count_b):
        return []
    return [
        {
            "words": words[part],
            "cells": [
                str(impacts.count_a),
                str(impacts.count_b),
                str(len(impacts.pairs)),
                percent(impacts.recall),
                percent(impacts.precision),
                quantity(impacts.median_delay, "s"),
                quantity(impacts.largest_delay, "s"),
                _of_whole(impacts.total_impulse_error),
                _of_whole(impacts.impulse_error),
                _of_whole(impacts.normal_speed_error),
                _of_whole(impacts.peak_force_error),
            ],
        }
        for part, impacts in scene.impacts.items()
    ]


def information_rows(scene: SceneComparison) -> list[dict[str, Any]]:
    """Return one row per excited channel, with cells under `INFORMATION_HEADINGS`.

    Two digits: of impacts, which samples meet or miss, the third depends on the sampling.
    """
    return [
        {"name": name, "cells": [number(channel.metrics[key], 2) for key in INFORMATION_HEADINGS]}
        for name, channel in scene.channels.items()
        if channel.metrics
    ]


def situation_rows(scene: SceneComparison) -> list[dict[str, Any]]:
    """Return one row per situation with its time share in both models, and one for the crank pin.

    Situations that occur in neither model are omitted.
    """
    both, pins = scene.situations, scene.pin_contact
    rows = []
    if both != (None, None):
        rows += [
            {"words": words, "cells": [_of_whole(shares[key]) if shares else MISSING for shares in both]}
            for key, words in SITUATIONS.items()
        ]
    if pins != (None, None):
        cells = [MISSING if share is None else _of_whole(share) for share in pins]
        rows.append({"words": f"{CONTACTS[PIN]} in contact", "cells": cells})
    return rows


def run_rows(provenance: Mapping[str, Mapping[str, Any]]) -> list[dict[str, str]]:
    """Return one row per run; missing entries are "n/a"."""
    return [
        {
            "name": name,
            "formulation": str(run.get("formulation", "")),
            "integrator": str(run.get("integrator", MISSING)),
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


def _strip(mask: BoolArray, time: Array) -> str:
    """Return the intervals of a mask as an SVG path, 1000 wide (the run) and 10 high."""
    start, per_second = float(time[0]), 1000 / float(time[-1] - time[0])
    boxes = spans(mask, time, columns=200)
    scaled = [(per_second * (low - start), per_second * (high - low)) for low, high in boxes]
    return "".join(f"M{left:.0f} 0h{width:.0f}v10h-{width:.0f}z" for left, width in scaled)


def _of_place(events: pd.DataFrame | None, place: str) -> pd.DataFrame | None:
    return None if events is None else events[events["corner"] == place]


def _contacts(events: pd.DataFrame | None) -> list[str]:
    """Return the cells of one model under `CONTACT_HEADINGS`."""
    if events is None:
        return [MISSING] * len(CONTACT_HEADINGS)
    if events.empty:
        return ["0", *[MISSING] * (len(CONTACT_HEADINGS) - 1)]
    return [
        str(len(events)),
        quantity(float((events["end"] - events["start"]).median()), "s"),
        quantity(float(events["normal_speed"].max()), "m/s"),
        quantity(float(events["impulse"].sum()), "N s"),
        quantity(float(events["peak_force"].max()), "N"),
        quantity(float(events["largest_depth"].max()), "m"),
    ]


def _of_scale(scaled: float) -> str:
    return "" if np.isnan(scaled) else f"{number(scaled)} of scale"


def _of_whole(share: float) -> str:
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
