"""What stands in the page: the fits, and what runs say of radius, gravity and reference line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import exp, radians, sqrt

import numpy as np
import pandas as pd

from comparison.formatting import number, percent, quantity
from comparison.scene import load_scene
from comparison.studies.identification.facts import (
    BASE,
    UNKNOWNS,
    shipped_geometry,
    shown,
    table_1,
    vibration,
)
from comparison.studies.identification.fitting import Fit, Profile, residuals
from comparison.studies.identification.kinematics import TOPOLOGIES, motion
from comparison.studies.identification.radius import fit_radius, radius_words
from comparison.studies.identification.runs import (
    CASES,
    CHANNELS,
    GRAVITIES,
    GRAVITY,
    PRINTED_RANGES,
    RUNNER_UP,
    Runs,
)
from comparison.studies.shared.frames import markdown, rows_table
from comparison.studies.shared.published import published
from comparison.tables.table import Table

LISTED = 8
FINE = 7201
"""Crank angles of the closed form where instants are read from it, 0.05 degrees apart."""
DECISIVE = 3.0
"""Factor between two misfits from which on the peaks decide; scenes scatter by 2 about their mean."""
_metres, _two = partial(quantity, unit="m"), partial(number, digits=2)


def of_fits(fits: Sequence[Fit], facts: pd.DataFrame, profiles: Sequence[Profile]) -> dict[str, object]:
    """Return what the page says of the fits, by the names in its template."""
    best, second = fits[:2]
    shipped = shipped_geometry()
    off = np.array(shipped) - np.array(best.geometry)
    misses = residuals(shipped, best.topology, facts, facts["allowance"].to_numpy())
    velocities = ((2, "F14c-vy"), (3, "F14c-vy2"))
    possible = [all(_excess(each.shown[n], row) == 0 for n, row in velocities) for each in fits]
    compared = facts.assign(best=best.shown, second=second.shown, shipped=shown(shipped, best.topology)[1])
    return {
        "finding": f"Of {len(fits)} arrangements the best fits the printed figures with a misfit of "
        f"{number(best.misfit, 2)} allowances, the second with {number(second.misfit, 2)}.",
        "count": len(fits),
        "best": best.topology,
        "second": second.topology,
        "facts": rows_table(
            {
                "": str(word),
                "taken from the print": f"{fact['value']:.6g} {fact['unit']}".rstrip(),
                "allowance": number(fact["allowance"], 2),
                "best": f"{fact['best']:.6g}",
                "second": f"{fact['second']:.6g}",
                "shipped geometry": f"{fact['shipped']:.6g}",
            }
            for word, fact in compared.iterrows()
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
        "distance": number(sqrt(float(off @ np.linalg.pinv(best.covariance) @ off)), 2),
        "shipped_misfit": number(sqrt(float(np.sum(misses**2)) / 2), 2),
        "possible": sum(possible),
        "bounds": rows_table(
            {"": str(facts.index[place]), "Fig. 14c": f"{published(row).value} m/s"}
            | {f"{n + 1}. by misfit": _inside(each.shown[place], row) for n, each in enumerate(fits[:4])}
            for place, row in velocities
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
    excess = _excess(value, row)
    judged = f"**{1e3 * abs(excess):.0f} mm/s too {'large' if excess > 0 else 'small'}**"
    return f"{value:.3f} m/s, {judged if excess else 'possible'}"


def _excess(value: float, row: str) -> float:
    """Return by how much an ideal velocity is larger than the published one, m/s; 0 where it is possible."""
    printed = published(row)
    excess = abs(value) - abs(printed.value)
    return 0.0 if -vibration() - printed.rounding <= excess <= printed.rounding else excess


def _bottom(best: Fit) -> dict[str, str]:
    """Return when the slider is at its lowest, and for how long the print cannot distinguish it."""
    printed = published("S4.2-stroke")
    lengths, speed = table_1()
    angle = np.linspace(0.0, 2 * np.pi, FINE)
    crank = radians(best.shown[0]) + best.topology.crank * angle
    y = motion(best.geometry, best.topology, lengths, crank).F.imag
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


def of_runs(runs: Runs) -> dict[str, object]:
    """Return what the page says of the runs, by the names in its template."""
    fitted = fit_radius(runs.by_radius)
    radii = runs.by_radius.assign(**{"geometric mean": np.exp(np.log(runs.by_radius).mean(axis=1))})
    ranges = pd.concat([pd.DataFrame(PRINTED_RANGES, ["published"]), runs.ranges.rename(_metres)])
    misfits = np.exp(np.sqrt((np.log(runs.ratios) ** 2).mean(axis=1)))
    shown_as = [f"{name}, {letter}" for name in CASES for letter in CHANNELS.values()]
    gravity = runs.ratios.loc[[GRAVITY, RUNNER_UP]].set_axis(shown_as, axis=1)
    presses = [f"{'first' if key == GRAVITY else 'second'}, {value:g} m/s²" for key, value in gravity.index]
    names = ("up", "none", "down", "runner_up_turned", "runner_up_none", "runner_up")
    named = dict(zip(names, misfits[gravity.index], strict=True))
    central = [", ".join(map(_two, runs.ratios[BASE].loc[(GRAVITY, value)].tolist())) for value in GRAVITIES]
    return {
        "check": rows_table(
            {"largest difference to the closed form": model} | _differences(run)
            for model, run in runs.ideal.items()
        ),
        "radius": markdown(
            radii.rename_axis("corner radius").reset_index(),
            {"corner radius": _metres, **dict.fromkeys(CASES, _two), "geometric mean": number},
        ),
        **radius_words(fitted),
        "gravity": markdown(
            gravity.assign(**{"press and gravity": presses, "misfit": misfits}),
            {"press and gravity": str, **dict.fromkeys([*shown_as, "misfit"], _two)},
        ),
        "offset": markdown(
            ranges.rename_axis("reference offset").reset_index(),
            {"reference offset": str, **dict.fromkeys(PRINTED_RANGES, partial(_metres, digits=4))},
        ),
        **{name: number(misfit, 2) for name, misfit in named.items()},
        "decided_down": decision({"the second": named["runner_up"], "the first": named["down"]}),
        "decided_none": decision({"the second": named["runner_up_none"], "the first": named["none"]}),
        "decided_gravity": decision(
            {"gravity downwards": named["down"], "no gravity": named["none"], "gravity upwards": named["up"]}
        ),
        "central_none": central[1],
        "central_down": central[2],
        **_offset(runs.ranges),
    }


def decision(misfits: Mapping[str, float]) -> str:
    """Say which of several the peaks exclude: those that miss them `DECISIVE` times as much as the best."""
    most = DECISIVE * min(misfits.values())
    excluded = [name for name, misfit in misfits.items() if misfit >= most]
    return f"the peaks exclude {' and '.join(excluded)}" if excluded else "the peaks do not decide"


def _differences(run: Table) -> dict[str, str]:
    """Compare a model's run of the ideal press with the closed form of this study at the shipped geometry."""
    lengths, speed = table_1()
    crank = radians(run.provenance["scene"]["mechanism"]["crank_angle_deg"]) + speed * run.time
    here = motion(shipped_geometry(), TOPOLOGIES[0], lengths, crank)
    return {
        word: quantity(float(np.abs(run.values(channel) - expected).max()), unit, 2)
        for word, channel, expected, unit in (
            ("y", "slider_y", here.F.imag, "m"),
            ("velocity", "slider_vy", speed * here.velocity, "m/s"),
            ("acceleration", "slider_ay", speed**2 * here.acceleration, "m/s^2"),
        )
    }


