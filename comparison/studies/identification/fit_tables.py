"""What stands in the page of the fits."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, radians, sqrt

import numpy as np
import pandas as pd

from comparison.formatting import number, percent
from comparison.studies.identification.facts import UNKNOWNS, shipped_geometry, shown, table_1, vibration
from comparison.studies.identification.fitting import Fit, Profile, residuals
from comparison.studies.identification.kinematics import motion
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.published import published

LISTED = 8
FINE = 7201
"""Crank angles of the closed form where instants are read from it, 0.05 degrees apart."""


def of_fits(fits: Sequence[Fit], facts: pd.DataFrame, profiles: Sequence[Profile]) -> dict[str, object]:
    """Return what the page says of the fits, by the names in its template."""
    best, second = fits[:2]
    shipped = shipped_geometry()
    values = shown(shipped, best.topology)[1]
    off = np.array(shipped) - np.array(best.geometry)
    distance = sqrt(float(off @ np.linalg.pinv(best.covariance) @ off))
    misses = residuals(shipped, best.topology, facts, facts["allowance"].to_numpy())
    return {
        "count": len(fits),
        "best": best.topology,
        "second": second.topology,
        "facts": rows_table(
            {
                "": str(word),
                "taken from the print": f"{fact['value']:.6g} {fact['unit']}".rstrip(),
                "allowance": number(fact["allowance"], 2),
                "best": f"{of_best:.6g}",
                "second": f"{of_second:.6g}",
                "shipped geometry": f"{of_shipped:.6g}",
            }
            for (word, fact), of_best, of_second, of_shipped in zip(
                facts.iterrows(), best.shown, second.shown, values, strict=True
            )
        ),
        "ranking": rows_table(_ranked(each, facts) for each in fits[:LISTED]),
        "unknowns": rows_table(
            {
                "": name,
                "best": _mm(best.geometry[n]),
                "standard deviation": _mm(sqrt(best.covariance[n, n])),
                "two deviations by the profile": " … ".join(map(_mm, profiles[n].two_sigma)),
                "shipped": _mm(shipped[n]),
            }
            for n, name in enumerate(UNKNOWNS)
        ),
        "vibration": f"{1e3 * vibration():.1f}",
        "second_chance": percent(exp(-0.5 * float(np.sum(second.residuals**2)))),
        "distance": number(distance, 2),
        "shipped_misfit": number(sqrt(float(np.sum(misses**2)) / 2), 2),
        "bounds": rows_table(
            {"": word, "Fig. 14c": f"{published(row).value} m/s"}
            | {f"{n + 1}. by misfit": _inside(each.shown[place], row) for n, each in enumerate(fits[:4])}
            for word, place, row in (("lowest velocity", 2, "F14c-vy"), ("highest velocity", 3, "F14c-vy2"))
        ),
    } | _bottom(best)


def _ranked(each: Fit, facts: pd.DataFrame) -> dict[str, str]:
    misses = each.residuals * facts["allowance"] / facts["rounding"]
    x, y, guide = (f"{1e3 * value:.1f}" for value in each.geometry)
    return {
        "topology": str(each.topology),
        "H (mm)": f"({x}, {y})",
        "line of the slider (mm)": guide,
        "misfit": number(each.misfit, 2),
        "misses, in roundings of the print": ", ".join(number(miss, 2) for miss in misses),
    }


def _inside(value: float, row: str) -> str:
    """Return an ideal velocity, and whether what the clearance adds can have made it the published one."""
    printed = published(row)
    excess = abs(value) - abs(printed.value)
    judged = "possible"
    if excess > printed.rounding:
        judged = f"**{1e3 * excess:.0f} mm/s too large**"
    elif -excess > vibration() + printed.rounding:
        judged = f"**{-1e3 * excess:.0f} mm/s too small**"
    return f"{value:.3f} m/s, {judged}"


def _bottom(best: Fit) -> dict[str, str]:
    """Return when the slider is at its lowest, and for how long the print cannot distinguish it."""
    printed = published("S4.2-stroke")
    lengths, speed = table_1()
    angle = np.linspace(0.0, 2 * np.pi, FINE)
    start = radians(best.shown[0])
    y = motion(best.geometry, best.topology, lengths, start + best.topology.crank * angle).F.imag
    fall, time = y - y[0], (angle + angle[-1]) / speed
    low = time[np.abs(fall - printed.value) <= printed.rounding]
    return {
        "lowest_at": f"{time[y.argmin()]:.4f}",
        "low_from": f"{low[0]:.4f}",
        "low_to": f"{low[-1]:.4f}",
        "printed_fall": f"{printed.value}",
        "printed_at": f"{printed.time}",
        "fall_there": f"{np.interp(printed.time, time, fall):.5f}",
    }


def _mm(value: float) -> str:
    return f"{1e3 * value:.2f} mm"
