"""Judgement of any two solvers by runs of their own: ``sixbar judge`` and `sixbar.judge`.

Each side runs at its setting, a level finer and a level coarser, and twice at the coarser from a start moved
at random in all states; `comparison.verdict.recorded` judges these runs. Only a difference asks for more. It
must outlast further levels, with fixed steps two: three steps that err alike, as of an impact that is found
at the end of a step, are no rarity. Then ensembles confirm it, whose starts lie as far apart as the error of
the run is worth there (`comparison.verdict.confirmation`), never less than the perturbed ones.

Without a stated order u is 3 times the distance of the levels: an order that is fitted to three runs is
theirs by construction, and the least one, 1, is taken for what the coarser run is worth.
"""

import tomllib
from collections.abc import Mapping as Pairs
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationError

from comparison.accuracy.uncertainty import PERTURBATION, WINDOW
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
from comparison.scene.keys import explain, unboxed
from comparison.scene.schema import Positive, Section
from comparison.tables.arguments import as_mapping
from comparison.tables.channels import Array
from comparison.tables.dialect import Source, position
from comparison.tables.foreign import read_tables
from comparison.tables.mapping import Mapping, Quantity, mapping_of
from comparison.tables.table import TableError
from comparison.verdict.channel import Criteria
from comparison.verdict.confirmation import OTHER_MEMBERS, equivalent_start, scaled_member, unconfirmed
from comparison.verdict.recorded import ProgramRuns, compare_recorded
from comparison.verdict.results import Doubt, SceneComparison

FACTORS = {"tolerance": 10.0, "step": 1.7}
"""Factor between two levels; steps that are no parts of each other do not jump at the same instants."""
LEVELS = {"tolerance": 1, "step": 2}
"""Levels finer than the first judgement that a difference must outlast."""
LEAST_SIZE = 1e-12
"""Least perturbation by default, as a share of a state's scale: less is rounded away."""


class Solver(Section):
    """Keys of a side."""

    command: str | None = None
    fmu: str | None = None
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
    """States that are moved, and by how much."""

    states: list[str] = Field(default=[])
    size: Positive | None = None


class PairKeys(Section):
    """Contents of a pair file."""

    side: Solvers
    title: Annotated[str, Field(min_length=1)] = "Two solvers"
    start: Start = Start()
    mapping: Any = None
    scale: dict[str, Positive] = Field(default={})
    window: Positive | None = None
    limit: Positive = 600.0


def load_pair(path: Path) -> "Pair":
    """Read a pair file; a `TableError` tells file, key, value and violated rule."""
    with reading(path, TableError, "TOML"):
        return _pair(tomllib.loads(contents(path)), path.parent, (None, None), path.stem)


