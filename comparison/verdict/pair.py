"""Judgement of any two solvers by runs of their own: ``sixbar judge`` and `sixbar.judge`.

Each side runs at its setting, a level finer and a level coarser, and twice at the coarser from a start moved
at random in all states; `comparison.verdict.recorded` judges these runs. Only a difference needs more. It
must outlast further levels at the same samples, two with fixed steps: at some samples three steps often err
alike, as where an impact is found at the end of a step, and which samples is chance. Then ensembles confirm
it. Their starts lie as far apart as the start error equivalent to the run's error
(`comparison.verdict.confirmation`), never less than the perturbed ones.

Without a stated order u is 3 times the distance of the levels: an order fitted to three runs holds for these
by construction, and the least order, 1, gives the weight of the coarser run.
"""

import tomllib
from collections.abc import Iterator, Sequence
from collections.abc import Mapping as Pairs
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from comparison.accuracy.uncertainty import PERTURBATION, WINDOW
from comparison.execution.pool import kept_workers
from comparison.execution.run import Progress
from comparison.execution.sides import (
    Command,
    Function,
    Run,
    Side,
    SolverError,
    command_side,
    fmu_side,
    run_sides,
)
from comparison.files import contents, reading
from comparison.scene.keys import explain, unbox
from comparison.scene.schema import Positive, Section
from comparison.tables.arguments import as_mapping
from comparison.tables.channels import Array
from comparison.tables.dialect import Source, position
from comparison.tables.foreign import open_source, read_tables
from comparison.tables.mapping import Mapping, Quantity, mapping_of
from comparison.tables.table import Table, TableError
from comparison.verdict.channel import Criteria
from comparison.verdict.confirmation import OTHER_MEMBERS, equivalent_start, scaled_member, with_doubt
from comparison.verdict.recorded import ProgramRuns, compare_recorded, with_errors, without_error
from comparison.verdict.results import Doubt, SceneComparison

FACTORS = {"tolerance": 10.0, "step": 1.7}
"""Factor between two levels; steps that do not divide each other do not jump at the same instants."""
LEVELS = {"tolerance": 1, "step": 2}
"""Levels finer than the first judgement that a difference must outlast."""
LEAST_SIZE = 1e-12
"""Least perturbation by default, as a share of a state's scale: less is rounded away."""

Programs = tuple[tuple[ProgramRuns, ...], tuple[str, ...]]
"""Runs of both sides, and warnings."""


class Solver(Section):
    """Keys of a side."""

    label: Annotated[str, Field(min_length=1)] | None = None
    command: str | None = None
    fmu: str | None = None
    file: str | None = None  # a table without further runs; its error is from these two:
    u: dict[str, Positive] = Field(default={})
    repeat: list[str] = Field(default=[])
    tolerance: Positive | None = None
    step: Positive | None = None
    factor: Annotated[float, Field(gt=1, allow_inf_nan=False)] | None = None
    order: Positive | None = None
    stop: Positive | None = None  # of an FMU, s
    interval: Positive | None = None  # between two rows of an FMU, s


class Solvers(Section):
    """The two sides."""

    a: Solver
    b: Solver


class Start(Section):
    """States that are moved, and the size of the move."""

    states: list[str] = Field(default=[])
    size: Positive | None = None

    def _violations(self) -> Iterator[tuple[str, object, str]]:
        if len({*self.states}) < len(self.states):
            yield "states", self.states, "must not contain a state twice"


class Demand(Section):
    """Time until which the two must agree, s, or share of the samples that must be predictable."""

    until: Positive | Literal["any"] | None = None
    coverage: Annotated[float, Field(gt=0, le=1)] | None = None


class PairKeys(Section):
    """Contents of a pair file."""

    side: Solvers
    title: Annotated[str, Field(min_length=1)] = "Two solvers"
    start: Start = Start()
    mapping: Any = None
    scale: dict[str, Positive] = Field(default={})
    demand: Demand = Demand()
    window: Positive | None = None
    limit: Positive = 600.0