def _offset(ranges: pd.DataFrame) -> dict[str, str]:
    """Return the offset from the x range, and those at which the y errors' ends would meet the print."""
    low, high = PRINTED_RANGES["x, lowest"], PRINTED_RANGES["x, highest"]
    used = ranges.loc[load_scene("paper").data["mechanism"]["reference_offset"]]
    clearance = load_scene(BASE).data["clearance"]["slider"]
    tangent = shown(shipped_geometry(), TOPOLOGIES[0])[1][-1]
    met = {}
    for side in ("highest", "lowest"):
        slope, at_zero = np.polyfit(ranges.index.to_numpy(np.float64), ranges[f"y error, {side}"], 1)
        offset = (PRINTED_RANGES[f"y error, {side}"] - at_zero) / slope if slope else np.nan
        met[f"offset_{side}"] = quantity(offset, "m", 2)
    return {
        "quotient": percent(1 - used["y error, highest"] / -used["x, lowest"] / tangent),
        "centre": quantity(-0.5 * (low + high), "m"),
        "width": quantity(high - low, "m", 4),
        "printed_excess": quantity(0.5 * (high - low) - clearance, "m", 2),
        "excess": quantity(0.5 * (used["x, highest"] - used["x, lowest"]) - clearance, "m", 2),
    } | met
