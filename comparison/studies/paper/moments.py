r"""First-order second moments of the slider's errors over random inputs, checked by Monte Carlo.

With gradients b of a response g(u) about u = 0, where u are independent standard normal numbers,

.. math:: \mu \approx g_0, \quad \sigma^2 \approx \sum b_i^2, \quad \alpha_i^2 = b_i^2 / \sigma^2, \quad
          P(g > l) \approx \Phi(-\beta), \quad \beta = (l - \mu) / \sigma

(A. H.-S. Ang and W. H. Tang, Probability Concepts in Engineering Planning and Design II, 1984, Ch. 6).

Impacts make a response rough, and a difference over a small step shows the roughness. So the gradient is that
of a plane fitted to runs that scatter over a chosen scale: the average slope over that scale. Its standard
error comes from the residuals, whose size may change from place to place: HC3 (J. S. Long and L. H. Ervin,
The American Statistician 54 (2000) 217-224). What the plane leaves is the roughness, together with the
curvature.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import norm

from comparison.execution.run import Progress
from comparison.formatting import MISSING, prefix, quantity
from comparison.report import svg
from comparison.scene import load_scene
from comparison.scene.schema import RandomInput
from comparison.studies.random_inputs.draws import RESPONSES, Draw, Drawn, inputs_of, label, run_draws
from comparison.studies.shared.study import Study, interval, write_csv
from comparison.tables.channels import Array, BoolArray

# ---- first-order second moments

CONFIDENCE = 0.95


class Plane(NamedTuple):
    """A plane fitted to a response."""

    mean: float
    mean_error: float  # at u = 0, and its standard error
    gradient: Array
    errors: Array  # per standard deviation of each input, and their standard errors, shape (d,)
    rest: float  # standard deviation of what the plane leaves

    @property
    def deviation(self) -> float:
        """Standard deviation of the plane over the inputs; the noise of the gradient is taken out."""
        return float(np.sqrt(max(0.0, float(np.sum(self.gradient**2 - self.errors**2)))))

    @property
    def importance(self) -> Array:
        """Share of each input in the plane's variance, shape (d,)."""
        squares = self.gradient**2
        return np.asarray(squares / (np.sum(squares) or 1.0))


def fit_plane(u: Array, response: Array) -> Plane:
    """Fit a plane to responses, shape (n,), over inputs in standard deviations, shape (n, d).

    Raises ValueError if there are fewer runs than twice the unknowns.
    """
    basis = np.column_stack([np.ones(len(u)), u])
    if len(u) < 2 * basis.shape[1]:
        raise ValueError(f"{len(u)} runs are too few for a plane over {u.shape[1]} inputs")
    inverse = np.linalg.inv(basis.T @ basis)
    coefficients = inverse @ (basis.T @ response)
    residuals = response - basis @ coefficients
    leverage = np.einsum("ij,jk,ik->i", basis, inverse, basis)
    weighted = basis * (residuals / (1.0 - leverage))[:, None]
    errors = np.sqrt(np.diag(inverse @ (weighted.T @ weighted) @ inverse))
    rest = float(np.sqrt(np.sum(residuals**2) / (len(u) - basis.shape[1])))
    return Plane(float(coefficients[0]), float(errors[0]), coefficients[1:], errors[1:], rest)


def failure_probability(plane: Plane, limit: float, *, with_rest: bool = False) -> tuple[float, float, float]:
    """Return P(response > limit) after first order, with the interval that the standard errors leave.

    With the rest: what the plane leaves counts as one more independent normal input.
    """
    deviation = float(np.sqrt(plane.deviation**2 + (plane.rest**2 if with_rest else 0.0)))
    if deviation == 0.0:
        return (float(plane.mean > limit),) * 3
    beta = (limit - plane.mean) / deviation
    # Of the mean and of the deviation: d beta = -d mean / sigma - beta d sigma / sigma.
    spread = float(np.sqrt(np.sum((plane.gradient * plane.errors) ** 2))) / deviation
    error = float(np.hypot(plane.mean_error, beta * spread)) / deviation
    half = float(norm.ppf(0.5 * (1.0 + CONFIDENCE))) * error
    return float(norm.sf(beta)), float(norm.sf(beta + half)), float(norm.sf(beta - half))


