"""Page and figures of the study nonlinear: whether the press is chaotic."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from comparison.accuracy.levels import thresholds
from comparison.formatting import MISSING, prefix, quantity
from comparison.models import MODELS
from comparison.report import svg
from comparison.scene import load_scene
from comparison.studies.ensembles.statistics import NAMES, distances, scattered
from comparison.studies.nonlinear import bouncing_ball as ball
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
from comparison.studies.nonlinear.press import LATER, SAMPLES, STATE, Memory
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array
from comparison.tables.channels import channels

SECTION = 15
"""The sample of a cycle, of `ANGLES`, that stands for the others: in the slider's chatter."""
SAME = 1e-3
"""Of the clearance: two states of a section this close are the same."""
EVERY = 5
"""Samples of a cycle from one section that is compared as a distribution to the next."""
COLOURS = dict(zip(MODELS, (svg.FIRST, svg.SECOND), strict=True))

# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, best = results.config, results.best
    orbits = results.perturbed[MAIN, "reference", USUAL["reference"]]
    counted = Counter(verdict(best, name).value for name in config.scenes)
    counts = ", ".join(f"{count} {word}" for word, count in counted.most_common())
    return {
        "finding": f"Of {len(config.scenes)} scenes: {counts}.",
        "answer": rows_table(answer(best, name) for name in config.scenes),
        "sections": rows_table(
            _section(results, name) | _distributions(results, name) for name in config.scenes
        ),
        "forgetting": rows_table(_forgetting(results, name) for name in (MAIN, FORGETTING)),
        "without_memory": without_memory(best, results.scatter),
        "memory": rows_table(_memory(results.memories, angle) for angle in LATER),
        "controls": rows_table(_controls(config.periods)),
        "noise": quantity(nan if orbits is None else float(np.median(orbits.noise)), "m", 2),
        "cycles": config.cycles["reference"],
        "exudyn_cycles": config.cycles["exudyn"],
        "long": config.long_main["reference"],
        "long_exudyn": config.long_main["exudyn"],
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


def _section(results: Results, name: str) -> dict[str, str]:
    """Return 0-1 test, recurrence and scatter of a scene."""
    series = {model: results.sections[name, model][:, SECTION, 0] for model in MODELS}
    line = {"scene": name}
    for model, x in series.items():
        line[f"K, {model}"] = f"{chaos_indicator(x):.2f}" if x.size >= LEAST else MISSING
    repeats = recurrence(series[MODELS[0]], SAME * load_scene(name).data["clearance"]["slider"])
    scatter = results.scatter[name]
    return line | {
        "section repeats after (cycles)": "never" if repeats is None else str(repeats),
        "largest scatter": quantity(float(scatter.max()), "m", 2),
        "least": quantity(float(scatter.min()), "m", 2),
    }


def _distributions(results: Results, name: str) -> dict[str, str]:
    """Return the comparison of both models' sections, where they scatter more than what is predictable."""
    scene, alpha = load_scene(name).data, thresholds().alpha
    floors = {channel: alpha * channels()[channel].scale_value(scene, 0.0) for channel in STATE}
    columns = pd.MultiIndex.from_product([STATE, range(0, ANGLES, EVERY), [""]], names=NAMES)
    ensembles = []
    for model in MODELS:
        states = results.sections[name, model][:, ::EVERY].swapaxes(1, 2)
        ensembles.append(pd.DataFrame(states.reshape(len(states), -1), columns=columns))
    a, b = scattered(ensembles[0], ensembles[1], floors)
    tests = distances(a, b)
    correlations = [abs(a[column].autocorr()) for column in a]
    numbers = {
        "largest distance": f"{tests['statistic'].max():.2f}",
        "Wasserstein over scatter": f"{(tests['wasserstein'] / tests['scale']).max():.2f}",
        "smallest adjusted p": f"{tests['adjusted'].min():.2g}",
        "correlation of cycles": f"{max(correlations, default=nan):.2f}",
    }
    count = {"sections that differ": f"**{tests['differs'].sum()}** of {len(tests)}"}
    return count | (numbers if len(tests) else dict.fromkeys(numbers, MISSING))


def _forgetting(results: Results, name: str) -> dict[str, str]:
    """Return exponents and scatter of the main scene with frozen impact speeds, or without that memory."""
    line = {"impact speed": "frozen" if name == MAIN else "of the moment"}
    for model in MODELS:
        e = results.best.get((name, model, USUAL[model]))
        line[f"exponent, {model}"] = MISSING if e is None else _with_interval(e)
    scatter = results.scatter[name]
    sizes = {f"scatter at {360 * angle:.0f}°": scatter[round(angle * ANGLES)] for angle in LATER}
    sizes["largest"] = scatter.max()
    return line | {where: quantity(float(size), "m", 2) for where, size in sizes.items()}


def _with_interval(e: Exponent, digits: int = 2) -> str:
    if e.collapsed == 1.0:
        return f"≤ {e.value:.1f}"
    return f"{'' if e.measured else '≤ '}{e.value:.{digits}f} ({e.low:.{digits}f} … {e.high:.{digits}f})"


def without_memory(best: Mapping[Key, Exponent], scatter: Mapping[str, Array]) -> str:
    """Return in a sentence how much of the main scene's magnification is the contact law's memory."""
    runs = [[best.get((name, model, USUAL[model])) for name in (MAIN, FORGETTING)] for model in MODELS]
    pairs = [[e.value for e in pair if e is not None and e.measured] for pair in runs]
    measured = [pair for pair in pairs if len(pair) == 2]
    if not measured:
        kept, free = (float(scatter[name].max()) for name in (MAIN, FORGETTING))
        bounds = (
            "Without the memory only upper bounds of the exponent are measured, and cycles differ by "
            f"{quantity(free, 'm', 2)} at most, with it by {quantity(kept, 'm', 2)}"
        )
        # A hundredth: what is left cannot be the scatter of an attractor of the same size.
        return (
            f"{bounds}: without the memory the cycles of this scene repeat."
            if free < 0.01 * kept
            else f"{bounds}."
        )
    kept, free = np.mean(measured, axis=0).tolist()
    if free <= 0.0:
        return "Without the memory neighbours do not part: all of the magnification is the law's memory."
    return (
        f"Without the memory a small distance still grows e^{free:.1f} times a cycle, with it e^{kept:.1f} "
        f"times (means of both): {100 * (1.0 - free / kept):.0f} % of the exponent is the law's memory."
    )


def _memory(memories: Sequence[Memory], angle: float) -> dict[str, str]:
    """Return how much of the state at an angle after a rest follows from the remembered impact speeds."""
    there = {memory.channel: memory for memory in memories if memory.angle == angle}
    line = {"crank angle after the start": f"{360 * angle:.0f}°"}
    for channel, heading in zip(STATE, ("x", "angle", "rate of x", "rate of angle"), strict=True):
        memory = there.get(channel)
        line[heading] = (
            MISSING
            if memory is None
            else f"{quantity(memory.scatter, 'm', 2)}: {100 * memory.explained:.2f} %"
        )
    return line


def _controls(periods: int) -> list[dict[str, str]]:
    """Return what the methods give for the ball where it moves regularly and where it does not."""
    lines = []
    for amplitude, source in ((ball.REGULAR, "ln e"), (ball.CHAOTIC, "exact linear maps")):
        result = ball.control(amplitude, periods)
        lines.append(
            {
                "peak acceleration of the table": f"{amplitude:g} g",
                "exponent, known": f"{result.known:.3f} ({source})",
                "from perturbed runs": _with_interval(result.measured, 3),
                "K": f"{result.indicator:.2f}",
                "repeats after (periods)": "never" if result.repeats is None else str(result.repeats),
            }
        )
    return lines


# ---- figures

DRAWN = (0, 7, 15, 34)
"""Samples of a cycle whose sections are drawn."""
MOST_POINTS = 200
GROWN = (1, 2, 3)
"""Which distances the growth is drawn of."""
STRETCHES = 20
"""Of a cycle, over which the growth is summed."""
SMALLEST = 1e-16
"""m; what a logarithmic axis shows of zero."""
DIAGRAMS = (
    (SPEED, "speed (rpm)", 1.0, 15),
    (SPEED, "speed (rpm)", 1.0, 36),
    (CLEARANCE, "clearance (mm)", 1e3, 15),
)
"""Key, label, factor and sample of a cycle of each bifurcation diagram: after the reversal the slider
chatters, before the top dead centre only at high speed."""
BINS = 400
"""Of a bifurcation diagram's height: cycles that fall into the same are one point."""
_LINES: tuple[dict[str, Any], ...] = (
    {"marker": "o"},
    {"marker": "s", "dashes": (4, 2)},
    {"marker": "^", "dashes": (1, 1)},
    {"marker": "v", "dashes": (6, 2, 1, 2)},
)


def draw(results: Results, folder: Path) -> None:
    """Write the figures and the table of all exponents."""
    exponents_frame(results).to_csv(folder / "exponents.csv", index=False, float_format="%.6g")
    names = results.config.scenes
    with svg.panels(folder / "exponents.svg", height=0.42 * len(names) + 1.0) as (axes,):
        _exponents_by_scene(axes, results.best, names)
    with svg.panels(folder / "distances.svg") as (axes,):
        _exponents_by_distance(axes, results)
    with svg.panels(folder / "sections.svg", 2, 2, height=4.8) as panels:
        for axes, angle in zip(panels, DRAWN, strict=True):
            _section_at(axes, results, angle)
        svg.legend_above(panels[0])
    with svg.panels(folder / "bifurcation.svg", len(DIAGRAMS), height=6.4) as panels:
        for axes, (key, label, factor, angle) in zip(panels, DIAGRAMS, strict=True):
            x = {factor * value: each[:, angle] for value, each in results.swept[key].items()}
            _bifurcation(axes, x)
            axes.set_title(f"{360 * angle / ANGLES:.0f}° after the start", fontsize=9)
            axes.set(xlabel=label, ylabel="slider x / clearance (-)")
    with svg.panels(folder / "growth.svg", 2, height=4.2, sharex=True) as (upper, lower):
        _growth(upper, lower, results)


def _exponents_by_scene(axes: Axes, best: Mapping[Key, Exponent], names: Sequence[str]) -> None:
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


def _exponents_by_distance(axes: Axes, results: Results) -> None:
    """Draw the main scene's exponents over the distance; hollow: an upper bound."""
    coarsest = results.config.tolerances["reference"][0]
    shown = {
        (model, tolerance): measured
        for (name, model, tolerance), measured in results.exponents.items()
        if measured
        and name == MAIN
        and (tolerance == USUAL["exudyn"] if model == "exudyn" else tolerance != coarsest)
    }
    for n, ((model, tolerance), measured) in enumerate(shown.items()):
        line, colour = _LINES[n % len(_LINES)], COLOURS[model]
        at = np.array(DISTANCES[model]) * 10 ** (0.05 * (n - 0.5 * len(shown)))
        value, low, high = np.array([(e.value, e.low, e.high) for e in measured]).T
        axes.errorbar(at, value, [value - low, high - value], color=colour, lw=0.7, ls="none", capsize=1.5)
        axes.plot(
            at, value, color=colour, lw=0.6, ms=4, mfc="none", label=f"{model}, {tolerance:.0e}", **line
        )
        firm = np.array([e.measured for e in measured])
        axes.plot(at[firm], value[firm], line["marker"], ms=4, color=colour)
    axes.margins(x=0.05)
    axes.axhline(0.0, color=svg.LIMIT, lw=0.8)
    axes.set(xscale="log", xlabel="distance of the perturbed run (m)", ylabel="exponent (1/cycle)")
    svg.legend_above(axes, columns=2)


def _section_at(axes: Axes, results: Results, angle: int) -> None:
    """Draw x and its rate once a cycle, of both models, from the reference's median."""
    reference = results.sections[MAIN, MODELS[0]][:, angle]
    middle, reach = np.median(reference, axis=0), np.ptp(reference, axis=0)
    (factor, unit), (rate_factor, rate_unit) = (
        prefix(max(0.3 * size, 1e-9), unit) for size, unit in ((reach[0], "m"), (reach[2], "m/s"))
    )
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


def _bifurcation(axes: Axes, diagram: Mapping[float, Array]) -> None:
    """Draw x once a cycle over a parameter; cycles that look the same are one point."""
    points = [(value, y / BINS) for value, x in diagram.items() for y in np.unique(np.round(x * BINS))]
    at, y = np.array(points).reshape(-1, 2).T
    # Very short dashes with round ends are dots, in one path: a tenth of the bytes of markers.
    ends, nothing = 1e-4 * (max(diagram, default=1.0) - min(diagram, default=0.0)), np.full(at.size, np.nan)
    axes.plot(
        np.column_stack([at, at + ends, nothing]).ravel(), np.column_stack([y, y, nothing]).ravel(),
        color=svg.FIRST, lw=1.5, solid_capstyle="round",
    )  # fmt: skip
    axes.margins(x=0.02)


def _growth(upper: Axes, lower: Axes, results: Results) -> None:
    """Draw how far all cycles scatter over the crank angle, and by how much neighbours part."""
    scatter = results.scatter[MAIN]
    angle = 360.0 * np.arange(scatter.size) / scatter.size
    upper.semilogy(angle, np.maximum(scatter, SMALLEST), color=svg.FIRST)
    upper.set_ylabel("scatter of all cycles (m)")
    orbits = results.perturbed[MAIN, "reference", USUAL["reference"]]
    if orbits is not None:
        length = np.diff(orbits.times, axis=1)[:, 0]
        cycles = max(1, round(float(length.sum()) / SAMPLES))
        for which, line in zip(GROWN, _LINES, strict=False):
            total = np.zeros(STRETCHES)
            rates = orbits.logs[which] / length
            for begin, rate, count in zip(orbits.times[:, 0], rates, length, strict=True):
                stretches = ((begin + np.arange(count)) % SAMPLES) // (SAMPLES // STRETCHES)
                total += rate * np.bincount(stretches, minlength=STRETCHES)
            grown = np.concatenate([[0.0], np.cumsum(total / cycles)])
            lower.plot(
                np.linspace(0.0, 360.0, grown.size), grown,
                label=f"from {quantity(orbits.distances[which], 'm')}",
                color=svg.FIRST, dashes=line.get("dashes", (None, None)),
            )  # fmt: skip
    lower.set(ylabel="ln of the growth so far (-)", xlabel="crank angle after the start (°)")
    lower.set_xticks(range(0, 361, 45))
    svg.legend_above(lower)


STUDY = Study(
    "nonlinear",
    small=Config(
        scenes=(MAIN, "300rpm-0.2mm"),
        tolerances={"reference": (1e-10, 1e-12), "exudyn": (1e-10,)},
        cycles={"reference": 3, "exudyn": 2},
        long={"reference": 112, "exudyn": 14},
        long_main={"reference": 112, "exudyn": 14},
        swept={SPEED: (100.0, 200.0), CLEARANCE: (1e-4, 2e-4)},
        periods=110,
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
        periods=1000,
    ),
    measure=measure,
    page=page,
    draw=draw,
)
