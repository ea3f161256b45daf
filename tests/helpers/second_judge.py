"""A second judge: every number of a comparison once more, from the written rule alone.

Of the product it uses the data file of the channels and nothing else; where that filters, searches and
accumulates, this looks at every pair and window. The thresholds are written here as numbers: one that is
changed has to be changed twice.
"""

import math
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import second_measures

K, SHARE = 2.0, 0.99
ALPHA = {"standard": 0.01, "tight": 5e-5}
COVERAGE = {"standard": 0.5, "tight": 0.25}
TAN_BETA = 0.2093

_DATA = tomllib.loads((Path(__file__).parents[2] / "comparison" / "tables" / "channels.toml").read_text())


def rules(name):
    """The data file's entry of a channel."""
    if name.startswith("corner_"):
        _, corner, quantity = name.split("_")
        entry = dict(_DATA["corner"][quantity])
        if "follows" in entry:
            entry["follows"] = f"corner_{corner}_{entry['follows']}"
        return entry
    return _DATA["joint"][name[-1]] if name.startswith("reaction_") else _DATA["channel"][name]


def scale_of(name, scene, low, high):
    """The scale of a channel's differences, of a slider with clearance."""
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


def uncertainty(runs, name, period, factor, order, weight=1.0):
    """u(t) of one model from its five runs (frames by name), as docs and the module's formula say.

    ``weight`` is ten where u of its gap counts ten times.
    """
    time, at = runs["base"]["time"].to_numpy(), {kind: frame[name].to_numpy() for kind, frame in runs.items()}
    s, step = at["base"], (time[-1] - time[0]) / (time.size - 1)
    reach = 1
    while reach * step < 0.01 * period - 1e-6 * step:  # a hundredth, whichever way it rounds
        reach += 1

    def around(a, b):
        """The largest distance within reach of each sample."""
        distance = np.pad(np.abs(a - b), reach)  # no distance is less than 0
        return np.lib.stride_tricks.sliding_window_view(distance, 2 * reach + 1).max(axis=1)

    d_f, gain = around(s, at["finer"]), factor**order
    u = 3.0 * d_f
    if "coarser" in at:
        d_c = around(at["coarser"], s)
        for i in range(s.size):
            exponent = math.log(d_c[i] / d_f[i]) / math.log(factor) if d_f[i] > 0 and d_c[i] > 0 else math.inf
            in_order = order - order / 4 <= exponent <= order + order / 4
            # Below the order the observed ratio counts, after Richardson; at least that of the two distances.
            ratio = max(1.0, d_c[i] / d_f[i] - 1.0) if exponent < order - order / 4 else gain
            u[i] = (1.25 * gain / (gain - 1) if in_order else 3.0) * max(d_f[i], d_c[i] / ratio)
    kinds = {"perturbed", "other_perturbed"} & at.keys()
    if kinds:
        d_t = np.max([around(at.get("coarser", s), at[kind]) for kind in kinds], axis=0)
        kappa = 0.0
        for i in range(s.size):  # as far as the run's own error has come
            kappa = max(kappa, min(1.0, d_f[i] / d_t[i]) if d_t[i] > 0 else float(d_f[i] > 0))
            u[i] = max(u[i], 3 * kappa * d_t[i])
    steepest = np.abs(np.diff(s) / np.diff(time)).max()
    round_off = max(rules(name)["round_off"], 4 * 2.0**-52 * np.abs(s).max())
    u = np.maximum(u, max(round_off, 1e-11 * (time[-1] - time[0]) * steepest))
    gap = rules(name).get("follows", "")
    if gap.endswith("gap") and gap in runs["base"]:
        near = np.abs(runs["base"][gap].to_numpy()) <= weight * uncertainty(runs, gap, period, factor, order)
        for i in np.flatnonzero(near & (s == 0)):  # it may touch
            u[i] = max(u[i], np.abs(s).max())
    return u


