"""Common similarity measures of a channel, for information only."""

from __future__ import annotations

from comparison.metrics.iso18571 import MOST_POINTS, rating
from comparison.metrics.norms import resampled, sprague_geers, tube_share
from comparison.tables.arrays import Array


def information(time: Array, a: Array, b: Array, *, position: bool) -> dict[str, float]:
    """Measure b against a, on at most 5,000 points.

    Parameters
    ----------
    time
        Increasing, s, shape (n,), n >= 2.
    a, b
        In one unit, shape (n,).
    position
        Whether the channel is a position: its zero is arbitrary (the slider moves by 0.2 mm at x = -0.55 m),
        so both are measured from the mean of the two. Forces, rates and gaps have a zero of their own.

    Returns
    -------
    measures
        `comparison.metrics.norms.sprague_geers`, the scores of `comparison.metrics.iso18571.rating` and
        `comparison.metrics.norms.tube_share`; nan where one is undefined.

    Notes
    -----
    A longer table is resampled without a filter, so that some impacts shorter than the new interval are
    missed: for force channels these measures are of little use. They are those of the samples: of impacts the
    scores change by some percent with the sampling, whose nine samples smooth the slope.
    """
    grid, (first, second) = resampled(time, (a, b), MOST_POINTS)
    if position:
        middle = (first.mean() + second.mean()) / 2
        first, second = first - middle, second - middle
    errors, scores = sprague_geers(grid, first, second), rating(first, second)
    return {
        "sprague_geers_magnitude": errors.magnitude,
        "sprague_geers_phase": errors.phase,
        "sprague_geers_combined": errors.combined,
        "iso18571": scores.overall,
        "iso18571_corridor": scores.corridor,
        "iso18571_phase": scores.phase,
        "iso18571_magnitude": scores.magnitude,
        "iso18571_slope": scores.slope,
        "tube_share": tube_share(grid, first, second),
    }
