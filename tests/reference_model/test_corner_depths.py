"""The checker of located contacts, `benchmarks/corner_depths.py`, and a small share of its runs."""

import corner_depth_steps as steps
import corner_depths as depths
import pytest

from comparison.scene import load_scene
from reference_model import simulate

SHORT = {"drive.cycles": 0.05, "initial.slider_omega": 0.2, "initial.slider_angle": 1e-4}


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
    closed = int((followed.run.modes["speed"] > 0.0).sum())
    assert int((whole.events["end"] >= whole.columns["time"][-1]).sum()) == closed
    # Judged by a guide, or a bearing, that is narrower than the one of the run by a micrometre.
    clearance = scene.data["clearance"]
    narrow = {f"clearance.{joint}": clearance[joint] - 1e-6 for joint in ("slider", "crank_pin")}
    computed = steps.check(scene, 1e-11, 10**6, judged=load_scene("paper", values | narrow)).depths
    seen = computed[[steps.OUTSIDE, steps.TOUCHING]]
    assert seen[:, steps.VIOLATIONS].sum() > 0
    assert seen[:, steps.WORST].max() == pytest.approx(1e-6, abs=1e-9)


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
