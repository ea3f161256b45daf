"""The report's tables: channels, contacts, reliability, other measures, runs, the scene's numbers."""

import json
from collections.abc import Mapping
from math import nan
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from comparison.formatting import MISSING, NO_BREAK, number, percent, pretty_unit, quantity
from comparison.metrics import SITUATIONS, contact_places
from comparison.reliability.assessment import ROUNDING, Difference
from comparison.report.svg import spans
from comparison.scene.keys import flat
from comparison.tables.channels import CONTACTS
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.reliability import format_reliability, limit
from comparison.words.since import Since, change_text
from comparison.words.verdicts import SYMBOLS, until

Cells = list[tuple[str, str, str]]
"""Row of a table: heading, subheading (or "") and text of each cell; Markup is a whole cell."""
_CONTACTS = {
    "Median duration": ("duration", "median", "s"),
    "Largest normal speed": ("normal_speed", "max", "m/s"),
    "Impulse": ("impulse", "sum", "N s"),
    "Largest force": ("peak_force", "max", "N"),
    "Deepest": ("largest_depth", "max", "m"),
}
"""Heading -> column of the event table, its statistic and unit."""


class Table(NamedTuple):
    """Groups of columns, each a heading with its subheadings, and the cells of each row."""

    first: str
    groups: list[tuple[str, list[str]]]
    rows: dict[str, list[str]]
    titles: Mapping[str, str]  # row -> a title longer than its name


def _table(first: str, rows: Mapping[str, Cells], titles: Mapping[str, str] | None = None) -> Table | None:
    """Return a table; None without a row."""
    groups: dict[str, list[str]] = {}
    for group, part, _ in next(iter(rows.values()), []):
        groups.setdefault(group, []).extend([part] if part else [])
    cells = {name: [text for *_, text in row] for name, row in rows.items()}
    return Table(first, list(groups.items()), cells, titles or {}) if rows else None


def _verdict(verdict: str) -> Cells:
    cell = Markup('<td class="verdict {}">{} {}</td>')
    return [("Verdict", "", cell.format(verdict.split()[0], SYMBOLS.get(verdict, "!"), verdict))]


def channel_table(scene: SceneComparison) -> Table | None:
    """Return a row per excited channel with the numbers that decide its verdict."""
    excited = scene.excited
    example = next((each for each in excited.values() if each.threshold is not None), None)
    has_u = any(each.u is not None for each in excited.values() if each.threshold is not None)
    limit = f"{example.limits.k:g}u" if example and has_u else "tolerance"
    rows, titles = {}, {}
    for name, channel in excited.items():
        cells = _verdict(channel.verdict)
        if example:
            cells.append((example.ratio_name, "", number(channel.ratio, 2)))
            if has_u:
                coverage = percent(channel.coverage, channel.coverage_error)
                cells.append(("Until (s)", "", until(channel)))
                cells.append(("Share of samples", "predictable", coverage))
            within = f"of these ≤ {limit}" if has_u else "within"
            cells += [
                ("Share of samples", within, percent(channel.explained)),
                ("Worst sample", "|E|", quantity(channel.worst_size, channel.unit)),
                ("Worst sample", limit, quantity(channel.worst_threshold, channel.unit)),
                ("Worst sample", "at (s)", number(channel.worst_time, 4)),
            ]
        cells.append(("|E| over the whole run", "largest", quantity(channel.max_difference, channel.unit)))
        cells.append(("|E| over the whole run", "RMS", quantity(channel.rms_difference, channel.unit)))
        if example:
            cells.append(("Predictable, over time" if has_u else "Beyond, over time", "", _strip(channel)))
        rows[name] = cells
        titles[name] = f"{channel.label} ({pretty_unit(channel.unit)})".removesuffix(" ()")
    return _table("Channel", rows, titles)


def since_table(since: Since) -> Table | None:
    """Return a row for each scene, tier and channel that has moved since an earlier report."""
    headings = ("Verdict", "|E|/limit", "Predictable")
    rows: dict[str, Cells] = {
        ", ".join(filter(None, move[:3])): [
            (heading, "", change_text(before, now))
            for heading, before, now in zip(headings, move.before, move.now, strict=True)
        ]
        for move in since.moves
    }
    return _table("Scene, tier, channel", rows)


def _strip(channel: ChannelComparison) -> Markup:
    """Return a cell that marks the times at which a channel is beyond, or not predictable."""
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


