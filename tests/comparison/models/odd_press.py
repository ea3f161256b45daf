"""A model that plays a sine; its error goes with its tolerance. `solver.odd.what` says what it does wrong."""

import sys
from types import SimpleNamespace

import numpy as np


def even(scene, *, progress=None):
    return simulate(scene, progress=progress, name="even")


def simulate(scene, *, progress=None, name="odd"):
    own = scene["solver"].get(name, {})
    what = own.get("what", "")
    scene["drive"]["speed_rpm"] = 1.0  # of its own copy
    match what:
        case "exits":
            sys.exit(4)
        case "prints":
            print("hello")  # noqa: T201
        case "no share":
            progress(float("nan"))
        case "nothing":
            return None
        case "no ideal" if scene["output"]["groups"]:
            raise ValueError("only the motion is available")
    t = np.arange(101) * 0.004
    names = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
    size = 1 + own.get("tolerance", 0.0) + own.get("bias", 0.0)
    columns = {"time": t} | {name: size * (1.1 + np.sin(5 * np.pi * t + n)) for n, name in enumerate(names)}
    if what == "one more":
        columns["slider_z"] = t
    contact = {"corner": ["ll"], "start": [0.1], "end": [0.2], "largest_depth": [1e-6]}
    contact |= {"normal_speed": [1.0], "impulse": [1.0], "peak_force": [1.0]}
    record = {"mass": t} if what == "arrays" else {}
    return SimpleNamespace(
        columns=columns, events=contact, extrema={}, provenance=record, status="success", remedy=""
    )
