"""All that the study measures, and what of it is kept for a baseline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from comparison.accuracy.levels import thresholds_record
from comparison.models import platform_name, versions
from comparison.studies.detection import alarms, cross_model, limits, rounding
from comparison.studies.detection.faults import Trial
from comparison.studies.detection.rates import confirmation_of, count, interval
from comparison.studies.detection.tasks import Found

ByRounding = Mapping[rounding.Rounding, Sequence[Found]]


@dataclass(frozen=True)
class Results:
    """What was found."""

    both: Sequence[tuple[cross_model.Kind, ByRounding]]
    """Of both models against each other: by kind and variant of rounding, in the order of the draws."""
    own: Sequence[tuple[alarms.Kind, Sequence[Found]]]
    """Of each model against itself."""
    bits: Mapping[rounding.Rounding, tuple[str, ...]]
    """Hashes of tables by variant of rounding, see `rounding.hashes`."""
    healthy: Sequence[Found]
    """Of the catalogue's scenes without a fault."""
    faults: Sequence[tuple[Trial, Found]]
    smallest: Mapping[str, Sequence[Found]]
    """What the searches for the smallest change of each parameter found, one a place of `limits`."""

    @property
    def without_fault(self) -> list[tuple[str, list[Found]]]:
        """Each kind of comparison without a fault by its label, those of the main job first."""
        both = [(kind.label, pooled(by_rounding)) for kind, by_rounding in self.both]
        return both + [(kind.label, list(found)) for kind, found in self.own]

    @property
    def detections(self) -> dict[str, list[bool]]:
        """Tier -> whether each fault was detected, the tight tier first."""
        by_tier: dict[str, list[bool]] = {}
        for trial, found in self.faults:
            by_tier.setdefault(trial.tier, []).append(trial.detected(found))
        return dict(sorted(by_tier.items(), reverse=True))


def pooled(by_rounding: ByRounding) -> list[Found]:
    """Return what was found under all variants."""
    return [found for all_found in by_rounding.values() for found in all_found]


def record(results: Results) -> dict[str, Any]:
    """Return counts, verdicts, and changes with two digits, with the thresholds that they were measured with.

    The gate's baseline takes over the rates: see `comparison.regression.record`.
    """
    return {
        "machine": platform_name(),
        "versions": versions(),
        "thresholds": thresholds_record(),
        "false_alarms": {label: _counts(found) for label, found in results.without_fault},
        "detected": {
            tier: {
                "faults": len(detected),
                "detected": sum(detected),
                "interval_95": [round(bound, 4) for bound in interval(sum(detected), len(detected))],
            }
            for tier, detected in results.detections.items()
        },
        "rounding": {
            variant.name: {
                "environment": dict(variant.environment),
                "tables": dict(zip(map(", ".join, rounding.PLACES), all_bits, strict=True)),
            }
            | {kind.label: _counts(found[variant]) for kind, found in results.both if variant in found}
            for variant, all_bits in results.bits.items()
        },
        "faults": [
            {
                "fault": trial.fault.name,
                "kind": trial.fault.kind,
                "model": trial.model,
                "tier": trial.tier,
                "verdict": found["verdict"],
                "detected": trial.detected(found),
                "confirmation": confirmation_of(found).get("outcome"),
                "first": None if found["first"] is None else found["first"]["channel"],
            }
            for trial, found in results.faults
        ],
        "smallest_change": {
            name: {
                ", ".join(place): None if found["found"] is None else float(f"{found['found']:.2g}")
                for place, found in zip(limits.PLACES, row, strict=True)
            }
            for name, row in results.smallest.items()
        },
    }


def _counts(found: Sequence[Found]) -> dict[str, float]:
    counts = count(found)
    return {
        "draws": counts.draws,
        "decided": counts.decided,
        "underestimated": counts.underestimated,
        "alarms": counts.alarms,
        "upper_limit_95": round(counts.upper_limit, 5),
    }
