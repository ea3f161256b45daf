"""The tables of the study nonlinear."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import nan

import numpy as np

from comparison.accuracy.levels import thresholds
from comparison.formatting import MISSING, quantity, table
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.studies.ensembles.statistics import Sample, distances
from comparison.studies.nonlinear.chaos import verdict
from comparison.studies.nonlinear.memory import LATER, Memory
from comparison.studies.nonlinear.methods.lyapunov import Exponent
from comparison.studies.nonlinear.methods.recurrence import LONGEST, period
from comparison.studies.nonlinear.methods.zero_one import LEAST, chaos_indicator
from comparison.studies.nonlinear.press import STATE
from comparison.studies.nonlinear.scenes import ANGLES, DISTANCES, FORGETTING, MAIN, USUAL, Key
from comparison.studies.shared.frames import rows_table
from comparison.tables.arrays import Array
from comparison.tables.channels import channels

Found = Mapping[Key, Sequence[Exponent]]
"""Exponents, one a distance; none where the runs could not be followed."""
Sections = Mapping[tuple[str, str], Array]
SECTION = 15
"""The sample of a cycle, of `ANGLES`, that stands for the others: in the slider's chatter."""
SAME = 1e-3
"""Of the clearance: two states of a section this close are the same."""
EVERY = 5
"""Samples of a cycle from one section that is compared as a distribution to the next."""


def answer(best: Mapping[Key, Exponent], names: Sequence[str]) -> str:
    """Return for each scene whether it is chaotic, and how many runs measure its exponent."""
    lines = []
    for name in names:
        runs = {key: e for key, e in best.items() if key[0] == name}
        measured = {key: e for key, e in runs.items() if e.measured}
        count, count_measured = (Counter(model for _, model, _ in of) for of in (runs, measured))
        share = {f"{m} runs that measure the exponent": f"{count_measured[m]} of {count[m]}" for m in MODELS}
        lines.append({"scene": name, "verdict": f"**{verdict(best, name).value}**"} | share)
    return rows_table(lines)


def finding(best: Mapping[Key, Exponent], names: Sequence[str]) -> str:
    """Return how many scenes are chaotic, and how many are not or undecided."""
    counted = Counter(verdict(best, name) for name in names)
    counts = ", ".join(f"{count} {chaos.value}" for chaos, count in counted.most_common())
    return f"Of {len(names)} scenes: {counts}."


def by_distance(found: Found) -> str:
    """Return the exponents of the main scene by model, tolerance and distance."""
    lines = []
    for model in MODELS:
        runs = {tolerance: of for (name, by, tolerance), of in found.items() if (name, by) == (MAIN, model)}
        for tolerance in sorted(runs, reverse=True):
            cells = dict(zip(DISTANCES[model], map(_exponent, runs[tolerance]), strict=False))
            wide = {f"{distance:.0e} m": cells.get(distance, "") for distance in DISTANCES["reference"]}
            lines.append({"model": model, "tolerance": f"{tolerance:.0e}"} | wide)
    return rows_table(lines)


def by_scene(
    best: Mapping[Key, Exponent],
    sections: Sections,
    scenes: Mapping[tuple[str, str], Scene],
    scatter: Mapping[str, Array],
) -> str:
    """Return exponents, 0-1 test, recurrence and scatter of each scene."""
    lines = []
    for name, of in scatter.items():
        line = {"scene": name}
        for model in MODELS:
            of_model = [e for key, e in best.items() if key[:2] == (name, model)]
            of_model.sort(key=lambda e: e.value)
            ends = of_model[:1] + of_model[1:][-1:]
            line[f"exponent, {model}"] = " … ".join(map(_exponent, ends)) or MISSING
        series = {model: sections[name, model][:, SECTION, 0] for model in MODELS}
        for model, x in series.items():
            line[f"K, {model}"] = f"{chaos_indicator(x):.2f}" if x.size >= LEAST else MISSING
        clearance = scenes[name, MODELS[0]].data["clearance"]["slider"]
        repeats = period(series[MODELS[0]], SAME * clearance)
        line[f"section repeats after, cycles (of {LONGEST})"] = "never" if repeats is None else str(repeats)
        line["largest scatter over the angles"] = quantity(float(of.max()), "m", 2)
        line["least"] = quantity(float(of.min()), "m", 2)
        lines.append(line)
    return rows_table(lines)


