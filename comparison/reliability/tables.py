"""Reliability of the slider's motion in tables of any origin, against a table of the ideal mechanism."""

from collections.abc import Mapping as Pairs
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import Runs
from comparison.formatting import holes_line, instant
from comparison.reliability.assessment import (
    MARGIN,
    Assessment,
    ReliabilityComparison,
    assess,
    compare_reliability,
)
from comparison.reliability.errors import QUANTITIES, part_edges, slider_errors
from comparison.scene import Reliability, Scene, as_scene, load_scene
from comparison.scene.loading import BASE
from comparison.scene.schema import Positive, Real
from comparison.tables.align import holes
from comparison.tables.arguments import Options, Results, as_mapping, as_source
from comparison.tables.foreign import read_tables
from comparison.tables.mapping import Mapping
from comparison.tables.table import SAME_GRID, Table, TableError, check, slacks

CHANNELS = tuple(QUANTITIES.values())
_LEAST_CHANGE = 0.1 * MARGIN
"""Change of R with half the samples, above which they are too few; its error is a tenth of that or less."""
_SAME_PERIOD = 1e-6  # relative: periods may be stated with six digits


@dataclass(frozen=True)
class TableReliability:
    """Reliability of the slider's motion in one table or two, by quantity.

    ``a`` and ``b``: quantity ("displacement", "velocity", "acceleration") -> its assessment in either
    table; ``comparison``: by both. Without a second table they are empty and None. ``missing``: quantity ->
    the tables without its channel. ``settings``: limits, of the quantities ``given`` as stated, of others
    those of the scene ``source``; ``period`` of the crank cycle, s.
    """

    names: tuple[str, ...]
    settings: Reliability
    given: tuple[str, ...]
    source: str
    period: float
    a: dict[str, Assessment]
    b: dict[str, Assessment]
    comparison: ReliabilityComparison | None
    missing: dict[str, list[str]]
    warnings: tuple[str, ...]

    @property
    def by_quantity(self) -> dict[str, dict[str, Assessment]]:
        """The assessments of each quantity, by table, "a" or "b"."""
        sides = {"a": self.a, "b": self.b}
        rows = {name: {x: side[name] for x, side in sides.items() if name in side} for name in QUANTITIES}
        return {name: row for name, row in rows.items() if row}


