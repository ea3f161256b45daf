"""Measures of signals once more, from their printed formulas: by loops and scipy's minimiser."""

import math

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import minimize_scalar


def root_mean_square(time, values):
    """The mean over time: a sample stands for the way to its neighbours' middles, those at the ends twice."""
    largest = np.abs(values).max()
    if largest == 0:
        return 0.0
    before, after = 2 * time[0] - time[1], 2 * time[-1] - time[-2]
    edges = (np.array([before, *time]) + np.array([*time, after])) / 2
    area = math.fsum(np.diff(edges) * (values / largest) ** 2)
    return largest * math.sqrt(area / (edges[-1] - edges[0]))


def tube_share(time, m, c, width=0.002):
    """Share of samples in the tube about a polyline: its corners and ends within each window."""
    reach, height, inside = width * (time[-1] - time[0]), width * (m.max() - m.min()), 0
    for t, value in zip(time, c, strict=True):
        first, last = max(time[0], t - reach), min(time[-1], t + reach)
        near = [*m[(first <= time) & (time <= last)], *np.interp([first, last], time, m)]
        inside += min(near) - height <= value <= max(near) + height
    return inside / time.size


def shift_between(time, a, b, rates, reach):
    """The delay of b after a, s: least sum of the logarithms of the residuals' variances.

    This equals weights inverse to the variances. It is over positions with their rates.
    """
    inner = (time >= time[0] + reach) & (time <= time[-1] - reach)
    curves = {name: CubicHermiteSpline(time, a[name], a[rates[name]]) for name in rates}

    def cost(s):
        residuals = (b[name][inner] - curve(time[inner] - s) for name, curve in curves.items())
        return sum(math.log(np.var(each) + 1e-300) for each in residuals)

    grid = np.linspace(-reach, reach, 401)
    best, step = min(grid, key=cost), grid[1] - grid[0]
    bounds = best - step, best + step
    return float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-14}).x)


def between_events(time, values, at, edges):
    """Linear within each piece between events; nan where a piece has no two samples."""
    edges = np.unique([e for e in edges if time[0] < e <= time[-1]])
    pieces, values_at = np.searchsorted(edges, time, side="right"), np.full(len(at), np.nan)
    for k, t in enumerate(at):
        rows = np.flatnonzero(pieces == np.searchsorted(edges, t, side="right"))
        if t in time:
            values_at[k] = values[time == t][0]
        elif rows.size >= 2:
            row = np.clip(np.sum(time[rows] <= t), 1, rows.size - 1)
            i, j = rows[row - 1], rows[row]
            values_at[k] = values[i] + (values[j] - values[i]) * (t - time[i]) / (time[j] - time[i])
    return values_at
