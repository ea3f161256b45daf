"""Where a difference comes from, on tables whose errors are known."""

from dataclasses import replace
from math import isnan

import pandas as pd
import pytest
from by_keywords import compare

from comparison.accuracy.uncertainty import Runs
from comparison.words.differences import attribution_lines
from comparison.words.record import as_mapping
from comparison.words.verdicts import reasons

LABELS = ("reference", "exudyn")
KINDS = ("base", "finer", "perturbed", "coarser", "other_perturbed")


def compared(scene, a, b, **options):
    return compare(a, b, scene=scene, labels=LABELS, **options)


def moved(runs, late, **columns):
    """Move columns of a model's runs from some time on, by a size."""
    for kind in KINDS:
        frame = getattr(runs, kind).frame
        for name, by in columns.items():
            frame.loc[frame["time"] > late, name] += by
    return runs


# Sizes go with the errors e_a and e_b, and refining leaves a quarter of its own side's.
# The tables round at 1e-16 m of differences of 2e-10 m: 1e-6 of them.
@pytest.mark.parametrize(("e_a", "e_b"), [(0.0, 1e-6), (3e-6, 0.0), (1e-6, -2e-6), (1e-6, 3e-5)])
def test_what_refining_either_side_or_both_leaves_of_a_difference(scene, make_runs, e_a, e_b):
    result = compared(scene, make_runs(e_a), make_runs(e_b))
    attribution = result.attribution
    assert (result.verdict, attribution.explained, attribution.outside_in) == ("agree", 1.0, "")
    left = {"a": abs(e_a / 4 - e_b), "b": abs(e_a - e_b / 4), "both": abs(e_a / 4 - e_b / 4)}
    expected = {key: pytest.approx(size / abs(e_a - e_b), rel=1e-5) for key, size in left.items()}
    assert attribution.remaining == expected


def test_the_lines_state_the_setting_its_value_and_what_was_expected_of_it(scene, make_runs):
    result = compared(scene, make_runs(1e-10, refinement=(10.0, 1.0)), make_runs(1e-6))
    lines = [
        "100.00% of the judged samples explained",
        "left of the difference: 100.0% with reference's tolerance / 10 (1e-10; 0.1 of its own error), 25.0% "
        "with exudyn's step / 2 (2e-06 s; with its tolerance, 1e-07; 0.25 of its own error), 25.0% with both",
    ]
    assert attribution_lines(result) == lines
    # They stand in the numbers and on the terminal.
    record = as_mapping(result)["attribution"]
    assert (record["remaining"], record["sentences"]) == (result.attribution.remaining, lines)
    assert dict(reasons(result))["why"] == "; ".join(lines)
    # Equal tables have no difference of which something could be left.
    same = compared(scene, make_runs(0.0), make_runs(0.0))
    assert attribution_lines(same) == lines[:1]


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


def test_of_foreign_tables_only_the_first_sample_outside_the_tolerance_is_reported(scene, make_table):
    a, b = Runs(make_table()), Runs(make_table(stretch=1e-3))
    result = compare(a, b, tolerance=1e-4)
    attribution = result.attribution
    assert isnan(attribution.explained)
    assert (attribution.refinements, attribution.remaining) == ((), {})
    # x grows by 1e-3 of its amplitude; the scale is its range, twice that: outside from sin(phase) > 0.2 on.
    where = f"{attribution.outside_in} at {attribution.outside_from:.4g} s"
    assert attribution_lines(result) == [f"first outside the tolerance: {where}"]
    assert attribution_lines(compare(a, b, tolerance=1.0)) == attribution_lines(compare(a, b)) == []
    (sentence,) = attribution_lines(compare(a, b, scene=scene, tolerance=1e-4))
    assert "(cycle 1, crank at " in sentence
