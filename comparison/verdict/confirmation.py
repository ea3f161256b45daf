r"""Verdicts settled before they are reported, by ensembles and refinement of runs: README.md, "Verdicts".

**Ensembles** confirm a verdict "differ" or take it back. A run is ranked in the other model's ensemble by its
largest distance from the centre over all predictable samples of all channels (`comparison.metrics.signals`);
the smallest rank with n members is 1 / (n + 1). If the difference is not confirmed u is replaced by that of
the ensembles, and the runs are judged again: by the choice of
`comparison.accuracy.uncertainty.ENSEMBLE_FACTOR` they differ then only where each is outside.

**Starts.** An error e of the start has grown to G e where the response is G, which the perturbed runs of a
model show: they were moved by a known distance. So the error |S - S_f| of its run is equivalent to |S - S_f|
/ G at the start. The starts lie apart by the median of that over x, and the angle times the slider's length,
at all samples before the first unpredictable one. But an integration error is not present from the start.
Until t its equivalent is

.. math:: w(t) = \max_{s \le t} \frac{\max_{r \le s} |S - S_f|(r)}{\max_{r \le s} G(r)},

and where that is less than the distance of the starts, the deviations of the members at t are scaled down
accordingly. Both are never less than what the perturbed runs were moved by, or an ensemble would be narrower
than what it is to correct.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, nan

import numpy as np
import pandas as pd

from comparison.accuracy.levels import finer, tight
from comparison.accuracy.uncertainty import ENSEMBLE_FACTOR, Runs, movable, moved, perturbation
from comparison.execution.run import VIOLATED, Outcome
from comparison.metrics.contacts import Parting, parting_contact
from comparison.metrics.signals import clustered, distances, split
from comparison.scene import Scene, digest
from comparison.tables.channels import Array
from comparison.tables.table import Table
from comparison.verdict.compare import compare
from comparison.verdict.criteria import Criteria
from comparison.verdict.results import Confirmation, Doubt, SceneComparison

MEMBERS = {"reference": 99}
"""Runs in an ensemble, by model; the reference takes 0.03 s each."""
OTHER_MEMBERS = 30
"""Of any other model; Exudyn's tree takes about 1 s a run at the tight tier."""
ENOUGH = 19
"""Members that can show a rank of 5 %; with fewer nothing is confirmed, nor taken back."""
# Responses below it are round-off: a few operations on coordinates of 0.55 m.
_NO_RESPONSE = 1e-15

Run = Callable[[Sequence[Scene], str], list[Table]]
"""Runs scenes by a model and returns the tables of the runs that succeeded."""
Ensembles = Mapping[int, Sequence[Table]]
"""Of the first model (0) and the second (1); of one that is too slow there is none."""
Pair = tuple[Sequence[Table], Sequence[Table]]


def confirm(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    *,
    scene: Scene,
    models: tuple[str, str],
    run: Run,
) -> SceneComparison:
    """Confirm a verdict "differ" of runs by ensembles, or correct the uncertainty that it rests on.

    The result has its ``confirmation``: "confirmed" or "unconfirmed" where the verdict is still "differ",
    "underestimated" where it is now "agree" or "indeterminate". Another verdict is returned unchanged.
    ``run`` is called once per model that is not too slow.
    """
    if result.verdict != "differ":
        return result
    if any(channel.u is None for channel in result.channels.values()):
        return unconfirmed(result, Doubt.TOLERANCE)
    if movable(scene) is None:
        return unconfirmed(result, Doubt.RIGID)
    quick = [side for side, model in enumerate(models) if not too_slow(scene, model)]
    if not quick:
        return unconfirmed(result, Doubt.SLOW)
    positions = [result.channels[name] for name in ("slider_x", "slider_angle") if name in result.channels]
    ends = [int(channel.predictable.argmin()) for channel in positions if not channel.predictable.all()]
    errors = [starting_error(model, scene, min(ends, default=result.time.size)) for model in runs]
    if len(quick) < len(models):  # one is ranked in the other's ensemble: the larger error counts
        errors = [(max(shift for shift, _ in errors), np.maximum(*(until for _, until in errors)))] * 2
    ensembles, shifts = {}, [nan, nan]
    for side in quick:
        model, base, (shift, until) = models[side], runs[side].base, errors[side]
        shifts[side], share = shift, np.minimum(until / shift, 1.0)
        ensembles[side] = [
            scaled_member(table, base, share)
            for table in run(moved_starts(scene, model, shift), model)
            if np.array_equal(table.time, base.time)  # a third model may choose its times
        ]
    judged = decided(result, runs, ensembles, lambda large: judged_again(result, runs, scene, large))
    assert judged.confirmation is not None
    return replace(judged, confirmation=replace(judged.confirmation, shifts=(shifts[0], shifts[1])))


