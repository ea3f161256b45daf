"""A model with a known answer and error, in place of a simulation; the gravity selects its behaviour.

The tests copy this file to a folder as ``reference_model`` and as ``exudyn_model``, so that worker processes
import it under these names.
"""

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np

GRAVITY = SimpleNamespace(crash=1.0, refuse=2.0, fail=3.0, nan=4.0, differ=6.0, lucky=10.0)
CORNERS = ("ll", "lr", "ul", "ur")
MODEL = __name__.removesuffix("_model")


def signals(scene, error=0.0, stretch=0.0):
    """All channels of a scene as sines of the crank angle.

    ``error`` moves each by up to twice this share of its amplitude, as a numerical error would.
    ``stretch`` is an error that does not depend on settings: a difference of models.
    """
    if "body" in scene:
        return linkage_signals(scene, error, stretch)
    per_cycle = scene["output"]["samples_per_cycle"]
    period = 60.0 / abs(scene["drive"]["speed_rpm"])
    count = round(scene["drive"]["cycles"] * per_cycle)
    t = np.arange(count + 1) * (period / per_cycle)
    phase = 2 * np.pi * t / period
    w = 2 * np.pi / period
    c = scene["clearance"]["slider"]
    half = scene["mechanism"]["slider"]["length"] / 2
    size = (1 + stretch) + error * (1 + np.cos(phase))
    x, vx, ax = c * size * np.sin(phase), c * size * w * np.cos(phase), -c * size * w * w * np.sin(phase)
    columns = {
        "time": t,
        "slider_x": scene["mechanism"]["guide_x"] + x,
        "slider_y": 0.1 * np.cos(phase) + 0.2 * x,
        "slider_angle": x / half,
        "slider_vx": vx,
        "slider_vy": -0.1 * w * np.sin(phase) + 0.2 * vx,
        "slider_omega": vx / half,
    }
    if "accelerations" in scene["output"]["groups"]:
        columns |= {"slider_ax": ax, "slider_ay": 0.2 * ax, "slider_alpha": ax / half}
    if "corners" in scene["output"]["groups"] and scene["joints"]["crank_pin"] == "clearance":
        path = scene["clearance"]["crank_pin"] * np.exp(1j * phase) * size
        columns |= {"journal_x": path.real, "journal_y": path.imag}
    if "corners" in scene["output"]["groups"] and scene["joints"]["slider"] == "clearance":
        for corner in ("ll", "lr", "ul", "ur"):
            inside = np.maximum(np.sin(phase) - 0.5, 0.0) * size
            columns[f"corner_{corner}_gap"] = c * (0.5 - np.sin(phase) * size)
            columns[f"corner_{corner}_normal"] = 40.0 * inside
            columns[f"corner_{corner}_friction"] = -6.0 * inside
    if "joints" in scene["output"]["groups"]:
        columns |= {f"reaction_{joint}_{axis}": 50.0 * np.sin(phase) for joint in "OABHCF" for axis in "xy"}
        columns["crank_torque"] = np.cos(phase)
        if scene["joints"]["slider"] == "ideal":
            columns |= {"guide_force": np.cos(phase), "guide_moment": np.cos(phase)}
    if "energy" in scene["output"]["groups"]:
        parts = ("drive", "gravity", "kinetic", "contact", "damping", "friction", "residual")
        loaded = scene["load"]["force"] or scene["load"]["table"]
        columns |= {f"energy_{part}": 0.0 * t for part in (*parts, *(["load"] if loaded else []))}
    return columns