def counted_probability(failed: BoolArray) -> tuple[float, float, float]:
    """Return the share of failures with its exact interval (C. J. Clopper and E. S. Pearson, 1934)."""
    return float(failed.mean()), *interval(int(failed.sum()), failed.size)


def paired_change(failed: BoolArray, reference: BoolArray) -> tuple[float, float, float]:
    """Return by how much the share of failures differs between runs with the same inputs, with its interval.

    Only runs that fail in one of the two count (Q. McNemar, Psychometrika 12 (1947) 153-157); their share in
    one direction has the exact interval, given how many they are.
    """
    changed = failed != reference
    if not changed.any():
        # None of n runs changed: with that confidence no more than this share does, either way.
        most = 1.0 - (0.5 * (1.0 - CONFIDENCE)) ** (1.0 / failed.size)
        return 0.0, -most, most
    _, low, high = counted_probability(failed[changed])
    share, change = float(changed.mean()), (int(failed.sum()) - int(reference.sum())) / failed.size
    return change, share * (2 * low - 1), share * (2 * high - 1)


# ---- what is run

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


class Config(NamedTuple):
    """How much is run."""

    samples: int  # a cycle; peaks between them are those that the model has at its own steps
    runs: int  # of Monte Carlo
    plane: int  # runs that a plane is fitted to
    factors: tuple[float, ...]  # scales of the scatter over which a gradient is measured; the last is 1
    tolerances: tuple[float, ...]  # of the reference, the finest last
    common: int  # runs with the same inputs at every tolerance


