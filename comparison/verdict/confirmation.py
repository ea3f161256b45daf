r"""Confirmation of a verdict "differ" by ensembles of runs from moved starts.

**Ensembles** confirm a verdict "differ" or take it back. A run is ranked in the other model's ensemble by its
largest distance from the centre over all predictable samples of all channels (`comparison.metrics`);
the smallest rank with n members is 1 / (n + 1). If that does not confirm the difference, the u of the
ensembles replaces u, and the runs are judged again: by the choice of
`comparison.accuracy.uncertainty.ENSEMBLE_FACTOR` they differ then only where each is outside.

**Starts.** An error e of the start grows to G e where the response is G. The perturbed runs of a model show
G, as the distance of their starts is known. So the error |S - S_f| of a run is equivalent to |S - S_f| / G at
the start. The distance of the starts is the median of that over x, and the angle times the slider's length,
at all samples before the first unpredictable one. But an integration error is not present from the start.
Until t its equivalent is

.. math:: w(t) = \max_{s \le t} \frac{\max_{r \le s} |S - S_f|(r)}{\max_{r \le s} G(r)},

and where that is less than the distance of the starts, the deviations of the members at t are scaled down
accordingly. Neither is less than the distance of the perturbed runs' starts, or an ensemble would be narrower
than the uncertainty that it corrects.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import inf, nan

import numpy as np
import pandas as pd

from comparison.accuracy.uncertainty import ENSEMBLE_FACTOR, Runs, movable, move_start, perturbation
from comparison.metrics import Parting, distances, parting_contact
from comparison.scene import Scene, digest
from comparison.tables.channels import Array
from comparison.tables.table import Table
from comparison.verdict.channel import Criteria
from comparison.verdict.compare import compare
from comparison.verdict.results import Confirmation, Doubt, SceneComparison

MEMBERS = {"reference": 99}
"""Runs in an ensemble, by model; the reference takes 0.03 s each."""
OTHER_MEMBERS = 30
"""Runs in an ensemble of any other model; Exudyn's tree takes about 1 s a run at the tight tier."""
ENOUGH_MEMBERS = 19
"""Members that can show a rank of 5 %; fewer neither confirm a difference nor take it back."""
# Responses below it are round-off: a few operations on coordinates of 0.55 m.
_NO_RESPONSE = 1e-15

Run = Callable[[Sequence[Scene], str], list[Table]]
"""Runs scenes by a model and returns the tables of the runs that succeeded."""
Ensembles = Mapping[int, Sequence[Table]]
"""Ensembles of the first model (0) and the second (1); a model that is too slow has none."""
Pair = tuple[Sequence[Table], Sequence[Table]]


def confirm(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    *,
    scene: Scene,
    models: tuple[str, str],
    run: Run,
) -> SceneComparison:
    """Confirm a verdict "differ" of runs by ensembles, or correct the uncertainty below it.

    The result has its ``confirmation``: "confirmed" or "unconfirmed" where the verdict is still "differ",
    "underestimated" where it is now "agree" or "indeterminate". Another verdict is returned unchanged.
    ``run`` is called once per model that is not too slow.
    """
    if result.verdict != "differ":
        return result
    if any(channel.u is None for channel in result.channels.values()):
        return with_doubt(result, Doubt.TOLERANCE)
    if movable(scene) is None:
        return with_doubt(result, Doubt.RIGID)
    sides = [side for side, model in enumerate(models) if not too_slow(scene, model)]
    if not sides:
        return with_doubt(result, Doubt.SLOW)
    positions = [result.channels[name] for name in ("slider_x", "slider_angle") if name in result.channels]
    ends = [int(channel.predictable.argmin()) for channel in positions if not channel.predictable.all()]
    errors = [starting_error(model, scene, min(ends, default=result.time.size)) for model in runs]
    if len(sides) < len(models):  # one is ranked in the other's ensemble: the larger error counts
        errors = [(max(shift for shift, _ in errors), np.maximum(*(w for _, w in errors)))] * 2
    ensembles, shifts = {}, [nan, nan]
    for side in sides:
        model, base, (shift, w) = models[side], runs[side].base, errors[side]
        shifts[side], share = shift, np.minimum(w / shift, 1.0)
        ensembles[side] = [
            scaled_member(table, base, share)
            for table in run(moved_starts(scene, model, shift), model)
            if np.array_equal(table.time, base.time)  # a third model may choose its times
        ]
    comparison = confirm_by_ensembles(result, runs, ensembles, partial(judge_again, result, runs, scene))
    assert comparison.confirmation is not None
    return replace(comparison, confirmation=replace(comparison.confirmation, shifts=(shifts[0], shifts[1])))


