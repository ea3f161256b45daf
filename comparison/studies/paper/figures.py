"""The paper's figures by both models, printed values marked, and all predictions beside their intervals."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from comparison.formatting import pretty_unit
from comparison.models import MODELS
from comparison.reliability.errors import QUANTITIES
from comparison.report import svg
from comparison.report.svg import envelope, upper_envelope
from comparison.scene import load_scene
from comparison.studies.paper.ledger import Use
from comparison.studies.paper.runs import CENTRAL, CHANNELS, PIN, SCENES, Runs, scene_of, second_cycle
from comparison.studies.shared.published import published
from comparison.studies.shared.study import plain_ticks
from comparison.tables.channels import Array, channels

LINES: dict[str, dict[str, Any]] = dict(zip(MODELS, svg.MODEL_LINES, strict=True))
COLOURS = {model: line["color"] for model, line in LINES.items()}
CIRCLE: dict[str, Any] = {"color": svg.OUTSIDE, "marker": "o", "ms": 4, "mfc": "none", "ls": "", "zorder": 3}
LIMIT: dict[str, Any] = {"color": svg.OUTSIDE, "dashes": (1, 2), "lw": 0.8}
RANGE: dict[str, Any] = {"color": svg.THRESHOLD, "dashes": (3.5, 1.8), "lw": 0.8}
"""Lines of a printed range, and of the range of all cycles."""
BARS = {"gravity": (-0.15, svg.THRESHOLD, "gravity"), "none": (0.15, "#c4c4c4", "no gravity")}
EDGE = 0.2  # of the axis of the predictions
LAWS = {"law": svg.THRESHOLD, "code": svg.DIFFERENCE}  # the differences in Fig. 13
COLUMNS = 250  # of a panel half as wide as the page
STRIDE = 8  # samples of the two cycles that are drawn of a path
QUANTILE = 0.99  # of the pin's force: above it hits are marked
CYCLES = 4  # of the portraits' curves: the last ones. More would fill the plane, and the page
SCALES = {"slider_y": (1e6, "µm"), "slider_vy": (1e3, "mm/s"), "slider_ay": (1.0, "m/s²")}
WORDS = {channel: word for word, channel in QUANTITIES.items()}
ERROR_LABELS = [f"error of the\n{WORDS[channel]} ({unit})" for channel, (_, unit) in SCALES.items()]
ERRORS = {
    "figure-9": ("F9-210", "F9-69"),
    "figure-10": ("F10-28", "F10-33"),
    "figure-11": ("F11-01", "F11-05"),
    "figure-12": ("F12-150", "F12-300"),
}
"""Figure -> prefixes of the ids of the printed peaks of its two conditions."""


def draw(runs: Runs, entries: pd.DataFrame, verdicts: pd.DataFrame, folder: Path) -> None:
    """Write the figures of runs and of the ledger."""
    _predictions(entries, verdicts, folder / "predictions.svg")
    _responses(runs, folder / "figure-7.svg")
    _pin(runs, folder / "figure-8-pin.svg")
    for name, conditions in ERRORS.items():
        _errors(runs, conditions, folder / f"{name}.svg")
    _two_codes(runs, folder / "figure-13.svg")
    _phase(runs, folder / "figure-14-phase.svg")
    _poincare(runs, folder / "figure-14-poincare.svg")


@contextmanager
def _grid(
    path: Path, rows: Sequence[str], titles: Sequence[str], height: float, x: str, columns: int = 4, **of: Any
) -> Iterator[list[list[Axes]]]:
    """Draw a figure with a column a title and a row a label of its ordinate, and the first panel's legend."""
    with svg.panels(path, len(rows), len(titles), height=height, **of) as panels:
        grid = [panels[k : k + len(titles)] for k in range(0, len(panels), len(titles))]
        yield grid
        for row, label in zip(grid, rows, strict=True):
            row[0].set_ylabel(label)
        for top, bottom, title in zip(grid[0], grid[-1], titles, strict=True):
            top.set_title(title, fontsize=9)
            if x:
                bottom.set_xlabel(x)
        svg.legend_above(panels[0], columns)


