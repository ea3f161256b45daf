"""A model that plays a sine; its error goes with its tolerance. `solver.odd.what` says what it does wrong."""

import sys
from types import SimpleNamespace

import numpy as np


def even(scene, *, progress=None):
    return simulate(scene, progress=progress, name="even")


def simulate(scene, *, progress=None, name="odd"):
    del progress
    own = scene["solver"].get(name, {})
    what = own.get("what", "")
    scene["drive"]["speed_rpm"] = 1.0  # of its own copy
    if what == "raises":
        raise KeyError("no\nsuch thing")
    if what == "exits":
        sys.exit(4)
    if what == "refuses":
        raise ValueError("joints.slider = 'clearance' is beyond this model")
    if what == "prints":
        print("hello")  # noqa: T201
    t = np.arange(101) * 0.004
    phase = 5 * np.pi * t
    names = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
    size = 1 + own.get("tolerance", 0.0) + own.get("bias", 0.0)
    columns = {"time": t} | {name: size * (1.1 + np.sin(phase + n)) for n, name in enumerate(names)}
    contact = {
        "corner": ["ll"],
        "start": [0.1],
        "end": [0.2],
        "normal_speed": [1.0],
        "impulse": [1.0],
        "peak_force": [1.0],
        "largest_depth": [1e-6],
    }
    run = {
        "columns": columns,
        "events": contact,
        "extrema": {},
        "provenance": {},
        "status": "success",
        "remedy": "",
    }
    if what == "no channel":
        del columns["slider_vy"]
    if what == "one more":
        columns["slider_z"] = t
    if what == "not finite":
        columns["slider_y"][5] = np.nan
    if what == "uneven":
        columns["slider_y"] = columns["slider_y"][:-1]
    if what == "short":
        run["columns"] = {name: values[:-3] for name, values in columns.items()}
    if what == "no contacts' end":
        del contact["end"]
    if what == "elsewhere":
        contact["corner"] = ["roof"]
    if what == "nan contact":
        contact["impulse"] = [float("nan")]
    if what == "no events":
        del run["events"]
    if what == "list":
        run["columns"] = list(columns.values())
    if what == "arrays":
        run["provenance"] = {"mass": t}
    if what == "zeros":
        contact |= {"impulse": [0.0], "peak_force": [0.0]}
    if what == "status":
        run |= {"status": "stalled", "remedy": "push it"}
    if what == "no ideal" and not scene["output"]["groups"] == []:
        raise ValueError("only the motion is available")
    return None if what == "nothing" else SimpleNamespace(**run)
