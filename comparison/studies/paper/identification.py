"""The geometry from the printed facts, and corner radius and gravity from the printed peaks."""

from collections.abc import Sequence
from functools import partial
from itertools import product
from math import exp, log, radians, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import t as student

from comparison.execution.run import Progress
from comparison.formatting import number, quantity
from comparison.report import svg
from comparison.scene import load_scene
from comparison.studies.paper import fitting, runs
from comparison.studies.paper.fitting import BASE, TOPOLOGIES, Fit, Topology
from comparison.studies.shared.published import published
from comparison.studies.shared.study import Columns, Study, markdown, part, write_csv

FITTING = 0.3  # share of the progress that the fits take
UNKNOWNS = ("H_x", "H_y", "line")
VELOCITIES = {"lowest": (2, "F14c-vy"), "highest": (3, "F14c-vy2")}
"""Place among the facts, and row of the printed one."""
CASES = {
    BASE: "F9-210",
    "69GPa": "F9-69",
    "90rpm-0.1mm": "F11-01",
    "90rpm-0.5mm": "F11-05",
    "300rpm-0.2mm": "F12-300",
}
"""Scene -> prefix of its rows in the table of printed numbers; Poisson's ratio 0.33 repeats the first."""
RADIUS, GRAVITY = "contact.corner_radius", "environment.gravity"
RADII = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
GRAVITIES = {"upwards": -9.81, "none": 0.0, "downwards": 9.81}
DECISIVE = 3.0
"""Factor between two misfits from which on the peaks decide; scenes scatter by 2 about their mean."""
POWER = 0.2
"""Of the radius in an impact's peak force: the stiffness K goes with its root, the force with K^0.4."""
NUDGE = 1e-9
"""m, of the start from one member to the next: the hardest impact can be another one after less than that."""


class Config(NamedTuple):
    """Fits, and the number of runs."""

    topologies: Sequence[Topology]
    members: int  # runs in an ensemble
    sampling: runs.Config


class Results(NamedTuple):
    """Fits of all arrangements, the best first, and peaks."""

    config: Config
    facts: pd.DataFrame
    fits: list[Fit]
    ratios: pd.DataFrame
    """Median of the largest errors in the second cycle over the printed one: a row for each key that is
    varied and its value, a column for each printed row."""


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Fit every arrangement, and run the shipped one with other radii and gravities."""
    facts, fits = fitting.printed_facts(), []
    for n, topology in enumerate(config.topologies):
        if fit := fitting.fit(topology, facts):
            fits.append(fit)
        if on_progress:
            on_progress(FITTING * (n + 1) / len(config.topologies))
    fits.sort(key=lambda each: each.misfit)
    return Results(config, facts, fits, simulate(config, n_jobs, part(on_progress, FITTING, 1.0)))


def simulate(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run the shipped press with each radius and gravity by the reference: ``ratios`` of `Results`."""
    settings = [*product([RADIUS], RADII), *product([GRAVITY], GRAVITIES.values())]
    ids = {name: tuple(f"{prefix}-{letter}" for letter in "dva") for name, prefix in CASES.items()}
    draws = []
    for (key, value), name, k in product(settings, CASES, range(config.members)):
        start = load_scene(name).data["mechanism"]["reference_offset"] + k * NUDGE
        changes = {key: value, runs.START: start}
        draws.append((runs.Draw(name, ids[name], config.sampling, {}, left_open=False, changes=changes), 1))
    ensembles = iter(runs.run_draws(draws, n_jobs, on_progress))
    rows = []
    for _ in settings:
        sizes: dict[str, float] = {}
        for name in CASES:
            readings = pd.concat([next(ensembles).readings for _ in range(config.members)])
            sizes |= {row: float(readings[row]["value"].abs().median()) for row in ids[name]}
        rows.append({row: size / abs(published(row).value) for row, size in sizes.items()})
    return pd.DataFrame(rows, pd.MultiIndex.from_tuples(settings))


