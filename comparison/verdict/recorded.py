"""Comparison of two tables in one call, and of two programs by tables of their runs."""

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Pairs
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np

from comparison.accuracy.levels import recorded_refinement
from comparison.accuracy.uncertainty import SAFETY_FACTOR, TIME_ROUND_OFF, Runs
from comparison.scene import Scene, as_scene
from comparison.tables.align import unwrap_like
from comparison.tables.arguments import Results, as_mapping, as_source
from comparison.tables.dialect import Source
from comparison.tables.foreign import read_tables
from comparison.tables.mapping import Mapping
from comparison.tables.table import Table, TableError
from comparison.verdict.channel import NO_CRITERIA, Criteria
from comparison.verdict.compare import compare as compare_runs
from comparison.verdict.compare import recorded_scene
from comparison.verdict.confirmation import confirm_by_ensembles, with_doubt
from comparison.verdict.results import Doubt, SceneComparison


def compare(
    a: Results,
    b: Results,
    *,
    scene: Scene | str | Path | None = None,
    tolerance: float | None = None,
    share: float = 1.0,
    mapping: Mapping | str | Path | None = None,
    labels: Sequence[str] = ("a", "b"),
    **options: Any,
) -> SceneComparison:
    """Compare two tables, channel by channel, with a tolerance.

    Parameters
    ----------
    a, b
        The trusted one first. Tables such as `sixbar.simulate` returns, data frames whose time (s) is a
        column or the index, or paths, also of other programs' files.
    scene
        Gives the scales of the channels; None: the scene recorded in both tables, else scales are ranges.
    tolerance
        Largest difference, as a share of each channel's scale; None: that of the scene. Where nothing limits
        a channel the verdict is "indeterminate".
    share
        Share of the samples that must be within the tolerance.
    mapping
        Mapping of the columns to channels, or the path of a mapping file.
    labels
        Names of the two in messages.
    options
        Other fields of `comparison.verdict.channel.Criteria`: ``channels``, ``tolerances``, ``absolute``,
        ``time_tolerance``, ``gate``, ``at_events``, ``common_time``, ``period``, ``until``.

    Returns
    -------
    SceneComparison
        ``verdict``: "agree", "differ" or "indeterminate"; ``channels``: name -> its own verdict, largest and
        RMS difference, metrics; ``warnings``.

    Raises
    ------
    TableError
        If the tables cannot be read or compared, or an option is wrong.
    SceneError
        If the scene cannot be read.

    Examples
    --------
    >>> import sixbar
    >>> scene = sixbar.load_scene("150rpm-0.2mm", {"drive.cycles": 0.02})
    >>> run = sixbar.simulate(scene)
    >>> moved = run.frame.assign(slider_x=run.frame["slider_x"] + 1e-6)  # 0.5 % of the clearance
    >>> comparison = sixbar.compare(run, moved, scene=scene, tolerance=1e-3)
    >>> comparison.verdict, [name for name, one in comparison.channels.items() if one.verdict == "differ"]
    ('differ', ['slider_x'])
    """
    criteria = Criteria(tolerance=tolerance, share=share, **options)
    if not isinstance(labels, list | tuple) or len(labels) != 2:
        raise TableError(f"labels = {labels!r} must be two names")
    first, second = (str(label) for label in labels)
    return compare_files(
        [("base", as_source(a, first))],
        [("base", as_source(b, second))],
        labels=(first, second),
        scene=None if scene is None else as_scene(scene),
        mapping=as_mapping(mapping),
        criteria=criteria,
    )


@dataclass(frozen=True)
class ProgramRuns:
    """Runs of one program; without a finer one it has no uncertainty, and must have no other run.

    The first two perturbed runs are part of the uncertainty, at the coarser setting if there is such a run;
    any others form an ensemble at the setting of the base. ``refinement`` is the factor between two settings
    and the order of the error; None: as recorded beside the base.
    """

    base: Table
    finer: Table | None = None
    coarser: Table | None = None
    perturbed: Sequence[Table] = ()
    refinement: tuple[float, float] | None = None
    rigid: bool = False  # no start can be moved, so no motions diverge

    @property
    def known_refinement(self) -> tuple[float, float] | None:
        """Factor and order of the field, else those of the recorded model; None for another program."""
        record = self.base.provenance
        model, scene = record.get("model"), record.get("scene")
        if self.refinement is not None or not isinstance(model, str) or not isinstance(scene, dict):
            return self.refinement
        settings = scene.get("solver", {}).get(model)
        return recorded_refinement(model, settings) if isinstance(settings, dict) else None

    @property
    def runs(self) -> Runs:
        """All runs except the ensemble."""
        first, second, *_ = (*self.perturbed, None, None)
        refinement = filter(None, [self.known_refinement])
        return Runs(self.base, self.finer, first, self.coarser, second, *refinement)

    def each(self, change: Callable[[Table], Table]) -> Self:
        """Return the program with all its runs changed."""
        finer, coarser = (run and change(run) for run in (self.finer, self.coarser))
        perturbed = [change(run) for run in self.perturbed]
        return replace(self, base=change(self.base), finer=finer, coarser=coarser, perturbed=perturbed)


