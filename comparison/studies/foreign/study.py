"""The verdict on pairs of solvers of foreign systems, against true trajectories and a tube of fixed width.

For each system, pair and start: a judgement of the same equations, and for the first starts one in which the
second solver has a parameter slightly wrong. The true trajectory says until when the runs are right.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from math import ceil, inf, log
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np
import pandas as pd
from scipy.ndimage import maximum_filter1d

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import FIRST, so_far
from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.formatting import number
from comparison.models import EngineError, machine_and_versions
from comparison.report import svg
from comparison.studies.foreign.systems import STEP, SYSTEMS, System
from comparison.studies.foreign.truth import Truth
from comparison.studies.shared.study import Study, markdown, share, upper_limit, write_csv
from comparison.tables.channels import Array
from comparison.verdict.pair import judge
from comparison.verdict.results import SceneComparison
from comparison.verdict.until import until

STARTS = 6
"""Starts of each pair of solvers, the first ``FAULTS`` of them with a fault as well."""
FAULTS = 2
SPREAD = 0.1
"""Largest change of a state at the start, as a share of itself."""
TUBE = 0.002
"""Half-width of the tube beside, as a share of the range."""
SIZE = 10.0
"""|E| / u that a fault reaches on 1 % of the samples, all of them before half of `until`."""
_TRIAL = 1e-7  # relative change of a parameter whose effect is scaled


@dataclass(frozen=True)
class Case(Task):
    """A pair of solvers of a system, from the start of a number."""

    system: str
    pair: tuple[str, float, str, float]
    start: int
    models = ()


class Extent(NamedTuple):
    """Systems and starts of a run of the study."""

    systems: Sequence[System]
    starts: int


class Results(NamedTuple):
    """A row for each judgement, and the reasons of cases without."""

    rows: pd.DataFrame
    failures: list[str]


def measure(extent: Extent, n_jobs: int, on_progress: Progress | None) -> Results:
    """Judge every pair of solvers of the systems; `EngineError` where heyoka is not installed."""
    if find_spec("heyoka") is None:
        raise EngineError("the true trajectories need heyoka: pip install heyoka")
    cases = [
        Case(system.name, pair, start)
        for system in extent.systems
        for pair in system.solvers
        for start in range(extent.starts)
    ]
    results = measure_all(measure_case, cases, on_processes(n_jobs), on_progress)
    rows = [row for each in results if each["status"] == SUCCESS for row in each["rows"]]
    failures = [
        f"{case.system}, {case.pair}, start {case.start}: {row['message']}"
        for case, row in zip(cases, results, strict=True)
        if row["status"] != SUCCESS
    ]
    return Results(pd.DataFrame(rows), failures)


def measure_case(case: Case, progress: Progress) -> Row:
    """Return the rows of a case: of the same equations, then of a fault."""
    progress(0.0)
    system = next(system for system in SYSTEMS if system.name == case.system)
    rng = np.random.default_rng([crc32(system.name.encode()), case.start])
    start = (np.array(system.start) * (1 + SPREAD * rng.uniform(-1, 1, len(system.start)))).tolist()
    truth, labels = Truth(system), {"system": system.name, "pair": pair_name(case.pair), "start": case.start}
    comparison = compare(system, case.pair, start, {})
    row = labels | {"fault": 0.0} | outcome(comparison) | errors(comparison, truth.states(start), system)
    rows = [row | {"exponent": truth.exponent(start)}]
    if case.start < FAULTS and (fault := fault_of(system, case.pair, start, comparison)):
        rows.append(
            labels | {"fault": fault} | outcome(compare(system, case.pair, start, defect(system, fault)))
        )
    return {"rows": rows}


def pair_name(pair: tuple[str, float, str, float]) -> str:
    """Return the name of a pair of solvers."""
    first, one, second, other = pair
    return f"{first} {one:g}, {second} {other:g}"


def defect(system: System, fault: float) -> dict[str, float]:
    """Return the parameter that a fault changes by a share of itself."""
    name, value = next(iter(system.parameters.items()))
    return {name: value * (1 + fault)}


def compare(
    system: System, pair: tuple[str, float, str, float], start: Sequence[float], overrides: dict[str, float]
) -> SceneComparison:
    """Judge a pair, the second with parameters of its own."""
    first, one, second, other = pair
    return judge(
        system.side(first, start, system.parameters),
        system.side(second, start, system.parameters | overrides),
        tolerance=(None if first == STEP else one, None if second == STEP else other),
        step=(one if first == STEP else None, other if second == STEP else None),
        states=len(system.start),
        n_jobs=1,
    )


def outcome(comparison: SceneComparison) -> Row:
    """Return verdict, `until` (s), and the verdict of a tube of fixed width."""
    sides = comparison.channels.values()
    within = all(float(np.abs(c.difference).max()) <= TUBE * float(np.ptp(c.a)) for c in sides)
    return {"verdict": comparison.verdict, "until": comparison.until, "tube": within}


def errors(comparison: SceneComparison, truth: Array, system: System) -> Row:
    """Return the time (s) at which a run parts from the truth by more than is judged, and numbers on u.

    Up to it the error, the largest within the window of u(t), is small, by the rule of `until`.
    ``outside``: share of the predictable samples at which an error is above 1.41 u; ``width``: median of u
    over error.
    """
    alpha = thresholds("standard").alpha
    parting, outside, widths = system.end, list[float](), list[float]()
    reach = max(1, ceil(comparison.window / system.times[1]))
    for column, channel in enumerate(comparison.channels.values()):
        exact = truth[:, column]
        bound = alpha * (so_far(exact, FIRST) + so_far(-exact, FIRST))
        for values, u in ((channel.a, channel.u_a), (channel.b, channel.u_b)):
            error = np.abs(values - exact)
            near = maximum_filter1d(error, 2 * reach + 1, mode="nearest") <= bound
            parting = min(parting, until(channel.time, near, comparison.window)[0])
            if u is not None and (mask := u <= alpha * channel.scale).any():
                outside.append(float(np.mean(error[mask] > 2**0.5 * u[mask])))
                widths.append(float(np.median(u[mask] / np.maximum(error[mask], 1e-6 * u[mask]))))
    window = comparison.window
    return {"parted": parting, "window": window, "outside": max(outside, default=0.0), "end": system.end} | {
        "width": float(np.median(widths)) if widths else None
    }


def fault_of(
    system: System, pair: tuple[str, float, str, float], start: Sequence[float], comparison: SceneComparison
) -> float:
    """Return the relative change of a parameter that makes |E| `SIZE` u; 0 where it is unknown.

    |E| / u is that on 1 % of the samples, all of them before half of `until`, in the channel where it is
    largest. The effect of a trial is scaled, until that of the change itself is within a factor of 2.
    """
    fault, half = _TRIAL, comparison.time <= comparison.until / 2
    count = max(1, round(0.01 * half.size))
    base, variant = (_values(system, pair, start, change) for change in (0.0, fault))
    for _ in range(6):
        ratios = [0.0]
        for column, channel in enumerate(comparison.channels.values()):
            assert channel.u is not None
            effect = np.sort(np.abs(variant - base)[half, column] / channel.u[half])
            ratios += effect[-count:][:1].tolist() if effect.size >= count else []
        if SIZE / 2 <= max(ratios) <= 2 * SIZE:
            return fault
        if not 0.0 < max(ratios) < inf:
            return 0.0
        fault *= SIZE / max(ratios)
        variant = _values(system, pair, start, fault)
    return 0.0


def _values(
    system: System, pair: tuple[str, float, str, float], start: Sequence[float], fault: float
) -> Array:
    """Return the samples of the second solver with a fault, shape (samples, states)."""
    run = system.side(pair[2], start, system.parameters | defect(system, fault))
    return run(pair[3], np.zeros(len(start))).drop(columns="time").to_numpy()


# ---- page and figure


def system_lines(rows: pd.DataFrame) -> Iterator[dict[str, str]]:
    """Yield the line of each system."""
    for system, group in rows.groupby("system", sort=False):
        clean, faults = group[group["fault"] == 0.0], group[group["fault"] != 0.0]
        yield {
            "system": str(system),
            "pairs and starts": str(len(clean)),
            "differ": str(int((clean["verdict"] == "differ").sum())),
            "until, of its end": share((clean["until"] / clean["end"]).median()),
            "right until, of its end": share((clean["parted"] / clean["end"]).median()),
            "too late": str(int(until_is_late(clean).sum())),
            "error above 1.41 u": share(clean["outside"].mean()),
            "u over error": number(clean["width"].median(), 2),
            "faults": str(len(faults)),
            "found": str(int((faults["verdict"] == "differ").sum())),
            "tube passes": f"{int(clean['tube'].sum())}, with a fault {int(faults['tube'].sum())}",
        }


def until_is_late(rows: pd.DataFrame) -> "pd.Series[bool]":
    """Return a mask of the rows whose `until` is more than a window after a run and the truth part."""
    return rows["until"] > rows["parted"] + rows["window"]


def lead(rows: pd.DataFrame) -> "pd.Series[float]":
    """Return the logarithm of an error's growth from `until` to the time at which it is too large."""
    return (rows["parted"] - rows["until"]) * rows["exponent"]


