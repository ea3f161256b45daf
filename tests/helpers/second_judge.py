"""A second judge: every number of a comparison once more, from the written rule alone.

Plain numpy and loops; of the product it uses the data file of the channels and nothing else. Where the
product filters, searches and accumulates, this looks at every pair, window and path; it is slow. The
thresholds are written here as numbers: one that is changed has to be changed twice.
"""

from __future__ import annotations

import math
import tomllib
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import second_measures

K, SHARE = 2.0, 0.99
ALPHA = {"standard": 0.01, "tight": 5e-5}
COVERAGE = {"standard": 0.5, "tight": 0.25}
TAN_BETA = 0.2093
EPS = 2.0**-52

_FILE = Path(__file__).parents[2] / "comparison" / "tables" / "channels.toml"
_DATA = tomllib.loads(_FILE.read_text())


def rules(name: str) -> dict:
    """What the data file says of a channel."""
    if name.startswith("corner_"):
        _, corner, quantity = name.split("_")
        own = dict(_DATA["corner"][quantity])
        if "follows" in own:
            own["follows"] = f"corner_{corner}_{own['follows']}"
        return own
    if name.startswith("reaction_"):
        return _DATA["joint"][name[-1]]
    return _DATA["channel"][name]


def scale_of(name: str, scene: dict, low: float, high: float) -> float:
    """What a difference of a channel is measured by; of a slider with clearance."""
    c, length = scene["clearance"]["slider"], scene["mechanism"]["slider"]["length"]
    hundredth = 60 / abs(scene["drive"]["speed_rpm"]) / 100
    return {
        "clearance": c,
        "clearance of the pin": scene["clearance"]["crank_pin"],
        "clearance*tan_beta": c * TAN_BETA,
        "clearance/length": c / length,
        "clearance/(T/100)": c / hundredth,
        "clearance*tan_beta/(T/100)": c * TAN_BETA / hundredth,
        "clearance/length/(T/100)": c / length / hundredth,
        "range": high - low,
    }[rules(name)["scale"]]


def largest_around(values: np.ndarray, reach: int) -> np.ndarray:
    """The largest of the values at most so many samples away, one window after the other."""
    return np.array([values[max(0, i - reach) : i + reach + 1].max() for i in range(values.size)])


def uncertainty(runs: dict, name: str, period: float, factor: float, order: float) -> np.ndarray:
    """u(t) of one model from its five runs (frames by name), as docs and the module's formula say."""
    base = runs["base"]
    time, s = base["time"].to_numpy(), base[name].to_numpy()
    step = (time[-1] - time[0]) / (time.size - 1)
    reach = 1
    while reach * step < 0.01 * period - 1e-6 * step:  # a hundredth, whichever way it rounds
        reach += 1
    gain = factor**order
    fine = np.abs(s - runs["finer"][name].to_numpy())
    u = np.zeros(s.size)
    d_f = largest_around(fine, reach)
    if "coarser" in runs:
        d_c = largest_around(np.abs(runs["coarser"][name].to_numpy() - s), reach)
        for i in range(s.size):
            safety = 3.0
            if d_f[i] > 0 and d_c[i] > 0:
                seen = math.log(d_c[i] / d_f[i]) / math.log(factor)
                if order - order / 4 <= seen <= order + order / 4:
                    safety = 1.25 * gain / (gain - 1)
            u[i] = safety * max(d_f[i], d_c[i] / gain)
    else:
        u = 3.0 * d_f
    unmoved = runs.get("coarser", base)[name].to_numpy()
    for kind in ("perturbed", "other_perturbed"):
        if kind in runs:
            u = np.maximum(u, 3 * largest_around(np.abs(unmoved - runs[kind][name].to_numpy()), reach))
    steepest = max(abs(b - a) / (q - p) for (a, b), (p, q) in zip(pairwise(s), pairwise(time), strict=True))
    least = max(rules(name)["round_off"], 4 * EPS * np.abs(s).max(), 1e-11 * (time[-1] - time[0]) * steepest)
    return np.maximum(u, least)


