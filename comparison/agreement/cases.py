"""Single findings that pass or fail, for continuous integration: test cases in the sense of JUnit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from comparison.agreement.results import SceneComparison

Status = Literal["passed", "failed", "skipped", "error"]
_STATUS: dict[str, Status] = {
    "agree": "passed",
    "differ": "failed",
    "indeterminate": "skipped",
    "unexcited": "skipped",
    "cannot compare": "error",
}


@dataclass(frozen=True)
class Case:
    """Result of one check.

    Attributes
    ----------
    suite
        The scene.
    group
        What was checked, within the scene: a tier, or a model and its tier.
    name
        The channel, or another checked item.
    status
        "skipped" if no conclusion is possible, "error" if there was nothing to check.
    message
        One line.
    """

    suite: str
    group: str
    name: str
    status: Status
    message: str = ""


def of_comparisons(comparisons: Sequence[SceneComparison]) -> list[Case]:
    """Return the verdict of each scene and tier, followed by those of its channels."""
    return [
        case
        for comparison in comparisons
        for tier in comparison.tiers
        for case in (
            Case(
                comparison.name, tier.tier, "verdict", _STATUS[tier.verdict], _message(tier.verdict, tier.why)
            ),
            *(
                Case(
                    comparison.name,
                    tier.tier,
                    name,
                    _STATUS[channel.verdict],
                    _message(channel.verdict, channel.reason),
                )
                for name, channel in tier.channels.items()
            ),
        )
    ]


def _message(verdict: str, why: str) -> str:
    return f"{verdict}: {why}"
