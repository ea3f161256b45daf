"""Sentences about a scene's reliability: a line for the terminal, notes for the report."""

import numpy as np

from comparison.execution.run import describe
from comparison.reliability.assessment import ROUNDING
from comparison.reliability.averages import ENOUGH
from comparison.reliability.difference import Difference, FailedRun, ReliabilityComparison
from comparison.reliability.errors import unit_of


def rounded(value: float) -> str:
    """Return a reliability with five digits as the paper prints it, with seven from 0.99 on."""
    return f"{value:.5f}" if value < 0.99 else f"{value:.7f}"


def missing(comparison: ReliabilityComparison) -> str:
    """Return what prevented the comparison, in one line; empty where nothing did."""
    why = comparison.missing
    if isinstance(why, FailedRun):
        return f"a run failed: {describe(why.job, why.outcome)}"
    return "" if why is None else str(why)


def line(comparison: ReliabilityComparison) -> str:
    """Return verdict, smallest reliability of each quantity and the largest difference of the models."""
    if not comparison.quantities:
        return f"not available: {missing(comparison)}"
    smallest = [_smallest(name, difference) for name, difference in comparison.quantities.items()]
    largest = max(comparison.quantities.values(), key=lambda difference: abs(difference.minimum))
    known = np.isfinite(largest.half_width)
    uncertainty = f"± {largest.half_width:.1e}" if known else "of unknown uncertainty"
    return (
        f"{comparison.verdict}: smallest of {', '.join(smallest)}; "
        f"largest difference {abs(largest.minimum):.1e} {uncertainty}"
    )


def notes(comparison: ReliabilityComparison) -> list[str]:
    """Return the notes on this scene's numbers: limits, cap, cycles."""
    if not comparison.quantities:
        return [f"Not available: {missing(comparison)}."]
    settings, quantities = comparison.settings, comparison.quantities
    size = "size of the error" if settings.errors == "absolute" else "signed error"
    limits, capped = [], []
    for name, both in quantities.items():
        limit, count = both.a.limits, int(np.sum(both.a.capped & both.b.capped))
        lower = f"{limit.lower:g} to " if limit.lower else ""
        limits.append(f"{name} {lower}{limit.upper:g} {unit_of(name)}")
        capped += [f"{name} in {count} of {both.a.angle.size} parts"] if count else []
    caps = " or ".join(dict.fromkeys(f"{both.a.cap:.10f}" for both in quantities.values()))
    cycles = int(next(iter(quantities.values())).a.cycles.max())
    few = "" if cycles >= ENOUGH else ", few for an interval, and the first one still remembers its start"
    sampled = f"Cycles sampled: {cycles}{few}."
    if cycles == 1:
        sampled = (
            "Of one cycle nothing is known about others: for the intervals, what varies within a part of the "
            "cycle is taken for what varies between cycles."
        )
    return [
        f"Mean and deviation over time of the {size} in each of {settings.bins} intervals of the crank "
        f"cycle, against limits: {', '.join(limits)}.",
        f"Without any error R is {caps}, the cap. Within {ROUNDING:g} of it, where R shows nothing of the "
        f"mechanism but that the limit is wide: {'; '.join(capped) or 'none'}.",
        sampled,
    ]


def _smallest(name: str, difference: Difference) -> str:
    a, b = difference.a, difference.b
    values = " and ".join(dict.fromkeys(rounded(model.minimum) for model in (a, b)))
    if a.capped[a.worst] and b.capped[b.worst]:
        return f"{name} {values} (the cap)"
    angles = " and ".join(dict.fromkeys(f"{model.angle[model.worst]:g}" for model in (a, b)))
    return f"{name} {values} at {angles} deg"