def judge_channel(name, time, a, b, u, scale, tier, known=None) -> SimpleNamespace:
    """One channel's numbers and verdict by its uncertainty, sample after sample."""
    counts = {"predictable": 0, "happening": 0, "judged": 0, "outside": 0}
    worst = (-1.0, math.nan, math.nan, math.nan)
    predictable = np.zeros(time.size, bool)
    for i in range(time.size):
        e, happens = a[i] - b[i], not (a[i] == 0 and b[i] == 0)
        predictable[i] = u[i] <= ALPHA[tier] * scale and (known is None or known[i])
        counts["predictable"] += predictable[i]
        counts["happening"] += happens
        if predictable[i] and happens:
            counts["judged"] += 1
            counts["outside"] += abs(e) > K * u[i]
            if abs(e) / (K * u[i]) > worst[0]:
                worst = (abs(e) / (K * u[i]), time[i], e, K * u[i])
    coverage = counts["predictable"] / time.size
    explained = 1 - counts["outside"] / counts["judged"] if counts["judged"] else math.nan
    outside = counts["outside"]
    if max(a.max(), b.max()) - min(a.min(), b.min()) < rules(name)["floor"]:
        verdict = "unexcited"
    elif not counts["judged"] or (coverage < COVERAGE[tier] and outside <= (1 - SHARE) * counts["happening"]):
        verdict = "indeterminate"
    elif outside < 3 and (explained < SHARE or counts["judged"] < 10):
        verdict = "indeterminate"  # too few to differ, or to agree
    else:
        verdict = "differ" if explained < SHARE else "agree"
    if verdict == "indeterminate" and "follows" not in rules(name) and counts["happening"]:
        # Even the largest u of all times explains too few.
        rest = [i for i in range(time.size) if not (a[i] == 0 and b[i] == 0)]
        beyond = [i for i in rest if abs(a[i] - b[i]) > K * u.max()]
        if 1 - len(beyond) / len(rest) < SHARE:
            at = max(range(time.size), key=lambda i: abs(a[i] - b[i]))
            verdict, explained, outside = "differ", math.nan, len(beyond)
            worst = (math.nan, time[at], a[at] - b[at], K * u.max())
    return SimpleNamespace(
        verdict=verdict,
        predictable=predictable,
        coverage=coverage,
        explained=explained,
        outside=outside,
        worst_time=worst[1],
        worst_difference=worst[2],
        worst_threshold=worst[3],
        max_difference=max(abs(p - q) for p, q in zip(a, b, strict=True)),
        rms_difference=second_measures.root_mean_square(time, a - b),
        scale=scale,
        u=u,
    )


def judge_by_tolerance(name, time, a, b, scale, tolerance, share=1.0) -> SimpleNamespace:
    """One channel's numbers and verdict by a tolerance that holds for so large a share of the samples."""
    counts, worst = {"judged": 0, "outside": 0}, (-1.0, math.nan, math.nan)
    for t, p, q in zip(time, a, b, strict=True):
        if p == 0 and q == 0:
            continue
        counts["judged"] += 1
        counts["outside"] += abs(p - q) > tolerance * scale
        if abs(p - q) > worst[0]:
            worst = (abs(p - q), t, p - q)
    explained = 1 - counts["outside"] / counts["judged"] if counts["judged"] else math.nan
    if max(a.max(), b.max()) - min(a.min(), b.min()) < rules(name)["floor"]:
        verdict = "unexcited"
    elif not counts["judged"]:
        verdict = "indeterminate"
    else:
        verdict = "differ" if explained < share else "agree"
    return SimpleNamespace(
        verdict=verdict,
        coverage=1.0,
        explained=explained,
        outside=counts["outside"],
        worst_time=worst[1],
        worst_difference=worst[2],
        worst_threshold=tolerance * scale if counts["judged"] else math.nan,
        max_difference=max(abs(p - q) for p, q in zip(a, b, strict=True)),
        rms_difference=second_measures.root_mean_square(time, a - b),
        scale=scale,
    )