def judge_again(
    result: SceneComparison, runs: tuple[Runs, Runs], scene: Scene, ensembles: Pair = ((), ())
) -> SceneComparison:
    """Return the comparison of the same channels by other runs, or by more runs."""
    comparison = compare(
        *runs,
        scene=scene,
        labels=result.labels,
        criteria=Criteria(**scene.compare.model_dump(), channels=list(result.channels)),
        tier=result.tier,
        ensembles=ensembles,
    )
    fields = ("name", "command", "warnings", "refined", "halved", "demand")
    return replace(comparison, **{name: getattr(result, name) for name in fields})


def confirm_by_ensembles(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    ensembles: Ensembles,
    judge: Callable[[Pair], SceneComparison],
) -> SceneComparison:
    """Confirm a difference by ensembles of `ENOUGH_MEMBERS` or more, or judge with their uncertainty."""
    groups = {side: tables for side, tables in ensembles.items() if len(tables) >= ENOUGH_MEMBERS}
    pair = groups.get(0, ()), groups.get(1, ())
    members, since = (len(ensembles.get(0, ())), len(ensembles.get(1, ()))), result.attribution.outside_from
    farther, excess = _ranks(result, runs, groups)
    if any(farther):
        revision = judge(pair)
        if revision.verdict != "differ":
            confirmation = Confirmation("underestimated", members=members, farther=farther, since=since)
            return replace(revision, confirmation=replace(confirmation, factor=_factor(result, revision)))
        result, (_, excess) = revision, _ranks(revision, runs, groups)
    if len(groups) < len(ensembles):
        return with_doubt(result, Doubt.FEW_RUNS, members)
    since = result.attribution.outside_from
    first, second = ([model.base, *tables] for model, tables in zip(runs, pair, strict=True))
    confirmation = Confirmation(
        "confirmed",
        members=members,
        excess=excess,
        since=since,
        parting=_parting(first, second, result, since),
    )
    return replace(result, confirmation=confirmation)


def with_doubt(result: SceneComparison, doubt: Doubt, members: tuple[int, int] = (0, 0)) -> SceneComparison:
    """Return the difference with the reason why it is not confirmed."""
    since = result.attribution.outside_from
    return replace(result, confirmation=Confirmation("unconfirmed", doubt, members, since=since))


def _ranks(
    result: SceneComparison, runs: tuple[Runs, Runs], ensembles: Ensembles
) -> tuple[tuple[int, int], float]:
    """Rank each model's run in the other's ensemble, over the predictable samples of all judged channels.

    By ensemble: the number of members at least as far from the other members as the other model's run is
    from all; and the least distance of such a run over that of the farthest member.
    """
    farther, excess = [0, 0], inf
    for side, tables in ensembles.items():
        members, run_distance = np.zeros(len(tables)), 0.0
        for name, channel in result.excited.items():
            mask, floor = channel.deciding
            values = np.array([table.values(name)[mask] for table in tables])
            of_members, distance = distances(values, runs[1 - side].base.values(name)[mask], floor)
            members, run_distance = np.maximum(members, of_members), max(run_distance, distance)
        farther[side] = int((members >= run_distance).sum())
        excess = min(excess, run_distance / float(members.max()) if members.max() > 0.0 else inf)
    return (farther[0], farther[1]), excess


# ---- starts of an ensemble


