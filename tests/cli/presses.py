"""Models with a known answer, as another package would bring them (docs/engine.md): quick and obedient.

Keys of ``[solver.alpha]``: ``tolerance``, a tenth of the error, and ``does``, the fault.
"""

import os
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from fake_model import signals

FAILURES = {
    "fail": ("newton-failed", "try a smaller step"),
    "violate": ("invariant-violated", "open-depth: corner ul is 2e-07 m inside its wall"),
}


def motion(scene, error, does):
    """The motion of `fake_model`, moved with the start, so that neighbouring runs are neighbours."""
    columns, x = signals(scene, error, 1e-3 * (does == "differ")), scene["initial"]["slider_offset"]
    columns["slider_x"] += x
    columns["slider_y"] += 0.2 * x
    columns["slider_angle"] += scene["initial"]["slider_angle"] + x / 0.035
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
        status, remedy = FAILURES.get(does, ("success", ""))
        columns = motion(scene, 10 * settings.get("tolerance", 1e-9), does)
        scene["drive"]["speed_rpm"] = 1.0  # the scene is its own copy
        end = float(columns["time"][-1])
        contact = {"start": 0.25 * end, "end": 0.3 * end, "normal_speed": 0.1, "impulse": 0.02}
        contact |= {"peak_force": 40.0, "largest_depth": 1e-6}
        return SimpleNamespace(
            columns=columns,
            events={"corner": np.array(["ll"])} | {key: np.array([value]) for key, value in contact.items()},
            extrema={c: {"min": v.min(), "max": v.max()} for c, v in columns.items() if c != "time"},
            provenance={"model": name, "counters": {"steps": columns["time"] if does == "arrays" else 5}},
            status=status,
            remedy=remedy,
        )

    simulate.settings = {"tolerance": 1e-9, "does": "agree"}
    return simulate


alpha, beta, gamma = model("alpha"), model("beta"), model("gamma")
