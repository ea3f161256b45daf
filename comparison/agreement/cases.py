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
                comparison.name,
                tier.tier,
                "verdict",
                _STATUS[tier.verdict],
                _message(tier.verdict, why(tier)),
            ),
            *(
                Case(
                    comparison.name,
                    tier.tier,
                    name,
                    _STATUS[channel.verdict],
                    _message(channel.verdict, reason(channel)),
                )
                for name, channel in tier.channels.items()
            ),
        )
    ]


def _message(verdict: str, text: str) -> str:
    return f"{verdict}: {text}"
