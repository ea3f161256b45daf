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
    cases = []
    for comparison in comparisons:
        for tier in comparison.tiers:
            findings = [("verdict", tier.verdict, why(tier))]
            findings += [(name, channel.verdict, reason(channel)) for name, channel in tier.channels.items()]
            cases += [
                Case(comparison.name, tier.tier, name, _STATUS[verdict], f"{verdict}: {text}")
                for name, verdict, text in findings
            ]
    return cases