def parting_time(time, known, window):
    """The start of the first unpredictable stretch longer than a window, less a window at either end."""
    if not known.any():
        return time[0]
    since = None
    for i in range(int(known.argmax()), time.size):
        if known[i]:
            since = None
        elif since is None:
            since = i
        if since is not None and (i + 1 == time.size or known[i + 1]):
            least = 0.999999 * window  # samples that are a window apart up to the rounding of times count
            inner = [time[k] for k in range(since, i + 1) if time[k] - time[since] >= least]
            inner = [t for t in inner if time[i] - t >= least]
            if inner and inner[-1] - inner[0] > window:
                return time[since]
    return time[-1]


def judge_channel(name, time, a, b, scale, threshold, share, predictable=None, coverage=0.0, largest=0.0):
    """One channel's numbers and verdict: differences against thresholds, where it is predictable.

    By a tolerance all samples are, and there is no ``predictable``. ``largest`` is the largest 2 u.
    """
    by_tolerance, happens, e = predictable is None, (a != 0) | (b != 0), a - b
    predictable = np.full(time.size, True) if by_tolerance else predictable
    rows = [i for i in range(time.size) if predictable[i] and happens[i]]
    outside = sum(abs(e[i]) > threshold[i] for i in rows)
    worst = max(rows, key=lambda i: abs(e[i]) / (1.0 if by_tolerance else threshold[i]), default=None)
    portion = predictable.mean()
    explained = 1 - outside / len(rows) if rows else math.nan
    if max(a.max(), b.max()) - min(a.min(), b.min()) < rules(name)["floor"]:
        verdict = "unexcited"
    elif not rows or (portion < coverage and outside <= (1 - SHARE) * happens.sum()):
        verdict = "indeterminate"
    elif not by_tolerance and outside < 3 and (explained < share or len(rows) < 10):
        verdict = "indeterminate"  # too few to differ, or to agree
    else:
        verdict = "differ" if explained < share else "agree"
    worst_threshold = math.nan if worst is None else threshold[worst]
    if not by_tolerance and verdict == "indeterminate" and "follows" not in rules(name) and happens.any():
        # Even the largest u of all times explains too few.
        count = (np.abs(e[happens]) > largest).sum()
        if 1 - count / happens.sum() < SHARE:
            verdict, explained, outside = "differ", math.nan, count
            worst, worst_threshold = int(np.abs(e).argmax()), largest
    return SimpleNamespace(
        verdict=verdict,
        predictable=predictable,
        coverage=portion,
        explained=explained,
        outside=outside,
        worst_time=math.nan if worst is None else time[worst],
        worst_difference=math.nan if worst is None else e[worst],
        worst_threshold=worst_threshold,
        max_difference=np.abs(e).max(),
        rms_difference=second_measures.root_mean_square(time, e),
        scale=scale,
        u=threshold / K,
    )


def judge(runs_a, runs_b, scene, tier, levels):
    """All channels of two models' runs on one grid, and the scene's verdict and coverage.

    ``levels`` holds factor and order of either model's refinement.
    """
    period, channels = 60 / abs(scene["drive"]["speed_rpm"]), {}
    base_a, base_b = runs_a["base"], runs_b["base"]
    names = [name for name in base_a if name != "time"]
    for name in sorted(names, key=lambda name: "follows" in rules(name)):
        a, b = base_a[name].to_numpy(), base_b[name].to_numpy()
        position = channels.get(rules(name).get("follows"))
        weight = 1.0 if position is None else position.weight
        each = (
            uncertainty(runs, name, period, *level, weight)
            for runs, level in zip((runs_a, runs_b), levels, strict=True)
        )
        u = np.sqrt(sum(part**2 for part in each))
        scale = scale_of(name, scene, min(a.min(), b.min()), max(a.max(), b.max()))
        known = u <= ALPHA[tier] * scale
        if position is not None:
            known &= position.predictable
        time, largest = base_a["time"].to_numpy(), K * u.max()
        weight = np.where(time > parting_time(time, known, period / 100), 10.0, 1.0)
        u *= weight
        known &= u <= ALPHA[tier] * scale
        arguments = (scale, K * u, SHARE, known, COVERAGE[tier], largest)
        channels[name] = judge_channel(name, time, a, b, *arguments)
        channels[name].weight = weight
    results = [channel for channel in channels.values() if channel.verdict != "unexcited"]
    portions = [0.0 if math.isnan(channel.explained) else channel.coverage for channel in results]
    coverage = sum(portions) / len(portions) if portions else math.nan
    verdicts = {channel.verdict for channel in results}
    agree = "agree" in verdicts and coverage >= COVERAGE[tier]
    verdict = "differ" if "differ" in verdicts else "agree" if agree else "indeterminate"
    return SimpleNamespace(channels=channels, verdict=verdict, coverage=coverage)


