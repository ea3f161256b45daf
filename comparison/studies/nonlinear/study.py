"""Page and figures of the study nonlinear: whether the press is chaotic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from comparison.formatting import MISSING, prefix, quantity
from comparison.models import MODELS
from comparison.report import svg
from comparison.scene import load_scene
from comparison.studies.nonlinear.chaos import (
    ANGLES,
    CLEARANCE,
    DISTANCES,
    FORGETTING,
    MAIN,
    SHOWN_CYCLES,
    SPEED,
    SWEPT_CYCLES,
    USUAL,
    Config,
    Key,
    Results,
    measure,
    verdict,
)
from comparison.studies.nonlinear.methods import LEAST, LONGEST, Exponent, chaos_indicator, recurrence
from comparison.studies.shared.frames import Quantities, quantities, write_csv
from comparison.studies.shared.study import Study

SECTION = 15
"""The sample of a cycle, of `ANGLES`, that stands for the others: in the slider's chatter."""
SAME = 1e-3
"""Of the clearance: two states of a section this close are the same."""
COLOURS = dict(zip(MODELS, (svg.FIRST, svg.SECOND), strict=True))
SECTIONS: Quantities = {
    "scene": "scene",
    "K, reference": ("K, reference", "", 2),
    "K, exudyn": ("K, exudyn", "", 2),
    "section repeats after (cycles)": "repeats",
    "largest scatter": ("scatter_m", "m", 2),
    "least": ("least_scatter_m", "m", 2),
}
"""Columns of a table of the appendix."""
LATER = (0.78, 0.86, 0.0)
"""Of a cycle: at rest at the right wall, just after it has left it, at the next top dead centre."""

# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, best = results.config, results.best
    return {
        "config": config,
        "verdicts": pd.Series([verdict(best, name).value for name in config.scenes]).value_counts(),
        "answer": pd.DataFrame(answer(best, name) for name in config.scenes),
        "sections": quantities(sections_frame(results), SECTIONS),
        "forgetting": pd.DataFrame(_forgetting(results, name) for name in (MAIN, FORGETTING)),
        "longest": LONGEST,
        "shown": SHOWN_CYCLES,
        "swept": SWEPT_CYCLES,
    }


def answer(best: Mapping[Key, Exponent], name: str) -> dict[str, str]:
    """Return for a scene whether it is chaotic, its exponents, and how many runs measure them."""
    line = {"scene": name, "verdict": f"**{verdict(best, name).value}**"}
    for model in MODELS:
        runs = [e for key, e in best.items() if key[:2] == (name, model)]
        measured = sorted(e.value for e in runs if e.measured)
        ends = " … ".join(f"{value:.2f}" for value in dict.fromkeys(measured[:1] + measured[-1:]))
        bound = f"≤ {min(e.value for e in runs):.2f}" if runs else MISSING
        line[f"exponent, {model} (1/cycle)"] = ends or bound
        line[f"runs that measure it, {model}"] = f"{len(measured)} of {len(runs)}"
    return line


def exponents_frame(results: Results) -> pd.DataFrame:
    """Return every exponent, a row a distance."""
    return pd.DataFrame(
        {
            "scene": name,
            "model": model,
            "tolerance": tolerance,
            "distance_m": distance,
            "exponent_per_cycle": e.value,
            "low": e.low,
            "high": e.high,
            "share_collapsed": e.collapsed,
            "upper_bound": not e.measured,
            "believed": e == results.best[name, model, tolerance],
        }
        for (name, model, tolerance), measured in results.exponents.items()
        for distance, e in zip(DISTANCES[model], measured, strict=False)
    )


def sections_frame(results: Results) -> pd.DataFrame:
    """Return 0-1 test, recurrence and scatter of each scene."""
    rows = []
    for name in results.config.scenes:
        series = {model: results.sections[name, model][:, SECTION, 0] for model in MODELS}
        same = SAME * load_scene(name).data["clearance"]["slider"]
        rows.append(
            {"scene": name}
            | {f"K, {model}": chaos_indicator(x) if x.size >= LEAST else nan for model, x in series.items()}
            | {
                "repeats": recurrence(series[MODELS[0]], same) or "never",
                "scatter_m": results.scatter[name].max(),
                "least_scatter_m": results.scatter[name].min(),
            }
        )
    return pd.DataFrame(rows)


def _forgetting(results: Results, name: str) -> dict[str, str]:
    """Return exponents and scatter of the main scene with frozen impact speeds, or without that memory."""
    line = {"impact speed": "frozen" if name == MAIN else "of the moment"}
    for model in MODELS:
        e = results.best.get((name, model, USUAL[model]))
        bound = "" if e is None or e.measured else "≤ "
        line[f"exponent, {model}"] = (
            MISSING if e is None else f"{bound}{e.value:.2f} ({e.low:.2f} … {e.high:.2f})"
        )
    scatter = results.scatter[name]
    sizes = {f"scatter at {360 * angle:.0f}°": scatter[round(angle * ANGLES)] for angle in LATER}
    sizes["largest"] = scatter.max()
    return line | {where: quantity(float(size), "m", 2) for where, size in sizes.items()}


# ---- figures