class Results(NamedTuple):
    """Monte Carlo runs; planes by response over the whole scatter; tables."""

    config: Config
    inputs: tuple[RandomInput, ...]
    many: Drawn
    planes: dict[str, Plane]
    tables: dict[str, pd.DataFrame]
    """`probabilities`; "precision": `changes`; `gradients`."""


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run all draws and fit the planes."""
    values = {
        "drive.cycles": 2.0,
        "output.groups": ["accelerations"],
        "output.samples_per_cycle": config.samples,
    }
    scenes = [
        load_scene("150rpm-0.2mm", values | {"solver.reference.tolerance": tolerance})
        for tolerance in (1e-10, *config.tolerances)
    ]
    usual, *same = scenes
    inputs = inputs_of(usual)
    draws = [(Draw(usual, inputs, GRADIENT, factor), config.plane) for factor in config.factors]
    # At the usual tolerance they are the first of the many.
    draws += [(Draw(each, inputs, MONTE_CARLO), config.common) for each in same]
    draws.append((Draw(usual, inputs, MONTE_CARLO), config.runs))
    *drawn, many = run_draws(draws, n_jobs, on_progress)
    planes = {
        factor: {name: fit_plane(each.u, each.responses[name].to_numpy()) for name in RESPONSES}
        for factor, each in zip(config.factors, drawn, strict=False)
    }
    common = dict(zip(config.tolerances, drawn[len(planes) :], strict=True))
    own = {name: getattr(usual.reliability, name.partition(",")[0]).upper for name in RESPONSES}
    limits = {name: (*others, float(own[name])) for name, others in LIMITS.items()}
    tables = {
        "probabilities": probabilities(planes[1.0], many.responses, limits),
        "precision": changes(common),
        "gradients": gradients(inputs, planes),
    }
    return Results(config, inputs, many, planes[1.0], tables)


# ---- tables


def probabilities(
    planes: Mapping[str, Plane], responses: pd.DataFrame, limits: Mapping[str, Sequence[float]]
) -> pd.DataFrame:
    """Return the probabilities of exceeding limits by each method, with their intervals; a row each.

    ``agrees``: the interval of first order meets that of Monte Carlo.
    """
    rows = []
    for name, limit in ((each, limit) for each in RESPONSES for limit in limits[each]):
        counted = counted_probability(responses[name].to_numpy() > limit)
        for method, (p, low, high) in {
            "Monte Carlo": counted,
            FIRST_ORDER: failure_probability(planes[name], limit),
            WITH_RESIDUAL: failure_probability(planes[name], limit, with_rest=True),
        }.items():
            rows.append((name, limit, method, p, low, high, counted[1] <= high and low <= counted[2]))
    return pd.DataFrame(rows, columns=["response", "limit", "method", "p", "low", "high", "agrees"])


def changes(common: Mapping[float, Drawn]) -> pd.DataFrame:
    """Return how far failure probabilities change against the finest tolerance; a row each.

    ``shifted``: the interval of the change excludes zero.
    """
    rows = []
    *coarse, (_, finest) = common.items()
    for (tolerance, drawn), name in product(coarse, COMPARED):
        failed = [each.responses[name] > LIMITS[name][0] for each in (drawn, finest)]
        change, low, high = paired_change(*pd.concat(failed, axis=1, join="inner").to_numpy().T)
        cost = drawn.seconds, len(drawn.failures)
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
    many, changed, count = results.many, results.tables["precision"], len(results.many.responses)
    slopes = results.tables["gradients"].query("scale == 1.0")
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
        "responses": pd.DataFrame(_shown(results, name) for name in RESPONSES),
        "inputs": inputs,
        "shifted": changed[changed["shifted"]],
        "runs": count,
        "failed": len(many.failures),
        "config": results.config,
        "seconds": many.seconds,
        "total": many.seconds * (count + len(many.failures)),
    }


def _shown(results: Results, name: str) -> dict[str, str]:
    """Return a line with the moments of a response by both methods, and where their probabilities agree."""
    plane, drawn, exceeded = (
        results.planes[name],
        results.many.responses[name],
        results.tables["probabilities"],
    )
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
LEAST_COUNT = 5  # failures: a smaller share is not drawn


def draw(results: Results, folder: Path) -> None:
    """Draw the probabilities; write them, the gradients and the changes over the tolerance as tables."""
    planes, responses = results.planes, results.many.responses
    write_csv(results.tables, folder, "%.6g")
    least = LEAST_COUNT / len(responses)
    with svg.panels(folder / "probabilities.svg", 2, 2, height=4.8) as four:
        # The probability of exceeding a limit over the limit: counted, first order, with the residual.
        for axes, (name, base_unit) in zip(four, RESPONSES.items(), strict=True):
            values = responses[name].to_numpy()
            factor, unit = prefix(float(np.median(values)), base_unit)
            first, last = np.quantile(values, (0.002, max(0.5, 1.0 - 0.5 * least)))
            limits = np.linspace(first, last if last > first else first + 1.0, STEPS)
            value, low, high = np.array([counted_probability(values > limit) for limit in limits]).T
            axes.fill_between(limits / factor, np.maximum(low, 0.1 * least), high, color=svg.SHADE, lw=0)
            curves = {"Monte Carlo": np.maximum(value, 0.1 * least)}
            for method in (FIRST_ORDER, WITH_RESIDUAL):
                rest = method == WITH_RESIDUAL
                shares = [failure_probability(planes[name], limit, with_rest=rest)[0] for limit in limits]
                curves[method] = np.maximum(shares, 1e-12)
            for (method, curve), line in zip(curves.items(), svg.SERIES_LINES, strict=False):
                axes.semilogy(limits / factor, curve, label=method, **line)
            axes.set_ylim(least, 1.2)
            axes.set_title(name.replace(", ", ",\n"), fontsize=9)
            axes.set(xlabel=f"limit ({unit})", ylabel="P(error > limit) (-)")
            axes.locator_params(axis="x", nbins=5)
        svg.legend_above(four[0])


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
