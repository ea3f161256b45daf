"""Figures 8, 14 and 15: the slider's way in its clearance, phase portraits, Poincaré maps, many turns."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from comparison.execution.run import MODELS
from comparison.report import svg
from comparison.report.decimate import envelope
from comparison.scene import load_scene
from comparison.studies.paper.dynamics import pin_forces
from comparison.studies.paper.figures import COLUMNS, finish, grid, share
from comparison.studies.paper.runs import CENTRAL, PIN, Runs, by_turn, second
from comparison.studies.shared.published import published
from comparison.tables.arrays import Array

TURNS = 4
"""Of the portraits' curves: the last ones. More would fill the plane, and the page."""
TOUCHES = 5
"""Samples of the two turns that are drawn of the pin's touches."""
EVERY = 8
"""Samples of the two turns that are drawn of the slider's way."""


def draw(runs: Runs, folder: Path) -> None:
    """Write figures 8, 14 and 15, inside `svg.style`."""
    _way(runs, folder / "figure-8.svg")
    _pin(runs, folder / "figure-8-pin.svg")
    _phase(runs, folder / "figure-14-phase.svg")
    _poincare(runs, folder / "figure-14-poincare.svg")
    _turns(runs, folder / "figure-15.svg")


def of_x(runs: Runs, model: str) -> tuple[Array, Array]:
    """Return x from the ideal slider's line (mm) and its velocity (mm/s), one row a turn."""
    run, line = runs.long[CENTRAL, model], runs.ideal[CENTRAL, model].values("slider_x")[0]
    return 1e3 * (by_turn(run, "slider_x") - line), 1e3 * by_turn(run, "slider_vx")


def of_y(runs: Runs, model: str) -> tuple[Array, Array]:
    """Return y from the ideal slider's start (m) and its velocity (m/s), one row a turn."""
    run, start = runs.long[CENTRAL, model], runs.ideal[CENTRAL, model].values("slider_y")[0]
    return by_turn(run, "slider_y") - start, by_turn(run, "slider_vy")


def of_error(runs: Runs, model: str) -> tuple[Array, Array]:
    """Return the errors of y (um) and of its velocity (mm/s), one row a turn."""
    errors = (runs.long_errors(CENTRAL, model, channel) for channel in ("slider_y", "slider_vy"))
    y, velocity = errors
    return 1e6 * y, 1e3 * velocity


Plane = Callable[[Runs, str], tuple[Array, Array]]
PLANES: tuple[tuple[Plane, str, str, str, float, float], ...] = (
    (of_x, "x − line (mm)", "velocity of x (mm/s)", "F14a-x F14a-x2 F14a-vx F14a-vx2", 1e3, 1e3),
    (of_y, "y − start (m)", "velocity of y (m/s)", "F14c-y F14c-y2 F14c-vy F14c-vy2", 1.0, 1.0),
    (of_error, "error of y (µm)", "its velocity (mm/s)", "F14e-y F14e-y2 F14e-vy F14e-vy2", 1e6, 1e3),
)
"""What is drawn, the names of its axes, the rows of its printed ranges, and the scales of these."""


def _way(runs: Runs, path: Path) -> None:
    """Draw the slider's centre in its guide over the second turn (Fig. 8a)."""
    figure, axes = grid(1, 2.6)
    share(axes)
    for panel, model in zip(axes[0], MODELS, strict=True):
        run, ideal = runs.short[CENTRAL, model][0], runs.ideal[CENTRAL, model]
        shown = second(run)
        x = 1e3 * (run.values("slider_x") - ideal.values("slider_x")[0])[shown][::EVERY]
        y = (run.values("slider_y") - ideal.values("slider_y")[0])[shown][::EVERY]
        panel.plot(x, y, color=svg.FIRST, lw=0.8)
        for name in ("F14a-x", "F14a-x2"):
            panel.axvline(1e3 * published(name).value, color=svg.BEYOND, dashes=(1, 2), lw=0.8)
    axes[0][0].plot([], [], color=svg.FIRST, label="slider's centre, second turn")
    axes[0][0].plot([], [], color=svg.BEYOND, dashes=(1, 2), label="printed range")
    axes[0][0].set_ylabel("y − start (m)")
    finish(figure, axes, "x − line (mm)", path)


def _pin(runs: Runs, path: Path) -> None:
    """Draw where the pin touches its bearing in the second turn (Fig. 8b)."""
    clearance = 1e3 * float(load_scene(PIN).data["clearance"]["crank_pin"])
    figure, axes = grid(1, 2.3)
    share(axes)
    round_turn = np.exp(1j * np.linspace(0.0, 2 * np.pi, 181))
    for panel, model in zip(axes[0], MODELS, strict=True):
        force = pin_forces(runs, PIN, model)
        strong = np.abs(force) > 0
        size = np.abs(force[strong])
        # Outwards by the force, so that a place that is touched lightly is told from one that is hit.
        touched = clearance * (1 + size / np.max(size, initial=1e-300)) * force[strong] / size
        panel.plot(clearance * round_turn.real, clearance * round_turn.imag, color=svg.LIMIT)
        panel.plot(touched.real[::TOUCHES], touched.imag[::TOUCHES], ".", color=svg.FIRST, ms=2)
        panel.margins(0.05)
        panel.set_aspect("equal", adjustable="datalim")
    axes[0][0].plot([], [], ".", color=svg.FIRST, ms=4, label="touching, outwards by the force")
    axes[0][0].plot([], [], color=svg.LIMIT, label="clearance")
    axes[0][0].set_ylabel("y of the pin (mm)")
    finish(figure, axes, "x of the pin (mm)", path)