def linkage_signals(scene, error, stretch):
    """The motion of all bodies of a linkage as if each turned about the origin, from where it starts."""
    drive, output = scene["drive"], scene["output"]
    turn = 2 * np.pi * drive.get("cycles", 1.0)
    t = np.linspace(0.0, output.get("duration", 1.0), output.get("samples", 1000) + 1)
    if "speed_rpm" in drive:
        period = 60.0 / abs(drive["speed_rpm"])
        count = round(drive["cycles"] * output["samples_per_cycle"])
        t = np.arange(count + 1) * (period / output["samples_per_cycle"])
    w, columns = turn / t[-1], {"time": t}
    for body in scene["body"]:
        start = np.radians(scene["initial"].get(body, {}).get("angle_deg", 0.0))
        size = (1 + stretch) + error * (1 + np.cos(w * t))
        point = size * np.exp(1j * (w * t + start))
        rates = [1j * w * point, -w * w * point]
        parts = {"": (point, w * t + start), "v": (rates[0], w + 0 * t), "a": (rates[1], error * np.sin(t))}
        for kind, (place, angle) in parts.items():
            if kind != "a" or "accelerations" in output["groups"]:
                name = {"": "angle", "v": "omega", "a": "alpha"}[kind]
                columns |= {
                    f"{body}.{kind}x": place.real,
                    f"{body}.{kind}y": place.imag,
                    f"{body}.{name}": angle,
                }
    for name, clearance in scene.get("clearance", {}).items() if "contacts" in output["groups"] else ():
        size = clearance["size"] * ((1 + stretch) + error * (1 + np.cos(w * t)))
        inside = np.maximum(np.sin(w * t) - 0.5, 0.0) * (1 + stretch + error)
        forces = {"normal": 40.0 * inside, "friction": -6.0 * inside}
        if "journal_radius" in clearance:
            columns |= {f"{name}.x": size * np.cos(w * t), f"{name}.y": size * np.sin(w * t)}
        for place in [f"{name}."] if "journal_radius" in clearance else [f"{name}.{c}_" for c in CORNERS]:
            columns |= {f"{place}{force}": values for force, values in forces.items()}
            columns |= {f"{place}gap": size * (0.5 - np.sin(w * t))} if place.endswith("_") else {}
    return columns


def sensitivity(scene):
    """An error of up to 1e-5 by the direction of a start's shift; zero for that of a perturbed run."""
    offset = abs(scene["initial"]["slider_offset"] - 5e-5)
    arc = abs(scene["initial"]["slider_angle"] * scene["mechanism"]["slider"]["length"])
    return 1e-5 * (offset - arc) / (offset + arc) if offset + arc else 0.0


def simulate(scene, *, progress=None):
    gravity = scene["environment"]["gravity"]
    if log := os.environ.get("SIXBAR_TEST_LOG"):
        with Path(log).open("a") as file:
            file.write(f"{MODEL} {gravity} {os.environ.get('OMP_NUM_THREADS')} {os.getpid()}\n")
    if MODEL == "truth_press":
        error = 0.0
    elif MODEL == "reference":
        error = 10 * scene["solver"]["reference"]["tolerance"]
    elif scene["solver"]["exudyn"]["formulation"] == "tree":
        error = 10 * scene["solver"]["exudyn"]["tolerance"]
    else:
        error = 1e6 * scene["solver"]["exudyn"]["step"] ** 2
    if progress:
        progress(0.5)
    # A journal in its bearing moves the slider; so it does in both models.
    joints = scene.get("joints", {"crank_pin": "", "slider": ""})
    stretch = 1e-2 if joints["crank_pin"] == "clearance" else 0.0
    # A guide that holds the slider changes its motion, too.
    stretch += 2e-2 if joints["slider"] == "ideal" else 0.0
    stretch += sensitivity(scene) if gravity == GRAVITY.lucky else 0.0
    status, remedy = "success", ""
    if MODEL == "exudyn":
        match gravity:
            case GRAVITY.crash:
                os._exit(3)
            case GRAVITY.refuse:
                raise ValueError("contact.law = 'foundation' is not simulated yet")
            case GRAVITY.fail:
                status, remedy = "newton-failed", "try a smaller step"
        stretch += {GRAVITY.differ: 1e-3, GRAVITY.lucky: 3e-6}.get(gravity, 0.0)
    columns = signals(scene, error, stretch)
    if gravity == GRAVITY.nan and MODEL == "exudyn":
        columns["slider_vy"][7] = np.nan
    end = min(0.02, float(columns["time"][-1]))
    contact = {"start": 0.5 * end, "end": end, "normal_speed": 0.1, "impulse": 0.02}
    contact |= {"peak_force": 40.0, "largest_depth": 1e-6}
    items = scene.get("clearance", {}).items()
    places = [name if "journal_radius" in gap else f"{name}.ul" for name, gap in items if "body" in scene]
    places = places if "body" in scene else ["ll"]
    return SimpleNamespace(
        columns=columns,
        events={"corner": np.array(places)}
        | {name: np.full(len(places), value) for name, value in contact.items()},
        extrema={name: {"min": values.min(), "max": values.max()} for name, values in columns.items()},
        provenance={"model": MODEL, "counters": {"steps": 5}},
        status=status,
        remedy=remedy,
    )
