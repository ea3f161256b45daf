"""Texts of a scene's reliability: a line for the terminal, sentences for the report."""

from __future__ import annotations

import numpy as np

from comparison.reliability.assessment import Assessment
from comparison.reliability.difference import Difference, ReliabilityComparison
from comparison.reliability.errors import unit_of
from comparison.reliability.interference import ROUNDING
from comparison.reliability.sampling import ENOUGH


def line(comparison: ReliabilityComparison) -> str:
    """Return verdict, smallest reliability of each quantity and the largest difference of the models."""
    if not comparison.quantities:
        return f"not available: {comparison.missing}"
    smallest = [_smallest(name, difference) for name, difference in comparison.quantities.items()]
    worst = max(comparison.quantities.values(), key=lambda difference: abs(difference.minimum))
    return (
        f"{comparison.verdict}: smallest of {', '.join(smallest)}; largest difference "
        f"{abs(worst.minimum):.1e} ± {worst.half_width:.1e}"
    )


def rounded(value: float) -> str:
    """Return a reliability with five digits as the paper prints it, with seven from 0.99 on."""
    return f"{value:.5f}" if value < 0.99 else f"{value:.7f}"


def notes(comparison: ReliabilityComparison) -> list[str]:
    """Return the notes on this scene's numbers: limits, cap, samples."""
    if not comparison.quantities:
        return [f"Not available: {comparison.missing}."]
    settings, found = comparison.settings, comparison.quantities
    of_what = "size of the error" if settings.errors == "absolute" else "signed error"
    limits = ", ".join(_limits(name, of.a) for name, of in found.items())
    return [
        f"Mean and deviation over time of the {of_what} in each of {settings.bins} intervals of the crank "
        "cycle, against limits: "
        f"{limits}.",
        _of_cap(found),
        _of_sampling(next(iter(found.values())).a),
    ]


def _smallest(name: str, difference: Difference) -> str:
    a, b = difference.a, difference.b
    values = " and ".join(dict.fromkeys(rounded(of.minimum) for of in (a, b)))
    angles = " and ".join(dict.fromkeys(f"{of.angle[of.worst]:g}" for of in (a, b)))
    if a.capped[a.worst] and b.capped[b.worst]:
        return f"{name} {values} (the cap)"
    return f"{name} {values} at {angles} deg"


def _limits(name: str, of: Assessment) -> str:
    lower = f"{of.limits.lower:g} to " if of.limits.lower else ""
    return f"{name} {lower}{of.limits.upper:g} {unit_of(name)}"


def _of_cap(found: dict[str, Difference]) -> str:
    capped = {name: int(np.sum(of.a.capped & of.b.capped)) for name, of in found.items()}
    counted = [f"{name} in {n} of {found[name].a.angle.size} parts" for name, n in capped.items() if n]
    values = " or ".join(dict.fromkeys(f"{of.a.cap:.10f}" for of in found.values()))
    capped_parts = "; ".join(counted) if counted else "none"
    return (
        f"Without any error R is {values}, the cap. Within {ROUNDING:g} of it, where R shows nothing of the "
        f"mechanism but that the limit is wide: {capped_parts}."
    )


def _of_sampling(of: Assessment) -> str:
    cycles = int(of.cycles.max())
    if cycles == 1:
        return (
            "Of one cycle nothing is known about others: for the intervals, what varies within a part of the "
            "cycle is taken for what varies between cycles."
        )
    few = "" if cycles >= ENOUGH else ", few for an interval, and the first one still remembers its start"
    return f"Cycles sampled: {cycles}{few}."