def load_pair(path: Path, demand: Pairs[str, object] | None = None) -> "Pair":
    """Read a pair file; a `TableError` names file, key, value and violated rule.

    A ``demand`` replaces that of the file.
    """
    with reading(path, TableError, "TOML"):
        content = tomllib.loads(contents(path))
        content |= {"demand": demand} if demand else {}
        return _pair(content, path.parent.resolve(), (None, None), path.stem)


def judge(
    a: Function | str | Path,
    b: Function | str | Path,
    *,
    tolerance: Sequence[float | None] | float | None = None,
    step: Sequence[float | None] | float | None = None,
    states: int | str | Sequence[str] = 0,
    n_jobs: int = 1,
    **options: Any,
) -> SceneComparison:
    """Judge whether two solvers agree, by runs of their own, and until when.

    Parameters
    ----------
    a, b
        Functions of the tolerance (or step) and of the offsets of the start, an array of one a state, which
        return a data frame whose ``time`` (s) is a column or its index; or commands, or paths of FMUs, as in
        a pair file. All runs of both have the same times.
    tolerance, step
        The setting that controls each one's error: of both, or a pair; None for the side that has the other.
    states
        Number of states that are moved, the first columns of the table, or their names.
    n_jobs
        Runs at a time; above 1 functions run in processes, each for ``limit`` (s) at most, and a script
        needs ``if __name__ == "__main__":``.
    options
        Other keys of a pair file: ``size``, ``until``, ``coverage``, ``window``, ``scale``, ``mapping``,
        ``title``, ``limit`` and, of both sides, ``factor``, ``order``, ``stop``, ``interval``.

    Returns
    -------
    SceneComparison
        ``verdict``: "agree", "differ" or "indeterminate"; ``until``, s; ``channels``; ``report(path)`` writes
        the page.

    Raises
    ------
    TableError
        If an option is wrong, a run fails, or the tables cannot be compared.

    Examples
    --------
    >>> import numpy as np, pandas as pd, sixbar
    >>> from scipy.integrate import solve_ivp
    >>> def decay(tolerance, start, rate=1.0, method="DOP853"):
    ...     t = np.linspace(0, 5, 201)
    ...     run = solve_ivp(lambda t, y: -rate * y, (0, 5), 1 + start, method, t, rtol=tolerance, atol=1e-12)
    ...     return pd.DataFrame({"time": t, "y": run.y[0]})
    >>> def other(tolerance, start):
    ...     return decay(tolerance, start, 1.0001, "LSODA")
    >>> sixbar.judge(decay, decay, tolerance=1e-8, states=1).verdict
    'agree'
    >>> sixbar.judge(decay, other, tolerance=1e-8, states=1).verdict
    'differ'
    """
    entries = [states] if isinstance(states, str) else states
    names = [position(n + 1) for n in range(entries)] if isinstance(entries, int) else [*entries]
    content: dict[str, Any] = {"side": {"a": {}, "b": {}}, "start": {"states": names}}
    for key, value in ((key, unbox(value)) for key, value in options.items() if value is not None):
        if key in Solver.model_fields:
            content["side"]["a"][key] = content["side"]["b"][key] = value
        else:
            section = next((name for name, keys in _SECTIONS.items() if key in keys.model_fields), "")
            (content.setdefault(section, {}) if section else content)[key] = value
    for n, (side, solver) in enumerate(zip("ab", (a, b), strict=True)):
        keys = {"tolerance": _of(tolerance, n), "step": _of(step, n)}
        if not callable(solver):
            keys["fmu" if str(solver).lower().endswith(".fmu") else "command"] = str(solver)
        content["side"][side] |= {key: unbox(value) for key, value in keys.items() if value is not None}
    functions = tuple(solver if callable(solver) else None for solver in (a, b))
    pair = _pair(content, Path.cwd(), functions, "judge")
    with kept_workers():
        return replace(pair, n_jobs=n_jobs).judge()[0]


_SECTIONS: dict[str, type[Section]] = {"start": Start, "demand": Demand}


def _of(value: Any, n: int) -> Any:
    return value[n] if isinstance(value, list | tuple) and len(value) == 2 else value


