"""The figures of step stability: Baumgarte's gains and the drift, one impact, and the map of contacts."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.colors import LinearSegmentedColormap, LogNorm

from comparison.formatting import decade
from comparison.report import svg
from comparison.studies.extremes.step_stability.baumgarte import SCENES
from comparison.studies.extremes.step_stability.contacts_tables import ALL_PHASES, WRONG
from comparison.studies.extremes.step_stability.explicit import limit
from comparison.studies.extremes.step_stability.fixed_steps import METHODS, rebounds

_DASHES = ((None, None), (4, 1.5), (1, 1.5))
_PER_CONTACT = (10.0, 3.0, 1.0)
"""Steps per contact drawn into the map."""
_MARKS = ("o", "s", "^", "D", "v")
_SHADES = LinearSegmentedColormap.from_list("drift", ["#ffffff", "#5a3d8a"])
SMALL = 0.01
_LOOKS = {
    f"error up to {SMALL:.0%}": ("o", svg.LIMIT, 3),
    f"up to {WRONG:.0%}": ("s", svg.THRESHOLD, 4),
    "larger": ("D", svg.OUTSIDE, 5),
    "stopped": ("x", svg.DIFFERENCE, 5),
}


def steps_over_gain(runs: pd.DataFrame, folder: Path) -> None:
    """Write baumgarte_steps.svg: the reference's mean step where alpha = beta."""
    S = limit(-1.0)
    equal = runs[(runs["cycles"] == 1.0) & (runs["alpha"] == runs["beta"]) & (runs["alpha"] > 0)]
    with svg.panels(folder / "baumgarte_steps.svg", height=3.9) as (axes,):
        for name, mark in zip(SCENES, _MARKS, strict=False):
            groups = equal[equal["scene"] == name].groupby("tolerance", sort=False)
            for (tolerance, group), dashes in zip(groups, _DASHES, strict=False):
                axes.plot(
                    group["alpha"], group["mean_step"], mark, ls="-", color=svg.FIRST, dashes=dashes,
                    mfc="none", ms=4, label=f"{name}, tolerance {tolerance:.0e}",
                )  # fmt: skip
        line = np.array([S / 0.02, equal["alpha"].max()])
        axes.plot(line, S / line, color=svg.LIMIT, lw=2.5, alpha=0.6, zorder=0, label="theory: S / alpha")
        axes.set(xscale="log", yscale="log", xlabel="alpha = beta (1/s)", ylabel="mean step (s)")
        axes.margins(x=0.03)
        svg.legend_above(axes, 2)


def drift_over_gains(runs: pd.DataFrame, folder: Path) -> None:
    """Write baumgarte_drift.svg: the drift of the positions over alpha and beta, at the loosest tolerance."""
    single = runs[(runs["cycles"] == 1.0) & (runs["tolerance"] == runs["tolerance"].max())]
    with svg.panels(folder / "baumgarte_drift.svg", 1, 2, height=3.1, sharey=True) as both:
        for axes, name in zip(both, SCENES, strict=True):
            drift = single[single["scene"] == name].pivot_table("position", "alpha", "beta")
            axes.grid(visible=False)
            axes.pcolormesh(drift, cmap=_SHADES, norm=LogNorm(1e-14, 1e-4))
            for (row, column), value in np.ndenumerate(drift.to_numpy()):
                axes.text(
                    column + 0.5, row + 0.5, f"{np.log10(value):.0f}".replace("-", "−"), ha="center",
                    va="center", color="#000000" if value < 1e-8 else "#ffffff",
                )  # fmt: skip
            labels = ["0", *(decade(gain) for gain in map(float, drift.columns[1:]))]
            axes.set_xticks(np.arange(len(labels)) + 0.5, labels)
            axes.set_yticks(np.arange(len(labels)) + 0.5, labels)
            axes.set_xlabel("beta (1/s)")
            axes.set_title(f"log₁₀ of Φ (m), {name}", size=9)
        both[0].set_ylabel("alpha (1/s)")


def rebound(impacts: pd.DataFrame, folder: Path) -> None:
    """Write rebound.svg: one impact of one mass and of five bodies, over w h."""
    wh = np.geomspace(1e-2, 2e3, 300)
    with svg.panels(folder / "rebound.svg", 2, 1, height=4.9, sharex=True) as both:
        for axes, (name, method) in zip(both, METHODS.items(), strict=True):
            mine = impacts[impacts["method"] == name]
            of = np.array([rebounds(method, each, ALL_PHASES) for each in wh])
            ends = of.min(axis=1), of.max(axis=1)
            axes.fill_between(wh, *ends, color=svg.THRESHOLD, alpha=0.35, lw=0, label="one mass, all phases")
            axes.plot(wh, of.mean(axis=1), color=svg.INK, label="one mass, mean")
            for (step, group), mark in zip(mine.groupby("step"), _MARKS, strict=False):
                axes.plot(
                    group["wh"], group["rebound"], mark, color=svg.SECOND, mfc="none", ms=4, mew=0.7,
                    label=f"five bodies, {step:.0e} s",
                )  # fmt: skip
            failed = mine.loc[mine["status"] != "success", "wh"]
            axes.plot(failed, np.full(len(failed), 0.1), "x", color=svg.DIFFERENCE, ms=5, label="stopped")
            axes.axvline(pi / 10, color=svg.LIMIT, lw=0.8, label="10 steps per contact")
            axes.set(xscale="log", xlim=(wh[0], wh[-1]), ylim=(0, 3.1), ylabel="rebound / impact speed")
            axes.set_title(name, size=9)
        both[1].set_xlabel("w h (steps per contact: π / (w h))")
        svg.legend_above(both[0], 3)


def step_and_modulus(points: pd.DataFrame, folder: Path) -> None:
    """Write step_and_modulus.svg: the error of the map by classes, and lines of equal steps per contact."""
    sizes, (small, wide, larger, stopped) = points["wrong"].abs(), _LOOKS
    conditions = [points["status"] != "success", sizes <= SMALL, sizes <= WRONG]
    classes = np.select(conditions, [stopped, small, wide], larger)
    options = {"sharex": True, "sharey": True}
    with svg.panels(folder / "step_and_modulus.svg", 1, 2, height=3.6, **options) as both:
        for axes, name in zip(both, METHODS, strict=True):
            mine = points["method"] == name
            for words, (mark, colour, size) in _LOOKS.items():
                part = points[mine & (classes == words)]
                axes.plot(part["step"], part["modulus"], mark, color=colour, ms=size, label=words)
            line = points[mine].drop_duplicates("modulus")
            for count, dashes in zip(_PER_CONTACT, _DASHES, strict=True):
                axes.plot(
                    line["count"] * line["step"] / count, line["modulus"], color=svg.INK, lw=0.9,
                    dashes=dashes, label=f"T_c / h = {count:g}",
                )  # fmt: skip
            axes.set(xscale="log", yscale="log", xlabel="step (s)")
            axes.set_title(name, size=9)
        x, y = ((of.min() / 1.7, of.max() * 1.7) for of in (points["step"], points["modulus"]))
        both[0].set(ylabel="Young's modulus (Pa)", xlim=x, ylim=y)
        svg.legend_above(both[0])
