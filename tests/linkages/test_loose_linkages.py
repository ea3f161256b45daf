"""Both models against a minimal program on random linkages with clearances, contacts one to one."""

import copy
import functools
import importlib
import os

import numpy as np
import pytest
from contact_oracle import Bodies, solve
from loose_linkages import KINDS, scene, shorten

REFINED = {
    # Across kinks errors do not fall with each decade of the tolerance: three runs show more than two.
    "reference_model": ("reference", "tolerance", (1.0, 0.1, 0.01)),
    "exudyn_model": ("exudyn", "step", (1.0, 0.5)),
}
"""The setting of a model's runs, and its factors."""
# What the program knows of an event, and to which share: it sees peaks at the ends of its steps' parts.
EVENTS = {"start": 1e-7, "end": 1e-7, "normal_speed": 1e-7, "impulse": 1e-7, "peak_force": 1e-3,
          "largest_depth": 1e-3}  # fmt: skip


@functools.cache
def expected(kind, i):
    """Return a scene that ends after three contacts, its columns and events."""
    whole = scene(kind, i)
    _, events = solve(Bodies(whole), [0.0, 0.05], 1e-8, 3)
    drawn = shorten(whole, max((event["end"] for event in events), default=0.05))
    return drawn, *solve(Bodies(drawn))


def disagreements(model, drawn, columns, events):
    """Return a sentence for each quantity off by more than thrice the largest difference of the runs."""
    section, key, factors = REFINED[model]
    results = []
    for factor in factors:
        setting = copy.deepcopy(drawn)
        setting["solver"][section][key] *= factor
        results.append(importlib.import_module(model).simulate(setting))
    if {result.status for result in results} != {"success"}:
        yield "; ".join(f"{result.status}: {result.remedy}" for result in results)
        return
    names = [event["corner"] for event in events]
    for result in results:
        if list(result.events["corner"]) != names:
            yield f"{list(result.events['corner'])} instead of {names}"
            return
    quantities = {}
    for name in columns:
        quantity = name.rpartition("_" if name.split("_")[-1] in ("gap", "normal", "friction") else ".")[2]
        quantities.setdefault("energy" if quantity.startswith("energy") else quantity, []).append(name)
    tables = [(each, columns, [run.columns for run in results]) for each in quantities.values()]
    truth = {key: np.array([event[key] for event in events], float) for key in EVENTS}
    tables += [([key], truth, [run.events for run in results]) for key in truth if truth[key].size]
    for names, known, runs in tables:
        exact, *others, got = (np.array([run[name] for name in names]) for run in (known, *runs))
        # Measured: across kinks of friction a start at 8 ms is off by 3e-10, 4e-11, 2e-10 s at 1e-10, 1e-11,
        # 1e-12; by rounding in depths of 1e-5 m forces have 1e-8 of theirs.
        spread = max(np.abs(got - other).max() for other in others)
        tolerance = 3 * spread + EVENTS.get(names[0], 1e-7) * np.abs(exact).max()
        if names[0] != "time" and np.abs(got - exact).max() > tolerance:
            yield f"{names[0]} and others off by {np.abs(got - exact).max():.1e}, tolerance {tolerance:.1e}"


@pytest.mark.parametrize("model", REFINED)
# The last ones: a guide on a body without clearance, and rest.
@pytest.mark.parametrize(("kind", "i"), [*((kind, 0) for kind in KINDS), ("lever", 1), ("slider-crank", 6)])
def test_a_linkage_with_clearances_moves_as_its_minimal_program(kind, i, model):
    assert not list(disagreements(model, *expected(kind, i)))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_random_clearances_make_no_silent_error(kind):
    """Run LINKAGES of a kind, 11 by default, the last an assembly that offsets must not change."""
    cases = [(i, model) for i in range(int(os.environ.get("LINKAGES", "11"))) for model in REFINED]
    wrong = {case: list(disagreements(case[1], *expected(kind, case[0]))) for case in cases}
    assert not {case: lines for case, lines in wrong.items() if lines}
