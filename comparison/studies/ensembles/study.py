"""Both models as distributions, on the part of the time where single runs cannot be compared.

Every quantity gives one number a run, so that the runs, started independently, are the sample. Two samples
are compared by the two-sample test of Kolmogorov and Smirnov and by the Wasserstein distance. Some hundred
tests at 5 % each would find differences by chance: the p-values are adjusted after Benjamini and Yekutieli
(Ann. Statist. 29, 2001, 1165-1188), however the tests depend on each other.
"""

from collections.abc import Mapping, Sequence
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
from comparison.tables.channels import CORNERS, Array, channels
from comparison.tables.table import Table

CYCLES, FIRST_CYCLE = 4, 1
SPREAD = 0.01
"""Of the clearance: initial offsets are drawn from so much to either side. After a cycle it is forgotten."""
COMPARED = ("slider_x", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
INSTANTS = 40  # a cycle, at which the channels are compared
ROUND_OFF = 1e-16  # m; of a coordinate of 0.55 m
RATE = 0.05  # of the differences that are reported, the share expected to be false is at most this
QUANTILES = {"median": 0.5, "nine tenths": 0.9, "largest": 1.0}
CONTACT_COLUMNS = {"largest_depth": "m", "peak_force": "N", "normal_speed": "m/s"}
ENSEMBLES = pd.DataFrame(
    [
        ("", "", "reference", {}),
        ("reference against Exudyn", "the question", "exudyn", {}),
        ("reference against itself, other starts", "nothing", "reference", {}),
        ("restitution 1 % lower in one", "a difference", "reference", {"contact.restitution": 0.891}),
        ("restitution 5 % lower in one", "a difference", "reference", {"contact.restitution": 0.855}),
        ("friction 1 % higher in one", "a difference", "reference", {"friction.coefficient": 0.1515}),
    ],
    columns=["ensembles", "expected", "model", "changed"],
)
"""The first is compared with each of the others: the question, and controls."""


class Results(NamedTuple):
    """Tests, and what is drawn."""

    members: int  # runs in an ensemble
    tests: list[pd.DataFrame]  # by `distances`, one for each ensemble but the first
    cycles: Array  # times in cycles, shape (n,)
    bands: list[Array]
    """5, 50 and 95 % quantiles of x over the runs of the reference and of Exudyn, m, shape (3, n) each."""
    predictable: float  # m; where x scatters by less single runs can be compared


def measure(members: int, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the ensembles, each of so many runs, all of which must succeed, and test them."""
    base = load_scene("150rpm-0.2mm", {"drive.cycles": float(CYCLES), "output.samples_per_cycle": 200})
    clearance, usual = base.data["clearance"]["slider"], base.data["initial"]["slider_offset"]
    jobs = []
    for n, ensemble in enumerate(ENSEMBLES.to_dict("records"), start=1):
        for k in range(members):
            moved = SPREAD * clearance * np.random.default_rng([n, k]).uniform(-1.0, 1.0)
            drawn = base.with_values({"initial.slider_offset": float(usual + moved)} | ensemble["changed"])
            jobs.append(Job(at_tier(drawn, "tight"), ensemble["model"]))
    tables = map(successful, run_all(jobs, n_jobs, on_progress), jobs)
    ensembles = [list(islice(tables, members)) for _ in range(len(ENSEMBLES))]
    known, alpha = channels(), thresholds().alpha
    floors = {name: alpha * known[name].scale_value(jobs[0].scene.data, 0.0) for name in COMPARED}
    instants = base.period * np.arange(FIRST_CYCLE * INSTANTS, CYCLES * INSTANTS) / INSTANTS
    first, *others = (numbers_of(runs, instants, COMPARED, base.period, FIRST_CYCLE) for runs in ensembles)
    x = ([run.values("slider_x") for run in runs] for runs in ensembles[:2])
    return Results(
        members,
        [distances(*scattered(first, other, floors)) for other in others],
        ensembles[0][0].time / base.period,
        [np.quantile(values, (0.05, 0.5, 0.95), axis=0) for values in x],
        alpha * clearance,
    )


# ---- tests


def distances(a: pd.DataFrame, b: pd.DataFrame) -> pd.DataFrame:
    """Test every column of two ensembles, a row a run; their p-values are adjusted as one family of tests.

    Returns a row a column: ``statistic``, 0 to 1; ``wasserstein`` and ``scale``, the standard deviation of
    both together, in the column's unit; ``p`` for this column alone; ``adjusted``, the smallest rate of false
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
    runs: Sequence[Table], instants: Array, compared: Sequence[str], period: float, first_cycle: int
) -> pd.DataFrame:
    """Return the numbers of an ensemble: a row a run, a column a quantity, where it is taken, and its unit.

    Channels are taken at sample times ``instants`` (s), which all runs have. Contacts count from a cycle on,
    the first being 0: until then the runs have not diverged.
    """
    rows = []
    for run in runs:
        assert run.events is not None
        at = np.searchsorted(run.time, instants - 1e-9 * instants[-1])
        numbers = {
            (name, f"t = {instant:.4f} s", channels()[name].unit): value
            for name in compared
            for instant, value in zip(instants, run.values(name)[at], strict=True)
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
        rows.append(numbers)
    names = pd.MultiIndex.from_tuples(list(rows[0]), names=["quantity", "where", "unit"])
    return pd.DataFrame(rows, columns=names)


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    answers = ENSEMBLES[["ensembles", "expected"]][1:].to_dict("records")
    for line, tests in zip(answers, results.tests, strict=True):
        least = int(tests["p"].argmin())
        quantity, where, _ = tests.index[least]
        line |= {
            "tests": len(tests),
            f"unadjusted p <= {RATE:g}": (tests["p"] <= RATE).sum(),
            "differ": f"**{tests['differs'].sum()}**",
            "smallest adjusted p": f"{tests['adjusted'].min():.2g}",
            "largest distance": f"{tests['statistic'].iloc[least]:.2f} ({quantity}, {where})",
        }
    return {
        "question": results.tests[0],
        "answers": pd.DataFrame(answers),
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
        drawn = zip(results.bands, svg.MODEL_LINES, ("reference", "exudyn"), strict=True)
        for (low, median, high), line, label in drawn:
            upper.plot(results.cycles, 1e3 * (median - middle), label=label, **line)
            # Zero has no logarithm.
            lower.semilogy(results.cycles, 1e3 * np.maximum(high - low, ROUND_OFF), **line)
        lower.axhline(1e3 * results.predictable, color=svg.LIMIT, dashes=(1, 2))
        upper.plot([], [], label="predictable below", color=svg.LIMIT, dashes=(1, 2))
        upper.set_ylabel("median of slider x (mm)")
        lower.set(xlabel="time (crank cycles)", ylabel="95 % − 5 % quantile (mm)")
        svg.legend_above(upper)


STUDY = Study("ensembles", small=3, full=64, measure=measure, page=page, draw=draw)  # runs in an ensemble
