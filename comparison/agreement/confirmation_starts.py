"""Starts of an ensemble's runs: random perturbations equivalent to a model's own error at the start.

An error e of the start has grown to G e where the response is G. The perturbed runs of a model show G: they
were moved by a known distance. So the error |S - S_f| of its run is equivalent to |S - S_f| / G at the start.
The starts lie apart by the median over x, and the angle times the slider's length, at all samples before the
first unpredictable one. Moved by |S - S_f| itself, an ensemble would spread G times as far as the model errs
(measured: median 6 in x, 90 in the angle, in the first cycle of poisson-0.33) and hide what differs.

But an integration error is not present from the start: that of the five bodies is
7e-4 (90rpm-0.5mm) and 2e-3 (90rpm-0.1mm) of what it becomes, before the first contact. Until t its equivalent
is

    w(t) = max over s <= t of  max(|S - S_f|, until s) / max(G, until s),

and where that is less than the distance of the starts, the deviations of the members at t are scaled down
accordingly (`arrived`).

Moved by less than the perturbed runs were, an ensemble would be narrower than what it is to correct: both are
never less than those (`comparison.accuracy.uncertainty.perturbation`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.accuracy.uncertainty import Runs, movable, moved, perturbation
from comparison.agreement.results import SceneComparison
from comparison.scene import Scene, digest
from comparison.tables.arrays import Array
from comparison.tables.table import Table

MEMBERS = {"reference": 99}
"""Runs in an ensemble, by model; the reference takes 0.03 s each."""
OTHER_MEMBERS = 30
"""Of any other model; Exudyn's tree takes about 1 s a run at the tight tier."""
ENOUGH = 19
"""Members that can show a rank of 5 %; with fewer nothing is confirmed, nor taken back."""
# Responses below it are round-off: a few operations on coordinates of 0.55 m.
_NO_RESPONSE = 1e-15


class StartingError(NamedTuple):
    """Initial perturbation equivalent to a model's error."""

    shift: float
    """Standard deviation of the starts of an ensemble, m."""
    until: Array
    """Equivalent error accumulated until each sample, w(t), m, shape (n,)."""

    @property
    def share(self) -> Array:
        """Weight of the members' deviations at each sample, up to 1, shape (n,)."""
        return np.minimum(self.until / self.shift, 1.0)


def ensemble_errors(
    result: SceneComparison, runs: tuple[Runs, Runs], scene: Scene, models: tuple[str, str]
) -> dict[int, StartingError]:
    """Return the spread of the starts of each model's ensemble, and the growth of that error.

    A model too slow for an ensemble has none: its run is ranked in the other's, with the larger of both
    errors.

    Parameters
    ----------
    result
        Says what is predictable.
    runs, scene, models
        As in `comparison.agreement.confirmation.confirm`; the start is `movable`.

    Returns
    -------
    dict
        0 for the first model, 1 for the second.
    """
    before = _predictable_samples(result)
    errors = [starting_error(of, scene, before) for of in runs]
    slow = [too_slow(scene, model) for model in models]
    if any(slow):
        larger = StartingError(max(e.shift for e in errors), np.maximum(*(e.until for e in errors)))
        errors = [larger, larger]
    return {side: errors[side] for side in (0, 1) if not slow[side]}


def too_slow(scene: Scene, model: str) -> bool:
    """Return whether a model is too slow for an ensemble at the settings of a scene, at some 10 s a run."""
    return model == "exudyn" and scene.data["solver"]["exudyn"]["formulation"] == "full"


def starting_error(of: Runs, scene: Scene, before: int) -> StartingError:
    """Return the initial perturbation equivalent to a model's error; see above.

    Parameters
    ----------
    of
        The model's runs.
    scene
        Whose start is `movable`.
    before
        Number of samples before the first unpredictable one; later ones add nothing.
    """
    least = perturbation(scene)
    until = np.full(of.base.time.size, least)
    lengths = {"slider_x": 1.0}
    if movable(scene) == "slider":
        lengths["slider_angle"] = scene.data["mechanism"]["slider"]["length"]
    worth = [np.zeros(1)]
    for name, length in lengths.items():
        if of.finer is None or not of.perturbed_runs:
            continue
        error = length * np.abs(of.base.values(name) - of.finer.values(name))[:before]
        original = of.original.values(name)
        apart = np.max([np.abs(original - run.values(name)) for run in of.perturbed_runs], axis=0)
        response = length * apart[:before] / least
        known = response > _NO_RESPONSE / least
        worth.append(error[known] / response[known])
        # At once by the start's own distance: the crank pin's, where that is moved, grows into it.
        grown = np.maximum.accumulate(np.maximum(response, 1.0))
        arisen = np.maximum.accumulate(np.maximum.accumulate(error) / grown)
        until[:before] = np.maximum(until[:before], arisen)
    until = np.maximum.accumulate(until)
    return StartingError(max(float(np.median(np.concatenate(worth))), least), until)


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


def arrived(members: Sequence[Table], base: Table, share: Array) -> list[Table]:
    """Return an ensemble whose members deviate from the model's run by what has arisen until each sample.

    Parameters
    ----------
    members
        Runs from moved starts.
    base
        The run from the start itself; the members have its times and channels.
    share
        Shape (n,), see `StartingError`.
    """
    centre = base.frame.drop(columns="time")
    return [
        replace(
            member,
            frame=pd.concat(
                [base.frame["time"], centre + (member.frame[centre.columns] - centre).mul(share, axis=0)],
                axis=1,
            ),
        )
        for member in members
    ]


def _predictable_samples(result: SceneComparison) -> int:
    """Return how many samples come before the first at which the slider's position is not predictable."""
    positions = [result.channels[name] for name in ("slider_x", "slider_angle") if name in result.channels]
    first = [int(channel.predictable.argmin()) for channel in positions if not channel.predictable.all()]
    return min(first, default=result.time.size)