def _both(panel: Axes, x: Array, values: Mapping[str, Array]) -> None:
    """Draw a curve of each model."""
    for model, y in values.items():
        points = envelope(y, COLUMNS)
        panel.plot(x[points], y[points], label=model, **LINES[model])


def _predictions(entries: pd.DataFrame, verdicts: pd.DataFrame, path: Path) -> None:
    """Draw printed sizes over ours, with both intervals: a panel a quantity, a line a condition."""
    predictions = entries[entries["use"] == Use.PREDICTION]
    kind = predictions["unit"].map({"m": "displacement", "m/s": "velocity", "m/s^2": "acceleration"})
    ours = predictions[MODELS[0]].abs()
    of_many = predictions["quantity"].str.startswith("range_")
    name = predictions["scene"].where(~of_many, predictions["quantity"].str.replace("_", " "))
    lines = [*SCENES, *dict.fromkeys(name[of_many])]
    place = name.map(lines.index)
    titles, x = list(QUANTITIES), "size over ours (-)"
    with _grid(path, [""], titles, 3.4, x, columns=3, sharex=True, sharey=True) as (axes,):
        for panel, quantity in zip(axes, QUANTITIES, strict=True):
            panel.axvline(1.0, color=svg.GRID, lw=0.8)
            mask = kind == quantity
            for hypothesis, rows in verdicts.groupby("hypothesis", sort=False):
                shift, colour, of = BARS[str(hypothesis)]
                ends = rows.set_index("id").reindex(predictions.index[mask])
                for end, width, label in (("_without", 5, f"our interval, {of}"), ("", 1, f"with u_D, {of}")):
                    low, high = (ends[f"{side}{end}"] / ours[mask] for side in ("low", "high"))
                    y = place[mask] + shift
                    panel.hlines(y, low.clip(lower=EDGE), high, label=label, lw=width, color=colour)
                    panel.plot([low, high], [y, y], ls="", marker="|", ms=width, color=colour)
            panel.plot((predictions["printed_size"] / ours)[mask], place[mask], label="printed", **CIRCLE)
            panel.set(xscale="log", xlim=(EDGE, 1 / EDGE), ylim=(len(lines) - 0.5, -0.5))
            plain_ticks(panel.xaxis, [0.5, 1, 2, 4])
        axes[0].set_yticks(range(len(lines)), lines)


# ---- the second cycle


def _responses(runs: Runs, path: Path) -> None:
    """Draw the slider's motion with clearance at the slider, at the crank pin, and the ideal one."""
    ideal = runs.ideal[CENTRAL, MODELS[0]]
    cycle, lowest = second_cycle(ideal), published("S4.2-stroke")
    time = ideal.time[cycle]
    titles = ("clearance at the slider", "clearance at the crank pin A")
    labels = [f"{WORDS[each]} ({pretty_unit(channels()[each].unit)})" for each in CHANNELS]
    with _grid(path, labels, titles, 4.9, "time (s)", sharex=True, sharey="row") as axes:
        for row, channel in zip(axes, CHANNELS, strict=True):
            motion = ideal.values(channel)
            zero = motion[0] if channel == "slider_y" else 0.0
            for panel, scene in zip(row, (CENTRAL, PIN), strict=True):
                _both(panel, time, {m: runs.short[scene, m][0].values(channel)[cycle] - zero for m in MODELS})
                panel.plot(time, motion[cycle] - zero, label="ideal", color=svg.DIFFERENCE, lw=0.5)
                panel.set_xlim(time[0], time[-1])
        for panel in axes[0]:
            panel.plot(lowest.time, lowest.value, label="printed", **CIRCLE)