def attribution_table(scene: SceneComparison) -> Table | None:
    """Return the share of the difference that remains after each refinement, and after both, or None."""
    result = scene.attribution
    rows: dict[str, Cells] = {}
    for key, change in zip("ab", result.refinements if result.remaining else (), strict=False):
        rows[change.label] = [
            ("Difference left", "", percent(result.remaining[key])),
            ("If the cause", "", percent(1.0 / change.gain)),
            ("Setting", "", pairs(change.settings)),
            ("Divided by", "", number(change.factor)),
        ]
    if rows:
        gain = min(change.gain for change in result.refinements)
        remainder = percent(result.remaining["both"])
        rows["both"] = [("", "", remainder), ("", "", percent(1.0 / gain)), ("", "", ""), ("", "", "")]
    return _table("Refined", rows)


def contact_tables(scene: SceneComparison) -> tuple[Table | None, Table | None]:
    """Return two tables, of all contacts and of the first ones: a row per corner or pin, and one for all."""
    names = contact_places(*scene.events)
    places = {CONTACTS.get(place, place): [place] for place in names} | ({"all": names} if names else {})
    rows, first = dict[str, Cells](), dict[str, Cells]()
    events = [e if e is None else e.assign(duration=e["end"] - e["start"]) for e in scene.events]
    for name, corners in places.items():
        sides = [e if e is None else e[e["corner"].isin(corners)] for e in events]
        counts = [MISSING if e is None else str(len(e)) for e in sides]
        rows[name] = [("Number", *cell) for cell in zip(scene.labels, counts, strict=True)]
        for heading, (key, statistic, unit) in _CONTACTS.items():
            values = [nan if e is None else float(e[key].agg(statistic)) for e in sides]
            texts = [quantity(value, unit) for value in values]
            rows[name] += [(heading, *cell) for cell in zip(scene.labels, texts, strict=True)]
        times = [nan if e is None else float(e["start"].min()) for e in sides]
        texts = [*(quantity(time, "s", 6) for time in times), quantity(times[0] - times[1], "s")]
        first[name] = [("Start", *cell) for cell in zip((*scene.labels, "difference"), texts, strict=True)]
    return _table("Where", rows), _table("First contact", first)


def impact_table(scene: SceneComparison) -> Table | None:
    """Return a row for all contacts and one for the predictable part; None without contacts to match."""
    a, b = scene.labels
    parts = scene.impacts or {}
    if not any(impacts.count_a or impacts.count_b for impacts in parts.values()):
        return None
    names = {"all": "all", "predictable": "predictable part"}
    rows: dict[str, Cells] = {
        names[part]: [
            ("Number", a, str(impacts.count_a)),
            ("Number", b, str(impacts.count_b)),
            ("Number", "matched", str(len(impacts.pairs))),
            ("Matched share", a, percent(impacts.recall)),
            ("Matched share", b, percent(impacts.precision)),
            ("Distance of starts", "median", quantity(impacts.median_delay, "s")),
            ("Distance of starts", "largest", quantity(impacts.largest_delay, "s")),
            ("Error of", "total impulse", _share(impacts.total_impulse_error)),
            ("Error of", "impulses", _share(impacts.impulse_error)),
            ("Error of", "normal speed", _share(impacts.normal_speed_error)),
            ("Error of", "peak force", _share(impacts.peak_force_error)),
        ]
        for part, impacts in parts.items()
    }
    return _table("Contacts", rows)


def situation_table(scene: SceneComparison) -> Table | None:
    """Return the time share of each contact situation; None if unknown."""
    sides = list(zip(scene.labels, scene.situations, strict=True))
    situations = SITUATIONS if scene.situations != (None, None) else {}
    rows: dict[str, Cells] = {
        words: [(label, "", _share(side[key] if side else None)) for label, side in sides]
        for key, words in situations.items()
    }
    return _table("Situation", rows)


def _share(share: float | None) -> str:
    """Return percent with three digits, so that rare situations do not appear as zero."""
    return MISSING if share is None or np.isnan(share) else f"{number(100 * share)}{NO_BREAK}%"


