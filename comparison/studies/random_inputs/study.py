"""First-order second moments of the slider's errors over random inputs, checked by Monte Carlo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from comparison.execution.run import Progress
from comparison.formatting import MISSING, prefix, quantity
from comparison.report import svg
from comparison.scene import Scene, load_scene
from comparison.scene.schema import RandomInput
from comparison.studies.random_inputs.draws import RESPONSES, Drawn, Draws, inputs_of, label, run_draws
from comparison.studies.random_inputs.second_moment import (
    Plane,
    counted_probability,
    failure_probability,
    fit_plane,
    paired_change,
)
from comparison.studies.shared.frames import write_csv
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array

MONTE_CARLO, GRADIENT = 1, 2  # seeds
LIMITS = {
    "displacement": (5.3e-5, 5.5e-5),
    "velocity": (7.8e-3, 8.2e-3),
    "acceleration": (60.0, 80.0),
    "displacement, against the nominal mechanism": (5e-4, 7e-4),
}
"""Two of each, the second exceeded seldom; the scene's own, of ``[reliability]``, come after them."""
COMPARED = ("displacement", "velocity", "acceleration")
"""Responses whose failure probability is compared at several tolerances."""
FIRST_ORDER, WITH_RESIDUAL = "first order", "first order with the residual"


@dataclass(frozen=True)
class Config:
    """How much is run."""

    samples: int  # a cycle; peaks between them are those that the model has at its own steps
    runs: int  # of Monte Carlo
    plane: int  # runs that a plane is fitted to
    factors: tuple[float, ...]  # scales of the scatter over which a gradient is measured; the last is 1
    tolerances: tuple[float, ...]  # of the reference, the finest last
    common: int  # runs with the same inputs at every tolerance


@dataclass(frozen=True)
class Results:
    """Monte Carlo runs; planes by factor and response; runs with the same inputs by tolerance."""

    config: Config
    inputs: tuple[RandomInput, ...]
    many: Drawn
    planes: dict[float, dict[str, Plane]]
    common: dict[float, Drawn]


def scene(samples: int, tolerance: float = 1e-10) -> Scene:
    """Return two cycles of the scene."""
    values: dict[str, object] = {
        "drive.cycles": 2.0,
        "output.groups": ["accelerations"],
        "output.samples_per_cycle": samples,
        "solver.reference.tolerance": tolerance,
    }
    return load_scene("150rpm-0.2mm", values)


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run all draws and fit the planes."""
    usual = scene(config.samples)
    inputs = inputs_of(usual)
    draws = [Draws(usual, inputs, config.plane, GRADIENT, factor) for factor in config.factors]
    # At the usual tolerance they are the first of the many.
    same = [scene(config.samples, tolerance) for tolerance in config.tolerances]
    draws += [Draws(each, inputs, config.common, MONTE_CARLO) for each in same]
    draws.append(Draws(usual, inputs, config.runs, MONTE_CARLO))
    *drawn, many = run_draws(draws, n_jobs, on_progress)
    planes = {
        factor: {name: fit_plane(each.u, each.responses[name].to_numpy()) for name in RESPONSES}
        for factor, each in zip(config.factors, drawn, strict=False)
    }
    common = dict(zip(config.tolerances, drawn[len(planes) :], strict=True))
    return Results(config, inputs, many, planes, common)


# ---- tables


def limits_of(samples: int) -> dict[str, tuple[float, ...]]:
    """Return the limits of each response, the scene's own last."""
    own = scene(samples).reliability
    return {
        name: (*limits, float(getattr(own, name.partition(",")[0]).upper)) for name, limits in LIMITS.items()
    }


def probabilities(
    planes: Mapping[str, Plane], responses: pd.DataFrame, limits: Mapping[str, Sequence[float]]
) -> pd.DataFrame:
    """Return the probabilities of exceeding limits by each method, with their intervals; a row each.

    ``agrees``: the interval of first order meets that of Monte Carlo.
    """
    rows = []
    for name in RESPONSES:
        for limit in limits[name]:
            counted = counted_probability(responses[name].to_numpy() > limit)
            for method, (p, low, high) in {
                "Monte Carlo": counted,
                FIRST_ORDER: failure_probability(planes[name], limit),
                WITH_RESIDUAL: failure_probability(planes[name], limit, with_rest=True),
            }.items():
                agrees = counted[1] <= high and low <= counted[2]
                rows.append((name, limit, method, p, low, high, agrees))
    return pd.DataFrame(rows, columns=["response", "limit", "method", "p", "low", "high", "agrees"])


def changes(common: Mapping[float, Drawn]) -> pd.DataFrame:
    """Return how far failure probabilities change against the finest tolerance; a row each.

    ``shifted``: the interval of the change excludes zero.
    """
    rows = []
    (*coarse, _), (*_, finest) = common, common.values()
    for tolerance in coarse:
        for name in COMPARED:
            failed = [each.responses[name] > LIMITS[name][0] for each in (common[tolerance], finest)]
            pair = pd.concat(failed, axis=1, join="inner").to_numpy()
            change, low, high = paired_change(*pair.T)
            cost = common[tolerance].seconds, len(common[tolerance].failures)
            rows.append((tolerance, *cost, name, change, low, high, low > 0 or high < 0))
    names = ["tolerance", "seconds", "failed", "response", "change", "low", "high", "shifted"]
    return pd.DataFrame(rows, columns=names)


