"""The section about contacts without error control: one mass, one impact of five bodies, and the map."""

from __future__ import annotations

from functools import partial
from math import exp, log10, pi

import numpy as np
import pandas as pd

from comparison.formatting import number, quantity
from comparison.scene import load_scene
from comparison.studies.extremes.impact import restitution
from comparison.studies.extremes.step_stability.contacts import LOOSE
from comparison.studies.extremes.step_stability.fixed_steps import (
    METHODS,
    SPECTRAL_RADIUS,
    Method,
    rebounds,
    spectral_radius,
)
from comparison.studies.shared.frames import Columns, crossed, largest, markdown, rows_table
from comparison.tables.arrays import Array

ALL_PHASES = np.linspace(0.005, 1.0, 200)
WRONG = 0.1
"""Above it a point of the map is reported as wrong."""
_FREQUENCIES = (0.1, 1.0, 10.0, 100.0, 1e4)
_PER_CONTACT = (100.0, 30.0, 10.0, 5.0, 3.0, 2.0, 1.0, 0.5, 0.1, 0.01)
"""Steps in an exact contact."""
_CLASSES = (0.0, 0.5, 2.0, 5.0, 10.0, 20.0, 400.0)
"""Steps per contact, of the comparison of the table of contacts with the motion."""
_two = partial(number, digits=2)


def values(impacts: pd.DataFrame, points: pd.DataFrame) -> dict[str, object]:
    """Return what stands in the template, from what `contacts.run_impacts` and `contacts.run_map` return."""
    gone = impacts[impacts["status"] != "success"]
    stopped, ran = points[points["status"] != "success"], points[points["status"] == "success"]
    wrong = ran[ran["wrong"].abs() > WRONG]
    fastest = largest(ran, "speed")
    e = restitution(load_scene("150rpm-0.2mm").data["contact"]["restitution"])
    rigid = {name: rebounds(method, 1e4, ALL_PHASES).max() for name, method in METHODS.items()}
    bounds = [
        f"{name}: {_two(_least_steps(method, 1.0))} without loss in the law, "
        f"{_two(_least_steps(method, 1 / e))} with the scene's restitution"
        for name, method in METHODS.items()
    ]
    helped = [
        f"{(of == 'success').sum()} of {len(of)} of {name}" for name, of in gone.groupby("method")["loosened"]
    ]
    return {
        "linear": rows_table(
            {"method": name} | {f"w h = {wh:g}": f"{spectral_radius(method, wh):.6f}" for wh in _FREQUENCIES}
            for name, method in METHODS.items()
        ),
        "radius": f"{SPECTRAL_RADIUS:g}",
        "phases": len(ALL_PHASES),
        "one_mass": rows_table(
            _one_mass(name, method, count) for name, method in METHODS.items() for count in _PER_CONTACT
        ),
        "rigid": ", ".join(f"{number(most)} ({name})" for name, most in rigid.items()),
        "restitution": number(e, 4),
        "bounds": "; ".join(bounds),
        "five_bodies": rows_table(_five_bodies(of) for _, of in impacts.groupby(["method", "step"])),
        "impacts": len(impacts),
        "gone": len(gone),
        "kinds": ", ".join(sorted(set(gone["status"]))) or "none",
        "loose": f"{LOOSE:g}",
        "helped": " and ".join(helped) or "none",
        "events": _events(impacts[impacts["status"] == "success"]),
        "maps": "\n\n".join(f"{name}:\n\n{_map(of)}" for name, of in points.groupby("method")),
        "stopped": len(stopped),
        "points": len(points),
        "stopped_below": _two(stopped["count"].max()),
        "wrong": len(wrong),
        "wrong_by": f"{WRONG:.0%}",
        "either_below": _two(pd.concat([stopped, wrong])["count"].max()),
        "decades": round(log10(points["modulus"].max() / points["modulus"].min())),
        "worst": f"{fastest['method']}, {quantity(fastest['step'], 's')}, {fastest['modulus']:.0e} Pa, "
        f"{_two(fastest['count'])} steps per contact",
        "times": _two(fastest["speed"]),
    }


def growth(of: Array) -> float:
    """Return the geometric mean of rebounds: what a long row of impacts at random phases grows by, each."""
    return exp(float(np.mean(np.log(of))))


def _least_steps(method: Method, allowed: float) -> float:
    """Return the steps per contact below which the growth per impact exceeds what is allowed."""
    counts = np.geomspace(0.05, 20.0, 500)
    grows = [growth(rebounds(method, pi / n, ALL_PHASES)) > allowed * (1 + 1e-3) for n in counts]
    return float(counts[np.flatnonzero(grows)[-1]])


def _one_mass(name: str, method: Method, count: float) -> dict[str, str]:
    of = rebounds(method, pi / count, ALL_PHASES)
    sizes = {"least": of.min(), "mean": of.mean(), "largest": of.max(), "growth per impact": growth(of)}
    first = {"method": name, "steps per contact": f"{count:g}", "w h": number(pi / count)}
    return first | {heading: f"{size:.4f}" for heading, size in sizes.items()}


def _five_bodies(impacts: pd.DataFrame) -> dict[str, str]:
    """Return how far the rebounds of five bodies are from those of one mass, by one method and step."""
    failed = impacts.loc[impacts["status"] != "success", "wh"]
    return {
        "method": impacts["method"].iloc[0],
        "step": quantity(impacts["step"].iloc[0], "s"),
        "w h": f"{number(impacts['wh'].min())} … {number(impacts['wh'].max())}",
        "impacts": str(len(impacts)),
        "largest difference from one mass": _two((impacts["rebound"] - impacts["theory"]).abs().max()),
        "largest rebound": number(impacts["rebound"].max()),
        "failed": f"{len(failed)}, w h from {number(failed.min())}" if len(failed) else "none",
    }


def _events(ran: pd.DataFrame) -> str:
    """Hold the table of contacts against the motion: largest sizes, by steps per contact."""
    differences = {
        "rebound less 1": ran["rebound"] - 1,
        "table's impulse / (m v) less (1 + rebound)": ran["impulse"] - ran["rebound"],
        "table's speed / v less 1": ran["touch"] - 1,
    }
    classes = pd.cut(pi / ran["wh"], _CLASSES, right=False).rename("steps per contact")
    sizes = pd.DataFrame(differences).abs().groupby(classes, observed=True).max()[::-1]
    first: Columns = {"steps per contact": lambda each: f"{each.left:g} … {each.right:g}"}
    return markdown(sizes.reset_index(), first | dict.fromkeys(sizes, _two))


def _map(points: pd.DataFrame) -> str:
    """Return error and steps per contact of each run of a method, the stiffest wall first."""
    points = points.sort_values("modulus", ascending=False, kind="stable")
    cells = [
        f"{_two(run['wrong'])} ({_two(run['count'])})"
        if run["status"] == "success"
        else f"{run['status']} at {quantity(run['until'], 's', 2)} ({_two(run['count'])})"
        for run in points.to_dict("records")
    ]
    moduli = [f"{modulus:.0e}" for modulus in points["modulus"]]
    return crossed("modulus (Pa)", moduli, [quantity(step, "s") for step in points["step"]], cells)
