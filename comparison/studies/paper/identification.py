"""The geometry from the published facts, and what runs say about radius, gravity and reference line."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product
from math import exp, radians, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from comparison.execution.run import Job, Progress, run_all, successful
from comparison.formatting import number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import slider_errors
from comparison.report import svg
from comparison.scene import load_scene
from comparison.studies.paper import fitting
from comparison.studies.paper.fitting import BASE, TOPOLOGIES, Fit, Topology
from comparison.studies.shared.published import published
from comparison.studies.shared.study import Columns, Study, curves, markdown, part, write_csv
from comparison.tables.table import Table

Values = dict[str, object]

FITTING = 0.1  # share of the progress that the fits take
UNKNOWNS = ("H_x", "H_y", "guide")
DECISIVE = 3.0
"""Factor between two misfits from which on the peaks decide; scenes scatter by 2 about their mean."""
VELOCITIES = {"lowest": (2, "F14c-vy"), "highest": (3, "F14c-vy2")}
"""Place among the facts, and row of the published one."""
CASES = {
    BASE: "F9-210",
    "69GPa": "F9-69",
    "90rpm-0.1mm": "F11-01",
    "90rpm-0.5mm": "F11-05",
    "300rpm-0.2mm": "F12-300",
}
"""Scene -> how its rows begin in the table of published results; Poisson's ratio 0.33 repeats the first."""
CHANNELS = {"slider_y": "d", "slider_vy": "v", "slider_ay": "a"}
RADIUS, GRAVITY, RUNNER_UP = "contact.corner_radius", "environment.gravity", "runner-up"
PRINTED_RANGES = {
    "x, lowest": published("F14a-x").value,
    "x, highest": published("F14a-x2").value,
    "y error, lowest": published("F14e-y").value,
    "y error, highest": published("F14e-y2").value,
}
"""Of 100 cycles, relative to the ideal slider, m."""
RADII = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
GRAVITIES = (-9.81, 0.0, 9.81)
OFFSETS = (-50e-6, 0.0, 25e-6, 50e-6, 75e-6)
POWER = 0.2
"""Of the radius in an impact's peak force: the stiffness K goes with its root, the force with K^0.4."""
NUDGE = 1e-9
"""m, of the start from one member to the next: which impact is the hardest can depend on less than that."""


class Config(NamedTuple):
    """What is fitted and how much is run."""

    topologies: Sequence[Topology]
    members: int  # runs in an ensemble
    samples: int  # a cycle, of the runs whose peaks are taken
    cycles: int
    long_samples: int  # a cycle, of the runs whose ranges are taken


