"""Sentences about the reliability of a scene, for terminal and report, and of tables."""

from collections.abc import Mapping, Sequence

import numpy as np

from comparison.execution.run import RunError
from comparison.formatting import quantity
from comparison.reliability.assessment import MARGIN, ROUNDING, Assessment, Difference, ReliabilityComparison
from comparison.reliability.errors import MANY, QUANTITIES
from comparison.reliability.tables import TableReliability
from comparison.scene import Reliability
from comparison.scene.linkage import LinkageReliability


def format_reliability(value: float) -> str:
    """Return a reliability with five digits as the paper prints it, with seven from 0.99 on."""
    return f"{value:.5f}" if value < 0.99 else f"{value:.7f}"


def missing_reason(comparison: ReliabilityComparison) -> str:
    """Return in one line the reason why there is no comparison; empty where there is one."""
    why = comparison.missing
    if isinstance(why, RunError):
        return f"a run failed: {why}"
    if why is None:
        return "" if comparison.quantities else "the drive has no period, which only drive.speed_rpm gives"
    return str(why)


def line(comparison: ReliabilityComparison) -> str:
    """Return verdict, smallest reliability of each quantity and the largest difference of the models."""
    if not comparison.quantities:
        return f"not available: {missing_reason(comparison)}"
    smallest = [_smallest_text(name, difference) for name, difference in comparison.quantities.items()]
    largest = max(comparison.quantities.values(), key=lambda difference: abs(difference.minimum))
    finite = np.isfinite(largest.half_width)
    uncertainty = f"± {largest.half_width:.1e}" if finite else "of unknown uncertainty"
    return (
        f"{comparison.verdict}: smallest of {', '.join(smallest)}; "
        f"largest difference {abs(largest.minimum):.1e} {uncertainty}"
        f"{f'; {why}' if (why := undecided_reasons(comparison)) else ''}"
    )


def undecided_reasons(comparison: ReliabilityComparison) -> str:
    """Return the reach of the interval of each undecided difference, and its main cause."""
    reasons = []
    for name, case in comparison.quantities.items():
        excess = abs(case.minimum) + case.half_width - MARGIN
        cause = "scatter of cycles" if case.sampling >= case.numerical else "numerics"
        text = f"the difference of {name}, {case.minimum:.1e} ± {case.half_width:.1e} (mostly {cause}), "
        text += f"includes zero and reaches {excess:.1e} beyond {MARGIN:g}"
        text = text if np.isfinite(excess) else f"the numerical error of {name} is not known"
        reasons += [text] if case.verdict == "undecided" else []
    return "; ".join(reasons)


def limit(assessment: Assessment) -> str:
    """Return the limits of an error, with "by default" if no scene states them."""
    lower = f"{quantity(assessment.limits.lower, assessment.unit)} to " if assessment.limits.lower else "≤ "
    default = "" if "upper" in assessment.limits.model_fields_set else "by default "
    return f"{default}{lower}{quantity(assessment.limits.upper, assessment.unit)}"


def notes(comparison: ReliabilityComparison) -> list[str]:
    """Return the notes on this scene's numbers: limits, cap, cycles."""
    if not comparison.quantities:
        return [f"Not available: {missing_reason(comparison)}."]
    lines = _notes(comparison.settings, {name: (d.a, d.b) for name, d in comparison.quantities.items()})
    if isinstance(comparison.settings, LinkageReliability):
        names = ", ".join(comparison.settings.channels.values())
        lines.insert(0, f"Errors of {names}, against the same linkage without clearance.")
    return [f"Undecided: {why}.", *lines] if (why := undecided_reasons(comparison)) else lines