Files = Sequence[tuple[str, Path | Source]]
"""Tables of one program, each with the field of `ProgramRuns` that it is for, or "repeat"."""
Errors = Pairs[str, float] | None
"""Errors of a table, by channel, in its unit."""


def compare_files(
    a: Files,
    b: Files,
    *,
    labels: tuple[str, str],
    scene: Scene | None = None,
    mapping: Mapping | None = None,
    refinements: tuple[tuple[float, float] | None, tuple[float, float] | None] = (None, None),
    errors: tuple[Errors, Errors] = (None, None),
    criteria: Criteria = NO_CRITERIA,
) -> SceneComparison:
    """Read and compare the tables of two programs, as ``sixbar compare`` and the fixture of pytest do.

    Without a scene the one recorded beside the tables counts. Options that neither the criteria nor the
    mapping state are those of the scene. ``errors`` are the stated ones of tables without a finer run, by
    channel. An option without effect gives a warning. The errors raised are those of `compare_recorded` and
    `comparison.tables.foreign.read_tables`.
    """
    files, sides = [file for _, file in (*a, *b)], ["a"] * len(a) + ["b"] * len(b)
    tables, warnings = read_tables(files, sides, mapping, criteria.at_events, only=criteria.channels)
    if scene is None:
        scene, notes = recorded_scene(tables[0], tables[len(a)])
        warnings += notes
    first = _program_runs(a, tables[: len(a)], refinements[0], errors[0])
    second = _program_runs(b, tables[len(a) :], refinements[1], errors[1])
    uncertain = first.finer is not None or second.finer is not None
    defaults = [] if scene is None else [scene.compare.model_dump()]
    defaults += [] if mapping is None else [{"gate": mapping.gate, "channels": mapping.compare}]
    all_criteria = criteria.over(*defaults)
    options = {
        "--tolerance": criteria.tolerance is not None or bool(criteria.tolerances),
        "--time-tolerance": "time_tolerance" in criteria.model_fields_set,
        "--share": criteria.share < 1,
        "--absolute": criteria.absolute,
        "the gate": bool(all_criteria.gate),
    }
    names, why = [], ""
    if uncertain:
        names, why = list(options), ": the uncertainty from finer runs decides"
    elif all_criteria.tolerance is None and not all_criteria.tolerances:
        names, why = ["--time-tolerance", "--share", "--absolute"], " without a tolerance"
    warnings += tuple(f"{name} has no effect{why}" for name in names if options[name])
    if criteria.until is not None and not uncertain:
        warnings += ("--until has no effect: without finer runs it is unknown what is predictable",)
    result = compare_recorded(
        first,
        second,
        scene=scene,
        labels=labels,
        warnings=warnings,
        criteria=all_criteria,
    )
    from_errors = [
        bool(error) or any(kind == "repeat" for kind, _ in side)
        for side, error in zip((a, b), errors, strict=True)
    ]
    return without_error(result, (first, second), from_errors)


def without_error(
    result: SceneComparison, programs: Sequence[ProgramRuns], from_errors: Sequence[bool]
) -> SceneComparison:
    """Warn of channels without a known error, where other channels, or further runs, promise one.

    A difference of equal runs is unconfirmed. ``from_errors`` is True for a program whose errors, or repeats
    of its table, take the place of a finer run.
    """
    for label, program, from_error in zip(result.labels, programs, from_errors, strict=True):
        if program.finer is None:
            continue
        names = [*(result.excited if from_error else program.base.names)]
        ties = [n for n in names if np.array_equal(program.finer.values(n), program.base.values(n))]
        if from_error and ties:
            line = f"no error is known of {', '.join(ties)}, which counts as exact apart from its round-off"
        elif ties == names:
            line = "runs at two settings are equal: is the setting used?"
        else:
            continue
        result = replace(result, warnings=(*result.warnings, f"{label}: {line}"))
        if ties == names and result.verdict == "differ" and result.confirmation:
            result = with_doubt(result, Doubt.NO_EFFECT, result.confirmation.members)
    return result


