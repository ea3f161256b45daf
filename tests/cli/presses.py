"""Models with a known answer, as another package would bring them (docs/engine.md): quick and obedient.

Keys of ``[solver.alpha]``: ``tolerance``, of which ten times are the error, and ``does``, what goes wrong.
"""

import os
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np

STOPPED = {
    "fail": ("newton-failed", "try a smaller step"),
    "violate": ("invariant-violated", "open-depth: corner ul is 2e-07 m inside its wall"),
}


def motion(scene, error, does):
    per_cycle, drive = scene["output"]["samples_per_cycle"], scene["drive"]
    period = 60 / abs(drive["speed_rpm"])
    t = np.arange(round(drive["cycles"] * per_cycle) + 1) * period / per_cycle
    w, clearance, half = 2 * np.pi / period, scene["clearance"]["slider"], 0.035
    # As the error of a method: it depends on the time, and vanishes with the tolerance.
    size = 1 + error * (1 + np.cos(w * t)) + (1e-3 if does == "differ" else 0)
    # A start that is moved is followed, so that neighbouring runs are neighbours.
    x = clearance * size * np.sin(w * t) + scene["initial"]["slider_offset"]
    vx, ax = clearance * size * w * np.cos(w * t), -clearance * size * w**2 * np.sin(w * t)
    columns = {
        "time": t,
        "slider_x": scene["mechanism"]["guide_x"] + x,
        "slider_y": 0.1 * np.cos(w * t) + 0.2 * x,
        "slider_angle": scene["initial"]["slider_angle"] + x / half,
        "slider_vx": vx,
        "slider_vy": -0.1 * w * np.sin(w * t) + 0.2 * vx,
        "slider_omega": vx / half,
    }
    if "accelerations" in scene["output"]["groups"]:  # as reliability has them
        columns |= {
            "slider_ax": ax,
            "slider_ay": -0.1 * w**2 * np.cos(w * t) + 0.2 * ax,
            "slider_alpha": ax / half,
        }
    if does == "nan":
        columns["slider_vy"][7] = np.nan
    if does == "lacks":
        del columns["slider_omega"]
    return {name: values[: -3 if does == "short" else None] for name, values in columns.items()}


def model(name):
    def simulate(scene, *, progress=None):
        settings = scene["solver"].get(name, {})
        does = settings.get("does", "agree")
        if log := os.environ.get("PRESSES_LOG"):
            with Path(log).open("a") as file:
                file.write(f"{name} {does} {os.getpid()} {scene['output']}\n")
            if progress:
                progress(0.5)
        if does == "die":
            os._exit(3)
        if does == "nothing":
            return None
        if does == "print":
            print("hello")  # noqa: T201
            progress(float("nan"))
        if does == "refuse" or (does == "free" and scene["joints"]["slider"] == "ideal"):
            raise ValueError("contact.law = 'hertz-corners' is not simulated yet")
        if does == "bug":
            raise RuntimeError("index out of\nrange")
        while does == "hang":
            time.sleep(0.05)
        status, remedy = STOPPED.get(does, ("success", ""))
        columns = motion(scene, 10 * settings.get("tolerance", 1e-9), does)
        scene["drive"]["speed_rpm"] = 1.0  # of its own copy
        end = float(columns["time"][-1])
        contact = {"start": 0.25 * end, "end": 0.3 * end, "normal_speed": 0.1, "impulse": 0.02}
        contact |= {"peak_force": 40.0, "largest_depth": 1e-6}
        return SimpleNamespace(
            columns=columns,
            events={"corner": np.array(["ll"])} | {key: np.array([of]) for key, of in contact.items()},
            extrema={c: {"min": v.min(), "max": v.max()} for c, v in columns.items() if c != "time"},
            provenance={"model": name, "counters": {"steps": columns["time"] if does == "arrays" else 5}},
            status=status,
            remedy=remedy,
        )

    simulate.settings = {"tolerance": 1e-9, "does": "agree"}
    return simulate


alpha, beta, gamma = model("alpha"), model("beta"), model("gamma")
