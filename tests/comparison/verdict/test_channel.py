"""One channel's verdict on known signals; its bounds and numbers are asked for in `tests/judge`."""

import numpy as np
import pytest
from judged_runs import decided

from comparison.accuracy.levels import thresholds
from comparison.scene import load_scene
from comparison.tables.channels import channels
from comparison.verdict.channel import Criteria, Samples, compare_channel
from comparison.verdict.compare import scene_verdict
from comparison.verdict.results import scene_coverage

N = 1000
TIME = np.linspace(0, 0.4, N)
WAVE = np.sin(2 * np.pi * TIME / 0.4)
LIMITS = thresholds()
SCENE = load_scene("150rpm-0.2mm").data


def judge(a, b, u=None, channel="slider_ax", **options):
    """Compare with this uncertainty in both, or in either; None: none."""
    both = u if isinstance(u, tuple) else (u, u)
    both = tuple(None if each is None else np.broadcast_to(each, a.shape).astype(float) for each in both)
    usual = {"scene": None, "limits": LIMITS} | options
    return compare_channel(channels()[channel], Samples(np.linspace(0, 0.4, a.size), a, b, *both), **usual)


def test_a_force_that_is_zero_throughout_differs_from_rare_impacts():
    force = np.zeros(N)
    force[[50, 51, 400, 800]] = (30.0, 10.0, 50.0, 20.0)  # 0.4 % of the samples: fewer than may be outside
    known = {"channel": "corner_ll_normal", "scene": SCENE}
    for a, b in ((force, 0 * force), (0 * force, force)):
        result = judge(a, b, 1e-6, **known)
        assert (result.verdict, result.explained) == ("differ", 0.0)
        assert judge(a, b, criteria=Criteria(tolerance=0.01), channel="corner_ll_normal").verdict == "differ"
    # Where none of them is predictable it is not called agreement either.
    result = judge(force, 0 * force, np.where(force > 0, 10.0, 1e-9), **known)
    assert (result.verdict, result.coverage > 0.99) == ("indeterminate", True)
    assert np.isnan([result.explained, result.worst_time, result.ratio]).all()


@pytest.mark.parametrize("name", ["slider_x", "slider_vx"])
def test_a_unit_that_leaves_nothing_predictable_differs_and_a_motion_that_does_so_does_not(name):
    """Metres against millimetres: the uncertainty, in millimetres as well, exceeds alpha everywhere."""
    position = -0.55 + 1e-4 * WAVE if name == "slider_x" else 0.1 * WAVE
    small = 1e-4 * channels()[name].scale_value(SCENE, np.nan)
    known = {"channel": name, "scene": SCENE}
    result = judge(position, 1e3 * position, (small, 1e3 * small), **known)
    assert (result.verdict, result.coverage) == ("differ", 0.0)
    assert abs(result.worst_difference) > result.worst_threshold == pytest.approx(2e3 * small, rel=1e-6)
    assert scene_verdict({name: result, "other": judge(WAVE, WAVE, 1e-6)}, 0.5) == "differ"
    # Neighbours that have spread by as much as the motion itself: its largest uncertainty explains them.
    spread = np.where(TIME < 0.1, small, 3 * np.ptp(position))
    apart = np.where(TIME < 0.1, position, position[::-1]) + small
    assert judge(position, apart, spread, **known).verdict == "indeterminate"


def test_the_scene_takes_the_worst_verdict_and_nothing_excited_is_not_agreement():
    agree, differ = judge(WAVE, WAVE + 1e-7, 1e-6), judge(WAVE, WAVE + 1e-3, 1e-6)
    open_, quiet = judge(WAVE, WAVE), judge(0 * WAVE, 0 * WAVE)
    judged = {"a": agree, "b": agree, "d": differ, "o": open_, "p": open_, "q": quiet}
    for names, verdict, said in (
        ("aq", "agree", "1 of 1 excited channels agree, "),
        ("aopq", "indeterminate", "2 of 3 channels are indeterminate: there is neither "),
        ("q", "indeterminate", "nothing was compared"),
        ("aod", "differ", "1 of 3 channels differ, most of all "),
        # The third has nothing to be judged by: it may be off by any amount.
        ("abo", "indeterminate", "1 of 3 channels are indeterminate: there is neither "),
    ):
        overall, why = decided({name: judged[name] for name in names})
        assert (overall, said in why) == (verdict, True), why
    assert scene_coverage({name: judged[name] for name in "aboq"}) == pytest.approx(2 / 3)
