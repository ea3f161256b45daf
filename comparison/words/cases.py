"""Single findings that pass or fail, for continuous integration: test cases in the sense of JUnit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from comparison.verdict.results import SceneComparison
from comparison.words.verdicts import reason, why

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
    """Result of one check; "skipped" if no conclusion is possible, "error" if there was nothing to check."""

    suite: str  # the scene
    group: str  # a tier, or a model and its tier
    name: str  # the channel, or another checked item
    status: Status
    message: str = ""


def of_comparisons(comparisons: Sequence[SceneComparison]) -> list[Case]:
    """Return the verdict of each scene and tier, followed by those of its channels."""
    return [
        Case(comparison.name, tier.tier, name, _STATUS[verdict], f"{verdict}: {text}")
        for comparison in comparisons
        for tier in comparison.tiers
        for name, verdict, text in [
            ("verdict", tier.verdict, why(tier)),
            *((name, channel.verdict, reason(channel)) for name, channel in tier.channels.items()),
        ]
    ]
