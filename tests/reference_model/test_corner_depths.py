"""The checker of located contacts, `benchmarks/corner_depths.py`, and a small share of its runs."""

import corner_depth_steps as steps
import corner_depths as depths
import numpy as np
import pytest
from reference_states import in_state

from comparison.scene import load_scene
from reference_model import simulate
from reference_model.contact import CONTACTS, GAP, MEMORY, MODES
from reference_model.parameters import read_parameters
from reference_model.running import formulation, start

SHORT = {"drive.cycles": 0.05, "initial.slider_omega": 0.2, "initial.slider_angle": 1e-4}
VARIANTS = pytest.mark.parametrize("variant", depths.FORMULATIONS)


@VARIANTS
def test_gaps_are_those_of_the_equations_of_motion(variant):
    """In random states near the start, 1e-4 rad and m apart; of coordinates of 0.5 m, rounded at 1e-16 m."""
    scene = load_scene("paper", depths.FORMULATIONS[variant])
    p = read_parameters(scene.data)
    model, _ = formulation(p)
    y0, g, own = start(p, model), steps.geometry(scene), np.empty(CONTACTS)
    rng = np.random.default_rng(1)
    for t in rng.uniform(0.0, 1e-3, 50):
        y = y0 + 1e-4 * rng.normal(size=y0.size)
        contacts, _, _ = in_state(model, p, t, y, np.zeros(MODES))
        steps.gaps(g, t, y, own)
        np.testing.assert_allclose(own, contacts[GAP : GAP + CONTACTS], rtol=0.0, atol=2e-15)
        assert np.isfinite(own).any()


def test_depths_in_a_table_are_its_gaps():
    scene = load_scene("paper", {**SHORT, "output.groups": ["corners"]})
    columns = simulate(scene.data).columns
    for corner, depth in depths.depths(scene, columns).items():
        np.testing.assert_allclose(-depth, columns[f"corner_{corner}_gap"], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("variant", ["minimal", "both"])  # the slow test below has all of them
def test_one_attempt_at_a_time_is_the_same_run_and_what_sinks_into_a_wall_is_seen(variant):
    """The same up to rounding, which contacts magnify by a thousand; a step less would be off by 1e-10."""
    values = {**SHORT, **depths.FORMULATIONS[variant], "output.groups": ["joints"]}
    scene = load_scene("paper", values)
    whole, followed = simulate(scene.data), steps.check(scene, 1e-11, 10**6)
    assert depths.STATUS[followed.status] == depths.FINISHED
    assert followed.steps == pytest.approx(whole.provenance["counters"]["steps"], rel=0.05)
    assert followed.depths[steps.CLOSED, steps.VIOLATIONS] == 0
    assert whole.events["start"].size > 0
    closed = int((followed.run.modes[MEMORY : MEMORY + CONTACTS] > 0.0).sum())
    assert int((whole.events["end"] >= whole.columns["time"][-1]).sum()) == closed
    # Judged by a guide, or a bearing, that is narrower than the one of the run by a micrometre.
    clearance = scene.data["clearance"]
    narrow = {f"clearance.{joint}": clearance[joint] - 1e-6 for joint in ("slider", "crank_pin")}
    computed = steps.check(scene, 1e-11, 10**6, judged=load_scene("paper", values | narrow)).depths
    seen = computed[[steps.OUTSIDE, steps.TOUCHING]]
    assert seen[:, steps.VIOLATIONS].sum() > 0
    assert seen[:, steps.WORST].max() == pytest.approx(1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("starts", "ends", "expected"),
    [([], [], []), ([1.0], [2.0], [1, 2]), ([1.0, 3.0], [1.5, 4.0], [1, 3, 4])],
)
def test_samples_within_a_contact(starts, ends, expected):
    computed = depths.closed(np.arange(5.0), np.array(starts), np.array(ends))
    assert np.flatnonzero(computed).tolist() == expected


@pytest.mark.slow
@pytest.mark.parametrize(
    ("draws", "judge"),
    [
        (depths.grazing_runs(60, seed=1), depths.followed),
        (depths.random_runs(60, seed=1), depths.followed),
        (depths.scipy_runs(4, seed=1), depths.tabulated),
    ],
    ids=["grazing", "random", "scipy"],
)
def test_no_contact_is_missed(draws, judge):
    assert {draw.number: computed for draw in draws if (computed := judge(draw)).too_deep} == {}
