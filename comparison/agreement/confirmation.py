"""Confirmation of a verdict "differ" by ensembles of runs before it is reported.

The five runs that give a model's uncertainty are a small sample. Where motion magnifies errors by decades,
the error of a run is one draw from a wide distribution, shared by all later samples, and five draws may lie
together by chance. So each model is rerun from many starts, perturbed at random by the size of its own error
(`comparison.agreement.confirmation_starts`) at the setting that was judged, and the other model's run is
ranked in that ensemble by one statistic per scene: its largest distance from the centre over all predictable
samples of all channels, in units of the ensemble's standard deviation or of u, whichever is larger
(`comparison.metrics.outliers`).

A difference is confirmed if each model's run is farther from the other's ensemble than every member left out
of it; the smallest rank with n members is 1 / (n + 1). Exudyn's run of five bodies is too slow for an
ensemble: it is ranked in one of the other model, perturbed by its error.

If it is not confirmed, the uncertainty was too small. It is replaced by that of the ensembles, and the runs
are judged again. By the choice of `comparison.accuracy.uncertainty.ENSEMBLE_FACTOR` they differ then only
where each run is outside the other's ensemble: on fewer samples, but a confirmed difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import nan

import numpy as np

from comparison.accuracy.uncertainty import Runs, movable
from comparison.agreement.compare import compare
from comparison.agreement.confirmation_causes import (
    Ensembles,
    between_models,
    clusters,
    farthest,
    judged_samples,
    underestimation,
    within_ensemble,
)
from comparison.agreement.confirmation_starts import ENOUGH, arrived, ensemble_errors, moved_starts
from comparison.agreement.confirmation_text import contact_words, sentence
from comparison.agreement.results import Confirmation, SceneComparison
from comparison.metrics.outliers import distances
from comparison.scene import Scene
from comparison.tables.table import Table

Run = Callable[[Sequence[Scene], str], list[Table]]
"""Runs scenes by a model and returns the tables of the runs that succeeded."""


def confirm(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    *,
    scene: Scene,
    models: tuple[str, str],
    run: Run,
) -> SceneComparison:
    """Confirm a verdict "differ" by ensembles, or correct the uncertainty that it rests on.

    Parameters
    ----------
    result
        A comparison of these runs. One with another verdict is returned unchanged, without further runs.
    runs
        Of both models.
    scene
        Scene of the runs, with the settings of this tier.
    models
        Names of the two models.
    run
        Runs the ensembles; called once per model that is not too slow.

    Returns
    -------
    comparison
        With its ``confirmation``: "confirmed" or "unconfirmed" where the verdict is still "differ",
        "underestimated" where it is now "agree" or "indeterminate", by a corrected uncertainty.
    """
    if result.verdict != "differ":
        return result
    found = Confirmation("unconfirmed")
    if any(channel.u is None for channel in result.channels.values()):
        return _reported(result, found, "the verdict uses a tolerance, to which ensembles do not apply")
    if movable(scene) is None:
        return _reported(result, found, "no joint has clearance, so no start can be moved")
    errors = ensemble_errors(result, runs, scene, models)
    if not errors:
        return _reported(result, found, "both models are too slow for an ensemble")
    ensembles = {}
    for side, error in errors.items():
        base = runs[side].base
        members = [
            table
            for table in run(moved_starts(scene, models[side], error.shift), models[side])
            if np.array_equal(table.time, base.time)  # a third model may choose its times
        ]
        ensembles[side] = arrived(members, base, error.share)
    found = replace(
        found,
        members=(len(ensembles.get(0, ())), len(ensembles.get(1, ()))),
        shifts=(errors[0].shift if 0 in errors else nan, errors[1].shift if 1 in errors else nan),
    )
    return _decided(result, runs, ensembles, found, lambda large: _with_ensembles(result, runs, large, scene))


def confirm_recorded(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    ensembles: tuple[Sequence[Table], Sequence[Table]],
    judge: Callable[[tuple[Sequence[Table], Sequence[Table]]], SceneComparison],
) -> SceneComparison:
    """Confirm a verdict "differ" by runs that are there already, or correct the uncertainty.

    Parameters
    ----------
    result, runs
        As of `confirm`.
    ensembles
        Runs of each program from moved starts, at its base's setting and times.
    judge
        Compares the runs with the uncertainty of ensembles.
    """
    if result.verdict != "differ":
        return result
    found = Confirmation("unconfirmed", members=(len(ensembles[0]), len(ensembles[1])))
    there = {side: list(tables) for side, tables in enumerate(ensembles) if tables}
    if not there:
        return _reported(result, found, "no runs from moved starts beyond those of the uncertainty")

    def judged(large: Ensembles) -> SceneComparison:
        return judge((large.get(0, ()), large.get(1, ())))

    return _decided(result, runs, there, found, judged)


def _decided(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    ensembles: Ensembles,
    found: Confirmation,
    judge: Callable[[Ensembles], SceneComparison],
) -> SceneComparison:
    """Confirm a difference by ensembles of at least `ENOUGH` members, or judge with their uncertainty."""
    large = {side: tables for side, tables in ensembles.items() if len(tables) >= ENOUGH}
    farther, excess = ranks(result, runs, large)
    if any(farther.values()):
        judged = judge(large)
        if judged.verdict != "differ":
            found = replace(found, farther=(farther.get(0, 0), farther.get(1, 0)))
            return _reported(judged, _underestimated(found, result, judged, runs, large))
        result, (farther, excess) = judged, ranks(judged, runs, large)
    if len(large) < len(ensembles):
        return _reported(result, found, f"fewer than {ENOUGH} runs from moved starts succeeded")
    found = replace(found, outcome="confirmed", since=_since(result), excess=min(excess.values()))
    parting = between_models(result, runs, large, until=found.since)
    if parting is not None:
        found = replace(found, contact=contact_words(parting, result.labels))
    return _reported(result, found)


def ranks(
    result: SceneComparison, runs: tuple[Runs, Runs], ensembles: Ensembles
) -> tuple[dict[int, int], dict[int, float]]:
    """Rank each model's run in the other's ensemble, over the predictable samples of all judged channels.

    Returns
    -------
    farther, excess
        By the side of the ensemble: number of members that lie, left out, at least as far from the others as
        the other model's run from all; distance of that run over that of the farthest member.
    """
    farther, excess = {}, {}
    for side, tables in ensembles.items():
        members, other = np.zeros(len(tables)), 0.0
        for name, channel in result.channels.items():
            if channel.verdict == "unexcited":
                continue
            mask, floor = judged_samples(channel)
            values = np.array([table.values(name)[mask] for table in tables])
            of_members, of_run = distances(values, runs[1 - side].base.values(name)[mask], floor)
            members, other = np.maximum(members, of_members), max(other, of_run)
        farther[side] = int((members >= other).sum())
        excess[side] = other / float(members.max()) if members.max() > 0.0 else np.inf
    return farther, excess


def _with_ensembles(
    result: SceneComparison, runs: tuple[Runs, Runs], ensembles: Ensembles, scene: Scene
) -> SceneComparison:
    """Judge the same runs with the ensembles' uncertainty."""
    judged = compare(
        *runs,
        scene=scene,
        labels=result.labels,
        command=result.command,
        tier=result.tier,
        only=list(result.channels),
        ensembles=(ensembles.get(0, ()), ensembles.get(1, ())),
    )
    return replace(
        judged,
        name=result.name,
        warnings=result.warnings,
        tight=result.tight,
        reliability=result.reliability,
    )


def _underestimated(
    found: Confirmation,
    before: SceneComparison,
    after: SceneComparison,
    runs: tuple[Runs, Runs],
    ensembles: Ensembles,
) -> Confirmation:
    """Report the factor and onset of the underestimation and, if large, the decisive contact."""
    factor, worst = underestimation(before, after)
    parted = clusters(before, ensembles)
    found = replace(
        found, outcome="underestimated", factor=factor, since=_since(before), clustered=parted is not None
    )
    if not found.suspicious:
        return found
    side, name, sample = parted or farthest(worst, before, after, runs, ensembles)
    tables = [runs[side].base, *ensembles[side]]
    parting = within_ensemble(tables, name, sample, before)
    if parting is None:
        return found
    return replace(found, contact=contact_words(parting, (before.labels[side], before.labels[side])))


def _since(result: SceneComparison) -> float:
    return nan if result.attribution is None else result.attribution.outside_from


def _reported(result: SceneComparison, found: Confirmation, why: str = "") -> SceneComparison:
    if found.outcome == "unconfirmed":
        found = replace(found, since=_since(result))
    return replace(result, confirmation=replace(found, sentence=sentence(found, result.labels, why)))
