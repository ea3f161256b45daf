"""Both models as distributions, on the part of the time where single runs cannot be compared.

Every quantity gives one number a run, so that the runs, started independently, are the sample. Two samples
are compared by the two-sample test of Kolmogorov and Smirnov and by the Wasserstein distance. Some hundred
tests at 5 % each would find differences by chance: the p-values are adjusted after Benjamini and Yekutieli
(Ann. Statist. 29, 2001, 1165-1188), however the tests depend on each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import false_discovery_control, ks_2samp, wasserstein_distance

from comparison.accuracy.levels import thresholds
from comparison.execution.run import Job, Progress, run_all, successful
from comparison.report import svg
from comparison.scene import load_scene
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array
from comparison.tables.channels import CORNERS, channels
from comparison.tables.table import Table

CYCLES, FIRST_CYCLE = 4, 1
SPREAD = 0.01
"""Of the clearance: initial offsets are drawn from so much to either side. After a cycle it is forgotten."""
COMPARED = ("slider_x", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
INSTANTS = 40
"""A cycle, at which the channels are compared."""
ROUND_OFF = 1e-16
"""m; of a coordinate of 0.55 m."""
RATE = 0.05
"""Of the differences that are reported, the share expected to be false is at most this."""
NAMES = ["quantity", "where", "unit"]
"""What names a column of an ensemble's numbers, and a row of their tests."""
QUANTILES = {"median": 0.5, "nine tenths": 0.9, "largest": 1.0}
CONTACT_COLUMNS = {"largest_depth": "m", "peak_force": "N", "normal_speed": "m/s"}


class Ensemble(NamedTuple):
    """Runs that are compared with the first ensemble."""

    words: str
    expected: str
    model: str
    seed: int
    changed: dict[str, object]


ENSEMBLES = (
    Ensemble("", "", "reference", 1, {}),
    Ensemble("reference against Exudyn", "the question", "exudyn", 2, {}),
    Ensemble("reference against itself, other starts", "nothing", "reference", 3, {}),
    Ensemble("restitution 1 % lower in one", "a difference", "reference", 4, {"contact.restitution": 0.891}),
    Ensemble("restitution 5 % lower in one", "a difference", "reference", 5, {"contact.restitution": 0.855}),
    Ensemble("friction 1 % higher in one", "a difference", "reference", 6, {"friction.coefficient": 0.1515}),
)
"""The first is compared with each of the others: the question, and controls."""


@dataclass(frozen=True)
class Results:
    """Tests, and what is drawn."""

    members: int  # runs in an ensemble
    tests: list[pd.DataFrame]  # by `distances`, one for each ensemble but the first
    cycles: Array  # times in cycles, shape (n,)
    bands: list[Array]
    """5, 50 and 95 % quantiles of x over the runs of the reference and of Exudyn, m, shape (3, n) each."""
    predictable: float  # m; where x scatters by less single runs can be compared


def member(ensemble: Ensemble, k: int) -> Job:
    """Return the k-th run of an ensemble: every seed draws offsets of its own."""
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": float(CYCLES), "output.samples_per_cycle": 200})
    clearance, usual = scene.data["clearance"]["slider"], scene.data["initial"]["slider_offset"]
    moved = SPREAD * clearance * np.random.default_rng([ensemble.seed, k]).uniform(-1.0, 1.0)
    drawn = scene.with_values({"initial.slider_offset": float(usual + moved)} | ensemble.changed)
    return Job(at_tier(drawn, "tight"), ensemble.model)