def _pair(content: Pairs[str, Any], folder: Path, functions: Sequence[Function | None], name: str) -> "Pair":
    try:
        keys = PairKeys.model_validate(content)
    except ValidationError as error:
        raise TableError(explain(error, PairKeys)) from None
    entry = keys.mapping
    if isinstance(entry, dict):
        try:
            mapping = mapping_of(entry)
        except TableError as error:
            raise TableError(f"mapping: {error}") from None
    else:
        mapping = as_mapping(folder / entry if isinstance(entry, str) else entry) or Mapping()
    quantities = {
        name: mapping.channels.get(name, Quantity()).model_copy(update={"scale": scale})
        for name, scale in keys.scale.items()
    }
    mapping = mapping.model_copy(update={"channels": mapping.channels | quantities})
    sides = [
        _side(letter, getattr(keys.side, letter), function, folder, (keys.start.states, mapping))
        for letter, function in zip("ab", functions, strict=True)
    ]
    if sides[0].label == sides[1].label:
        sides = [
            replace(side, label=f"{side.label} ({letter})") for letter, side in zip("ab", sides, strict=True)
        ]
    pair = Pair((sides[0], sides[1]), keys, mapping, name)
    if all(side.files for side in sides):
        raise TableError("side.a and side.b are files: sixbar compare judges these")
    for letter, side in zip("ab", sides, strict=True):
        for n, path in enumerate(side.files):
            pair._tables[Run(side, n, ())] = open_source(path, mapping.dialect.of(letter))
    return pair


def _side(
    letter: str, keys: Solver, function: Function | None, folder: Path, shared: tuple[list[str], Mapping]
) -> Side:
    where, (states, mapping) = f"side.{letter}", shared
    if keys.file is not None:
        if {*keys.model_fields_set} - {"label", "file", "u", "repeat"}:
            raise TableError(f"{where} with a file has no other keys than label, u and repeat")
        paths = tuple(folder / name for name in (keys.file, *keys.repeat))
        return Side(keys.label or paths[0].stem, None, "tolerance", files=paths)
    settings = [name for name in FACTORS if getattr(keys, name) is not None]
    if len(settings) != 1:
        raise TableError(f"{where} must have a tolerance or a step{', not both' if settings else ''}")
    if (keys.command is None) + (keys.fmu is None) + (function is None) != 2:
        raise TableError(f"{where} must have a command, an fmu or a file, and one of them")
    (setting,), label = settings, letter
    solver: Function | Command
    if keys.fmu is not None:
        options = {"states": states, "stop": keys.stop, "interval": keys.interval}
        also = {"also": [*mapping.columns, *getattr(mapping, letter)]}
        solver, label = fmu_side(Path(keys.fmu), folder, setting, options | also), Path(keys.fmu).stem
    elif keys.command is not None:
        try:
            solver = command_side(keys.command, folder, [setting, *(["start"] if states else [])])
        except SolverError as error:
            raise SolverError(f"{where}: {error}") from None
    else:
        assert function is not None
        solver, label = function, getattr(function, "__name__", letter).replace("<lambda>", letter)
    factor, order = keys.factor or FACTORS[setting], keys.order or nan
    return Side(keys.label or label, solver, setting, getattr(keys, setting), factor, order)


