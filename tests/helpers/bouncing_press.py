"""Scenes as the judge returns them, of a made-up press: a mass that bounces between two walls."""

from dataclasses import fields, replace
from functools import cache
from math import cos, pi, sin

import numpy as np
import pandas as pd

from comparison.accuracy.uncertainty import Runs
from comparison.metrics import Pulse
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.compare import compare
from comparison.verdict.results import Attribution

PERIOD = 0.4  # s
CLEARANCE = 2e-4  # m
CYCLES, SAMPLES = 2, 1000  # samples a cycle
START = 5.3184808e-5  # m
STEPS = 40  # a sample: 1e-5 s
MASS = 0.17  # kg
STIFFNESS = 1.9e7  # N/m: contacts of 0.3 ms
GROUPS = ["accelerations", "corners"]
RECORD = {
    "formulation": "two degrees of freedom", "integrator": "dop853", "settings": {"tolerance": 1e-9},
    "versions": {"numpy": "2.4.6"}, "platform": "Linux-x86_64", "wall_time_s": 2.34, "status": "success",
    "counters": {"steps": 123456, "rhs": 1523456},
}  # fmt: skip


@cache
def bounce(start, drift):
    """Integrate a mass between two walls under a reversing force.

    Returns x, vx, ax, left and right wall force at the samples, shape (5, n), and the contacts;
    ``drift`` (m/s) is the error of the integrator.
    """
    step = PERIOD / SAMPLES / STEPS
    x, v, depth = start, 0.0, 0.0
    rows, contacts = [], []
    touch = impact = impulse = peak = 0.0
    for k in range(CYCLES * SAMPLES * STEPS + 1):
        t = k * step
        over, side = abs(x) - CLEARANCE, 1.0 if x > 0 else -1.0
        force = 0.0
        if over > 0.0:
            if depth == 0.0:
                # A loss that depends on the instant of touch spreads neighbouring runs as a tilt does.
                v *= 0.8 + 0.2 * sin(2e5 * (t - over / max(side * v, 1e-9)))
                touch, impact, impulse, peak = t, max(side * v, 1e-4), 0.0, 0.0
            depth = max(depth, over)
            force = STIFFNESS * over * (1.0 + 0.5 * max(-1.0, min(1.0, side * v / impact)))
            impulse += force * step
            peak = max(peak, force)
        elif depth > 0.0:
            contacts.append(("lr" if x > 0 else "ll", touch, t, impact, impulse, peak, depth))
            depth = 0.0
        a = (12.0 * cos(2 * pi * t / PERIOD + 0.4) - side * force) / MASS
        if k % STEPS == 0:
            rows.append((x, v, a, force * (x < 0), force * (x > 0)))
        v += a * step
        x += (v + drift) * step
    names = ["corner", "start", "end", "normal_speed", "impulse", "peak_force", "largest_depth"]
    return np.array(rows).T, pd.DataFrame(contacts, columns=names)


def columns_of(run, time):
    """Every channel from the bouncing mass: the others follow from its motion or stay zero."""
    x, v, a, left, right = run
    phase = 2 * pi * time / PERIOD
    side = 0.2 * np.sin(phase)
    zero = np.zeros_like(time)
    columns = {
        "slider_x": x - 0.55,
        "slider_y": 0.112 * np.cos(phase) - 0.3 + side * x,
        "slider_angle": x / 0.09,
        "slider_vx": v,
        "slider_vy": -1.7 * np.sin(phase) + side * v,
        "slider_omega": v / 0.09,
        "slider_ax": a,
        "slider_ay": -27.0 * np.cos(phase) + side * a,
        "slider_alpha": a / 0.09,
    }
    for corner, sign, force in (("ll", 1, left), ("lr", -1, right), ("ul", 1, zero), ("ur", -1, zero)):
        columns[f"corner_{corner}_gap"] = CLEARANCE + sign * x
        columns[f"corner_{corner}_normal"] = force
        columns[f"corner_{corner}_friction"] = -0.15 * force * np.sign(np.cos(phase))
    return columns


def make_scene(name="press", alter=lambda columns: columns, tier="standard"):
    """Return a scene judged at a tier; ``alter`` changes the second model's result."""
    time = np.arange(CYCLES * SAMPLES + 1) * (PERIOD / SAMPLES)
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": float(CYCLES), "output.groups": GROUPS})
    families = []
    for model, drift, change in (("reference", 0.0, dict), ("exudyn", 1e-14, alter)):
        record = {"model": model, **RECORD}
        tables = []
        for shift in (0.0, 1e-12):  # the neighbour stands for the finer run: their distance is u
            run, events = bounce(START + shift, drift)
            columns = change({"time": time} | columns_of(run, time))
            tables.append(Table(pd.DataFrame(columns), events, provenance=record))
        families.append(Runs(*tables))
    comparison = compare(*families, scene=scene, labels=("reference", "exudyn"), tier=tier)
    return replace(
        comparison,
        name=name,
        title="A made-up press, 2 cycles",
        description="A mass between two walls under a reversing force.",
        command=f"sixbar validate {name}",
        run_scene=scene,
        attribution=Attribution(explained=0.99996),
        causes=(),
    )


def stretch(channel, times):
    n = times * (len(channel.time) - 1) + 1
    arrays = {
        field.name: np.resize(getattr(channel, field.name), n)
        for field in fields(channel)
        if isinstance(getattr(channel, field.name), np.ndarray)
    }
    return replace(channel, **(arrays | {"time": np.arange(n) * channel.time[1]}))


def half_sines(scene):
    """Contacts resolved in time, as a linear spring gives them: half a sine up to the event table's peak."""
    first, second = (
        []
        if events is None
        else [
            Pulse(row, phase * (end - start), peak * np.sin(np.pi * phase))
            for row, (start, end, peak) in enumerate(
                events[["start", "end", "peak_force"]].itertuples(index=False)
            )
        ]
        for phase in [np.linspace(0.0, 1.0, 25)]
        for events in scene.events
    )
    return first, second