def judge(
    a: Function | str | Path,
    b: Function | str | Path,
    *,
    tolerance: Sequence[float | None] | float | None = None,
    step: Sequence[float | None] | float | None = None,
    states: int | Sequence[str] = 0,
    n_jobs: int = 1,
    **options: Any,
) -> SceneComparison:
    """Judge whether two solvers agree, by runs of their own, and until when.

    Parameters
    ----------
    a, b
        Functions of the tolerance (or step) and of the offsets of the start, an array of one a state, which
        return a data frame whose time (s) is a column or the index; or commands, or paths of FMUs, as in a
        pair file. All runs of both have the same times.
    tolerance, step
        The setting that controls each one's error: of both, or a pair; None for the side that has the other.
    states
        Number of states that are moved, the first columns of the table, or their names.
    n_jobs
        Runs at a time; above 1 functions run in processes, and a script needs
        ``if __name__ == "__main__":``.
    options
        Other keys of a pair file: ``size``, ``window``, ``scale``, ``mapping``, ``title``, ``limit`` and, of
        both sides, ``factor``, ``order``, ``stop``, ``interval``.

    Returns
    -------
    SceneComparison
        ``verdict``: "agree", "differ" or "indeterminate"; ``channels``; ``report(path)`` writes the page.

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
    of_sides, rest = ("factor", "order", "stop", "interval"), dict(options)
    own = {name: rest.pop(name) for name in of_sides if name in rest}
    names = [position(n + 1) for n in range(states)] if isinstance(states, int) else [*states]
    content = {
        "side": {},
        "start": {"states": names, **{k: rest.pop(k) for k in ("size",) if k in rest}},
        **rest,
    }
    for n, (side, solver) in enumerate((("a", a), ("b", b))):
        keys = own | {"tolerance": _of(tolerance, n), "step": _of(step, n)}
        if not callable(solver):
            keys["fmu" if str(solver).lower().endswith(".fmu") else "command"] = str(solver)
        content["side"][side] = {key: unboxed(value) for key, value in keys.items() if value is not None}
    functions = tuple(solver if callable(solver) else None for solver in (a, b))
    pair = _pair({k: v for k, v in content.items() if v is not None}, Path(), functions, "judge")
    return replace(pair, n_jobs=n_jobs).judge()[0]


def _of(value: Any, n: int) -> Any:
    return value[n] if isinstance(value, list | tuple) and len(value) == 2 else value


def _pair(content: Pairs[str, Any], folder: Path, functions: Sequence[Function | None], name: str) -> "Pair":
    try:
        keys = PairKeys.model_validate(content)
    except ValidationError as error:
        raise TableError(explain(error, PairKeys)) from None
    given = keys.mapping
    if isinstance(given, dict):
        try:
            mapping = mapping_of(given)
        except TableError as error:
            raise TableError(f"mapping: {error}") from None
    else:
        mapping = as_mapping(folder / given if isinstance(given, str) else given) or Mapping()
    scaled = {
        name: mapping.channels.get(name, Quantity()).model_copy(update={"scale": scale})
        for name, scale in keys.scale.items()
    }
    mapping = mapping.model_copy(update={"channels": mapping.channels | scaled})
    sides = [
        _side(which, getattr(keys.side, which), function, folder, (keys.start.states, mapping))
        for which, function in zip("ab", functions, strict=True)
    ]
    if sides[0].label == sides[1].label:
        sides = [
            replace(side, label=f"{side.label} ({which})") for which, side in zip("ab", sides, strict=True)
        ]
    return Pair((sides[0], sides[1]), keys, mapping, name)


def _side(
    which: str, keys: Solver, function: Function | None, folder: Path, more: tuple[list[str], Mapping]
) -> Side:
    where, (states, mapping) = f"side.{which}", more
    settings = [name for name in FACTORS if getattr(keys, name) is not None]
    if len(settings) != 1:
        raise TableError(f"{where} must have a tolerance or a step{', not both' if settings else ''}")
    if (keys.command is None) + (keys.fmu is None) + (function is None) != 2:
        raise TableError(f"{where} must have a command or an fmu{', not both' if keys.command else ''}")
    (setting,), label = settings, which
    solver: Function | Command
    if keys.fmu is not None:
        options = {"states": states, "stop": keys.stop, "interval": keys.interval}
        also = {"also": [*mapping.columns, *getattr(mapping, which)]}
        solver, label = fmu_side(Path(keys.fmu), folder, setting, options | also), Path(keys.fmu).stem
    elif keys.command is not None:
        try:
            solver = command_side(keys.command, folder, [setting, *(["start"] if states else [])])
        except SolverError as error:
            raise SolverError(f"{where}: {error}") from None
    else:
        assert function is not None
        solver, label = function, getattr(function, "__name__", which).replace("<lambda>", which)
    return Side(
        label,
        solver,
        getattr(keys, setting),
        setting == "step",
        keys.factor or FACTORS[setting],
        keys.order or nan,
    )


@dataclass(frozen=True)
class Pair:
    """Two sides to judge."""

    sides: tuple[Side, Side]
    keys: PairKeys
    mapping: Mapping
    name: str
    n_jobs: int = 1
    on_progress: Progress | None = None
    _tables: dict[Run, Source | SolverError] = field(default_factory=dict)

    def judge(self) -> tuple[SceneComparison, tuple[ProgramRuns, ...]]:
        """Return the verdict, and the runs on which it rests; a `SolverError` if one of them fails."""
        level, doubt = 0, Doubt.ONE_STATE if len(self.keys.start.states) == 1 else None
        programs, warnings = self._read(self._families(0))
        result = self._compare(programs, warnings)
        most = max(LEVELS["step" if side.stepped else "tolerance"] for side in self.sides)
        while result.verdict == "differ" and level < most:
            try:
                programs, warnings = self._read(self._families(level + 1))
            except SolverError:
                doubt = Doubt.UNREFINED
                break
            level += 1
            result = replace(self._compare(programs, warnings), refined=level)
        if result.verdict == "differ" and self.keys.start.states:
            programs, warnings = self._ensembles(result, level, programs)
            result = replace(self._compare(programs, warnings), refined=level)
        if result.verdict == "differ" and result.confirmation and doubt:
            result = unconfirmed(result, doubt, result.confirmation.members)
        return result, programs

    def _compare(self, programs: Sequence[ProgramRuns], warnings: tuple[str, ...]) -> SceneComparison:
        usual: dict[str, Any] = {} if self.mapping.compare is None else {"channels": self.mapping.compare}
        if self.keys.window is not None:
            usual["period"] = self.keys.window / WINDOW
        labels = self.sides[0].label, self.sides[1].label
        first, second = programs
        criteria = Criteria(**usual)
        result = compare_recorded(
            first, second, scene=None, labels=labels, warnings=warnings, criteria=criteria
        )
        return replace(result, name=self.name, title=self.keys.title)

    # ---- runs

    def _families(self, level: int) -> list[list[Run]]:
        """Run both sides with the base at a level: base, finer, coarser, and the perturbed ones."""
        count = len(self.keys.start.states)
        families = [[Run(side, level + more, (0.0,) * count) for more in (0, 1, -1)] for side in self.sides]
        moves = np.random.default_rng(0).standard_normal((2 if count else 0, count))
        self._run(families, sum(map(len, families)) + 2 * len(moves))
        for family in families:  # random directions of root mean square 1; of one state + and -
            shares = [self._size(family[0].side) * move / np.sqrt(np.mean(move**2)) for move in moves]
            family += [Run(family[0].side, level - 1, self._start(family[0].side, own)) for own in shares]
        self._run(families)
        return families

    def _ensembles(
        self, result: SceneComparison, level: int, programs: Sequence[ProgramRuns]
    ) -> tuple[tuple[ProgramRuns, ...], tuple[str, ...]]:
        """Return the runs with those of an ensemble of each side behind the perturbed ones."""
        families, shares = self._families(level), []
        ends = [np.flatnonzero(~channel.predictable)[:1] for channel in result.excited.values()]
        before = int(min([*np.concatenate(ends), result.time.size]))
        lengths = {name: 1.0 / channel.scale for name, channel in result.excited.items()}
        for n, (family, program) in enumerate(zip(families, programs, strict=True)):
            side = family[0].side
            shift, w = equivalent_start(program.runs, lengths, self._size(side), before)
            draws = np.random.default_rng(n + 1).standard_normal((OTHER_MEMBERS, len(family[0].start)))
            family += [Run(side, level, self._start(side, shift * draw)) for draw in draws]
            shares.append(np.minimum(w / shift, 1.0))
        self._run(families, needed=False)
        complete = [[run for run in family if isinstance(self._tables[run], Source)] for family in families]
        programs, warnings = self._read(complete)
        scaled = []
        for program, share in zip(programs, shares, strict=True):
            members = [run for run in program.perturbed[2:] if run.time.size == share.size]
            members = [scaled_member(run, program.base, share) for run in members]
            scaled.append(replace(program, perturbed=[*program.perturbed[:2], *members]))
        return tuple(scaled), warnings

    def _size(self, side: Side) -> float:
        default = PERTURBATION if side.stepped else max(side.setting, LEAST_SIZE)
        return self.keys.start.size or default

    def _start(self, side: Side, shares: Array) -> tuple[float, ...]:
        """Return offsets from shares of the states' scales.

        A scale is the range of the column of this name in the first run of the side, else 1.
        """
        source = self._tables[Run(side, 0, (0.0,) * shares.size)]
        assert isinstance(source, Source)
        places = [*enumerate(source.columns)]
        ranges = {key: float(np.ptp(c.numbers)) for n, c in places for key in (c.name, position(n))}
        scales = [ranges.get(state) or 1.0 for state in self.keys.start.states]
        return tuple((shares * scales).tolist())

    def _run(self, families: Sequence[Sequence[Run]], total: int = 0, *, needed: bool = True) -> None:
        """Run what has not run, of so many in ``total``; if needed a run that failed raises its error."""
        runs = [run for family in families for run in family]
        new = [run for run in runs if run not in self._tables]
        before, total = len(runs) - len(new), total or len(runs)

        def report(share: float) -> None:
            if self.on_progress:
                self.on_progress((before + share * len(new)) / total)

        dialects = [self.mapping.dialect.of("ab"[self.sides.index(run.side)]) for run in new]
        limit, results = self.keys.limit, self._tables
        results |= zip(new, run_sides(new, dialects, (self.n_jobs, limit), report), strict=True)
        for run in runs if needed else ():
            if isinstance(error := results[run], SolverError):
                raise error

    def _read(self, families: Sequence[Sequence[Run]]) -> tuple[tuple[ProgramRuns, ...], tuple[str, ...]]:
        """Return the tables of runs as channels, and warnings."""
        sources = [self._tables[run] for family in families for run in family]
        sides = ["ab"[n] for n, family in enumerate(families) for _ in family]
        tables, warnings = read_tables([s for s in sources if isinstance(s, Source)], sides, self.mapping)
        programs = []
        for side, count in zip(self.sides, map(len, families), strict=True):
            base, finer, coarser, *perturbed = tables[:count]
            programs.append(ProgramRuns(base, finer, coarser, perturbed, (side.factor, side.order)))
            tables = tables[count:]
        if len(self.keys.start.states) == 1:
            warnings += ("only one state is moved: how motions diverge along others is not seen",)
        return tuple(programs), tuple(dict.fromkeys(warnings))