def judged_again(
    result: SceneComparison, runs: tuple[Runs, Runs], scene: Scene, ensembles: Pair = ((), ())
) -> SceneComparison:
    """Return the comparison of the same channels by other runs, or by more."""
    judged = compare(
        *runs,
        scene=scene,
        labels=result.labels,
        criteria=Criteria(channels=list(result.channels)),
        tier=result.tier,
        ensembles=ensembles,
    )
    kept = {part: getattr(result, part) for part in ("name", "command", "warnings", "refined")}
    return replace(judged, **kept)


def decided(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    ensembles: Ensembles,
    judge: Callable[[Pair], SceneComparison],
) -> SceneComparison:
    """Confirm a difference by ensembles of at least `ENOUGH` members, or judge with their uncertainty."""
    large = {side: tables for side, tables in ensembles.items() if len(tables) >= ENOUGH}
    pair = large.get(0, ()), large.get(1, ())
    members, since = (len(ensembles.get(0, ())), len(ensembles.get(1, ()))), result.attribution.outside_from
    farther, excess = _ranks(result, runs, large)
    if any(farther):
        judged = judge(pair)
        if judged.verdict != "differ":
            confirmation = Confirmation("underestimated", members=members, farther=farther, since=since)
            return replace(judged, confirmation=_explained(confirmation, result, judged, runs, large))
        result, (_, excess) = judged, _ranks(judged, runs, large)
    if len(large) < len(ensembles):
        return unconfirmed(result, Doubt.FEW_RUNS, members)
    since = result.attribution.outside_from
    first, second = ([model.base, *tables] for model, tables in zip(runs, pair, strict=True))
    confirmation = Confirmation(
        "confirmed",
        members=members,
        excess=excess,
        since=since,
        parting=_parting(first, second, result, since),
        parted=result.labels,
    )
    return replace(result, confirmation=confirmation)


def unconfirmed(result: SceneComparison, doubt: Doubt, members: tuple[int, int] = (0, 0)) -> SceneComparison:
    """Return the difference with what keeps it from being confirmed."""
    since = result.attribution.outside_from
    return replace(result, confirmation=Confirmation("unconfirmed", doubt, members, since=since))


def _ranks(
    result: SceneComparison, runs: tuple[Runs, Runs], ensembles: Ensembles
) -> tuple[tuple[int, int], float]:
    """Rank each model's run in the other's ensemble, over the predictable samples of all judged channels.

    By ensemble: number of members that lie, left out, at least as far from the others as the other model's
    run from all; and the least distance of such a run over that of the farthest member.
    """
    farther, excess = [0, 0], inf
    for side, tables in ensembles.items():
        members, other = np.zeros(len(tables)), 0.0
        for name, channel in result.excited.items():
            mask, floor = channel.deciding
            values = np.array([table.values(name)[mask] for table in tables])
            left_out, away = distances(values, runs[1 - side].base.values(name)[mask], floor)
            members, other = np.maximum(members, left_out), max(other, away)
        farther[side] = int((members >= other).sum())
        excess = min(excess, other / float(members.max()) if members.max() > 0.0 else inf)
    return (farther[0], farther[1]), excess


# ---- starts of an ensemble


def too_slow(scene: Scene, model: str) -> bool:
    """Return whether a model is too slow for an ensemble at the settings of a scene, at some 10 s a run."""
    return model == "exudyn" and scene.data["solver"]["exudyn"]["formulation"] == "full"


