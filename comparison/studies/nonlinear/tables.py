"""What the study nonlinear says."""

from __future__ import annotations

from importlib.resources import files

import numpy as np

from comparison.accuracy.thresholds import thresholds
from comparison.execution.run import Job
from comparison.formatting import MISSING, quantity, table
from comparison.studies.ensembles.statistics import Distance, Sample, distances
from comparison.studies.nonlinear import scenes
from comparison.studies.nonlinear.chains import TRANSIENT
from comparison.studies.nonlinear.controls import controls
from comparison.studies.nonlinear.memory import remembered
from comparison.studies.nonlinear.methods.lyapunov import Exponent, closest_measured
from comparison.studies.nonlinear.methods.recurrence import period
from comparison.studies.nonlinear.methods.twins import Twins
from comparison.studies.nonlinear.methods.zero_one import LEAST, chaos_indicator
from comparison.studies.nonlinear.press import STATE, spread
from comparison.tables.arrays import Array
from comparison.tables.channels import channels
from comparison.tables.table import Table

Found = dict[tuple[str, str, float], list[Exponent]]
SECTION = 15
"""The sample of a turn, of `scenes.ANGLES`, that stands for the others: in the slider's chatter."""
NEAR = 0.01
"""Of the largest scatter over the angles: twins that start farther apart are no neighbours."""
SAME = 1e-3
"""Of the clearance: two states of a section this close are the same."""


def text(
    found: Found,
    twins: dict[tuple[str, str, float], Twins | None],
    sections: dict[tuple[str, str], Array],
    run: Table,
    job: Job,
) -> str:
    """Return the study's README."""
    template = files("comparison.studies.nonlinear").joinpath("nonlinear.md").read_text("utf-8")
    main = {key: of for key, of in found.items() if key[0] == scenes.MAIN}
    return template.format(
        answer=answer(found, sections),
        controls=controls(),
        main=table(
            ("model", "tolerance", *(f"{d:.0e} m" for d in scenes.DISTANCES["reference"])),
            [
                [model, f"{tolerance:.0e}", *_cells(of, scenes.DISTANCES[model])]
                for (_, model, tolerance), of in sorted(main.items(), key=_order)
            ],
        ),
        scenes=table(SCENE_HEADINGS, [_scene_row(name, found, sections) for name in scenes.SCENES]),
        memory=memory_table(run, job),
        distributions=table(DISTRIBUTION_HEADINGS, [distribution_row(n, sections) for n in scenes.SCENES]),
        noise=quantity(_noise(twins), "m", 2),
        turns=scenes.TURNS["reference"],
        exudyn_turns=scenes.TURNS["exudyn"],
        long=scenes.LONG_MAIN["reference"],
        long_exudyn=scenes.LONG_MAIN["exudyn"],
    )


def _order(item: tuple[tuple[str, str, float], object]) -> tuple[bool, float]:
    (_, model, tolerance), _found = item
    return model != "reference", -tolerance


def _noise(twins: dict[tuple[str, str, float], Twins | None]) -> float:
    of = twins[scenes.MAIN, "reference", scenes.USUAL["reference"]]
    return float("nan") if of is None else float(np.median(of.noise))


def _cells(of: list[Exponent], at: tuple[float, ...]) -> list[str]:
    """Return one cell for each distance of the reference."""
    cells = dict(zip(at, map(_exponent, of), strict=False))
    return [cells.get(distance, "") for distance in scenes.DISTANCES["reference"]]


def _exponent(e: Exponent) -> str:
    if e.collapsed == 1.0:
        return f"≤ {e.value:.1f}, every turn collapsed"
    bound = "" if e.measured else "≤ "
    return f"{bound}{e.value:.2f} ({e.low:.2f} … {e.high:.2f}), {e.collapsed:.0%} collapsed"


def answer(found: Found, sections: dict[tuple[str, str], Array]) -> str:
    """Return a sentence for each scene: where the exponent is measured, and its sign.

    Chaotic is a scene whose exponent is positive in every run that measures it, in both models; not chaotic
    one whose exponent, or upper bound, is negative in every run.
    """
    lines = []
    for name in scenes.SCENES:
        runs = {key: _best(of, key, sections) for key, of in found.items() if key[0] == name and of}
        measured = {key: e for key, e in runs.items() if e.measured}
        models = {model for _, model, _ in measured}
        if {e.sign for e in measured.values()} == {1} and models == set(scenes.LONG):
            verdict = "chaotic: the exponent is positive in every run that measures it"
        elif runs and {e.sign for e in runs.values()} == {-1}:
            verdict = "not chaotic: the exponent is negative in every run"
        else:
            verdict = "undecided: its sign is not the same, or not sure, in the runs that measure it"
        counts = [
            f"{sum(key[1] == model for key in measured)} of {sum(key[1] == model for key in runs)} {model}"
            for model in scenes.LONG
        ]
        lines.append(f"- {name}: **{verdict}** ({' and '.join(counts)}).")
    return "\n".join(lines)