def fit_radius(peaks: pd.DataFrame) -> tuple[float, float, float]:
    """Fit the dependence of peaks over the printed ones, a row a radius (m), a column a scene, on the radius.

    Return, by a line through the logarithms, the power of the radius; the radius at which the mean of the
    peaks is the printed one, nan where they do not grow with it; and the factor to which it is known, one
    standard error of the mean, from the scatter of the scenes through `POWER`.
    """
    logs, scale = np.log(peaks.to_numpy()), np.log(peaks.index.to_numpy(np.float64))
    power = float(np.polyfit(scale, logs.mean(axis=1), 1)[0])
    # The residual of each scene's ratio about the mean of all gives the uncertainty of a mean of five.
    scatter = sqrt(float(np.mean(np.var(logs, axis=1, ddof=1))))
    best = exp(float(scale.mean() - logs.mean() / power)) if power > 0 else float("nan")
    return power, best, exp(scatter / sqrt(logs.shape[1]) / POWER)


def by_radius(ratios: pd.DataFrame) -> pd.DataFrame:
    """Return the ratios of the acceleration: a row a radius (m), a column a scene."""
    return pd.DataFrame({name: ratios.loc[RADIUS, f"{prefix}-a"] for name, prefix in CASES.items()})


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return the variables of the template."""
    (best, second, *_), facts, shipped = results.fits, results.facts, fitting.shipped_geometry()
    misfits = misfit(results.ratios)
    misses = fitting.residuals(shipped, best.topology, facts, facts["allowance"].to_numpy())
    shipped_facts = fitting.facts_of(shipped, best.topology)[1]
    table = facts.assign(best=best.facts, second=second.facts, shipped=shipped_facts)
    write = "{:.6g}".format
    writers: Columns = {"fact": str, "unit": str, "value": write, "allowance": partial(number, digits=2)}
    writers |= dict.fromkeys(("best", "second", "shipped"), write)
    deviations = np.sqrt(np.diag(best.covariance))
    columns: dict[str, Any] = {"best": best.geometry, "standard deviation": deviations, "shipped": shipped}
    unknowns = {name: [_mm(value) for value in values] for name, values in columns.items()}
    gravities = {name: float(misfits[GRAVITY, value]) for name, value in GRAVITIES.items()}
    threshold = DECISIVE * min(gravities.values())
    peaks = by_radius(results.ratios)
    power, radius, factor = fit_radius(peaks)
    return {
        "config": results.config,
        "best": best,
        "second": second,
        "count": len(results.fits),
        "possible": int(ranking(results.fits)["possible"].sum()),
        "facts": markdown(table.rename_axis("fact").reset_index(), writers),
        "unknowns": markdown(pd.DataFrame({"": UNKNOWNS} | unknowns)),
        "certainty": ", ".join(map(_mm, deviations)),
        "values": ", ".join(map(_mm, shipped)),
        "within": int((np.abs(np.subtract(shipped, best.geometry)) < deviations).sum()),
        "shipped_misfit": sqrt(float(np.sum(misses**2)) / 2),
        "vibration": f"{1e3 * fitting.vibration():.1f}",
        "gravities": gravities,
        "excluded": [name for name, value in gravities.items() if value >= threshold],
        "power": power,
        "radii": sorted(exp(np.interp(0.0, np.log(peaks[name]), np.log(RADII))) for name in peaks),
        "likely": factor ** student.ppf(0.975, peaks.shape[1] - 1),
        "radius_factor": factor,
        # In such factors.
        "radius_off": abs(log(load_scene(BASE).data["contact"]["corner_radius"] / radius)) / log(factor),
        "implied": {name: quantity(value, "m", 3) for name, value in fitting.implied_positions().items()},
    }


def _mm(value: float) -> str:
    return f"{1e3 * value:.2f} mm"


def ranking(fits: Sequence[Fit]) -> pd.DataFrame:
    """Return a row for each arrangement, the best first: geometry (mm), misfit, ideal velocities (m/s).

    ``possible``: both velocities lie inside the printed range, by no more than clearance can widen it.
    """
    rows = []
    for each in fits:
        row: dict[str, Any] = {"arrangement": str(each.topology), "misfit": each.misfit, "possible": True}
        row |= {f"{name}_mm": 1e3 * value for name, value in zip(UNKNOWNS, each.geometry, strict=True)}
        for end, (place, name) in VELOCITIES.items():
            datum, velocity = published(name), each.facts[place]
            excess = abs(velocity) - abs(datum.value)
            row["possible"] &= -fitting.vibration() - datum.rounding <= excess <= datum.rounding
            row[f"{end}_velocity"] = velocity
        rows.append(row)
    return pd.DataFrame(rows)


def misfit(ratios: pd.DataFrame) -> pd.Series:
    """Return the typical factor by which each row's peaks miss the printed ones."""
    factors: pd.Series = np.exp(np.sqrt((np.log(ratios) ** 2).mean(axis=1)))
    return factors


