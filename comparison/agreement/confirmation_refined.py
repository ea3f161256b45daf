"""A difference that the numerical error of a slow model explains, asked again of finer runs.

Exudyn's five bodies are ranked in an ensemble of the other model that their own error moves. At the standard
tier that error is large: an ensemble so wide also covers small faults of either model. So where it explains
a difference, both models run two levels finer (five bodies at a quarter of the step, with a sixteenth of the
error), and the same rule decides on these runs: what differs there, and is confirmed there, is a difference
of models. Numerical errors, the cause of nearly all differences that are taken back, vanish with the step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from comparison.accuracy.levels import finer
from comparison.accuracy.uncertainty import Runs
from comparison.agreement.compare import compare
from comparison.agreement.confirmation import Run, confirm
from comparison.agreement.confirmation_starts import too_slow
from comparison.agreement.results import SceneComparison
from comparison.scene import Scene

LEVELS = 2
"""How many levels finer; the finer run that the uncertainty rests on is one."""

RunFamilies = Callable[[Scene], tuple[Runs, Runs] | None]
"""Runs the families of both models at the settings of a scene; None if a run did not succeed."""


def confirm_refined(
    result: SceneComparison,
    runs: tuple[Runs, Runs],
    *,
    scene: Scene,
    models: tuple[str, str],
    run: Run,
    run_families: RunFamilies,
) -> SceneComparison:
    """Confirm a verdict "differ" by ensembles; where they explain it for a slow model, by finer runs.

    Parameters
    ----------
    result, runs, scene, models, run
        As of `comparison.agreement.confirmation.confirm`.
    run_families
        Called at most once.

    Returns
    -------
    comparison
        As of `confirm`. Confirmed by finer runs, it still shows the runs at the scene's own settings.
    """
    explained = confirm(result, runs, scene=scene, models=models, run=run)
    found = explained.confirmation
    if found is None or found.outcome != "underestimated" or not any(too_slow(scene, m) for m in models):
        return explained
    closer = refined(scene, models)
    again = None if closer is None else run_families(closer)
    if closer is None or again is None:
        return explained
    judged = confirm(
        compare(*again, scene=closer, labels=result.labels, tier=result.tier, only=list(result.channels)),
        again,
        scene=closer,
        models=models,
        run=run,
    )
    if judged.confirmation is not None and judged.confirmation.outcome == "confirmed":
        sentence = f"{judged.confirmation.sentence}; all these runs are two levels finer than the scene's"
        return replace(result, confirmation=replace(judged.confirmation, refined="differ", sentence=sentence))
    verdict = {"agree": "they agree", "indeterminate": "too little is predictable"}.get(judged.verdict)
    if verdict is None:
        return explained
    sentence = f"{found.sentence}; with both models two levels finer {verdict}"
    return replace(explained, confirmation=replace(found, refined=judged.verdict, sentence=sentence))


def refined(scene: Scene, models: Sequence[str]) -> Scene | None:
    """Return the scene with the settings of both models `LEVELS` finer; None if one cannot be refined."""
    closer: Scene | None = scene
    for model in models:
        for _ in range(LEVELS):
            closer = None if closer is None else finer(model, closer)
    return closer
