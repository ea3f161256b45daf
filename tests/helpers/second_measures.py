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
    edges = [
        time[0] - (time[1] - time[0]) / 2,
        *((time[:-1] + time[1:]) / 2),
        time[-1] + (time[-1] - time[-2]) / 2,
    ]
    area = math.fsum((q - p) * (v / largest) ** 2 for p, q, v in zip(edges, edges[1:], values, strict=False))
    return largest * math.sqrt(area / (edges[-1] - edges[0]))


def sprague_geers(time, m, c) -> tuple[float, float, float]:
    """By the formulas as they are printed; an arc cosine near 0 or pi keeps half of the digits."""
    mm, cc, mc = (
        math.fsum((q - p) * (f + g) / 2 for p, q, f, g in zip(time, time[1:], of, of[1:], strict=False))
        for of in ((m * m), (c * c), (m * c))
    )
    magnitude = math.sqrt(cc / mm) - 1
    phase = math.acos(max(-1.0, min(1.0, mc / math.sqrt(mm * cc)))) / math.pi
    return magnitude, phase, math.sqrt(magnitude**2 + phase**2)


def tube_share(time, m, c, width: float = 0.002) -> float:
    """Share of samples in the tube about a polyline: its corners and ends within each window."""
    reach, height, inside = width * (time[-1] - time[0]), width * (m.max() - m.min()), 0
    for t, value in zip(time, c, strict=True):
        first, last = max(time[0], t - reach), min(time[-1], t + reach)
        near = [v for s, v in zip(time, m, strict=True) if first <= s <= last]
        near += np.interp([first, last], time, m).tolist()
        inside += min(near) - height <= value <= max(near) + height
    return inside / time.size


def iso18571(t: np.ndarray, c: np.ndarray) -> dict[str, float]:
    """Scores of ISO/TS 18571 by its printed formulas, with a full table for the warping."""
    n, top = t.size, np.abs(t).max()
    inner, outer = 0.05 * top, 0.5 * top
    corridor = []
    for p, q in zip(t, c, strict=True):
        off = abs(p - q)
        corridor.append(
            1.0 if off <= inner else 0.0 if off >= outer else ((outer - off) / (outer - inner)) ** 2
        )
    most, shift = -math.inf, 0
    for size in range(int(0.2 * n) + 1):
        for late in (size, -size):
            part_t = t[: n - late] if late >= 0 else t[-late:]
            part_c = c[late:] if late >= 0 else c[: n + late]
            if np.ptp(part_t) == 0 or np.ptp(part_c) == 0:
                continue
            alike = np.corrcoef(part_t, part_c)[0, 1]
            if alike > most + 1e-12:
                most, shift = alike, late
    first, second = (t[: n - shift], c[shift:]) if shift >= 0 else (t[-shift:], c[: n + shift])
    band = math.ceil(0.1 * first.size) - 1
    cost = np.full((first.size + 1, first.size + 1), math.inf)
    cost[0, 0], back = 0.0, {}
    for i in range(1, first.size + 1):
        for j in range(max(1, i - band), min(first.size, i + band) + 1):
            steps = [
                (cost[i - 1, j - 1], 0, (i - 1, j - 1)),
                (cost[i - 1, j], 1, (i - 1, j)),
                (cost[i, j - 1], 2, (i, j - 1)),
            ]
            best = min(steps)
            cost[i, j], back[i, j] = best[0] + (second[j - 1] - first[i - 1]) ** 2, best[2]
    at, off, total = (first.size, first.size), 0.0, 0.0
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
    scores["overall"] = 0.4 * scores["corridor"] + 0.2 * (
        scores["phase"] + scores["magnitude"] + scores["slope"]
    )
    return scores


def shift_between(time, a: dict, b: dict, rates: dict, reach: float) -> float:
    """By how much b is later than a, s: least sum of the logarithms of the residuals' variances.

    That is what weights inverse to the variances amount to. Over positions with their rates.
    """
    inner = (time >= time[0] + reach) & (time <= time[-1] - reach)
    curves = {name: CubicHermiteSpline(time, a[name], a[rates[name]]) for name in rates}

    def cost(s):
        return sum(
            math.log(np.var(b[name][inner] - curve(time[inner] - s)) + 1e-300)
            for name, curve in curves.items()
        )

    grid = np.linspace(-reach, reach, 401)
    best = grid[np.argmin([cost(s) for s in grid])]
    step = grid[1] - grid[0]
    found = minimize_scalar(
        cost, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-14}
    )
    return float(found.x)


def between_events(time, values, at, edges) -> np.ndarray:
    """Linear within each piece between events; nan where a piece has no two samples."""
    edges = sorted({e for e in edges if time[0] < e <= time[-1]})
    found = np.full(len(at), np.nan)

    def piece(t):
        return sum(e <= t for e in edges)

    pieces = [piece(t) for t in time]
    for k, t in enumerate(at):
        if t in time:
            found[k] = values[list(time).index(t)]
            continue
        own = [i for i in range(len(time)) if pieces[i] == piece(t)]
        if len(own) < 2:
            continue
        after = next((n for n, i in enumerate(own) if time[i] > t), len(own) - 1)
        i, j = own[max(after, 1) - 1], own[max(after, 1)]
        found[k] = values[i] + (values[j] - values[i]) * (t - time[i]) / (time[j] - time[i])
    return found