def gradients(inputs: Sequence[RandomInput], planes: Mapping[float, Mapping[str, Plane]]) -> pd.DataFrame:
    """Return the slopes of every plane per standard deviation of an input, by the scale of its runs.

    ``significant``: the slope is beyond two standard errors of zero; ``importance``: share in the variance.
    """
    return pd.DataFrame(
        (scale, name, label(one), slope, error, abs(slope) > 2 * error, share)
        for scale, by_response in planes.items()
        for name, p in by_response.items()
        for one, slope, error, share in zip(inputs, p.gradient, p.errors, p.importance, strict=True)
    ).set_axis(["scale", "response", "input", "slope", "error", "significant", "importance"], axis=1)


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, many, planes = results.config, results.many, results.planes[1.0]
    exceeded = probabilities(planes, many.responses, limits_of(config.samples))
    slopes = gradients(results.inputs, results.planes).query("scale == 1.0")
    changed, count = changes(results.common), len(many.responses)
    inputs = pd.DataFrame(
        {
            "input": [label(one) for one in results.inputs],
            "distribution": [one.distribution for one in results.inputs],
            "deviation": [f"{one.deviation:g}" for one in results.inputs],
        }
    )
    shares = slopes["importance"].map("{:.1%}".format).where(slopes["significant"], "–")
    for name in RESPONSES:
        inputs[name] = shares[slopes["response"] == name].tolist()
    return {
        "decisive": slopes.loc[slopes.groupby("response", sort=False)["importance"].idxmax()],
        "responses": pd.DataFrame(
            shown_response(name, planes[name], many.responses[name], exceeded) for name in RESPONSES
        ),
        "inputs": inputs,
        "shifted": changed[changed["shifted"]],
        "runs": count,
        "failed": len(many.failures),
        "config": config,
        "seconds": many.seconds,
        "total": many.seconds * (count + len(many.failures)),
    }


def shown_response(name: str, plane: Plane, drawn: pd.Series, exceeded: pd.DataFrame) -> dict[str, str]:
    """Return a line with the moments of a response by both methods, and where their probabilities agree."""
    unit, total = RESPONSES[name], plane.deviation**2 + plane.rest**2
    mean = f"{quantity(plane.mean, unit)} ± {quantity(2 * plane.mean_error, unit, 2)}"
    deviations = [quantity(size, unit) for size in (plane.deviation, float(drawn.std(ddof=0)))]
    line = {
        "largest error": name,
        "mean: plane; Monte Carlo": f"{mean}; {quantity(float(drawn.mean()), unit)}",
        "deviation: plane; Monte Carlo": "; ".join(deviations),
        "residual": quantity(plane.rest, unit),
        "variance explained": f"{plane.deviation**2 / total:.0%}" if total else MISSING,
    }
    for method in (FIRST_ORDER, WITH_RESIDUAL):
        agrees = exceeded[(exceeded["response"] == name) & (exceeded["method"] == method)]["agrees"]
        line[f"{method} agrees at"] = f"{agrees.sum()} of {len(agrees)} limits"
    return line


# ---- figures

STEPS = 120
LEAST_COUNT = 5
"""Failures: a smaller share is not drawn."""


def draw(results: Results, folder: Path) -> None:
    """Draw the probabilities; write them, the gradients and the changes over the tolerance as tables."""
    planes, responses = results.planes[1.0], results.many.responses
    frames = {
        "probabilities": probabilities(planes, responses, limits_of(results.config.samples)),
        "precision": changes(results.common),
        "gradients": gradients(results.inputs, results.planes),
    }
    write_csv(frames, folder, "%.6g")
    with svg.panels(folder / "probabilities.svg", 2, 2, height=4.8) as four:
        for axes, name in zip(four, RESPONSES, strict=True):
            _probabilities(axes, name, responses[name].to_numpy(), planes[name])
        svg.legend_above(four[0])


def _probabilities(axes: Axes, name: str, values: Array, plane: Plane) -> None:
    """Draw the probability of exceeding a limit over the limit: counted, first order, with the residual."""
    factor, unit = prefix(float(np.median(values)), RESPONSES[name])
    least = LEAST_COUNT / values.size
    first, last = np.quantile(values, (0.002, max(0.5, 1.0 - 0.5 * least)))
    limits = np.linspace(first, last if last > first else first + 1.0, STEPS)
    value, low, high = np.array([counted_probability(values > limit) for limit in limits]).T
    axes.fill_between(limits / factor, np.maximum(low, 0.1 * least), high, color=svg.SHADE, lw=0)
    curves = {"Monte Carlo": np.maximum(value, 0.1 * least)}
    for method in (FIRST_ORDER, WITH_RESIDUAL):
        with_rest = method == WITH_RESIDUAL
        found = [failure_probability(plane, limit, with_rest=with_rest)[0] for limit in limits]
        curves[method] = np.maximum(found, 1e-12)
    for (method, curve), line in zip(curves.items(), svg.SERIES_LINES, strict=False):
        axes.semilogy(limits / factor, curve, label=method, **line)
    axes.set_ylim(least, 1.2)
    axes.set_title(name.replace(", ", ",\n"), fontsize=9)
    axes.set(xlabel=f"limit ({unit})", ylabel="P(error > limit) (-)")
    axes.locator_params(axis="x", nbins=5)


STUDY = Study(
    "random-inputs",
    small=Config(samples=40, runs=60, plane=30, factors=(0.1, 1.0), tolerances=(1e-7, 1e-10), common=20),
    full=Config(
        samples=500, runs=10_000, plane=400, common=2000, factors=(0.003, 0.03, 0.3, 1.0),
        tolerances=(1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11),
    ),
    measure=measure,
    page=page,
    draw=draw,
)  # fmt: skip