def starting_error(runs: Runs, scene: Scene, before: int) -> tuple[float, Array]:
    """Return the initial perturbation equivalent to a model's error, from so many samples; see above.

    That is the standard deviation of the starts of an ensemble, and w(t), shape (n,); both in m.
    """
    least = perturbation(scene)
    until, worth = np.full(runs.base.time.size, least), [np.zeros(1)]
    lengths = {"slider_x": 1.0}
    if movable(scene) == "slider":
        lengths["slider_angle"] = scene.data["mechanism"]["slider"]["length"]
    for name, length in lengths.items():
        if runs.finer is None or not runs.perturbed_runs:
            continue
        error = length * np.abs(runs.base.values(name) - runs.finer.values(name))[:before]
        original = runs.original.values(name)
        apart = np.max([np.abs(original - run.values(name)) for run in runs.perturbed_runs], axis=0)
        response = length * apart[:before] / least
        known = response > _NO_RESPONSE / least
        worth.append(error[known] / response[known])
        # At once by the start's own distance: the crank pin's, where that is moved, grows into it.
        grown = np.maximum.accumulate(np.maximum(response, 1.0))
        arisen = np.maximum.accumulate(np.maximum.accumulate(error) / grown)
        until[:before] = np.maximum(until[:before], arisen)
    return max(float(np.median(np.concatenate(worth))), least), np.maximum.accumulate(until)


def moved_starts(scene: Scene, model: str, shift: float) -> list[Scene]:
    """Draw the starts of a model's ensemble by their standard deviation, m; always the same ones."""
    seed = int(digest({"scene": scene.hash, "model": model})[:16], 16)
    draws = shift * np.random.default_rng(seed).standard_normal((MEMBERS.get(model, OTHER_MEMBERS), 2))
    return [moved(scene, float(across), float(turned)) for across, turned in draws]


def scaled_member(member: Table, base: Table, share: Array) -> Table:
    """Return a run from a moved start with its deviations from the base, at the same times, scaled."""
    centre = base.frame.drop(columns="time")
    scaled = centre + (member.frame[centre.columns] - centre).mul(share, axis=0)
    return replace(member, frame=pd.concat([base.frame["time"], scaled], axis=1))


# ---- causes: where an ensemble splits into clusters, or spreads much farther than u, a contact decides
# that occurs in some runs only


def _explained(
    confirmation: Confirmation,
    before: SceneComparison,
    after: SceneComparison,
    runs: tuple[Runs, Runs],
    ensembles: Ensembles,
) -> Confirmation:
    """Add the factor of the underestimation and, if that is suspicious, the decisive contact.

    The factor is the largest of all channels: the ensembles' largest distance over u, at the samples at which
    the difference was outside k u. Elsewhere an ensemble may be wider without having made the difference; and
    of these samples the share that a verdict may leave unexplained does not count, such as one in which a
    contact begins.
    """
    factors = []
    for channel in before.with_verdict("differ"):
        (mask, floor), wider = channel.deciding, after.channels[channel.channel].u
        assert wider is not None
        outside = np.abs(channel.difference[mask]) > channel.limits.k * floor
        ratio = wider[mask][outside] / (ENSEMBLE_FACTOR * floor[outside])
        factor = float(np.quantile(ratio, channel.limits.share, method="lower"))
        sample = int(np.flatnonzero(mask)[(wider[mask] / floor).argmax()])
        factors.append((factor, sample, channel.channel))
    factor, sample, name = max(factors, key=lambda one: one[0])
    cluster = _cluster(before, ensembles)
    confirmation = replace(confirmation, factor=factor, clustered=cluster is not None)
    if not confirmation.suspicious:
        return confirmation
    families = {side: [runs[side].base, *tables] for side, tables in ensembles.items()}
    if cluster is not None:
        sample, side, name = cluster
    else:
        side = max(families, key=lambda key: np.ptp([table.values(name)[sample] for table in families[key]]))
    above = split(np.array([table.values(name)[sample] for table in families[side]]))
    low, high = (
        [table for table, is_above in zip(families[side], above, strict=True) if is_above == which]
        for which in (False, True)
    )
    parting = _parting(low, high, before, float(before.time[sample]))
    return replace(confirmation, parting=parting, parted=(before.labels[side],) * 2)


