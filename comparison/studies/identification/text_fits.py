"""What the page says of the fits."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, radians, sqrt

import numpy as np

from comparison.formatting import number, percent, table
from comparison.studies.identification.facts import (
    UNITS,
    UNKNOWNS,
    WORDS,
    Facts,
    shipped_geometry,
    shown,
    vibration,
)
from comparison.studies.identification.fitting import Fit, Profile, residuals
from comparison.studies.identification.kinematics import Lengths, motion
from comparison.studies.shared.published import published

LISTED = 8
FINE = 7201
"""Crank angles of the closed form where instants are read from it, 0.05 degrees apart."""


def of_kinematics(
    fits: Sequence[Fit], facts: Facts, profiles: Sequence[Profile], lengths: Lengths, speed: float
) -> dict[str, str]:
    """Return what the page says of the fits, by the names in its template."""
    best, second = fits[:2]
    shipped = shipped_geometry()
    values = shown(shipped, best.topology, lengths, speed)[1]
    off = np.array(shipped) - np.array(best.geometry)
    distance = sqrt(float(off @ np.linalg.pinv(best.covariance) @ off))
    with_shipped = residuals(shipped, best.topology, lengths, speed, facts, facts.allowances)
    return {
        "count": str(len(fits)),
        "facts": table(
            ("", "taken from the print", "allowance", "best", "second", "shipped geometry"),
            [
                [
                    WORDS[n],
                    f"{facts.values[n]:.6g} {UNITS[n]}".removesuffix(" 1"),
                    number(facts.allowances[n], 2),
                    *(f"{each[n]:.6g}" for each in (best.shown, second.shown, values)),
                ]
                for n in range(len(WORDS))
            ],
        ),
        "best": str(best.topology),
        "second": str(second.topology),
        "ranking": table(
            ("topology", "H (mm)", "line of the slider (mm)", "misfit", "misses, in roundings of the print"),
            [_ranked(each, facts) for each in fits[:LISTED]],
        ),
        "unknowns": table(
            ("", "best", "standard deviation", "two deviations by the profile", "shipped"),
            [
                [
                    UNKNOWNS[n],
                    _mm(best.geometry[n]),
                    _mm(sqrt(best.covariance[n, n])),
                    " … ".join(_mm(end) for end in profiles[n].two_sigma),
                    _mm(shipped[n]),
                ]
                for n in range(len(UNKNOWNS))
            ],
        ),
        "vibration": f"{1e3 * vibration():.1f}",
        "second_chance": percent(exp(-0.5 * float(np.sum(second.residuals**2)))),
        "distance": number(distance, 2),
        "shipped_misfit": number(sqrt(float(np.sum(with_shipped**2)) / 2), 2),
        "bounds": table(
            ("", "Fig. 14c", *(f"{n}. by misfit" for n in range(1, 5))),
            [
                [
                    WORDS[n],
                    f"{published(row).value} m/s",
                    *(_inside(each.shown[n], row) for each in fits[:4]),
                ]
                for n, row in ((2, "F14c-vy"), (3, "F14c-vy2"))
            ],
        ),
        "bottom": _bottom(best, lengths, speed),
    }


def _ranked(each: Fit, facts: Facts) -> list[str]:
    misses = each.residuals * facts.allowances / facts.roundings
    return [
        str(each.topology),
        f"({1e3 * each.geometry.pivot_x:.1f}, {1e3 * each.geometry.pivot_y:.1f})",
        f"{1e3 * each.geometry.guide:.1f}",
        number(each.misfit, 2),
        ", ".join(number(miss, 2) for miss in misses),
    ]


def _inside(value: float, row: str) -> str:
    """Say whether an ideal velocity can have become the published one by what the clearance adds."""
    printed = published(row)
    beyond = abs(value) - abs(printed.value)
    if beyond > printed.rounding:
        told = f"**{1e3 * beyond:.0f} mm/s beyond**"
    elif -beyond > vibration() + printed.rounding:
        told = f"**{-1e3 * beyond:.0f} mm/s short**"
    else:
        told = "possible"
    return f"{value:.3f} m/s, {told}"


def _bottom(best: Fit, lengths: Lengths, speed: float) -> str:
    """Say when the slider is at its lowest, and how long it is there as far as the print can tell."""
    printed = published("S4.2-stroke")
    turn = best.topology.crank * np.linspace(0.0, 2 * np.pi, FINE)
    y = motion(best.geometry, best.topology, lengths, radians(best.shown[0]) + turn).F.imag
    time = np.abs(turn) / speed
    period = time[-1]
    fall = y - y[0]
    low = time[np.abs(fall - printed.value) <= printed.rounding] + period
    there = float(np.interp(printed.time - period, time, fall))
    return (
        f"The lowest point comes at {time[y.argmin()] + period:.4f} s of the second turn. Any time from "
        f"{low[0]:.4f} to {low[-1]:.4f} s has a displacement that prints as {printed.value} m; "
        f"at the printed {printed.time} s it is {there:.5f} m."
    )


def _mm(value: float) -> str:
    return f"{1e3 * value:.2f} mm"