def _phase(runs: Runs, path: Path) -> None:
    figure, axes = grid(len(PLANES), 1.9)
    share(axes)
    for row, (plane, across, up, names, *scales) in enumerate(PLANES):
        for panel, model in zip(axes[row], MODELS, strict=True):
            x, v = (values[-TURNS:].ravel() for values in plane(runs, model))
            panel.margins(0.04)
            panel.plot(x, v, color=svg.FIRST, lw=0.5, label=f"last {TURNS} turns")
            everything = [(values.min(), values.max()) for values in plane(runs, model)]
            _box(panel, everything[0], everything[1], svg.THRESHOLD, (3.5, 1.8), "range of all turns")
            printed = [published(name).value for name in names.split()]
            x_range = scales[0] * printed[0], scales[0] * printed[1]
            v_range = scales[1] * printed[2], scales[1] * printed[3]
            if plane is not of_y:
                _box(panel, x_range, v_range, svg.BEYOND, (1, 2), "printed range")
                continue
            for value in v_range:  # of the displacement the paper prints a range that cannot be
                panel.axhline(value, color=svg.BEYOND, dashes=(1, 2), lw=0.8)
        for panel in axes[row]:
            panel.tick_params(labelbottom=True)
            panel.set_xlabel(across, labelpad=1)
        axes[row][0].set_ylabel(up)
    _apart(axes)
    finish(figure, axes, PLANES[-1][1], path)


def _poincare(runs: Runs, path: Path) -> None:
    """Draw sections of x at the start's angle and where they are widest, and of the error of y."""
    width = np.ptp(of_x(runs, MODELS[0])[0][1:], axis=0)
    widest = int(width.argmax())
    sections = (
        (of_x, 0, 1e6, "x (nm)", 1e3, "velocity (µm/s)"),
        (of_x, widest, 1e3, "x (µm)", 1.0, "velocity (mm/s)"),
        (of_error, 0, 1e3, "error of y (nm)", 1e3, "velocity (µm/s)"),
    )
    figure, axes = grid(len(sections), 1.9)
    share(axes)
    for line, (plane, at, scale, across, scale_v, up) in zip(axes, sections, strict=True):
        for panel, model in zip(line, MODELS, strict=True):
            x, v = (values[1:, at] - values[1:, at].mean() for values in plane(runs, model))
            panel.plot(scale * x, scale_v * v, ".", color=svg.FIRST, ms=3, label="once a turn, less the mean")
            panel.margins(0.05)
            panel.tick_params(labelbottom=True)
            panel.set_xlabel(f"{across}, {360 * at / width.size:.0f}° from the start", labelpad=1)
        line[0].set_ylabel(up)
    _apart(axes)
    finish(figure, axes, axes[-1][0].get_xlabel(), path)


def _turns(runs: Runs, path: Path) -> None:
    """Draw x and y over all turns: of each column of the drawing the lowest and the highest sample."""
    figure, axes = grid(2, 1.4)
    share(axes)
    for column, model in enumerate(MODELS):
        for row, (plane, label) in enumerate(((of_x, "x − line (mm)"), (of_y, "y − start (m)"))):
            values = plane(runs, model)[0]
            turns = np.arange(values.size) / values.shape[1]
            kept = envelope(values.ravel(), COLUMNS)
            axes[row][column].plot(turns[kept], values.ravel()[kept], color=svg.FIRST, lw=0.6)
            axes[row][column].set_xlim(0, values.shape[0])
            if not column:
                axes[row][column].set_ylabel(label)
        for name in ("F14a-x", "F14a-x2"):
            axes[0][column].axhline(1e3 * published(name).value, color=svg.BEYOND, dashes=(1, 2), lw=0.8)
        axes[1][column].axhline(published("S4.2-stroke").value, color=svg.BEYOND, dashes=(1, 2), lw=0.8)
    axes[0][0].plot([], [], color=svg.BEYOND, dashes=(1, 2), label="printed")
    finish(figure, axes, "crank turns", path)


def _apart(axes: list[list[Axes]]) -> None:
    """Make room between rows for the names of their own horizontal axes."""
    for line in axes:
        for panel in line:
            box = panel.get_position()
            panel.set_position((box.x0, box.y0 + 0.045, box.width, box.height - 0.045))


def _box(
    panel: Axes,
    x: tuple[float, float],
    v: tuple[float, float],
    colour: str,
    dashes: tuple[float, float],
    label: str,
) -> None:
    panel.plot(
        [x[0], x[1], x[1], x[0], x[0]],
        [v[0], v[0], v[1], v[1], v[0]],
        color=colour,
        dashes=dashes,
        lw=0.8,
        label=label,
    )