def _cluster(result: SceneComparison, ensembles: Ensembles) -> tuple[int, int, str] | None:
    """Return first sample, model and channel of an ensemble that splits into clusters; None if none does.

    Only positions and velocities are considered: a force jumps at either end of every contact, so a sample
    there separates runs that coincide afterwards. A channel's clusters count if they last for more samples
    than a verdict may leave unexplained.
    """
    clusters = []
    for side, tables in ensembles.items():
        for name, channel in result.excited.items():
            if channel.definition.follows is not None:
                continue
            mask, floor = channel.deciding
            parted = clustered(np.array([table.values(name)[mask] for table in tables]), floor)
            if parted.sum() > (1.0 - channel.limits.share) * parted.size:
                clusters.append((int(np.flatnonzero(mask)[parted.argmax()]), side, name))
    return min(clusters, default=None)


def _parting(
    first: Sequence[Table], second: Sequence[Table], result: SceneComparison, until: float
) -> Parting | None:
    """Return the contact that separates two groups of runs; None if there is none, or no event tables."""
    one, other = ([table.events for table in group if table.events is not None] for group in (first, second))
    if not one or not other or result.period is None:
        return None
    return parting_contact((one, other), period=result.period, until=until)


# ---- refinement of a model with fixed steps, until it is known what its runs converge to
#
# Three step sizes can err alike in stiff contacts (measured at 0.4 mm of clearance: errors of x of 1.3e-6,
# 7.5e-7, 7.7e-7, 1.2e-8 and 3.0e-9 m at 2, 1, 0.5, 0.25 and 0.125 us), which an ensemble does not show: its
# starts are moved, not its steps. So a verdict other than "agree" is judged again one level finer, and so
# on:
#
# - "agree" at any level stands: numerical errors, the cause of nearly all differences, vanish with the
#   step;
# - "differ" stands where the difference outlasts two refinements (`CONVERGED`), and the ensembles confirm
#   it at that level. Where the third opinion contradicts it, the tree of the same package at the tight
#   tier, it must outlast all;
# - "differ" after which the runs still move by as much as they differ, or of which a finer run failed,
#   stands only where the third opinion shows it as well; else what they converge to is unknown, and the
#   verdict is "indeterminate";
# - "indeterminate" stands after `ENOUGH_LEVELS`: the motion, not the step, is what cannot be predicted;
# - a run that violates an invariant at the scene's own step gives no verdict, and a smaller step is the
#   remedy: the first verdict is that of the next level (`without_violation`).

ENOUGH_LEVELS = 2
"""Levels after which "indeterminate" stands, and after which "differ" can."""
MOST_LEVELS = 4
"""Levels at most: 2 us become 0.125 us, in 16 times the time of a run."""
SMALLEST_STEP = 1.2e-7
"""s; beyond `ENOUGH_LEVELS` none below this, where a run of two cycles takes minutes."""
FINEST_TOLERANCE = 1e-12
"""Of the reference, whose finer run is a tenth of it; below there is only round-off."""
CONVERGED = 0.25
"""Of a difference: the most by which the last two refinements moved the run, at the median of the samples
that differ. At second order runs whose difference is an error move by three quarters of it at the next level.
"""

RunFamilies = Callable[[Scene], tuple[Runs, Runs] | None]
"""Runs the families of both models at the settings of a scene; None if a run did not succeed."""


@dataclass(frozen=True)
class Settled:
    """A verdict that stands, with the runs and the scene's settings that it is of."""

    comparison: SceneComparison
    runs: tuple[Runs, Runs]
    scene: Scene


