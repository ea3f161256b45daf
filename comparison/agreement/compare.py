"""Comparison of two models' runs of a scene, or of any two tables, channel by channel.

Coverage and RMS depend on where the samples are: most contacts are shorter than the distance of two, and u
sees them or not. Their errors are estimated as those of a quadrature of first order: the same runs are judged
on every second and on every fourth sample, and three times the larger of the changes, that on every fourth
halved, is the error (the factor of safety of two grids after Roache). Largest values and ranges are those of
the samples: no coarser grid tells what lies between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.uncertainty import (
    SAFETY_FACTOR,
    WINDOW,
    Levels,
    Runs,
    round_off,
    uncertainty,
    window_samples,
)
from comparison.agreement.attribution import attribute
from comparison.agreement.results import ChannelComparison, SceneComparison, scene_coverage
from comparison.agreement.scene_verdict import scene_verdict
from comparison.agreement.time_checks import between, check_holes, check_times, kinds, too_late
from comparison.agreement.verdict import compare_channel
from comparison.execution.quality import contact_warnings
from comparison.scene import Scene, SceneError, scene_from_mapping
from comparison.tables.align import align
from comparison.tables.channels import expected
from comparison.tables.table import Table, TableError, check

_BESIDES = ("crank", "own")  # groups of channels
_FEW = 16  # samples; of fewer every fourth one tells nothing

__all__ = ["Runs", "compare", "recorded_scene"]


def compare(
    a: Runs,
    b: Runs,
    *,
    scene: Scene | None = None,
    tolerance: float | None = None,
    share: float = 1.0,
    period: float | None = None,
    labels: tuple[str, str] = ("a", "b"),
    name: str = "compare",
    command: str = "",
    warnings: tuple[str, ...] = (),
    tier: str = "standard",
    only: Sequence[str] | None = None,
    ensembles: tuple[Sequence[Table], Sequence[Table]] = ((), ()),
) -> SceneComparison:
    """Compare two models' runs of a scene, or any two tables.

    Parameters
    ----------
    a, b
        With a finer run each: judged by their numerical uncertainty. Else by the tolerance.
    scene
        Scene of the tables: determines their required channels, time span and scales. Without it both must
        hold the same channels over the same time, and scales are ranges.
    tolerance
        Share of each channel's scale; only for tables without uncertainty. With neither, the verdict is
        "indeterminate". Without a scene the scales are the ranges of ``a``.
    share
        Of the samples that must be within the tolerance.
    period
        Of the motion, s, whose hundredth is the window of an uncertainty; None: the scene's, else the span.
    labels, name, command, warnings
        Names of the two results, of the comparison, its command, and further warnings.
    tier
        One of `comparison.accuracy.tiers.TIERS`, whose thresholds apply.
    only
        Channels to compare, among those requested by the scene; None: all.
    ensembles
        Additional runs of each model at its base's setting and times, see
        `comparison.agreement.confirmation`.

    Raises
    ------
    TableError
        If the tables cannot be compared: a channel missing or unexpected, a number that is not finite, time
        that does not increase, a truncated run.
    """
    both = tuple(zip(labels, (a, b), strict=True))
    tables = {f"{label}{kind}": table for label, runs in both for kind, table in kinds(runs)}
    names = _names(a.base, b.base, scene, only)
    for label, table in tables.items():
        check(table, names, None if scene is None else (0.0, scene.duration), name=label)
    check_times(both)
    warnings += check_holes(both)
    warnings += tuple(f"{label}: {line}" for label, of in both for line in contact_warnings(of.base))
    aligned = align(a.base, b.base, names)
    if aligned.interpolated and a.finer is not None and b.finer is not None:
        raise TableError(f"{labels[0]} and {labels[1]}: runs with uncertainties must have the same times")
    if aligned.interpolated:
        which = labels[0] if aligned.interpolated == "a" else labels[1]
        warnings += (
            f"{which} was interpolated to the times of the other: events shorter than a sample are not "
            "resolved",
        )
    if aligned.unknown:
        count = sum(int(part.sum()) for part in aligned.unknown.values())
        warnings += (
            f"{count} samples of {len(aligned.unknown)} channels are not judged: a contact starts or ends "
            "between them and the nearest samples of the interpolated table",
        )
    limits = thresholds(tier)
    period = period if scene is None else scene.period
    window = float(a.base.time[-1] - a.base.time[0]) if period is None else period
    known = a.base.known | b.base.known

    def judged(every: int) -> dict[str, ChannelComparison]:
        found: dict[str, ChannelComparison] = {}
        for channel in map(known.__getitem__, names):  # positions come before what follows from them
            position, unknown = found.get(channel.follows or ""), aligned.unknown.get(channel.name)
            within = None if position is None else position.predictable
            if unknown is not None:
                within = ~unknown[::every] if within is None else within & ~unknown[::every]
            found[channel.name] = compare_channel(
                channel,
                aligned.time[::every],
                aligned.a[channel.name][::every],
                aligned.b[channel.name][::every],
                scene=None if scene is None else scene.data,
                u=(
                    model_uncertainty(a, channel.name, window, ensembles[0], every),
                    model_uncertainty(b, channel.name, window, ensembles[1], every),
                ),
                within=within,
                tolerance=tolerance,
                limits=limits,
                share=share,
            )
        return found

    grids = [judged(every) for every in (1, 2, 4)] if aligned.time.size >= _FEW else [judged(1)]
    results = {
        name: replace(
            channel,
            coverage_error=_sampling_error([grid[name].coverage for grid in grids]),
            rms_error=_sampling_error([grid[name].rms_difference for grid in grids]),
        )
        for name, channel in grids[0].items()
    }
    if aligned.interpolated and tolerance is not None:
        side = 0 if aligned.interpolated == "a" else 1
        warnings += between((a, b)[side].base, labels[side], aligned, results, tolerance)
    verdict, reason = scene_verdict(results, limits.coverage)
    if (late := too_late(results, aligned, labels, tolerance)) and verdict != "differ":
        verdict, reason = "differ", late
    return SceneComparison(
        name=name if scene is None else scene.name,
        title="Two tables" if scene is None else scene.title,
        description="" if scene is None else scene.description,
        labels=labels,
        verdict=verdict,
        reason=reason,
        warnings=(() if scene is None else scene.warnings) + warnings,
        time=aligned.time,
        period=period,
        channels=results,
        events=(a.base.events, b.base.events),
        provenance={label: table.provenance for label, table in tables.items()},
        scene=None if scene is None else scene.data,
        command=command,
        tier=tier,
        shift=aligned.shift,
        coverage_error=_sampling_error([scene_coverage(grid) for grid in grids]),
        attribution=attribute(
            (a, b), results, aligned.time, verdict=verdict, tier=tier, labels=labels, scene=scene
        ),
    )


def _sampling_error(values: Sequence[float]) -> float:
    """Estimate the error of a number from its values on all, every second and every fourth sample."""
    if len(values) < 3:
        return nan
    fine, half, quarter = values
    return SAFETY_FACTOR * float(np.maximum(abs(half - fine), abs(quarter - fine) / 2))


def recorded_scene(a: Table, b: Table) -> tuple[Scene | None, tuple[str, ...]]:
    """Find the scene that both tables record; settings of solvers and output may differ.

    Returns
    -------
    scene, warnings
        No scene where they record none; none and a warning where they record two that differ.
    """
    record_a, record_b = a.provenance.get("scene"), b.provenance.get("scene")
    if not isinstance(record_a, dict) or not isinstance(record_b, dict):
        return None, ()
    sections = {*record_a, *record_b} - {"scene", "solver", "output"}
    changed = sorted(section for section in sections if record_a.get(section) != record_b.get(section))
    if changed:
        return None, (
            f"the tables are of different scenes ({', '.join(changed)} differ): the scales are ranges",
        )
    # Scales and channels do not depend on settings, and the model of a table need not be installed here.
    record = {section: part for section, part in record_a.items() if section != "solver"}
    for solver in (_solvers(a) | _solvers(b), {}):
        try:
            return scene_from_mapping(record | {"solver": solver}), ()
        except SceneError as error:
            reason = error
    return None, (f"the scene recorded beside the tables is not used: {reason}",)


def _solvers(table: Table) -> dict[str, Any]:
    """Return the recorded settings of the model that wrote a table, by its name."""
    model, solvers = table.provenance.get("model"), table.provenance["scene"].get("solver", {})
    return {model: solvers[model]} if isinstance(model, str) and model in solvers else {}


def _names(a: Table, b: Table, scene: Scene | None, only: Sequence[str] | None) -> list[str]:
    """Return the channels that both must hold: the scene's, or else all of either."""
    known = a.known | b.known
    if scene is None:
        return [name for name in known if name in a.frame or name in b.frame or name in (only or ())]
    # Besides what every run of the scene holds there may be channels that no model writes.
    names = expected(scene.data)
    names += [
        name
        for name, channel in known.items()
        if channel.group in _BESIDES and (name in a.frame or name in b.frame)
    ]
    if other := [name for name in only or () if name not in names]:
        raise TableError(f"scene {scene.name!r}: has no channel {other[0]} to compare")
    return names if only is None else [name for name in names if name in only]


def model_uncertainty(
    runs: Runs, name: str, period: float, ensemble: Sequence[Table] = (), every: int = 1
) -> NDArray[np.float64] | None:
    """Uncertainty of one channel of one model, in its unit; None without a finer run.

    The window is a hundredth of the period (s) to either side; where the distance of the samples varies, the
    largest number of samples that any such window holds. Of every so many samples only the first one is
    looked at: shape (n,) or fewer.
    """
    if runs.finer is None:
        return None

    def values(run: Table) -> NDArray[np.float64]:
        return run.values(name)[::every]

    time, base = runs.base.time[::every], values(runs.base)
    interval = float(time[-1] - time[0]) / (time.size - 1)
    held = np.searchsorted(time, time + WINDOW * period) - np.arange(1, time.size + 1)
    factor, order = runs.refinement
    levels = Levels(
        base=base,
        finer=values(runs.finer),
        coarser=None if runs.coarser is None else values(runs.coarser),
        perturbed=tuple(map(values, runs.perturbed_runs)),
        factor=factor,
        order=order,
        ensemble=tuple(map(values, ensemble)),
    )
    return uncertainty(
        levels,
        max(window_samples(period, interval), int(held.max())),
        round_off(base, time, runs.base.known[name].round_off),
    )
