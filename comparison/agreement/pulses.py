"""Contact forces resolved in time, of both models in all scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from comparison.metrics.contacts import Pulse, noted

if TYPE_CHECKING:
    from comparison.agreement.cross_check import Validation

Pulses = Mapping[tuple[str, str], tuple[Sequence[Pulse], Sequence[Pulse]]]
"""By scene and tier, of either model."""


def resolved(results: Sequence[Validation]) -> Pulses:
    """Return the resolved contacts of both models; those whose runs failed have none."""
    pulses = {}
    for result in results:
        runs = {"standard": result.runs, "tight": result.tight_runs}
        for tier in result.comparison.tiers:
            a, b = (noted(run.base) if (run := runs[tier.tier].get(label)) else [] for label in tier.labels)
            pulses[result.comparison.name, tier.tier] = a, b
    return pulses
