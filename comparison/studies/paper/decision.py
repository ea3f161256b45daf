"""What evidence says of a statement."""

from __future__ import annotations

from dataclasses import dataclass

from comparison.formatting import NO_BREAK, number

SUPPORTED, CONTRADICTED, UNDECIDED = "supported", "contradicted", "undecided"


@dataclass(frozen=True)
class Decision:
    """A verdict and the numbers that it rests on, in words."""

    verdict: str
    evidence: str


def per_cent(share: float) -> str:
    """Return a share with two significant digits."""
    return f"{number(100 * share, 2)}{NO_BREAK}%"


def decide(value: float, low: float, high: float, evidence: str) -> Decision:
    """Return supported from ``high`` on, contradicted up to ``low``, and undecided between."""
    if value >= high:
        return Decision(SUPPORTED, evidence)
    return Decision(CONTRADICTED if value <= low else UNDECIDED, evidence)