def judge(runs_a: dict, runs_b: dict, scene: dict, tier: str, levels: tuple) -> SimpleNamespace:
    """All channels of two models' runs on one grid, and the scene's verdict and coverage.

    ``levels`` holds factor and order of either model's refinement.
    """
    period = 60 / abs(scene["drive"]["speed_rpm"])
    base_a, base_b = runs_a["base"], runs_b["base"]
    time, found = base_a["time"].to_numpy(), {}
    names = [name for name in base_a if name != "time"]
    for name in sorted(names, key=lambda name: "follows" in rules(name)):
        a, b = base_a[name].to_numpy(), base_b[name].to_numpy()
        u = np.array(
            [
                math.sqrt(p * p + q * q)
                for p, q in zip(
                    uncertainty(runs_a, name, period, *levels[0]),
                    uncertainty(runs_b, name, period, *levels[1]),
                    strict=True,
                )
            ]
        )
        scale = scale_of(name, scene, min(a.min(), b.min()), max(a.max(), b.max()))
        before = found.get(rules(name).get("follows"))
        known = None if before is None else before.predictable
        found[name] = judge_channel(name, time, a, b, u, scale, tier, known)
    excited = [of for of in found.values() if of.verdict != "unexcited"]
    covered = [0.0 if math.isnan(of.explained) else of.coverage for of in excited]
    coverage = sum(covered) / len(covered) if covered else math.nan
    verdicts = {of.verdict for of in excited}
    if "differ" in verdicts:
        verdict = "differ"
    elif "agree" in verdicts and coverage >= COVERAGE[tier]:
        verdict = "agree"
    else:
        verdict = "indeterminate"
    return SimpleNamespace(channels=found, verdict=verdict, coverage=coverage)


# Impacts


def pair_up(a, b, window: float) -> list[tuple[int, int]]:
    """Contacts of one corner that are each other's nearest, earlier ones first, at most a window apart."""

    def nearest(row, rows):
        same = [other for other in rows if other["corner"] == row["corner"]]
        return min(same, key=lambda o: (abs(o["start"] - row["start"]), o["start"]))["n"] if same else None

    rows_a, rows_b = (
        [
            {"n": n, "corner": c, "start": s}
            for n, (c, s) in enumerate(zip(of["corner"], of["start"], strict=True))
        ]
        for of in (a, b)
    )
    pairs = []
    for row in rows_a:
        other = nearest(row, rows_b)
        if other is None or nearest(rows_b[other], rows_a) != row["n"]:
            continue
        if abs(rows_b[other]["start"] - row["start"]) <= window:
            pairs.append((row["n"], other))
    return sorted(pairs, key=lambda pair: (rows_a[pair[0]]["start"], pair[0]))


def impacts(a, b, window: float, within_a=None, within_b=None) -> dict[str, float]:
    """The metrics of impacts by their definitions; ``within``: of each contact, whether it is considered."""
    pairs = pair_up(a, b, window)
    within_a = [True] * len(a) if within_a is None else list(within_a)
    within_b = [True] * len(b) if within_b is None else list(within_b)
    pairs = [(i, j) for i, j in pairs if within_a[i] or within_b[j]]
    rows_a = {i for i in range(len(a)) if within_a[i]} | {i for i, _ in pairs}
    rows_b = {j for j in range(len(b)) if within_b[j]} | {j for _, j in pairs}
    column_a, column_b = (
        {name: of[name].tolist() for name in ("start", "normal_speed", "impulse", "peak_force")}
        for of in (a, b)
    )

    def apart(name):
        return [abs(column_a[name][i] - column_b[name][j]) for i, j in pairs]

    def largest(name):
        most = max([column_a[name][i] for i in rows_a] + [column_b[name][j] for j in rows_b], default=0)
        return max(apart(name)) / most if pairs and most > 0 else math.nan

    total_a = math.fsum(column_a["impulse"][i] for i in rows_a)
    total_b = math.fsum(column_b["impulse"][j] for j in rows_b)
    mean = (total_a + total_b) / 2
    delays = sorted(apart("start"))
    half = len(delays) // 2
    return {
        "pairs": pairs,
        "count_a": len(rows_a),
        "count_b": len(rows_b),
        "precision": len(pairs) / len(rows_b) if rows_b else math.nan,
        "recall": len(pairs) / len(rows_a) if rows_a else math.nan,
        "largest_delay": delays[-1] if delays else math.nan,
        "median_delay": (delays[half] + delays[-half - 1]) / 2 if delays else math.nan,
        "normal_speed_error": largest("normal_speed"),
        "total_impulse_error": abs(total_a - total_b) / mean if mean > 0 else math.nan,
        "impulse_error": math.fsum(apart("impulse")) / mean if pairs and mean > 0 else math.nan,
        "peak_force_error": largest("peak_force"),
    }


def begins_in(events, time, mask_of_corner: dict) -> list[bool]:
    """Of each contact, whether the samples on both sides of its start are in its corner's mask."""
    found = []
    for corner, start in zip(events["corner"], events["start"], strict=True):
        after = 1
        while after < len(time) - 1 and time[after] < start:
            after += 1
        mask = mask_of_corner.get(corner)
        found.append(mask is not None and bool(mask[after - 1]) and bool(mask[after]))
    return found
