"""Tables of the study's page: comparisons without a fault, and the variants of rounding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from comparison.accuracy.levels import TIERS
from comparison.formatting import MISSING
from comparison.studies.detection import rounding
from comparison.studies.detection.rates import confirmation_of, count, interval, share
from comparison.studies.detection.results import Results, pooled
from comparison.studies.detection.tasks import Found
from comparison.studies.shared.frames import rows_table
from comparison.tables.channels import channels


def both_table(results: Results) -> str:
    """Return the alarms of both models against each other: of each kind, and by variant of rounding."""
    rows = []
    for kind, by_rounding in results.both:
        groups = {"all": pooled(by_rounding)} | {variant.name: of for variant, of in by_rounding.items()}
        for name, found in groups.items():
            label = f"**{kind.label}**" if name == "all" else ""
            rows.append({"comparison": label, "rounding": name} | _counted(found))
    return rows_table(rows)


def own_table(results: Results) -> str:
    """Return the alarms of each model against itself."""
    return rows_table(
        {"model against itself": kind.label, "crank cycles": span(kind.cycles)} | _counted(found)
        for kind, found in results.own
    )


def _counted(found: Sequence[Found]) -> dict[str, str]:
    counts = count(found)
    covered = [
        np.mean([c[1] for c in f["channels"].values() if c[0] != "unexcited"]) for f in found if f["channels"]
    ]
    quantiles = np.quantile(covered, (0.0, 0.1, 0.5)) if covered else []
    return {
        "draws": str(counts.draws),
        "indeterminate": f"{counts.indeterminate} ({share(counts.indeterminate / counts.draws)})",
        "decided": str(counts.decided),
        "of these agree with a corrected uncertainty": str(counts.underestimated),
        "false alarms": str(counts.alarms),
        "rate, 95 % interval": between(interval(counts.alarms, counts.decided)),
        "upper limit, 95 %": share(counts.upper_limit),
        "samples predictable: least, tenth, median draw": ", ".join(f"{value:.0%}" for value in quantiles)
        or MISSING,
    }


def alarm_list(results: Results) -> str:
    """Return one line an alarm, and one an agreement by a corrected uncertainty."""
    groups = [
        (f"{kind.label}, {variant.name}", found)
        for kind, by_rounding in results.both
        for variant, found in by_rounding.items()
    ] + [(kind.label, found) for kind, found in results.own]
    lines = []
    for place, all_found in groups:
        for draw, found in enumerate(all_found):
            if found["verdict"] not in ("agree", "indeterminate") or confirmation_of(found):
                scene = f" ({found['scene']})" if found.get("scene") else ""
                why = confirmation_of(found).get("sentence") or found["reason"]
                lines.append(f"- {place}, draw {draw}{scene}: {found['verdict']}: {why}.")
    return "\n".join(lines) or "There was none."


def channel_table(results: Results) -> str:
    """Return the alarms by channel: a draw that is open as a whole raises none."""
    rows = []
    for name in channels():
        verdicts = {
            label: Counter((f["verdict"], f["channels"][name][0]) for f in found if name in f["channels"])
            for label, found in results.without_fault
        }
        if any(verdicts.values()):
            cells = {}
            for label, counts in verdicts.items():
                judged = sum(n for (_, of), n in counts.items() if of in ("agree", "differ"))
                cells[label] = f"{counts['differ', 'differ']} of {judged}"
            rows.append({"channel": name} | cells)
    return rows_table(rows)


def rounding_table(results: Results) -> str:
    """Return the first digits of the hashes by variant, and at which tiers it counts."""
    counted = {tier: rounding.effective(results.bits, tier) for tier in TIERS}
    return rows_table(
        {
            "variant": variant.name,
            "environment": " ".join(f"`{name}={value}`" for name, value in variant.environment) or "nothing",
            "copies": "yes" if variant.engines else "no",
            **{", ".join(place): bits[:8] for place, bits in zip(rounding.PLACES, all_bits, strict=True)},
            "counts at the tiers": ", ".join(t for t in TIERS if variant in counted[t]) or "nowhere",
        }
        for variant, all_bits in results.bits.items()
    )


def between(bounds: tuple[float, float]) -> str:
    """Return an interval of a rate as percent."""
    return " to ".join(share(bound) for bound in bounds)


def span(bounds: tuple[float, float], factor: float = 1.0) -> str:
    """Return an interval of numbers, or the one that both ends are."""
    low, high = (f"{bound * factor:g}" for bound in bounds)
    return low if low == high else f"{low} to {high}"
