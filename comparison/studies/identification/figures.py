"""The figures of the study identification."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians
from pathlib import Path

import numpy as np
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from comparison.formatting import number
from comparison.report import svg
from comparison.studies.identification.fitting import Fit, Profile, shipped_geometry, table_1
from comparison.studies.identification.kinematics import motion
from comparison.studies.identification.runs import POWER, PRINTED_RANGES, Runs

UNKNOWNS = ("H_x", "H_y", "guide")
_BESIDE = {"O": (8, -9), "A": (7, 4), "B": (3, 5), "H": (4, 4), "C": (3, 6), "F": (-12, -3)}
"""Joint -> offset of its letter, points: clear of the links and of the other letters."""
_ROW = 0.19
"""Inches: a line of the ranking."""


def draw_presses(fits: Sequence[Fit], path: Path) -> None:
    """Draw the best press and the second at the ends of the stroke, with the paths of crank pin and tip."""
    with svg.panels(path, 1, 2, height=3.1, sharex=True, sharey=True) as both:
        for axes, fit, word in zip(both, fits, ("best", "second"), strict=False):
            angle = radians(fit.shown[0]) + fit.topology.crank * np.linspace(0.0, 2 * np.pi, 721)
            cycle = motion(fit.geometry, fit.topology, table_1()[0], angle)
            for path_of in (cycle.C, cycle.A):
                axes.plot(path_of.real, path_of.imag, color=svg.LIMIT, lw=0.8)
            axes.axvline(fit.geometry.guide, color=svg.GRID, lw=0.8)
            H = complex(fit.geometry.pivot_x, fit.geometry.pivot_y)
            low = int(cycle.F.imag.argmin())
            for at, colour, label in (
                (0, svg.SERIES[0], "top dead centre"),
                (low, svg.SERIES[1], "bottom dead centre"),
            ):
                chain = np.array([0.0, cycle.A[at], cycle.B[at], np.nan, H, cycle.C[at], cycle.F[at]])
                axes.plot(chain.real, chain.imag, marker="o", ms=2.5, color=colour, label=label)
            joints = {"O": 0j, "H": H} | {name: getattr(cycle, name)[0] for name in "ABCF"}
            for name, point in joints.items():
                axes.annotate(
                    name, (point.real, point.imag), xytext=_BESIDE[name], textcoords="offset points"
                )
            axes.margins(x=0.15, y=0.1)
            axes.set(aspect="equal", xlabel="position x (m)")
            axes.set_title(f"{word}: misfit {fit.misfit:.2g}", fontsize=9)
        both[0].set_ylabel("position y (m)")
        svg.legend_above(both[0])


def draw_ranking(fits: Sequence[Fit], path: Path) -> None:
    """Draw the misfit of every topology, the best on top."""
    places = np.arange(len(fits))
    misfits = [fit.misfit for fit in fits]
    with svg.panels(path, height=0.7 + _ROW * len(fits)) as (axes,):
        axes.hlines(places, min(misfits) / 2, misfits, color=svg.SHADE, lw=0.8)
        axes.plot(misfits, places, "o", color=svg.SERIES[0], ms=4)
        axes.axvline(1.0, color=svg.LIMIT, dashes=(1, 2))
        axes.set_xscale("log")
        axes.set_xlim(min(misfits) / 2, 2 * max(misfits))
        axes.set_ylim(len(fits) - 0.5, -0.5)
        labels = [fit.topology.words("{}, B {}, rod 2 at {}, {}, guide {}") for fit in fits]
        axes.set_yticks(places, labels, fontsize=6.8)
        axes.set_xlabel("misfit of the printed figures (allowances)")


def draw_profiles(profiles: Sequence[Profile], path: Path) -> None:
    """Draw what holding one unknown costs; one profile an unknown."""
    with svg.panels(path, 1, 3, height=2.6, sharey=True) as three:
        for axes, name, held, value in zip(three, UNKNOWNS, profiles, shipped_geometry(), strict=True):
            axes.plot(
                1e3 * (held.values - held.best), held.growth, label="others fitted", color=svg.SERIES[0]
            )
            axes.axhline(4.0, label="two standard deviations", color=svg.LIMIT, dashes=(1, 2))
            axes.axvline(1e3 * (value - held.best), label="shipped", color=svg.SERIES[3])
            axes.set_xlabel(f"{name} − best (mm)")
            axes.set_title(f"best {number(1e3 * held.best, 5)} mm", fontsize=9)
        three[0].set_ylabel("growth of the sum of squares (-)")
        svg.legend_above(three[0])


def draw_radius(runs: Runs, path: Path) -> None:
    """Draw the peaks of the acceleration's error over the corner radius, published ones = 1."""
    peaks = runs.by_radius
    radii = peaks.index.to_numpy(np.float64)
    with svg.panels(path, height=3.2) as (axes,):
        for name, colour in zip(peaks, svg.SERIES, strict=False):
            axes.loglog(radii, peaks[name], marker="o", label=str(name), color=colour)
        slope = np.exp(np.log(peaks).mean(axis=None)) * (radii / np.exp(np.log(radii).mean())) ** POWER
        axes.loglog(radii, slope, color=svg.INK, lw=0.8, dashes=(1, 2), label="K to the power 0.4")
        axes.axhline(1.0, color=svg.LIMIT, lw=0.8)
        axes.yaxis.set_major_locator(FixedLocator([0.2, 0.5, 1, 2, 5]))
        axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.yaxis.set_minor_locator(NullLocator())
        axes.margins(x=0.03)
        axes.set(xlabel="corner radius (m)", ylabel="peak acceleration error,\nours / published (-)")
        svg.legend_above(axes, 3)


def draw_offset(runs: Runs, path: Path) -> None:
    """Draw the ranges of many cycles over the reference offset, with the published ones."""
    offsets = 1e6 * runs.ranges.index.to_numpy(np.float64)
    with svg.panels(path, 1, 2, height=2.8) as both:
        for axes, name, scale, unit in zip(both, ("x", "y error"), (1e3, 1e6), ("mm", "µm"), strict=True):
            for side, colour, label in (
                ("highest", svg.SERIES[0], None),
                ("lowest", svg.SERIES[1], "published"),
            ):
                column = f"{name}, {side}"
                axes.plot(offsets, scale * runs.ranges[column], marker="o", label=side, color=colour)
                axes.axhline(scale * PRINTED_RANGES[column], color=svg.LIMIT, dashes=(1, 2), label=label)
            axes.margins(x=0.05)
            axes.set(xlabel="reference offset (µm)", ylabel=f"range of the error of {name[0]} ({unit})")
        svg.legend_above(both[0])
