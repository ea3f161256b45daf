"""A difference is confirmed, left unconfirmed, or taken back as an underestimated uncertainty."""

from __future__ import annotations

import numpy as np
import pytest
from fake_ensemble import COARSE, LATE, LOCAL, MODELS, Fake, narrow, wide

from comparison.accuracy.uncertainty import Runs
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.compare import compare
from comparison.verdict.confirmation import (
    MEMBERS,
    OTHER_MEMBERS,
    confirm,
)
from comparison.verdict.results import EXIT_CODES
from comparison.words import differences as words


def test_where_models_agree_nothing_is_run(fake):
    model = fake(wide)
    before, after = model.confirmed()
    assert before.verdict == "agree"
    assert after is before
    assert model.asked == []
    assert after.confirmation is None


@pytest.mark.parametrize("size", [3.0, 300.0])
def test_a_true_difference_is_confirmed_even_a_tiny_one(fake, size):
    u = 1.25 * 10 / 9 * LOCAL / 10 * np.sqrt(2.0)  # of three levels in order, of both models
    model = fake(narrow, bias=(0.0, size * u))
    before, after = model.confirmed()
    assert before.verdict == "differ"
    assert model.asked == [("reference", MEMBERS["reference"]), ("exudyn", OTHER_MEMBERS)]
    found = after.confirmation
    assert (after.verdict, found.outcome, found.farther) == ("differ", "confirmed", (0, 0))
    assert found.members == (99, 30)
    # By construction the farthest of 99 normal draws is some 3 standard deviations out, i.e. about 2 u.
    assert found.excess > 1.0
    assert found.since == pytest.approx(LATE * 0.8, abs=0.01)
    assert words.confirmation(after).startswith("difference confirmed from 0.48")
    assert "by 99 reference and 30 exudyn runs" in words.confirmation(after)


def test_an_underestimated_uncertainty_is_taken_back_and_called_so(fake):
    before, after = fake(wide).confirmed(b=3e-6)
    assert before.verdict == "differ"
    found = after.confirmation
    assert (after.verdict, found.outcome) == ("agree", "underestimated")
    assert EXIT_CODES[after.verdict] == 0
    assert min(found.farther) > 0
    # The farthest of 99 draws over four decades is close to their end, 1e-4; u is some 2e-7.
    assert 1e-4 / 2.5e-7 / 2 < found.factor < 2 * 1e-4 / 1.5e-7
    assert found.since == pytest.approx(LATE * 0.8, abs=0.01)
    assert "no difference of models, the uncertainty was underestimated by a factor" in words.confirmation(
        after
    )
    # The corrected uncertainty is in the channels, and holds only where it was wrong.
    x, old = after.channels["slider_x"], before.channels["slider_x"]
    late = x.time > LATE * 0.8 + 0.02
    assert np.all(x.u[late] > 10 * old.u[late])
    early = x.time < LATE * 0.8 - 0.02
    np.testing.assert_array_equal(x.u[early], old.u[early])


def test_what_the_ensemble_makes_unpredictable_is_lost_and_below_the_floor_nobody_can_tell(fake):
    def draw(rng: np.random.Generator) -> float:
        return float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-6.0, 0.0))

    # Predictable at the standard tier is u <= 0.01 of scale, over at least half of the samples; errors of
    # up to 1 come late enough to leave that, or too early.
    for late, verdict in ((0.6, "agree"), (0.3, "indeterminate")):
        before, after = fake(draw, late=late).confirmed(b=1e-4)
        assert before.verdict == "differ"
        assert (after.verdict, after.confirmation.outcome) == (verdict, "underestimated")
        x = after.channels["slider_x"]
        # But where the sine passes zero, for there the error of this fake does, too.
        assert x.predictable[x.time > late * 0.8 + 0.02].mean() < 0.15
        assert x.predictable[x.time < late * 0.8 - 0.02].all()
    assert EXIT_CODES[after.verdict] == 3