def page(results: Results) -> dict[str, object]:
    """Return the variables of the template."""
    rows = results.rows
    clean, faults = rows[rows["fault"] == 0.0], rows[rows["fault"] != 0.0]
    decisions = clean[clean["verdict"].isin(["agree", "differ"])]
    differ, hits = int((decisions["verdict"] == "differ").sum()), int((faults["verdict"] == "differ").sum())
    return {
        "systems": rows["system"].nunique(),
        "comparisons": len(clean),
        "decided": len(decisions),
        "differ": differ,
        "limit": share(upper_limit(differ, len(decisions))),
        "faults": len(faults),
        "detected": hits,
        "detected_share": share(hits / max(len(faults), 1)),
        "late": int(until_is_late(clean).sum()),
        "early": share(float((lead(clean) > log(100)).mean())),
        "tube": int(clean["tube"].sum()),
        "tube_faults": int(faults["tube"].sum()),
        "table": markdown(pd.DataFrame(system_lines(rows))),
        "misses": faults[faults["verdict"] != "differ"].to_dict("records"),
        "wrong": decisions[decisions["verdict"] == "differ"].to_dict("records"),
        "failures": results.failures,
        "machine": machine_and_versions(),
    }


def draw(results: Results, folder: Path) -> None:
    """Draw `until` over the time at which a run and the truth part; write the table."""
    write_csv({"foreign": results.rows}, folder, "%.4g")
    clean = results.rows[results.rows["fault"] == 0.0]
    with svg.panels(folder / "until.svg", height=5.0) as (axes,):
        for n, (system, group) in enumerate(clean.groupby("system", sort=False)):
            mark = "osv^D"[n // len(svg.SERIES)]
            axes.plot(
                group["parted"] / group["end"],
                group["until"] / group["end"],
                mark,
                ms=4,
                color=svg.SERIES[n % len(svg.SERIES)],
                label=str(system),
            )
        axes.plot([0, 1], [0, 1], color=svg.LIMIT)
        axes.set(xlabel="time until which both are right, share of the run", ylabel="until, share of the run")
        axes.margins(0.03)
        svg.legend_above(axes, 3)


STUDY = Study(
    "foreign",
    small=Extent(SYSTEMS[:1], 1),
    full=Extent(SYSTEMS, STARTS),
    measure=measure,
    page=page,
    draw=draw,
)
