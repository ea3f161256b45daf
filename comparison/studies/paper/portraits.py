"""Figures 8, 14 and 15: the slider's path in its clearance, phase portraits, Poincaré maps, many cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from comparison.models import MODELS
from comparison.report import svg
from comparison.report.svg import envelope
from comparison.scene import load_scene
from comparison.studies.paper.figures import COLUMNS, LINES, grid
from comparison.studies.paper.runs import CENTRAL, PIN, Runs, second
from comparison.studies.shared.published import published
from comparison.tables.arrays import Array

CYCLES = 4
"""Of the portraits' curves: the last ones. More would fill the plane, and the page."""
TOUCHES = 5
"""Samples of the two cycles that are drawn of the pin's touches."""
USUAL, REACH = 0.99, 0.5
"""Quantile of the pin's force that is drawn farthest from the circle, and how far, over the clearance."""
EVERY = 8
"""Samples of the two cycles that are drawn of the slider's path."""
LIMIT: dict[str, Any] = {"color": svg.OUTSIDE, "dashes": (1, 2), "lw": 0.8}
"""Line of a printed range."""
RANGE: dict[str, Any] = {"color": svg.THRESHOLD, "dashes": (3.5, 1.8), "lw": 0.8}
X_RANGE, Y_RANGE, Y_ERROR = (("F14a-x", "F14a-x2"), ("F14c-y", "F14c-y2"), ("F14e-y", "F14e-y2"))


def of_x(runs: Runs, model: str) -> tuple[Array, Array]:
    """Return x from the ideal slider's line (mm) and its velocity (mm/s), one row a cycle."""
    run, line = runs.long[CENTRAL, model], runs.ideal[CENTRAL, model].values("slider_x")[0]
    return 1e3 * (runs.by_cycle(run, "slider_x") - line), 1e3 * runs.by_cycle(run, "slider_vx")


def of_y(runs: Runs, model: str) -> tuple[Array, Array]:
    """Return y from the ideal slider's start (m) and its velocity (m/s), one row a cycle."""
    run, start = runs.long[CENTRAL, model], runs.ideal[CENTRAL, model].values("slider_y")[0]
    return runs.by_cycle(run, "slider_y") - start, runs.by_cycle(run, "slider_vy")


def of_error(runs: Runs, model: str) -> tuple[Array, Array]:
    """Return the errors of y (um) and of its velocity (mm/s), one row a cycle."""
    y, velocity = (runs.long_errors(CENTRAL, model, channel) for channel in ("slider_y", "slider_vy"))
    return 1e6 * y, 1e3 * velocity


PLANES = (
    (of_x, "slider x − line (mm)", "velocity of x (mm/s)", (X_RANGE, ("F14a-vx", "F14a-vx2")), (1e3, 1e3)),
    (of_y, "slider y − start (m)", "velocity of y (m/s)", (Y_RANGE, ("F14c-vy", "F14c-vy2")), (1.0, 1.0)),
    (of_error, "error of y (µm)", "its velocity (mm/s)", (Y_ERROR, ("F14e-vy", "F14e-vy2")), (1e6, 1e3)),
)
"""Values, labels of both axes, rows of the printed ranges of both, and scales from the printed units."""


def draw(runs: Runs, folder: Path) -> None:
    """Write figures 8, 14 and 15."""
    _path(runs, folder / "figure-8.svg")
    _pin(runs, folder / "figure-8-pin.svg")
    _phase(runs, folder / "figure-14-phase.svg")
    _poincare(runs, folder / "figure-14-poincare.svg")
    _cycles(runs, folder / "figure-15.svg")


def _path(runs: Runs, path: Path) -> None:
    """Draw the slider's centre in its guide over the second cycle (Fig. 8a)."""
    with grid(path, 1, MODELS, 3.2, sharex=True, sharey=True) as (axes,):
        for panel, model in zip(axes, MODELS, strict=True):
            run, ideal = runs.short[CENTRAL, model][0], runs.ideal[CENTRAL, model]
            x, y = (
                (run.values(channel) - ideal.values(channel)[0])[second(run)][::EVERY]
                for channel in ("slider_x", "slider_y")
            )
            panel.plot(1e3 * x, y, color=LINES[model]["color"], lw=0.8, label="slider's centre, second cycle")
            for name, label in zip(X_RANGE, ("printed range", None), strict=True):
                panel.axvline(1e3 * published(name).value, label=label, **LIMIT)
            panel.margins(x=0.04)
            panel.set_xlabel("slider x − guide line (mm)")
        axes[0].set_ylabel("slider y − start (m)")