def _program_runs(
    files: Files, tables: Sequence[Table], refinement: tuple[float, float] | None, errors: Errors
) -> ProgramRuns:
    pairs = [(kind, table) for (kind, _), table in zip(files, tables, strict=True)]
    repeats, perturbed = ([t for kind, t in pairs if kind == which] for which in ("repeat", "perturbed"))
    runs: dict[str, Any] = {kind: table for kind, table in pairs if kind not in ("repeat", "perturbed")}
    if repeats or errors:
        if "finer" in runs:
            raise TableError(f"{files[0][1]}: has a finer run, from which its error follows; state no other")
        runs["finer"] = with_errors(runs["base"], errors or {}, repeats)
    return ProgramRuns(**runs, perturbed=perturbed, refinement=refinement)


def with_errors(base: Table, errors: Pairs[str, float], repeats: Sequence[Table] = ()) -> Table:
    """Return a run in place of a finer one, which gives a table its known errors.

    By channel u is the stated number, or `SAFETY_FACTOR` times the largest distance of the table's repeats.
    """
    if unknown := [name for name in errors if name not in base.channels]:
        raise TableError(f"{unknown[0]!r}, of which an error is stated, is not a channel of the table")
    repeats = [_align_times(run, base) for run in repeats]
    if any(not np.array_equal(run.time, base.time) for run in repeats):
        raise TableError("a repeat must have the times of its table")
    frame = base.frame.copy()
    for name in base.channels:
        distances = [np.abs(run.values(name) - base.values(name)) for run in repeats if name in run.names]
        frame[name] += np.max(
            [np.full(base.time.size, errors.get(name, 0.0) / SAFETY_FACTOR), *distances], axis=0
        )
    return replace(base, frame=frame)


def compare_recorded(
    a: ProgramRuns,
    b: ProgramRuns,
    *,
    scene: Scene | None,
    labels: tuple[str, str],
    warnings: tuple[str, ...] = (),
    criteria: Criteria = NO_CRITERIA,
    before: SceneComparison | None = None,
) -> SceneComparison:
    """Compare two programs by their runs, and confirm a difference by their ensembles.

    With a finer run they are judged by their uncertainty, without by the criteria; errors, and ``before``,
    are those of `comparison.verdict.compare.compare`.
    """
    for label, program in zip(labels, (a, b), strict=True):
        if program.finer is None and (program.coarser is not None or program.perturbed):
            raise TableError(f"{label}: coarser and perturbed runs count only beside a finer one")
    if (a.finer is None) != (b.finer is None):
        owner, exact = labels[::-1] if a.finer is None else labels
        warnings += (f"only the error of {owner} is known: {exact} counts as exact apart from its round-off",)
        a, b = (program if program.finer else replace(program, finer=program.base) for program in (a, b))
    a, b = (program.each(partial(_align_times, base=program.base)) for program in (a, b))
    if a.finer is not None:
        # Without whole revolutions, runs that count them differently have equal angles.
        a, b = (program.each(partial(unwrap_like, like=a.base)) for program in (a, b))
        for label, program in zip(labels, (a, b), strict=True):
            warnings += _assumptions(label, program)
    runs = a.runs, b.runs
    options: dict[str, Any] = {"labels": labels, "warnings": warnings, "before": before}
    judge = partial(compare_runs, *runs, scene=scene, criteria=criteria, **options)
    result = judge()
    if a.finer is None or result.verdict != "differ":
        return result
    ensembles = {n: program.perturbed[2:] for n, program in enumerate((a, b)) if program.perturbed[2:]}
    if not ensembles:
        return with_doubt(result, Doubt.NO_STARTS)
    return confirm_by_ensembles(result, runs, ensembles, lambda pair: judge(ensembles=pair))


def _align_times(run: Table, base: Table) -> Table:
    """Return a run with the times of the base, where they differ by the rounding of added steps."""
    for table in (run, base):  # the comparison refuses times that are no numbers
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


def _assumptions(label: str, program: ProgramRuns) -> tuple[str, ...]:
    """Return a warning of the assumptions of a program's uncertainty in place of missing runs or orders."""
    parts = []
    if not program.perturbed and not program.rigid:
        parts.append("without perturbed runs its uncertainty leaves out how neighbouring motions diverge")
    if program.coarser is not None and program.known_refinement is None:
        factor, order = program.runs.refinement
        assumption = f"factor {factor:g} between its settings and order {order:g} of its error are assumed"
        parts.append(f"{assumption} (--refinement)")
    return (f"{label}: {'; '.join(parts)}",) if parts else ()
