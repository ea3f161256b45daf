"""Tables of the study's page: comparisons without a fault, and the variants of rounding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from comparison.accuracy.tiers import TIERS
from comparison.formatting import MISSING, table
from comparison.studies.detection import rounding
from comparison.studies.detection.rates import count, interval, share
from comparison.studies.detection.results import Results, pooled
from comparison.studies.detection.tasks import Found
from comparison.tables.channels import channels

_COUNTED = (
    "draws",
    "indeterminate",
    "decided",
    "of these agree with a corrected uncertainty",
    "false alarms",
    "rate, 95 % interval",
    "upper limit, 95 %",
    "samples predictable: least, tenth, median draw",
)


def both_table(results: Results) -> str:
    """Return the alarms of both models against each other: of each kind, and by variant of rounding."""
    rows = []
    for kind, by_rounding in results.both:
        rows.append([f"**{kind.label}**", "all", *_cells(pooled(by_rounding))])
        rows += [["", variant.name, *_cells(found)] for variant, found in by_rounding.items()]
    return table(("comparison", "rounding", *_COUNTED), rows)


def own_table(results: Results) -> str:
    """Return the alarms of each model against itself."""
    rows = [[kind.label, span(kind.cycles), *_cells(found)] for kind, found in results.own]
    return table(("model against itself", "crank cycles", *_COUNTED), rows)


def _cells(found: Sequence[Found]) -> list[str]:
    counts = count(found)
    covered = [
        np.mean([c[1] for c in f["channels"].values() if c[0] != "unexcited"]) for f in found if f["channels"]
    ]
    quantiles = np.quantile(covered, (0.0, 0.1, 0.5)) if covered else []
    return [
        str(counts.draws),
        f"{counts.indeterminate} ({share(counts.indeterminate / counts.draws)})",
        str(counts.decided),
        str(counts.underestimated),
        str(counts.alarms),
        between(interval(counts.alarms, counts.decided)),
        share(counts.upper_limit),
        ", ".join(f"{value:.0%}" for value in quantiles) or MISSING,
    ]


def alarm_list(results: Results) -> str:
    """Return one line an alarm, and one an agreement by a corrected uncertainty."""
    groups = [
        (f"{kind.label}, {variant.name}", found)
        for kind, by_rounding in results.both
        for variant, found in by_rounding.items()
    ] + [(kind.label, found) for kind, found in results.own]
    lines = [
        f"- {place}, draw {draw}{_scene(found)}: {found['verdict']}: {_why(found)}."
        for place, all_found in groups
        for draw, found in enumerate(all_found)
        if found["verdict"] not in ("agree", "indeterminate") or found.get("confirmation")
    ]
    return "\n".join(lines) if lines else "There was none."


def _scene(found: Found) -> str:
    return f" ({found['scene']})" if found.get("scene") else ""


def _why(found: Found) -> str:
    return str((found.get("confirmation") or {}).get("sentence") or found["reason"])


def channel_table(results: Results) -> str:
    """Return the alarms by channel."""
    kinds = results.without_fault
    rows = []
    for name in channels():
        verdicts = [
            Counter(f["channels"][name][0] for f in found if name in f["channels"]) for _, found in kinds
        ]
        if any(verdicts):
            rows.append([name, *(f"{v['differ']} of {v['differ'] + v['agree']}" for v in verdicts)])
    return table(("channel", *(label for label, _ in kinds)), rows)


def rounding_table(results: Results) -> str:
    """Return the first digits of the hashes by variant, and at which tiers it counts."""
    counted: Mapping[str, Sequence[rounding.Rounding]] = {
        tier: rounding.effective(results.bits, tier) for tier in TIERS
    }
    rows = [
        [
            variant.name,
            " ".join(f"`{name}={value}`" for name, value in variant.environment) or "nothing",
            "yes" if variant.engines else "no",
            *(bits[:8] for bits in all_bits),
            ", ".join(tier for tier in TIERS if variant in counted[tier]) or "nowhere",
        ]
        for variant, all_bits in results.bits.items()
    ]
    headings = ("variant", "environment", "copies", *(f"{model}, {tier}" for model, tier in rounding.PLACES))
    return table((*headings, "counts at the tiers"), rows)


def between(bounds: tuple[float, float]) -> str:
    """Return an interval of a rate as percent."""
    return " to ".join(share(bound) for bound in bounds)


def span(bounds: tuple[float, float], factor: float = 1.0) -> str:
    """Return an interval of numbers, or the one that both ends are."""
    low, high = (f"{bound * factor:g}" for bound in bounds)
    return low if low == high else f"{low} to {high}"