class Results(NamedTuple):
    """Fits of all arrangements, the best first, and what was run."""

    config: Config
    facts: pd.DataFrame
    fits: list[Fit]
    ratios: pd.DataFrame
    """Median of the largest errors in the second cycle over the published one: a row for each key that is
    varied and its value, a column for each scene and channel."""
    ranges: pd.DataFrame  # a row for each reference offset (m) with the columns of `PRINTED_RANGES`
    ideal: dict[str, Table]  # model -> one cycle of the scene ``ideal``

    @property
    def by_radius(self) -> pd.DataFrame:
        """Ratios of the acceleration: a row a radius (m), a column a scene."""
        return self.ratios.loc[[RADIUS], (slice(None), "slider_ay")].droplevel(0).droplevel(1, axis=1)


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Fit every arrangement and run what kinematics leave open."""
    facts, fits = fitting.printed_facts(), []
    for n, topology in enumerate(config.topologies):
        if fitted := fitting.fit(topology, facts):
            fits.append(fitted)
        if on_progress:
            on_progress(FITTING * (n + 1) / len(config.topologies))
    fits.sort(key=lambda each: each.misfit)
    runs = simulate(fits[1], config, n_jobs, part(on_progress, FITTING, 1.0))
    return Results(config, facts, fits, *runs)


# ---- the runs


def simulate(
    runner_up: Fit, config: Config, n_jobs: int, on_progress: Progress | None
) -> tuple[pd.DataFrame, pd.DataFrame, dict[str, Table]]:
    """Run the shipped press and the runner-up in one go: ``ratios``, ``ranges`` and ``ideal`` of `Results`.

    The runner-up's crank must rotate counter-clockwise and its rod 2 be attached at the rocker's centroid.
    """
    topology, geometry = runner_up.topology, runner_up.geometry
    other: Values = {
        "mechanism.rocker_pivot": [geometry.pivot_x, geometry.pivot_y],
        "mechanism.guide_x": geometry.guide - load_scene(BASE).data["mechanism"]["reference_offset"],
        "mechanism.crank_angle_deg": float(runner_up.shown[0]),
        "mechanism.rocker_branch": topology.rocker,
        "mechanism.slider_branch": topology.slider,
    }
    settings: dict[tuple[str, float], Values] = {(RADIUS, value): {RADIUS: value} for value in RADII}
    settings |= {(GRAVITY, value): {GRAVITY: value} for value in GRAVITIES}
    settings |= {(RUNNER_UP, value): other | {GRAVITY: value} for value in GRAVITIES}
    jobs: dict[tuple[object, ...], Job] = {}
    for (setting, values), name in product(settings.items(), CASES):
        # Gravity and contact move nothing in the ideal mechanism.
        still = {key: value for key, value in values.items() if key.startswith("mechanism.")}
        jobs[setting, name] = _job(name, still | {"joints.slider": "ideal"}, config)
        for k in range(config.members):
            jobs[setting, name, k] = _job(name, values, config, k)
    for offset, (joint, cycles) in product(OFFSETS, (("clearance", config.cycles), ("ideal", 1))):
        long: Values = {"mechanism.reference_offset": offset, "joints.slider": joint, "output.groups": []}
        long |= {"drive.cycles": float(cycles), "output.samples_per_cycle": config.long_samples}
        jobs[offset, joint] = Job(load_scene(BASE, long), "reference")
    for model in MODELS:
        jobs["ideal", model] = Job(load_scene("ideal", {"drive.cycles": 1.0}), model)
    outcomes = run_all(list(jobs.values()), n_jobs, on_progress)
    tables = dict(zip(jobs, map(successful, outcomes, jobs.values()), strict=True))

    rows = []
    for setting in settings:
        ratios = []
        for name, (channel, letter) in product(CASES, CHANNELS.items()):
            still_run = tables[setting, name]
            period = float(still_run.time[-1]) / 2
            errors = (
                slider_errors(tables[setting, name, k], still_run, period) for k in range(config.members)
            )
            sizes = [abs(each.peak(channel, period, 2 * period).value) for each in errors]
            ratios.append(float(np.median(sizes)) / abs(published(f"{CASES[name]}-{letter}").value))
        rows.append(ratios)
    columns = pd.MultiIndex.from_product([CASES, CHANNELS])
    ranges = {offset: _ranges(tables[offset, "clearance"], tables[offset, "ideal"]) for offset in OFFSETS}
    return (
        pd.DataFrame(rows, pd.MultiIndex.from_tuples(settings), columns),
        pd.DataFrame.from_dict(ranges, orient="index", columns=list(PRINTED_RANGES)),
        {model: tables["ideal", model] for model in MODELS},
    )


def _job(name: str, values: Values, config: Config, member: int = 0) -> Job:
    fixed: Values = {"output.groups": ["accelerations"], "output.samples_per_cycle": config.samples}
    scene = load_scene(name, fixed | values)
    start = scene.data["mechanism"]["reference_offset"] + member * NUDGE
    return Job(scene.with_values({"initial.slider_offset": start}), "reference")


def _ranges(run: Table, ideal: Table) -> list[float]:
    # Both start at zero, and the ideal motion repeats in every cycle.
    cycle = np.arange(run.time.size) % (ideal.time.size - 1)
    off = run.values("slider_y") - ideal.values("slider_y")[cycle]
    line, x = float(ideal.values("slider_x")[0]), run.extrema["slider_x"]
    return [x["min"] - line, x["max"] - line, float(off.min()), float(off.max())]


class RadiusFit(NamedTuple):
    """A straight line through the logarithms of radii and peaks."""

    power: float  # of the radius in the peaks
    radius: float
    """At which the mean of the peaks is the published one, m; nan where they do not grow with it."""
    low: float
    high: float  # one standard deviation to either side, from the scatter of the scenes through `POWER`, m
    scatter: float  # factor by which the scenes scatter about their mean


def fit_radius(peaks: pd.DataFrame) -> RadiusFit:
    """Return how peaks over the published ones, a row a radius (m), a column a scene, depend on it."""
    logs, scale = np.log(peaks.to_numpy()), np.log(peaks.index.to_numpy(np.float64))
    power = float(np.polyfit(scale, logs.mean(axis=1), 1)[0])
    # The residual of each scene's ratio about the mean of all gives the uncertainty of a mean of five.
    scatter = sqrt(float(np.mean(np.var(logs, axis=1, ddof=1))))
    factor = exp(scatter / sqrt(logs.shape[1]) / POWER)
    best = exp(float(scale.mean() - logs.mean() / power)) if power > 0 else float("nan")
    return RadiusFit(power, best, best / factor, best * factor, exp(scatter))


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what the template asks."""
    (best, second, *_), facts, shipped = results.fits, results.facts, fitting.shipped_geometry()
    ranked, misfits = ranking(results.fits, facts), misfit(results.ratios)
    misses = fitting.residuals(shipped, best.topology, facts, facts["allowance"].to_numpy())
    own = fitting.shown(shipped, best.topology)[1]
    compared = facts.assign(best=best.shown, second=second.shown, shipped=own)
    six = "{:.6g}".format
    written: Columns = {"fact": str, "unit": str, "value": six, "allowance": partial(number, digits=2)}
    written |= dict.fromkeys(("best", "second", "shipped"), six)
    deviations = np.sqrt(np.diag(best.covariance))
    columns: dict[str, Any] = {"best": best.geometry, "standard deviation": deviations, "shipped": shipped}
    unknowns = {name: [_mm(value) for value in values] for name, values in columns.items()}
    highest = results.ranges["y error, highest"]
    slope, at_zero = np.polyfit(results.ranges.index.to_numpy(np.float64), highest, 1)
    offset = (PRINTED_RANGES["y error, highest"] - at_zero) / slope if slope else np.nan
    factors = {name: [float(misfits[name, value]) for value in GRAVITIES] for name in (GRAVITY, RUNNER_UP)}
    gravities = dict(zip(("upwards", "none", "downwards"), factors[GRAVITY], strict=True))
    return {
        "config": results.config,
        "best": best,
        "second": second,
        "count": len(results.fits),
        "possible": int(((ranked["lowest_off"] == 0) & (ranked["highest_off"] == 0)).sum()),
        "facts": markdown(compared.rename_axis("fact").reset_index(), written),
        "unknowns": markdown(pd.DataFrame({"": UNKNOWNS} | unknowns)),
        "certainty": ", ".join(map(_mm, deviations)),
        "shipped_misfit": sqrt(float(np.sum(misses**2)) / 2),
        "vibration": f"{1e3 * fitting.vibration():.1f}",
        "closed_form": max(_off_the_closed_form(run) for run in results.ideal.values()),
        "gravities": gravities,
        "runner_up": factors[RUNNER_UP],
        "decided": decision(gravities),
        "radius": fit_radius(results.by_radius),
        "used": load_scene(BASE).data["contact"]["corner_radius"],
        "offset_highest": quantity(offset, "m", 2),
    }


