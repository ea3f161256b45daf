"""Both models against a minimal program on random linkages, without and with clearances."""

import copy
import functools
import importlib
import os
import re

import numpy as np
import pandas as pd
import pytest
from linkage_oracle import solve
from random_linkages import KINDS, LOOSE, loose_scene, scene, shorten

REFINEMENTS = {
    "reference_model": ("reference", "tolerance", (1.0, 0.1, 0.01)),
    "exudyn_model": ("exudyn", "step", (1.0, 0.5)),
}
"""The setting of a model's runs, and its factors."""


@pytest.fixture(params=REFINEMENTS)
def model(request):
    return request.param


def runs(model, data, part=slice(None)):
    section, key, factors = REFINEMENTS[model]
    results = []
    for factor in factors[part]:
        setting = copy.deepcopy(data)
        setting["solver"][section][key] *= factor
        results.append(importlib.import_module(model).simulate(setting))
    return results


ROUNDING, KINK = 1e-9, 2e-8
"""The oracle's own error, and that with a table of torques; in SI units, and of a quantity's scale.

The oracle steps over the kinks of a table: of four-bar 36 it is off by 1e-8 of an acceleration, where both
models are together, Exudyn at steps of 1 us.
"""
FORCES = "reaction_x reaction_y force"
QUANTITIES = ["x y", "angle", "vx vy", "omega", "ax ay", "alpha", FORCES, "moment torque", "energy"]
# A smooth motion of each kind, a change point and a lock of two; by speed, freely, by torques and tables.
CASES = [("four-bar", 0), ("four-bar", 3), ("four-bar", 1), ("slider-crank", 5), ("slider-crank", 8),
       ("slider-crank", 6), ("watt", 12), ("stephenson", 17)]  # fmt: skip
MORE = {"watt": (10, 13), "stephenson": (15, 18)}  # change points and locks of six-bars


@functools.cache
def motion(kind, i):
    """Return a scene, its columns and the time of its singular position."""
    data = scene(kind, i)
    columns, _, end = solve(data)
    return data, columns, end


def errors(model, data, columns, end):
    """Return a sentence for each silent error: a success that is wrong, a singular position elsewhere.

    The tolerance of a quantity is twice the difference of the model's two runs. The finer one is judged: a
    method of second order errs there by a third of it, and by once where forces have kinks.
    """
    results = runs(model, data, slice(None, None, 2 if model == "reference_model" else 1))
    status = "success" if end == np.inf else "singular"
    if [result.status for result in results] != [status] * 2:
        yield f"{results[-1].status} instead of {status} at {end:.6f} s: {results[-1].remedy}"
        return
    if status == "singular":
        for result in results:
            time = float(re.search(r"t = ([0-9.e+-]+) s", result.remedy)[1])
            if abs(time - end) > 1.5e-3:  # 1e-3 s by the contract, half of one by three decimals
                yield f"singular at {time} instead of {end:.6f} s"
    # Towards a singular position velocities grow without bound.
    n = int(np.searchsorted(columns["time"], 0.9 * end, side="right"))
    coarse, fine = (result.columns for result in results)
    if min(len(fine["time"]), len(coarse["time"])) < n or set(columns) - set(fine):
        yield f"{len(fine['time'])} samples of {n}, without {set(columns) - set(fine)}"
        return
    error = KINK if "torque_table" in data["drive"] else ROUNDING
    ends = {name: "energy" if name.startswith("energy") else name.rpartition(".")[2] for name in columns}
    for quantity in QUANTITIES:
        if names := [name for name in columns if ends[name] in quantity.split()]:
            tables = (columns, fine, coarse)
            truth, values, other = (np.array([table[name][:n] for name in names]) for table in tables)
            tolerance = 2 * np.abs(values - other).max() + error * (1 + np.abs(truth).max())
            distance = np.abs(values - truth).max(axis=1)
            if not distance.max() <= tolerance:
                yield f"{names[distance.argmax()]} off by {distance.max():.1e}, tolerance {tolerance:.1e}"


