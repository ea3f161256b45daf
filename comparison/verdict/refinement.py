"""Refinement of runs until their verdict stands.

Two models with tolerances whose difference ensembles confirm are judged again at a tenth and at a hundredth
of these: u of a run with few steps may be too small, and an ensemble does not show that. The first level at
which they do not differ decides. Refinement does not come first, since ensembles at finer tolerances are
narrower: they confirmed a difference in one of 259 random scenes, those at the scene's tolerance in none.

Five bodies have fixed steps. A verdict on them other than "agree" is judged again at half the step, until it
is "agree" or has outlasted two halvings: "indeterminate" then stands, and a difference stands unless the tree
of the same package, at the tight tier, agrees. If the levels end before, a difference stands only if the
tree shows it too.

Three step sizes can err alike in stiff contacts (measured at 0.4 mm of clearance: errors of x of 1.3e-6,
7.5e-7, 7.7e-7, 1.2e-8 and 3.0e-9 m at 2, 1, 0.5, 0.25 and 0.125 us). An ensemble does not show that: its runs
have other starts, not other steps. Numerical errors, the cause of nearly all differences, vanish with the
step; where "indeterminate" does not, the motion cannot be predicted.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from comparison.accuracy.levels import finer, tight
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import VIOLATED, Outcome
from comparison.scene import Scene
from comparison.verdict.compare import compare
from comparison.verdict.confirmation import Run, confirm, judge_again, too_slow
from comparison.verdict.results import SceneComparison

ENOUGH_LEVELS = 2
"""Levels finer than the first judgement after which "indeterminate" stands, and "differ" can stand."""
MOST_LEVELS = 4
"""Levels finer than the first judgement at most: 2 us become 0.125 us, in 16 times the time of a run."""
SMALLEST_STEP = 1.2e-7
"""Smallest step beyond `ENOUGH_LEVELS`, s; below it a run of two cycles takes minutes."""
FINEST_TOLERANCE = 1e-12
"""Finest tolerance of the reference; its finer run has a tenth, below which there is only round-off."""
CONVERGED = 0.25
"""Largest share of a difference by which the last two refinements may move the run, at the median of the
samples that differ. At second order a difference that is an error makes a run move by three quarters of it.
"""

RunFamilies = Callable[[Scene], tuple[Runs, Runs] | None]
"""Runs the families of both models at the settings of a scene; None if a run did not succeed."""


@dataclass(frozen=True)
class Judgement:
    """A verdict, with the runs and the scene's settings on which it rests."""

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
) -> Judgement:
    """Confirm a verdict "differ" by ensembles and by refinement, which for fixed steps comes first.

    ``run_families`` is called once a level, and once for the third opinion; the rest is as in `confirm`.
    """

    def confirm_last(last: Judgement) -> Judgement:
        comparison = confirm(last.comparison, last.runs, scene=last.scene, models=models, run=run)
        return replace(last, comparison=comparison)

    @cache
    def tree_verdict() -> str:
        """Return the verdict at the tight tier if the tree replaces five bodies there; else ""."""
        finer_scene = tight(scene, models)
        if finer_scene is None or any(too_slow(finer_scene, model) for model in models):
            return ""
        if (families := run_families(finer_scene)) is None:
            return ""
        comparison = compare(*families, scene=finer_scene, labels=result.labels, tier="tight")
        return confirm(comparison, families, scene=finer_scene, models=models, run=run).verdict

    levels = [Judgement(result, runs, scene)]
    if not any(too_slow(scene, model) for model in models):
        return _judge_at_finer_tolerances(confirm_last(levels[0]), models, run_families)
    while True:
        last = levels[-1]
        verdict = last.comparison.verdict
        if verdict == "agree" or (verdict == "indeterminate" and len(levels) > ENOUGH_LEVELS):
            return last
        finer_scene = _finer(last.scene, models, len(levels))
        outlasts = verdict == "differ" and _outlasts(levels, models)
        if outlasts and (finer_scene is None or tree_verdict() != "agree"):
            return confirm_last(last)
        families = None if finer_scene is None else run_families(finer_scene)
        if finer_scene is None or families is None:
            break
        comparison = judge_again(result, families, finer_scene)
        comparison = replace(comparison, refined=result.refined + len(levels), halved=True)
        levels.append(Judgement(comparison, families, finer_scene))
    if verdict == "indeterminate":
        return last
    if tree_verdict() == "differ":
        return confirm_last(last)
    unsettled = replace(last.comparison, verdict="indeterminate", unsettled=True, causes=())
    return replace(last, comparison=unsettled)