def reliability(
    a: Results,
    b: Results | None = None,
    *,
    ideal: Results,
    finer_a: Results | None = None,
    finer_b: Results | None = None,
    scene: Scene | str | Path | None = None,
    mapping: Mapping | str | Path | None = None,
    **options: Any,
) -> TableReliability:
    """Compute how reliably the slider follows the ideal mechanism, by the paper's Eqs. 34-37.

    Errors are those at equal time, from t = 0 s to the end of the shortest table's last whole interval of the
    crank cycle (of less than a cycle: to its end). Intervals (95 %) hold what
    other cycles leave open; a table whose samples leave more than a tenth of `MARGIN` open is warned of.

    Parameters
    ----------
    a, b
        Tables with at least one of slider_y, slider_vy, slider_ay (m, m/s, m/s^2), such as `sixbar.simulate`
        returns, data frames with a column ``time`` (s), or paths, also of other programs' files.
    ideal
        The motion of the mechanism without clearance; taken as exact at its times.
    finer_a, finer_b
        The same runs at finer settings: without both the numerical uncertainty of a difference is unknown.
    scene
        Has limits, intervals of the crank cycle and period; by default the scene recorded beside a table, and
        without one the paper's limits.
    mapping
        Mapping of the columns of files to channels, or the path of a mapping file.
    options
        ``limits``: quantity -> lower and upper limit of its error, m, m/s, m/s^2; by default those of the
        scene. ``period`` of the crank cycle, s, where no scene has it. ``at_events``: "left", "right" or
        "both", which rows of a time that a file repeats count.

    Returns
    -------
    TableReliability
        Of each table and quantity the reliability by crank angle, the smallest with its interval, and the
        moments of the error; of two tables their difference.

    Raises
    ------
    TableError
        If a table cannot be read, holds none of the channels, does not start at 0 s, or does not fit the
        others; if neither a scene nor ``period`` gives the period.
    SceneError
        If the limits are not valid.

    Examples
    --------
    >>> import sixbar
    >>> cycle = {"drive.cycles": 1}
    >>> run = sixbar.simulate(sixbar.load_scene("150rpm-0.2mm", cycle))
    >>> ideal = sixbar.simulate(sixbar.load_scene("ideal", cycle))
    >>> velocity = sixbar.reliability(run, ideal=ideal).a["velocity"]
    >>> low, high = velocity.interval
    >>> bool(low < velocity.minimum < high < velocity.cap), float(velocity.angle[velocity.worst])
    (True, 36.0)
    """
    if b is None and not (finer_a is None and finer_b is None):
        raise TableError("finer runs count only for the difference of two tables, and there is one")
    override, choices = None if scene is None else as_scene(scene), _Choices(**options)
    arguments = {"a": a, "b": b, "ideal": ideal, "finer a": finer_a, "finer b": finer_b}
    results = {part: one for part, one in arguments.items() if one is not None}
    names = {part: str(x) if isinstance(x, str | Path) else f"table {part}" for part, x in results.items()}
    sides = [part.removeprefix("finer ") for part in results]
    sources = [as_source(one, names[part]) for part, one in results.items()]
    table_list, warnings = read_tables(sources, sides, as_mapping(mapping), choices.at_events, only=CHANNELS)
    tables = {part: table.only(CHANNELS) for part, table in zip(results, table_list, strict=True)}
    for part, table in tables.items():
        _check(table, names[part])
    cycle, source = _conditions(tables, names, override, choices.period)
    source.require_press("sixbar reliability")
    values = {
        f"reliability.{quantity}.{end}": value
        for quantity, both in choices.limits.items()
        for end, value in zip(("lower", "upper"), both, strict=True)
    }
    settings = source.with_values(values).reliability
    tables, notes = _cut_to_shortest(tables, names, cycle, settings.bins)
    warnings += notes

    def assess_part(part: str, table: Table, ideal: Table) -> dict[str, Assessment]:
        shared = [name for name in table.channels if name in ideal.channels]
        if not shared:
            raise TableError(f"{names['ideal']}: holds none of the channels of {names[part]}")
        return assess(slider_errors(table, ideal, cycle, names=shared), settings)

    of_a = assess_part("a", tables["a"], tables["ideal"])
    of_b = {} if b is None else assess_part("b", tables["b"], tables["ideal"])
    # The change with every second sample shows the error by what is between the samples.
    halves = {part: _halve(table) for part, table in tables.items()}
    checks = [("a", of_a, assess_part("a", halves["a"], tables["ideal"]))]
    checks += [("b", of_b, assess_part("b", halves["b"], tables["ideal"]))] if of_b else []
    checks += [("ideal", of_a, assess_part("a", tables["a"], halves["ideal"]))]
    for part, usual, other in checks:
        change = max(np.abs(bins.reliability - other[name].reliability).max() for name, bins in usual.items())
        if change > _LEAST_CHANGE:
            more = f"with every second one R changes by {change:.0e}"
            warnings += (f"{names[part]}: too few samples: {more}",)

    return TableReliability(
        names=tuple(names[part] for part in ("a", "b") if part in names),
        settings=settings,
        given=tuple(choices.limits),
        source=source.name,
        period=cycle,
        a=of_a,
        b=of_b,
        comparison=None if b is None else _comparison(tables, halves["ideal"], cycle, settings),
        missing={
            quantity: lacking
            for quantity, channel in QUANTITIES.items()
            if (lacking := [names[part] for part, table in tables.items() if channel not in table.channels])
        },
        warnings=warnings,
    )


