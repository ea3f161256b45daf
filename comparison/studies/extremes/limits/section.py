"""The section of the page about all limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from comparison.studies.extremes.limits import clearance, convergence, figures, lossless, speed, stiffness
from comparison.studies.extremes.limits.convergence import Limit
from comparison.studies.shared.study import Study

LIMITS = (clearance.LIMIT, stiffness.LIMIT, lossless.LIMIT, speed.LIMIT)


def page(found: Sequence[tuple[Limit, pd.DataFrame]]) -> Mapping[str, object]:
    """Return what stands in the template."""
    return {key: value for each in found for key, value in convergence.values(*each).items()}


def draw(found: Sequence[tuple[Limit, pd.DataFrame]], folder: Path) -> None:
    """Write a figure for each limit."""
    for limit, frame in found:
        figures.draw(limit, frame, folder)


STUDY = Study("extremes.limits", LIMITS, LIMITS, convergence.measured, page, draw)
"""Its runs are few and short: it has no smaller form."""
