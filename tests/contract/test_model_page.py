"""docs/model.md is enough to write an engine: its formulas alone give forces and motion of both models."""

import ast
import inspect
import re
import textwrap

import numpy as np
import pytest
from page_engine import Engine
from page_formulas import MATH, STATED, SYMBOLS, Numbers

from comparison.tables.channels import channels


@pytest.mark.parametrize(("function", "formulas"), STATED, ids=lambda value: getattr(value, "__name__", ""))
def test_every_formula_and_symbol_of_these_functions_is_on_the_page(function, formulas):
    for formula in formulas:
        assert any(formula in math for math in MATH), formula
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    # Of the formulas, not of the decorator.
    tree.body[0].decorator_list.clear()
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    names |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    for name in names - {"np", "math", "max"}:
        symbol = re.escape(SYMBOLS[name])
        assert any(re.search(rf"(?<![A-Za-z\\]){symbol}(?![A-Za-z_'])", math) for math in MATH), name


# Contacts that exist at t = 0: all that their forces need follows from channels and scene alone. A side is
# pressed in with both corners, a little tilted, and begins to slip on the ramp of the friction.
SIDE = {
    "initial.slider_offset": 2.02e-4,
    "initial.slider_angle": 1e-5,
    "initial.slider_vx": 2e-3,
    "drive.cycles": 2e-5,
    "output.samples_per_cycle": 100_000_000,  # contacts of some us
}
MATERIALS = {"contact.youngs_modulus.slider": 69e9, "contact.poisson.guide": 0.33}
TILTED = {**SIDE, "initial.slider_offset": 1.99e-4, "initial.slider_angle": 1e-4, "initial.slider_vx": 3e-3}
SURFACES = {
    "both corners inside": SIDE,
    "one corner inside": TILTED,
    "both corners inside, rotating": {**SIDE, "initial.slider_omega": 0.1},
    "one corner inside, two materials": {**TILTED, **MATERIALS},
}
VARIANTS = ("reference-minimal", "exudyn-tree")