def _conditions(
    tables: Pairs[str, Table], names: Pairs[str, str], scene: Scene | None, period: float | None
) -> tuple[float, Scene]:
    """Return the period of the crank cycle, s, and the scene whose limits count."""
    recorded = {part: table.scene for part, table in tables.items()}
    if (ideal_scene := recorded["ideal"]) and (joints := ideal_scene.loose):
        rule = f"recorded of a scene with clearance ({', '.join(joints)}): the ideal motion has none"
        raise TableError(f"{names['ideal']}: {rule}")
    periods = {names[part]: record.period for part, record in recorded.items() if record is not None}
    cycle = _common_period(
        periods
        | ({} if scene is None else {f"scene {scene.name!r}": scene.period})
        | ({} if period is None else {"the stated period": period})
    )
    criteria = [  # not every record holds them
        recorded[part] for part in ("a", "b") if part in tables and "reliability" in tables[part].provenance
    ]
    return cycle, scene or next(filter(None, criteria), None) or load_scene(BASE)


def _cut_to_shortest(
    tables: Pairs[str, Table], names: Pairs[str, str], cycle: float, bins: int
) -> tuple[dict[str, Table], tuple[str, ...]]:
    """Return the tables up to the end of the shortest, with warnings of rows left out or missing."""
    end, shortest_name = min((float(table.time[-1]), names[part]) for part, table in tables.items())
    cuts, warnings, interval = {}, [], cycle / bins
    if (remainder := end - part_edges(end, cycle, bins)[-1]) > SAME_GRID * cycle:
        rule = f"they do not fill one of the {bins} intervals of the crank cycle"
        warnings.append(f"{shortest_name}: its last {remainder:.3g} s do not count: {rule}")
    for part, table in tables.items():
        if not np.diff(table.time).mean() <= interval <= (1 + SAME_GRID) * end:
            rule = f"must hold a sample and be within the {end:g} s that count"
            raise TableError(f"{names[part]}: an interval of the crank cycle, {interval:g} s, {rule}")
        counts = table.time <= end + SAME_GRID * cycle
        if not counts.all():
            count = instant(end, float(table.time[-1]))
            warnings.append(f"{names[part]}: only its first {count} s count, where {shortest_name} ends")
        if gaps := holes(table.time[counts]):
            warnings.append(holes_line(f"{names[part]} has", gaps))
        cuts[part] = replace(table, frame=table.frame[counts])
    return cuts, tuple(warnings)


def _halve(table: Table) -> Table:
    """Return a table with every second sample, and the last."""
    return replace(table, frame=pd.concat([table.frame.iloc[:-1:2], table.frame.iloc[-1:]]))


def _pair(value: object) -> object:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise PydanticCustomError("rule", "", {"text": "must be two numbers, lower and upper limit"})
    return tuple(value)


class _Choices(Options):
    """Options of `reliability`."""

    limits: Annotated[
        dict[str, Annotated[tuple[Real, Real], BeforeValidator(_pair)]],
        Field(default={}),
    ]
    period: Positive | None = None
    at_events: Literal["left", "right", "both"] | None = None


def _comparison(
    tables: Pairs[str, Table], thinned: Table, cycle: float, settings: Reliability
) -> ReliabilityComparison | None:
    shared = [name for name in CHANNELS if all(name in table.channels for table in tables.values())]
    if not shared:
        return None
    tables = {part: table.only(shared) for part, table in tables.items()}
    exact = Runs(tables["ideal"], coarser=thinned)
    runs = Runs(tables["a"], tables.get("finer a")), Runs(tables["b"], tables.get("finer b"))
    return ReliabilityComparison(
        settings, compare_reliability(runs, (exact, exact), cycle, settings, thresholds().k)
    )


def _check(table: Table, name: str) -> None:
    if not table.channels:
        hint = "a mapping file (--mapping) assigns columns to channels"
        raise TableError(f"{name}: holds none of {', '.join(CHANNELS)}; {hint}")
    check(table, table.channels, name=name)
    if abs(table.time[0]) > slacks(table.time)[0]:
        raise TableError(f"{name}: starts at {table.time[0]:g} s and must start at 0 s")


def _common_period(periods: Pairs[str, float]) -> float:
    if not periods:
        raise TableError(
            "the period of the crank cycle is not known: no scene is recorded; give --period or --scene"
        )
    first, period = next(iter(periods.items()))
    for name, value in periods.items():
        if not isclose(value, period, rel_tol=_SAME_PERIOD):
            raise TableError(f"{name}: the crank cycle takes {value:g} s; that of {first} takes {period:g} s")
    return period
