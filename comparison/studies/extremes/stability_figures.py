"""The drawings of fixed steps against contacts: one hit over w h, and the map of step and modulus."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from comparison.report import svg
from comparison.studies.extremes.fixed_steps import METHODS, rebounds
from comparison.studies.extremes.stability import MODULI, STEPS, Cell, Found, Hit
from comparison.studies.extremes.stability_text import ALL_PHASES, WRONG

_MARKS = ("o", "s", "^", "D", "v")
_LINES = ((10.0, (None, None)), (3.0, (4, 1.5)), (1.0, (1, 1.5)))
"""Steps per contact drawn into the map."""


def draw(found: Found, folder: Path) -> None:
    """Write rebound.svg and step_and_modulus.svg."""
    with svg.style():
        _rebound(found.hits, folder / "rebound.svg")
        _map(found.cells, folder / "step_and_modulus.svg")


def _rebound(hits: Sequence[Hit], path: Path) -> None:
    figure = Figure(figsize=(5.56, 4.9))
    wh = np.geomspace(1e-2, 2e3, 300)
    steps = sorted({hit.step for hit in hits})
    for k, (name, method) in enumerate(METHODS.items()):
        axes = figure.add_axes((0.1, 0.545 - 0.45 * k, 0.88, 0.32))
        of = np.array([rebounds(method, each, ALL_PHASES) for each in wh])
        axes.fill_between(
            wh,
            of.min(axis=1),
            of.max(axis=1),
            color=svg.THRESHOLD,
            alpha=0.35,
            lw=0,
            label="one mass, all phases",
        )
        axes.plot(wh, of.mean(axis=1), color=svg.INK, label="one mass, mean")
        for step, mark in zip(steps, _MARKS, strict=True):
            mine = [
                hit for hit in hits if hit.method == name and hit.step == step and hit.status == "success"
            ]
            axes.plot(
                [hit.wh for hit in mine], [hit.rebound for hit in mine], mark, color=svg.SECOND, mfc="none",
                ms=4, mew=0.7, label=f"five bodies, {step:.0e} s",
            )  # fmt: skip
        failed = [hit for hit in hits if hit.method == name and hit.status != "success"]
        axes.plot(
            [hit.wh for hit in failed],
            [0.1] * len(failed),
            "x",
            color=svg.DIFFERENCE,
            ms=5,
            label="Newton failed",
        )
        axes.set(xscale="log", ylim=(0, 3.1), ylabel="rebound")
        axes.text(1.2e-2, 1.9, name, size=9)
        axes.set_xlim(1e-2, 2e3)
        if k == 0:
            axes.legend(loc="lower left", bbox_to_anchor=(-0.08, 1.02), ncols=3, columnspacing=0.8)
        else:
            axes.set_xlabel("w h (steps per contact: π / (w h))")
        axes.axvline(pi / 10, color=svg.LIMIT, lw=0.8)
        axes.text(pi / 10 * 0.93, 2.6, "10 steps", ha="right", size=8)
    svg.write_svg(figure, path)


def _map(cells: Sequence[Cell], path: Path) -> None:
    figure = Figure(figsize=(5.56, 3.6))
    looks = {
        "within 1 %": ("o", svg.FIRST, 3),
        f"within {WRONG:.0%}": ("s", svg.THRESHOLD, 4),
        "beyond": ("D", svg.SECOND, 5),
        "stopped": ("x", svg.DIFFERENCE, 5),
    }
    for k, name in enumerate(METHODS):
        axes = figure.add_axes((0.105 + 0.455 * k, 0.125, 0.42, 0.63))
        mine = [cell for cell in cells if cell.method == name]
        for words, (mark, colour, size) in looks.items():
            part = [cell for cell in mine if _class(cell, list(looks)) == words]
            axes.plot(
                [cell.step for cell in part], [cell.modulus for cell in part], mark, color=colour, ms=size,
                label=words,
            )  # fmt: skip
        for count, dashes in _LINES:
            line = [next(cell for cell in mine if cell.modulus == young) for young in MODULI]
            axes.plot(
                [cell.steps_per_contact * cell.step / count for cell in line], MODULI, color=svg.INK,
                lw=0.9, dashes=dashes, label=f"T_c / h = {count:g}",
            )  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel="step (s)", title=name)
        axes.title.set_fontsize(9)
        axes.set_xlim(STEPS[0] / 1.5, STEPS[-1] * 1.5)
        axes.set_ylim(MODULI[0] / 2, MODULI[-1] * 2)
        if k == 0:
            axes.set_ylabel("Young's modulus (Pa)")
            axes.legend(loc="lower left", bbox_to_anchor=(-0.1, 1.12), ncols=4, columnspacing=1.0)
        else:
            axes.set_yticklabels([])
    svg.write_svg(figure, path)


def _class(cell: Cell, names: Sequence[str]) -> str:
    if cell.status != "success":
        return names[3]
    return names[0] if abs(cell.wrong) <= 0.01 else names[1] if abs(cell.wrong) <= WRONG else names[2]
