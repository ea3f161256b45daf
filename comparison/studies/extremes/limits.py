"""Limits with a known answer, and the rates at which both models come to them."""

from __future__ import annotations

from dataclasses import dataclass

from comparison.execution.run import Progress, run_all
from comparison.studies.extremes import clearance_limit, elastic_limit, speed_limit, stiffness_limit


@dataclass(frozen=True)
class Found:
    """The rows of each limit."""

    clearance: list[clearance_limit.Row]
    stiffness: list[stiffness_limit.Row]
    elastic: list[elastic_limit.Row]
    speed: list[speed_limit.Row]


def measured(n_jobs: int, on_progress: Progress | None) -> Found:
    """Run all four limits."""
    parts = [part.jobs() for part in (clearance_limit, stiffness_limit, elastic_limit, speed_limit)]
    outcomes = iter(run_all([job for part in parts for job in part], n_jobs, on_progress))
    clearance, stiffness, elastic, speed = ([next(outcomes) for _ in part] for part in parts)
    return Found(
        clearance_limit.rows(clearance),
        stiffness_limit.rows(stiffness),
        elastic_limit.rows(elastic),
        speed_limit.rows(speed),
    )


def text(found: Found) -> str:
    """Return the four limits, each under a heading of third order."""
    return "\n\n".join(
        (
            f"### Clearance to 0\n\n{clearance_limit.text(found.clearance)}",
            f"### Stiffness to infinity\n\n{stiffness_limit.text(found.stiffness)}",
            f"### Nothing lost\n\n{elastic_limit.text(found.elastic)}",
            f"### Speed to 0\n\n{speed_limit.text(found.speed)}",
        )
    )
