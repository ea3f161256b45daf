"""Causes of a difference in the physics of the press: friction, gravity, an impact, a missing contact.

A cause shows before the motions of two models part, or in a single run; once they part everything differs.
Results without the channels or events of the press have none of these causes.
"""

from collections.abc import Mapping
from math import isnan, log
from typing import Literal

import numpy as np
import pandas as pd

from comparison.metrics import WINDOW, fit, match, starts_at
from comparison.tables.channels import CONTACTS, CORNERS, Array
from comparison.tables.table import Table
from comparison.verdict.results import Cause, ChannelComparison

Channels = Mapping[str, ChannelComparison]
Tables = tuple[Table, Table]

RIVAL = 3.0
"""Factor of the remainder of the best fit, within which another fit is as good."""
SIGNIFICANT = 3.0
"""Factor of its uncertainty, above which a number is a finding."""
FEW = 5
"""Samples; fewer tell nothing."""

_LEAST = 1e-4  # change of a coefficient, an impact, or ax over ay: errors of usual settings stay below
_SLIDES = 0.1  # of the largest speed, above which friction does not depend on it
_PRESSES = 0.01  # of the largest force, above which noise is not taken for a contact
_FLIGHT = 10  # samples before the first contact, at least
_STEADY = 0.01  # share of a constant in these that may vary: a mass or a length leaves twice as much
_PURE = 0.15  # share of an impact's change, by which it may miss the pattern of its cause
_SAME_CONTACT = 0.02  # share of a crank cycle, within which a contact of the other run is the same one


def friction(results: Channels) -> list[Cause]:
    """Name the coefficient of friction: friction over normal force of sliding corners, in each run."""
    speed = results.get("slider_vy")
    pairs = [(f"corner_{corner}_normal", f"corner_{corner}_friction") for corner in CORNERS]
    corners = [pair for pair in pairs if results.keys() >= {*pair}]
    if speed is None or not corners:
        return []
    sliding = np.abs(speed.a) > _SLIDES * np.abs(speed.a).max()
    sides: list[tuple[float, float]] = []
    for side in ("a", "b"):
        shares = []
        for names in corners:
            normal, tangential = (getattr(results[name], side) for name in names)
            pressed = sliding & (normal > _PRESSES * normal.max())
            shares.append(np.abs(tangential[pressed]) / normal[pressed])
        values = np.concatenate(shares)
        median = float(np.median(values)) if values.size >= FEW else 0.0
        if not median:
            return []
        # Of a normal distribution two standard errors of the median are 3.7 median deviations over root n.
        sides.append((median, 3.7 * float(np.median(np.abs(values - median))) / np.sqrt(values.size)))
    (first, error), (second, its_error) = sides
    ratio = second / first
    uncertainty = ratio * float(np.hypot(error / first, its_error / second))
    if abs(log(ratio)) <= max(SIGNIFICANT * uncertainty / ratio, _LEAST):
        return []
    return [Cause("friction", of_corners(results, "friction"), ratio, uncertainty, values=(first, second))]


def of_corners(results: Channels, part: str) -> tuple[str, ...]:
    """Return the names of a force ("normal" or "friction") at the corners of the results."""
    return tuple(name for corner in CORNERS if (name := f"corner_{corner}_{part}") in results)


def gravity(results: Channels, tables: Tables) -> list[Cause]:
    """Name gravity: before the first contact the slider's ax differs by a part that ay does not explain.

    In flight the guide leaves x free, and rod 4 at the angle beta gives ax = (ay + g) tan(beta). A mass, a
    length or the drive changes the part with ay, which varies; another start shows in x at once.
    """
    x, ax, ay = (results.get(f"slider_{name}") for name in ("x", "ax", "ay"))
    starts = [
        table.events["start"].min() for table in tables if table.events is not None and len(table.events)
    ]
    if x is None or ax is None or ay is None or len(starts) < 2:
        return []
    flight = ax.time < min(starts)
    if flight.sum() < _FLIGHT or not ay.a[flight].any():
        return []
    difference, ay_flight, distance = -ax.difference[flight], ay.a[flight], np.abs(x.difference[flight])
    if np.abs(difference).max() <= _LEAST * np.abs(ay_flight).max() or distance[0] > _STEADY * distance.max():
        return []
    steady = fit(np.zeros(difference.size), difference, moved=True)
    projection = ay_flight * (difference @ ay_flight) / (ay_flight @ ay_flight)
    rest = float(np.sqrt(np.mean((difference - projection) ** 2) / np.mean(difference**2)))
    if steady.rest > min(_STEADY, rest / RIVAL):
        return []
    return [Cause("gravity", ("slider_ax",), steady.offset, steady.offset_error, rest=steady.rest)]


