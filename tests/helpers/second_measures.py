"""Measures of signals once more, from their printed formulas: by loops, full tables and scipy's minimiser."""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import minimize_scalar


def root_mean_square(time: np.ndarray, values: np.ndarray) -> float:
    """Over time: each sample stands for the way to the middle of its neighbours, those at the ends twice."""
    largest = np.abs(values).max()
    if largest == 0:
        return 0.0
    before, after = 2 * time[0] - time[1], 2 * time[-1] - time[-2]
    edges = (np.array([before, *time]) + np.array([*time, after])) / 2
    area = math.fsum(np.diff(edges) * (values / largest) ** 2)
    return largest * math.sqrt(area / (edges[-1] - edges[0]))


def sprague_geers(time, m, c) -> tuple[float, float, float]:
    """By the formulas as they are printed; an arc cosine near 0 or pi keeps half of the digits."""
    mm, cc, mc = (math.fsum(np.diff(time) * (of[1:] + of[:-1]) / 2) for of in (m * m, c * c, m * c))
    magnitude = math.sqrt(cc / mm) - 1
    phase = math.acos(max(-1.0, min(1.0, mc / math.sqrt(mm * cc)))) / math.pi
    return magnitude, phase, math.hypot(magnitude, phase)


def tube_share(time, m, c, width: float = 0.002) -> float:
    """Share of samples in the tube about a polyline: its corners and ends within each window."""
    reach, height, inside = width * (time[-1] - time[0]), width * (m.max() - m.min()), 0
    for t, value in zip(time, c, strict=True):
        first, last = max(time[0], t - reach), min(time[-1], t + reach)
        near = [*m[(first <= time) & (time <= last)], *np.interp([first, last], time, m)]
        inside += min(near) - height <= value <= max(near) + height
    return inside / time.size


def shifted(t, c, late: int):
    """Both signals where they overlap, the second one so many samples late."""
    return (t[: t.size - late], c[late:]) if late >= 0 else (t[-late:], c[: t.size + late])


def iso18571(t: np.ndarray, c: np.ndarray) -> dict[str, float]:
    """Scores of ISO/TS 18571 by its printed formulas, with a full table for the warping."""
    n, top = t.size, np.abs(t).max()
    corridor = np.clip((0.5 * top - np.abs(t - c)) / (0.5 * top - 0.05 * top), 0.0, 1.0) ** 2
    most, shift = -math.inf, 0
    for late in (sign * size for size in range(int(0.2 * n) + 1) for sign in (1, -1)):
        part_t, part_c = shifted(t, c, late)
        if np.ptp(part_t) and np.ptp(part_c):
            alike = np.corrcoef(part_t, part_c)[0, 1]
            if alike > most + 1e-12:
                most, shift = alike, late
    first, second = shifted(t, c, shift)
    size, back = first.size, {}
    band = math.ceil(0.1 * size) - 1
    cost = np.full((size + 1, size + 1), math.inf)
    cost[0, 0] = 0.0
    for i in range(1, size + 1):
        for j in range(max(1, i - band), min(size, i + band) + 1):
            steps = [(i - 1, j - 1), (i - 1, j), (i, j - 1)]
            best, _, back[i, j] = min((cost[step], rank, step) for rank, step in enumerate(steps))
            cost[i, j] = best + (second[j - 1] - first[i - 1]) ** 2
    at, off, total = (size, size), 0.0, 0.0
    while at != (0, 0):
        off, total = off + abs(second[at[1] - 1] - first[at[0] - 1]), total + abs(first[at[0] - 1])
        at = back[at]

    def smooth(signal):
        slope = np.gradient(signal)
        half = [min(4, i, slope.size - 1 - i) for i in range(slope.size)]
        return np.array([slope[i - h : i + h + 1].mean() for i, h in enumerate(half)])

    slope_t, slope_c = smooth(first), smooth(second)
    scores = {
        "corridor": float(np.mean(corridor)),
        "phase": 1 - abs(shift) / (0.2 * n),
        "magnitude": max(0.0, 1 - off / total / 0.5),
        "slope": max(0.0, 1 - np.abs(slope_c - slope_t).sum() / np.abs(slope_t).sum() / 2),
    }
    return scores | {"overall": 0.2 * (sum(scores.values()) + scores["corridor"])}


def shift_between(time, a: dict, b: dict, rates: dict, reach: float) -> float:
    """By how much b is later than a, s: least sum of the logarithms of the residuals' variances.

    That is what weights inverse to the variances amount to. Over positions with their rates.
    """
    inner = (time >= time[0] + reach) & (time <= time[-1] - reach)
    curves = {name: CubicHermiteSpline(time, a[name], a[rates[name]]) for name in rates}

    def cost(s):
        apart = (b[name][inner] - curve(time[inner] - s) for name, curve in curves.items())
        return sum(math.log(np.var(each) + 1e-300) for each in apart)

    grid = np.linspace(-reach, reach, 401)
    best, step = min(grid, key=cost), grid[1] - grid[0]
    bounds = best - step, best + step
    return float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-14}).x)


def between_events(time, values, at, edges) -> np.ndarray:
    """Linear within each piece between events; nan where a piece has no two samples."""
    edges = np.unique([e for e in edges if time[0] < e <= time[-1]])
    pieces, found = np.searchsorted(edges, time, side="right"), np.full(len(at), np.nan)
    for k, t in enumerate(at):
        own = np.flatnonzero(pieces == np.searchsorted(edges, t, side="right"))
        if t in time:
            found[k] = values[time == t][0]
        elif own.size >= 2:
            after = np.clip(np.sum(time[own] <= t), 1, own.size - 1)
            i, j = own[after - 1], own[after]
            found[k] = values[i] + (values[j] - values[i]) * (t - time[i]) / (time[j] - time[i])
    return found