DRAWN = (0, 7, 15, 34)
"""Samples of a cycle whose sections are drawn."""
MOST_POINTS = 200
DIAGRAMS = (
    (SPEED, "speed (rpm)", 1.0, 15),
    (SPEED, "speed (rpm)", 1.0, 36),
    (CLEARANCE, "clearance (mm)", 1e3, 15),
)
"""Key, label, factor and sample of a cycle of each bifurcation diagram: after the reversal the slider
chatters, before the top dead centre only at high speed."""
BINS = 400
"""Of a bifurcation diagram's height: cycles that fall into the same are one point."""


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and exponents and sections as tables."""
    write_csv({"exponents": exponents_frame(results), "sections": sections_frame(results)}, folder, "%.6g")
    names = results.config.scenes
    with svg.panels(folder / "exponents.svg", height=0.42 * len(names) + 1.0) as (axes,):
        _exponents(axes, results.best, names)
    with svg.panels(folder / "sections.svg", 2, 2, height=4.8) as panels:
        for axes, angle in zip(panels, DRAWN, strict=True):
            _section(axes, results, angle)
        svg.legend_above(panels[0])
    with svg.panels(folder / "bifurcation.svg", len(DIAGRAMS), height=6.4) as panels:
        for axes, (key, label, factor, angle) in zip(panels, DIAGRAMS, strict=True):
            points = [
                (factor * value, y / BINS)
                for value, x in results.swept[key].items()
                for y in np.unique(np.round(x[:, angle] * BINS))
            ]
            at, y = np.array(points).reshape(-1, 2).T
            # Very short dashes with round ends are dots, in one path: a tenth of the bytes of markers.
            gap, ends = np.full(at.size, np.nan), at + 1e-4 * np.ptp(at) if at.size else at
            line = np.column_stack([at, ends, gap]).ravel(), np.column_stack([y, y, gap]).ravel()
            axes.plot(*line, color=svg.FIRST, lw=1.5, solid_capstyle="round")
            axes.margins(x=0.02)
            axes.set_title(f"{360 * angle / ANGLES:.0f}° after the start", fontsize=9)
            axes.set(xlabel=label, ylabel="slider x / clearance (-)")


def _exponents(axes: Axes, best: Mapping[Key, Exponent], names: Sequence[str]) -> None:
    """Draw the exponents to believe with their intervals; hollow: an upper bound."""
    for row, name in enumerate(names):
        runs = [(model, e) for (scene, model, _), e in best.items() if scene == name]
        for n, (model, e) in enumerate(runs):
            at, bars = row + 0.12 * (n - 0.5 * (len(runs) - 1)), [[e.value - e.low], [e.high - e.value]]
            axes.errorbar(
                e.value, at, xerr=bars, color=COLOURS[model], fmt="o", ms=4, lw=0.9, capsize=1.5,
                mfc=None if e.measured else "none",
            )  # fmt: skip
    for model, colour in COLOURS.items():
        axes.plot([], [], "o", ms=4, color=colour, label=model)
    axes.plot([], [], "o", ms=4, color=svg.INK, mfc="none", label="upper bound")
    axes.axvline(0.0, color=svg.LIMIT, lw=0.8)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set(xlabel="largest Lyapunov exponent (1/cycle)", ylabel="scene")
    svg.legend_above(axes)


def _section(axes: Axes, results: Results, angle: int) -> None:
    """Draw x and its rate once a cycle, of both models, from the reference's median."""
    reference = results.sections[MAIN, MODELS[0]][:, angle]
    middle, reach = np.median(reference, axis=0), np.ptp(reference, axis=0)
    factor, unit = prefix(max(0.3 * reach[0], 1e-9), "m")
    rate_factor, rate_unit = prefix(max(0.3 * reach[2], 1e-9), "m/s")
    for model, marker in zip(MODELS, "ox", strict=True):
        x, _, rate, _ = (results.sections[MAIN, model][:MOST_POINTS, angle] - middle).T
        axes.plot(
            x / factor, rate / rate_factor, marker,
            color=COLOURS[model], ms=2.6, mew=0.6, label=model, fillstyle="none",
        )  # fmt: skip
    axes.margins(0.06)
    axes.locator_params(nbins=5)
    axes.ticklabel_format(style="plain", useOffset=False)
    axes.set_title(f"{360 * angle / ANGLES:.0f}° after the start", fontsize=9)
    axes.set(xlabel=f"slider x ({unit})", ylabel=f"velocity of x ({rate_unit})")


STUDY = Study(
    "nonlinear",
    small=Config(
        scenes=(MAIN, "300rpm-0.2mm"),
        tolerances={"reference": (1e-10, 1e-12), "exudyn": (1e-10,)},
        cycles={"reference": 3, "exudyn": 2},
        long={"reference": 112, "exudyn": 14},
        long_main={"reference": 112, "exudyn": 14},
        swept={SPEED: (100.0, 200.0), CLEARANCE: (1e-4, 2e-4)},
    ),
    full=Config(
        scenes=(MAIN, "300rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm"),
        tolerances={"reference": (1e-9, 1e-10, 1e-11, 1e-12), "exudyn": (1e-8, 1e-9, 1e-10, 1e-11)},
        cycles={"reference": 40, "exudyn": 8},
        long={"reference": 600, "exudyn": 60},
        long_main={"reference": 600, "exudyn": 110},
        swept={
            SPEED: tuple(float(speed) for speed in range(60, 401, 2)),
            CLEARANCE: tuple(round(5e-6 * k, 6) for k in range(12, 121)),
        },
    ),
    measure=measure,
    page=page,
    draw=draw,
)
