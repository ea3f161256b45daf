"""The statements of the paper's text: how they are decided, on made-up motions whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.scene import load_scene
from comparison.studies.paper import dynamics, runs, trends
from comparison.studies.paper.decision import CONTRADICTED, SUPPORTED, UNDECIDED, decide
from comparison.tables.table import Table


def larger(channel="slider_y"):
    return {"channel": channel, "more": "69GPa", "less": runs.CENTRAL}


def noise(made_up, seed, size=5e-5):
    return size * np.random.default_rng(seed).standard_normal(made_up.cycles * made_up.sparse + 1)


def of_starts(made_up, base, perturbed, finer):
    many = made_up.motions(long={runs.CENTRAL: {"x": base}}, perturbed={"x": perturbed})
    other = made_up.motions(perturbed={"x": finer})
    return replace(many, finer=other.perturbed)


def test_larger_errors_in_both_comparisons_support_and_smaller_ones_contradict(made_up):
    base, soft = (runs.CENTRAL, "slider_y"), ("69GPa", "slider_y")
    cycle = np.repeat(1 + 0.01 * np.arange(made_up.cycles), made_up.sparse)
    wave = np.append(
        cycle * np.sin(2 * np.pi * np.arange(made_up.cycles * made_up.sparse) / made_up.sparse), 0.0
    )
    small, big = {"y": 1e-5 * wave}, {"y": 2e-5 * wave}
    members = [{base: 1.0e-5, soft: 2.0e-5}, {base: 1.1e-5, soft: 2.1e-5}]
    up = made_up.motions(members, {runs.CENTRAL: small, "69GPa": big})
    assert trends.larger(up, "reference", larger()).verdict == SUPPORTED
    down = made_up.motions([{base: 2e-5, soft: 1e-5}], {runs.CENTRAL: big, "69GPa": small})
    assert trends.larger(down, "reference", larger()).verdict == CONTRADICTED
    at_odds = made_up.motions(members, {runs.CENTRAL: big, "69GPa": small})
    assert trends.larger(at_odds, "reference", larger()).verdict == UNDECIDED
    overlapping = made_up.motions(
        [{base: 1e-5, soft: 2e-5}, {base: 3e-5, soft: 1e-5}], {runs.CENTRAL: small, "69GPa": big}
    )
    assert trends.larger(overlapping, "reference", larger()).verdict == UNDECIDED


def test_accelerations_of_later_cycles_are_judged_by_the_forces_of_the_contacts(made_up):
    period = load_scene(runs.CENTRAL).period
    hits = [((k + 0.3) * period, 10.0 + k) for k in range(made_up.cycles)] + [(0.9 * period, 900.0)]
    of = made_up.motions(long={"69GPa": {"events": hits}})
    # The first cycle, with its 900 N, does not count.
    assert trends.later_cycles(of, "69GPa", "exudyn", "slider_ay") == pytest.approx(
        10.0 + np.arange(1, made_up.cycles)
    )
    assert trends.later_cycles(of, runs.PIN, "exudyn", "slider_y").size == made_up.cycles - 1
    # Nor do its two contacts.
    assert trends.contacts_by_cycle(of, "69GPa", "exudyn")["size"].tolist() == [1] * (made_up.cycles - 1)
    more = trends.more_contacts(of, "reference", {"more": "69GPa", "less": runs.CENTRAL})
    assert more.verdict == SUPPORTED


def test_mann_and_whitney():
    assert trends.above(np.array([2.0, 3.0]), np.array([1.0, 2.0])) == pytest.approx(3.5 / 4)


def test_a_perturbed_run_as_different_as_any_two_cycles_is_chaos_and_one_that_stays_close_is_not(made_up):
    claim = {"scene": runs.CENTRAL}
    base = noise(made_up, 1)
    chaos = dynamics.sensitive(
        of_starts(made_up, base, noise(made_up, 2), noise(made_up, 3)), "reference", claim
    )
    assert chaos.verdict == SUPPORTED
    close = dynamics.sensitive(of_starts(made_up, base, base + 1e-9, noise(made_up, 3)), "reference", claim)
    assert close.verdict == CONTRADICTED
    nothing = dynamics.sensitive(of_starts(made_up, 0.0, 0.0, 0.0), "reference", claim)
    assert nothing.verdict == CONTRADICTED
    # A map that is ten times narrower at a closer tolerance is the solver's own.
    solver = dynamics.sensitive(
        of_starts(made_up, base, noise(made_up, 2), noise(made_up, 3, 5e-6)), "reference", claim
    )
    assert solver.verdict == UNDECIDED
    assert "0.10 times as wide" in solver.evidence or "0.0" in solver.evidence


def test_scattered_points_and_a_repeating_motion(made_up):
    noisy = made_up.motions(long={runs.CENTRAL: {"x": noise(made_up, 1), "y": noise(made_up, 2)}})
    of_x, of_y = ({"scene": runs.CENTRAL, "channel": f"slider_{axis}"} for axis in "xy")
    assert dynamics.scattered(noisy, "reference", of_x).verdict == SUPPORTED
    assert dynamics.scattered(made_up.motions(), "reference", of_x).verdict == CONTRADICTED
    # Scattered at a fifth of all angles only: it depends on the angle of the section.
    here = np.append(np.tile(np.arange(made_up.sparse) < made_up.sparse // 5, made_up.cycles), False)
    partly = made_up.motions(long={runs.CENTRAL: {"x": here * noise(made_up, 1)}})
    assert dynamics.scattered(partly, "reference", of_x).verdict == UNDECIDED
    assert dynamics.periodic(noisy, "reference", of_y).verdict == SUPPORTED  # noise of 1e-3 of the stroke
    shaken = made_up.motions(long={runs.CENTRAL: {"y": 100 * noise(made_up, 2)}})
    assert dynamics.periodic(shaken, "reference", of_y).verdict == CONTRADICTED
    assert dynamics.recurring(noisy, "reference", of_y).verdict != SUPPORTED
    wave = np.sin(2 * np.pi * np.arange(made_up.cycles * made_up.sparse + 1) / made_up.sparse)
    again = made_up.motions(long={runs.CENTRAL: {"y": 1e-5 * wave}})
    assert dynamics.recurring(again, "reference", of_y).verdict == SUPPORTED


def test_contacts_and_crossings_are_counted_by_the_cycle(made_up):
    claim = {"scene": runs.CENTRAL}
    clearance = load_scene(runs.CENTRAL).data["clearance"]["slider"]
    period = load_scene(runs.CENTRAL).period
    wave = np.sin(2 * np.pi * 3 * np.arange(made_up.cycles * made_up.sparse + 1) / made_up.sparse)
    hits = [((cycle + (k + 0.5) / 12) * period, 1.0) for cycle in range(made_up.cycles) for k in range(12)]
    # From the guide's centre line: the ideal slider's is 0.05 mm beside it.
    of = made_up.motions(long={runs.CENTRAL: {"x": clearance * wave - 5e-5, "events": hits}})
    decision = dynamics.traversals(of, "reference", claim)
    assert decision.verdict == SUPPORTED
    assert decision.evidence.startswith("12.0 contacts a cycle or more; 5 to 5 crossings")
    assert dynamics.traversals(made_up.motions(), "reference", claim).verdict == CONTRADICTED


@pytest.mark.parametrize(
    ("angles", "verdict"),
    [
        ((135, 225), SUPPORTED),
        ((-45, 45), SUPPORTED),  # the same in the frame of the pin
        ((135, -45), CONTRADICTED),
        ((135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 225), UNDECIDED),
    ],
)
def test_the_quadrants_in_which_the_pin_pushes(made_up, angles, verdict):
    time = np.linspace(0.0, 0.8, 2 * made_up.dense + 1)
    # In the first cycle it pushes elsewhere.
    angle = np.radians(np.where(time < 0.399, 45, np.resize(angles, time.size)))
    frame = pd.DataFrame(
        {"time": time, "reaction_A_x": 50 * np.cos(angle), "reaction_A_y": 50 * np.sin(angle)}
    )
    of = replace(made_up.motions(), pin={(runs.PIN, "reference"): Table(frame)})
    assert dynamics.pin_zones(of, "reference", {"scene": runs.PIN}).verdict == verdict


def test_contacts_near_the_lowest_point(made_up):
    period = load_scene(runs.CENTRAL).period
    of = made_up.motions()
    short = of.short[runs.CENTRAL, "reference"]
    claim = {"scene": runs.CENTRAL}
    assert dynamics.contacts_at_the_bottom(of, "reference", claim).verdict == CONTRADICTED
    # The lowest point of the second cycle of a cosine.
    short[0] = made_up.table(
        period, 2, made_up.dense, events=[(1.5 * period + by, 1.0) for by in (-0.015, 0.0, 0.01, 0.03)]
    )
    decision = dynamics.contacts_at_the_bottom(of, "reference", claim)
    assert decision.verdict == SUPPORTED
    assert decision.evidence.startswith("3 contacts")


def test_two_codes_that_differ_by_half_of_the_error_are_not_consistent(made_up):
    of = made_up.motions([{(runs.CENTRAL, channel): 1e-5 for channel in runs.CHANNELS}])
    claim = {"scene": runs.CENTRAL}
    assert dynamics.two_codes(of, "reference", claim).verdict == SUPPORTED
    other = made_up.motions([{(runs.CENTRAL, channel): 2e-5 for channel in runs.CHANNELS}])
    of.short[runs.CENTRAL, "exudyn"] = other.short[runs.CENTRAL, "exudyn"]
    assert dynamics.two_codes(of, "reference", claim).verdict == CONTRADICTED


def test_decide_leaves_the_middle_open():
    assert [decide(v, 0.0, 1.0, "").verdict for v in (0.0, 0.5, 1.0)] == [CONTRADICTED, UNDECIDED, SUPPORTED]