def _errors(runs: Runs, conditions: Sequence[str], path: Path) -> None:
    """Draw the errors of two conditions over the second cycle, with the printed peaks."""
    scenes, x = [scene_of(f"{prefix}-d") for prefix in conditions], "time (crank cycles)"
    with _grid(path, ERROR_LABELS, scenes, 4.9, x, sharex=True, sharey="row") as axes:
        for row, (channel, (scale, _)), letter in zip(axes, SCALES.items(), "dva", strict=True):
            for panel, prefix, scene in zip(row, conditions, scenes, strict=True):
                run = runs.short[scene, MODELS[0]][0]
                cycle, period = second_cycle(run), run.time[-1] / 2
                errors = {m: scale * runs.errors(scene, m, channel)[cycle] for m in MODELS}
                _both(panel, run.time[cycle] / period, errors)
                datum = published(f"{prefix}-{letter}")
                panel.plot(datum.time / period, scale * datum.value, label="printed peak", **CIRCLE)
                panel.set(xlim=(1, 2), xticks=(1.2, 1.4, 1.6, 1.8))


def _two_codes(runs: Runs, path: Path) -> None:
    """Draw two codes with a law each, as the paper's may have had, and the changes by code and by law."""
    run = runs.short[CENTRAL, MODELS[0]][0]
    cycle = second_cycle(run)
    time = run.time[cycle]
    titles = "Eqs. 9-11, and IMPACT of ADAMS", "difference of codes, and of laws"
    with _grid(path, ERROR_LABELS, titles, 4.9, "time (s)", sharex=True) as axes:
        for (codes, changes), (channel, (scale, unit)) in zip(axes, SCALES.items(), strict=True):
            error = runs.errors(CENTRAL, MODELS[0], channel)[cycle]
            other = error + runs.laws_and_codes["law and code"][channel]
            _both(codes, time, {MODELS[0]: scale * error, MODELS[1]: scale * other})
            for name, colour in LAWS.items():
                difference = scale * np.maximum(np.abs(runs.laws_and_codes[name][channel]), 1e-16)
                points = upper_envelope(difference, COLUMNS)
                changes.semilogy(time[points], difference[points], color=colour, label=f"another {name}")
            changes.set(ylabel=f"|difference| ({unit})", xlim=(time[0], time[-1]))
        axes[-1][1].legend(loc="lower left", fontsize=7)  # above the panels stands that of the models


# ---- paths, phase portraits, Poincaré maps: a column a model

PLANES = {
    "x": ("slider x − line (mm)", "velocity of x (mm/s)", "F14a-x", "F14a-vx", (1e3, 1e3)),
    "y": ("slider y − start (m)", "velocity of y (m/s)", "F14c-y", "F14c-vy", (1.0, 1.0)),
    "error": ("error of y (µm)", "its velocity (mm/s)", "F14e-y", "F14e-vy", (1e6, 1e3)),
}
"""Labels of both axes, prefixes of the rows of the printed ranges, and scales from the printed units."""


def _plane(runs: Runs, name: str, model: str) -> tuple[Array, Array]:
    """Return the coordinate and its velocity in the units of `PLANES`, a row a cycle.

    x is from the ideal slider's line, y from its start.
    """
    scale, scale_v = PLANES[name][-1]
    if name == "error":
        y, velocity = (runs.long_errors(CENTRAL, model, channel) for channel in ("slider_y", "slider_vy"))
        return scale * y, scale_v * velocity
    zero = runs.ideal[CENTRAL, model].values(f"slider_{name}")[0]
    place, velocity = (runs.by_cycle(CENTRAL, model, f"slider_{part}{name}") for part in ("", "v"))
    return scale * (place - zero), scale_v * velocity