def _judge_at_finer_tolerances(
    judgement: Judgement, models: tuple[str, str], run_families: RunFamilies
) -> Judgement:
    """Return the first judgement at finer tolerances of both models without a difference, else the given."""
    result, scene = judgement.comparison, judgement.scene
    if result.verdict != "differ" or None in [finer(model, scene) for model in models]:
        return judgement
    for level in range(1, ENOUGH_LEVELS + 1):
        finer_scene = _finer(scene, models, level)
        if finer_scene is None or (families := run_families(finer_scene)) is None:
            break
        scene = finer_scene
        comparison = replace(judge_again(result, families, scene), refined=result.refined + level)
        if comparison.verdict != "differ":
            return Judgement(comparison, families, scene)
    return judgement


def without_violation(
    scene: Scene,
    failures: Sequence[tuple[str, Outcome]],
    models: tuple[str, str],
    run_families: RunFamilies,
) -> tuple[Scene, tuple[Runs, Runs], tuple[str]] | None:
    """Return scene, runs and warning one level finer, if all failed runs are five bodies with a violation."""
    if any(outcome.status != VIOLATED or not too_slow(scene, model) for model, outcome in failures):
        return None
    finer_scene = _finer(scene, models, 1)
    runs = None if finer_scene is None else run_families(finer_scene)
    if finer_scene is None or runs is None:
        return None
    step = scene.data["solver"]["exudyn"]["step"]
    messages = "; ".join(outcome.message for _, outcome in failures)
    warning = f"judged at half the scene's step, {step:g} s, at which five bodies fail: {messages}"
    return finer_scene, runs, (warning,)


def _finer(scene: Scene, models: Sequence[str], level: int) -> Scene | None:
    """Return the scene with each model one level finer that has one; None at the last, or if none has."""
    finer_scene = scene
    for model in dict.fromkeys(models):
        tolerance = scene.data["solver"].get(model, {}).get("tolerance", 1.0)
        if not (model == "reference" and tolerance <= 1.01 * FINEST_TOLERANCE):
            finer_scene = finer(model, finer_scene) or finer_scene
    if finer_scene is scene or level > MOST_LEVELS:
        return None
    small = finer_scene.data["solver"]["exudyn"]["step"] < SMALLEST_STEP
    return None if small and level > ENOUGH_LEVELS else finer_scene


def _outlasts(levels: Sequence[Judgement], models: Sequence[str]) -> bool:
    """Return whether the difference of the last level has outlasted two refinements of fixed steps."""
    if len(levels) <= ENOUGH_LEVELS:
        return False
    comparison, scene = levels[-1].comparison, levels[-1].scene
    sides = [side for side, model in enumerate(models) if too_slow(scene, model)]
    ratios = []
    for channel in comparison.with_verdict("differ"):
        mask, u = channel.deciding
        difference = np.abs(channel.difference[mask])
        outside = difference > channel.limits.k * u
        values = [
            [level.runs[side].base.values(channel.channel)[mask] for side in sides] for level in levels[-3:]
        ]
        changes = np.abs(np.diff(values, axis=0)).max(axis=(0, 1))
        ratios.append(changes[outside] / difference[outside])
    # Without ratios a time shift alone exceeds the tolerance.
    return not ratios or bool(np.median(np.concatenate(ratios)) <= CONVERGED)
