"""Each sample is the state that docs/model.md gives there: accelerations, forces, reactions, energies.

The page's equations in 15 coordinates are closed at the sample's slider and solved with the contacts of the
table; a mirrored press has the other branches, the other sense of rotation and walls on the other side.
"""

import numpy as np
import pytest
from page_engine import Engine, at_time
from page_formulas import CORNERS

from comparison.scene import load_scene
from comparison.tables.channels import channels

PAPER = load_scene("150rpm-0.2mm").data["mechanism"]
SPEED = load_scene("150rpm-0.2mm").data["drive"]["speed_rpm"]
PIVOT_X, PIVOT_Y = PAPER["rocker_pivot"]
ABOUT_Y = {
    "drive.speed_rpm": -SPEED,
    "mechanism.rocker_branch": -PAPER["rocker_branch"],
    "mechanism.rocker_pivot": [-PIVOT_X, PIVOT_Y],
    "mechanism.crank_angle_deg": 180.0 - PAPER["crank_angle_deg"],
    "mechanism.guide_x": -PAPER["guide_x"],
}
ABOUT_X = {
    "drive.speed_rpm": -SPEED,
    "mechanism.rocker_branch": -PAPER["rocker_branch"],
    "mechanism.slider_branch": -PAPER["slider_branch"],
    "mechanism.rocker_pivot": [PIVOT_X, -PIVOT_Y],
    "mechanism.crank_angle_deg": -PAPER["crank_angle_deg"],
    "environment.gravity": -9.81,
}
# Both corners of a side, slips of either sign, off the ramp of the friction, on it and beyond.
FAST = {
    "drive.cycles": 0.02,
    "initial.slider_omega": 5.0,
    "initial.slider_vx": 0.2,
    "friction.static_speed": 0.05,
    "friction.transition_speed": 0.3,
    "contact.poisson": {"slider": 0.33, "guide": 0.3},
    "mechanism.slider.thickness": 0.04,  # the width is 0.05 m
}
SOFT = {"contact.youngs_modulus": {"slider": 1e9, "guide": 3e9}}
# The wall would pull.
CLIPPED = {"contact.damping_model": "flores", "contact.restitution": 0.1}
SCENES = {
    "rattle": ("rattle", {}),
    "wedge": ("wedge", {}),
    "punch": ("punch", {}),
    "clipped": ("rattle", FAST | SOFT | CLIPPED),
    "about y": ("rattle", FAST | SOFT | CLIPPED | ABOUT_Y | {"contact.law": "foundation"}),
    "about x": ("punch", FAST | ABOUT_X | {
        "contact.stiffness": 1e9, "contact.damping": 50.0, "contact.damping_depth": 1e-6,
        "load.table": [], "load.force": 50.0, "load.depth": 0.1, "load.surface": 0.15}),
    "switching": ("rattle", FAST | {
        "contact.law": "paper-switching", "contact.youngs_modulus": {"slider": 1e8, "guide": 3e8}}),
}  # fmt: skip
TURNS = {
    "turn": {},
    "load": {"load.force": 500.0},
    "about x": ABOUT_X,
}
# Bounds of positions, velocities and the rest, relative to the largest value in the same unit: rounding; what
# Baumgarte's terms and Newton's method leave of the constraints, and of rates those of position alone (full).
# Two to ten times what was measured.
BOUNDS = {
    "reference-minimal": (1e-14, 1e-13, 1e-11),
    "reference-multiplier": (1e-11, 1e-10, 1e-10),
    "exudyn-full": (2e-11, 2e-6, 1e-4),
    "exudyn-index2": (1.8e-9, 1e-9, 1e-6),
    "exudyn-tree": (1e-14, 1e-13, 1e-10),
}
# Of reactions and torque where a force jumps: the trapezoidal rule damps nothing, so what a jump leaves in
# them stays, with a sign that changes from step to step: the mean of two states errs by 1e-6. Measured are
# 3.2e-4 at this step, at any tolerance of Newton's method, 2.1e-4 at half of it, 5e-5 at a quarter.
RINGING = 1e-3
ORDER = {"m": 0, "rad": 0, "m/s": 1, "rad/s": 1}
INTEGRALS = {"time", *(f"energy_{name}" for name in ("drive", "gravity", "damping", "friction", "residual"))}


def assert_page(simulation, engines, rows, bounds, ringing=0.0):
    """Compare all channels except sums over time with the page's in these rows."""
    columns, largest = simulation.columns, {}
    units = {name: channels()[name].unit for name in columns if name not in INTEGRALS}
    for name, unit in units.items():
        largest[unit] = max(largest.get(unit, 0.0), np.abs(columns[name]).max())
    pages = [engine.channels(start := engine.start(), start) for engine in engines]
    for name, unit in units.items():
        distance = np.abs([page[name] for page in pages] - columns[name][rows]).max()
        least = ringing if name.startswith(("reaction", "crank_torque")) else 0.0
        assert distance <= max(bounds[ORDER.get(unit, 2)], least) * largest[unit], name


@pytest.mark.parametrize("name", SCENES)
def test_a_slider_with_clearance(run, variant, name):
    simulation = run(variant, *SCENES[name])
    columns, events, time = simulation.columns, simulation.result.events, simulation.columns["time"]
    start = [columns[f"slider_{part}"][0] for part in ("x", "y", "angle", "vx", "vy", "omega")]
    place = [12, 13, 14, 27, 28, 29]
    np.testing.assert_allclose(start, Engine(simulation.scene).start()[place], rtol=1e-12, atol=1e-14)
    speeds = np.zeros((time.size, 4))
    for corner, start, end, speed in zip(
        *(events[key] for key in ("corner", "start", "end", "normal_speed")), strict=True
    ):
        speeds[(start <= time) & (time < end), CORNERS.index(corner)] = speed
    edges = np.concatenate([events["start"][events["start"] > 0.0], events["end"]])
    sure = np.abs(edges[:, None] - time).min(axis=0) > 1e-8
    inside, outside = (np.flatnonzero(sure & (speeds.any(axis=1) == hit)) for hit in (True, False))
    assert inside.size > 100
    rows = np.concatenate([inside[:: inside.size // 60], outside[:: outside.size // 20]])
    engines = []
    for row in rows:
        motion = (columns[f"slider_{part}"][row] for part in ("x", "angle", "vx", "omega"))
        engines.append(at_time(simulation.scene, time[row], *motion))
        engines[-1].v_i[:4] = speeds[row]
    rings = (variant, name) == ("exudyn-index2", "switching")
    assert_page(simulation, engines, rows, BOUNDS[variant], RINGING * rings)


@pytest.mark.parametrize("case", TURNS)
@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"])
def test_an_ideal_slider(run, variant, case):
    simulation, rows = run(variant, "turn", TURNS[case]), range(0, 1000, 7)
    engines = [at_time(simulation.scene, simulation.columns["time"][row]) for row in rows]
    # By the trapezoidal rule over six times the step of the others.
    assert_page(simulation, engines, rows, (4e-9, 1e-8, 1e-6) if "exudyn" in variant else BOUNDS[variant])
