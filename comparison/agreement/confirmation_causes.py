"""Size of an underestimated uncertainty, and the contact that causes a difference.

Where an ensemble splits into clusters, or spreads much farther than u, a discontinuous event decides: a
contact that occurs in some runs only. Causes are motion that grazes a wall, or a model that occasionally
misses a contact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from comparison.accuracy.uncertainty import ENSEMBLE_FACTOR, Runs
from comparison.agreement.results import ChannelComparison, SceneComparison
from comparison.metrics.outliers import Parting, clustered, parting_contact, split
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.table import Table

Ensembles = Mapping[int, Sequence[Table]]
"""Of the first model (0) and the second (1); of one that is too slow there is none."""


def judged_samples(channel: ChannelComparison) -> tuple[BoolArray, Array]:
    """Return the samples of a channel that decide, shape (n,), and u on these; it has an uncertainty.

    Where a channel differs although its predictable samples, too few, do not show it, all samples decide and
    the largest u of all times counts, as in `comparison.agreement.verdict`.
    """
    u = _u(channel)
    happens = (channel.a != 0) | (channel.b != 0)
    if channel.verdict == "differ" and np.isnan(channel.explained):
        return happens, np.full(int(happens.sum()), u.max())
    mask = happens & channel.predictable
    return mask, u[mask]


def underestimation(before: SceneComparison, after: SceneComparison) -> tuple[float, str]:
    """Return the largest factor of underestimation, and its channel.

    That is the ensembles' largest distance over u, at the samples at which the difference was outside k u.
    Elsewhere an ensemble may be wider without having made the difference; and of these samples the share
    that a verdict may leave unexplained does not count, such as one in which a contact begins.

    Parameters
    ----------
    before, after
        The comparison that differed, and the same by the ensembles' uncertainty.
    """
    factors = {}
    for name, channel in before.channels.items():
        if channel.verdict != "differ":
            continue
        mask, floor = judged_samples(channel)
        outside = np.abs(channel.difference[mask]) > channel.limits.k * floor
        ratio = _u(after.channels[name])[mask][outside] / (ENSEMBLE_FACTOR * floor[outside])
        factors[name] = float(np.quantile(ratio, channel.limits.share, method="lower"))
    worst = max(factors, key=lambda name: factors[name])
    return factors[worst], worst


def clusters(result: SceneComparison, ensembles: Ensembles) -> tuple[int, str, int] | None:
    """Return model, channel and first sample of an ensemble that splits into clusters; None if none does.

    Only positions and velocities are considered: a force jumps at either end of every contact, so a sample
    there separates runs that coincide afterwards. A channel's clusters count if they last for more samples
    than a verdict may leave unexplained.
    """
    found = []
    for side, tables in ensembles.items():
        for name, channel in result.channels.items():
            if channel.verdict == "unexcited" or channel.definition.follows is not None:
                continue
            mask, floor = judged_samples(channel)
            parted = clustered(np.array([table.values(name)[mask] for table in tables]), floor)
            if parted.sum() > (1.0 - channel.limits.share) * parted.size:
                found.append((int(np.flatnonzero(mask)[parted.argmax()]), side, name))
    if not found:
        return None
    sample, side, name = min(found)
    return side, name, sample


def farthest(
    name: str,
    before: SceneComparison,
    after: SceneComparison,
    runs: tuple[Runs, Runs],
    ensembles: Ensembles,
) -> tuple[int, str, int]:
    """Return model, channel and sample with the largest underestimation of a channel's uncertainty."""
    mask, floor = judged_samples(before.channels[name])
    sample = int(np.flatnonzero(mask)[(_u(after.channels[name])[mask] / floor).argmax()])
    width = {
        side: np.ptp([table.values(name)[sample] for table in (runs[side].base, *tables)])
        for side, tables in ensembles.items()
    }
    return max(width, key=lambda side: width[side]), name, sample


def within_ensemble(
    tables: Sequence[Table], name: str, sample: int, result: SceneComparison
) -> Parting | None:
    """Return the contact that separates one model's runs above the widest gap of a sample from the others."""
    above = split(np.array([table.values(name)[sample] for table in tables]))
    groups = [
        [table for table, high in zip(tables, above, strict=True) if high == which] for which in (False, True)
    ]
    return _parting(groups[0], groups[1], result, float(result.time[sample]))


def between_models(
    result: SceneComparison, runs: tuple[Runs, Runs], ensembles: Ensembles, until: float
) -> Parting | None:
    """Return the contact that separates all runs of one model from those of the other, up to a time (s)."""
    first, second = ([of.base, *ensembles.get(side, ())] for side, of in enumerate(runs))
    return _parting(first, second, result, until)


def _parting(
    first: Sequence[Table], second: Sequence[Table], result: SceneComparison, until: float
) -> Parting | None:
    """Return the contact that separates two groups of runs; None if there is none, or no event tables."""
    one, other = ([table.events for table in group if table.events is not None] for group in (first, second))
    if not one or not other or result.period is None:
        return None
    return parting_contact((one, other), period=result.period, until=until)


def _u(channel: ChannelComparison) -> Array:
    assert channel.u is not None
    return channel.u
