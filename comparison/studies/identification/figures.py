"""The drawings of the study identification."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from comparison.report import svg
from comparison.studies.identification.facts import UNKNOWNS
from comparison.studies.identification.fitting import Fit, Profile
from comparison.studies.identification.kinematics import Geometry, Lengths, Topology, motion
from comparison.studies.identification.runs import CASES, POWER, PRINTED_RANGES, RADII, RADIUS, Runs, ratios

LINES: tuple[dict[str, Any], ...] = (
    {"color": svg.FIRST},
    {"color": svg.SECOND, "dashes": (3.5, 1.8)},
    {"color": svg.DIFFERENCE, "dashes": (1, 1)},
    {"color": svg.BEYOND, "dashes": (6, 1.5)},
    {"color": svg.THRESHOLD, "dashes": (4, 1.5, 1, 1.5)},
)


def draw_presses(fits: Sequence[Fit], lengths: Lengths, path: Path) -> None:
    """Draw the best press and the runner-up at the ends of the stroke, with the way of the rocker's tip."""
    figure = Figure(figsize=(5.56, 3.6))
    for n, fit in enumerate(fits[:2]):
        axes = figure.add_axes((0.09 + 0.48 * n, 0.13, 0.42, 0.73))
        turn = motion(
            fit.geometry,
            fit.topology,
            lengths,
            radians(fit.shown[0]) + fit.topology.crank * np.linspace(0.0, 2 * np.pi, 721),
        )
        axes.plot(turn.C.real, turn.C.imag, color=svg.LIMIT, lw=0.8)
        axes.plot(turn.A.real, turn.A.imag, color=svg.LIMIT, lw=0.8)
        axes.axvline(fit.geometry.guide, color=svg.GRID, lw=0.8)
        low = int(turn.F.imag.argmin())
        H = complex(fit.geometry.pivot_x, fit.geometry.pivot_y)
        for at, line in ((low, LINES[1]), (0, LINES[0])):
            joints = np.array([0.0, turn.A[at], turn.B[at]])
            axes.plot(joints.real, joints.imag, marker="o", ms=2.5, **line)
            rocker = np.array([H, turn.C[at], turn.F[at]])
            axes.plot(rocker.real, rocker.imag, marker="o", ms=2.5, **line)
        named = {"O": 0j, "A": turn.A[0], "H": H, "B": turn.B[0], "C": turn.C[0], "F": turn.F[0]}
        for name, point in named.items():
            axes.annotate(
                name, (point.real, point.imag), xytext=(3, 4), textcoords="offset points", fontsize=8
            )
        axes.set_aspect("equal")
        axes.set_xlim(-0.68, 0.38)
        axes.set_ylim(-0.15, 0.78)
        axes.set_xlabel("x (m)")
        axes.set_title(f"{'best' if n == 0 else 'second'}: misfit {fit.misfit:.2g}", fontsize=8, loc="left")
        if n == 0:
            axes.set_ylabel("y (m)")
    svg.write_svg(figure, path)


def draw_ranking(fits: Sequence[Fit], path: Path) -> None:
    """Draw the misfit of every topology, the best on top."""
    figure = Figure(figsize=(5.56, 5.2))
    axes = figure.add_axes((0.44, 0.09, 0.52, 0.88))
    places = np.arange(len(fits))
    misfits = [fit.misfit for fit in fits]
    axes.hlines(places, min(misfits) / 2, misfits, color=svg.SHADE, lw=0.8)
    axes.plot(misfits, places, "o", color=svg.FIRST, ms=4)
    axes.axvline(1.0, color=svg.LIMIT, dashes=(1, 2))
    axes.set_xscale("log")
    axes.set_xlim(min(misfits) / 2, 2 * max(misfits))
    axes.set_ylim(len(fits) - 0.5, -0.5)
    axes.set_yticks(places, [_short(fit.topology) for fit in fits], fontsize=6)
    axes.set_xlabel("misfit (allowances)")
    svg.write_svg(figure, path)


def draw_profiles(profiles: Sequence[Profile], shipped: Geometry, path: Path) -> None:
    """Draw what holding one unknown costs; one profile an unknown."""
    figure = Figure(figsize=(5.56, 2.5))
    for n, (name, held, value) in enumerate(zip(UNKNOWNS, profiles, shipped, strict=True)):
        axes = figure.add_axes((0.09 + 0.315 * n, 0.19, 0.255, 0.64))
        axes.plot(1e3 * (held.values - held.best), held.growth, label="others fitted", **LINES[0])
        axes.axhline(4.0, label="two standard deviations", color=svg.LIMIT, dashes=(1, 2))
        axes.axvline(1e3 * (value - held.best), label="shipped", **LINES[1])
        axes.set_xlabel(f"off {name} = {1e3 * held.best:.2f} mm (mm)")
        if n == 0:
            axes.set_ylabel("growth of the sum of squares")
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1.03), ncols=3)
    svg.write_svg(figure, path)


def draw_radius(runs: Runs, path: Path) -> None:
    """Draw the peaks of the acceleration's error over the corner radius, published ones = 1."""
    table = np.array([ratios(runs, (RADIUS, radius), ["slider_ay"]) for radius in RADII])
    figure = Figure(figsize=(5.56, 3.2))
    axes = figure.add_axes((0.11, 0.14, 0.86, 0.7))
    for name, values, line in zip(CASES, table.T, LINES, strict=True):
        axes.loglog(RADII, values, marker="o", ms=3, label=name, **line)
    # K goes with the root of the radius, the peak force of an impact with K^0.4.
    middle = float(np.exp(np.log(table).mean()))
    slope = middle * (np.array(RADII) / np.exp(np.log(RADII).mean())) ** POWER
    axes.loglog(RADII, slope, color=svg.INK, lw=0.8, dashes=(1, 2), label="K to the power 0.4")
    axes.axhline(1.0, color=svg.LIMIT, lw=0.8)
    axes.yaxis.set_major_locator(FixedLocator([0.2, 0.5, 1, 2, 5]))
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("corner radius (m)")
    axes.set_ylabel("peak acceleration error / published")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), ncols=3)
    svg.write_svg(figure, path)


def draw_offset(runs: Runs, path: Path) -> None:
    """Draw the ranges of 100 cycles over the reference offset, with the published ones."""
    figure = Figure(figsize=(5.56, 2.7))
    offsets = 1e6 * np.array(list(runs.ranges))
    for n, (name, scale, unit) in enumerate((("x", 1e3, "mm"), ("y", 1e6, "µm"))):
        axes = figure.add_axes((0.11 + 0.5 * n, 0.17, 0.37, 0.67))
        for side, line, label in ((1, LINES[0], "highest"), (0, LINES[1], "lowest")):
            values = scale * np.array([getattr(found, name)[side] for found in runs.ranges.values()])
            axes.plot(offsets, values, marker="o", ms=3, label=label, **line)
            printed = scale * PRINTED_RANGES[name][side]
            axes.axhline(printed, color=svg.LIMIT, dashes=(1, 2), label=None if side else "published")
        axes.set_xlabel("reference offset (µm)")
        axes.set_ylabel(f"error of {name} ({unit})")
        if n == 0:
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1.03), ncols=3)
    svg.write_svg(figure, path)


def _short(topology: Topology) -> str:
    words = str(topology).replace("crank ", "").replace("rod 2 at the rocker's ", "rod 2 at ")
    return words.replace("counter-clockwise", "ccw").replace("clockwise", "cw").replace("slider ", "")