def _best(
    of: list[Exponent], key: tuple[str, str, float], sections: dict[tuple[str, str], Array]
) -> Exponent:
    """Return the exponent to believe, of those whose twins are neighbours in the scene's scatter."""
    name, model, _ = key
    largest = float(spread(sections[name, "reference"], scenes.long_run(name, "reference").scene).max())
    near = [e for e, d in zip(of, scenes.DISTANCES[model], strict=True) if d <= NEAR * largest]
    return near[closest_measured(near)] if near else of[0]


SCENE_HEADINGS = (
    "scene",
    "exponent, reference, least and most of the tolerances",
    "exponent, Exudyn",
    "K, reference",
    "K, Exudyn",
    "section repeats after",
    "scatter of all turns, largest and least over the angles",
)


def _scene_row(name: str, found: Found, sections: dict[tuple[str, str], Array]) -> list[str]:
    ours, theirs = (
        [_best(of, key, sections) for key, of in found.items() if key[:2] == (name, model) and of]
        for model in ("reference", "exudyn")
    )
    turns = sections[name, "reference"]
    scene = scenes.long_run(name, "reference").scene
    scatter = spread(turns, scene)
    clearance = scene.data["clearance"]["slider"]
    repeats = period(turns[:, SECTION, 0], SAME * clearance)
    return [
        name,
        " … ".join(_exponent(e) for e in (min(ours, key=_value), max(ours, key=_value))) if ours else MISSING,
        " … ".join(_exponent(e) for e in (min(theirs, key=_value), max(theirs, key=_value)))
        if len(theirs) > 1
        else _exponent(theirs[0])
        if theirs
        else MISSING,
        *(_indicator(sections[name, model]) for model in ("reference", "exudyn")),
        "never (16 turns looked at)" if repeats is None else f"{repeats} turn{'s' if repeats > 1 else ''}",
        f"{quantity(float(scatter.max()), 'm', 2)}, {quantity(float(scatter.min()), 'm', 2)}",
    ]


def _value(e: Exponent) -> float:
    return e.value


def _indicator(turns: Array) -> str:
    series = turns[:, SECTION, 0]
    return f"{chaos_indicator(series):.2f}" if series.size >= LEAST else MISSING


def memory_table(run: Table, job: Job) -> str:
    """Return how much of the state after a rest follows from the remembered impact speeds."""
    found = remembered(run, job.scene, TRANSIENT)
    rows = []
    for k in range(0, len(found), len(STATE)):
        four = found[k : k + len(STATE)]
        cells = [f"{quantity(of.scatter, 'm', 2)}: {100 * of.explained:.2f} %" for of in four]
        rows.append([f"{360 * found[k].angle:.0f}°", *cells])
    words = ("x", "angle", "rate of x", "rate of angle")
    return table(("crank angle from the start", *words), rows or [[MISSING] * 5])


DISTRIBUTION_HEADINGS = (
    "scene",
    "tests",
    "found to differ",
    "smallest adjusted p",
    "largest distance of distributions",
    "largest Wasserstein distance over the scatter",
    "correlation of successive turns, largest",
)


def distribution_row(name: str, sections: dict[tuple[str, str], Array]) -> list[str]:
    """Return the comparison of both models' sections, where they scatter more than what is predictable."""
    a, b = (sections[name, model] for model in ("reference", "exudyn"))
    scene = scenes.long_run(name, "reference").scene.data
    samples, correlations = [], []
    for k, channel in enumerate(STATE):
        floor = thresholds().alpha * channels()[channel].scale_value(scene, 0.0)
        for angle in range(0, scenes.ANGLES, 5):
            of = [turns[:, angle, k] for turns in (a, b)]
            if max(values.std() for values in of) > floor:
                samples.append(Sample(channel, f"{angle}", channels()[channel].unit, *of))
                correlations.append(abs(float(np.corrcoef(of[0][1:], of[0][:-1])[0, 1])))
    tests: list[Distance] = distances(samples)
    if not tests:
        return [name, "0: single runs are predictable", *[MISSING] * 5]
    return [
        name,
        str(len(tests)),
        f"**{sum(test.found for test in tests)}**",
        f"{min(test.adjusted for test in tests):.2g}",
        f"{max(test.statistic for test in tests):.2f}",
        f"{max(test.wasserstein / test.scale for test in tests):.2f}",
        f"{max(correlations):.2f}",
    ]