def _notes(settings: Reliability, quantities: Mapping[str, Sequence[Assessment]]) -> list[str]:
    size = "size of the error" if settings.errors == "absolute" else "signed error"
    limits, caps_reached = [], []
    for name, tables in quantities.items():
        count = int(np.sum(np.all([assessment.capped for assessment in tables], axis=0)))
        limits.append(f"{name} {limit(tables[0])}")
        caps_reached += [f"{name} in {count} of {tables[0].angle.size} parts"] if count else []
    caps = " or ".join(dict.fromkeys(f"{tables[0].cap:.10f}" for tables in quantities.values()))
    cycles = int(next(iter(quantities.values()))[0].cycles.max())
    few = "" if cycles >= MANY else ", few for an interval, and the first one still remembers its start"
    cycle_note = f"Cycles sampled: {cycles}{few}."
    if cycles == 1:
        cycle_note = (
            "Of one cycle nothing is known about others: for the intervals, the variation within a part of "
            "the cycle stands for that between cycles."
        )
    return [
        f"Mean and deviation over time of the {size} in each of {settings.bins} intervals of the crank "
        f"cycle, against limits: {', '.join(limits)}.",
        f"Without any error R is {caps}, the cap. Within {ROUNDING:g} of it, where R shows nothing of the "
        f"mechanism but that the limit is wide: {'; '.join(caps_reached) or 'none'}.",
        cycle_note,
    ]


def _smallest_text(name: str, difference: Difference) -> str:
    a, b, name = difference.a, difference.b, f"{name} ({limit(difference.a)})"
    values = " and ".join(dict.fromkeys(format_reliability(model.minimum) for model in (a, b)))
    if a.capped[a.worst] and b.capped[b.worst]:
        return f"{name} {values} (the cap)"
    angles = " and ".join(dict.fromkeys(f"{model.angle[model.worst]:g}" for model in (a, b)))
    return f"{name} {values} at {angles} deg"


def table_rows(result: TableReliability, *, every: bool) -> list[tuple[str, ...]]:
    """Return a heading and, by quantity and table, the smallest reliability, or that at every angle."""
    head = ("by crank angle", "to deg") if every else ("smallest", "at deg")
    rows: list[tuple[str, ...]] = [(*head, "R", "95 % from", "to", "mean error", "deviation")]
    for name, tables in result.by_quantity.items():
        for label, assessment in tables.items():
            rows += [
                (
                    f"{name} {label}",
                    f"{assessment.angle[k]:g}",
                    format_reliability(assessment.reliability[k]),
                    format_reliability(assessment.low[k]),
                    format_reliability(assessment.high[k]),
                    f"{assessment.mean[k]:.3g} {assessment.unit}",
                    f"{assessment.deviation[k]:.3g}",
                )
                for k in (range(assessment.angle.size) if every else [assessment.worst])
            ]
    return rows


def difference_rows(comparison: ReliabilityComparison) -> list[tuple[str, ...]]:
    """Return a heading and, by quantity, the difference of the smallest reliabilities of two tables."""
    return [
        ("a less b", "R", "±", "verdict"),
        *(
            (name, f"{case.minimum:.1e}", f"{np.linalg.norm(_half_widths(case)):.1e}", case.verdict)
            for name, case in comparison.quantities.items()
        ),
    ]


def table_notes(result: TableReliability) -> list[str]:
    """Return notes: meaning of the verdicts, missing quantities, basis of the numbers."""
    lines = []
    if result.comparison:
        lines.append(
            "Differ: the interval of the difference excludes zero. Agree: it holds zero and is within "
            f"{MARGIN:g}. Undecided: it holds zero and reaches further, or is not known in full."
        )
        lines += [f"Undecided: {why}."] if (why := undecided_reasons(result.comparison)) else []
        if any(len(_half_widths(case)) < 2 for case in result.comparison.quantities.values()):
            lines.append(
                "± holds what other cycles leave open, not the numerical error of the tables: "
                "that is known from finer runs of both (--finer-a, --finer-b)."
            )
    for name, tables in result.missing.items():
        lines.append(f"Not computed: {name}, where {QUANTITIES[name]} is missing: {', '.join(tables)}.")
    limits = f"The limits are those of scene {result.source!r}"
    if result.given:
        limits += f", except of {' and '.join(result.given)}, as given"
    by_quantity = {name: list(tables.values()) for name, tables in result.by_quantity.items()}
    lines += _notes(result.settings, by_quantity) if by_quantity else []
    return [*lines, f"{limits}. The crank cycle takes {result.period:g} s."]


def _half_widths(difference: Difference) -> list[float]:
    return [part for part in (difference.sampling, difference.numerical) if np.isfinite(part)]