# Impacts


def pair_up(a, b, window):
    """Contacts of one corner that are each other's nearest, earlier ones first, at most a window apart."""
    rows_a, rows_b = (list(zip(table["corner"], table["start"], strict=True)) for table in (a, b))

    def nearest(row, rows):
        gaps = [(abs(start - row[1]), start, n) for n, (corner, start) in enumerate(rows) if corner == row[0]]
        return min(gaps)[2] if gaps else None

    pairs = [(i, j) for i, row in enumerate(rows_a) if (j := nearest(row, rows_b)) is not None]
    close = [(i, j) for i, j in pairs if abs(rows_a[i][1] - rows_b[j][1]) <= window]
    return sorted(
        [(i, j) for i, j in close if nearest(rows_b[j], rows_a) == i], key=lambda pair: rows_a[pair[0]][1]
    )


def impacts(a, b, window, within_a=None, within_b=None):
    """The metrics of impacts by their definitions; ``within`` flags the contacts that count."""
    within_a = [True] * len(a) if within_a is None else within_a
    within_b = [True] * len(b) if within_b is None else within_b
    pairs = [(i, j) for i, j in pair_up(a, b, window) if within_a[i] or within_b[j]]
    rows_a = {i for i in range(len(a)) if within_a[i]} | {i for i, _ in pairs}
    rows_b = {j for j in range(len(b)) if within_b[j]} | {j for _, j in pairs}

    def distances(name):
        return [abs(a[name].iloc[i] - b[name].iloc[j]) for i, j in pairs]

    def each(name):
        return [a[name].iloc[i] for i in rows_a], [b[name].iloc[j] for j in rows_b]

    def largest(name):
        most = max([*each(name)[0], *each(name)[1]], default=0)
        return max(distances(name)) / most if pairs and most > 0 else math.nan

    total_a, total_b = map(math.fsum, each("impulse"))
    mean = (total_a + total_b) / 2
    delays = distances("start")
    return {
        "pairs": pairs,
        "count_a": len(rows_a),
        "count_b": len(rows_b),
        "precision": len(pairs) / len(rows_b) if rows_b else math.nan,
        "recall": len(pairs) / len(rows_a) if rows_a else math.nan,
        "largest_delay": max(delays, default=math.nan),
        "median_delay": np.median(delays) if delays else math.nan,
        "normal_speed_error": largest("normal_speed"),
        "total_impulse_error": abs(total_a - total_b) / mean if mean > 0 else math.nan,
        "impulse_error": math.fsum(distances("impulse")) / mean if pairs and mean > 0 else math.nan,
        "peak_force_error": largest("peak_force"),
    }


def begins_in(events, time, mask_of_corner):
    """A flag for each contact: the samples on both sides of its start are in its corner's mask."""
    inside = []
    for corner, start in zip(events["corner"], events["start"], strict=True):
        after = min(max(int(np.sum(time < start)), 1), len(time) - 1)
        mask = mask_of_corner.get(corner)
        inside.append(mask is not None and bool(mask[after - 1] and mask[after]))
    return inside