def too_slow(scene: Scene, model: str) -> bool:
    """Return whether a model is too slow for an ensemble at the settings of a scene, at some 10 s a run."""
    return model == "exudyn" and scene.data["solver"]["exudyn"]["formulation"] == "full"


def starting_error(runs: Runs, scene: Scene, count: int) -> tuple[float, Array]:
    """Return the initial perturbation equivalent to a model's error in the first ``count`` samples.

    That is the standard deviation of the starts of an ensemble, and w(t), shape (n,); both in m.
    """
    lengths = {"slider_x": 1.0}
    if movable(scene) == "slider":
        lengths["slider_angle"] = scene.data["mechanism"]["slider"]["length"]
    return equivalent_start(runs, lengths, perturbation(scene), count)


def equivalent_start(
    runs: Runs, lengths: Mapping[str, float], size: float, count: int
) -> tuple[float, Array]:
    """Return the result of `starting_error` for any system, in the unit of ``size``.

    ``size`` is the distance of the perturbed starts; ``lengths`` has its unit over that of each channel.
    """
    w, equivalents = np.full(runs.base.time.size, size), [np.zeros(1)]
    for name, length in lengths.items():
        if runs.finer is None or not runs.perturbed_runs:
            continue
        error = length * np.abs(runs.base.values(name) - runs.finer.values(name))[:count]
        original = runs.original.values(name)
        distance = np.max([np.abs(original - run.values(name)) for run in runs.perturbed_runs], axis=0)
        response = length * distance[:count] / size
        mask = response > _NO_RESPONSE / size
        equivalents.append(error[mask] / response[mask])
        # G is at least 1: from a start with another crank pin the slider's distance grows to that from zero.
        growth = np.maximum.accumulate(np.maximum(response, 1.0))
        equivalent = np.maximum.accumulate(np.maximum.accumulate(error) / growth)
        w[:count] = np.maximum(w[:count], equivalent)
    return max(float(np.median(np.concatenate(equivalents))), size), np.maximum.accumulate(w)


def moved_starts(scene: Scene, model: str, shift: float) -> list[Scene]:
    """Draw the starts of a model's ensemble by their standard deviation, m; always the same ones."""
    seed = int(digest({"scene": scene.hash, "model": model})[:16], 16)
    draws = shift * np.random.default_rng(seed).standard_normal((MEMBERS.get(model, OTHER_MEMBERS), 2))
    return [move_start(scene, float(offset), float(turn)) for offset, turn in draws]


def scaled_member(member: Table, base: Table, share: Array) -> Table:
    """Return a run from a moved start with its deviations from the base, at the same times, scaled."""
    centre = base.frame.drop(columns="time")
    columns = centre + (member.frame[centre.columns] - centre).mul(share, axis=0)
    return replace(member, frame=pd.concat([base.frame["time"], columns], axis=1))


def _factor(before: SceneComparison, after: SceneComparison) -> float:
    """Return the factor by which the uncertainty was underestimated, the largest of all channels.

    It is the ensembles' largest distance over u, at the samples where the difference was outside k u.
    Elsewhere an ensemble may be wider and not explain the difference. The share of these samples that a
    verdict may leave unexplained does not count, such as one in which a contact begins.
    """
    factors = []
    for channel in before.with_verdict("differ"):
        (mask, floor), ensemble_u = channel.deciding, after.channels[channel.channel].u
        assert ensemble_u is not None
        outside = np.abs(channel.difference[mask]) > channel.limits.k * floor
        ratio = ensemble_u[mask][outside] / (ENSEMBLE_FACTOR * floor[outside])
        factors.append(float(np.quantile(ratio, channel.limits.share, method="lower")))
    return max(factors)


def _parting(
    first: Sequence[Table], second: Sequence[Table], result: SceneComparison, until: float
) -> Parting | None:
    """Return the contact that separates two groups of runs; None if there is none, or no event tables."""
    one, other = ([table.events for table in group if table.events is not None] for group in (first, second))
    if not one or not other or result.period is None:
        return None
    return parting_contact((one, other), period=result.period, until=until)
