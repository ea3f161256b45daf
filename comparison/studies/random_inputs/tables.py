"""The tables of the study random-inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from comparison.formatting import MISSING, quantity
from comparison.scene.schema import RandomInput
from comparison.studies.random_inputs.draws import RESPONSES, Drawn
from comparison.studies.random_inputs.inputs import label
from comparison.studies.random_inputs.second_moment import Plane, counted_probability, failure_probability
from comparison.studies.shared.frames import rows_table
from comparison.tables.arrays import Array


def inputs(drawn: Sequence[RandomInput]) -> str:
    """Return what scatters, and how."""
    return rows_table(
        {"key": label(one), "distribution": one.distribution, "standard deviation": f"{one.deviation:g}"}
        for one in drawn
    )


def moments(planes: Mapping[str, Plane], responses: pd.DataFrame) -> str:
    """Return means and standard deviations by both methods, and how much of them the plane has."""

    def row(name: str, unit: str) -> dict[str, str]:
        plane, counted = planes[name], responses[name]
        mean = f"{quantity(plane.mean, unit)} ± {quantity(2 * plane.mean_error, unit, 2)}"
        deviations = [quantity(value, unit) for value in (plane.deviation, float(counted.std(ddof=0)))]
        total = plane.deviation**2 + plane.rest**2
        explained = f"{plane.deviation**2 / total:.0%}" if total else MISSING
        return {
            "largest error of the second cycle": name,
            "mean: plane, Monte Carlo": f"{mean}, {quantity(float(counted.mean()), unit)}",
            "standard deviation: plane, Monte Carlo": ", ".join(deviations),
            "residual of the plane": quantity(plane.rest, unit),
            "share of the variance that the plane explains": explained,
        }

    return rows_table(row(*each) for each in RESPONSES.items())


def importance(planes: Mapping[str, Plane], labels: Sequence[str]) -> str:
    """Return the share of each input in the variance of each plane, where its slope is significant."""

    def share(plane: Plane, i: int) -> str:
        return f"{plane.importance[i]:.1%}" if abs(plane.gradient[i]) > 2 * plane.errors[i] else "–"

    return rows_table(
        {"input": name} | {response: share(planes[response], i) for response in RESPONSES}
        for i, name in enumerate(labels)
    )


def finding(planes: Mapping[str, Plane], labels: Sequence[str]) -> str:
    """Return the input with the largest share in the variance of each response."""
    parts = []
    for response in RESPONSES:
        shares = list(planes[response].importance)
        share, name = max(zip(shares, labels, strict=True))
        parts.append(f"{response}: {name} ({share:.0%})")
    return f"Input with the largest share in the variance of the error: {'; '.join(parts)}."


def probabilities(
    planes: Mapping[str, Plane], responses: pd.DataFrame, limits: Mapping[str, Sequence[float]]
) -> str:
    """Return the probabilities of exceeding limits: counted, and by first order."""

    def row(name: str, limit: float) -> dict[str, str]:
        found = _by_method(planes[name], responses[name], limit)
        return {"largest error": name, "limit": quantity(limit, RESPONSES[name])} | {
            f"{method}, 95 % interval": f"{p:.2%} ({low:.2%} … {high:.2%})"
            for method, (p, low, high) in found.items()
        }

    return rows_table(row(name, limit) for name in RESPONSES for limit in limits[name])


def agreement(
    planes: Mapping[str, Plane], responses: pd.DataFrame, limits: Mapping[str, Sequence[float]]
) -> str:
    """Return at how many limits the intervals of first order and Monte Carlo meet."""

    def row(name: str) -> dict[str, str]:
        found = [_by_method(planes[name], responses[name], limit) for limit in limits[name]]
        cells = {"largest error": name}
        for method in list(found[0])[1:]:
            both = [(of["Monte Carlo"], of[method]) for of in found]
            met = sum(a[1] <= b[2] and b[1] <= a[2] for a, b in both)
            cells[method] = f"{met} of {len(found)}"
        return cells

    return rows_table(row(name) for name in RESPONSES)


def _by_method(plane: Plane, response: pd.Series, limit: float) -> dict[str, tuple[float, float, float]]:
    """Return the probability of exceeding a limit and its interval by each method."""
    return {
        "Monte Carlo": counted_probability(response.to_numpy() > limit),
        "first order": failure_probability(plane, limit),
        "first order with the residual as one more input": failure_probability(plane, limit, with_rest=True),
    }


def shifted(common: Mapping[float, Drawn], changes: Mapping[str, Array]) -> str:
    """Name the responses, and the tolerances, at which the change of the probability is significant."""
    found = [
        f"{name} at {tolerance:.0e}"
        for name, of in changes.items()
        for tolerance, (_, low, high) in zip(common, of, strict=False)
        if low > 0 or high < 0
    ]
    return ", ".join(found) or "none"


def precision(common: Mapping[float, Drawn], changes: Mapping[str, Array]) -> str:
    """Return cost, and change of the failure probabilities against the finest tolerance, by tolerance."""

    def row(n: int, tolerance: float, of: Drawn) -> dict[str, str]:
        cells = {
            f"change, {name}": "{:+.2f} % ({:+.2f} … {:+.2f})".format(*(100 * change[n]))
            if n < len(change)
            else "compared with"
            for name, change in changes.items()
        }
        cost = {"processor time of a run": quantity(of.seconds, "s"), "failed runs": str(len(of.failures))}
        return {"tolerance": f"{tolerance:.0e}"} | cost | cells

    return rows_table(row(n, *each) for n, each in enumerate(common.items()))