def reliability_tables(scene: SceneComparison) -> tuple[Table | None, Table | None]:
    """Return two tables: smallest reliability, share within the limits and difference; and intervals."""
    a, b = scene.labels
    rows: dict[str, Cells] = {}
    intervals: dict[str, Cells] = {}
    for name, difference in scene.reliability.quantities.items() if scene.reliability else ():
        models = (difference.a, difference.b)
        errors = (difference.half_width, difference.sampling, difference.numerical)
        half, cycles, numerics = (number(error, 2) if np.isfinite(error) else MISSING for error in errors)
        at = ("cap" if model.capped[model.worst] else f"{model.angle[model.worst]:g}°" for model in models)
        at_within = (
            "everywhere" if np.ptp(model.within) == 0.0 else f"{model.angle[model.within.argmin()]:g}°"
            for model in models
        )
        row = f"{name}, {limit(difference.a)}"
        rows[row] = [
            *_verdict(difference.verdict),
            ("Smallest reliability R", a, format_reliability(difference.a.minimum)),
            ("Smallest reliability R", b, format_reliability(difference.b.minimum)),
            ("Smallest reliability R", "at", ", ".join(dict.fromkeys(at))),
            ("Difference of R", "value", number(difference.minimum, 2)),
            ("Difference of R", "±", half),
            ("Smallest P(within the limits)", a, f"{difference.a.within.min():.3f}"),
            ("Smallest P(within the limits)", b, f"{difference.b.within.min():.3f}"),
            ("Smallest P(within the limits)", "at", ", ".join(dict.fromkeys(at_within))),
            ("R over the crank cycle", "", _curves(difference)),
        ]
        largest = [quantity(float(np.abs(model.mean).max()), model.unit, 3) for model in models]
        intervals[row] = [
            ("Largest mean error of an interval", a, largest[0]),
            ("Largest mean error of an interval", b, largest[1]),
            ("95 % interval of R", a, "{:.5f} … {:.5f}".format(*difference.a.interval)),
            ("95 % interval of R", b, "{:.5f} … {:.5f}".format(*difference.b.interval)),
            ("Parts of ±", "cycles", cycles),
            ("Parts of ±", "numerics", numerics),
        ]
    return _table("Quantity", rows), _table("Quantity", intervals)


def _curves(difference: Difference) -> Markup:
    """Return a cell with both models' reliability over the crank cycle, the cap at the top."""
    curves = {"first": difference.a.reliability, "second": difference.b.reliability}
    low = min(float(curve.min()) for curve in curves.values())
    top = max(difference.a.cap, *(float(curve.max()) for curve in curves.values()))
    span = max(top - low, 10 * ROUNDING)  # less shows nothing
    paths = []
    for model, curve in curves.items():
        curve = curve.repeat(2) if curve.size == 1 else curve  # a run within one interval
        places = 1000 * np.arange(curve.size) / (curve.size - 1)
        heights = 0.5 + 9 * (top - curve) / span
        path = "M" + "L".join(f"{x:.0f} {y:.1f}" for x, y in zip(places, heights, strict=True))
        paths.append(Markup('<path class="{}" d="{}"/>').format(model, path))
    attributes = 'class="curves" viewBox="0 0 1000 10" preserveAspectRatio="none" aria-hidden="true"'
    return Markup("<td><svg {}>{}</svg></td>").format(Markup(attributes), Markup("").join(paths))


def information_table(scene: SceneComparison) -> Table | None:
    """Return common measures of similarity, to two digits: further digits depend on the sampling."""
    rows = {
        name: [
            ("Peak, second − first", "value", quantity(c.metrics["peak_difference"], c.unit)),
            ("Peak, second − first", "at (s)", number(c.metrics["peak_time_difference"], 2)),
            ("Correlation", "", number(c.metrics["correlation"], 2)),
            ("Tube", "", number(c.metrics["tube_share"], 2)),
        ]
        for name, c in scene.channels.items()
        if c.metrics
    }
    return _table("Channel", rows)


def pairs(values: Mapping[str, Any] | None) -> str:
    """Return "steps 123,456, tolerance 1e-10"."""

    def text(value: object) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, int):
            return f"{value:,}"
        return f"{value:.6g}" if isinstance(value, float) else str(value)

    return ", ".join(f"{key} {text(value)}" for key, value in (values or {}).items()) or MISSING


def version_lines(provenance: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return one line for each set of versions and platform, with the runs that share it."""
    lines: dict[str, list[str]] = {}
    for name, run in provenance.items():
        parts = [f"{package} {version}" for package, version in (run.get("versions") or {}).items()]
        if line := ", ".join([*parts, *([str(run["platform"])] if "platform" in run else [])]):
            lines.setdefault(line, []).append(name)
    return [f"{', '.join(names)}: {line}" for line, names in lines.items()]


def scene_values(scene: Mapping[str, Any] | None) -> str:
    """Return the scene as lines ``drive.speed_rpm = 150.0``, keys as `--set` takes them; no texts."""
    keys = flat({key: value for key, value in (scene or {}).items() if key != "scene"})
    return "\n".join(f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in keys.items())
