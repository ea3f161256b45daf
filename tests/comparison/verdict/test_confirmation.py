"""A difference is confirmed, left unconfirmed, or taken back as an underestimated uncertainty."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest
from by_keywords import compare
from fake_ensemble import COARSE, LATE, LOCAL, MODELS, Fake, narrow, wide

from comparison.accuracy.uncertainty import Runs, movable, perturbation
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.confirmation import confirm, decided, moved_starts, scaled_member, starting_error
from comparison.words import differences as words
from comparison.words.record import as_mapping
from comparison.words.verdicts import reasons, scene_reason

SINCE = pytest.approx(LATE * 0.8, abs=0.01)


def test_where_models_agree_nothing_is_run(fake):
    model = fake(wide)
    before, after = model.confirmed()
    assert (before.verdict, after, model.asked) == ("agree", before, [])
    assert as_mapping(after)["confirmation"] is None


@pytest.mark.parametrize("size", [3.0, 300.0])
def test_a_true_difference_is_confirmed_even_a_tiny_one(fake, size):
    u = 1.25 * 10 / 9 * LOCAL / 10 * np.sqrt(2.0)  # of three levels in order, of both models
    model = fake(narrow, bias=(0.0, size * u))
    before, after = model.confirmed()
    made = after.confirmation
    assert model.asked == [("reference", 99), ("exudyn", 30)]
    assert (before.verdict, after.verdict, made.outcome) == ("differ", "differ", "confirmed")
    assert (made.farther, made.members, made.since) == ((0, 0), (99, 30), SINCE)
    # By construction the farthest of 99 normal draws is some 3 standard deviations out, i.e. about 2 u.
    assert made.excess > 1.0
    assert "from 0.484 s on by 99 reference and 30 exudyn runs" in words.confirmation(after)


def test_an_underestimated_uncertainty_is_taken_back_and_called_so(fake):
    before, after = fake(wide).confirmed(b=3e-6)
    made, said = after.confirmation, words.confirmation(after)
    assert (before.verdict, after.verdict, made.outcome) == ("differ", "agree", "underestimated")
    assert (min(made.farther) > 0, made.since) == (True, SINCE)
    # The farthest of 99 draws over four decades is close to their end, 1e-4; u is some 2e-7.
    assert 1e-4 / 2.5e-7 / 2 < made.factor < 2 * 1e-4 / 1.5e-7
    assert "no difference of models, the uncertainty was underestimated by a factor" in said
    # The corrected uncertainty is in the channels, and holds only where it was wrong.
    x, old = after.channels["slider_x"], before.channels["slider_x"]
    late, early = x.time > LATE * 0.8 + 0.02, x.time < LATE * 0.8 - 0.02
    assert np.all(x.u[late] > 10 * old.u[late])
    np.testing.assert_array_equal(x.u[early], old.u[early])
    # It stands on the console and in the numbers.
    assert reasons(after)[:2] == [("reason", scene_reason(after)), ("confirmation", said)]
    record = as_mapping(after)["confirmation"]
    assert (record["outcome"], record["members"], record["sentence"]) == (made.outcome, (99, 30), said)


@pytest.mark.parametrize(("late", "verdict"), [(0.6, "agree"), (0.3, "indeterminate")])
def test_what_the_ensemble_makes_unpredictable_is_lost_and_below_the_floor_nobody_can_tell(
    fake, late, verdict
):
    """Predictable is u <= 0.01 of scale, over half of the samples: errors of up to 1 leave that, or not."""
    draws = fake(lambda rng: float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-6.0, 0.0)), late=late)
    before, after = draws.confirmed(b=1e-4)
    assert before.verdict == "differ"
    assert (after.verdict, after.confirmation.outcome) == (verdict, "underestimated")
    x = after.channels["slider_x"]
    # But where the sine passes zero, for there the error of this fake does, too.
    assert x.predictable[x.time > late * 0.8 + 0.02].mean() < 0.15
    assert x.predictable[x.time < late * 0.8 - 0.02].all()


def test_an_ensemble_that_spreads_much_farther_than_u_is_suspicious(fake):
    """All runs but the judged one have a contact: its neighbours show that it should, too."""
    model = fake(narrow, bias=(1e-4, 1e-4), extra=lambda late: late > 5e-5)
    _, after = model.confirmed(a=-1e-4)
    assert (after.confirmation.outcome, after.confirmation.suspicious) == ("underestimated", True)
    assert "a factor above 10 indicates a discontinuous event" in words.confirmation(after)


def test_too_few_members_leave_the_difference_unconfirmed_and_one_large_ensemble_takes_it_back(fake):
    _, after = fake(narrow, bias=(0.0, 1e-3), succeed=18).confirmed()
    made = after.confirmation
    assert (after.verdict, made.outcome, made.members) == ("differ", "unconfirmed", (18, 18))
    assert words.confirmation(after).startswith("differ (unconfirmed, 18 runs) from 0.484 s on: ")

    class Failing(Fake):
        def run(self, starts, model):
            tables = super().run(starts, model)
            # A third model may choose its times: such runs are no members.
            return tables if model == "reference" else [*tables[:5], Table(tables[5].frame.iloc[::2])]

    same = fake(wide)
    taken_back = Failing(same.signals, same.scene, wide).confirmed(b=3e-6)[1].confirmation
    assert (taken_back.outcome, taken_back.members) == ("underestimated", (99, 5))
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
    after = confirm(judged, (a, b), scene=scene, models=MODELS, run=model.run)
    assert words.confirmation(after).endswith("the verdict uses a tolerance, to which ensembles do not apply")
    rigid = fake(narrow, of=load_scene("ideal", COARSE), bias=(0.0, 1e-3))
    _, after = rigid.confirmed()
    assert (after.verdict, "no joint has clearance" in words.confirmation(after)) == ("differ", True)
    assert model.asked == rigid.asked == []


def test_models_that_are_one_are_hardly_ever_distinguished(fake):
    """Bases and members drawn alike: whatever is confirmed is a false alarm, once in 31 by either rank."""
    outcomes, whole, names = [], fake(wide), ["slider_x", "slider_vx"]

    def two_channels(*arguments):
        columns = whole.signals(*arguments)
        return {name: columns[name] for name in ("time", *names)}

    model = replace(whole, signals=two_channels)
    for seed in range(25):
        rng = np.random.default_rng(seed)
        runs = model.family(0, wide(rng)), model.family(1, wide(rng))
        judge = partial(compare, *runs, scene=model.scene, labels=MODELS, only=names)
        if (before := judge()).verdict == "differ":
            ensembles = {side: [model.table(wide(rng)) for _ in range(30)] for side in (0, 1)}
            after = decided(before, runs, ensembles, lambda large, judge=judge: judge(ensembles=large))
            outcomes.append(after.confirmation.outcome)
    assert len(outcomes) >= 15
    assert outcomes.count("confirmed") <= 1
    assert set(outcomes) <= {"confirmed", "underestimated"}


def test_the_excess_is_the_distance_of_the_nearer_run_over_that_of_the_farthest_member(fake):
    """Recomputed from the errors alone, which all channels have in common."""
    model, rng = fake(wide), np.random.default_rng(3)
    bases, spreads = (0.0, 1e-2), (1e-4, 2e-4)
    errors = [base + spread * rng.standard_normal(20) for base, spread in zip(bases, spreads, strict=True)]
    runs = model.family(0, bases[0]), model.family(1, bases[1])
    judge = partial(compare, *runs, scene=model.scene, labels=MODELS)
    ensembles = {side: [model.table(error) for error in own] for side, own in enumerate(errors)}
    after = decided(judge(), runs, ensembles, lambda large: judge(ensembles=large)).confirmation

    def distance(value, others):
        return abs(value - others.mean()) / others.std()

    excess = [
        distance(run, own) / max(distance(own[n], np.delete(own, n)) for n in range(own.size))
        for run, own in zip(bases[::-1], errors, strict=True)
    ]
    assert (after.outcome, after.excess) == ("confirmed", pytest.approx(min(excess), rel=1e-4))


# Starts


def test_starts_are_moved_by_what_the_error_is_worth_and_always_alike(make_table, small, scene):
    clearance, samples = scene.data["clearance"]["slider"], make_table().time.size

    def worth(error, response, before=samples):
        """Of a run with an error, whose perturbed runs have moved by so many times what their starts had."""
        apart = response * perturbation(scene) / clearance
        base, finer, one, other = (make_table(stretch=size) for size in (0.0, error, apart, -apart))
        return starting_error(Runs(base, finer, one, other_perturbed=other), scene, before)

    # x moves by the clearance times the error at a sine's peak, as its perturbed runs do by their response: a
    # constant ratio. The angle times the length is twice that, and its response as well.
    for response in (10.0, 1000.0):
        shift, until = worth(1e-5, response)
        assert shift == pytest.approx(1e-5 * clearance / response, rel=1e-3)
        assert min(until[-1] / shift, 1.0) == pytest.approx(1.0, rel=1e-3)
    assert worth(1e-12, 1000.0)[0] == worth(1e-5, 10.0, 0)[0] == perturbation(scene)
    starts, others = (moved_starts(small, model, 1e-9) for model in MODELS)
    assert [s.hash for s in starts] == [s.hash for s in moved_starts(small, "reference", 1e-9)]
    assert len({s.hash for s in (*starts, *others)}) == 129
    offsets, angles = (
        np.array([s.data["initial"][key] for s in starts]) for key in ("slider_offset", "slider_angle")
    )
    length = small.data["mechanism"]["slider"]["length"]
    for moved in (offsets - small.data["initial"]["slider_offset"], angles * length):
        assert moved.std() == pytest.approx(1e-9, rel=0.3)
    assert abs(np.corrcoef(offsets, angles)[0, 1]) < 0.3
    pin = load_scene("crank-pin")
    assert movable(pin) == "crank_pin"
    assert len({s.data["mechanism"]["crank_angle_deg"] for s in moved_starts(pin, "exudyn", 1e-9)}) == 30


def test_members_deviate_by_no_more_than_the_error_that_has_arisen(make_table, scene):
    """A model that is exact until the middle of the run: until there its ensemble is as narrow as can be."""
    base, far = make_table(), make_table(stretch=1e-3)
    late = base.time >= base.time[-1] / 2.0
    erring = replace(base, frame=pd.concat([base.frame[~late], make_table(stretch=1e-5).frame[late]]))
    apart = 10.0 * perturbation(scene) / scene.data["clearance"]["slider"]
    one, other = make_table(stretch=apart), make_table(stretch=-apart)
    shift, until = starting_error(Runs(base, erring, one, other_perturbed=other), scene, base.time.size)
    np.testing.assert_array_equal(until[~late], perturbation(scene))
    assert np.all(np.diff(until) >= 0.0)
    share = np.minimum(until / shift, 1.0)
    assert share[-1] == 1.0
    x, of_base, full = (table.values("slider_x") for table in (scaled_member(far, base, share), base, far))
    np.testing.assert_allclose(x - of_base, (full - of_base) * share, atol=1e-15)