def impact(results: Channels, tables: Tables, period: float | None) -> list[Cause]:
    """Name stiffness or restitution by the first impact, which both enter at one speed.

    A stiffer contact (force K depth^n) multiplies the peak force and divides depth and duration by the same
    factor; the impulse stays. Less loss gives a larger impulse, in a contact that is not longer.
    """
    a, b = (table.events for table in tables)
    if a is None or b is None or period is None or not len(a) or not len(b):
        return []
    window = WINDOW * period
    first = min(a["start"].min(), b["start"].min())
    pairs = [
        (a.iloc[row_a], b.iloc[row_b])
        for row_a, row_b in match(a, b, window)
        if a["start"].iloc[row_a] <= first + window
    ]
    names = ("normal_speed", "impulse", "peak_force", "largest_depth")
    logs = []
    for one, other in pairs:
        sides = [[*map(float, each[[*names]]), float(each["end"] - each["start"])] for each in (one, other)]
        if min(map(min, sides)) <= 0.0:
            return []
        logs.append([log(of_b / of_a) for of_a, of_b in zip(*sides, strict=True)])
    if not logs:
        return []
    speed, impulse, peak, depth, duration = np.array(logs).T
    place, time = str(pairs[0][0]["corner"]), float(first)

    def within(values: Array, size: Array) -> bool:
        return bool((np.abs(values) <= _PURE * np.abs(size)).all())

    def cause(kind: Literal["stiffness", "restitution"], values: Array, error: float) -> list[Cause]:
        ratio = float(np.exp(values.mean()))
        error = ratio * (error + float(np.ptp(values)) / 2)
        return [Cause(kind, of_corners(results, "normal"), ratio, error, time=time, place=place)]

    if min(np.abs(peak)) > _LEAST and all(
        within(v, peak) for v in (speed, impulse, peak + depth, peak + duration)
    ):
        exponent = _exponent(tables[0])
        powers = (peak - depth) / 2 * (exponent + 1)
        return cause("stiffness", powers, float(np.abs(peak + depth).max()) / 2 * (exponent + 1))
    sign = np.sign(impulse[0])
    together = all((np.sign(values) == sign).all() for values in (impulse, peak, depth, -duration))
    if min(np.abs(impulse)) > _LEAST and within(speed, impulse) and together:
        return cause("restitution", impulse, float(np.abs(speed).max()))
    return []


def _exponent(table: Table) -> float:
    scene = table.scene
    return 1.5 if scene is None or scene.is_linkage else float(scene.data["contact"]["exponent"])


def missing_contact(
    results: Channels, tables: Tables, period: float | None, outside_from: float
) -> list[Cause]:
    """Name the contact that only one run has, if the difference begins with it."""
    if isnan(outside_from):
        return []
    time = next(iter(results.values())).time
    step = float(np.median(np.diff(time)))
    window = max(2 * step, _SAME_CONTACT * (period or 0.0))
    for corner in CONTACTS:
        force = results.get(f"corner_{corner}_normal")
        values = (None, None) if force is None else (force.a, force.b)
        spans = [_spans(table.events, corner, time, f) for table, f in zip(tables, values, strict=True)]
        for side, other in ((0, 1), (1, 0)):
            for start, end in spans[side]:
                if not start <= outside_from <= end + 2 * step:
                    continue
                partner = [span for span in spans[other] if abs(span[0] - start) <= window]
                if partner and not _silent(force, side, partner[0]):
                    continue
                return [Cause("contact", side="ab"[other], time=start, place=corner)]
    return []


def _spans(
    events: pd.DataFrame | None, corner: str, time: Array, force: Array | None
) -> list[tuple[float, float]]:
    """Return starts and ends of a corner's contacts, from events or else from samples with a force."""
    if events is not None:
        rows, starts = starts_at(events, corner)
        return list(zip(starts.tolist(), events["end"].to_numpy(np.float64)[rows].tolist(), strict=True))
    if force is None:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], force > 0.0, [False]]).astype(np.int8)))
    return [(float(time[n]), float(time[m - 1])) for n, m in edges.reshape(-1, 2)]


def _silent(force: ChannelComparison | None, side: int, span: tuple[float, float]) -> bool:
    """Return True if a contact has a force in the samples of its run and none in those of the other."""
    if force is None:
        return False
    run_force, other = (force.a, force.b) if side == 0 else (force.b, force.a)
    inside = (force.time > span[0]) & (force.time < span[1]) & (run_force > 0.0)
    return bool(inside.any() and not other[inside].any())
