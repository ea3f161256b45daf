"""Where an ensemble starts, how it widens, and what is said of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from fake_ensemble import wide

from comparison.accuracy.uncertainty import Runs, movable, perturbation
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.confirmation import (
    moved_starts,
    scaled_members,
    starting_error,
)
from comparison.words import differences
from comparison.words import verdicts as words
from comparison.words.record import as_mapping
from comparison.words.verdicts import reasons


def test_models_that_are_one_are_hardly_ever_distinguished(fake, small):
    """Bases and members drawn alike: whatever is confirmed is a false alarm, once in 100 by the ranks."""
    outcomes = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        moved = small.with_values({"initial.slider_offset": 1e-5 * (1 + seed / 100)})
        before, after = fake(wide, of=moved).confirmed(a=wide(rng), b=wide(rng))
        if before.verdict == "differ":
            outcomes.append(after.confirmation.outcome)
    assert len(outcomes) >= 15
    assert outcomes.count("confirmed") <= 1
    assert set(outcomes) <= {"confirmed", "underestimated"}


def test_starts_are_moved_by_what_the_error_is_worth_and_always_alike(make_table, small, scene):
    def moving(error: float, response: float) -> Runs:
        """A run with an error, whose perturbed runs have moved by so many times what their starts had."""
        apart = response * perturbation(scene) / scene.data["clearance"]["slider"]
        return Runs(
            make_table(),
            finer=make_table(stretch=error),
            perturbed=make_table(stretch=apart),
            other_perturbed=make_table(stretch=-apart),
        )

    c = scene.data["clearance"]["slider"]
    samples = make_table().time.size
    # x moves by c times the error at a sine's peak, as its perturbed runs do by their response: a constant
    # ratio.
    for error, response in ((1e-5, 10.0), (1e-5, 1000.0)):
        worth = starting_error(moving(error, response), scene, samples)
        # The angle's amplitude is that of x over half the length, so times the length it is twice that; its
        # response is as much larger, so that both say the same.
        assert worth.shift == pytest.approx(error * c / response, rel=1e-3)
        assert worth.share[-1] == pytest.approx(1.0, rel=1e-3)
    assert starting_error(moving(1e-12, 1000.0), scene, samples).shift == perturbation(scene)
    assert starting_error(moving(1e-5, 10.0), scene, 0).shift == perturbation(scene)
    starts = moved_starts(small, "reference", 1e-9)
    assert [s.hash for s in starts] == [s.hash for s in moved_starts(small, "reference", 1e-9)]
    offsets = np.array([s.data["initial"]["slider_offset"] for s in starts])
    angles = np.array([s.data["initial"]["slider_angle"] for s in starts])
    length = small.data["mechanism"]["slider"]["length"]
    for moved in (offsets - small.data["initial"]["slider_offset"], angles * length):
        assert moved.std() == pytest.approx(1e-9, rel=0.3)
    assert abs(np.corrcoef(offsets, angles)[0, 1]) < 0.3
    others = moved_starts(small, "exudyn", 1e-9)
    assert len({s.hash for s in (*starts, *others)}) == len(starts) + len(others) == 129
    pin = load_scene("crank-pin")
    assert movable(pin) == "crank_pin"
    assert len({s.data["mechanism"]["crank_angle_deg"] for s in moved_starts(pin, "exudyn", 1e-9)}) == 30


def test_members_deviate_by_no_more_than_the_error_that_has_arisen(make_table, scene):
    """A model that is exact until the middle of the run: until there its ensemble is as narrow as can be."""
    time = make_table().time
    late = time >= time[-1] / 2.0

    def late_table(stretch: float) -> Table:
        usual, other = make_table(), make_table(stretch=stretch)
        return replace(usual, frame=pd.concat([usual.frame[~late], other.frame[late]]))

    apart = 10.0 * perturbation(scene) / scene.data["clearance"]["slider"]
    runs = Runs(
        make_table(),
        late_table(1e-5),
        perturbed=make_table(stretch=apart),
        other_perturbed=make_table(stretch=-apart),
    )
    error = starting_error(runs, scene, time.size)
    np.testing.assert_array_equal(error.until[~late], perturbation(scene))
    assert np.all(np.diff(error.until) >= 0.0)
    assert error.share[-1] == 1.0
    far = make_table(stretch=1e-3)
    (member,) = scaled_members([far], runs.base, error.share)
    x, base, full = (table.values("slider_x") for table in (member, runs.base, far))
    np.testing.assert_allclose(x - base, (full - base) * error.share, atol=1e-15)
    np.testing.assert_array_equal(member.time, time)
    assert member.channels == runs.base.channels


def test_the_sentence_stands_on_the_console_and_in_the_json(fake):
    _, taken_back = fake(wide).confirmed(b=3e-6)
    found = taken_back.confirmation
    assert reasons(taken_back)[:2] == [
        ("reason", words.scene_reason(taken_back)),
        ("confirmation", differences.confirmation(taken_back)),
    ]
    record = as_mapping(taken_back)["confirmation"]
    assert record["outcome"] == "underestimated"
    assert record["members"] == (99, 30)
    assert record["factor"] == found.factor
    assert record["sentence"] == differences.confirmation(taken_back)
    assert as_mapping(fake(wide).confirmed()[1])["confirmation"] is None