@dataclass(frozen=True)
class Pair:
    """Two sides to judge."""

    sides: tuple[Side, Side]
    keys: PairKeys
    mapping: Mapping
    name: str
    n_jobs: int = 1
    on_progress: Progress | None = None
    scales: Pairs[str, float | None] = field(default_factory=dict)  # of states, in place of their ranges
    _tables: dict[Run, Source | SolverError] = field(default_factory=dict)

    def judge(self) -> tuple[SceneComparison, tuple[ProgramRuns, ...]]:
        """Return the verdict and its runs; raise a `SolverError` if a run fails."""
        level, doubt = 0, Doubt.ONE_STATE if len(self.keys.start.states) == 1 else None
        data = self._read(self._families(0))
        result = self._compare(data)
        last_level = max(LEVELS[side.kind] for side in self.sides)
        while result.verdict == "differ" and level < last_level:
            try:
                data = self._read(self._families(level + 1))
            except SolverError:
                doubt = Doubt.UNREFINED
                break
            level += 1
            result = replace(self._compare(data, result), refined=level)
        if result.verdict == "differ" and self.keys.start.states:
            data = self._ensembles(result, level, data[0])
            result = replace(self._compare(data, result), refined=level)
        programs, _ = data
        for side, program in zip(self.sides, programs, strict=True):
            frames = [run.frame for run in program.perturbed[:2]]
            if program.coarser and frames and all(frame.equals(program.coarser.frame) for frame in frames):
                line = f"{side.label}: a moved start changes nothing: how its motions diverge is not known"
                result, doubt = replace(result, warnings=(*result.warnings, line)), Doubt.UNMOVED
        if result.verdict == "differ" and result.confirmation and doubt:
            result = with_doubt(result, doubt, result.confirmation.members)
        return without_error(result, programs, [bool(side.files) for side in self.sides]), programs

    def _compare(self, data: Programs, before: SceneComparison | None = None) -> SceneComparison:
        demand, window, channels = self.keys.demand, self.keys.window, self.mapping.compare
        period = None if window is None else window / WINDOW
        until = "any" if demand.until is None and demand.coverage is not None else demand.until
        labels = self.sides[0].label, self.sides[1].label
        criteria = Criteria(channels=channels, period=period, until=until)
        options: dict[str, Any] = {"labels": labels, "warnings": data[1], "before": before}
        result = compare_recorded(*data[0], scene=None, criteria=criteria, **options)
        result = replace(result, name=self.name, title=self.keys.title)
        lacks = result.verdict == "agree" and result.coverage < (demand.coverage or 0.0)
        return replace(result, verdict="indeterminate") if lacks else result

    # ---- runs

    def _families(self, level: int) -> list[list[Run]]:
        """Run both sides with the base at a level: base, finer, coarser and perturbed runs."""
        count = len(self.keys.start.states)
        families = [
            [Run(side, n, ()) for n, _ in enumerate(side.files)]
            or [Run(side, level + more, (0.0,) * count) for more in (0, 1, -1)]
            for side in self.sides
        ]
        moves = np.random.default_rng(0).standard_normal((2 if count else 0, count))
        total = sum(map(len, families)) + 2 * len(moves)
        if any(side.solver is not None for side in self.sides):  # refuse columns of one side at once
            first = [family[:1] for family in families]
            self._run(first, total)
            self._read_tables(first)
        self._run(families, total)
        for side, family in zip(self.sides, families, strict=True):
            if not side.files:  # random directions of root mean square 1; of one state + and -
                shares = [self._size(side) * move / np.sqrt(np.mean(move**2)) for move in moves]
                family += [Run(side, level - 1, self._start(side, share)) for share in shares]
        self._run(families)
        return families

    def _ensembles(self, result: SceneComparison, level: int, programs: Sequence[ProgramRuns]) -> Programs:
        """Return the runs, with an ensemble of each side after the perturbed ones."""
        families, shares = self._families(level), [np.empty(0)] * 2
        count = int(np.searchsorted(result.time, result.until))
        lengths = {name: 1.0 / channel.scale for name, channel in result.excited.items()}
        for n, (family, program) in enumerate(zip(families, programs, strict=True)):
            side = family[0].side
            if side.files:
                continue
            shift, w = equivalent_start(program.runs, lengths, self._size(side), count)
            draws = np.random.default_rng(n + 1).standard_normal((OTHER_MEMBERS, len(family[0].start)))
            family += [Run(side, level, self._start(side, shift * draw)) for draw in draws]
            shares[n] = np.minimum(w / shift, 1.0)
        self._run(families, needed=False)
        successes = [[run for run in family if isinstance(self._tables[run], Source)] for family in families]
        programs, warnings = self._read(successes)
        results = []
        for program, share in zip(programs, shares, strict=True):
            members = [run for run in program.perturbed[2:] if run.time.size == share.size]
            members = [scaled_member(run, program.base, share) for run in members]
            results.append(replace(program, perturbed=[*program.perturbed[:2], *members]))
        return tuple(results), warnings

    def _size(self, side: Side) -> float:
        default = PERTURBATION if side.kind == "step" else max(side.setting, LEAST_SIZE)
        return self.keys.start.size or default

    def _start(self, side: Side, shares: Array) -> tuple[float, ...]:
        """Return offsets from shares of the states' scales.

        A scale is the range of the state's column in the first run of the side, else 1.
        """
        columns = self._columns(Run(side, 0, (0.0,) * shares.size))
        numbers = {name: values[np.isfinite(values)] for name, values in columns.items()}
        ranges = {name: float(np.ptp(values)) for name, values in numbers.items() if values.size}
        missing = [state for state in self.keys.start.states if state not in {*columns, *self.scales}]
        if missing and not isinstance(side.solver, Command):
            names = ", ".join(name for name in columns if not name.startswith("#"))
            raise SolverError(f"states: {missing[0]!r} is not a column of {side.label}, which has {names}")
        scales = [self.scales.get(s) or ranges.get(s) or 1.0 for s in self.keys.start.states]
        return tuple((shares * scales).tolist())

    def _columns(self, run: Run) -> dict[str, Array]:
        """Return the columns of a table by their names, and by their places."""
        source = self._tables[run]
        assert isinstance(source, Source)
        return {key: c.numbers for n, c in enumerate(source.columns) for key in (c.name, position(n))}

    def _run(self, families: Sequence[Sequence[Run]], total: int = 0, *, needed: bool = True) -> None:
        """Run the new runs, of ``total`` ones; if ``needed`` a failed run raises its error."""
        runs = [run for family in families for run in family]
        queue = [run for run in runs if run not in self._tables]
        offset, total = len(runs) - len(queue), total or len(runs)

        def report(share: float) -> None:
            if self.on_progress:
                self.on_progress((offset + share * len(queue)) / total)

        results = self._tables
        results |= zip(queue, self._results(queue, report), strict=True)
        for run in runs if needed else ():
            if isinstance(error := results[run], SolverError):
                raise error

    def _results(self, runs: Sequence[Run], on_progress: Progress) -> list[Source | SolverError]:
        """Return the table or the error of each run."""
        dialects = [self.mapping.dialect.of("ab"[self.sides.index(run.side)]) for run in runs]
        return run_sides(runs, dialects, (self.n_jobs, self.keys.limit), on_progress)

    def _read_tables(self, families: Sequence[Sequence[Run]]) -> tuple[list[Table], tuple[str, ...]]:
        """Return the tables of runs, side by side, and warnings."""
        sources = [self._tables[run] for family in families for run in family]
        sides = ["ab"[n] for n, family in enumerate(families) for _ in family]
        tables, warnings = read_tables([s for s in sources if isinstance(s, Source)], sides, self.mapping)
        if unknown := [name for name in self.keys.scale if name not in tables[0].channels]:
            raise TableError(f"scale.{unknown[0]}: {unknown[0]!r} is not a channel of the tables")
        return tables, warnings

    def _read(self, families: Sequence[Sequence[Run]]) -> Programs:
        """Return the tables of runs as channels, and warnings."""
        tables, warnings = self._read_tables(families)
        runs = [run for family in families for run in family]
        tables = [
            replace(table, provenance={"settings": run.values()})
            for table, run in zip(tables, runs, strict=True)
        ]
        programs = []
        for side, keys, count in zip(
            self.sides, (self.keys.side.a, self.keys.side.b), map(len, families), strict=True
        ):
            base, *others = tables[:count]
            if side.files:
                has_error = keys.u or others
                programs.append(ProgramRuns(base, with_errors(base, keys.u, others) if has_error else None))
            else:
                finer, coarser, *perturbed = others
                programs.append(ProgramRuns(base, finer, coarser, perturbed, (side.factor, side.order)))
            tables = tables[count:]
        states = self.keys.start.states
        if len(states) == 1:
            warnings += ("only one state is moved: how motions diverge along others is not seen",)
        for side, family in zip(self.sides, families, strict=True):
            columns = {*(states if side.files else self._columns(family[0]))}
            names = ", ".join(state for state in states if state not in columns)
            warnings += (f"{side.label}: no column {names}: its scale is taken as 1",) if names else ()
        return tuple(programs), tuple(dict.fromkeys(warnings))