def _mm(value: float) -> str:
    return f"{1e3 * value:.2f} mm"


def ranking(fits: Sequence[Fit], facts: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each arrangement, the best first.

    Its geometry (mm), misfit, misses of the five facts in roundings of the print, its ideal velocities,
    and by how much they are too large for the published range, m/s; 0 where they are possible.
    """
    rows = []
    for each in fits:
        misses = each.residuals * facts["allowance"] / facts["rounding"]
        row: dict[str, Any] = {"arrangement": str(each.topology), "misfit": each.misfit}
        row |= {f"{name}_mm": 1e3 * value for name, value in zip(UNKNOWNS, each.geometry, strict=True)}
        row |= {f"miss of {name}": miss for name, miss in misses.items()}
        for end, (place, name) in VELOCITIES.items():
            printed = published(name)
            excess = abs(each.shown[place]) - abs(printed.value)
            possible = -fitting.vibration() - printed.rounding <= excess <= printed.rounding
            row |= {f"{end}_velocity": each.shown[place], f"{end}_off": 0.0 if possible else excess}
        rows.append(row)
    return pd.DataFrame(rows)


def misfit(ratios: pd.DataFrame) -> pd.Series:
    """Return the typical factor by which each row's peaks miss the published ones."""
    factors: pd.Series = np.exp(np.sqrt((np.log(ratios) ** 2).mean(axis=1)))
    return factors


def decision(misfits: Mapping[str, float]) -> str:
    """Say which of several the peaks exclude: those that miss them `DECISIVE` times as much as the best."""
    most = DECISIVE * min(misfits.values())
    excluded = [name for name, value in misfits.items() if value >= most]
    return f"the peaks exclude {' and '.join(excluded)}" if excluded else "the peaks do not decide"


def _off_the_closed_form(run: Table) -> float:
    """Return how far a model's ideal slider is off the closed form of the shipped geometry at most, m."""
    lengths, speed = fitting.table_1()
    crank = radians(run.provenance["scene"]["mechanism"]["crank_angle_deg"]) + speed * run.time
    here = fitting.motion(fitting.shipped_geometry(), TOPOLOGIES[0], lengths, crank)
    return float(np.abs(run.values("slider_y") - here.F.imag).max())


# ---- figures and tables beside the page


def draw(results: Results, folder: Path) -> None:
    """Draw presses and ranking of the fits, radius and offset of the runs; write CSV."""
    _draw_presses(results.fits, folder / "press.svg")
    _draw_ranking(results.fits, folder / "ranking.svg")
    _draw_radius(results.by_radius, folder / "radius.svg")
    _draw_offset(results.ranges, folder / "offset.svg")
    ratios = results.ratios
    peaks = ratios.set_axis(ratios.columns.map(", ".join), axis=1).assign(misfit=misfit(ratios))
    frames = {
        "arrangements": ranking(results.fits, results.facts),
        "peaks": peaks.rename_axis(["varied", "value"]).reset_index(),
        "ranges": results.ranges.rename_axis("offset").reset_index(),
    }
    write_csv(frames, folder)


_BESIDE = {"O": (8, -9), "A": (7, 4), "B": (3, 5), "H": (4, 4), "C": (3, 6), "F": (-12, -3)}
"""Joint -> offset of its letter, points: clear of the links and of the other letters."""


def _draw_presses(fits: Sequence[Fit], path: Path) -> None:
    """Draw the best press and the second at the ends of the stroke, with the paths of crank pin and tip."""
    with svg.panels(path, 1, 2, height=3.1, sharex=True, sharey=True) as both:
        for axes, each, word in zip(both, fits, ("best", "second"), strict=False):
            angle = radians(each.shown[0]) + each.topology.crank * np.linspace(0.0, 2 * np.pi, 721)
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
                axes.annotate(name, at_point, xytext=_BESIDE[name], textcoords="offset points")
            axes.margins(x=0.15, y=0.1)
            axes.set(aspect="equal", xlabel="position x (m)")
            axes.set_title(f"{word}: misfit {each.misfit:.2g}", fontsize=9)
        both[0].set_ylabel("position y (m)")
        svg.legend_above(both[0])


def _draw_ranking(fits: Sequence[Fit], path: Path) -> None:
    """Draw the misfit of every topology, the best on top."""
    places, misfits = np.arange(len(fits)), [each.misfit for each in fits]
    with svg.panels(path, height=0.7 + 0.19 * len(fits)) as (axes,):
        axes.hlines(places, min(misfits) / 2, misfits, color=svg.SHADE, lw=0.8)
        axes.plot(misfits, places, "o", color=svg.SERIES[0], ms=4)
        axes.axvline(1.0, color=svg.LIMIT, dashes=(1, 2))
        axes.set(xscale="log", xlim=(min(misfits) / 2, 2 * max(misfits)), ylim=(len(fits) - 0.5, -0.5))
        labels = [each.topology.words("{}, B {}, rod 2 at {}, {}, guide {}") for each in fits]
        axes.set_yticks(places, labels, fontsize=6.8)
        axes.set_xlabel("misfit of the printed figures (allowances)")


def _draw_radius(peaks: pd.DataFrame, path: Path) -> None:
    """Draw the peaks of the acceleration's error over the corner radius, published ones = 1."""
    radii = peaks.index.to_numpy(np.float64)
    long = peaks.rename_axis("radius").reset_index().melt("radius", var_name="scene")
    looks = {name: {"marker": "o", "color": each} for name, each in zip(peaks, svg.SERIES, strict=False)}
    with svg.panels(path, height=3.2) as (axes,):
        curves(axes, long, "radius", "value", "scene", looks, xscale="log", yscale="log")
        slope = np.exp(np.log(peaks).mean(axis=None)) * (radii / np.exp(np.log(radii).mean())) ** POWER
        axes.plot(radii, slope, color=svg.INK, lw=0.8, dashes=(1, 2), label="K to the power 0.4")
        axes.axhline(1.0, color=svg.LIMIT, lw=0.8)
        axes.yaxis.set_major_locator(FixedLocator([0.2, 0.5, 1, 2, 5]))
        axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.yaxis.set_minor_locator(NullLocator())
        axes.set(xlabel="corner radius (m)", ylabel="peak acceleration error,\nours / published (-)")
        svg.legend_above(axes, 3)


def _draw_offset(ranges: pd.DataFrame, path: Path) -> None:
    """Draw the ranges of many cycles over the reference offset, with the published ones."""
    offsets = 1e6 * ranges.index.to_numpy(np.float64)
    with svg.panels(path, 1, 2, height=2.8) as both:
        for axes, name, scale, unit in zip(both, ("x", "y error"), (1e3, 1e6), ("mm", "µm"), strict=True):
            sides = zip(("highest", "lowest"), svg.SERIES, (None, "published"), strict=False)
            for side, colour, label in sides:
                column = f"{name}, {side}"
                axes.plot(offsets, scale * ranges[column], marker="o", label=side, color=colour)
                axes.axhline(scale * PRINTED_RANGES[column], color=svg.LIMIT, dashes=(1, 2), label=label)
            axes.set(xlabel="reference offset (µm)", ylabel=f"range of the error of {name[0]} ({unit})")
        svg.legend_above(both[0])


STUDY = Study(
    "identification",
    small=Config(topologies=TOPOLOGIES[:5], members=2, samples=100, cycles=3, long_samples=100),
    # 10,000 samples a cycle are 40 us apart at 150 rpm, where half of the contacts last more than 200 us.
    full=Config(topologies=TOPOLOGIES, members=4, samples=10_000, cycles=100, long_samples=1000),
    measure=measure,
    page=page,
    draw=draw,
    part_of="paper",
)
