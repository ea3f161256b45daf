"""Each sample is the state that docs/model.md gives there: accelerations, forces, reactions, energies.

The page's equations in 15 coordinates are closed at the sample's slider and solved with the contacts of the
table; a mirrored press has the other branches, the other sense of rotation and walls on the other side.
"""

import numpy as np
import pytest
from page_engine import at_time
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
SCENES = {
    "rattle": ("rattle", {}),
    "wedge": ("wedge", {}),
    "punch": ("punch", {}),
    "about y": ("rattle", ABOUT_Y),
    "about x": ("rattle", ABOUT_X),
}
IDEAL = {
    "ideal": {},
    "backwards": {"drive.speed_rpm": -90.0},
    "load": {"load.force": 500.0},
    "about x": ABOUT_X,
}
# Of the largest value in the same unit: rounding; what Baumgarte's terms and Newton's method leave of the
# constraints, and of rates those of position alone (full). Two to ten times what was measured.
BOUNDS = {
    "reference-minimal": 1e-11,
    "reference-multiplier": 1e-10,
    "exudyn-full": 1e-4,
    "exudyn-index2": 1e-6,
    "exudyn-tree": 1e-10,
}
INTEGRALS = {"time", *(f"energy_{name}" for name in ("drive", "gravity", "damping", "friction", "residual"))}


def assert_page(simulated, engines, rows, bound):
    """Compare all channels but sums over time with the page's in these rows."""
    columns, largest = simulated.columns, {}
    names = [name for name in columns if name not in INTEGRALS]
    for name in names:
        unit = channels()[name].unit
        largest[unit] = max(largest.get(unit, 0.0), np.abs(columns[name]).max())
    pages = [engine.channels(engine.start(), np.zeros(4)) for engine in engines]
    for name in names:
        apart = np.abs([page[name] for page in pages] - columns[name][rows]).max()
        assert apart <= bound * largest[channels()[name].unit], name


@pytest.mark.parametrize("name", SCENES)
def test_a_slider_with_clearance(run, variant, name):
    simulated = run(variant, *SCENES[name])
    columns, events, time = simulated.columns, simulated.result.events, simulated.columns["time"]
    edges = np.concatenate([events["start"][events["start"] > 0.0], events["end"]])
    rows = [row for row in range(0, time.size, 7) if np.abs(edges - time[row]).min() > 1e-8]
    engines = []
    for row in rows:
        motion = (columns[f"slider_{part}"][row] for part in ("x", "angle", "vx", "omega"))
        engines.append(at_time(simulated.scene, time[row], *motion))
        for i in np.flatnonzero((events["start"] <= time[row]) & (time[row] < events["end"])):
            engines[-1].v_i[CORNERS.index(events["corner"][i])] = events["normal_speed"][i]
    assert sum(engine.v_i.any() for engine in engines) > 40
    assert_page(simulated, engines, rows, BOUNDS[variant])


@pytest.mark.parametrize("case", IDEAL)
@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"])
def test_an_ideal_slider(run, variant, case):
    groups = {"output.groups": ["accelerations", "joints", "energy"], "solver.exudyn.step": 1e-5}
    simulated, rows = run(variant, "ideal", groups | {"drive.cycles": 1.0} | IDEAL[case]), range(0, 1000, 7)
    engines = [at_time(simulated.scene, simulated.columns["time"][row]) for row in rows]
    assert_page(simulated, engines, rows, BOUNDS[variant])
