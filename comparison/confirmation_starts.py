"""Where the runs of an ensemble start: moved at random by what a model's own error is worth at the start.

An error e of the start has grown to G e where the response is G. The perturbed runs of a model show G: they
were moved by a known distance. So the error |S - S_f| of its run is worth |S - S_f| / G at the start. Taken
is the median over x, and the angle times the slider's length, at all samples before the first unpredictable
one. Moved by |S - S_f| itself, an ensemble would spread G times as far as the model errs (measured: median 6
in x, 90 in the angle, in the first cycle of poisson-0.33) and hide what differs. Moved by less than the
perturbed runs were, it would be narrower than what it is to correct: never less than a billionth of the
clearance.
"""

from __future__ import annotations

import numpy as np

from comparison.findings import SceneComparison
from comparison.scene import Scene, digest
from comparison.uncertainty import Runs, movable, moved, twin_shift

MEMBERS = {"reference": 99}
"""Runs in an ensemble, by model; the reference takes 0.03 s each."""
OTHER_MEMBERS = 30
"""Of any other model; Exudyn's tree takes about 1 s a run at the tight tier."""
ENOUGH = 19
"""Members that can show a rank of 5 %; with fewer nothing is confirmed, nor taken back."""
FIVE_BODIES = ("full", "native")
"""Formulations of Exudyn that are too slow for an ensemble: some 10 s a run."""
# Responses below it are round-off: a few operations on coordinates of 0.55 m.
_NO_RESPONSE = 1e-15


def ensemble_shifts(
    result: SceneComparison, runs: tuple[Runs, Runs], scene: Scene, models: tuple[str, str]
) -> dict[int, float]:
    """Return by how much to move the starts of each model's ensemble, m (one standard deviation).

    A model that is too slow for an ensemble has none: its run is ranked in the other's, moved by the larger
    of both errors.

    Parameters
    ----------
    result
        Says what is predictable.
    runs, scene, models
        As in `comparison.confirmation.confirm`; the start is `movable`.

    Returns
    -------
    dict
        0 for the first model, 1 for the second.
    """
    errors = [starting_error(of, scene, _predictable_samples(result)) for of in runs]
    slow = [
        model == "exudyn" and scene.data["solver"]["exudyn"]["formulation"] in FIVE_BODIES for model in models
    ]
    return {side: max(errors) if any(slow) else errors[side] for side in (0, 1) if not slow[side]}


def starting_error(of: Runs, scene: Scene, before: int) -> float:
    """Return what a model's error before its amplification is worth at the start, m; see above.

    Parameters
    ----------
    of
        The model's runs.
    scene
        Whose start is `movable`.
    before
        Number of samples before the first unpredictable one.
    """
    shift = twin_shift(scene)
    lengths = {"slider_x": 1.0}
    if movable(scene) == "slider":
        lengths["slider_angle"] = scene.data["mechanism"]["slider"]["length"]
    worth = []
    for name, length in lengths.items():
        if of.finer is None or not of.twins:
            continue
        error = length * np.abs(of.base.values(name) - of.finer.values(name))[:before]
        original = of.original.values(name)
        apart = np.max([np.abs(original - twin.values(name)) for twin in of.twins], axis=0)
        response = length * apart[:before] / shift
        known = response > _NO_RESPONSE / shift
        worth.append(error[known] / response[known])
    all_worth = np.concatenate([np.zeros(1), *worth])
    return max(float(np.median(all_worth)), shift)


def moved_starts(scene: Scene, model: str, shift: float) -> list[Scene]:
    """Draw the starts of a model's ensemble, normally distributed in both coordinates; always the same ones.

    Parameters
    ----------
    scene
        Whose start is `movable`.
    model
        Whose ensemble: every model draws starts of its own.
    shift
        Standard deviation of the slider's offset, and of its angle times its length, m.
    """
    seed = int(digest({"scene": scene.hash, "model": model})[:16], 16)
    draws = shift * np.random.default_rng(seed).standard_normal((MEMBERS.get(model, OTHER_MEMBERS), 2))
    return [moved(scene, float(across), float(turned)) for across, turned in draws]


def _predictable_samples(result: SceneComparison) -> int:
    """Return how many samples come before the first at which the slider's position is not predictable."""
    positions = [result.channels[name] for name in ("slider_x", "slider_angle") if name in result.channels]
    first = [int(channel.predictable.argmin()) for channel in positions if not channel.predictable.all()]
    return min(first, default=result.time.size)
