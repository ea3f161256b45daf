"""Comparisons as numbers (for JSON) and sentences (for the terminal)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, fields
from math import isnan
from typing import Any

from comparison.agreement.attribution_text import percent
from comparison.agreement.contact_states import of_scene, pin_of_scene
from comparison.agreement.results import Attribution, ChannelComparison, SceneComparison
from comparison.metrics.contacts import Impacts
from comparison.reliability.difference import Difference, ReliabilityComparison
from comparison.reliability.errors import unit_of
from comparison.words.reliability import line as reliability_line
from comparison.words.reliability import missing

EXIT_CODES = {"agree": 0, "differ": 1, "cannot compare": 2, "indeterminate": 3}
_WORST_FIRST = (70, 2, 1, 3, 0)
_NUMBERS = (
    "coverage",
    "coverage_error",
    "explained",
    "max_difference",
    "rms_difference",
    "rms_error",
    "max_scaled",
    "rms_scaled",
    "ratio",
    "largest_ratio",
    "worst_time",
    "worst_difference",
    "worst_threshold",
    "outside",
)


def exit_code(codes: Sequence[int], *, allow_indeterminate: bool = False) -> int:
    """Return the worst of several exit codes: 70, 2, 1, 3, 0 in this order."""
    code = next(code for code in _WORST_FIRST if code in codes)
    return 0 if code == 3 and allow_indeterminate else code


def as_mapping(comparison: SceneComparison) -> dict[str, Any]:
    """Return all results without curves, for JSON; undefined numbers are nan (written as null)."""
    return {
        "name": comparison.name,
        "tier": comparison.tier,
        "refined": comparison.refined,
        "title": comparison.title,
        "verdict": comparison.verdict,
        "reason": comparison.reason,
        "decisive_channel": None if comparison.decisive is None else comparison.decisive.channel,
        "ratio": None if comparison.decisive is None else comparison.decisive.ratio,
        "warnings": list(comparison.warnings),
        "labels": list(comparison.labels),
        "samples": int(comparison.time.size),
        "time_shift": None if comparison.shift is None else vars(comparison.shift),
        "command": comparison.command,
        "situations": dict(zip(comparison.labels, of_scene(comparison), strict=True)),
        "crank_pin_contact": dict(zip(comparison.labels, pin_of_scene(comparison), strict=True)),
        "confirmation": None
        if comparison.confirmation is None
        else asdict(comparison.confirmation) | {"suspicious": comparison.confirmation.suspicious},
        "attribution": None if comparison.attribution is None else asdict(comparison.attribution),
        "impacts": None
        if comparison.impacts is None
        else {part: _impacts(impacts) for part, impacts in comparison.impacts.items()},
        "reliability": None
        if comparison.reliability is None
        else _reliability(comparison.reliability, comparison.labels),
        "channels": {name: _channel(channel) for name, channel in comparison.channels.items()},
        "provenance": comparison.provenance,
        "tight": None if comparison.tight is None else as_mapping(comparison.tight),
    }


def reasons(comparison: SceneComparison) -> list[tuple[str, str]]:
    """Return why a verdict at one tier is what it is: what each sentence is about, and the sentence.

    The reason, the confirmation of a difference, the attribution, the reliability of the motion.
    """
    said = [("reason", comparison.reason)]
    if comparison.refined:
        said.append(("runs", comparison.finer_runs))
    if comparison.confirmation is not None:
        said.append(("confirmation", comparison.confirmation.sentence))
    if comparison.attribution is not None and (words := attribution_words(comparison.attribution)):
        said.append(("why", "; ".join(words)))
    if comparison.reliability is not None:
        said.append(("reliability", reliability_line(comparison.reliability)))
    return said


def attribution_words(attribution: Attribution) -> list[str]:
    """Return the share that is explained, where there is one, and the sentences of an attribution."""
    explained = (
        []
        if isnan(attribution.explained)
        else [f"{percent(attribution.explained)} of the judged samples explained"]
    )
    return [*explained, *attribution.sentences]


def shift_line(comparison: SceneComparison) -> str:
    """Return the estimated time shift between the two results, if any, as a sentence."""
    return "" if comparison.shift is None else comparison.shift.sentence(comparison.labels)


def _channel(channel: ChannelComparison) -> dict[str, Any]:
    numbers = {name: getattr(channel, name) for name in _NUMBERS}
    return {
        "verdict": channel.verdict,
        "reason": channel.reason,
        "unit": channel.unit,
        "scale": channel.scale,
        **numbers,
        "information": dict(channel.metrics),
    }


def _reliability(found: ReliabilityComparison, labels: tuple[str, str]) -> dict[str, Any]:
    return {
        "verdict": found.verdict,
        "missing": missing(found),
        "bins": found.settings.bins,
        "errors": found.settings.errors,
        "quantities": {
            name: _quantity(name, difference, labels) for name, difference in found.quantities.items()
        },
    }


def _quantity(name: str, found: Difference, labels: tuple[str, str]) -> dict[str, Any]:
    models = {
        label: {
            "smallest": of.minimum,
            "smallest_interval": list(of.interval),
            "smallest_at_deg": float(of.angle[of.worst]),
            "reliability": of.reliability.tolist(),
            "low": of.low.tolist(),
            "high": of.high.tolist(),
            "at_cap": of.capped.tolist(),
            "mean": of.mean.tolist(),
            "deviation": of.deviation.tolist(),
            "within": of.within.tolist(),
            "within_low": of.within_low.tolist(),
            "within_high": of.within_high.tolist(),
        }
        for label, of in zip(labels, (found.a, found.b), strict=True)
    }
    return {
        "verdict": found.verdict,
        "unit": unit_of(name),
        "lower_limit": found.a.limits.lower,
        "upper_limit": found.a.limits.upper,
        "cap": found.a.cap,
        "angle_deg": found.a.angle.tolist(),
        "cycles": found.a.cycles.tolist(),
        "difference": found.minimum,
        "half_width_sampling": found.sampling,
        "half_width_numerical": found.numerical,
        "half_width_quadrature": found.quadrature,
        "half_width": found.half_width,
        "differences": found.curve.tolist(),
        "half_widths": found.curve_half_width.tolist(),
        "models": models,
    }


def _impacts(impacts: Impacts) -> dict[str, Any]:
    numbers = {field.name: getattr(impacts, field.name) for field in fields(impacts) if field.name != "pairs"}
    return {"matched": len(impacts.pairs), **numbers}