def _pin(runs: Runs, path: Path) -> None:
    """Draw where the pin touches its bearing in the second cycle (Fig. 8b)."""
    clearance = 1e3 * float(load_scene(PIN).data["clearance"]["crank_pin"])
    circle = clearance * np.exp(1j * np.linspace(0.0, 2 * np.pi, 181))
    with grid(path, 1, MODELS, 3.2, sharex=True, sharey=True) as (axes,):
        for panel, model in zip(axes, MODELS, strict=True):
            force = runs.pin_forces(model)
            force = force[np.abs(force) > 0]
            size = np.abs(force)
            # Outwards by the force, which distinguishes a light touch from a hit. The few hardest hits are as
            # far out as the others' largest: their force would leave the others on the circle.
            usual = np.quantile(size, USUAL) if size.size else 1.0
            out = np.minimum(size / usual, 1.0)
            touched = (clearance * (1 + REACH * out) * force / size)[::TOUCHES]
            colour, label = (
                LINES[model]["color"],
                f"touching, outwards by the force up to its {USUAL:.0%} quantile",
            )
            panel.plot(touched.real, touched.imag, ".", color=colour, ms=2, label=label)
            panel.plot(circle.real, circle.imag, color=svg.LIMIT, label="clearance")
            panel.margins(0.05)
            panel.set_aspect("equal", adjustable="box")
            panel.set_xlabel("pin x in its bearing (mm)")
        axes[0].set_ylabel("pin y in its bearing (mm)")


def _phase(runs: Runs, path: Path) -> None:
    """Draw phase portraits with the ranges of all cycles and the printed ones (Fig. 14a, c, e)."""
    with grid(path, len(PLANES), MODELS, 6.6, sharex="row", sharey="row") as axes:
        for row, (plane, across, up, names, scales) in zip(axes, PLANES, strict=True):
            printed = np.array(
                [[s * published(n).value for n in of] for of, s in zip(names, scales, strict=True)]
            )
            for panel, model in zip(row, MODELS, strict=True):
                x, v = plane(runs, model)
                panel.margins(0.04)
                last, colour = (x[-CYCLES:].ravel(), v[-CYCLES:].ravel()), LINES[model]["color"]
                panel.plot(*last, color=colour, lw=0.5, label=f"last {CYCLES} cycles")
                everything = np.array([(x.min(), x.max()), (v.min(), v.max())])
                _box(panel, everything, label="range of all cycles", **RANGE)
                if plane is of_y:  # of the displacement the paper prints a range that cannot be
                    for value in printed[1]:
                        panel.axhline(value, **LIMIT)
                else:
                    _box(panel, printed, label="printed range", **LIMIT)
                panel.set_xlabel(across)
            row[0].set_ylabel(up)


def _poincare(runs: Runs, path: Path) -> None:
    """Draw sections of x at the start's angle and where widest, and of the error of y (Fig. 14b, f)."""
    width = np.ptp(of_x(runs, MODELS[0])[0][1:], axis=0)
    sections = (
        (of_x, 0, 1e6, "slider x (nm)", 1e3, "velocity of x (µm/s)"),
        (of_x, int(width.argmax()), 1e3, "slider x (µm)", 1.0, "velocity of x (mm/s)"),
        (of_error, 0, 1e3, "error of y (nm)", 1e3, "its rate (µm/s)"),
    )
    with grid(path, len(sections), MODELS, 6.6, sharex="row", sharey="row") as axes:
        for row, (plane, at, scale, across, scale_v, up) in zip(axes, sections, strict=True):
            for panel, model in zip(row, MODELS, strict=True):
                x, v = (values[1:, at] - values[1:, at].mean() for values in plane(runs, model))
                label = "once a cycle, less the mean"
                panel.plot(scale * x, scale_v * v, ".", color=LINES[model]["color"], ms=3, label=label)
                panel.margins(0.05)
                panel.set_xlabel(f"{across}, {360 * at / width.size:.0f}° from the start")
            row[0].set_ylabel(up)


def _cycles(runs: Runs, path: Path) -> None:
    """Draw the lowest and the highest sample of each column of the drawing over all cycles (Fig. 15)."""
    rows = (
        (of_x, "slider x − line (mm)", [1e3 * published(name).value for name in X_RANGE]),
        (of_y, "slider y − start (m)", [published("S4.2-stroke").value]),
    )
    with grid(path, len(rows), MODELS, 4.2, sharex=True, sharey="row") as axes:
        for row, (plane, label, printed) in zip(axes, rows, strict=True):
            for panel, model in zip(row, MODELS, strict=True):
                by_cycle = plane(runs, model)[0]
                values, colour = by_cycle.ravel(), LINES[model]["color"]
                kept = envelope(values, COLUMNS)
                cycles = kept / by_cycle.shape[1]
                panel.plot(cycles, values[kept], color=colour, lw=0.6, label="all cycles")
                for k, value in enumerate(printed):
                    panel.axhline(value, label=None if k else "printed", **LIMIT)
                panel.set_xlim(0, len(by_cycle))
            row[0].set_ylabel(label)
        for panel in axes[-1]:
            panel.set_xlabel("crank cycles (-)")


def _box(panel: Axes, ranges: Array, **line: Any) -> None:
    """Draw the rectangle of two ranges, shape (2, 2): across, up."""
    across, up = ranges
    panel.plot(across[[0, 1, 1, 0, 0]], up[[0, 0, 1, 1, 0]], **line)
