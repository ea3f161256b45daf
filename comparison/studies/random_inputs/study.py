"""First-order second moments of the slider's errors over random inputs, checked by Monte Carlo."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np

from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.formatting import MISSING, quantity, table
from comparison.scene.criteria import RandomInput
from comparison.studies.random_inputs import plan
from comparison.studies.random_inputs.draws import RESPONSES, Drawn, run_draws
from comparison.studies.random_inputs.figures import draw_gradients, draw_precision, draw_probabilities
from comparison.studies.random_inputs.inputs import inputs_of, label
from comparison.studies.random_inputs.second_moment import (
    Plane,
    counted_probability,
    failure_probability,
    fit_plane,
    paired_change,
)
from comparison.tables.arrays import Array

LIMITS = {
    "displacement": (5.3e-5, 5.5e-5),
    "velocity": (7.8e-3, 8.2e-3),
    "acceleration": (60.0, 80.0),
    "displacement, against the nominal mechanism": (5e-4, 7e-4),
}
"""Two of each, the second exceeded seldom; the scene's own, of ``[reliability]``, come after them."""
SLOPES = (("displacement", "clearance.slider"), ("acceleration", "contact.restitution"))
"""Response and input whose gradient is shown over the scale."""


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Run all draws, and write README.md and figures."""
    planes, coarser = plan.planes(), plan.coarser()
    drawn = iter(run_draws([*planes.values(), *coarser.values(), plan.monte_carlo()], n_jobs, on_progress))
    scaled = {factor: next(drawn) for factor in planes}
    common = {tolerance: next(drawn) for tolerance in coarser}
    many = next(drawn)
    inputs = inputs_of(plan.scene())
    fitted = {name: _plane(scaled[1.0], k) for k, name in enumerate(RESPONSES)}
    draw_probabilities(
        {
            name: (unit, many.responses[:, k], fitted[name])
            for k, (name, unit) in enumerate(RESPONSES.items())
        },
        folder / "probabilities.svg",
    )
    labels = [label(one) for one in inputs]
    slopes = {}
    for response, key in SLOPES:
        k, column = list(RESPONSES).index(response), labels.index(key)
        at = [_plane(of, k) for of in scaled.values()]
        slopes[f"{response} by {key}"] = (
            RESPONSES[response],
            # Per standard deviation of the input, not of the runs.
            np.array([p.gradient[column] for p in at]),
            np.array([p.errors[column] for p in at]),
        )
    draw_gradients(list(scaled), slopes, folder / "gradients.svg")
    changes = {name: _changes(common, k, LIMITS[name][0]) for k, name in enumerate(RESPONSES) if k < 3}
    milliseconds = [1e3 * of.seconds for of in common.values()]
    draw_precision(list(common), milliseconds, changes, folder / "precision.svg")
    with replacing(folder / "README.md") as part:
        part.write_text(text(inputs, fitted, many, common, changes), "utf-8")


def _plane(of: Drawn, response: int) -> Plane:
    return fit_plane(of.u, of.responses[:, response])


def _changes(common: dict[float, Drawn], response: int, limit: float) -> Array:
    """Return the change of the failure probability against the finest tolerance, shape (n - 1, 3)."""
    *coarse, finest = common.values()
    rows = []
    for of in coarse:
        both, mine, theirs = np.intersect1d(of.index, finest.index, return_indices=True)
        del both
        beyond = [(d.responses[at, response] > limit) for d, at in ((of, mine), (finest, theirs))]
        rows.append(paired_change(beyond[0], beyond[1]))
    return np.array(rows)


def text(
    inputs: Sequence[RandomInput],
    fitted: dict[str, Plane],
    many: Drawn,
    common: dict[float, Drawn],
    changes: dict[str, Array],
) -> str:
    """Return the study's README."""
    template = files("comparison.studies.random_inputs").joinpath("random_inputs.md").read_text("utf-8")
    labels = [label(one) for one in inputs]
    return template.format(
        runs=f"{many.index.size:,}",
        failed=len(many.failures),
        plane_runs=plan.PLANE,
        seconds=quantity(many.seconds, "s"),
        total=quantity(many.seconds * (many.index.size + len(many.failures)), "s"),
        inputs=table(
            ("key", "distribution", "standard deviation"),
            [[label(one), one.distribution, f"{one.deviation:g}"] for one in inputs],
        ),
        moments=table(MOMENT_HEADINGS, [_moments(n, fitted[n], many, k) for k, n in enumerate(RESPONSES)]),
        importance=table(
            ("input", *RESPONSES),
            [[labels[i], *(_importance(fitted[name], i) for name in RESPONSES)] for i in range(len(labels))],
        ),
        probabilities=table(
            PROBABILITY_HEADINGS,
            [
                _probabilities(name, limit, fitted[name], many.responses[:, k])
                for k, name in enumerate(RESPONSES)
                for limit in (*LIMITS[name], _permitted(name))
            ],
        ),
        precision=table(
            ("tolerance", "processor time of a run", "failed runs", *(f"change, {name}" for name in changes)),
            [_precision(n, tolerance, of, changes) for n, (tolerance, of) in enumerate(common.items())],
        ),
        common=plan.COMMON,
    )


def _permitted(name: str) -> float:
    """Return the limit that the scene sets to an error of this kind, in its unit."""
    limits = getattr(plan.scene().reliability, name.partition(",")[0])
    return float(limits.upper)


MOMENT_HEADINGS = (
    "largest error of the second turn",
    "mean: plane, Monte Carlo",
    "standard deviation: plane, Monte Carlo",
    "what the plane leaves",
    "share of the variance that the plane explains",
)


def _moments(name: str, plane: Plane, many: Drawn, k: int) -> list[str]:
    values, unit = many.responses[:, k], RESPONSES[name]
    total = plane.deviation**2 + plane.rest**2
    return [
        name,
        f"{quantity(plane.mean, unit)} ± {quantity(2 * plane.mean_error, unit, 2)}, "
        f"{quantity(float(np.mean(values)), unit)}",
        f"{quantity(plane.deviation, unit)}, {quantity(float(np.std(values)), unit)}",
        quantity(plane.rest, unit),
        f"{plane.deviation**2 / total:.0%}" if total else MISSING,
    ]


def _importance(plane: Plane, i: int) -> str:
    sure = abs(plane.gradient[i]) > 2 * plane.errors[i]
    return f"{plane.importance[i]:.1%}" if sure else "–"


PROBABILITY_HEADINGS = (
    "largest error",
    "limit",
    "Monte Carlo, 95 % interval",
    "first order, 95 % interval",
    "first order with the rest as one more input",
)


def _probabilities(name: str, limit: float, plane: Plane, values: Array) -> list[str]:
    cells = [
        counted_probability(values > limit),
        failure_probability(plane, limit),
        failure_probability(plane, limit, with_rest=True),
    ]
    return [
        name,
        quantity(limit, RESPONSES[name]),
        *(f"{p:.2%} ({low:.2%} … {high:.2%})" for p, low, high in cells),
    ]


def _precision(n: int, tolerance: float, of: Drawn, changes: dict[str, Array]) -> list[str]:
    cells = []
    for change in changes.values():
        if n == len(change):
            cells.append("compared with")
        else:
            value, low, high = 100 * change[n]
            cells.append(f"{value:+.2f} % ({low:+.2f} … {high:+.2f})")
    return [f"{tolerance:.0e}", quantity(of.seconds, "s"), str(len(of.failures)), *cells]
