"""The radius of the slider's corners from the peaks of the acceleration's error."""

from __future__ import annotations

from math import exp, isnan, sqrt
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.formatting import number
from comparison.scene import load_scene
from comparison.studies.identification.facts import BASE

POWER = 0.2
"""Of the radius in an impact's peak force: the stiffness K goes with its root, the force with K^0.4."""


class RadiusFit(NamedTuple):
    """A straight line through the logarithms of radii and peaks."""

    power: float
    """Of the radius in the peaks."""
    radius: float
    """At which the mean of the peaks is the published one, m; nan where they do not grow with it."""
    low: float
    high: float
    """One standard deviation to either side, from the scatter of the scenes through `POWER`, m."""
    scatter: float
    """Factor by which the scenes scatter about their mean."""


def fit_radius(peaks: pd.DataFrame) -> RadiusFit:
    """Return how peaks over the published ones, a row a radius (m), a column a scene, depend on it."""
    logs, scale = np.log(peaks.to_numpy()), np.log(peaks.index.to_numpy(np.float64))
    power = float(np.polyfit(scale, logs.mean(axis=1), 1)[0])
    # The residual of each scene's ratio about the mean of all gives the uncertainty of a mean of five.
    scatter = sqrt(float(np.mean(np.var(logs, axis=1, ddof=1))))
    factor = exp(scatter / sqrt(logs.shape[1]) / POWER)
    best = exp(float(scale.mean() - logs.mean() / power)) if power > 0 else float("nan")
    return RadiusFit(power, best, best / factor, best * factor, exp(scatter))


def radius_words(fitted: RadiusFit) -> dict[str, str]:
    """Return what the page says of the radius, by the names in its template."""
    words = {"exponent": number(fitted.power, 2)}
    if isnan(fitted.radius):
        found = "The peaks do not grow with the radius, so that no radius meets the published ones."
        return words | {"radius_found": found, "radius_certainty": "the peaks do not determine it"}
    used = load_scene(BASE).data["contact"]["corner_radius"]
    agrees = "agrees" if fitted.low <= used <= fitted.high else "does not agree"
    found = (
        f"The published peaks are met on the mean at {number(fitted.radius, 2)} m. The scenes scatter about "
        f"their mean by a factor of {number(fitted.scatter, 2)}, which through the power of {POWER} leaves "
        f"{number(fitted.low, 1)} … {number(fitted.high, 1)} m (one standard deviation)."
    )
    factor = number(fitted.high / fitted.radius, 1)
    certainty = f"{agrees} with the peaks, which determine it to a factor of {factor}"
    return words | {"radius_found": found, "radius_certainty": certainty}
