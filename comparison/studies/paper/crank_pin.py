"""Clearance at the crank pin A beside its printed peaks (Figs. 7 and 8): geometry and stiffness."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all, successful
from comparison.formatting import number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.report import svg
from comparison.scene import Scene, load_scene
from comparison.studies.paper import fitting
from comparison.studies.paper.runs import CENTRAL, PIN, PIN_NUDGE
from comparison.studies.shared.published import published
from comparison.studies.shared.study import Study, plain_ticks, rows_table
from comparison.tables.table import Table

STEEL = 210e9  # Pa; the modulus of the scenes
PRINTED = {name: published(f"F7-R-{name[0]}") for name in QUANTITIES}
CASE = ["model", "quantity", "modulus"]  # of an ensemble's peak; Young's modulus in Pa


class Config(NamedTuple):
    """How much is run."""

    moduli: tuple[float, ...]  # Young's, Pa; each is run as an ensemble of the reference
    members: int  # runs in an ensemble
    samples: int  # a cycle


def reach(clearance: float) -> float:
    """Return how far (m) rigid bodies let the slider be off its ideal place, over all crank angles.

    With its pin anywhere in a circle of radius ``clearance`` (m) about the crank's tip.
    """
    geometry, topology, lengths = fitting.shipped_geometry(), fitting.TOPOLOGIES[0], fitting.table_1()[0]
    angle, way = np.meshgrid(np.linspace(0, 2 * np.pi, 1441), np.linspace(0, 2 * np.pi, 73))
    pin = lengths.crank * np.exp(1j * angle) + clearance * np.exp(1j * way)
    shifted = fitting.motion(geometry, topology, lengths._replace(crank=np.abs(pin)), np.angle(pin))
    ideal = fitting.motion(geometry, topology, lengths, angle)
    return float(np.abs(shifted.F.imag - ideal.F.imag).max())


def scene(values: Mapping[str, object], member: int = 0) -> Scene:
    """Return two cycles with clearance at A only."""
    base = load_scene(CENTRAL)
    fixed: dict[str, object] = {
        "joints.slider": "ideal",
        "joints.crank_pin": "clearance",
        "mechanism.crank_angle_deg": base.data["mechanism"]["crank_angle_deg"] + member * PIN_NUDGE,
        "output.groups": ["accelerations"],
    }
    return base.with_values(fixed | dict(values))


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run the ensembles, Exudyn with steel and the ideal mechanism in one go.

    Returns a row a run and quantity, with the columns of `CASE`, ``size`` and ``time`` (s) of the largest
    error of the second cycle, and ``depth`` (m), the largest of the pin in its bearing; of a run that failed
    one row with ``message``.
    """
    usual = {"output.samples_per_cycle": config.samples}
    which = [(MODELS[0], modulus, k) for modulus in config.moduli for k in range(config.members)]
    which.append((MODELS[1], STEEL, 0))
    jobs = [Job(scene(usual | {"contact.youngs_modulus": E}, k), model) for model, E, k in which]
    still = Job(scene(usual | {"joints.crank_pin": "ideal"}), MODELS[0])
    *outcomes, last = run_all([*jobs, still], n_jobs, on_progress)
    ideal = successful(last, still)
    return pd.DataFrame(
        {"model": model, "modulus": modulus} | row
        for (model, modulus, _), outcome in zip(which, outcomes, strict=True)
        for row in peak_rows(outcome, ideal, still.scene.period)
    )


def peak_rows(outcome: Outcome, still: Table, period: float) -> list[dict[str, object]]:
    """Return the peaks of a run against the ideal mechanism's; of one that failed its reason."""
    if (run := outcome.table) is None:
        kind = "not simulated" if outcome.status == "bad input" else outcome.status
        return [{"message": f"{kind}: {outcome.message}"}]
    errors = slider_errors(run, still, period)
    peaks = {name: errors.peak(channel, period, 2 * period) for name, channel in QUANTITIES.items()}
    depth = np.nan if run.events is None else run.events["largest_depth"].max()
    return [
        {"quantity": name, "size": abs(peak.value), "time": peak.time, "depth": depth}
        for name, peak in peaks.items()
    ]


def cases(peaks: pd.DataFrame) -> pd.DataFrame:
    """Return median, least and largest peak of each ensemble and the greatest depth, by `CASE`."""
    groups = peaks.dropna(subset=["size"]).groupby(CASE, sort=False)
    frame = groups["size"].agg(["median", "min", "max", "count"]).assign(depth=groups["depth"].max())
    return frame.sort_index(level="modulus", sort_remaining=False)