def settle(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    *,
    scene: Scene,
    models: tuple[str, str],
    run: Run,
    run_families: RunFamilies,
    level: int = 0,
) -> Settled:
    """Confirm a verdict "differ" by ensembles; one of a model with fixed steps is first refined.

    ``run_families`` is called once a level, and once for the third opinion; ``level`` says by how much the
    runs are finer than the scene's own already; the rest as of `comparison.verdict.confirmation.confirm`.
    """

    def confirmed(last: Settled) -> Settled:
        judged = confirm(last.comparison, last.runs, scene=last.scene, models=models, run=run)
        return replace(last, comparison=judged)

    def third_opinion(last: Settled) -> str:
        """Return the verdict at the tight tier, if there the tree replaces five bodies; else nothing."""
        closer = tight(last.scene, models)
        if closer is None or any(too_slow(closer, model) for model in models):
            return ""
        if (again := run_families(closer)) is None:
            return ""
        judged = compare(*again, scene=closer, labels=result.labels, tier="tight")
        return confirm(judged, again, scene=closer, models=models, run=run).verdict

    levels = [Settled(replace(result, refined=level), runs, scene)]
    if result.verdict not in ("differ", "indeterminate") or not any(too_slow(scene, m) for m in models):
        return confirmed(levels[0])
    opinion: str | None = None
    while True:
        last = levels[-1]
        stays = last.comparison.verdict == "differ" and _converged(levels, models)
        if stays and opinion is None:
            opinion = third_opinion(last)
        closer = _finer(last.scene, models, level + len(levels))
        if stays and (opinion != "agree" or closer is None):
            return confirmed(last)
        if last.comparison.verdict == "indeterminate" and len(levels) > ENOUGH_LEVELS:
            return last
        again = None if closer is None else run_families(closer)
        if closer is None or again is None:
            break
        judged = replace(judged_again(result, again, closer), refined=level + len(levels))
        levels.append(Settled(judged, again, closer))
        if judged.verdict == "agree":
            return levels[-1]
    if last.comparison.verdict != "differ":
        return last
    if opinion is None:
        opinion = third_opinion(last)
    if opinion == "differ":
        return confirmed(last)
    return replace(last, comparison=replace(last.comparison, verdict="indeterminate", unsettled=True))


def without_violation(
    scene: Scene,
    failed: Sequence[tuple[str, Outcome]],
    models: tuple[str, str],
    run_families: RunFamilies,
) -> tuple[Scene, tuple[Runs, Runs], tuple[str]] | None:
    """Return scene, runs, warning one level finer, if all that failed are five bodies by an invariant."""
    if any(outcome.status != VIOLATED or not too_slow(scene, model) for model, outcome in failed):
        return None
    closer = _finer(scene, models, 1)
    runs = None if closer is None else run_families(closer)
    if closer is None or runs is None:
        return None
    step = scene.data["solver"]["exudyn"]["step"]
    messages = "; ".join(outcome.message for _, outcome in failed)
    warning = f"judged at half the scene's step, {step:g} s, at which five bodies fail: {messages}"
    return closer, runs, (warning,)


def _finer(scene: Scene, models: Sequence[str], level: int) -> Scene | None:
    """Return the scene with both models one level finer; None at the last, or if one cannot be refined."""
    closer: Scene | None = scene
    for model in dict.fromkeys(models):
        tolerance = scene.data["solver"].get(model, {}).get("tolerance", 1.0)
        if closer is not None and not (model == "reference" and tolerance <= 1.01 * FINEST_TOLERANCE):
            closer = finer(model, closer)
    if closer is None or level > MOST_LEVELS:
        return None
    small = closer.data["solver"]["exudyn"]["step"] < SMALLEST_STEP
    return None if small and level > ENOUGH_LEVELS else closer


def _converged(levels: Sequence[Settled], models: Sequence[str]) -> bool:
    """Return whether what differs at the last level has outlasted two refinements of the stepped models."""
    if len(levels) <= ENOUGH_LEVELS:
        return False
    comparison, scene = levels[-1].comparison, levels[-1].scene
    stepped = [side for side, model in enumerate(models) if too_slow(scene, model)]
    ratios = []
    for channel in comparison.with_verdict("differ"):
        mask, u = channel.deciding
        difference = np.abs(channel.difference[mask])
        outside = difference > channel.limits.k * u
        values = [
            [level.runs[side].base.values(channel.channel)[mask] for side in stepped] for level in levels[-3:]
        ]
        moved = np.abs(np.diff(values, axis=0)).max(axis=(0, 1))
        ratios.append(moved[outside] / difference[outside])
    return bool(np.median(np.concatenate(ratios)) <= CONVERGED)
