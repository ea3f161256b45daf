"""Both models as distributions, on the part of the time where single runs cannot be compared.

Every quantity gives one number a run, so that the runs, started independently, are the sample. Two samples
are compared by the two-sample test of Kolmogorov and Smirnov. Some hundred tests at 5 % each would find
differences by chance: the p-values are adjusted after Benjamini and Yekutieli (Ann. Statist. 29, 2001,
1165-1188), however the tests depend on each other.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from scipy.stats import false_discovery_control, ks_2samp

from comparison.accuracy.levels import thresholds
from comparison.execution.run import Job, Progress, run_all, table_of
from comparison.execution.store import Row
from comparison.scene import load_scene
from comparison.studies.shared.scenes import at_tier
from comparison.tables.channels import CORNERS, Array, channels
from comparison.tables.table import Table

CYCLES, FIRST_CYCLE = 4, 1
SPREAD = 0.01
"""Of the clearance: initial offsets are drawn from so much to either side. After a cycle it is forgotten."""
CHANNELS = ("slider_x", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
INSTANTS = 40  # a cycle, at which the channels are compared
RATE = 0.05  # of the differences that are reported, the share expected to be false is at most this
QUANTILES = {"median": 0.5, "nine tenths": 0.9, "largest": 1.0}
CONTACT_COLUMNS = ("largest_depth", "peak_force", "normal_speed")
ENSEMBLES: dict[str, tuple[str, str, Mapping[str, object]]] = {
    "": ("", "reference", {}),
    "reference against Exudyn": ("the question", "exudyn", {}),
    "reference against itself, other starts": ("no difference", "reference", {}),
    "restitution 1 % lower in one": ("a difference", "reference", {"contact.restitution": 0.891}),
}
"""Each is compared with the first: the expectation, the model, and its changed keys."""


def compare_ensembles(members: int, n_jobs: int, on_progress: Progress | None) -> list[Row]:
    """Run the ensembles, each of so many runs, all of which must succeed; return a row for each comparison.

    ``kind`` is the expectation, ``tests`` the number of quantities, ``differing`` that of those that differ,
    ``reason`` the largest distance.
    """
    base = load_scene("150rpm-0.2mm", {"drive.cycles": float(CYCLES), "output.samples_per_cycle": 200})
    clearance, offset = base.data["clearance"]["slider"], base.data["initial"]["slider_offset"]
    jobs = []
    for n, (_, model, changes) in enumerate(ENSEMBLES.values(), start=1):
        for k in range(members):
            shift = SPREAD * clearance * np.random.default_rng([n, k]).uniform(-1.0, 1.0)
            scene = base.with_values({"initial.slider_offset": float(offset + shift), **changes})
            jobs.append(Job(at_tier(scene, "tight"), model))
    outcomes = run_all(jobs, n_jobs, on_progress)
    tables = [table_of(outcome, job) for outcome, job in zip(outcomes, jobs, strict=True)]
    scales = {name: channels()[name].scale_value(base.data, 0.0) for name in CHANNELS}
    floors = {name: thresholds().largest(scale) for name, scale in scales.items()}
    instants = base.period * np.arange(FIRST_CYCLE * INSTANTS, CYCLES * INSTANTS) / INSTANTS
    first, *others = (
        numbers_of(tables[n : n + members], instants, CHANNELS, base.period, FIRST_CYCLE)
        for n in range(0, len(tables), members)
    )
    rows = []
    for name, other in zip(list(ENSEMBLES)[1:], others, strict=True):
        tests = distances(*scatter_columns(first, other, floors))
        smallest = int(tests["p"].argmin())
        quantity, where = tests.index[smallest]
        reason = f"largest distance {tests['statistic'].iloc[smallest]:.2f} ({quantity}, {where})"
        differing = int(tests["differs"].sum())
        verdict = {"name": name, "kind": ENSEMBLES[name][0], "verdict": "differ" if differing else "agree"}
        rows.append(verdict | {"tests": len(tests), "differing": differing, "reason": reason})
    return rows


def distances(a: pd.DataFrame, b: pd.DataFrame) -> pd.DataFrame:
    """Test every column of two ensembles, a row a run; their p-values are adjusted as one family of tests.

    Returns a row a column: ``statistic``, 0 to 1; ``p`` for this column alone; ``adjusted``, the smallest
    rate of false discoveries at which it is a difference; ``differs``: it is one at `RATE`.
    """
    rows = [ks_2samp(a[column].to_numpy(float), b[column].to_numpy(float)) for column in a]
    tests = pd.DataFrame([(test.statistic, test.pvalue) for test in rows], a.columns, ["statistic", "p"])
    tests["adjusted"] = false_discovery_control(tests["p"], method="by") if rows else tests["p"]
    return tests.assign(differs=tests["adjusted"] <= RATE)


def scatter_columns(
    a: pd.DataFrame, b: pd.DataFrame, floors: Mapping[str, float]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the columns in which either ensemble scatters by more than the floor of the quantity.

    Below it the motion is predictable, and single runs can be compared.
    """
    floor = a.columns.get_level_values("quantity").map(lambda name: floors.get(name, -1.0))
    scatter = np.maximum(a.to_numpy().std(axis=0), b.to_numpy().std(axis=0)) > floor
    return a.loc[:, scatter], b.loc[:, scatter]


def numbers_of(
    runs: Sequence[Table], instants: Array, names: Sequence[str], period: float, first_cycle: int
) -> pd.DataFrame:
    """Return the numbers of an ensemble: a row a run, a column a quantity and where it is taken.

    Channels are taken at sample times ``instants`` (s), which all runs have. Contacts count from a cycle on,
    the first being 0: until then the runs have not diverged.
    """
    rows = []
    for run in runs:
        assert run.events is not None
        at = np.searchsorted(run.time, instants - 1e-9 * instants[-1])
        numbers = {
            (name, f"t = {instant:.4f} s"): value
            for name in names
            for instant, value in zip(instants, run.values(name)[at], strict=True)
        }
        edges = period * np.arange(first_cycle, round(run.time[-1] / period) + 1)
        for corner, words in CORNERS.items():
            counts, _ = np.histogram(run.events.loc[run.events["corner"] == corner, "start"], edges)
            for cycle, count in enumerate(counts, first_cycle + 1):
                numbers[f"contacts, {words} corner", f"cycle {cycle}"] = float(count)
        later = run.events[run.events["start"] >= edges[0]]
        for column in CONTACT_COLUMNS:
            for words, level in QUANTILES.items():
                value = later[column].quantile(level) if len(later) else 0.0
                numbers[f"{column.replace('_', ' ')} of a contact", words] = float(value)
        rows.append(numbers)
    return pd.DataFrame(rows, columns=pd.MultiIndex.from_tuples(list(rows[0]), names=["quantity", "where"]))