def of_reference(frame: pd.DataFrame, name: str) -> pd.DataFrame:
    """Return the reference's peaks of a quantity by Young's modulus, Pa, ascending."""
    rows = frame.reset_index().set_index("modulus")
    return rows[(rows["model"] == MODELS[0]) & (rows["quantity"] == name)]


def met_at(sizes: pd.Series, size: float) -> list[float]:
    """Return the moduli, GPa, at which median peaks pass a size, by logs."""
    above, logs = np.log(sizes.to_numpy() / size), np.log(sizes.index.to_numpy(float) / 1e9)
    return [
        float(np.exp(logs[n] + (logs[n + 1] - logs[n]) * above[n] / (above[n] - above[n + 1])))
        for n in np.flatnonzero(above[:-1] * above[1:] <= 0)
    ]


def page(peaks: pd.DataFrame) -> dict[str, object]:
    """Return what the template asks."""
    frame, clearance = cases(peaks), load_scene(PIN).data["clearance"]["crank_pin"]
    bound, printed = reach(clearance), abs(PRINTED["displacement"].value)
    steel = of_reference(frame, "displacement").reindex([STEEL]).iloc[0]
    return {
        "bound": quantity(bound, "m", 4),
        "printed": quantity(printed, "m", 4),
        # To first order the bound goes with the radius of the circle.
        "needed": quantity(clearance * (printed / bound - 1), "m", 2),
        "depth": quantity(float(steel["depth"]), "m", 2),
        "ours": quantity(float(steel["median"]), "m", 4),
        "members": frame["count"].max(),
        "peaks": rows_table(shown_peak(frame, name) for name in QUANTITIES),
        "failed": peaks.reindex(columns=["model", "message"]).dropna().value_counts(sort=False),
    }


def shown_peak(frame: pd.DataFrame, name: str) -> dict[str, str]:
    """Return a line of the table: a peak of both models with steel, and the moduli that would meet it."""
    printed = PRINTED[name]
    line = {"largest error": name, "printed": quantity(abs(printed.value), printed.unit, 4)}
    for model in MODELS:
        statistics = frame.reindex(pd.MultiIndex.from_tuples([(model, name, STEEL)])).iloc[0]
        low, middle, high = (quantity(statistics[part], printed.unit, 4) for part in ("min", "median", "max"))
        line[model] = f"{middle} ({low} … {high})" if statistics["count"] > 1 else middle
    met = met_at(of_reference(frame, name)["median"], abs(printed.value))
    return line | {"met at (GPa)": " or ".join(number(each, 2) for each in met) or "none"}


def draw(peaks: pd.DataFrame, folder: Path) -> None:
    """Draw the peaks over the modulus; write all ensembles as a table."""
    frame = cases(peaks)
    frame.to_csv(folder / "peaks.csv", float_format="%.6g")
    statistics = of_reference(frame, "acceleration")
    moduli = statistics.index.to_numpy(float) / 1e9
    with svg.panels(folder / "stiffness.svg") as (axes,):
        axes.set(xscale="log", yscale="log", xlabel="Young's modulus (GPa)")
        axes.set_ylabel("peak of the acceleration's\nerror (m/s²)")
        axes.vlines(moduli, statistics["min"], statistics["max"], color=svg.FIRST, lw=0.9)
        look: Any = {"marker": "o", "ms": 4, "color": svg.FIRST, "label": "reference: median and range"}
        axes.plot(moduli, statistics["median"], **look)
        slope = statistics["median"].iloc[0] * (moduli / moduli[0]) ** 0.4
        axes.plot(moduli, slope, color=svg.LIMIT, dashes=(1, 2), label="modulus to the power 0.4")
        size = abs(PRINTED["acceleration"].value)
        axes.axhline(size, color=svg.OUTSIDE, lw=1.2, dashes=(3.5, 1.8), label="printed")
        axes.margins(x=0.03)
        plain_ticks(axes.yaxis, [100, 200, 500, 1000, 2000])
        svg.legend_above(axes)


STUDY = Study(
    "crank-pin",
    small=Config((10e9, 30e9, 70e9, STEEL), members=2, samples=100),
    full=Config((1e9, 3e9, 10e9, 30e9, 100e9, STEEL, 1000e9), members=8, samples=10_000),
    measure=measure,
    page=page,
    draw=draw,
    part_of="paper",
)