def test_an_ensemble_in_clusters_names_the_contact_that_decides(fake):
    def either(rng: np.random.Generator) -> float:
        return float(rng.choice([0.0, 2e-5]) + LOCAL / 10 * rng.standard_normal())

    _, after = fake(either, extra=lambda late: late > 1e-5).confirmed(b=2e-5)
    found = after.confirmation
    assert (after.verdict, found.outcome) == ("agree", "underestimated")
    assert found.clustered
    assert found.suspicious
    assert words.parting(found).startswith("the contact of the upper left corner at 0.3 s, which occurs in ")
    assert words.parting(found) in words.confirmation(after)
    assert "indicates a discontinuous event" in words.confirmation(after)


def test_an_intermittent_fault_of_the_judged_run_is_marked_although_its_ensemble_explains_it(fake):
    """All runs but the judged one have a contact: its neighbours show that it should, too."""
    model = fake(narrow, bias=(1e-4, 1e-4), extra=lambda late: late > 5e-5)
    before, after = model.confirmed(a=-1e-4)
    assert before.verdict == "differ"
    found = after.confirmation
    assert found.outcome == "underestimated"
    assert found.suspicious
    assert (
        "the contact of the upper left corner at 0.3 s, which occurs in 99 of 100 reference runs"
        in words.confirmation(after)
    )


@pytest.mark.parametrize("count", [0, 12, 18])
def test_too_few_members_leave_the_difference_unconfirmed(fake, count):
    model = fake(narrow, bias=(0.0, 1e-3), succeed=count)
    _, after = model.confirmed()
    found = after.confirmation
    assert (after.verdict, found.outcome, found.members) == ("differ", "unconfirmed", (count, count))
    assert words.confirmation(after).startswith(f"differ (unconfirmed, {count} runs) from 0.48")
    assert EXIT_CODES[after.verdict] == 1


def test_one_large_ensemble_suffices_to_take_back_but_not_to_confirm(fake):
    class Failing(Fake):
        def run(self, starts, model):
            return super().run(starts, model)[: None if model == "reference" else 5]

    same = fake(wide)
    failing = Failing(same.signals, same.scene, wide)
    assert failing.confirmed(b=3e-6)[1].confirmation.outcome == "underestimated"
    apart = Failing(same.signals, same.scene, narrow, bias=(0.0, 1e-3))
    assert apart.confirmed()[1].confirmation.outcome == "unconfirmed"


def test_five_bodies_are_ranked_in_an_ensemble_of_the_other_model(fake):
    scene = load_scene("150rpm-0.2mm", COARSE)
    model = fake(narrow, of=scene, bias=(0.0, 1e-3))
    _, after = model.confirmed()
    assert model.asked == [("reference", 99)]
    assert (after.confirmation.outcome, after.confirmation.members) == ("confirmed", (99, 0))
    assert "the exudyn run is outside those of reference" in words.confirmation(after)
    _, taken_back = fake(wide, of=scene).confirmed(b=3e-6)
    assert (taken_back.verdict, taken_back.confirmation.outcome) == ("agree", "underestimated")


def test_without_a_start_to_move_or_with_a_tolerance_nothing_is_run(fake, make_table, scene):
    model = fake(narrow)
    a, b = Runs(make_table()), Runs(make_table(stretch=1e-2))
    judged = compare(a, b, scene=scene, tolerance=1e-4, labels=MODELS)
    assert judged.verdict == "differ"
    after = confirm(judged, (a, b), scene=scene, models=MODELS, run=model.run)
    assert after.verdict == "differ"
    assert words.confirmation(after).endswith("the verdict uses a tolerance, to which ensembles do not apply")
    still = load_scene("ideal", COARSE)
    rigid = fake(narrow, of=still, bias=(0.0, 1e-3))
    _, after = rigid.confirmed()
    assert after.verdict == "differ"
    assert "no joint has clearance" in words.confirmation(after)
    assert model.asked == rigid.asked == []


def test_runs_on_other_times_are_no_members(fake):
    class Elsewhere(Fake):
        def run(self, starts, model):
            return [Table(table.frame.iloc[::2]) for table in super().run(starts, model)]

    usual = fake(narrow)
    _, after = Elsewhere(usual.signals, usual.scene, narrow, bias=(0.0, 1e-3)).confirmed()
    assert after.confirmation.members == (0, 0)
