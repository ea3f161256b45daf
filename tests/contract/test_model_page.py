"""docs/model.md is enough to write an engine: its formulas alone give forces and motion of both models."""

import ast
import inspect
import re
import textwrap

import numpy as np
import pytest
from page_engine import Engine
from page_formulas import MARKS, MATH, SYMBOLS

from comparison.tables.channels import channels


@pytest.mark.parametrize(("function", "formulas"), MARKS, ids=lambda value: getattr(value, "__name__", ""))
def test_every_formula_and_symbol_of_these_functions_is_on_the_page(function, formulas):
    for formula in formulas:
        assert any(formula in math for math in MATH), formula
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    # Of the formulas, not of the decorator.
    tree.body[0].decorator_list.clear()
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    names |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    for name in names - {"np", "math", "max", "min", "abs"}:
        symbol = re.escape(SYMBOLS[name])
        assert any(re.search(rf"(?<![A-Za-z\\]){symbol}(?![A-Za-z_'])", math) for math in MATH), name


VARIANTS = ("reference-minimal", "exudyn-tree")
MATERIALS = {
    "contact.youngs_modulus": {"slider": 69e9, "guide": 190e9},
    "contact.poisson": {"slider": 0.33, "guide": 0.3},
}
ROWS = [[0.0, 0.0], [2e-4, 30.0], [3e-4, 10.0]]
MIRROR = {
    "drive.speed_rpm": -150.0, "mechanism.rocker_branch": -1, "mechanism.rocker_pivot": [-0.2568, 0.2],
    "mechanism.crank_angle_deg": 68.64, "mechanism.guide_x": 0.55, "mechanism.reference_offset": -5e-5,
}  # fmt: skip
# The first contacts of each clearance, one mirrored about the y axis, two with a workpiece below the slider.
MOTIONS = {
    "150rpm-0.2mm": {
        "drive.cycles": 0.03, "contact.damping_model": "gonthier",
        "load.surface": 0.1885, "load.depth": 1e-3, "load.force": 50.0,
    },
    "crank-pin": MIRROR | MATERIALS | {
        "drive.cycles": 0.0185, "contact.damping_model": "hunt-crossley",
        "load.surface": 0.189, "load.table": ROWS,
    },
    "both-clearances": {"drive.cycles": 0.0195, "contact.law": "adams-impact"},
}  # fmt: skip
# Largest difference of a channel from this engine's, relative to its range; 1.3e-8 measured. The integrators
# keep their errors below 1e-12 (this one) to 1e-10 rad a step, and forces are those of depths of 1e-6 m.
LARGEST = 1e-7


@pytest.fixture(scope="module")
def solution():
    """The engine's solution of a scene at some times, computed once."""
    solutions = {}

    def solve(name, scene, times):
        if name not in solutions:
            solutions[name] = Engine(scene).run(times)
        return solutions[name]

    return solve


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("variant", VARIANTS)
def test_an_engine_made_from_the_page_gives_what_the_models_give(run, solution, variant, name):
    """From t = 0 through the first contacts: all channels, impact speeds, starts and ends of contacts."""
    simulation = run(variant, name, {"output.samples_per_cycle": 20_000, **MOTIONS[name]})
    columns, table = solution(name, simulation.scene, simulation.columns["time"])
    for channel in simulation.columns.keys() - {"time", "energy_residual"}:
        values, exact = simulation.columns[channel], columns[channel]
        bound = LARGEST * np.ptp(exact) + channels()[channel].floor  # below it nothing happens
        assert np.abs(exact - values).max() <= bound, channel
    if name != "both-clearances":  # past the table's last row
        assert simulation.columns["slider_y"].min() < simulation.scene["load"]["surface"] - ROWS[-1][0]
    events = simulation.result.events
    assert events["start"].size == len(table) == 2
    for contact, start, end, speed in table:
        at = np.argmin(np.abs(events["start"] - start) + (events["corner"] != contact))
        assert events["corner"][at] == contact
        # Measured are 5e-13 s: at 0.03 m/s that is 1e-14 m, the integrators' error of the gap.
        assert events["start"][at] == pytest.approx(start, abs=1e-11)
        assert events["end"][at] == pytest.approx(end, abs=1e-11)
        assert events["normal_speed"][at] == pytest.approx(speed, rel=LARGEST)
