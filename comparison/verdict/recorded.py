"""Comparison of two programs by runs that exist as tables, for programs that cannot be started here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from comparison.accuracy.levels import recorded_refinement
from comparison.accuracy.uncertainty import TIME_ROUND_OFF, Runs
from comparison.scene import Scene
from comparison.tables.align import unwound
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import compare
from comparison.verdict.confirmation import decided, unconfirmed
from comparison.verdict.results import Doubt, SceneComparison


@dataclass(frozen=True)
class Recorded:
    """Runs of one program; without a finer one it has no uncertainty, and nothing else may be given.

    The first two perturbed runs are part of the uncertainty, at the coarser setting if there is such a run;
    any more form an ensemble at the setting of the base. ``refinement`` is the factor between two settings
    and the order of the error; None: as recorded beside the base.
    """

    base: Table
    finer: Table | None = None
    coarser: Table | None = None
    perturbed: Sequence[Table] = ()
    refinement: tuple[float, float] | None = None

    @property
    def known_refinement(self) -> tuple[float, float] | None:
        """Factor and order as given, else those of the recorded model; None for another program."""
        record = self.base.provenance
        model, scene = record.get("model"), record.get("scene")
        if self.refinement is not None or not isinstance(model, str) or not isinstance(scene, dict):
            return self.refinement
        settings = scene.get("solver", {}).get(model)
        return recorded_refinement(model, settings) if isinstance(settings, dict) else None

    @property
    def runs(self) -> Runs:
        """All but the ensemble."""
        first, second, *_ = (*self.perturbed, None, None)
        known = self.known_refinement
        return Runs(self.base, self.finer, first, self.coarser, second, *([] if known is None else [known]))

    def each(self, change: Callable[[Table], Table]) -> Recorded:
        """Return the program with all its runs changed."""
        finer, coarser = (run and change(run) for run in (self.finer, self.coarser))
        perturbed = [change(run) for run in self.perturbed]
        return replace(self, base=change(self.base), finer=finer, coarser=coarser, perturbed=perturbed)


def compare_recorded(
    a: Recorded,
    b: Recorded,
    *,
    scene: Scene | None,
    labels: tuple[str, str],
    warnings: tuple[str, ...] = (),
    **options: Any,
) -> SceneComparison:
    """Compare two programs by their runs, and confirm a difference by their ensembles.

    With a finer run each they are judged by their uncertainty, with neither by the tolerance; further options
    and what is raised as of `comparison.verdict.compare.compare`.
    """
    for label, program in zip(labels, (a, b), strict=True):
        if program.finer is None and (program.coarser is not None or program.perturbed):
            raise TableError(f"{label}: coarser and perturbed runs count only beside a finer one")
    if (a.finer is None) != (b.finer is None):
        lacks = labels[0] if a.finer is None else labels[1]
        raise TableError(f"{lacks} has no finer run, the other one has: an uncertainty needs both or neither")
    a, b = (program.each(partial(_at_its_times, base=program.base)) for program in (a, b))
    if a.finer is not None:
        # Whole revolutions are taken out of the angles: runs that count them differently are one.
        a, b = (program.each(partial(unwound, like=a.base)) for program in (a, b))
        for label, program in zip(labels, (a, b), strict=True):
            warnings += _assumed(label, program)
    runs = a.runs, b.runs
    judge = partial(compare, *runs, scene=scene, labels=labels, warnings=warnings, **options)
    result = judge()
    if a.finer is None or result.verdict != "differ":
        return result
    ensembles = {n: program.perturbed[2:] for n, program in enumerate((a, b)) if program.perturbed[2:]}
    if not ensembles:
        return unconfirmed(result, Doubt.NO_STARTS)
    return decided(result, runs, ensembles, lambda large: judge(ensembles=large))


def _at_its_times(run: Table, base: Table) -> Table:
    """Give a run the times of the base where they differ by what adding up steps rounds."""
    for table in (run, base):  # what is no number is refused by the comparison
        if table.frame["time"].dtype.kind not in "fiu" or table.time.size == 0:
            return run
    time = base.time
    if run.time.size != time.size:
        return run
    # Late times round coarsely.
    rounding = max(TIME_ROUND_OFF * (time[-1] - time[0]), 4 * np.spacing(np.abs(time).max()))
    if not 0.0 < np.abs(run.time - time).max() <= rounding:
        return run
    return replace(run, frame=run.frame.assign(time=time))


def _assumed(label: str, program: Recorded) -> tuple[str, ...]:
    """Return what the uncertainty of a program rests on for want of runs or of a statement."""
    parts = []
    if not program.perturbed:
        parts.append("without perturbed runs its uncertainty leaves out how neighbouring motions diverge")
    if program.coarser is not None and program.known_refinement is None:
        factor, order = program.runs.refinement
        parts.append(f"factor {factor:g} between its settings and order {order:g} of its error are assumed")
    return (f"{label}: {'; '.join(parts)}",) if parts else ()