def measure(members: int, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the ensembles, each of so many runs, all of which must succeed, and test them."""
    jobs = [member(ensemble, k) for ensemble in ENSEMBLES for k in range(members)]
    tables = map(successful, run_all(jobs, n_jobs, on_progress), jobs)
    ensembles = [list(islice(tables, members)) for _ in ENSEMBLES]
    scene, known, alpha = jobs[0].scene, channels(), thresholds().alpha
    instants = scene.period * np.arange(FIRST_CYCLE * INSTANTS, CYCLES * INSTANTS) / INSTANTS
    units = {name: known[name].unit for name in COMPARED}
    floors = {name: alpha * known[name].scale_value(scene.data, 0.0) for name in COMPARED}
    first, *others = (numbers_of(runs, instants, units, scene.period, FIRST_CYCLE) for runs in ensembles)
    x = ([run.values("slider_x") for run in runs] for runs in ensembles[:2])
    return Results(
        members,
        [distances(*scattered(first, other, floors)) for other in others],
        ensembles[0][0].time / scene.period,
        [np.quantile(values, (0.05, 0.5, 0.95), axis=0) for values in x],
        alpha * scene.data["clearance"]["slider"],
    )


# ---- tests


def distances(a: pd.DataFrame, b: pd.DataFrame) -> pd.DataFrame:
    """Test every column of two ensembles, a row a run; their p-values are adjusted as one family of tests.

    Returns
    -------
    tests
        A row a column: ``statistic``, 0 to 1; ``wasserstein`` and ``scale``, the standard deviation of both
        together, in the column's unit; ``p`` for this column alone; ``adjusted``, the smallest rate of false
        discoveries at which it is a difference; ``differs``: it is one at `RATE`.
    """
    rows = []
    for column in a:
        x, y = a[column].to_numpy(float), b[column].to_numpy(float)
        test = ks_2samp(x, y)
        rows.append((test.statistic, wasserstein_distance(x, y), np.std(np.append(x, y)), test.pvalue))
    tests = pd.DataFrame(rows, a.columns, ["statistic", "wasserstein", "scale", "p"], dtype=np.float64)
    tests["adjusted"] = false_discovery_control(tests["p"], method="by") if rows else tests["p"]
    return tests.assign(differs=tests["adjusted"] <= RATE)


def scattered(
    a: pd.DataFrame, b: pd.DataFrame, floors: Mapping[str, float]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the columns in which either ensemble scatters by more than the floor of the quantity.

    Below it the motion is predictable, and single runs can be compared.
    """
    least = a.columns.get_level_values("quantity").map(lambda name: floors.get(name, -1.0))
    kept = np.maximum(a.to_numpy().std(axis=0), b.to_numpy().std(axis=0)) > least
    return a.loc[:, kept], b.loc[:, kept]


def numbers_of(
    runs: Sequence[Table], instants: Array, units: Mapping[str, str], period: float, first_cycle: int
) -> pd.DataFrame:
    """Return the numbers of an ensemble: a row a run, a column a quantity, where it is taken, and its unit.

    Channels (those of ``units``) are taken at sample times ``instants`` (s), which all runs have. Contacts
    count from a cycle on, the first being 0: until then the runs have not diverged.
    """
    rows = [_numbers(run, instants, units, period, first_cycle) for run in runs]
    return pd.DataFrame(rows, columns=pd.MultiIndex.from_tuples(list(rows[0]), names=NAMES))


def _numbers(
    run: Table, instants: Array, units: Mapping[str, str], period: float, first_cycle: int
) -> dict[tuple[str, str, str], float]:
    assert run.events is not None
    rows = np.searchsorted(run.time, instants - 1e-9 * instants[-1])
    numbers = {
        (channel, f"t = {instant:.4f} s", unit): value
        for channel, unit in units.items()
        for instant, value in zip(instants, run.values(channel)[rows], strict=True)
    }
    edges = period * np.arange(first_cycle, round(run.time[-1] / period) + 1)
    for corner, words in CORNERS.items():
        counts, _ = np.histogram(run.events.loc[run.events["corner"] == corner, "start"], edges)
        for cycle, count in enumerate(counts, first_cycle + 1):
            numbers[f"contacts, {words} corner", f"cycle {cycle}", ""] = float(count)
    late = run.events[run.events["start"] >= edges[0]]
    for column, unit in CONTACT_COLUMNS.items():
        for words, level in QUANTILES.items():
            value = late[column].quantile(level) if len(late) else 0.0
            numbers[f"{column.replace('_', ' ')} of a contact", words, unit] = float(value)
    return numbers


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    rows = []
    for ensemble, tests in zip(ENSEMBLES[1:], results.tests, strict=True):
        least = int(tests["p"].argmin())
        quantity, where, _ = tests.index[least]
        rows.append(
            {
                "ensembles": ensemble.words,
                "expected": ensemble.expected,
                "tests": len(tests),
                f"unadjusted p <= {RATE:g}": (tests["p"] <= RATE).sum(),
                "differ": f"**{tests['differs'].sum()}**",
                "smallest adjusted p": f"{tests['adjusted'].min():.2g}",
                "largest distance": f"{tests['statistic'].iloc[least]:.2f} ({quantity}, {where})",
            }
        )
    return {
        "question": results.tests[0],
        "answers": pd.DataFrame(rows),
        "members": results.members,
        "cycles": CYCLES,
        "spread": f"{SPREAD:.0%}",
        "instants": INSTANTS,
        "rate": f"{RATE:.0%}",
    }


def draw(results: Results, folder: Path) -> None:
    """Draw the medians of both ensembles and how far their runs scatter; write the tests of both models."""
    tests = results.tests[0].sort_values("p", kind="stable")
    tests.to_csv(folder / "tests.csv", float_format="%.6g")
    middle = 0.5 * float(results.bands[0].max() + results.bands[0].min())
    with svg.panels(folder / "slider_x.svg", 2, height=4.4, sharex=True) as (upper, lower):
        for (low, median, high), line, label in zip(
            results.bands, svg.MODEL_LINES, ("reference", "exudyn"), strict=True
        ):
            upper.plot(results.cycles, 1e3 * (median - middle), label=label, **line)
            # Zero has no logarithm.
            lower.semilogy(results.cycles, 1e3 * np.maximum(high - low, ROUND_OFF), **line)
        lower.axhline(1e3 * results.predictable, color=svg.LIMIT, dashes=(1, 2))
        upper.plot([], [], label="predictable below", color=svg.LIMIT, dashes=(1, 2))
        upper.set_ylabel("median of slider x (mm)")
        lower.set(xlabel="time (crank cycles)", ylabel="95 % − 5 % quantile (mm)")
        svg.legend_above(upper)


STUDY = Study(
    "ensembles",
    small=3,  # runs in an ensemble
    full=64,
    measure=measure,
    page=page,
    draw=draw,
)