@pytest.mark.parametrize("case", SURFACES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_the_page_gives_the_force_of_a_side_from_the_slider_s_motion(run, variant, case):
    """Under the law foundation: shares of both corners, one impact speed, the energy stored."""
    simulated = run(variant, "150rpm-0.2mm", {**SURFACES[case], "contact.law": "foundation"})
    numbers, columns, events = Numbers(simulated.scene), simulated.columns, simulated.result.events
    motion = [columns[f"slider_{name}"] for name in ("x", "angle", "vx", "vy", "omega")]
    lower, upper = numbers.corner(1, *motion), numbers.corner(3, *motion)
    assert events["start"][0] == 0.0
    during = np.flatnonzero(columns["time"] < events["end"][0])
    first, second = ([part[during] for part in corner[:3]] for corner in (lower, upper))
    assert events["corner"][0] == ("lr" if first[0][0] > second[0][0] else "ur")
    normal, drag, v_i, stored = numbers.side(first, second)
    assert events["normal_speed"][0] == pytest.approx(v_i, rel=1e-12)
    # The rounding of depths, 5e-16 m, relative to the deeper one, to which forces go by the square, energies
    # by the cube; of sums and products 1e-12; of the rate over the floor, 1e-15 / 1e-4, in the factor.
    close = 10.0 * 5e-16 / np.maximum(first[0], second[0]) + 3e-11
    for name, N, T in zip(("lr", "ur"), normal, drag, strict=True):
        assert np.all(np.abs(columns[f"corner_{name}_normal"][during] - N) <= close * N.max() + 1e-12)
        assert np.all(np.abs(columns[f"corner_{name}_friction"][during] - T) <= close * N.max() + 1e-12)
    if "energy_contact" in columns:  # five bodies and the reference alone account for energies
        assert np.all(np.abs(columns["energy_contact"][during] - stored) <= close * stored.max() + 1e-18)
    assert np.count_nonzero(normal[0]) > 30
    assert np.count_nonzero(drag[0]) > 3
    assert (np.minimum(first[0], second[0]).max() > 0.0) == (case.startswith("both corners inside"))


MOTIONS = {
    # Two corners of the left side at one instant, 45 and 59 N.
    "150rpm-0.2mm": 0.03,
    # Two bounces of the journal, 305 and 1559 N.
    "crank-pin": 0.0195,
}
ROWS = [[0.0, 0.0], [2e-4, 30.0], [3e-4, 10.0]]
MIRRORED = {
    "drive.speed_rpm": -150.0, "mechanism.rocker_branch": -1, "mechanism.rocker_pivot": [-0.2568, 0.2],
    "mechanism.crank_angle_deg": 68.64, "mechanism.guide_x": 0.55, "mechanism.reference_offset": -5e-5,
}  # fmt: skip
# The same with another law, mirrored about the y axis, and with a workpiece right below the slider.
OTHERS = {
    "adams-impact": ("150rpm-0.2mm", {"contact.law": "adams-impact"}),
    "adams-impact at the pin": ("crank-pin", {"contact.law": "adams-impact"}),
    "gonthier": ("150rpm-0.2mm", {"contact.damping_model": "gonthier"}),
    "hunt-crossley at the pin": ("crank-pin", {"contact.damping_model": "hunt-crossley"}),
    "mirrored at the pin": ("crank-pin", MIRRORED),
    "power": ("150rpm-0.2mm", {"load.surface": 0.1885, "load.depth": 1e-3, "load.force": 50.0}),
    "table": ("crank-pin", {"load.surface": 0.189, "load.table": ROWS, "drive.cycles": 0.0185}),
}
MOTION_CASES = [
    *((variant, name, name, {}) for variant in VARIANTS for name in MOTIONS),
    *((variant, name, *of) for variant in VARIANTS for name, of in OTHERS.items()),
]
# Largest difference of a channel from this engine's, relative to its range; 1.3e-8 is found. The integrators
# keep their errors below 1e-12 (this one) to 1e-10 rad a step, and forces are those of depths of 1e-6 m.
LARGEST = 1e-7


@pytest.fixture(scope="module")
def solution():
    """What the engine gives of a scene at some times, found once."""
    known = {}

    def solve(name, scene, times):
        if name not in known:
            known[name] = Engine(scene).run(times)
        return known[name]

    return solve


@pytest.mark.parametrize(("variant", "case", "name", "own"), MOTION_CASES)
def test_an_engine_made_from_the_page_gives_what_the_models_give(run, solution, variant, case, name, own):
    """From t = 0 through the first contacts: all channels, impact speeds, starts and ends of contacts."""
    changes = {"drive.cycles": MOTIONS[name], "output.samples_per_cycle": 20_000, **own}
    simulated = run(variant, name, changes)
    columns, table = solution(case, simulated.scene, simulated.columns["time"])
    for channel in simulated.columns.keys() - {"time", "energy_residual"}:
        values, exact = simulated.columns[channel], columns[channel]
        bound = LARGEST * np.ptp(exact) + channels()[channel].floor  # below it nothing happens
        assert np.abs(exact - values).max() <= bound, channel
    if case in ("power", "table"):  # past the table's last row
        assert simulated.columns["slider_y"].min() < simulated.scene["load"]["surface"] - ROWS[-1][0]
    events = simulated.result.events
    assert events["start"].size == len(table) == 2
    for contact, start, end, speed in table:
        at = np.argmin(np.abs(events["start"] - start) + (events["corner"] != contact))
        assert events["corner"][at] == contact
        # Found are 5e-13 s: at 0.03 m/s that is 1e-14 m, what the integrators leave of the gap.
        assert events["start"][at] == pytest.approx(start, abs=1e-11)
        assert events["end"][at] == pytest.approx(end, abs=1e-11)
        assert events["normal_speed"][at] == pytest.approx(speed, rel=LARGEST)