# ---- figures and tables beside the page

_OFFSETS = {"O": (8, -9), "A": (7, 4), "B": (3, 5), "H": (4, 4), "C": (3, 6), "F": (-12, -3)}
"""Joint -> offset of its letter, points: clear of the links and of the other letters."""


def draw(results: Results, folder: Path) -> None:
    """Draw the best press and the second at the ends of the stroke; write fits and peaks as CSV."""
    peaks = results.ratios.assign(misfit=misfit(results.ratios)).rename_axis(["varied", "value"])
    write_csv({"arrangements": ranking(results.fits), "peaks": peaks.reset_index()}, folder)
    with svg.panels(folder / "press.svg", 1, 2, height=3.1, sharex=True, sharey=True) as panels:
        for axes, each, word in zip(panels, results.fits, ("best", "second"), strict=False):
            angle = radians(each.facts[0]) + each.topology.crank * np.linspace(0.0, 2 * np.pi, 721)
            cycle = fitting.motion(each.geometry, each.topology, fitting.table_1()[0], angle)
            for path_of in (cycle.C, cycle.A):
                axes.plot(path_of.real, path_of.imag, color=svg.LIMIT, lw=0.8)
            axes.axvline(each.geometry.guide, color=svg.GRID, lw=0.8)
            H = complex(each.geometry.pivot_x, each.geometry.pivot_y)
            ends = {"top dead centre": 0, "bottom dead centre": int(cycle.F.imag.argmin())}
            for (label, at), colour in zip(ends.items(), svg.SERIES, strict=False):
                chain = np.array([0.0, cycle.A[at], cycle.B[at], np.nan, H, cycle.C[at], cycle.F[at]])
                axes.plot(chain.real, chain.imag, marker="o", ms=2.5, color=colour, label=label)
            joints = {"O": 0j, "H": H} | {name: getattr(cycle, name)[0] for name in "ABCF"}
            for name, point in joints.items():
                at_point = (point.real, point.imag)
                axes.annotate(name, at_point, xytext=_OFFSETS[name], textcoords="offset points")
            axes.margins(x=0.15, y=0.1)
            axes.set(aspect="equal", xlabel="position x (m)")
            axes.set_title(f"{word}: misfit {each.misfit:.2g}", fontsize=9)
        panels[0].set_ylabel("position y (m)")
        svg.legend_above(panels[0])


STUDY = Study(
    "identification",
    small=Config(TOPOLOGIES[:5], members=2, sampling=runs.Config(100, 100, 2)),
    # 10,000 samples a cycle are 40 us apart at 150 rpm, where half of the contacts last more than 200 us.
    full=Config(TOPOLOGIES, members=4, sampling=runs.Config(10_000, 1000, 2)),
    measure=measure,
    page=page,
    draw=draw,
    part_of="paper",
)
