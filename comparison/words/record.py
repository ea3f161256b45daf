"""A comparison as a mapping: all results without curves, for JSON."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import Any

from comparison.metrics.contacts import Impacts
from comparison.reliability.difference import Difference, ReliabilityComparison
from comparison.reliability.errors import unit_of
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words import differences
from comparison.words import verdicts as words
from comparison.words.reliability import missing

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
    "worst_size",
    "worst_threshold",
    "time_tolerance",
    "outside",
)


_OF_MODEL = (
    "reliability",
    "low",
    "high",
    "capped",
    "mean",
    "deviation",
    "within",
    "within_low",
    "within_high",
)


def as_mapping(comparison: SceneComparison) -> dict[str, Any]:
    """Return all results without curves, for JSON; undefined numbers are nan (written as null)."""
    labels, decisive, impacts = comparison.labels, comparison.decisive, comparison.impacts
    attribution = None
    if comparison.channels:
        attribution = asdict(comparison.attribution)
        attribution["sentences"] = differences.attribution_lines(comparison)
    return {
        "name": comparison.name,
        "tier": comparison.tier,
        "refined": comparison.refined,
        "title": comparison.title,
        "verdict": comparison.verdict,
        "reason": words.scene_reason(comparison),
        "decisive_channel": decisive and decisive.channel,
        "ratio": decisive and decisive.ratio,
        "warnings": list(comparison.warnings),
        "labels": list(labels),
        "samples": int(comparison.time.size),
        "time_shift": comparison.shift and vars(comparison.shift),
        "command": comparison.command,
        "situations": dict(zip(labels, comparison.situations, strict=True)),
        "crank_pin_contact": dict(zip(labels, comparison.pin_contact, strict=True)),
        "confirmation": confirmation_record(comparison),
        "attribution": attribution,
        "impacts": impacts and {part: _impacts(found) for part, found in impacts.items()},
        "reliability": comparison.reliability and _reliability(comparison.reliability, labels),
        "channels": {name: _channel(channel) for name, channel in comparison.channels.items()},
        "provenance": comparison.provenance,
        "tight": comparison.tight and as_mapping(comparison.tight),
    }


def confirmation_record(comparison: SceneComparison) -> dict[str, Any] | None:
    """Return the confirmation of a verdict "differ" with its sentence; None where there was none."""
    result = comparison.confirmation
    if result is None:
        return None
    numbers = {
        key: value for key, value in asdict(result).items() if key not in ("doubt", "parting", "parted")
    }
    sentences = {"contact": differences.parting(result), "sentence": differences.confirmation(comparison)}
    return numbers | {"suspicious": result.suspicious} | sentences


def _channel(channel: ChannelComparison) -> dict[str, Any]:
    return {
        "verdict": channel.verdict,
        "reason": words.reason(channel),
        "unit": channel.unit,
        "scale": channel.scale,
        **{name: getattr(channel, name) for name in _NUMBERS},
        "information": dict(channel.metrics),
        "gate": [asdict(check) | {"met": check.met} for check in channel.checks],
    }


def _reliability(comparison: ReliabilityComparison, labels: tuple[str, str]) -> dict[str, Any]:
    return {
        "verdict": comparison.verdict,
        "missing": missing(comparison),
        "bins": comparison.settings.bins,
        "errors": comparison.settings.errors,
        "quantities": {
            name: _quantity(name, difference, labels) for name, difference in comparison.quantities.items()
        },
    }


def _quantity(name: str, difference: Difference, labels: tuple[str, str]) -> dict[str, Any]:
    models = {
        label: {
            "smallest": model.minimum,
            "smallest_interval": list(model.interval),
            "smallest_at_deg": float(model.angle[model.worst]),
            **{"at_cap" if key == "capped" else key: getattr(model, key).tolist() for key in _OF_MODEL},
        }
        for label, model in zip(labels, (difference.a, difference.b), strict=True)
    }
    return {
        "verdict": difference.verdict,
        "unit": unit_of(name),
        "lower_limit": difference.a.limits.lower,
        "upper_limit": difference.a.limits.upper,
        "cap": difference.a.cap,
        "angle_deg": difference.a.angle.tolist(),
        "cycles": difference.a.cycles.tolist(),
        "difference": difference.minimum,
        "half_width_sampling": difference.sampling,
        "half_width_numerical": difference.numerical,
        "half_width_quadrature": difference.quadrature,
        "half_width": difference.half_width,
        "differences": difference.curve.tolist(),
        "half_widths": difference.curve_half_width.tolist(),
        "models": models,
    }


def _impacts(impacts: Impacts) -> dict[str, Any]:
    numbers = {field.name: getattr(impacts, field.name) for field in fields(impacts) if field.name != "pairs"}
    return {"matched": len(impacts.pairs), **numbers}