def _pin(runs: Runs, path: Path) -> None:
    """Draw the path of the pin in its bearing (Fig. 8b), and its second cycle unrolled, its hits marked.

    At the scale of the clearance a pin that slides along its bearing and one that hits it look alike.
    """
    clearance = 1e3 * float(load_scene(PIN).data["clearance"]["crank_pin"])
    circle = clearance * np.exp(1j * np.linspace(0.0, 2 * np.pi, 181))
    labels = ["pin y in its bearing (mm)", "pin beyond the\nclearance (µm)"]
    with _grid(path, labels, MODELS, 5.4, "", 2, height_ratios=(1.8, 1), sharey="row") as axes:
        for top, low, model in zip(*axes, MODELS, strict=True):
            run = runs.pin[model]
            pin = 1e3 * (run.values("journal_x") + 1j * run.values("journal_y"))
            force = np.abs(runs.pin_vector(model, "reaction_A_x", "reaction_A_y"))
            hard = (force > 0) & (force >= np.quantile(force, QUANTILE))
            first, journal = pin[~second_cycle(run)], pin[second_cycle(run)]
            top.plot(circle.real, circle.imag, label="clearance", **RANGE)
            for part, label, line in (
                (first, "first cycle, from the centre", {"color": svg.DIFFERENCE, "lw": 0.6}),
                (journal, "second cycle", {"color": COLOURS[model], "lw": 1.2}),
            ):
                top.plot(part.real[::STRIDE], part.imag[::STRIDE], label=label, **line)
            top.margins(0.06)
            top.set_aspect("equal", adjustable="box")
            top.set_xlabel("pin x in its bearing (mm)")
            angle, excess = np.degrees(np.angle(journal)) % 360.0, 1e3 * (np.abs(journal) - clearance)
            low.axhline(0.0, **RANGE)
            low.plot(angle[::STRIDE], excess[::STRIDE], ".", ms=1.2, color=COLOURS[model])
            for panel, x, y in ((top, journal.real, journal.imag), (low, angle, excess)):
                label = f"force in its largest {1 - QUANTILE:.0%}"
                panel.plot(x[hard], y[hard], "x", color=svg.INK, ms=4, label=label)
            low.set(xlim=(0, 360), xticks=range(0, 361, 90), xlabel="direction of the pin (deg)")


def _phase(runs: Runs, path: Path) -> None:
    """Draw phase portraits with the ranges of all cycles and the printed ones (Fig. 14a, c, e)."""

    def box(panel: Axes, ranges: Sequence[Sequence[float]], label: str, line: Any) -> None:
        (left, right), (low, high) = ranges
        panel.plot([left, right, right, left, left], [low, low, high, high, low], label=label, **line)

    labels = [plane[1] for plane in PLANES.values()]
    with _grid(path, labels, MODELS, 6.6, "", sharex="row", sharey="row") as axes:
        for row, (plane, (across, _, *names, scales)) in zip(axes, PLANES.items(), strict=True):
            limits = [
                [scale * published(each).value for each in (name, f"{name}2")]
                for name, scale in zip(names, scales, strict=True)
            ]
            for panel, model in zip(row, MODELS, strict=True):
                x, v = _plane(runs, plane, model)
                panel.margins(0.04)
                last = x[-CYCLES:].ravel(), v[-CYCLES:].ravel()
                panel.plot(*last, color=COLOURS[model], lw=0.5, label=f"last {CYCLES} cycles")
                box(panel, [(values.min(), values.max()) for values in (x, v)], "range of all cycles", RANGE)
                if plane == "y":  # of the displacement the paper prints a range that cannot be
                    for value in limits[1]:
                        panel.axhline(value, **LIMIT)
                else:
                    box(panel, limits, "printed range", LIMIT)
                panel.set_xlabel(across)


def _poincare(runs: Runs, path: Path) -> None:
    """Draw sections of x at the start's angle and where widest, and of the error of y (Fig. 14b, f)."""
    width = np.ptp(_plane(runs, "x", MODELS[0])[0][1:], axis=0)
    sections = (
        ("x", 0, 1e6, "slider x (nm)", 1e3, "velocity of x (µm/s)"),
        ("x", int(width.argmax()), 1e3, "slider x (µm)", 1.0, "velocity of x (mm/s)"),
        ("error", 0, 1e3, "error of y (nm)", 1e3, "its rate (µm/s)"),
    )
    labels = [section[-1] for section in sections]
    with _grid(path, labels, MODELS, 6.6, "", sharex="row", sharey="row") as axes:
        for row, (plane, at, scale, across, scale_v, _) in zip(axes, sections, strict=True):
            for panel, model in zip(row, MODELS, strict=True):
                x, v = (values[1:, at] - values[1:, at].mean() for values in _plane(runs, plane, model))
                label = "once a cycle, less the mean"
                panel.plot(scale * x, scale_v * v, ".", color=COLOURS[model], ms=3, label=label)
                panel.margins(0.05)
                panel.set_xlabel(f"{across}, {360 * at / width.size:.0f}° from the start")