def memory(found: Sequence[Memory]) -> str:
    """Return how much of the state after a rest follows from the remembered impact speeds."""
    lines: dict[float, list[str]] = {}
    for of in found:
        cell = f"{quantity(of.scatter, 'm', 2)}: {100 * of.explained:.2f} %"
        lines.setdefault(of.angle, []).append(cell)
    rows = [[f"{360 * angle:.0f}°", *cells] for angle, cells in lines.items()]
    words = ("x", "angle", "rate of x", "rate of angle")
    return table(("crank angle from the start", *words), rows or [[MISSING] * 5])


def forgetting(best: Mapping[Key, Exponent], scatter: Mapping[str, Array]) -> str:
    """Return exponents and scatter of the main scene with frozen impact speeds, and without that memory."""
    lines = []
    for name in (MAIN, FORGETTING):
        runs = {model: best.get((name, model, USUAL[model])) for model in MODELS}
        line = {"impact speed": "frozen" if name == MAIN else "of the moment"}
        line |= {f"exponent, {m}": MISSING if of is None else _exponent(of) for m, of in runs.items()}
        of_angles = scatter[name]
        for angle in LATER:
            at = f"scatter at {360 * angle:.0f}°"
            line[at] = quantity(float(of_angles[round(angle * ANGLES)]), "m", 2)
        lines.append(line | {"largest": quantity(float(of_angles.max()), "m", 2)})
    return rows_table(lines)


def without_memory(best: Mapping[Key, Exponent], scatter: Mapping[str, Array]) -> str:
    """Return in a sentence how much of the main scene's magnification is the contact law's memory."""
    pairs = [
        (of.value, without.value)
        for model in MODELS
        if (of := best.get((MAIN, model, USUAL[model]))) is not None
        and (without := best.get((FORGETTING, model, USUAL[model]))) is not None
        and of.measured
        and without.measured
    ]
    if not pairs:
        with_it, without_it = (float(scatter[name].max()) for name in (MAIN, FORGETTING))
        found = (
            "Without the memory no exponent is measured, only upper bounds (a perturbed run comes back to "
            f"within the rounding), and cycles differ by {quantity(without_it, 'm', 2)} at most, with it by "
            f"{quantity(with_it, 'm', 2)}."
        )
        # A hundredth: what is left cannot be the scatter of an attractor of the same size
        told = " So the magnification is the law's memory: without it the cycles of this scene repeat."
        return found + (told if without_it < 0.01 * with_it else "")
    kept, free = np.mean(pairs, axis=0).tolist()
    if free <= 0.0:
        return "Without the memory neighbours do not part: all of the magnification is the law's memory."
    share = f"{100 * (1.0 - free / kept):.0f} % of the exponent"
    return (
        f"Without the memory a small distance still grows e^{free:.1f} times a cycle, with it e^{kept:.1f} "
        f"times (means of both models): {share} is the law's memory, the rest is the press's."
    )


def distributions(sections: Sections, scenes: Mapping[tuple[str, str], Scene], names: Sequence[str]) -> str:
    """Return the comparison of both models' sections, where they scatter more than what is predictable."""
    lines = []
    for name in names:
        scene = scenes[name, MODELS[0]].data
        samples, correlations = [], []
        for k, channel in enumerate(STATE):
            floor = thresholds().alpha * channels()[channel].scale_value(scene, 0.0)
            for angle in range(0, ANGLES, EVERY):
                of = [sections[name, model][:, angle, k] for model in MODELS]
                if max(values.std() for values in of) > floor:
                    samples.append(Sample(channel, f"{angle}", channels()[channel].unit, *of))
                    correlations.append(abs(float(np.corrcoef(of[0][1:], of[0][:-1])[0, 1])))
        tests = distances(samples)
        scatter_apart = max((test.wasserstein / test.scale for test in tests), default=nan)
        cells = {
            "found to differ": f"**{sum(test.found for test in tests)}**",
            "smallest adjusted p": f"{min((test.adjusted for test in tests), default=nan):.2g}",
            "largest distance of distributions": f"{max((t.statistic for t in tests), default=nan):.2f}",
            "largest Wasserstein distance over the scatter": f"{scatter_apart:.2f}",
            "largest correlation of successive cycles": f"{max(correlations, default=nan):.2f}",
        }
        of_scene = {"scene": name, "tests": f"{len(tests)}"}
        lines.append(of_scene | (cells if tests else dict.fromkeys(cells, MISSING)))
    return rows_table(lines)


def _exponent(e: Exponent) -> str:
    if e.collapsed == 1.0:
        return f"≤ {e.value:.1f}, all cycles collapsed"
    bound = "" if e.measured else "≤ "
    return f"{bound}{e.value:.2f} ({e.low:.2f} … {e.high:.2f}), {e.collapsed:.0%} collapsed"