@pytest.mark.parametrize(("kind", "i"), CASES)
def test_a_linkage_moves_as_its_minimal_program(kind, i, model):
    assert not list(errors(model, *motion(kind, i)))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_random_linkages_make_no_silent_error(kind, model):
    """Run LINKAGES of a kind, 10 by default, and some more; there are 75 of each."""
    count = int(os.environ.get("LINKAGES", "10"))
    cases = sorted({*range(count), *MORE.get(kind, ())})
    sentences = {i: list(errors(model, *motion(kind, i))) for i in cases}
    # The share of locks; change points are singular too.
    assert sum(motion(kind, i)[2] < np.inf for i in cases) >= count // 5
    assert not {i: lines for i, lines in sentences.items() if lines}


# Relative errors of the program's events: it sees peaks at the ends of its steps' parts.
EVENTS = {"start": 1e-7, "end": 1e-7, "normal_speed": 1e-7, "impulse": 1e-7, "peak_force": 1e-3,
          "largest_depth": 1e-3}  # fmt: skip


def in_order(events):
    """Return contacts by start; of those within 1e-11 s, whose order rounding decides, by corner."""
    rows = sorted(events, key=lambda event: event["start"])
    starts = np.array([event["start"] for event in rows])
    group = np.cumsum(np.diff(starts, prepend=starts[:1]) > 1e-11)
    return [rows[k] for k in np.lexsort(([event["corner"] for event in rows], group))]


@functools.cache
def contact_motion(kind, i):
    """Return a scene that ends after three contacts, its columns and events."""
    whole = loose_scene(kind, i)
    _, events, _ = solve(whole, [0.0, 0.05], 1e-8, 3)
    data = shorten(whole, max((event["end"] for event in events), default=0.05))
    columns, events, _ = solve(data)
    return data, columns, in_order(events)


def disagreements(model, data, columns, events):
    """Return a sentence for each quantity off by more than thrice the largest difference of the runs.

    Across kinks errors do not fall with each decade of the tolerance: three runs show more than two.
    """
    results, names = runs(model, data), [event["corner"] for event in events]
    contacts = [in_order(pd.DataFrame(result.events).to_dict("records")) for result in results]
    for result, rows in zip(results, contacts, strict=True):
        corners = [event["corner"] for event in rows]
        if (result.status, corners) != ("success", names):
            yield f"{result.status}, {corners} instead of {names}: {result.remedy}"
            return
    quantities = {}
    for name in columns:
        quantity = name.rpartition("_" if name.split("_")[-1] in ("gap", "normal", "friction") else ".")[2]
        quantities.setdefault("energy" if quantity.startswith("energy") else quantity, []).append(name)
    tables = [(each, columns, [run.columns for run in results]) for each in quantities.values()]
    of_events = (
        {key: np.array([event[key] for event in e], float) for key in EVENTS} for e in (events, *contacts)
    )
    truth, *estimates = of_events
    tables += [([key], truth, estimates) for key in truth if truth[key].size]
    for names, base, samples in tables:
        exact, *others, array = (np.array([table[name] for name in names]) for table in (base, *samples))
        # Measured: across kinks of friction a start at 8 ms is off by 3e-10, 4e-11, 2e-10 s at 1e-10, 1e-11,
        # 1e-12; by rounding in depths of 1e-5 m forces have 1e-8 of theirs.
        spread = max(np.abs(array - other).max() for other in others)
        tolerance = 3 * spread + EVENTS.get(names[0], 1e-7) * np.abs(exact).max()
        if names[0] != "time" and np.abs(array - exact).max() > tolerance:
            yield f"{names[0]} and others off by {np.abs(array - exact).max():.1e}, tolerance {tolerance:.1e}"


# The last ones: a guide on a body with clearance, and rest.
@pytest.mark.parametrize(("kind", "i"), [*((kind, 0) for kind in LOOSE), ("lever", 1), ("slider-crank", 6)])
def test_a_linkage_with_clearances_moves_as_its_minimal_program(kind, i, model):
    assert not list(disagreements(model, *contact_motion(kind, i)))


@pytest.mark.slow
@pytest.mark.parametrize("kind", LOOSE)
def test_random_clearances_make_no_silent_error(kind, model):
    """Run LINKAGES of a kind, 11 by default, the last an assembly that offsets must not change."""
    cases = range(int(os.environ.get("LINKAGES", "11")))
    sentences = {i: list(disagreements(model, *contact_motion(kind, i))) for i in cases}
    assert not {i: lines for i, lines in sentences.items() if lines}
