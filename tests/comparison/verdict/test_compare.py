"""Where a difference comes from, by the runs of both models."""

from dataclasses import replace
from math import isnan

import pandas as pd
import pytest
from by_keywords import compare

from comparison.accuracy.uncertainty import Runs
from comparison.words.differences import attribution_lines

LABELS = ("reference", "exudyn")
KINDS = ("base", "finer", "perturbed", "coarser", "other_perturbed")


def compared(scene, a, b):
    return compare(a, b, scene=scene, labels=LABELS)


def moved(runs, late, parts=(1.0,) * 5, **columns):
    """Move columns of a model's runs from some time on, by a size times the part of each run."""
    for kind, part in zip(KINDS, parts, strict=True):
        frame = getattr(runs, kind).frame
        for name, by in columns.items():
            frame.loc[frame["time"] > late, name] += part * by
    return runs


# Sizes go with the errors e_a and e_b, and refining leaves a quarter of its own side's.
# The tables round at 1e-16 m of differences of 2e-10 m: 1e-6 of them.
@pytest.mark.parametrize(("e_a", "e_b"), [(3e-6, 0.0), (1e-6, -2e-6), (1e-6, 3e-5)])
def test_what_refining_either_side_or_both_leaves_of_a_difference(scene, make_runs, e_a, e_b):
    result = compared(scene, make_runs(e_a), make_runs(e_b))
    attribution = result.attribution
    assert (result.verdict, attribution.explained, attribution.outside_in) == ("agree", 1.0, "")
    left = {"a": abs(e_a / 4 - e_b), "b": abs(e_a - e_b / 4), "both": abs(e_a / 4 - e_b / 4)}
    expected = {key: pytest.approx(size / abs(e_a - e_b), rel=1e-5) for key, size in left.items()}
    assert (attribution.remaining, attribution.unpredictable) == (expected, {})


def test_the_lines_state_the_setting_its_value_and_what_was_expected_of_it(scene, make_runs):
    result = compared(scene, make_runs(1e-10, refinement=(10.0, 1.0)), make_runs(1e-6))
    assert attribution_lines(result) == [
        "100.00% of the judged samples explained",
        "left of the difference: 100.0% with reference's tolerance / 10 (1e-10; 0.1 of its own error), 25.0% "
        "with exudyn's step / 2 (2e-06 s; with its tolerance, 1e-07; 0.25 of its own error), 25.0% with both",
    ]


def test_a_difference_of_models_is_located_by_time_channel_and_contact(scene, make_runs):
    # From 14 ms on the second model moves further: the first sample then is the eighth, at 2 ms each.
    a, b = make_runs(1e-6), moved(make_runs(2e-6), 0.013, slider_x=1e-7, slider_y=1e-12)
    events = pd.DataFrame({"corner": ["ul", "ll"], "start": [0.0135, 0.1], "end": [0.0145, 0.2]})
    events = events.assign(normal_speed=0.1, impulse=0.1, peak_force=1.0, largest_depth=1e-6)
    result = compared(scene, replace(a, base=replace(a.base, events=events)), b)
    attribution = result.attribution
    assert result.verdict == "differ"
    # Of channels that part at one instant the one farthest outside is named.
    assert (attribution.outside_in, attribution.outside_from) == ("slider_x", pytest.approx(0.014))
    assert attribution_lines(result)[-1] == (
        "first outside the band: slider_x at 0.014 s (cycle 1, crank at 124°), "
        "during contact of the upper left corner"
    )
    # Errors of 1e-6 and 2e-6 of 2e-4 m beside 1e-7 m: what refinement removes is below 3/4 * 2 * 2 * 4e-10.
    assert all(abs(attribution.remaining[key] - 1) < 1.2e-2 for key in ("a", "b", "both"))
    # Of 21 channels one differs: the share that is explained counts all of them.
    assert 1 - 2 / 21 < attribution.explained < 1 - 0.9 / 21
    # Of tables without uncertainties only that instant is known.
    alone = compare(Runs(a.base), Runs(b.base), tolerance=1e-4).attribution
    assert (alone.outside_from, alone.refinements) == (pytest.approx(0.014), ())
    assert isnan(alone.explained)


def test_the_model_that_limits_the_coverage_is_named(scene, make_runs):
    # 0.2 of the clearance from half a cycle on, and not at all in the reference.
    a, b = make_runs(1e-6), moved(make_runs(1e-6), 0.2, (1.0, 0.25, 4.0, 4.0, 4.0), slider_x=2e-5)
    result = compared(scene, a, b)
    assert result.channels["slider_x"].verdict == "indeterminate"
    assert result.attribution.unpredictable == {"a": 0.0, "b": 1.0, "each": 0.0, "together": 0.0}
