"""Validation in batches of scenes: what is finished survives an interruption, or the fault of one scene."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from comparison.accuracy.tiers import TIERS
from comparison.agreement.planned_runs import family
from comparison.cli.console import described, is_refusal
from comparison.cli.progress import Reporter
from comparison.scene import Scene
from comparison.verdict.results import no_comparison
from comparison.verdict.validate import Validation, options, validate


@dataclass(frozen=True)
class Validated:
    """Results of the scenes that were finished, in their order, and those that were not reached."""

    results: list[Validation]
    missing: list[Scene]


def validate_batches(
    scenes: Sequence[Scene],
    *,
    models: tuple[str, str],
    n_jobs: int,
    accuracy: str | None,
    tiers: Sequence[str] = TIERS,
    report: Reporter,
) -> Validated:
    """Validate scenes in their order, as many at a time as keep the workers busy.

    Parameters
    ----------
    scenes, models, n_jobs, accuracy, tiers
        As in `comparison.verdict.validate.validate`.
    report
        Gets the finished share of the expected work, and a few words on each finished batch.

    Returns
    -------
    validated
        Ctrl-C leaves out the scenes that were not finished; an error while one is compared makes it "cannot
        compare", crashed unless it is a refusal of the input.

    Raises
    ------
    Exception
        A refusal of the input before any scene is finished.
    """
    # One scene has some twenty runs, but two or three of them take most of its time.
    size = max(1, n_jobs // 2)
    waiting = [scenes[first : first + size] for first in range(0, len(scenes), size)]
    total, done = sum(_cost(scene, models) for scene in scenes), 0.0
    results: list[Validation] = []
    with suppress(KeyboardInterrupt):
        while waiting:
            batch = waiting.pop(0)
            cost = sum(_cost(scene, models) for scene in batch)
            within = _Within(report, done / total, cost / total)
            try:
                found = validate(
                    batch, models=models, n_jobs=n_jobs, accuracy=accuracy, tiers=tiers, on_progress=within
                )
            except Exception as error:
                if len(batch) > 1:  # their runs are cached: it costs little to find out which one it is
                    waiting = [[scene] for scene in batch] + waiting
                    continue
                if is_refusal(error) and not results:
                    raise
                found = [_failed(batch[0], error, models, options(models, accuracy, tiers))]
            results += found
            done += cost
            verdicts = dict.fromkeys(tier.verdict for tier in found[-1].comparison.tiers)
            name = found[-1].comparison.name
            report.finished(
                done / total, f"{len(results)} of {len(scenes)} scenes; {name}: {', '.join(verdicts)}"
            )
    return Validated(results, list(scenes[len(results) :]))


class _Within:
    """Progress of a part of the work; an ensemble that starts anew from 0 does not turn it back."""

    def __init__(self, report: Reporter, start: float, part: float) -> None:
        self._report, self._start, self._part, self._most = report, start, part, 0.0

    def __call__(self, share: float) -> None:
        self._most = max(self._most, share)
        self._report(self._start + self._part * self._most)


def _cost(scene: Scene, models: tuple[str, str]) -> float:
    return sum(job.cost for model in models for _, job in family(scene, model))


def _failed(scene: Scene, error: Exception, models: tuple[str, str], options: Sequence[str]) -> Validation:
    message, code = described(error)
    return Validation(
        no_comparison(
            scene,
            f"scene {scene.name!r}: {' '.join(message.split())}",
            labels=models,
            command=scene.command("validate", *options),
            tier="standard",
        ),
        {},
        crashed=code == 70,
    )
